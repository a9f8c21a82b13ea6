"""Objects in one line, in notebooks as a table, and as the array that is meant where an array is expected."""

from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Summary:
    """A base of classes whose numbers would fill pages: ``_facts`` are what one line says of an object."""

    def _facts(self) -> dict[str, object]:
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join(f'{name} {fact}' for name, fact in self._facts().items())}>"


class Table(Summary):
    """A ``Summary`` that notebooks show as a table; classes that are shown as a picture are none."""

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{name}</th><td>{escape(str(fact))}</td></tr>" for name, fact in self._facts().items())
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


class Arrayed:
    """A base of classes that stand for one of their arrays, ``_array``, where NumPy is given one."""

    def _array(self) -> NDArray[Any]:
        raise NotImplementedError

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self._array(), dtype, copy=copy)

    def __len__(self) -> int:
        return len(self._array())


def size_of(texture: NDArray[Any]) -> str:
    """Width, height and dtype of a texture."""
    return f"{texture.shape[1]}x{texture.shape[0]} of {texture.dtype}"


def listed(numbers: Iterable[float]) -> str:
    """Numbers to three digits."""
    return " ".join(f"{number:.3g}" for number in numbers)


def arrays_of(arrays: Any) -> str:
    """Names and shapes of a mapping of arrays."""
    return "; ".join(f"{name} {array.shape}" for name, array in arrays.items()) or "none"
