"""The table of stiff cases as text and as JSON, and the picture of the sequences."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from matplotlib.figure import Figure

from lfssao.bench.stability.sequences import curves
from lfssao.bench.stability.table import Row
from lfssao.core.files import write_text, write_whole

# The text lists all inputs of a case up to this number; beyond it the worst of each path and verdict.
_MANY = 8


def as_text(rows: Iterable[Row]) -> str:
    """The table as text: errors in texels, and in ulp of the coordinate or of one texel, whichever is more."""
    line = "{:<20} {:<46} {:<8} {:>9} {:>9} {:>9} {:>9} {:>8}  {}"
    out = [line.format("case", "input", "path", "condition", "ulp", "texels", "bound", "flipped", "verdict")]
    for _, group in groupby(rows, key=lambda row: row.case):
        for row, count in _shown(list(group)):
            m = row.measured
            numbers = ["-"] * 5
            if m is not None:
                numbers = [f"{n:.2g}" for n in (m.condition, m.ulp, m.texels, m.bound)]
                numbers.append(f"{m.flipped}/{m.decisions}")
            text = row.input if count == 1 else f"{row.input} (worst of {count})"
            verdict = f"{row.verdict}: {row.reason}" if row.reason else row.verdict
            out.append(line.format(row.case, text, row.path, *numbers, verdict))
    return "\n".join(out)


def _shown(rows: list[Row]) -> list[tuple[Row, int]]:
    """The rows of a case to print, each with the number of rows that it stands for."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.path, row.verdict), []).append(row)
    if len(rows) <= _MANY * len({row.path for row in rows}):
        return [(row, 1) for row in rows]
    worst = [max(group, key=lambda row: row.measured.ulp if row.measured else 0) for group in groups.values()]
    return [(row, len(groups[row.path, row.verdict])) for row in worst]


def write_json(rows: Iterable[Row], path: Path) -> None:
    """Write all rows and both curves of each sequence; an infinity, where no bound is known, becomes null.

    InputError if the file cannot be written.
    """
    data = {"rows": [asdict(row) for row in rows], "sequences": curves()}
    write_text(path, json.dumps(_finite(data), indent=1, allow_nan=False) + "\n")


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def save_plot(path: Path) -> None:
    """Draw the errors of both formulas near both slits, a panel each, as a picture of the path's ending.

    InputError if the file cannot be written.
    """
    figure = Figure(figsize=(12, 8), layout="constrained")
    for number, (name, points) in enumerate(curves().items(), start=1):
        axes = figure.add_subplot(2, 2, number, title=f"near the {name}")
        axes.set(xlabel="k: z is within 2^-k of the slit", ylabel="largest error, ulp")
        axes.set_yscale("symlog", linthresh=1)  # errors may be 0
        slit = "m_z" if "lens" in name else "z_o"
        k, ours, straightforward = zip(*points, strict=True)
        axes.plot(k, ours, label=f"{slit} - z, as in the kernels")
        axes.plot(k, straightforward, label=f"1 - z / {slit}")
        axes.legend()
    write_whole(path, lambda part: figure.savefig(part, dpi=110))
