"""Several joints of one body, as few joints of the world as they fit in.

MuJoCo turns and moves a body by its joints in their order, each where those before have brought it. A run of them is
one joint here if it is slides along axes at right angles and then a ball, a hinge or two hinges at a right angle
about one point, or a hinge and a slide along one line. What is more goes on behind a carrier."""

from typing import NamedTuple

import numpy as np

from .poses import q_of_matrix

KINDS = {  # free coordinates: name of the joint
    (5,): "revolute",
    (2,): "prismatic",
    (2, 5): "cylindrical",
    (3, 4, 5): "spherical",
    (3, 4): "universal",
    (0, 1, 5): "planar",
    (0, 1, 2): "cartesian",
}


class Fit(NamedTuple):
    """A joint of the world for a run of joints of the file."""

    joints: list  # their indices
    turn: np.ndarray  # the joint's frame to the body's, w x y z
    point: np.ndarray  # in the body's frame, m
    places: list  # (coordinate, sign) of each
    kind: str
    locks: int


def _frame(z, x=None):
    """Axes of a right-handed frame with this z, and x if given (at a right angle to z)."""
    z = z / np.linalg.norm(z)
    if x is None:
        x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _square(a, b):
    return abs(a @ b) < 1e-9


def _parallel(a, b):
    return abs(abs(a @ b) - 1) < 1e-12 and np.linalg.norm(np.cross(a, b)) < 1e-9


def fit(source, joints):
    """A Fit for all of `joints`, or None."""
    import mujoco

    kinds = mujoco.mjtJoint
    of = [kinds(int(source.jnt_type[j])) for j in joints]
    axis = [np.array(source.jnt_axis[j]) / np.linalg.norm(source.jnt_axis[j]) for j in joints]
    slides = [k for k, kind in enumerate(of) if kind == kinds.mjJNT_SLIDE]
    turns = [k for k, kind in enumerate(of) if kind != kinds.mjJNT_SLIDE]
    ball = any(of[k] == kinds.mjJNT_BALL for k in turns)
    screw = len(of) == 2 and len(slides) == 1 and not ball and _parallel(axis[0], axis[1])
    if slides and turns and max(slides) > min(turns) and not screw:
        return None
    if len(turns) > (1 if ball else 2):
        return None
    if any(not _square(axis[a], axis[b]) for a in slides for b in slides if a < b):
        return None
    if len(turns) == 2:
        first, second = turns
        apart = np.linalg.norm(source.jnt_pos[joints[first]] - source.jnt_pos[joints[second]])
        if not _square(axis[first], axis[second]) or apart > 1e-12:
            return None
        frame = _frame(np.cross(axis[first], axis[second]), axis[first])
    elif len(turns) == 1 and not ball:
        beside = [axis[k] for k in slides if not _parallel(axis[k], axis[turns[0]])]
        if any(not _square(x, axis[turns[0]]) for x in beside):
            return None
        frame = _frame(axis[turns[0]], beside[0] if beside else None)
    elif len(slides) == 1 and not ball:
        frame = _frame(axis[0])
    elif slides:
        frame = _frame(np.cross(axis[0], axis[1]) if len(slides) > 1 else axis[0], axis[0] if len(slides) > 1 else None)
    else:
        frame = np.eye(3)
    places = []
    for k in range(len(joints)):
        if k in slides:
            along = frame.T @ axis[k]
            place = int(np.argmax(np.abs(along)))
            if abs(abs(along[place]) - 1) > 1e-9:
                return None
            places.append((place, float(np.sign(along[place]))))
        elif ball:
            places.append((3, 1.0))
        else:
            places.append((5 if len(turns) == 1 else 3 + turns.index(k), 1.0))
    free = tuple(sorted({c for c, _ in places} | ({3, 4, 5} if ball else set())))
    locks = 63 & ~sum(1 << c for c in free)
    point = np.array(source.jnt_pos[joints[turns[0] if turns else 0]])
    return Fit(list(joints), q_of_matrix(frame), point, places, KINDS.get(free, "custom"), locks)


def runs(source, joints):
    """The joints of a body, in their order, as a list of Fit: each as long as it fits."""
    out, begin = [], 0
    while begin < len(joints):
        end = len(joints)
        while (one := fit(source, joints[begin:end])) is None:
            end -= 1
        out.append(one)
        begin = end
    return out
