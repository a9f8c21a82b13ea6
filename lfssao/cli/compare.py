"""``lfssao compare``: another renderer's textures against a reference."""

import argparse
from collections.abc import Callable
from contextlib import suppress
from math import isnan
from pathlib import Path

from lfssao.cli import values
from lfssao.cli.terminal import printable, progress, working
from lfssao.core.memory import keep_freed_memory
from lfssao.errors import InputError, errors_of
from lfssao.verify.compare.comparison import Comparison
from lfssao.verify.compare.result import Tolerance

_HELP = {
    "mine": "a folder or a file of the renderer to be judged",
    "reference": "a folder that 'lfssao render' wrote, a kit of 'lfssao kit', a case of one, another folder, or a file",
    "--map": "a layer or channel of MINE is one of REFERENCE, as in ssao.R=merged.AO; may be given several times; "
    "vis.R=1-merged.AO: it is 1 - occlusion; 1-ao_1: so is MINE's own ao_1, as of files of one layer",
    "--files": "names of MINE's files: 'frame_{module}_ao.tif=merged', {number} for a module's number, without =LAYER "
    "for files of all layers; may be given several times",
    "--stored": "float32 values of a layer went through a format: half, unorm8, unorm16 or srgb8, or 8-bit colours are "
    "linear, as in shaded=unorm8; depth=linear: distances along a camera's axis; may be given several times",
    "--background": "value of MINE's depth and positions where there is no surface (default: infinity)",
    "--layers": "compare these layers of REFERENCE only; ao: those of all radii (default: all)",
    "--cases": "compare these cases of a kit only (default: all)",
    "--exact": "fail where bits differ",
    "--fail": "pass texels that differ from REFERENCE by no more, in the texture's unit or in codes (default: 0)",
    "--fail-percent": "pass textures of which no more than this percentage of the texels fail (default: 0)",
    "--model": "what MINE's arithmetic may do: shader, sampler, nearest or strict (default: shader)",
    "--estimator": "the Python file of the estimator of one's own that REFERENCE was made with; it is run",
    "--mesh": "the mesh that REFERENCE was rendered of: nine rays a texel into it judge depth and colour, without "
    "exceptions at silhouettes (of an embedded scene it is at hand)",
    "--no-diagnosis": "do not search for the change of the reference that explains a wrong texture",
    "--json": "write all figures as JSON; -: to standard output, in place of the report",
    "--junit": "write JUnit XML: a test suite a module, a test case a layer",
    "--html": "write a page for any browser: a table of all verdicts, and a viewer of both sides and their difference",
    "--picture": "draw the first module that fails or differs (.png, .svg or .pdf)",
}

_number = values.number("a number", lambda value: not isnan(value))


def add_to(compare: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    compare.description = """Compare textures of another renderer with a reference: equal bits, inside the interval of
        what rounding may change, or wrong, where, and why."""
    compare.set_defaults(run=_compare)

    def group(title: str) -> Callable[..., argparse.Action]:
        add_argument = compare.add_argument_group(title).add_argument
        return lambda name, **more: add_argument(name, help=_HELP[name], **more)

    for name in ("mine", "reference"):
        compare.add_argument(name, metavar=name.upper(), help=_HELP[name])
    add = group("names and formats")
    add("--map", action="append", default=[], metavar="MINE=REFERENCE")
    add("--files", action="append", default=[], metavar="PATTERN=LAYER")
    add("--stored", action="append", default=[], metavar="LAYER=FORMAT")
    add("--background", type=_number, metavar="VALUE")
    for name in ("--estimator", "--mesh"):
        add(name, metavar="FILE")
    add = group("what is compared, and how")
    add("--layers", metavar="NAME,...")
    add("--cases", metavar="NAME,...")
    add("--exact", action="store_true")
    for name in ("--fail", "--fail-percent"):
        add(name, type=_number, default=0.0, metavar="X")
    add("--model", default="shader", metavar="NAME")
    add("--no-diagnosis", action="store_true")
    add = group("reports")
    for name in ("--html", "--json", "--junit", "--picture"):
        add(name, metavar="FILE")


def _compare(options: argparse.Namespace) -> int:
    """Compare, write and print; the exit code is the report's."""
    keep_freed_memory()
    for name in ("html", "json", "junit", "picture"):
        target = getattr(options, name)
        if target is not None and not Path(target).parent.is_dir():
            raise InputError(f"--{name}: there is no folder {Path(target).parent}")
    layers, cases = (None if names is None else names.split(",") for names in (options.layers, options.cases))
    if options.estimator is not None:
        from lfssao.ao.estimators.own import read_estimator  # as in cli/estimators.py

        with errors_of("--estimator"):
            read_estimator(options.estimator)
    rules = values.rules(options.map, "MINE=REFERENCE")
    comparison = Comparison(
        Path(options.mine),
        Path(options.reference),
        rules,
        layers,
        options.exact,
        options.model,
        cases,
        Tolerance(options.fail, options.fail_percent),
        options.mesh,
        diagnosis=not options.no_diagnosis,
        page=options.html is not None,
        stored=dict(values.pairs("--stored", options.stored, "LAYER=FORMAT", 0)),
        files=options.files,
        background=options.background,
    )
    with progress(comparison.modules, unit="module") as bar:
        for module in bar:
            comparison.add(module)
    with working("report"):
        report = comparison.report()
        writers = report.write_html, report.write_json, report.write_junit, report.save_picture
        for name, write in zip(("html", "json", "junit", "picture"), writers, strict=True):
            target = getattr(options, name)
            if target is not None and (name, target) != ("json", "-"):
                write(Path(target))
    text = report.as_json() if options.json == "-" else str(report)
    with suppress(BrokenPipeError):  # the reader of the text may have gone; the exit code still counts
        print("\n".join(printable(line) for line in text.split("\n")), flush=True)
    return report.exit_code
