"""``lfssao bench stability``: stiff and extreme cases against exact arithmetic."""

import argparse
from pathlib import Path
from typing import Any

from lfssao.errors import InputError

_PICTURES = (".png", ".svg", ".pdf")
BROKEN = 1


def add_to(benches: Any) -> None:
    """Add the bench to the parser."""
    stability = benches.add_parser(
        "stability",
        allow_abbrev=False,
        help="stiff and extreme cases, against exact arithmetic",
        description="Stiff and extreme cases in float32 and float64 against exact arithmetic: errors, decisions "
        "flipped, and whether they stay within what error analysis states. Exit code 1 if one does not.",
    )
    stability.set_defaults(run=_stability)
    stability.add_argument("--json", metavar="FILE", type=Path, help="write the table as JSON, too")
    stability.add_argument("--plot", metavar="FILE", type=Path, help=f"draw the sequences: {', '.join(_PICTURES)}")


def _stability(options: argparse.Namespace) -> int:
    if options.plot is not None and options.plot.suffix not in _PICTURES:
        raise InputError(f"{options.plot}: its name must end in one of {', '.join(_PICTURES)}")
    from lfssao.bench.stability import report  # late: --help needs none of it
    from lfssao.bench.stability.cases import CASES

    rows = [row for case in CASES for row in case.rows()]
    print(report.as_text(rows))
    if options.json is not None:
        report.write_json(rows, options.json)
    if options.plot is not None:
        report.save_plot(options.plot)
    return BROKEN if any(row.verdict == "broken" for row in rows) else 0
