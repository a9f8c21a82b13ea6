"""The picture of a work-precision run, made from its JSON alone."""

from pathlib import Path
from typing import Any

from matplotlib import colormaps
from matplotlib.figure import Figure

from lfssao.bench.work_precision.advise import ERRORS, pareto_front, points_of
from lfssao.bench.work_precision.page import TITLES
from lfssao.core.files import write_whole


def draw(result: dict[str, Any]) -> Figure:
    """Return a figure of both errors over the time, a panel each, logarithmic.

    A line joins the settings of an estimator that none of its own beats, a thick one those that no other beats. Points
    whose sampling error is less than ten times that of their reference are hollow, and on no line.
    """
    setup = result["setup"]
    figure = Figure(figsize=(14, 6.5), layout="constrained")
    figure.suptitle(
        f"{setup['scene']}, {setup['width']}x{setup['height']}, {setup['machine']['threads']} threads of "
        f"{setup['machine']['processor']}",
        fontsize="medium",
    )
    points = points_of(result)
    panels = figure.subplots(1, 2)
    for axes, error in zip(panels, ERRORS, strict=True):
        axes.set(xscale="log", yscale="log", xlabel="median time, ms", ylabel="RMSE of ao", title=TITLES[error])
        front = [p for p in pareto_front(points, error) if p[error]]
        if front:
            thick: dict[str, Any] = {"color": "0.15", "linewidth": 5, "alpha": 0.35, "label": "Pareto front"}
            axes.plot([p["ms"] for p in front], [p[error] for p in front], "-", **thick)
        for k, name in enumerate(result["estimators"]):
            own = [p for p in points if p["estimator"] == name and p[error]]
            style: dict[str, Any] = {"color": colormaps["tab20"](k % 20), "markersize": 3.5}
            best = pareto_front(own, error)
            axes.plot([p["ms"] for p in best], [p[error] for p in best], "-", label=name, linewidth=1.3, **style)
            for full in (True, False):
                some = [p for p in own if (error == "model" or p["reference_serves"]) == full]
                style |= {"markerfacecolor": style["color"] if full else "none", "markeredgewidth": 0.7, "alpha": 0.6}
                axes.plot([p["ms"] for p in some], [p[error] for p in some], "o", **style)
        axes.grid(which="both", alpha=0.2)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", fontsize="small")
    return figure


def save_plots(result: dict[str, Any], folder: Path) -> None:
    """Write work-precision.png and .svg into a folder, each whole.

    InputError if one cannot be written.
    """
    figure = draw(result)
    for ending in (".png", ".svg"):
        write_whole(folder / f"work-precision{ending}", lambda part: figure.savefig(part, dpi=110))
