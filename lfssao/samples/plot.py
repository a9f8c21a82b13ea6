"""Figure of a sample set: its points, its radii, its periodogram, its pair correlation."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lfssao.core.files import write_whole
from lfssao.samples import statistics
from lfssao.samples.sets import SampleSet

_COORDINATES = {"square": ("xi_1", "xi_2"), "disk": ("r^2", "phi"), "sphere": ("z", "phi"), "ball": ("z / r", "phi")}


def draw_samples(made: SampleSet, r_min: float = 0.0, r_max: float = 1.0) -> Figure:
    """Return a figure of four panels: points, radial histogram, periodogram, pair correlation; radii are the ball's.

    The last two take the two coordinates that Algorithm 3 spreads evenly, mapped to [0, 1]; both wrap.
    """
    cube = statistics.unit_cube(made.points, made.domain, r_min, r_max)[:, :2]
    figure = Figure(figsize=(16, 4.4), layout="constrained")
    figure.suptitle(f"{made.method}, {len(made.points)} points, {made.domain}, seed {made.seed}")
    _draw_points(figure, made)
    _draw_radii(figure.add_subplot(1, 4, 2), made, r_min, r_max)
    first, second = _COORDINATES[made.domain]
    axes = figure.add_subplot(1, 4, 3, title="periodogram (independent: 1)")
    axes.set(xlabel=f"frequency in {first}", ylabel=f"frequency in {second}")
    extent = (-32.5, 32.5, -32.5, 32.5)
    picture = axes.imshow(statistics.periodogram(cube), origin="lower", extent=extent, vmin=0, vmax=4, cmap="viridis")
    figure.colorbar(picture, ax=axes, shrink=0.8, extend="max")
    axes = figure.add_subplot(1, 4, 4, title="pair correlation (independent: 1)", xlabel="distance x sqrt(n)")
    if len(cube) > 1:
        axes.plot(*statistics.pair_correlation(cube))
    axes.axhline(1.0, color="gray", linewidth=0.8)
    axes.set_ylim(bottom=0)
    return figure


def _draw_points(figure: Figure, made: SampleSet) -> None:
    size = max(2.0, min(30.0, 3000 / len(made.points)))
    weights = {} if made.weights is None else {"s": size * made.weights / float(np.mean(made.weights))}
    if made.points.shape[1] == 3:
        axes: Any = figure.add_subplot(1, 4, 1, projection="3d", title="points")
        axes.scatter(*made.points.T, **({"s": size} | weights), c=made.points[:, 2], cmap="coolwarm")
        axes.set_box_aspect((1, 1, 1))
        return
    axes = figure.add_subplot(1, 4, 1, title="points", aspect="equal")
    axes.scatter(*made.points.T, **({"s": size} | weights))
    if made.domain == "disk":
        turn = np.linspace(0, 2 * np.pi, 200)
        axes.plot(np.cos(turn), np.sin(turn), color="gray", linewidth=0.8)
    else:
        axes.set(xlim=(-1, 1), ylim=(-1, 1), xlabel="xi_1", ylabel="xi_2")


def _draw_radii(axes: Any, made: SampleSet, r_min: float, r_max: float) -> None:
    """The histogram of the distances from the centre, over the density of a uniform set."""
    r = np.sqrt(np.sum(made.points**2, axis=1))
    reach = {"square": 2**0.5, "ball": r_max}.get(made.domain, 1.0)
    edges = np.linspace(0, reach * 1.0001, 31)
    axes.set(title="distances from the centre", xlabel="r")
    axes.hist(r, edges, density=True, alpha=0.6)
    at = np.linspace(0, reach, 300)
    if made.domain == "disk":
        axes.plot(at, 2 * at, color="black", label="uniform")
    elif made.domain == "ball" and r_min < r_max:
        axes.plot(at, np.where(at >= r_min, 3 * at**2 / (r_max**3 - r_min**3), 0), color="black", label="uniform")
    elif made.domain == "square":
        corner = np.pi / 2 - 2 * np.arccos(np.minimum(1 / np.maximum(at, 1), 1))
        axes.plot(at, at * np.where(at > 1, corner, np.pi / 2), color="black", label="uniform")


def save_samples(made: SampleSet, path: Path, r_min: float = 0.0, r_max: float = 1.0) -> None:
    """Draw a set, as ``draw_samples`` does, into a file as a picture of its ending; InputError if that fails."""
    figure = draw_samples(made, r_min, r_max)
    write_whole(path, lambda part: figure.savefig(part, dpi=110))
