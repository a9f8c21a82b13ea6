"""The pictures of a work-precision run, made from its JSON alone."""

from functools import partial
from pathlib import Path
from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lfssao.bench.work_precision import advise
from lfssao.bench.work_precision.advise import Point
from lfssao.files.whole import write_whole

FAMILIES = {
    "LF and other balls": ("lf", "point", "hemisphere", "oriented-hemisphere"),
    "VO, whole ball": ("vo-points", "vo-lines", "vo-area"),
    "VO, above the tangent plane": ("vo-points-normal", "vo-lines-normal"),
    "SAO": ("alchemy", "sao", "sao-equation-1"),
    "horizons and levels": ("hbao", "gtao", "visibility-bitmask", "multiresolution"),
}
_MARKERS = "osD^vP*X<>dph"


def draw(result: dict[str, Any], error: str) -> Figure:
    """Return a figure of one error over the time at the first radii, a panel each family and one for all.

    Colours are estimators, markers samplers, lines join numbers of samples. The last panel has all points in grey and
    the Pareto front. Dashed lines are no AO and the best constant, a dotted one the truth's own error.
    """
    grid = result["setup"]["grid"]
    radii = grid["radii"][0]
    blur = 0.0 if error == "sampling" else max(grid["blurs"])
    points = [p for p in advise.points_of(result, error, radii) if p["blur"] == blur]
    figure = Figure(figsize=(11, 11), layout="constrained")
    scenes = len(result["setup"]["scenes"])
    title = advise.ERRORS[error][0]
    title = f"{title}: {advise.describe_radii(radii)}, blur {blur:g}, mean of {scenes} scenes"
    figure.suptitle(title, fontsize="medium")
    scales = {"xscale": "log", "yscale": "log" if error == "sampling" else "linear"}
    panels = figure.subplots(3, 2, sharex=True, sharey=True, subplot_kw=scales).ravel()
    samplers = sorted({p["sampler"] for p in points if p["sampler"] is not None})
    for axes, (family, names) in zip(panels, FAMILIES.items(), strict=False):
        for k, name in enumerate(names):
            _draw_estimator(axes, [p for p in points if p["estimator"] == name], samplers, k, name)
        own = [p for p in points if p["estimator"] in names]
        _decorate(axes, own, family)
        axes.set_visible(bool(own))
        if own:
            axes.legend(fontsize="x-small", loc="lower left")
    _draw_front(panels[-1], points, error)
    handles = [
        panels[-1].plot([], [], marker, color="0.3", linestyle="", label=name)[0]
        for name, marker in zip([*samplers, "its own"], _MARKERS, strict=False)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=6, fontsize="small")
    return figure


def _draw_estimator(axes: Axes, points: list[Point], samplers: list[str], k: int, name: str) -> None:
    color = colormaps["tab10"](k)
    label = name
    for sampler in (*samplers, None):
        own = sorted((p for p in points if p["sampler"] == sampler), key=lambda p: p["ms"])
        if own:
            marker = _MARKERS[len(samplers) if sampler is None else samplers.index(sampler)]
            style: dict[str, Any] = {"marker": marker, "markersize": 4.5, "linewidth": 0.7, "alpha": 0.75}
            axes.plot([p["ms"] for p in own], [p["error"] for p in own], color=color, label=label, **style)
            label = ""


def _decorate(axes: Axes, points: list[Point], title: str) -> None:
    """Labels and the points' null lines; sampling errors have none."""
    axes.set(xlabel="processor time, ms", ylabel="error")
    axes.label_outer()
    axes.grid(which="both", alpha=0.15)
    axes.set_title(title, fontsize="medium")
    edge: dict[str, Any] = {"xycoords": axes.get_yaxis_transform(), "va": "bottom", "ha": "right"}
    for null in map(dict, {tuple(point["null"].items()) for point in points if point["null"]}):
        for name, style, text in ("none", "--", "no AO"), ("constant", "-.", "best constant"), ("truth", ":", "truth"):
            axes.axhline(null[name], color="0.4", linewidth=0.9, linestyle=style)
            axes.annotate(text, (1, null[name]), fontsize="xx-small", color="0.3", **edge)
        axes.set_ylim(0, 1.5 * null["none"])  # what is worse by more lies above


def _draw_front(axes: Axes, points: list[Point], error: str) -> None:
    front = advise.pareto_front(points, advise.NOISE)
    axes.plot([p["ms"] for p in points], [p["error"] for p in points], ".", color="0.75", markersize=3)
    axes.plot([p["ms"] for p in front], [p["error"] for p in front], "o-", color="tab:red", markersize=4)
    near: dict[str, Any] = {"xytext": (3, 3), "textcoords": "offset points", "fontsize": "small"}
    for k, point in enumerate(front, 1):
        axes.annotate(str(k), (point["ms"], point["error"]), color="tab:red", **near)
    names = "\n".join(f"{k} {advise.describe(point).rsplit(',', 1)[0]}" for k, point in enumerate(front, 1))
    place: dict[str, Any] = {"y": 0.98, "va": "top"} if error == "sampling" else {"y": 0.08, "va": "bottom"}
    axes.text(x=0.99, s=names, transform=axes.transAxes, ha="right", fontsize=7, **place)
    _decorate(axes, [] if error.startswith("own") else points, "all, with the Pareto front")


def save_plots(result: dict[str, Any], folder: Path) -> None:
    """Write work-precision-ERROR.png of each error into a folder, each whole; InputError if one cannot be written."""
    for error in advise.ERRORS:
        if advise.points_of(result, error):
            picture = draw(result, error)
            write_whole(folder / f"work-precision-{error}.png", partial(picture.savefig, dpi=80))
