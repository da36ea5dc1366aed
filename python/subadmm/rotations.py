"""Unit quaternions w x y z, of any number at once, as arrays of numpy or tensors of torch."""
import numpy as np

from .namespace import namespace_of


def _all(*given):
    """The namespace, and what was given as its arrays."""
    xp = namespace_of(*given)
    return (xp, *(xp.array(x) for x in given))


def _doubles(given):
    xp = namespace_of(given)
    return xp, xp.asarray(given, dtype=xp.float64)


def multiply(a, b):
    """The product: first b, then a. ... x 4 each."""
    xp, a, b = _all(a, b)
    w = a[..., :1] * b[..., :1] - xp.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + xp.cross(a[..., 1:], b[..., 1:])
    return xp.concatenate([w, v], axis=-1)


def rotate(q, v):
    """Vectors (... x 3) turned by q (... x 4)."""
    xp, q, v = _all(q, v)
    axis = q[..., 1:]
    across = 2 * xp.cross(axis, v)
    return v + q[..., :1] * across + xp.cross(axis, across)


def conjugate(q):
    """The turn back."""
    xp, q = _all(q)
    return xp.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def unit(q):
    """Of length 1."""
    xp, q = _doubles(q)
    return q / xp.norm(q)


def of_vector(v):
    """Of rotation vectors (... x 3), rad."""
    xp, v = _doubles(v)
    half = xp.norm(v) / 2
    return xp.concatenate([xp.cos(half), xp.sinc(half / np.pi) / 2 * v], axis=-1)


def to_vector(q):
    """Rotation vectors (... x 3), of at most pi."""
    xp, q = _doubles(q)
    q = xp.where(q[..., :1] < 0, -q, q)
    sine = xp.norm(q[..., 1:])
    return 2 * xp.arctan2(sine, q[..., :1]) / xp.clip(sine, 1e-300, None) * q[..., 1:]
