"""``lfssao bench stability``: stiff and extreme cases against exact arithmetic."""

import argparse
from pathlib import Path

from lfssao.bench.stability import report
from lfssao.bench.stability.cases import CASES
from lfssao.cli.terminal import BROKEN
from lfssao.cli.values import PICTURES, check_target


def add_to(stability: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    stability.description = (
        "Stiff and extreme cases in float32 and float64 against exact arithmetic: errors, decisions flipped, and "
        "whether they stay within what error analysis states. Exit code 1 if one does not."
    )
    stability.set_defaults(run=_stability)
    stability.add_argument("--json", metavar="FILE", type=Path, help="write the table as JSON, too")
    stability.add_argument("--plot", metavar="FILE", type=Path, help=f"draw the sequences: {', '.join(PICTURES)}")


def _stability(options: argparse.Namespace) -> int:
    if options.plot is not None:
        check_target("--plot", options.plot, PICTURES)
    rows = [row for case in CASES for row in case.rows()]
    print(report.as_text(rows))
    if options.json is not None:
        report.write_json(rows, options.json)
    if options.plot is not None:
        report.save_plot(options.plot)
    return BROKEN if any(row.verdict == "broken" for row in rows) else 0
