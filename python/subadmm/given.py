"""Arrays that are given: of the numbers and the shape that are meant, or an error that says what is wrong."""
import operator

import numpy as np


def _array(name, given):
    try:
        return np.asarray(given)
    except ValueError as error:  # rows of different lengths
        raise ValueError(f"{name}: {error}") from None


def _refuse(name, array, kinds, must):
    error = ValueError if array.dtype.kind in kinds else TypeError
    raise error(f"{name}: must {must}; is {array.dtype} of shape {array.shape}")


def numbers(name, given, columns=None):
    """n x columns (None: any number) float64 in C order, of an array or nested lists of real numbers; of no numbers at
    all 0 x columns."""
    array = _array(name, given)
    if array.shape == (0,) and columns is not None:
        array = np.zeros((0, columns))
    if array.dtype.kind not in "iuf" or array.ndim != 2 or (columns is not None and array.shape[1] != columns):
        _refuse(name, array, "iuf", f"have {'rows and' if columns is None else columns} columns of real numbers")
    return np.ascontiguousarray(array, dtype=np.float64)


def indices(name, given, count):
    """m x 3 int32 in C order, of an array or nested lists of whole numbers in [0, count)."""
    array = _array(name, given)
    if array.shape == (0,):
        array = np.zeros((0, 3), np.int32)
    if array.dtype.kind not in "iu" or array.ndim != 2 or array.shape[1] != 3:
        _refuse(name, array, "iu", "have 3 columns of whole numbers")
    wrong = (array < 0) | (array >= min(count, 2**31))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise ValueError(f"{name}[{row}][{column}] = {array[row, column]}: must be in [0, {count})")
    return np.ascontiguousarray(array, dtype=np.int32)


def whole(name, value, low, high):
    """An int, of what is one, in [low, high]."""
    must = f"must be a whole number in [{low}, {high}]"
    try:
        out = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: {value!r}; {must}") from None
    if not low <= out <= high:
        raise ValueError(f"{name}: {value}; {must}")
    return out


def real(name, value, low, high, above=False):
    """A finite float, of what is a number, in [low, high]; above: in (low, high]."""
    must = f"must be a number in {'(' if above else '['}{low:g}, {high:g}]"
    try:
        out = None if isinstance(value, (str, bytes, bytearray)) else float(value)
    except (TypeError, ValueError, OverflowError):
        out = None
    if out is None:
        raise TypeError(f"{name}: {value!r}; {must}")
    if not low <= out <= high or (above and out == low):
        raise ValueError(f"{name}: {value}; {must}")
    return out


def point(name, value, count=3):
    """Finite numbers, as an array of float64."""
    out = np.asarray(value)
    if out.shape != (count,) or out.dtype.kind not in "iuf":
        raise TypeError(f"{name}: {value!r}; must be {count} numbers")
    if not np.isfinite(out).all():
        raise ValueError(f"{name}: {value!r}; must be {count} finite numbers")
    return out.astype(np.float64)
