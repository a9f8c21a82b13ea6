"""``lfssao bench``: measurements of the implementation. A bench is a file of this folder, listed here."""

import argparse

BENCHES = {
    "stability": "stiff and extreme cases of the mapping and of every estimator",
    "work-precision": "error against run time, of every estimator",
    "advise": "which setting to take for an error or a time",
}


def add_to(bench: argparse.ArgumentParser) -> None:
    """Add the benches."""
    bench.description = "Measure what this implementation gets right, and what that costs."
    benches = bench.add_subparsers(metavar="BENCH")
    for name, line in BENCHES.items():
        benches.add_parser(name, help=line, file=f"bench_{name.replace('-', '_')}")
