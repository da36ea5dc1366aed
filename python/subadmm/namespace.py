"""One code for arrays of numpy and tensors of torch: what it needs of the one whose arrays it has.

Functions that both have under one name and with the same arguments are that library's own."""

import functools
import sys

import numpy as np


class _Numpy:
    """Arrays of numpy."""

    device = None

    def __getattr__(self, name):
        return getattr(np, name)

    @staticmethod
    def array(given):
        """Of an array of either or a list, of its type, and not of a graph for gradients; itself where it can be."""
        return np.asarray(to_numpy(given))

    @staticmethod
    def copy(given):
        """Of float64."""
        return np.array(to_numpy(given), np.float64)

    @staticmethod
    def full(shape, value):
        return np.full(shape, value, np.float64)

    @staticmethod
    def zeros(shape):
        return np.zeros(shape)

    @staticmethod
    def norm(x):
        """Of the last axis, which stays."""
        return np.linalg.norm(x, axis=-1, keepdims=True)


class _Torch:
    """Tensors of torch on one device."""

    def __init__(self, torch, device):
        self._torch, self.device = torch, device

    def __getattr__(self, name):
        return getattr(self._torch, name)

    def array(self, given):
        if not isinstance(given, self._torch.Tensor):
            given = np.array(given)  # torch takes none that is not to be written to
        return self._torch.as_tensor(given, device=self.device).detach()

    def copy(self, given):
        return self._torch.asarray(self.array(given), dtype=self._torch.float64, copy=True)

    def full(self, shape, value):
        return self._torch.full(shape if isinstance(shape, tuple) else (shape,), value, dtype=self._torch.float64,
                                device=self.device)

    def zeros(self, shape):
        return self.full(shape, 0.0)

    def norm(self, x):
        return self._torch.linalg.norm(x, axis=-1, keepdims=True)

    def cross(self, a, b):
        return self._torch.linalg.cross(*self._torch.broadcast_tensors(a, b))


NUMPY = _Numpy()


def torch_with_cuda():
    """The module torch, for arrays on a CUDA device; or an error that says what to install."""
    try:
        import torch
    except ImportError as error:
        raise ImportError("arrays of environments on CUDA are tensors of torch: python -m pip install torch") from error
    if not torch.cuda.is_available():
        raise ImportError("arrays of environments on CUDA are tensors of torch, and this torch has no CUDA device: install "
                          "one that has (https://pytorch.org)")
    return torch


def is_tensor(given):
    """Is it torch's?"""
    return isinstance(given, getattr(sys.modules.get("torch"), "Tensor", ()))


@functools.cache
def of_torch(device):
    """The namespace of tensors on a device, of torch or by name."""
    import torch

    return _Torch(torch, torch.device(device))


def namespace_of(*arrays):
    """That of the first tensor; NUMPY where none is one."""
    for array in arrays:
        if is_tensor(array):
            return of_torch(array.device)
    return NUMPY


def to_numpy(given):
    """A tensor as an array of numpy; anything else as it is."""
    return given.detach().cpu().numpy() if is_tensor(given) else given
