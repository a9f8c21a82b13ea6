"""NPY files of numbers. NumPy's own reader trusts any length, repairs headers and opens archives."""

import ast
import operator
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError

_MOST_HEADER = 10_000  # bytes before the numbers


def read_npy(path: Path) -> NDArray[Any]:
    """The numbers of a file, of at most 64 bits, whole or not, in the machine's order of bytes.

    InputError if the file cannot be read, holds something else, or is not of exactly the bytes of its numbers, before
    memory is taken for them.
    """
    try:
        with path.open("rb") as stream:
            shape, by_columns, dtype = _header(stream)
            begin = stream.tell()
        if dtype.kind not in "fiu" or dtype.itemsize > 8 or min(shape, default=1) < 0:
            raise InputError(f"{path}: it holds {dtype} {shape}, expected numbers")
        needed, there = prod(shape) * dtype.itemsize, path.stat().st_size - begin
        if needed != there:
            raise InputError(f"{path}: it is damaged (shape {shape} needs {needed} bytes, has {there})")
        numbers = np.fromfile(path, dtype, offset=begin).reshape(shape, order="F" if by_columns else "C")
    except InputError:
        raise
    except (OSError, ValueError, TypeError, SyntaxError, KeyError, RecursionError, OverflowError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).split("\n")[0]
        raise InputError(f"{path}: it cannot be read as an NPY file ({reason})") from None
    return numbers.astype(dtype.newbyteorder("="), copy=False)


def _header(stream: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, and type."""
    version = np.lib.format.read_magic(stream)
    length = int.from_bytes(stream.read(2 if version == (1, 0) else 4), "little")
    if length > _MOST_HEADER:
        raise ValueError(f"its header claims {length} bytes")
    fields = ast.literal_eval(stream.read(length).decode("utf-8").strip())
    shape = tuple(operator.index(n) for n in fields["shape"])
    return shape, bool(fields["fortran_order"]), np.dtype(fields["descr"])
