"""The table of stiff cases as text and as JSON, and the picture of the sequences."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from lfssao.bench.sequences import curves
from lfssao.bench.stability import Row
from lfssao.files import write_whole

# A sequence of more inputs than this is one line a path in the text: its worst.
_MANY = 8


def as_text(rows: Iterable[Row]) -> str:
    """The table; errors in texels and in ulp of the coordinate, or of one texel where that is more."""
    line = "{:<20} {:<46} {:<8} {:>9} {:>9} {:>9} {:>9} {:>8}  {}"
    out = [line.format("case", "input", "path", "condition", "ulp", "texels", "bound", "flipped", "verdict")]
    for _, group in groupby(rows, key=lambda row: row.case):
        for row, count in _shown(list(group)):
            m = row.measured
            numbers = ("-",) * 5 if m is None else (
                *(f"{n:.2g}" for n in (m.condition, m.ulp, m.texels, m.bound)), f"{m.flipped}/{m.decisions}",
            )  # fmt: skip
            text = row.input if count == 1 else f"{row.input} (worst of {count})"
            verdict = f"{row.verdict}: {row.reason}" if row.reason else row.verdict
            out.append(line.format(row.case, text, row.path, *numbers, verdict))
    return "\n".join(out)


def _shown(rows: list[Row]) -> list[tuple[Row, int]]:
    """The rows of a case that its text has, each with how many it stands for."""
    paths = {row.path: [other for other in rows if other.path == row.path] for row in rows}
    if max(len(group) for group in paths.values()) <= _MANY:
        return [(row, 1) for row in rows]
    order = ("within bound", "refused", "degraded as stated", "broken")
    worst = [
        max(g, key=lambda r: (order.index(r.verdict), r.measured.ulp if r.measured else 0)) for g in paths.values()
    ]
    return [(row, len(paths[row.path])) for row in worst]


def write_json(rows: Iterable[Row], path: Path) -> None:
    """All rows and both curves of each sequence, written whole; an infinity, where no bound is known, as null.

    Parameters
    ----------
    rows : iterable of Row
        The table.
    path : Path
        The file.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    data = {"rows": [asdict(row) for row in rows], "sequences": curves()}
    text = json.dumps(_finite(data), indent=1, allow_nan=False)

    def write(part: Path) -> None:
        part.write_text(text + "\n", encoding="utf-8")

    write_whole(path, write)


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def save_plot(path: Path) -> None:
    """Draw the errors of both formulas near both slits, a panel each.

    Parameters
    ----------
    path : Path
        The picture; its ending says of what kind.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    from matplotlib.figure import Figure  # late: takes a second to import

    figure = Figure(figsize=(12, 8), layout="constrained")
    for number, (name, points) in enumerate(curves().items(), start=1):
        axes = figure.add_subplot(2, 2, number, title=f"near the {name}", xlabel="k: z is within 2^-k of the slit",
                                  ylabel="largest error, ulp", yscale="log")  # fmt: skip
        k, ours, straightforward = zip(*points, strict=True)
        axes.plot(k, ours, label="m_z - z, as in the kernels" if "lens" in name else "z_o - z, as in the kernels")
        axes.plot(k, straightforward, label="1 - z / m_z" if "lens" in name else "1 - z / z_o")
        axes.legend()
    write_whole(path, lambda part: figure.savefig(part, dpi=110))
