"""A wheel between two coordinates that one gear cannot tie: their axes are parallel in one place, or they are slides in
the same direction, on a body that moves (gear.h). The wheel is a small body on a hinge of that body, with a gear to
each of the two."""

import numpy as np

from .poses import mul, pose, q_matrix, q_of_matrix

#: Mass of the wheel as a share of the lighter of the two bodies, and its moment of theirs.
SHARE = 1e-3


def _place(joint, coordinate):
    """Where the joint is, and the axis of its coordinate, in the world."""
    body, (at, turn) = joint.body_a, joint.frame_a
    if body is not None:
        at, turn = mul(pose(body.position, body.orientation), pose(at, turn))
    return np.asarray(at), q_matrix(turn)[:, coordinate % 3]


def _frame_with(z):
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    return q_of_matrix(np.column_stack([x, np.cross(z, x), z]))


def _velocity_at(body, point):
    return body.linear_velocity + np.cross(body.angular_velocity, point - np.asarray(body.position))


def tie_by_wheel(world, one, first, other, second, ratio, offset, enabled):
    """q_first + ratio q_second = offset by two gears; returns them and the wheel. ValueError where the joints share
    no body."""
    shared = [b for b in (one.body_a, one.body_b) if b is not None and b in (other.body_a, other.body_b)]
    if not shared:
        raise ValueError("the joints have no body in common")
    carrier = shared[0]
    outer = [b for joint in (one, other) for b in (joint.body_a, joint.body_b) if b is not None and b != carrier]
    (at, axis), (beside, _) = _place(one, first), _place(other, second)
    width = np.linalg.norm(beside - at) + np.sqrt(max(carrier.inertia) / carrier.mass)
    middle = (at + beside) / 2
    mass = SHARE * min(b.mass for b in outer)
    if first < 3:  # a pinion on two racks: its axle across them
        radius = width / 2
        turn = _frame_with(axis)
        turn = q_of_matrix(q_matrix(turn) @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))
        moment = mass * radius**2
    else:  # a wheel beside two others
        radius = 1.0
        turn = _frame_with(axis)
        middle = middle + width * q_matrix(turn)[:, 0]
        moment = SHARE * min(min(b.inertia) for b in outer)
    wheel = world.add_body(mass=mass, inertia=(moment,) * 3, position=middle, name="wheel",
                           linear_velocity=_velocity_at(carrier, middle), angular_velocity=carrier.angular_velocity)
    axle = world.add_joint("revolute", carrier, wheel, position=middle, orientation=turn)
    begin = one.position[first]
    gears = [
        world.add_gear(one, first, axle, 5, ratio=radius, offset=float(begin), enabled=enabled),
        world.add_gear(other, second, axle, 5, ratio=-radius / ratio, offset=float((offset - begin) / ratio),
                       enabled=enabled),
    ]
    return gears, wheel
