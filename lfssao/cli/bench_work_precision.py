"""``lfssao bench work-precision`` and ``lfssao bench advise``: error against run time, and which setting to take."""

import argparse
import json
from pathlib import Path
from typing import Any

from lfssao.cli import values
from lfssao.cli.render import load
from lfssao.cli.terminal import bar_size
from lfssao.errors import InputError

_FOLDER = Path("work-precision")
_JSON = "work-precision.json"


def add_to(benches: Any) -> None:
    """Add both benches to the parser."""
    measure = benches.add_parser(
        "work-precision",
        allow_abbrev=False,
        help="error against run time, of every estimator",
        description="Time and errors of every estimator by sampler, number of samples, radii, blur and arithmetic. "
        "An interrupted run goes on where it was when the command is given again.",
    )
    measure.set_defaults(run=_measure)
    measure.add_argument("scene", nargs="?", default="gallery", metavar="SCENE",
                         help="name of an embedded scene, or a mesh file")  # fmt: skip
    measure.add_argument("--quick", action="store_true", help="few settings: minutes instead of most of an hour")
    measure.add_argument("--threads", type=values.threads, default=2, help="threads (2)")
    measure.add_argument("-o", "--output", metavar="DIR", type=Path, default=_FOLDER, help=f"folder ({_FOLDER})")

    advise = benches.add_parser(
        "advise",
        allow_abbrev=False,
        help="which setting to take for an error or a time",
        description="One sentence from the figures of 'lfssao bench work-precision'.",
    )
    advise.set_defaults(run=_advise)
    limit = advise.add_mutually_exclusive_group(required=True)
    limit.add_argument("--max-error", metavar="X", type=values.positive, help="largest RMSE of occlusion")
    limit.add_argument("--max-ms", metavar="Y", type=values.positive, help="longest time, milliseconds")
    advise.add_argument("--error", choices=("model", "sampling"), default="model",
                        help="against ray-cast occlusion (the default) or against many samples")  # fmt: skip
    advise.add_argument("--from", dest="file", metavar="FILE", type=Path, default=_FOLDER / _JSON,
                        help=f"the figures ({_FOLDER / _JSON})")  # fmt: skip


def _measure(options: argparse.Namespace) -> None:
    import numba  # late: --help needs none of it
    from tqdm import tqdm

    from lfssao.bench.work_precision import page, plot, run
    from lfssao.bench.work_precision.advise import read_result
    from lfssao.bench.work_precision.settings import FULL, QUICK
    from lfssao.core.files import check_folder, output_folder, write_text

    if options.threads > numba.config.NUMBA_NUM_THREADS:
        raise InputError(f"--threads: {options.threads} are more than the {numba.config.NUMBA_NUM_THREADS} there are")
    check_folder(options.output)
    mesh, grid = load(options.scene), QUICK if options.quick else FULL
    file = options.output / _JSON
    result = _started(file, run.start(mesh, grid, options.threads))
    numba.set_num_threads(options.threads)

    def save() -> None:
        write_text(file, json.dumps(result, indent=1, allow_nan=False) + "\n")

    with output_folder(options.output):
        steps = run.steps(grid, result)
        with tqdm(total=steps, unit="step", disable=None, leave=False, **bar_size()) as bar:

            def tick(what: str) -> None:
                bar.set_postfix_str(what)
                bar.update()

            run.run(mesh, grid, options.threads, result, save, tick)
        measured = read_result(file)
        plot.save_plots(measured, options.output)
        write_text(file.with_suffix(".md"), page.as_text(measured) + "\n")
    print(page.as_text(measured))


def _started(file: Path, fresh: dict[str, Any]) -> dict[str, Any]:
    """The file's result of the same run, to go on with; else a fresh result."""
    from lfssao.bench.work_precision.advise import read_result  # late: --help needs none of it

    if not file.exists():
        return fresh
    held = read_result(file)
    if held["setup"] != fresh["setup"]:
        raise InputError(f"{file}: it holds figures of another scene, setting, version or machine: give another -o")
    return held


def _advise(options: argparse.Namespace) -> None:
    from lfssao.bench.work_precision.advise import advice, load_warning, read_result  # late: --help needs none of it

    result = read_result(options.file)
    print(f"{advice(result, options.error, options.max_error, options.max_ms)} {load_warning(result)}".rstrip())
