"""Agreement of occlusion on the surface: means, correlation and regression, inside of surfaces and at silhouettes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from lfssao.verify.verdict import Flags, Plane

PARTS = ("interiors", "silhouettes")
_STEP = 0.01  # of the range of depths


@dataclass(frozen=True)
class Agreement:
    """The agreement of two textures on the texels of a part that are finite in both."""

    texels: int
    mean: float  # of the other renderer's
    reference_mean: float
    # The least squares fit is mine = slope reference + offset. Slope and offset are None if the reference is constant,
    # the correlation if either texture is.
    correlation: float | None
    slope: float | None
    offset: float | None
    within_1e5: float  # share of texels that are off by at most 1e-5
    within_code: float  # by at most 1/255, a code of 8 bits

    def words(self, part: str) -> str:
        """The agreement in a sentence; ``part`` is one of ``PARTS``."""
        regression = "" if self.slope is None else f"mine = {self.slope:.4g} reference {self.offset:+.4g}, "
        correlation = "" if self.correlation is None else f"correlation {self.correlation:.4f}, "
        shares = f"{100 * self.within_1e5:.4g} % within 1e-5, {100 * self.within_code:.4g} % within 1/255"
        means = f"mean {self.mean:.4g} for {self.reference_mean:.4g}"
        return f"{part}: {self.texels} texels, {means}, {correlation}{regression}{shares}"


def surface_parts(depth: NDArray[np.float32], height: int) -> dict[str, Flags]:
    """Flags of texels inside of surfaces and at silhouettes, for ``height`` rows; depth may have a guard band.

    A texel belongs to a silhouette if one of the 3 x 3 texels around it shows no surface, or if the second difference
    of depth along its row or column exceeds 1 % of the texture's range. A plane has no second difference in a camera's
    depth.
    """
    surface = np.isfinite(depth)
    depths = depth.astype(np.float64)
    edges: Flags = np.asarray(sliding_window_view(np.pad(~surface, 1), (3, 3)).any(axis=(2, 3)))
    step = _STEP * np.ptp(depths[surface]) if surface.any() else 0.0
    with np.errstate(invalid="ignore"):  # no surface
        edges[1:-1] |= np.abs(np.diff(depths, 2, axis=0)) > step
        edges[:, 1:-1] |= np.abs(np.diff(depths, 2, axis=1)) > step
    guard = (depth.shape[0] - height) // 2
    inside = slice(guard, -guard or None), slice(guard, -guard or None)
    return {part: (flags & surface)[inside] for part, flags in zip(PARTS, (~edges, edges), strict=True)}


def agreements(mine: Plane, reference: Plane, parts: Mapping[str, Flags]) -> dict[str, Agreement]:
    """The agreement of a layer of occlusion, (H, W), on each part that has texels."""
    found = {}
    for part, flags in parts.items():
        finite = flags & np.isfinite(mine) & np.isfinite(reference)
        if finite.any():
            found[part] = _agreement(mine[finite].astype(np.float64), reference[finite].astype(np.float64))
    return found


def _agreement(mine: NDArray[np.float64], reference: NDArray[np.float64]) -> Agreement:
    error = np.abs(mine - reference)
    mean = float(mine.mean())
    reference_mean = float(reference.mean())
    x = reference - reference_mean
    y = mine - mean
    xx, xy, yy = (float((a * b).sum()) for a, b in ((x, x), (x, y), (y, y)))
    slope = xy / xx if xx > 0 else None
    return Agreement(
        texels=mine.size,
        mean=mean,
        reference_mean=reference_mean,
        correlation=xy / (xx * yy) ** 0.5 if xx * yy > 0 else None,
        slope=slope,
        offset=None if slope is None else mean - slope * reference_mean,
        within_1e5=float((error <= 1e-5).mean()),
        within_code=float((error <= 1 / 255).mean()),
    )
