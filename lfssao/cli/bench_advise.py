"""``lfssao bench advise``: which setting to take for an error or a time."""

import argparse
from pathlib import Path

from lfssao.bench.work_precision.advise import COMMAND, COMMITTED, ERRORS, advice, read_result
from lfssao.cli import values
from lfssao.cli.bench_work_precision import FIGURES, FOLDER
from lfssao.errors import InputError


def add_to(advise: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    file = FOLDER / FIGURES
    advise.description = f"One sentence from the figures of '{COMMAND}', else from those of benchmarks/RESULTS.md."
    advise.set_defaults(run=_advise)
    limit = advise.add_mutually_exclusive_group(required=True)
    limit.add_argument("--max-error", metavar="X", type=values.positive, help="largest error of occlusion")
    limit.add_argument("--max-ms", metavar="Y", type=values.positive, help="longest processor time, milliseconds")
    kinds = "; ".join(f"{name}: {title}" for name, (title, _, _) in ERRORS.items())
    advise.add_argument("--error", choices=tuple(ERRORS), default="visibility", help=kinds)
    radii = "radii measured, fractions of the scene's diagonal (the first)"
    advise.add_argument("--radii", metavar="R,...", type=values.radii, help=radii)
    advise.add_argument("--from", dest="file", metavar="FILE", type=Path, help=f"the figures ({file}, if it is there)")


def _advise(options: argparse.Namespace) -> None:
    file = options.file or next((file for file in (FOLDER / FIGURES, COMMITTED) if file.exists()), None)
    if file is None:
        raise InputError(f"there are no figures: '{COMMAND} --quick' makes some, or give --from FILE")
    radii = options.radii and [radius / 100 if percent else radius for radius, percent in options.radii]
    print(advice(read_result(file), options.error, options.max_error, options.max_ms, radii))
    if options.file is None:
        print(f"(figures of {file}; '{COMMAND}' makes your machine's)")
