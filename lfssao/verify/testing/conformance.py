"""Assert that another renderer conforms to a case of the kit."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

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
        raise AssertionError("\n".join(wrong))


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
