"""Poses as pairs (position, m; unit quaternion w x y z)."""

import numpy as np

IDENTITY = (np.zeros(3), np.array([1.0, 0, 0, 0]))


def q_mul(a, b):
    """Turn by b, then by a."""
    (w, x, y, z), (s, i, j, k) = a, b
    return np.array(
        [
            w * s - x * i - y * j - z * k,
            w * i + x * s + y * k - z * j,
            w * j - x * k + y * s + z * i,
            w * k + x * j - y * i + z * s,
        ]
    )


def q_conjugate(q):
    return np.array([q[0], -q[1], -q[2], -q[3]])


def q_unit(q):
    q = np.array(q, dtype=np.float64)
    return q / np.linalg.norm(q)


def q_matrix(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def q_turn(q, v):
    return q_matrix(q) @ np.asarray(v, dtype=np.float64)


def q_about(axis, angle):
    """Turn about a unit axis by an angle, rad."""
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * np.asarray(axis, dtype=np.float64)])


def q_of_vector(v):
    """Of a rotation vector, rad."""
    angle = np.linalg.norm(v)
    return q_about(np.asarray(v) / angle, angle) if angle > 0 else IDENTITY[1].copy()


def q_of_matrix(m):
    """Of a rotation matrix, by the largest of the four ways to take the root."""
    t = np.array([m[0, 0] + m[1, 1] + m[2, 2], m[0, 0], m[1, 1], m[2, 2]])
    k = int(np.argmax(t))
    if k == 0:
        q = [1 + t[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
    elif k == 1:
        q = [m[2, 1] - m[1, 2], 1 + 2 * t[1] - t[0], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]]
    elif k == 2:
        q = [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 + 2 * t[2] - t[0], m[1, 2] + m[2, 1]]
    else:
        q = [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 + 2 * t[3] - t[0]]
    return q_unit(q)


def pose(position, orientation):
    return np.array(position, dtype=np.float64), q_unit(orientation)


def mul(a, b):
    """b, given in a's frame, in the frame that a is given in."""
    return a[0] + q_turn(a[1], b[0]), q_unit(q_mul(a[1], b[1]))


def inverse(a):
    back = q_conjugate(a[1])
    return -q_turn(back, a[0]), back
