"""``lfssao bench``: what the implementation can be measured by. A bench is a file of this folder, listed here."""

from typing import Any

from lfssao.cli import bench_plan, bench_stability, bench_work_precision

BENCHES = (bench_plan, bench_stability, bench_work_precision)


def add_to(commands: Any) -> None:
    """Add the command to the parser."""
    bench = commands.add_parser(
        "bench",
        allow_abbrev=False,
        help="measure errors, stability and time",
        description="Measure what this implementation gets right, and what that costs.",
    )
    benches = bench.add_subparsers(required=True, metavar="BENCH")
    for each in BENCHES:
        each.add_to(benches)
