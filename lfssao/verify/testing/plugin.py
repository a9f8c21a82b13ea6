"""The pytest plugin: the fixture ``lfssao_case``, for tests that are to run once for each case of the kit.

Every run of pytest where lfssao is installed loads this file, so it imports nothing that takes time.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from lfssao.verify.case import Case


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--lfssao-kit``."""
    parser.getgroup("lfssao").addoption(
        "--lfssao-kit",
        type=Path,
        metavar="DIR",
        help="take the cases of the fixture lfssao_case from a folder that 'lfssao kit' wrote; made anew by default",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line("markers", "lfssao_stages(*names): the stages whose cases the fixture lfssao_case takes")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat each test that takes ``lfssao_case`` for each case of its stages."""
    if "lfssao_case" not in metafunc.fixturenames:
        return
    marker = metafunc.definition.get_closest_marker("lfssao_stages")
    folder = metafunc.config.getoption("--lfssao-kit")
    cases = [name for name, stage in _stages(folder) if marker is None or stage in marker.args]
    metafunc.parametrize("lfssao_case", cases, indirect=True)


def _stages(folder: Path | None) -> list[tuple[str, str]]:
    """Name and stage of each case."""
    if folder is None:
        from lfssao.verify.kit.cases import RECIPES  # late: numba

        return [(recipe.name, recipe.stage) for recipe in RECIPES.values()]
    from lfssao.verify.kit.folder import read_index  # late: NumPy

    return [(entry["name"], entry["stage"]) for entry in read_index(folder)]


@pytest.fixture
def lfssao_case(request: Any) -> "Case":
    """A case of the conformance kit (lfssao.verify.case.Case); hand it to lfssao.testing.assert_conforms."""
    folder = request.config.getoption("--lfssao-kit")
    if folder is None:
        from lfssao.verify.kit.cases import make_case

        return make_case(request.param)
    from lfssao.verify.kit.folder import read_case, read_index

    entry = next(entry for entry in read_index(folder) if entry["name"] == request.param)
    return read_case(folder / entry["folder"])
