"""Many copies of a world, stepped together."""
from __future__ import annotations


import functools
from typing import Any
import warnings

import numpy as np

from . import _core
from .given import whole
from .namespace import NUMPY, of_torch, to_numpy, torch_with_cuda


class Environments:
    """Copies of a World, numbered from 0 to count - 1.

    Arrays are those of World.get with one dimension more: environments x rows x columns. `array` gives them where they
    lie, without a copy: output and state arrays are read only and have the numbers after each step and reset; input
    arrays are written to, and read by each step. An environment whose step fails is marked in `failed` and makes no
    steps until it is reset; the others go on.

    Copies of a world on CUDA are in the memory of the device, and `array` gives tensors of torch there. What torch has
    begun on its current stream is done before a step, or any other call, reads or writes them, and they are complete
    when it returns.
    """

    _tensors = False  # tensors on the host, too: for tests without a device

    def __init__(self, world: Any, count: int) -> None:
        self._library = _core._replicate(world, count)
        self._count = self._library.count
        self._failed = self._library.marked()
        self._bound = {}  # tensors on a device
        self._stream = None  # of torch, on the device

    @property
    def _core(self):
        """The library's environments, which wait for what torch has begun."""
        if self._stream is not None:
            self._library.set_stream(self._stream().cuda_stream)
        return self._library

    def __repr__(self) -> str:
        return f"<subadmm environments: {self.count}>"

    def __len__(self) -> int:
        return self.count

    @property
    def count(self) -> int:
        """How many there are."""
        return self._count

    @functools.cached_property
    def device(self) -> int:
        """The CUDA device that they are on; -1: they are on the CPU."""
        return self._library.device()

    @functools.cached_property
    def xp(self) -> Any:
        """numpy, or torch on the device, whichever the arrays are of; with array (of anything), copy, zeros and full
        (float64 on the device), and norm (along the last axis, which stays) and cross of both."""
        if self.device < 0 and not self._tensors:
            return NUMPY
        if self.device < 0:
            return of_torch("cpu")
        torch_with_cuda()
        return of_torch(f"cuda:{self.device}")

    @property
    def memory(self) -> int:
        """Bytes an environment: states and arrays; on CUDA with the world that they are in, once it has made a step."""
        return self._core.memory

    @property
    def settings(self) -> Any:
        """Settings of all; what is set of them, as settings.dt = 0.002, is set in all."""
        return self._core.settings

    @settings.setter
    def settings(self, settings: Any) -> None:
        self._core.settings = settings

    @property
    def failed(self) -> Any:
        """Which are marked: bool, count, of numpy; the array stays the same."""
        return self._failed

    def reason(self, environment: int) -> str:
        """Why an environment is marked; '' where it is not."""
        return self._core.mark(self._one(environment))

    def _one(self, environment):
        return whole("environment", environment, 0, self.count - 1)

    def _which(self, which):
        """int32 numbers, of numbers or of a mask; None: all."""
        if which is None:
            return None
        which = np.asarray(to_numpy(which))
        if which.dtype == bool:
            if which.shape != (self.count,):
                raise ValueError(f"which: a mask must have shape ({self.count},), and has {which.shape}")
            which = np.flatnonzero(which)
        which = np.atleast_1d(which)
        if which.size == 0:
            which = which.astype(np.int32)
        if which.dtype.kind not in "iu" or which.ndim != 1:
            raise TypeError(f"which: must be a mask or whole numbers, is {which.dtype} of shape {which.shape}")
        if which.size and not (which.min() >= -(2**31) and which.max() < 2**31):
            raise ValueError("which: must be environments")
        return np.ascontiguousarray(which, np.int32)

    def step(self, steps: int = 1) -> None:
        """Make `steps` time steps of settings.dt in all that are not marked."""
        self._core.step(steps)

    def reset(self, which: Any = None, states: Any = None) -> None:
        """Environments (numbers, or a mask; None: all) begin again, each with a state: 0 is the template's, others are
        those that keep() returned; one for all, or one each. The same steps follow, bit for bit. What input arrays have
        stays."""
        rows = self._which(which)
        if states is not None:
            given = np.asarray(to_numpy(states))
            if given.dtype.kind not in "iu":
                raise TypeError(f"states: must be whole numbers, is {given.dtype}")
            n = self.count if rows is None else len(rows)
            if given.shape not in ((), (n,)):
                raise ValueError(f"states: must be one number, or {n}; has shape {given.shape}")
            if given.size and not (given.min() >= 0 and given.max() < 2**31):
                raise ValueError("states: must be numbers that keep() returned, or 0")
            states = np.ascontiguousarray(np.broadcast_to(given, (n,)), np.int32)
        self._core.reset(rows, states)

    def keep(self, environment: int = 0) -> int:
        """Keep the state of an environment to reset to; its number."""
        return self._core.keep(self._one(environment))

    def forget(self, state: int) -> None:
        """Forget a state that keep() kept."""
        self._core.forget(whole("state", state, 0, 2**31 - 1))

    def array(self, name: str, precision: str = "f64") -> Any:
        """An array of all environments where it lies, float64 or ('f32') float32: the same one every time. An input
        array has one precision. On CUDA a tensor of torch; only input arrays may be written to."""
        if (name, precision) in self._bound:
            return self._bound[name, precision]
        array = self._core.bind(name, precision)
        if not isinstance(array, np.ndarray):
            torch = torch_with_cuda()
            array = self._bound[name, precision] = torch.from_dlpack(array)
            self._stream = functools.partial(torch.cuda.current_stream, array.device)
        elif self._tensors:
            with warnings.catch_warnings():  # that it is not to be written to
                warnings.simplefilter("ignore")
                array = self._bound[name, precision] = self.xp.from_numpy(array)
        return array

    def get(self, name: str, which: Any = None) -> Any:
        """A copy of an array's numbers, of numpy: of environments (numbers, or a mask; None: all)."""
        return self._core.get(name, self._which(which))

    def set(self, name: str, values: Any, which: Any = None) -> None:
        """Set an array that can be set, in environments (numbers, or a mask; None: all): values of shape environments x
        rows x columns, or what fits that by NumPy's rules. If anything is refused, nothing is set."""
        rows = self._which(which)
        now = self._core.get(name, rows)
        values = np.asarray(to_numpy(values))
        if values.dtype.kind not in "iuf":
            raise TypeError(f"values: must be real numbers, is {values.dtype}")
        try:
            values = np.broadcast_to(values, now.shape)
        except ValueError:
            raise ValueError(f"values: must have shape {now.shape}, and has {values.shape}") from None
        self._core.set(name, np.ascontiguousarray(values, np.float64), rows)

    def world(self, environment: int) -> Any:
        """A new World as an environment is now: to look at it, to query it, or to go on with it. It has no contacts before
        its next step: see record_contacts."""
        world = _core.World()
        world.restore(self._core.save(self._one(environment)))
        return world

    def record_contacts(self, record: bool = True) -> None:
        """Keep the contacts of each environment's last step from now on, or (False) no more."""
        self._core.record_contacts(record)

    def contacts(self, environment: int) -> Any:
        """Contacts of an environment's last step, all of them: an array of subadmm.contact_dtype, a copy; its ids are
        those of the template's bodies and shapes. After record_contacts()."""
        from . import contact_dtype

        return np.frombuffer(self._core.contacts(self._one(environment)), dtype=contact_dtype)

    def cast_rays(self, origins: Any, directions: Any, length: float = np.inf, which: Any = None, *, ignore: Any = None,
                  types: Any = ()) -> dict[str, Any]:
        """What rays hit in environments (numbers, or a mask; None: all): origins and directions of shape environments x
        rays x 3, or what fits that by NumPy's rules (m, world); how far to search (m). Distances (infinite: nothing),
        points and normals, of numpy. ignore: a Body of the template; types: of bodies, like ("static",) for heights of
        terrain."""
        rows = self._which(which)
        n = self.count if rows is None else len(rows)
        origins, directions = np.asarray(to_numpy(origins)), np.asarray(to_numpy(directions))
        for name, given in (("origins", origins), ("directions", directions)):
            if given.dtype.kind not in "iuf" or given.ndim < 1 or given.shape[-1] != 3:
                raise TypeError(f"{name}: must be real numbers, 3 in the last axis; is {given.dtype} of {given.shape}")
        try:
            shape = np.broadcast_shapes(origins.shape, directions.shape, (n, 1, 3))
            origins, directions = (np.ascontiguousarray(np.broadcast_to(x, shape), np.float64)
                                   for x in (origins, directions))
        except ValueError:
            shape = ()
        if len(shape) != 3 or shape[0] != n:
            raise ValueError(f"origins, directions: must have shape ({n}, rays, 3)")
        return self._core.cast_rays(origins, directions, length, rows, ignore, list(types))

    @property
    def error(self) -> Any:
        """How far the last step of each is from the laws, m/s; -1: not known. count numbers of numpy, a copy. On CUDA
        the natural map, which is worked out when it is asked for."""
        if self.device >= 0:
            return self.get("report")[:, 0, 0].copy()
        return np.array(to_numpy(self.array("report")[:, 0, 0]))
