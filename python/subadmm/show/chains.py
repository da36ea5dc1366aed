"""Driven joints of a world by the chains they make, as fingers of a hand, and poses that close such fingers."""
from dataclasses import dataclass

import numpy as np

from ..rotations import multiply, rotate

#: A chain with one of these words in its bodies' names is a finger, and can be closed.
FINGERS = ("finger", "thumb")
_REACH = 1e-4   # m, of the tip: nearer than that is there
_DAMPING = 0.02  # of the least squares, as a share of the tip's lever: bends of straight fingers stay finite


@dataclass
class Driven:
    """A coordinate with a position drive: `coordinate` of `joint`, row `row` of the world's joints."""
    joint: object
    row: int
    coordinate: int
    name: str       # of the body it moves
    lower: float    # m or rad, of its slider
    upper: float

    @property
    def is_angle(self):
        return self.coordinate >= 3


@dataclass
class Chain:
    """Driven coordinates from a body that has several such chains, or none before it, to the last body."""
    name: str
    joints: list    # of Driven
    base: int       # row of the body that the chain is on; -1: the world
    tip: int        # row of the last body

    @property
    def is_finger(self):
        return any(word in joint.name.lower() for joint in self.joints for word in FINGERS)


def _bodies_of(joint):
    return [-1 if body is None else body.index for body in (joint.body_a, joint.body_b)]


def _common(names):
    """The words that all names begin with; of one name, or where there are none, the first name."""
    words = [name.replace("_", " ").split() for name in names]
    first = words[0]
    for count in range(len(first), 0, -1):
        if all(other[:count] == first[:count] for other in words):
            return " ".join(first[:count])
    return " ".join(first)


def driven_chains(world):
    """All coordinates with a position drive, as a list of Chain; in the order of the joints."""
    driven, below = {}, {}
    bodies = world.bodies
    for row, joint in enumerate(world.joints):
        a, b = _bodies_of(joint)
        for k in range(6):
            if joint.locks >> k & 1:
                continue
            law = joint.coordinate(k)
            if law.drive != "position" or law.drive_stiffness <= 0:
                continue
            wide = np.pi if k >= 3 else 0.5
            lower, upper = (law.lower, law.upper) if law.limited else (-np.inf, np.inf)
            lower = lower if np.isfinite(lower) else law.target_position - wide
            upper = upper if np.isfinite(upper) else law.target_position + wide
            name = bodies[b].name if b >= 0 else bodies[a].name
            driven.setdefault(row, []).append(Driven(joint, row, k, name, min(lower, law.target_position),
                                                     max(upper, law.target_position)))
        if row in driven:
            below.setdefault(a, []).append((row, b))
    chains, done = [], set()
    for row in driven:
        a = _bodies_of(driven[row][0].joint)[0]
        alone = len(below.get(a, ())) == 1 and any(b == a for joints in below.values() for _, b in joints)
        if row in done or alone:
            continue
        own, at = [], row
        while at is not None and at not in done:  # down to where the chain ends or parts
            done.add(at)
            own += driven[at]
            tip = _bodies_of(driven[at][0].joint)[1]
            next_ = below.get(tip, ())
            at = next_[0][0] if len(next_) == 1 else None
        chains.append(Chain(_common([joint.name for joint in own]) or f"joint {row}", own, a, tip))
    rest = [joint for row in driven if row not in done for joint in driven[row]]  # of a closed ring
    if rest:
        chains.append(Chain("joints", rest, -1, -1))
    return chains


# ---- closing ---------------------------------------------------------------------------------------------------------


def _axes(joint):
    """(point, turn of a's frame) on body a, and the inverse of b's frame: as the joint has them."""
    (pa, qa), (pb, qb) = joint.frame_a, joint.frame_b
    back = np.array(qb) * [1, -1, -1, -1]
    return np.array(pa), np.array(qa), -rotate(back, np.array(pb)), back


class Finger:
    """A chain whose joints turn or slide along one axis each, from a body at rest: where its tip is for given
    coordinates, all in the frame of the body that it is on."""

    def __init__(self, chain):
        self.chain = chain
        self.frames = [_axes(joint.joint) for joint in chain.joints]

    @staticmethod
    def fits(chain):
        """Is it one? (One free coordinate a joint, each on the body of the last one.)"""
        bodies = [_bodies_of(joint.joint) for joint in chain.joints]
        single = all(bin(joint.joint.locks).count("1") == 5 for joint in chain.joints)
        return single and bodies[0][0] == chain.base and all(a[1] == b[0] for a, b in zip(bodies, bodies[1:]))

    def at(self, values):
        """(position, orientation) of the last body, and of each joint (point, axis)."""
        place, turn, joints = np.zeros(3), np.array([1.0, 0, 0, 0]), []
        for joint, value, (pa, qa, pb, qb) in zip(self.chain.joints, values, self.frames):
            place, turn = place + rotate(turn, pa), multiply(turn, qa)
            axis = np.eye(3)[joint.coordinate % 3]
            joints.append((place, rotate(turn, axis)))
            if joint.is_angle:
                turn = multiply(turn, np.concatenate([[np.cos(value / 2)], np.sin(value / 2) * axis]))
            else:
                place = place + rotate(turn, value * axis)
            place, turn = place + rotate(turn, pb), multiply(turn, qb)
        return place, turn, joints

    def reach(self, values, way):
        """Coordinates near `values` that bring the tip on by `way` (m, 3) and leave it turned as it is, as well as
        they can within their sliders' ends: damped least squares, step by step."""
        values = np.array(values, float)
        goal, turn, _ = self.at(values)
        goal = goal + way
        low = np.array([joint.lower for joint in self.chain.joints])
        high = np.array([joint.upper for joint in self.chain.joints])
        for _ in range(30):
            place, now, joints = self.at(values)
            size = max(max(np.linalg.norm(place - point) for point, _ in joints), 1e-6)
            turned = multiply(turn, now * [1, -1, -1, -1])
            residual = np.concatenate([goal - place, 2 * size * np.copysign(1, turned[0]) * turned[1:]])
            if np.linalg.norm(residual) < _REACH * size:
                break
            columns = [np.concatenate([np.cross(axis, place - point), size * axis]) if joint.is_angle
                       else np.concatenate([axis, np.zeros(3)])
                       for joint, (point, axis) in zip(self.chain.joints, joints)]
            matrix = np.array(columns).T
            square = matrix.T @ matrix + (_DAMPING * size) ** 2 * np.eye(len(values))
            values = np.clip(values + np.linalg.solve(square, matrix.T @ residual), low, high)
        return values


def opposing_thumb(tips):
    """Which of several points (n x 3) is farthest from the mean of the others."""
    return int(np.argmax([np.linalg.norm(np.delete(tips, k, axis=0).mean(axis=0) - tip) for k, tip in enumerate(tips)]))


def opposing(fingers, values):
    """For each of several fingers on one body the direction (unit, its frame) that closes it: towards the others for
    the thumb, the one that is farthest from them; against that for the rest."""
    tips = np.array([finger.at(own)[0] for finger, own in zip(fingers, values)])
    thumb = opposing_thumb(tips)
    across = np.delete(tips, thumb, axis=0).mean(axis=0) - tips[thumb]
    across /= max(np.linalg.norm(across), 1e-12)
    return [across if k == thumb else -across for k in range(len(tips))]
