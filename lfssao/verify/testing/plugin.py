"""The pytest plugin: the fixture ``lfssao_case``, for tests that run once for each case of the kit.

Every run of pytest where lfssao is installed loads this file, so it imports nothing that takes time.
"""

from collections.abc import Callable, Generator, Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from lfssao.errors import InputError, no_such

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
    line = "lfssao_stages(*names, kinds): the stages, and kinds of mapping, whose cases the fixture lfssao_case takes"
    config.addinivalue_line("markers", line)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat each test that takes ``lfssao_case`` for each case of its stages and kinds."""
    if "lfssao_case" not in metafunc.fixturenames:
        return
    marker = metafunc.definition.get_closest_marker("lfssao_stages") or pytest.mark.lfssao_stages().mark
    try:
        cases = _chosen(marker, metafunc.config.getoption("--lfssao-kit"))
    except InputError as error:
        raise pytest.Collector.CollectError(f"{metafunc.definition.nodeid}: lfssao_stages: {error}") from None
    metafunc.parametrize("lfssao_case", cases, indirect=True)


def _chosen(marker: pytest.Mark, folder: Path | None) -> list[str]:
    """Names of the cases that a marker selects; of all stages if it names none."""
    stages, _ = _kit(folder)
    _check("parameter", marker.kwargs, ("kinds",))
    _check("stage", marker.args, stages.values())
    cases = [name for name, stage in stages.items() if not marker.args or stage in marker.args]
    if "kinds" not in marker.kwargs:
        return cases
    wanted = marker.kwargs["kinds"]
    kinds = {name: _kind(name, folder) for name in cases}
    wanted = (wanted,) if isinstance(wanted, str) else tuple(wanted)
    _check("kind", wanted, [kind for kind in kinds.values() if kind])
    return [name for name, kind in kinds.items() if kind in wanted]


def _check(noun: str, names: Iterable[str], choices: Iterable[str]) -> None:
    """Refuse a name that is none of the choices (InputError)."""
    known = list(dict.fromkeys(choices))
    for name in names:
        if name not in known:
            raise no_such(noun, str(name), known or ["none"])


@cache
def _kit(folder: Path | None) -> tuple[dict[str, str], Callable[[str], "Case"]]:
    """The stage of each case by its name, and a function that computes or reads a case by its name."""
    if folder is None:
        from lfssao.verify.kit.cases import RECIPES, make_case  # late: numba

        return {recipe.name: recipe.stage for recipe in RECIPES.values()}, make_case
    from lfssao.verify.kit.folder import read_case, read_index  # late: NumPy

    index = {entry["name"]: entry for entry in read_index(folder)}
    stages = {name: entry["stage"] for name, entry in index.items()}
    return stages, lambda name: read_case(folder / index[name]["folder"])


@cache
def _kind(name: str, folder: Path | None) -> str | None:
    """The kind of a case's mapping, as in lfssao.optics.view.KINDS; None if it has no mapping."""
    if folder is None:
        from lfssao.verify.kit.cases import RECIPES

        parameters = RECIPES[name].build(*RECIPES[name].arguments)[0]
    else:
        parameters = dict(_kit(folder)[1](name).parameters)
    kind: str | None = parameters.get("mapping", {}).get("kind")
    return "matrix" if "world_to_screen" in parameters else kind


@pytest.fixture
def lfssao_case(request: Any) -> "Case":
    """A case of the conformance kit (lfssao.verify.case.Case); hand it to lfssao.testing.assert_conforms."""
    return _kit(request.config.getoption("--lfssao-kit"))[1](request.param)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: Any) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Note the stage of a test's case for the summary, and write the picture of numbers that do not conform."""
    report = yield
    name = getattr(getattr(item, "callspec", None), "params", {}).get("lfssao_case")
    if name is not None and call.when == "call":
        report.user_properties.append(("lfssao_stage", _kit(item.config.getoption("--lfssao-kit"))[0][name]))
        pictures = getattr(call.excinfo and call.excinfo.value, "pictures", None)
        factory = getattr(item.config, "_tmp_path_factory", None)
        if pictures is not None and factory is not None:
            path = factory.mktemp("lfssao") / f"{name}.png"
            path.write_bytes(pictures)
            report.sections.append(("lfssao: mine, expected, outside", str(path)))
    return report


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Print how many cases of each stage conform."""
    counts: dict[str, list[int]] = {}
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            stage = dict(getattr(report, "user_properties", ())).get("lfssao_stage")
            if stage is not None:
                numbers = counts.setdefault(str(stage), [0, 0])
                numbers[0] += outcome == "passed"
                numbers[1] += 1
    if counts:
        terminalreporter.section("lfssao: cases that conform, by stage")
        for stage, (right, all_of_it) in counts.items():
            terminalreporter.line(f"{stage}: {right} of {all_of_it}")
