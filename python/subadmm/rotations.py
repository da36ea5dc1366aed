"""Unit quaternions w x y z, of any number at once."""
import numpy as np


def multiply(a, b):
    """The product: first b, then a. ... x 4 each."""
    a, b = np.asarray(a), np.asarray(b)
    w = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([w, v], axis=-1)


def rotate(q, v):
    """Vectors (... x 3) turned by q (... x 4)."""
    q, v = np.asarray(q), np.asarray(v)
    axis = q[..., 1:]
    across = 2 * np.cross(axis, v)
    return v + q[..., :1] * across + np.cross(axis, across)
