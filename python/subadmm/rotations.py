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


def conjugate(q):
    """The turn back."""
    return np.asarray(q) * np.array([1.0, -1, -1, -1])


def unit(q):
    """Of length 1."""
    q = np.asarray(q, np.float64)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def of_vector(v):
    """Of rotation vectors (... x 3), rad."""
    v = np.asarray(v, np.float64)
    half = np.linalg.norm(v, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) / 2 * v], axis=-1)


def to_vector(q):
    """Rotation vectors (... x 3), of at most pi."""
    q = np.asarray(q, np.float64)
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    return 2 * np.arctan2(sine, q[..., :1]) / np.maximum(sine, 1e-300) * q[..., 1:]
