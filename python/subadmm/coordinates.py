"""Positions and velocities of a loaded robot in MuJoCo's order, and the arrays of its world that have them."""
import numpy as np

from .rotations import conjugate, multiply, of_vector, rotate, to_vector, unit


class _Free:
    """A joint of type 'free': where its numbers are, and the bodies that move with it. own: its frame in `xp`."""

    def __init__(self, joint, q, qd, rows, ties, xp):
        self.q, self.qd = slice(q, q + 7), slice(qd, qd + 6)
        self.body = rows[joint.body]
        self.place, self.turn = joint._frame
        self.own = xp.array(self.place), xp.array(self.turn)
        self.tree = _joined(self.body, ties)


def _joined(body, ties):
    """Bodies that joints tie to one, that one first."""
    found, at = [body], 0
    while at < len(found):
        found += sorted({b for pair in ties if found[at] in pair for b in pair} - set(found))
        at += 1
    return np.array(found)


class Coordinates:
    """Where MuJoCo's numbers (qpos, qvel) are in the arrays of a world, for any number of such worlds at once. joints:
    (LoadedJoint, its place in qpos, in qvel), in the file's order; nq, nv: how many numbers; xp: the namespace."""

    def __init__(self, world, joints, nq, nv, xp):
        self.xp, self.nq, self.nv = xp, nq, nv
        rows = {body: k for k, body in enumerate(world.bodies)}
        row_of = {joint: k for k, joint in enumerate(world.joints)}
        own = {joint.joint for joint, _, _ in joints if joint.joint is not None}  # no loops
        ties = [(rows[j.body_a], rows[j.body_b]) for j in own if j.body_a is not None and j.body_b is not None]
        dynamic = {rows[body] for body in rows if body.type == "dynamic"}
        ties = [pair for pair in ties if dynamic.issuperset(pair)]
        self.free, self.balls, hinges = [], [], []
        for joint, q, qd in joints:
            if joint.type == "free":
                self.free.append(_Free(joint, q, qd, rows, ties, xp))
            elif joint.type == "ball":
                self.balls.append((slice(q, q + 4), slice(qd, qd + 3), row_of[joint.joint], joint._turn,
                                   xp.array(joint._turn)))
            else:
                hinges.append((q, qd, row_of[joint.joint], joint.coordinate, joint.sign, joint.offset))
        self.hinges = [np.array(column) for column in zip(*hinges)] if hinges else [np.zeros(0, int)] * 6
        self.own_hinges = [xp.array(column) for column in self.hinges]

    def q(self, state, position):
        """n x nq, of body_state and joint_position (n x rows x columns)."""
        xp = self.xp
        out = xp.zeros((len(state), self.nq))
        q, _, row, coordinate, sign, offset = self.own_hinges
        out[:, q] = sign * position[:, row, coordinate] + offset
        for at, _, row, _, turn in self.balls:
            out[:, at] = of_vector(rotate(turn, position[:, row, 3:]))
        for free in self.free:
            turned = state[:, free.body, 3:7]
            place, turn = free.own
            out[:, free.q] = xp.concatenate(
                [state[:, free.body, :3] + rotate(turned, place), multiply(turned, turn)], -1
            )
        return out

    def qd(self, state, position, speed):
        """n x nv, of body_state, joint_position and joint_speed."""
        xp = self.xp
        out = xp.zeros((len(state), self.nv))
        _, qd, row, coordinate, sign, _ = self.own_hinges
        out[:, qd] = sign * speed[:, row, coordinate]
        for _, at, row, _, turn in self.balls:
            file = of_vector(rotate(turn, position[:, row, 3:]))
            out[:, at] = rotate(conjugate(file), rotate(turn, speed[:, row, 3:]))
        for free in self.free:
            body = state[:, free.body]
            turned, linear, angular = body[:, 3:7], body[:, 7:10], body[:, 10:]
            place, turn = free.own
            linear = linear + xp.cross(angular, rotate(turned, place))
            out[:, free.qd] = xp.concatenate([linear, rotate(conjugate(multiply(turned, turn)), angular)], -1)
        return out

    def check_turns(self, q):
        """ValueError where a quaternion of q (n x nq) is 0."""
        for at in [free.q.start + 3 for free in self.free] + [ball[0].start for ball in self.balls]:
            if len(q) and not (np.linalg.norm(q[:, at : at + 4], axis=1) > 1e-6).all():
                raise ValueError(f"q: numbers {at} to {at + 3} are a quaternion, and must not be 0")

    def place(self, get, set, q, qd):
        """Put what get(name) reads and set(name, values) sets (n x rows x columns, of numpy) to positions and velocities
        (n x nq, n x nv). What is joined to a free joint's body moves with it."""
        position, speed = get("joint_position"), get("joint_speed")
        at, of, row, coordinate, sign, offset = self.hinges
        position[:, row, coordinate] = sign * (q[:, at] - offset)
        speed[:, row, coordinate] = sign * qd[:, of]
        for at, of, row, turn, _ in self.balls:
            file = unit(q[:, at])
            position[:, row, 3:] = rotate(conjugate(turn), to_vector(file))
            speed[:, row, 3:] = rotate(conjugate(turn), rotate(file, qd[:, of]))
        if position.shape[1]:
            set("joint_position", position)
            set("joint_speed", speed)
        state = get("body_state")
        for free in self.free:
            self._move(state, free, q[:, free.q], qd[:, free.qd])
        if self.free:
            set("body_state", state)

    @staticmethod
    def _move(state, free, q, qd):
        """What is joined to a free joint's body moves with it, as a rigid body."""
        old = state[:, free.body].copy()
        turned = unit(q[:, 3:])
        orientation = multiply(turned, conjugate(free.turn))
        center = q[:, :3] - rotate(orientation, free.place)
        angular = rotate(turned, qd[:, 3:])
        linear = qd[:, :3] - np.cross(angular, q[:, :3] - center)
        turn = multiply(orientation, conjugate(old[:, 3:7]))[:, None]
        tree = state[:, free.tree]
        arm = tree[..., :3] - old[:, None, :3]
        relative = tree[..., 7:10] - old[:, None, 7:10] - np.cross(old[:, None, 10:], arm)
        spin = tree[..., 10:] - old[:, None, 10:]
        arm = rotate(turn, arm)
        tree[..., :3] = center[:, None] + arm
        tree[..., 3:7] = unit(multiply(turn, tree[..., 3:7]))
        tree[..., 7:10] = linear[:, None] + np.cross(angular[:, None], arm) + rotate(turn, relative)
        tree[..., 10:] = angular[:, None] + rotate(turn, spin)
        state[:, free.tree] = tree
