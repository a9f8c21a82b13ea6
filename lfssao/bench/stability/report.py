"""The table of stiff cases as text, as JSON and as a picture."""

import json
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from lfssao.bench.stability.measure import Measured
from lfssao.bench.stability.table import BROKEN, DEGRADED, NOT_EXACT, REFUSED, WITHIN, Row
from lfssao.files.whole import write_text, write_whole

_NUMBERS = "condition", "ulp", "error", "rms", "bound"
# From best to worst.
_COLORS = {WITHIN: "#d9ead3", DEGRADED: "#f6c667", NOT_EXACT: "#eeeeee", REFUSED: "#b7c9e2", BROKEN: "#d62728"}


def as_text(rows: Sequence[Row], all_rows: bool = False) -> str:
    """The table as text: all rows, or the worst of each case and reason that is not within its bound; and counts.

    Errors are in texels, or of occlusion; ulp are of the coordinate or of one texel, whichever is more.
    """
    table = [["case", "input", "path", *_NUMBERS, "flipped", "verdict"]]
    for group in [[row] for row in rows] if all_rows else _groups(rows):
        row = max(group, key=_badness)
        text = row.input if len(group) == 1 else f"{row.input} (worst of {len(group)})"
        verdict = f"{row.verdict}: {row.reason}" if row.reason else row.verdict
        table.append([row.case, text, row.path, *_numbers(row.measured), verdict])
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    columns = "  ".join(f"{{:{side}{width}}}" for side, width in zip("<<<>>>>>><", widths, strict=True))
    out = [columns.format(*words).rstrip() for words in table]
    counts = Counter(row.verdict for row in rows)
    return "\n".join([*out, f"{len(rows)} rows: " + ", ".join(f"{counts[verdict]} {verdict}" for verdict in _COLORS)])


def _numbers(m: Measured | None) -> list[str]:
    if m is None:
        return ["-"] * 6
    numbers = (getattr(m, name) for name in _NUMBERS)
    return ["-" if n is None else f"{n:.2g}" for n in numbers] + [f"{m.flipped}/{m.decisions}"]


def _groups(rows: Sequence[Row]) -> Iterable[list[Row]]:
    """Rows of one case, verdict and reason that are not within their bound; each estimator without exact values."""
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if row.verdict != WITHIN:
            own = row.path if row.verdict == NOT_EXACT else ""
            groups.setdefault((row.case, row.verdict, row.reason, own), []).append(row)
    return groups.values()


def _badness(row: Row) -> tuple[int, float, float]:
    m = row.measured
    return list(_COLORS).index(row.verdict), m.rms or m.error if m else 0.0, m.flipped if m else 0.0


def as_json(rows: Iterable[Row]) -> str:
    """All rows as JSON, null for an infinity, where no bound is known."""
    return json.dumps({"rows": [asdict(row, dict_factory=_finite) for row in rows]}, indent=1, allow_nan=False)


def write_json(rows: Iterable[Row], path: Path) -> None:
    """Write ``as_json`` to a file; InputError if it cannot be written."""
    write_text(path, f"{as_json(rows)}\n")


def _finite(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    return {name: None if isinstance(n, float) and not math.isfinite(n) else n for name, n in fields}


def save_plot(rows: Iterable[Row], path: Path) -> None:
    """Draw the whole table: a line a case, a column a path or estimator; colours are verdicts, numbers errors.

    The worst of several rows is shown by its largest error. InputError if the file cannot be written.
    """
    worst: dict[tuple[str, str], Row] = {}
    for row in rows:
        place = row.case, row.path
        worst[place] = max(worst.get(place, row), row, key=_badness)
    cases, paths = (list(dict.fromkeys(names)) for names in zip(*worst, strict=True))
    figure = Figure(figsize=(11, 1.5 + 0.24 * len(cases)), layout="constrained")
    axes = figure.add_subplot()
    for (case, name), row in worst.items():
        x = paths.index(name)
        y = cases.index(case)
        m = row.measured
        axes.add_patch(Rectangle((x, y), 1, 1, facecolor=_COLORS[row.verdict], edgecolor="white"))
        text = "" if m is None else f"{m.error:.0e}" if m.error else "0"
        axes.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7)
    axes.set(xlim=(0, len(paths)), ylim=(len(cases), 0), frame_on=False)
    axes.set_xticks(np.arange(len(paths)) + 0.5, paths, rotation=45, ha="left")
    axes.set_yticks(np.arange(len(cases)) + 0.5, cases)
    axes.tick_params(length=0, labeltop=True, labelbottom=False)
    patches = [Rectangle((0, 0), 1, 1, facecolor=color, label=verdict) for verdict, color in _COLORS.items()]
    title = "largest error: of an image point, texels; of occlusion, against exact numbers, or float32 against float64"
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches), frameon=False, title=title)
    write_whole(path, lambda part: figure.savefig(part, dpi=110))
