"""Figure of a sample set, or of many: points, histograms of their coordinates, periodogram, pair correlation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lfssao.samples import statistics
from lfssao.samples.sets import FloatArray, SampleSet


def draw_samples(sets: Sequence[SampleSet], r_min: float = 0.0, r_max: float = 1.0) -> Figure:
    """Return a figure of sets of one domain, the points of all together; radii are the ball's.

    Histograms of the coordinates have the band of 2 sigma of as many independent uniform points. Periodogram, its
    radial mean and pair correlation are means over the sets; they take the two coordinates that Algorithm 3 spreads
    evenly, mapped to [0, 1]; both wrap.
    """
    first = sets[0]
    cubes = [statistics.unit_cube(samples.points, samples.domain, r_min, r_max) for samples in sets]
    pooled = np.concatenate(cubes)
    names = {"square": ("xi_1", "xi_2"), "disk": ("r", "phi")}.get(first.domain, ("z", "phi", "r"))[: pooled.shape[1]]
    figure = Figure(figsize=(3.4 * (1 + len(names)), 6), layout="constrained")
    many = f"{first.method}, seed {first.seed}" if len(sets) == 1 else f"{first.method} and {len(sets) - 1} more"
    figure.suptitle(f"{many}: {len(pooled)} points, {first.domain}")
    grid = figure.add_gridspec(2, 1 + len(names))
    _draw_points(figure, grid[0, 0], sets)
    for k, name in enumerate(names):
        _draw_histogram(figure.add_subplot(grid[0, k + 1]), name, pooled[:, k], first.domain, r_min / r_max)
    flat = ("r^2", "phi") if first.domain == "disk" else names[:2]
    power = np.mean([statistics.periodogram(cube[:, :2]) for cube in cubes], axis=0)
    axes = figure.add_subplot(grid[1, 0], title="periodogram (independent: 1)")
    axes.set(xlabel=f"frequency in {flat[0]}", ylabel=f"frequency in {flat[1]}")
    extent = (-32.5, 32.5, -32.5, 32.5)
    picture = axes.imshow(power, origin="lower", extent=extent, vmin=0, vmax=4, cmap="viridis")
    figure.colorbar(picture, ax=axes, shrink=0.8, extend="max")
    frequency, mean, sigma = statistics.radial_mean(power)
    axes = figure.add_subplot(grid[1, 1], title="its radial mean (2 sigma)", xlabel="frequency")
    half = 2 * sigma / np.sqrt(len(sets))
    axes.fill_between(frequency, 1 - half, 1 + half, color="gray", alpha=0.3)
    axes.plot(frequency, mean)
    axes.set_ylim(bottom=0)
    axes = figure.add_subplot(grid[1, 2], title="pair correlation (independent: 1)", xlabel="distance x sqrt(n)")
    if all(len(cube) > 1 for cube in cubes):
        axes.plot(*np.mean([statistics.pair_correlation(cube) for cube in cubes], axis=0))
    axes.axhline(1.0, color="gray", linewidth=0.8)
    axes.set_ylim(bottom=0)
    return figure


def _draw_points(figure: Figure, place: Any, sets: Sequence[SampleSet]) -> None:
    points = np.concatenate([samples.points for samples in sets])
    weights = sets[0].weights
    size: Any = max(2.0, min(30.0, 3000 / len(points)))
    if len(sets) == 1 and weights is not None:
        size = size * weights / float(np.mean(weights))
    solid = points.shape[1] == 3
    axes: Any = figure.add_subplot(place, projection="3d" if solid else None, title="points", aspect="equal")
    axes.scatter(*points.T, s=size, c=points[:, -1], cmap="coolwarm")
    if not solid:
        axes.set(xlim=(-1, 1), ylim=(-1, 1))


def _draw_histogram(axes: Any, name: str, values: FloatArray, domain: str, inner: float) -> None:
    """Shares of the points in steps of a coordinate, whose value in the unit cube is given, over the fair shares."""
    n = len(values)
    u = np.linspace(0, 1, int(np.clip(n // 10, 4, 30)) + 1)
    edges, label = (360 * u, "phi, degrees") if name == "phi" else (2 * u - 1, name)
    if name == "r":
        edges = inner + (1 - inner) * u
        label = "r, of the largest"
        u = edges**2 if domain == "disk" else (edges**3 - inner**3) / (1 - inner**3)
    fair = np.diff(u)
    sigma = np.sqrt(fair * (1 - fair) / n)
    axes.stairs(fair + 2 * sigma, edges, baseline=fair - 2 * sigma, fill=True, color="gray", alpha=0.3)
    axes.stairs(fair, edges, color="black", linewidth=0.8, baseline=None)
    axes.stairs(np.histogram(np.clip(values, 0, 1), u)[0] / n, edges, baseline=None, color="C0", linewidth=1.5)
    axes.set(title=f"share by {name} (2 sigma)", xlabel=label)
    axes.set_ylim(bottom=0)
