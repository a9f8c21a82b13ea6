"""Classes of formulas that compilers tell apart.

numba knows the class of a named tuple again by its name and its fields. A class that was written anew, in a notebook
or in a file of one's own, would run the formulas of the one before.
"""

from typing import Any, TypeVar

_T = TypeVar("_T", bound=tuple[Any, ...])
_known: dict[tuple[str, ...], type] = {}  # by name and fields


def distinct(formulas: _T) -> _T:
    """Return a named tuple, whose class gets another name where there was a class with its name and its fields."""
    kind: Any = type(formulas)
    while _known.setdefault((kind.__name__, *kind._fields), kind) is not kind:
        kind.__name__ += "_"
    return formulas
