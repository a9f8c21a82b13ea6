"""NPY files of numbers. NumPy's own reader takes memory for any length and opens archives."""

from io import BytesIO
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.memory import check_available
from lfssao.errors import InputError
from lfssao.files.whole import check_file

_MOST_HEADER = 10_000  # bytes before the numbers


def read_npy(path: Path) -> NDArray[Any]:
    """Return the numbers of a file, of at most 64 bits, whole or not, in the machine's order of bytes.

    InputError if the file cannot be read, holds something else, or is not of exactly the bytes of its numbers, before
    memory is taken for them.
    """
    check_file(path)
    try:
        with path.open("rb") as file:
            stream = BytesIO(file.read(_MOST_HEADER))  # NumPy takes memory for any length that a header claims to have
        is_first = np.lib.format.read_magic(stream) == (1, 0)  # the third version is of arrays with named fields
        read_header = np.lib.format.read_array_header_1_0 if is_first else np.lib.format.read_array_header_2_0
        shape, by_columns, dtype = read_header(stream)
        begin = stream.tell()
        if dtype.kind not in "fiu" or dtype.itemsize > 8 or min(shape, default=1) < 0:
            raise InputError(f"{path}: it holds {dtype} {shape}, expected numbers")
        needed = prod(shape) * dtype.itemsize
        left = path.stat().st_size - begin
        if needed != left:
            raise InputError(f"{path}: it is damaged (shape {shape} needs {needed} bytes, has {left})")
        check_available(f"{path}: its numbers", needed)
        numbers = np.fromfile(path, dtype, offset=begin).reshape(shape, order="F" if by_columns else "C")
    except InputError:
        raise
    except (OSError, ValueError, TypeError, SyntaxError, RecursionError, OverflowError, TokenError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).split("\n")[0]
        raise InputError(f"{path}: it cannot be read as an NPY file ({reason})") from None
    return numbers.astype(dtype.newbyteorder("="), copy=False)


def write_npy(path: Path, array: NDArray[Any]) -> None:
    """Write an array; OSError if it cannot be written."""
    stream = BytesIO()  # NumPy would not notice that the end of a file is lost as it is closed
    np.save(stream, array)
    path.write_bytes(stream.getbuffer())
