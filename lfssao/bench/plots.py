"""Pictures and text of a work-precision run, made from its JSON alone."""

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lfssao.bench.advise import ERRORS, Point, describe, pareto_front, points_of
from lfssao.bench.slopes import BEFORE_THE_LIMIT, THEORY, fitted_slope
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
    line = "  {:18} {:10} {:>14}   {}"
    out = [line.format("estimator", "sampler", "slope", "theory in 2D, in the limit: edge, smooth")]

    def key(p: Point) -> tuple[str, str]:
        return p["estimator"], p["sampler"]

    plain = [p for p in points if p["radii"] == 1 and not p["blur"] and p["dtype"] == "float32"]
    for (estimator, sampler), group in groupby(sorted(plain, key=key), key=key):
        told = [p for p in group if p["reference_serves"]]
        fitted = fitted_slope([p["samples"] for p in told], [p["sampling"] for p in told])
        measured = "-" if fitted is None else f"{fitted[0]:.2f} +- {fitted[1]:.2f}"
        theory = ", ".join(f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else "-"
        before = f" ({BEFORE_THE_LIMIT[sampler]})" if sampler in BEFORE_THE_LIMIT else ""
        out.append(line.format(estimator, sampler, measured, theory + before))
    return out if len(out) > 1 else []


def _face_counts(table: dict[str, Any] | None) -> list[str]:
    if table is None:
        return []
    out = [f"LF table 1: 1024x768, mean of {table['frames']} frames, ms"]
    for key, what in (("as_shown", "as shown"), ("equal_cover", "all as small as the least covering one")):
        part = table[key]
        out.append(f"  {what}")
        for row in part["rows"]:
            before, after = table["lf_ms"][row["model"]]
            out.append(
                f"    {row['model']:10} {row['faces']:7} faces, cover {row['cover']:4.0%}: {row['without_ms']:.2f} "
                f"without, {row['with_ms']:.2f} with, SSAO {row['ssao_ms']:.2f}, {row['ns_per_covered_texel']:.0f} ns "
                f"a covered texel; LF: {before:.2f}, {after:.2f}, {after - before:.2f}"
            )
        out.append(
            f"    spread of SSAO {part['ssao_ms_spread_per_cent']:.1f} % (of medians "
            f"{part['ssao_median_ms_spread_per_cent']:.1f} %), of the time a covered texel "
            f"{part['ns_per_covered_texel_spread_per_cent']:.1f} %; LF {table['lf_spread_per_cent']:.1f} %"
        )
    return [*out, "  A shader runs at every texel, lfssao where there is a surface: its time follows the cover."]
