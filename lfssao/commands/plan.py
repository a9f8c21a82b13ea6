"""``lfssao plan``: what a render would run and what it would leave out, and why; nothing is rendered."""

import argparse
import json
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from lfssao.commands.render import add_options, prepare
from lfssao.commands.terminal import printable

if TYPE_CHECKING:
    from lfssao.plan import Cut


def add_to(commands: Any) -> None:
    """Add the command to the parser."""
    plan = commands.add_parser(
        "plan",
        allow_abbrev=False,
        help="what a render would run and what it would leave out, and why",
        description="Print what 'lfssao render' with the same options would run, what it would leave out because the "
        "scene does not need it, why, and what that is expected to save. Nothing is rendered, nothing is written.",
    )
    plan.set_defaults(run=_plan)
    add_options(plan, output=False)
    plan.add_argument("--json", action="store_true", help="print JSON: all cuts, and the window of every module")


def _plan(options: argparse.Namespace) -> None:
    work, _ = prepare(options)
    from lfssao.plan import make_plan  # late: reads files

    plan = make_plan(work.mesh, work.views, work.settings, work.boxes)
    if options.json:
        views = [
            {"name": name, "size": list(view.whole[2:]), "window": list(view.window) if view.window.texels else None}
            for name, view in plan.views
        ]
        print(json.dumps({"scene": work.scene, "cuts": plan.summary(), "views": views}, indent=1, allow_nan=False))
        return
    for line in _table(plan.cuts):
        print(printable(line))


_HEADS = ("", "run", "left out", "saved", "about ms", "when")
_INDENT = 6


def _table(cuts: "tuple[Cut, ...]") -> list[str]:
    """Two lines or more for each cut, its numbers and its reason, under a line of heads."""
    rows = [_HEADS]
    for cut in cuts:
        saved = "" if cut.saving is None else f"{100 * cut.saving:.0f} %"
        ms = "" if cut.milliseconds is None else f"{cut.milliseconds:.0f}"
        rows.append((cut.what, _number(cut.run), _number(cut.left_out), saved, ms, cut.when))
    widths = [max(len(row[k]) for row in rows) for k in range(len(_HEADS))]
    lines = []
    for number, row in enumerate(rows):
        cells = [f"{row[k]:>{w}}" if 0 < k < len(row) - 1 else f"{row[k]:{w}}" for k, w in enumerate(widths)]
        lines.append("  ".join(cells).rstrip())
        if number:
            cut = cuts[number - 1]
            lines += wrap(
                f"{cut.where}: {cut.reason}", 100, initial_indent=" " * _INDENT, subsequent_indent=" " * _INDENT
            )
    return lines


def _number(count: int | None) -> str:
    return "" if count is None else f"{count:,}"
