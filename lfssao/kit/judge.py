"""What of a renderer's numbers does not conform to a case, in sentences."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.kit.case import Case


def faults(mine: NDArray[Any] | Mapping[str, NDArray[Any]], case: Case, strict: bool = False) -> list[str]:
    """One sentence for each output that does not conform, in the order in which they are computed; empty if all do.

    Parameters
    ----------
    mine : array, or mapping of arrays
        The case's first output, or outputs by their names, the first one among them.
    case : Case
        The case.
    strict : bool
        Whether outputs that have bounds must have equal bits too.
    """
    main, *steps = case.outputs
    given = mine if isinstance(mine, Mapping) else {main: mine}
    unknown = [name for name in given if name not in case.outputs]
    if unknown or main not in given:
        what = f"there is no output {unknown[0]}" if unknown else f"output {main} is missing"
        return [f"case {case.name}: {what}; it has {', '.join(case.outputs)}"]
    found = (_fault(np.asarray(given[name]), name, case, strict) for name in (*steps, main) if name in given)
    return [f"case {case.name}, output {fault}" for fault in found if fault]


def _fault(mine: NDArray[Any], name: str, case: Case, strict: bool) -> str:
    expected = case.outputs[name]
    if (mine.shape, mine.dtype) != (expected.shape, expected.dtype):
        return f"{name}: it is {mine.shape} of {mine.dtype}, expected {expected.shape} of {expected.dtype}"
    if strict or name not in case.bounds:
        wrong = _bits(mine) != _bits(expected)
        return _places(name, mine, wrong, "not the bits of the reference", expected, expected)
    lower, upper = case.bounds[name]
    wrong = ~((mine >= lower) & (mine <= upper))
    return _places(name, mine, wrong, "outside the bounds", lower, upper)


def _bits(array: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(array).view(f"u{array.dtype.itemsize}")


def _places(
    name: str, mine: NDArray[Any], wrong: NDArray[np.bool_], what: str, lower: NDArray[Any], upper: NDArray[Any]
) -> str:
    """How many numbers are wrong, and the first of them; nothing where none is."""
    if not wrong.any():
        return ""
    place = tuple(int(k) for k in np.argwhere(wrong)[0])
    low, high = lower[place].item(), upper[place].item()
    expected = f"{low!r}" if lower is upper else f"{low!r} to {high!r}"
    count = f"{int(wrong.sum())} of {wrong.size} numbers are {what}"
    return f"{name}: {count}; the first is [{', '.join(map(str, place))}]: {mine[place].item()!r}, expected {expected}"
