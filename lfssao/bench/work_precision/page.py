"""The page of a work-precision run, Markdown made from its JSON alone."""

from collections.abc import Iterable, Sequence
from itertools import groupby
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
from lfssao.bench.work_precision.slopes import BEFORE_THE_LIMIT, THEORY, fitted_slope

TITLES = {"model": "model error: against ray-cast occlusion", "sampling": "sampling error: against many samples"}

# Limits that the page has a sentence for: RMSE, and milliseconds.
_ERRORS = {"model": (0.15, 0.12, 0.1), "sampling": (0.05, 0.02, 0.01)}
_TIMES = (0.5, 1.0, 3.0, 10.0)


def as_text(result: dict[str, Any]) -> str:
    """Settings to take, both fronts, the references' own errors, slopes beside theory, times by sampler."""
    points = points_of(result)
    out = ["# Error against run time", "", _about(result), "", "![both errors over the time](work-precision.png)"]
    out += ["", "## Which setting to take", *_sentences(result, points)]
    for error in ERRORS:
        out += ["", f"## Pareto front, {TITLES[error]}", "", *_front(points, error)]
    sampled = [p for p in points if p["reference_error"] is not None]
    if sampled:
        out += ["", "## References", "", *_references(sampled), "", "## Slopes", "", *_slopes(sampled)]
        out += ["", "## Time by sampler", "", *_samplers(sampled)]
    return "\n".join(out)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A Markdown table whose columns are aligned; the first is text, the others are numbers."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    rule = ["-" * widths[0], *("-" * (w - 1) + ":" for w in widths[1:])]
    aligned = [[line[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(line[1:], widths[1:], strict=True))]
               for line in lines]  # fmt: skip
    return ["| " + " | ".join(line) + " |" for line in (aligned[0], rule, *aligned[1:])]


def _about(result: dict[str, Any]) -> str:
    setup, machine = result["setup"], result["setup"]["machine"]
    return (
        f"{setup['scene']}, {setup['width']}x{setup['height']}, {machine['threads']} threads of "
        f"{machine['processor']}, commit {str(setup.get('commit'))[:10]}. Times are of ao, merge and blur, compiled. "
        f"{load_warning(result)}"
    ).strip()


def _sentences(result: dict[str, Any], points: Sequence[Point]) -> list[str]:
    """One for each error or time, each said once."""
    out = []
    for error in ERRORS:
        if usable(points, error):
            said = [advice(result, error, max_error=limit) for limit in _ERRORS[error]]
            said = [f"Error of at most {limit:g}: {text}" for limit, text in zip(_ERRORS[error], said, strict=True)]
            said += [f"At most {limit:g} ms: {advice(result, error, max_ms=limit)}" for limit in _TIMES]
            out += ["", *(f"- {text}" for text in said)]
    return out


def _front(points: Sequence[Point], error: str) -> list[str]:
    rows = [(describe(p), f"{p['ms']:.3f}", f"{p[error]:.5f}") for p in pareto_front(points, error)]
    return _table(("setting", "ms", "RMSE"), rows)


def _references(points: Sequence[Point]) -> list[str]:
    """Errors of the references by estimator, and the points that they do not serve."""
    rows, failing = [], []
    for name, group in groupby(sorted(points, key=lambda p: p["estimator"]), key=lambda p: p["estimator"]):
        own = list(group)
        served = [p["sampling"] for p in own if p["reference_serves"]]
        worst = max(p["reference_error"] for p in own)
        smallest = f"{min(served):.2g}" if served else "-"
        rows.append((name, f"{worst:.2g}", smallest, f"{len(served)} of {len(own)}"))
        failing += [p for p in own if not p["reference_serves"]]
    out = _table(("estimator", "largest own error", "smallest error known", "points served"), rows)
    if failing:
        out += ["", "Errors below ten times their reference's own, hollow in the plot, in no front and no slope:", ""]
        out += [f"- {describe(p)}: {p['sampling']:.2g}, reference {p['reference_error']:.2g}" for p in failing]
    return out


def _slopes(points: Sequence[Point]) -> list[str]:
    """Slopes of one radius without blur; points whose reference does not serve are left out."""
    rows = []

    def key(p: Point) -> tuple[str, str]:
        return p["estimator"], p["sampler"]

    plain = [p for p in points if p["radii"] == 1 and not p["blur"] and p["dtype"] == "float32"]
    for (estimator, sampler), group in groupby(sorted(plain, key=key), key=key):
        served = [p for p in group if p["reference_serves"]]
        fitted = fitted_slope([p["samples"] for p in served], [p["sampling"] for p in served])
        measured = "-" if fitted is None else f"{fitted[0]:.2f} +- {fitted[1]:.2f}"
        edge, smooth = (f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else ("-", "-")
        rows.append((estimator, sampler, measured, edge, smooth, BEFORE_THE_LIMIT.get(sampler, "")))
    head = ("estimator", "sampler", "slope", "theory, edge", "smooth", "")
    return [*_table(head, rows), "", "Theory is of two dimensions and in the limit; texels and the spread of distances "
            "in the ball are in the measured ones."]  # fmt: skip


def _samplers(points: Sequence[Point]) -> list[str]:
    """How far the samplers' times are apart at equal counts, of the points that have a time of their own."""
    plain = [p for p in points if p["radii"] == 1 and not p["blur"] and p["dtype"] == "float32"]
    own = [p for p in plain if p["time_of"] == p["sampler"]]
    samplers = sorted({p["sampler"] for p in own})
    rows = []
    for name, group in groupby(sorted(own, key=lambda p: p["estimator"]), key=lambda p: p["estimator"]):
        most = {p["sampler"]: p for p in sorted(group, key=lambda p: p["samples"])}
        cells = [f"{most[s]['ms']:.2f} ({most[s]['samples']})" if s in most else "-" for s in samplers]
        rows.append((name, *cells))
    out = ["Milliseconds of one radius without blur, float32, at the largest number of samples that each has a time of "
           "its own for (in brackets); the order of the points is the order in which memory is read.", ""]  # fmt: skip
    shared = sorted({p["samples"] for p in plain} - {p["samples"] for p in own})
    out += _table(("estimator", *samplers), rows)
    if shared:
        timed = next(p["time_of"] for p in plain if p["samples"] == shared[0])
        out += ["", f"With {', '.join(map(str, shared))} samples, sampler '{timed}' is timed for all."]
    return out
