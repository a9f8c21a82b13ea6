"""``lfssao bench stability``: stiff and extreme cases against exact arithmetic, and against float64."""

import argparse
from pathlib import Path

from lfssao.bench.stability import report
from lfssao.cli.terminal import BROKEN, progress
from lfssao.cli.values import PICTURES, check_target


def add_to(stability: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    stability.description = """Stiff and extreme cases: the mapping, LF's decisions and estimators that are written as
        formulas against exact arithmetic, every estimator in float32 against float64. Printed is what is degraded or
        refused, or has no exact value. Exit code 1 if a case is not as stated."""
    stability.set_defaults(run=_stability)
    stability.add_argument("--all", action="store_true", help="print all rows")
    stability.add_argument("--json", metavar="FILE", type=Path, help="write the table as JSON, too; -: print that")
    stability.add_argument("--plot", metavar="FILE", type=Path, help=f"draw the whole table: {', '.join(PICTURES)}")


def _stability(options: argparse.Namespace) -> int:
    from lfssao.bench.stability.cases import CASES  # late: displays of cases compile kernels, which is shown

    if options.plot is not None:
        check_target("--plot", options.plot, PICTURES)
    rows = [row for case in progress(CASES, unit="case", leave=False) for row in case.rows()]
    printed = str(options.json) == "-"
    print(report.as_json(rows) if printed else report.as_text(rows, options.all))
    if options.json is not None and not printed:
        report.write_json(rows, options.json)
    if options.plot is not None:
        report.save_plot(rows, options.plot)
    return BROKEN if any(row.verdict == "broken" for row in rows) else 0
