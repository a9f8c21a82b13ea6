"""Error of an estimator against the number of samples, by sampler."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers
from lfssao.samples import sample_set
from lfssao.viz.panels import mark_decades


@dataclass(frozen=True, eq=False)
class SamplingError:
    """Error by sampler and number of samples."""

    counts: NDArray[np.int64]  # (c,) int64: numbers of samples
    # (c,) float64 by sampler: root mean square, over surface texels and seeds, of occlusion less the reference
    rmse: dict[str, NDArray[np.float64]]
    reference: str  # samples and sampler of the reference

    def slope(self, method: str) -> float:
        """Exponent of the power of n that fits a sampler's error best (least squares of the logarithms)."""
        return float(np.polyfit(np.log(self.counts), np.log(self.rmse[method]), 1)[0])


def sampling_error(
    buffers: Buffers,
    radius: float,
    methods: Sequence[str],
    counts: Sequence[int],
    seeds: Sequence[int] = (0, 1, 2, 3),
    reference: tuple[str, int] = ("sobol", 4096),
) -> SamplingError:
    """Return the error of ``lf`` against itself with many samples: for each sampler and number, over all seeds.

    Samplers are of the ball; their sets fill all of it. The reference is a sampler that is not compared, and its number
    of samples. InputError if a name is unknown.
    """
    seen = np.isfinite(buffers.depth)

    def occlusion(method: str, n: int, seed: int) -> NDArray[np.float64]:
        points = sample_set("ball", method, n, seed).points
        return np.asarray(estimate("lf", buffers, radius, points).texture[seen], np.float64)

    exact = occlusion(*reference, seeds[0])
    rmse = {
        method: np.sqrt([np.mean([(occlusion(method, n, seed) - exact) ** 2 for seed in seeds]) for n in counts])
        for method in methods
    }
    return SamplingError(np.array(counts), rmse, f"{reference[1]} samples of {reference[0]}")


def draw_sampling_error(found: SamplingError) -> Figure:
    """Return a figure of the errors on logarithmic axes, each sampler with its slope."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log", xlabel="samples n", ylabel="RMSE of ao")
    for (method, rmse), marker in zip(found.rmse.items(), "osD^vP*X" * len(found.rmse), strict=False):
        axes.plot(found.counts, rmse, marker=marker, markersize=5, label=f"{method}: n^{found.slope(method):.2f}")
    first = max(rmse[0] for rmse in found.rmse.values())
    axes.plot(found.counts, first * np.sqrt(found.counts[0] / found.counts), "--", color="gray", label="n^-0.5")
    axes.set_xticks(found.counts, [str(n) for n in found.counts])
    mark_decades(axes, "y")
    axes.grid(alpha=0.3)
    axes.set_title(f"against {found.reference}", fontsize="medium")
    axes.legend(fontsize="small")
    return figure


def draw_sampler_gallery(methods: Sequence[str], n: int) -> Figure:
    """Return a figure of one set of n points of each of some samplers of the square, side by side."""
    figure = Figure(figsize=(1.7 * len(methods), 2.3), layout="constrained")
    for axes, method in zip(figure.subplots(1, len(methods), squeeze=False)[0], methods, strict=True):
        axes.plot(*sample_set("square", method, n).points.T, "o", markersize=3)
        axes.set(aspect="equal", xlim=(-1, 1), ylim=(-1, 1), xticks=(-1, 0, 1), yticks=(-1, 0, 1), title=method)
        axes.set(xlabel="$\\xi_1$", ylabel="$\\xi_2$")
        axes.label_outer()
    return figure
