"""Pictures and text of a work-precision run, made from its JSON alone."""

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lfssao.bench.advise import ERRORS, Point, describe, pareto_front, points_of
from lfssao.bench.slopes import THEORY, fitted_slope
from lfssao.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TITLES = {"model": "model error: against ray-cast occlusion", "sampling": "sampling error: against many samples"}


def draw(result: dict[str, Any]) -> "Figure":
    """A figure of both errors over the time, a panel each, logarithmic; the Pareto front is a line.

    Points whose sampling error is less than ten times that of their reference are drawn hollow.
    """
    from matplotlib import colormaps  # late: takes a second to import
    from matplotlib.figure import Figure

    setup = result["setup"]
    figure = Figure(figsize=(13, 6), layout="constrained")
    figure.suptitle(
        f"{setup['scene']}, {setup['width']}x{setup['height']}, {setup['machine']['threads']} threads of "
        f"{setup['machine']['processor']}",
        fontsize="medium",
    )
    points = points_of(result)
    names = list(result["estimators"])
    for axes, error in zip(figure.subplots(1, 2), ERRORS, strict=True):
        axes.set(xscale="log", yscale="log", xlabel="median time, ms", ylabel="RMSE of ao", title=_TITLES[error])
        for k, name in enumerate(names):
            own = [p for p in points if p["estimator"] == name and p[error]]
            for full in (True, False):
                some = [p for p in own if (error == "model" or p["reference_serves"]) == full]
                color = colormaps["tab20"](k % 20)
                axes.plot([p["ms"] for p in some], [p[error] for p in some], "o", markersize=4, color=color,
                          markerfacecolor=color if full else "none", label=name if full and some else None)  # fmt: skip
        front = [p for p in pareto_front(points, error) if p[error]]
        if front:
            axes.plot([p["ms"] for p in front], [p[error] for p in front], "k-", linewidth=1, label="Pareto front")
            axes.legend(fontsize="x-small", ncols=2)
        axes.grid(alpha=0.3)
    return figure


def save_plots(result: dict[str, Any], folder: Path) -> None:
    """Write work-precision.png and .svg into a folder, each whole.

    Raises
    ------
    InputError
        If one cannot be written.
    """
    figure = draw(result)
    for ending in (".png", ".svg"):
        write_whole(folder / f"work-precision{ending}", lambda part: figure.savefig(part, dpi=110))


def as_text(result: dict[str, Any]) -> str:
    """The Pareto fronts, the slopes beside theory, and the table of face counts."""
    points = points_of(result)
    out = []
    for error in ERRORS:
        out += [f"Pareto front, {_TITLES[error]}"]
        out += [f"  {p['ms']:10.3f} ms  {p[error]:.5f}  {describe(p)}" for p in pareto_front(points, error)]
    sampled = [p for p in points if p["reference_error"] is not None]
    if sampled:
        failing = sum(not p["reference_serves"] for p in sampled)
        out.append(
            f"References: own error {min(p['reference_error'] for p in sampled):.2g} to "
            f"{max(p['reference_error'] for p in sampled):.2g}; {failing} of {len(sampled)} points are less than ten "
            "times that and are marked"
        )
    out += _slopes(sampled)
    out += _face_counts(result["face_counts"])
    return "\n".join(out)


def _slopes(points: list[Point]) -> list[str]:
    """Slopes of one radius without blur; points whose reference does not serve are left out."""
    line = "  {:18} {:10} {:>8}   {}"
    out = [line.format("estimator", "sampler", "slope", "theory in 2D: edge, smooth")]

    def key(p: Point) -> tuple[str, str]:
        return p["estimator"], p["sampler"]

    plain = [p for p in points if p["radii"] == 1 and not p["blur"] and p["dtype"] == "float32"]
    for (estimator, sampler), group in groupby(sorted(plain, key=key), key=key):
        told = [p for p in group if p["reference_serves"]]
        slope = fitted_slope([p["samples"] for p in told], [p["sampling"] for p in told])
        theory = ", ".join(f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else "-"
        out.append(line.format(estimator, sampler, "-" if slope is None else f"{slope:.2f}", theory))
    return out if len(out) > 1 else []


def _face_counts(table: dict[str, Any] | None) -> list[str]:
    if table is None:
        return []
    low, high = table["lf_ms"]
    out = [f"LF table 1: 1024x768, mean of {table['frames']} frames"]
    out += [
        f"  {row['model']:10} {row['faces']:8} faces, {row['surface']:4.0%} surface: {row['without_ms']:8.2f} ms "
        f"without, {row['with_ms']:8.2f} ms with, SSAO {row['ssao_ms']:8.2f} ms"
        for row in table["rows"]
    ]
    ours, theirs = table["spread_per_cent"], table["lf_spread_per_cent"]
    return [*out, f"  spread of SSAO {ours:.1f} %; LF: {low} to {high} ms, {theirs:.1f} %"]
