"""Error of blurred occlusion against its unblurred limit: a blur takes away noise, and detail."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.ao import post
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples
from lfssao.viz.truth import Texture, deviation


@dataclass(frozen=True, eq=False)
class BlurError:
    """Error by number of samples and width of the blur."""

    sigmas: NDArray[np.float64]  # (s,) float64: standard deviations of the Gaussian, texels
    # (s,) float64 by number of samples: root mean square, over surface texels, of blurred occlusion less the reference
    rmse: dict[int, NDArray[np.float64]]
    lost: NDArray[np.float64]  # (s,) float64: that of the reference, blurred: without noise
    reference: str  # samples and sampler of the reference

    def best(self, n: int) -> float:
        """Sigma of the least error with n samples, texels."""
        return float(self.sigmas[self.rmse[n].argmin()])


def blur_error(
    buffers: Buffers,
    radius: float,
    counts: Sequence[int],
    sigmas: Sequence[float],
    sampler: str = "latin",
    reference: tuple[str, int] = ("sobol", 1024),
) -> BlurError:
    """Return the error of ``lf`` after a blur, against itself with many samples, not turned and not blurred.

    Samples are of a sampler of the ball, and turn by the buffers' turns. InputError if a name, a number or a sigma is
    wrong.
    """
    surface = np.isfinite(buffers.depth)
    still = replace(buffers, turns=None)
    exact = estimate("lf", still, radius, make_samples(*reference)).texture

    def errors(texture: Texture) -> NDArray[np.float64]:
        return np.array([deviation(post.blur(texture, sigma), exact, surface).rmse for sigma in sigmas])

    rmse = {n: errors(estimate("lf", buffers, radius, make_samples(sampler, n)).texture) for n in counts}
    name = f"{reference[1]} samples of {reference[0]}, not blurred"
    return BlurError(np.array(sigmas, np.float64), rmse, errors(exact), name)


def draw_blur_error(found: BlurError) -> Figure:
    """Return a figure of the errors over the blur, a line a number of samples, a ring at its least."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.add_subplot(xlabel="sigma of the blur, texels", ylabel="RMSE of ao")
    for (n, rmse), marker in zip(found.rmse.items(), "osD^vP*X" * len(found.rmse), strict=False):
        (line,) = axes.plot(found.sigmas, rmse, marker=marker, markersize=5, label=f"{n} samples")
        axes.plot(found.best(n), rmse.min(), "o", markersize=13, fillstyle="none", color=line.get_color())
    axes.plot(found.sigmas, found.lost, "--", color="gray", label="no noise: detail that the blur takes")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.set_title(f"against {found.reference}", fontsize="medium")
    axes.legend(fontsize="small")
    return figure
