"""``lfssao bench advise``: which setting to take for an error or a time."""

import argparse
from pathlib import Path

from lfssao.bench.work_precision.advise import advice, load_warning, read_result
from lfssao.cli import values
from lfssao.cli.bench_work_precision import FIGURES, FOLDER


def add_to(advise: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    advise.description = "One sentence from the figures of 'lfssao bench work-precision'."
    advise.set_defaults(run=_advise)
    limit = advise.add_mutually_exclusive_group(required=True)
    limit.add_argument("--max-error", metavar="X", type=values.positive, help="largest RMSE of occlusion")
    limit.add_argument("--max-ms", metavar="Y", type=values.positive, help="longest time, milliseconds")
    against = "against ray-cast occlusion (the default) or against many samples"
    advise.add_argument("--error", choices=("model", "sampling"), default="model", help=against)
    file = FOLDER / FIGURES
    advise.add_argument("--from", dest="file", metavar="FILE", type=Path, default=file, help=f"the figures ({file})")


def _advise(options: argparse.Namespace) -> None:
    result = read_result(options.file)
    print(f"{advice(result, options.error, options.max_error, options.max_ms)} {load_warning(result)}".rstrip())
