"""SHA-256 of arrays."""

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


def digest(array: NDArray[Any]) -> str:
    """SHA-256 of an array's numbers, little-endian, row by row; hexadecimal."""
    return hashlib.sha256(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).data).hexdigest()
