"""What properties read: numbers that are a copy, and that say so where somebody writes to them."""
import numpy as np


class Vector(np.ndarray):
    """Numbers of an object, read by value: an array of numpy that is not to be written to, since that would change a
    copy. `body.position = x` and `body.position += dx` set them; np.array(body.position) is a copy of your own."""

    _setter = ""  # of the object that it was read of, where there is one
    _hint = ""  # another way to set it

    def _refuse(self):
        if self._setter:
            raise ValueError(f"{self._setter}: what is read is a copy, which is not to be written to; set all of it, "
                             f"x.{self._setter} = (...), or write to one of your own, np.array(x.{self._setter})")
        if self._hint:
            raise ValueError(f"what is read is a copy, which is not to be written to; {self._hint} sets it")
        raise ValueError("what is read is a copy, which is not to be written to; np.array(x) is one of your own")

    def __setitem__(self, key, value):
        if not self.flags.writeable:
            self._refuse()
        super().__setitem__(key, value)

    def __array_wrap__(self, array, context=None, return_scalar=False):
        array = np.asarray(array)
        return array[()] if array.ndim == 0 else array

    # As a value: `body.position == [0, 0, 1]` is one answer. With other arrays: number by number, as arrays are compared.
    def __eq__(self, other):
        if isinstance(other, (list, tuple, Vector)):
            return np.bool_(np.array_equal(np.asarray(self), np.asarray(other)))
        return super().__eq__(other)

    def __ne__(self, other):
        return ~self.__eq__(other) if isinstance(other, (list, tuple, Vector)) else super().__ne__(other)

    __hash__ = None

    # `body.position += dx` reads, adds and sets: in between there is an array of one's own.
    def __iadd__(self, other):
        return np.asarray(self) + other

    def __isub__(self, other):
        return np.asarray(self) - other

    def __imul__(self, other):
        return np.asarray(self) * other

    def __itruediv__(self, other):
        return np.asarray(self) / other

    def __reduce__(self):
        return np.array, (self.tolist(),)

    def __copy__(self):
        return np.array(self)

    def __deepcopy__(self, memo):
        return np.array(self)

    def copy(self, order="C"):
        return np.array(self, order=order)


def read_only(array, hint):
    """An array as one that is not to be written to; hint: what sets the numbers."""
    out = np.asarray(array, np.float64).view(Vector)
    out.setflags(write=False)
    out._hint = hint
    return out


def made(values, setter):
    """Of the bytes of float64, which nothing can write to."""
    out = np.ndarray.__new__(Vector, (len(values) // 8,), np.float64, values)
    if setter:
        out._setter = setter
    return out
