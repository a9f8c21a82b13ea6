"""The page of a work-precision run, Markdown made from its JSON alone."""

from collections.abc import Iterable, Sequence
from typing import Any

from lfssao.bench.work_precision.advise import (
    ERRORS,
    Point,
    advice,
    describe,
    load_warning,
    pareto_front,
    points_of,
    usable,
)
from lfssao.bench.work_precision.references import rms
from lfssao.bench.work_precision.slopes import BEFORE_THE_LIMIT, THEORY, fitted_slope

TITLES = {"model": "model error: against ray-cast occlusion", "sampling": "sampling error: against many samples"}

# Limits, RMSE and milliseconds, for which the page has a sentence.
_ERRORS = {"model": (0.15, 0.12, 0.1), "sampling": (0.05, 0.02, 0.01)}
_TIMES = (0.5, 1.0, 3.0, 10.0)


def as_text(result: dict[str, Any]) -> str:
    """The whole page: settings to take, both fronts, errors of the references, slopes, times by sampler."""
    points = points_of(result)
    out = ["# Error against run time", "", _about(result), "", "![both errors over the time](work-precision.png)"]
    out += ["", "## Which setting to take", *_sentences(result, points)]
    for error in ERRORS:
        out += ["", f"## Pareto front, {TITLES[error]}", "", *_front(points, error)]
    sampled = [p for p in points if p["reference_error"] is not None]
    if sampled:
        out += ["", "## References", "", *_references(sampled), "", "## Slopes", "", *_slopes(sampled)]
        out += ["", "## Time by sampler", "", *_samplers(sampled)]
    if "rotations" in result:
        out += ["", "## Sampling error of samples that turn", "", *_rotations(result["rotations"])]
    return "\n".join(out)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A Markdown table whose columns are aligned; the first is text, the others are numbers."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    aligned = [[cell.rjust(width) for cell, width in zip(line, widths, strict=True)] for line in lines]
    for line in aligned:
        line[0] = line[0].strip().ljust(widths[0])
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return ["| " + " | ".join(line) + " |" for line in (aligned[0], rule, *aligned[1:])]


def _about(result: dict[str, Any]) -> str:
    setup, machine = result["setup"], result["setup"]["machine"]
    return (
        f"{setup['scene']}, {setup['width']}x{setup['height']}, {machine['threads']} threads of "
        f"{machine['processor']}, commit {str(setup.get('commit'))[:10]}. Times are of ao, merge and blur, compiled. "
        f"{load_warning(result)}"
    ).strip()


def _sentences(result: dict[str, Any], points: Sequence[Point]) -> list[str]:
    """A sentence for each limit of error and of time."""
    out = []
    for error in ERRORS:
        if usable(points, error):
            out.append("")
            for limit in _ERRORS[error]:
                out.append(f"- Error of at most {limit:g}: {advice(result, error, max_error=limit)}")
            for limit in _TIMES:
                out.append(f"- At most {limit:g} ms: {advice(result, error, max_ms=limit)}")
    return out


def _front(points: Sequence[Point], error: str) -> list[str]:
    rows = [(describe(p), f"{p['ms']:.3f}", f"{p[error]:.5f}") for p in pareto_front(points, error)]
    return _table(("setting", "ms", "RMSE"), rows)


def _rotations(rows: Sequence[Point]) -> list[str]:
    """Errors by view, radii and rotation, a column for each number of samples and blur; first those of all views."""
    cells: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        for view in ("all views", row["view"]):
            line = cells.setdefault(f"{view}, {row['radii']}, {row['rotation']}", {})
            line.setdefault(f"{row['samples']}, blur {row['blur']:g}", []).append(row["sampling"])
    lines = [(name, *(f"{rms(errors):.3f}" for errors in line.values())) for name, line in cells.items()]
    lines.sort(key=lambda line: not line[0].startswith("all"))
    share = max(row["reference_error"] / row["sampling"] for row in rows)
    note = f"RMSE of estimator lf with few samples; the references' own errors are at most {share:.2g} of these."
    return [note, "", *_table(("view, radii, rotation", *next(iter(cells.values()))), lines)]


def _groups(points: Sequence[Point], *keys: str) -> dict[tuple[str, ...], list[Point]]:
    """Points by the values of some keys, in their order."""
    out: dict[tuple[str, ...], list[Point]] = {}
    for point in points:
        out.setdefault(tuple(point[key] for key in keys), []).append(point)
    return dict(sorted(out.items()))


def _references(points: Sequence[Point]) -> list[str]:
    """Errors of the references by estimator, and the points that they do not serve."""
    rows = []
    for (name,), own in _groups(points, "estimator").items():
        served = [p["sampling"] for p in own if p["reference_serves"]]
        worst = max(p["reference_error"] for p in own)
        smallest = f"{min(served):.2g}" if served else "-"
        rows.append((name, f"{worst:.2g}", smallest, f"{len(served)} of {len(own)}"))
    out = _table(("estimator", "largest own error", "smallest error known", "points served"), rows)
    failing = [p for p in points if not p["reference_serves"]]
    if failing:
        out += ["", "Errors below ten times their reference's own, hollow in the plot, in no front and no slope:", ""]
        out += [f"- {describe(p)}: {p['sampling']:.2g}, reference {p['reference_error']:.2g}" for p in failing]
    return out


def _plain(points: Sequence[Point]) -> list[Point]:
    """Points of one radius without blur in float32."""
    return [p for p in points if p["radii"] == 1 and not p["blur"] and p["dtype"] == "float32"]


def _slopes(points: Sequence[Point]) -> list[str]:
    """Slopes of one radius without blur; points that their reference does not serve are left out."""
    rows = []
    for (estimator, sampler), own in _groups(_plain(points), "estimator", "sampler").items():
        served = [p for p in own if p["reference_serves"]]
        fitted = fitted_slope([p["samples"] for p in served], [p["sampling"] for p in served])
        measured = "-" if fitted is None else f"{fitted[0]:.2f} +- {fitted[1]:.2f}"
        edge, smooth = (f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else ("-", "-")
        rows.append((estimator, sampler, measured, edge, smooth, BEFORE_THE_LIMIT.get(sampler, "")))
    note = (
        "Theory is of two dimensions and in the limit; texels and the spread of distances in the ball are in the "
        "measured ones."
    )
    return [*_table(("estimator", "sampler", "slope", "theory, edge", "smooth", ""), rows), "", note]


def _samplers(points: Sequence[Point]) -> list[str]:
    """Times by sampler at equal counts, of the points that have a time of their own."""
    plain = _plain(points)
    own = [p for p in plain if p["time_of"] == p["sampler"]]
    samplers = sorted({p["sampler"] for p in own})
    rows = []
    for (name,), group in _groups(own, "estimator").items():
        most = {p["sampler"]: p for p in sorted(group, key=lambda p: p["samples"])}
        cells = [f"{most[s]['ms']:.2f} ({most[s]['samples']})" if s in most else "-" for s in samplers]
        rows.append((name, *cells))
    note = (
        "Milliseconds of one radius without blur, float32, at the largest number of samples that each has a time of "
        "its own for (in brackets); the order of the points is the order in which memory is read."
    )
    out = [note, "", *_table(("estimator", *samplers), rows)]
    shared = sorted({p["samples"] for p in plain} - {p["samples"] for p in own})
    if shared:
        timed = next(p["time_of"] for p in plain if p["samples"] == shared[0])
        out += ["", f"With {', '.join(map(str, shared))} samples, sampler '{timed}' is timed for all."]
    return out
