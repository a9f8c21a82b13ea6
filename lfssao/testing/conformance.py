"""Conformance of another renderer to a case of the kit, as an assertion."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lfssao.kit.case import Case
from lfssao.kit.folder import read_case
from lfssao.kit.judge import faults


def assert_conforms(
    mine: NDArray[Any] | Mapping[str, NDArray[Any]], case: Case | str | Path, *, strict: bool = False
) -> None:
    """Assert that a renderer's numbers conform to a case of the kit.

    Parameters
    ----------
    mine : array, or mapping of arrays
        What the renderer made of the case's inputs: its first output, or outputs by their names, the first one among
        them.
    case : Case, str or Path
        The case, its name, or its folder in a kit that 'lfssao kit' wrote.
    strict : bool
        False: every number lies within the case's bounds, or has equal bits where an output has none. True: equal
        bits everywhere.

    Raises
    ------
    AssertionError
        If they do not; it names each output that is wrong, the earliest first, and the first wrong number of each.
    InputError
        If there is no such case.
    """
    __tracebackhide__ = True
    wrong = faults(mine, _case(case), strict)
    if wrong:
        raise AssertionError("\n".join(wrong))


def _case(case: Case | str | Path) -> Case:
    if isinstance(case, Case):
        return case
    if isinstance(case, Path):
        return read_case(case)
    from lfssao.kit.cases import make_case  # late: it compiles kernels, and cases on disk need none

    return make_case(case)
