"""``lfssao bench work-precision``: error against run time, of every estimator."""

import argparse
import json
from pathlib import Path

import numba

from lfssao.bench.work_precision import page, plot, run
from lfssao.bench.work_precision.advise import read_result
from lfssao.bench.work_precision.settings import FULL, QUICK, SCENES
from lfssao.cli import values
from lfssao.cli.terminal import progress, working
from lfssao.errors import InputError
from lfssao.files.whole import check_folder, output_folder, write_text
from lfssao.scene.builtin import find_scene

FOLDER = Path("work-precision")
FIGURES = "work-precision.json"


def add_to(measure: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    measure.description = """Time and errors of every estimator by sampler, number of samples, radii and blur, against
        many samples and against rays. An interrupted run goes on where it was when the command is given again."""
    measure.set_defaults(run=_measure)
    add = measure.add_argument
    names = ", ".join(SCENES)
    add("scene", nargs="*", default=SCENES, metavar="SCENE", help=f"embedded scenes or mesh files ({names})")
    add("--quick", action="store_true", help="few settings: minutes instead of half an hour")
    add("--threads", type=values.threads, default=numba.config.NUMBA_NUM_THREADS, help="threads (all)")
    add("-o", "--output", metavar="DIR", type=Path, default=FOLDER, help=f"folder ({FOLDER})")


def _measure(options: argparse.Namespace) -> None:
    if options.threads > numba.config.NUMBA_NUM_THREADS:
        raise InputError(f"--threads: {options.threads} are more than the {numba.config.NUMBA_NUM_THREADS} there are")
    check_folder(options.output)
    meshes = [find_scene(name) for name in options.scene]
    grid = QUICK if options.quick else FULL
    file = options.output / FIGURES
    result = run.start(meshes, grid, options.threads)
    if file.exists():  # of the same run, to go on with
        held = read_result(file)
        if held["setup"] != result["setup"]:
            raise InputError(f"{file}: it holds figures of other scenes, settings, version or machine: give another -o")
        result = held

    with output_folder(options.output):

        def save() -> None:
            write_text(file, json.dumps(result, separators=(",", ":"), allow_nan=False) + "\n")

        with progress(total=run.steps(result), unit="step", leave=False) as bar:
            for name in run.run(meshes, grid, options.threads, result, save):
                bar.set_postfix_str(name)
                bar.update()
        measured = read_result(file)
        with working("draw"):
            plot.save_plots(measured, options.output)
        write_text(file.with_suffix(".md"), page.as_text(measured) + "\n")
    print(page.as_text(measured))
