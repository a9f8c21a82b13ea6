"""Checks of arguments from Python, where anything may be handed over: numbers, whole numbers, arrays without a mask."""

from math import nan
from numbers import Real
from operator import index
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError, shown

MOST_TEXELS = 2**31 - 1  # of a texture, and along its sides: kernels count them in 32 bits
MOST_SEED = 2**64 - 1


def as_number(value: object) -> float:
    """A real number, also in an array without dimensions, as a float; NaN, which no range holds, for all else."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        return nan
    try:
        return float(value)
    except OverflowError:  # of a whole number
        return nan


def as_whole(value: object) -> int | None:
    """A whole number of any type but bool, and not a float; None for all else."""
    try:
        return None if isinstance(value, bool) else index(value)  # type: ignore[arg-type]
    except TypeError:
        return None


def check_whole(argument: str, value: object, least: int, most: int | None = None, most_text: str = "") -> int:
    """A whole number (``as_whole``) in a range; InputError, with the argument's name, if it is none."""
    number = as_whole(value)
    if number is None or number < least or (most is not None and number > most):
        limits = f"of at least {least}" if most is None else f"from {least} to {most_text or most}"
        raise InputError(f"{argument} is {shown(value)}, it must be a whole number {limits}")
    return number


def check_seed(argument: str, seed: object) -> int:
    """The key of the random numbers (Philox4x32-10), 0 to 2**64 - 1; InputError, with the argument's name, if not."""
    return check_whole(argument, seed, 0, MOST_SEED, "2**64 - 1")


def check_unmasked(argument: str, value: object) -> None:
    """Refuse a masked array of which something is masked: nothing here reads a mask."""
    if np.ma.is_masked(value):
        raise InputError(f"{argument} is a masked array, and masks are not read: fill it (numpy.ma.filled)")


def as_numbers(argument: str, value: object) -> NDArray[Any]:
    """An array, or lists, of real numbers as an array of any shape, in its own dtype; InputError for all else."""
    check_unmasked(argument, value)
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{argument} is {shown(value)}, expected numbers")
    return array
