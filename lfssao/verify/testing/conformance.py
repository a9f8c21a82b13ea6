"""Assert that another renderer conforms to a case of the kit."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.files.pictures import row_png
from lfssao.verify.case import Array, Case
from lfssao.verify.judge import judge
from lfssao.verify.kit.folder import read_case
from lfssao.verify.verdict import Judgement, Verdict


def assert_conforms(mine: Array | Mapping[str, Array], case: Case | str | Path, *, strict: bool = False) -> None:
    """Assert that a renderer's numbers conform to a case of the kit.

    Parameters
    ----------
    mine : array, or mapping of arrays
        The renderer's outputs from the case's inputs: the first one, or outputs by their names, the first among them.
    case : Case, str or Path
        The case, its name, or its folder in a kit that 'lfssao kit' wrote.
    strict : bool
        False: every number lies within the case's bounds, or has equal bits if an output has none. True: equal bits
        everywhere.

    Raises
    ------
    AssertionError
        If they do not; it names each output that is wrong, the earliest first, and the first wrong number of each.
    InputError
        If there is no such case.

    Examples
    --------
    >>> case = lfssao.testing.make_case("frame")
    >>> lfssao.testing.assert_conforms(case.outputs, case)
    """
    __tracebackhide__ = True
    if isinstance(case, Path):
        case = read_case(case)
    elif isinstance(case, str):
        from lfssao.verify.kit.cases import make_case  # late: it compiles kernels, and cases on disk need none

        case = make_case(case)
    wrong = list(_faults(mine, case, strict))
    if wrong:
        error = NonconformityError("\n".join(wrong))
        error.pictures = picture_of(mine, case, strict)
        raise error


class NonconformityError(AssertionError):
    """Numbers that do not conform to a case; ``pictures`` is a PNG file for the plugin of pytest, None without one."""

    pictures: bytes | None = None


def picture_of(mine: Array | Mapping[str, Array], case: Case, strict: bool) -> bytes | None:
    """A PNG file of the first wrong output: mine, the one expected, and in white the texels outside.

    None where no wrong output is a texture of the expected size.
    """
    main = next(iter(case.outputs))
    given = {name: np.asarray(array) for name, array in (mine if isinstance(mine, Mapping) else {main: mine}).items()}
    if main not in given or given.keys() - case.outputs.keys():
        return None
    for name, judged in judge(given, case).items():
        bounds = None if strict else judged.bounds
        wrong = judged.differing if bounds is None else judged.outside
        right = case.outputs[name]
        own = given.get(name)
        if own is None or own.shape != right.shape or wrong.shape != right.shape or right.dtype.kind != "f":
            continue
        if right.ndim in (2, 3) and min(right.shape[:2]) > 1 and wrong.any():
            first = own.reshape(*own.shape[:2], -1)[..., 0], right.reshape(*right.shape[:2], -1)[..., 0]
            finite = first[1][np.isfinite(first[1])]
            low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
            codes = [_grey(plane, low, high) for plane in first]
            outside = np.asarray(wrong.reshape(*wrong.shape[:2], -1).any(axis=-1))
            return row_png([*codes, _grey(outside, 0.0, 1.0)])
    return None


def _grey(plane: Array, low: float, high: float) -> NDArray[np.uint8]:
    """Codes (H, W, 3), 0 at the low end and 255 at the high one, for infinity, and for NaN."""
    with np.errstate(all="ignore"):
        scaled = np.nan_to_num((plane.astype(np.float64) - low) / ((high - low) or 1.0), nan=1.0, posinf=1.0, neginf=0)
    return np.repeat(np.rint(np.clip(scaled, 0, 1) * 255).astype(np.uint8)[..., None], 3, axis=-1)


def _faults(mine: Array | Mapping[str, Array], case: Case, strict: bool) -> Iterator[str]:
    """Yield a sentence for each output that does not conform, in the order of computation."""
    main = next(iter(case.outputs))
    given = {name: np.asarray(array) for name, array in (mine if isinstance(mine, Mapping) else {main: mine}).items()}
    unknown = [name for name in given if name not in case.outputs]
    if unknown or main not in given:
        fault = f"there is no output {unknown[0]}" if unknown else f"output {main} is missing"
        yield f"case {case.name}: {fault}; it has {', '.join(case.outputs)}"
        return
    right = {Verdict.MISSING, Verdict.EQUAL_BITS} | (set() if strict else {Verdict.INSIDE})
    for name, judged in judge(given, case).items():
        if judged.verdict not in right:
            detail = judged.detail or _numbers(given[name], case.outputs[name], judged, strict)
            yield f"case {case.name}, output {name}: {detail}"


def _numbers(mine: Array, reference: Array, judged: Judgement, strict: bool) -> str:
    """A sentence on the number of wrong numbers, and the first of them."""
    bounds = None if strict else judged.bounds
    wrong = judged.differing if bounds is None else judged.outside
    index = tuple(int(k) for k in np.argwhere(wrong)[0])
    if bounds is None:
        fault = "not the bits of the reference"
        expected = repr(reference[index].item())
    else:
        fault = "outside the bounds"
        expected = f"{bounds.lower[index].item()!r} to {bounds.upper[index].item()!r}"
    count = f"{int(wrong.sum())} of {wrong.size} numbers are {fault}"
    return f"{count}; the first is [{', '.join(map(str, index))}]: {mine[index].item()!r}, expected {expected}"
