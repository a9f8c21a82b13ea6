"""Power of a verdict 'inside': the width of the intervals, and the smallest error of AO that they detect.

Any texture lies inside intervals of 0 to 1, so that verdict proves little. To measure its power, the renderer's AO is
multiplied by one factor after the other, stored again, and judged by the same intervals.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lfssao.ao.post import shade
from lfssao.optics.view import without_guard
from lfssao.verify.bounds.bounds import Bounds, Texture
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import VIEW, Arrays, Case
from lfssao.verify.compare.layers import is_occlusion
from lfssao.verify.judge import stage_inputs
from lfssao.verify.verdict import Flags, Verdict, interval_verdict

# Factors on AO, tried in turn; a verdict is weak if AO times WEAK would be inside as well.
FACTORS = (0.999, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5)
WEAK = 0.95
# A texture has enough AO if AO, or its darkening of the image, exceeds DARK at a SHARE of the surface's texels, in the
# renderer's texture or the reference's. Times WEAK, such AO changes by at least half a code of 8 bits.
DARK = 0.05
SHARE = 0.01

Fails = Callable[[Texture], bool]


@dataclass(frozen=True)
class Power:
    """The power of the verdict that a texture is inside its intervals."""

    width: float  # median of upper - lower over the surface's texels and channels, in the texture's unit
    factor: float | None = None  # largest of FACTORS with which AO would fail; None if it never fails
    # Share of the surface's texels with AO above DARK, 0 to 1; None if the texture has no AO or it is unknown.
    share: float | None = None
    weak: bool = False  # whether there is a SHARE of AO and AO x WEAK would be inside

    def __str__(self) -> str:
        width = f"median width {self.width:.3g}"
        if self.share is None:
            return width
        if self.factor is not None:
            return f"{width}; AO x {self.factor:g} would be outside"
        if self.share < SHARE:
            return f"{width}; there is hardly any AO"
        return f"{width}; even AO x {FACTORS[-1]:g} would pass"


@dataclass(frozen=True, eq=False)
class _ShownOcclusion:
    """The AO in a texture."""

    rendered: Texture  # (H, W), the renderer's
    reference: Texture  # the reference's
    image: Texture | None = None  # (H, W, 3), shaded by AO; None if the texture is AO itself
    lit: tuple[Any, ...] = ()  # normals and the light

    def scaled(self, factor: float, stored: TextureFormat | None) -> Texture:
        """The texture with AO times a factor, after storing."""
        ao = self.rendered * np.float32(factor)
        texture = ao if self.image is None else shade(self.image, ao, *self.lit)
        return texture if stored is None else stored.round_trip(texture)

    def share(self, surface: Flags) -> float:
        """Share of the surface's texels at which AO, or its darkening of the image, exceeds DARK."""
        if not surface.any():
            return 0.0
        darkening = np.maximum(self.rendered, self.reference)
        if self.image is not None:
            bright, dark = (shade(self.image, ao, *self.lit) for ao in (np.zeros_like(darkening), darkening))
            darkening = (bright - dark).max(axis=2)
        return float((darkening[surface] > DARK).mean())


def power_of(name: str, mine: Arrays, case: Case, bounds: Bounds, stored: TextureFormat | None, fails: Fails) -> Power:
    """The power of a texture's bounds; the texture is inside.

    ``mine`` are the renderer's textures by their names. ``fails`` tells whether another texture would fail, tolerances
    included. The verdict on a case of a kit is never weak: a case is small, and some are designed for undecided
    samples.
    """
    shape = bounds.lower.shape[:2]
    surface = _surface(case, shape)
    shown = _shown_occlusion(name, mine, case)
    width = _median_width(bounds, surface)
    if shown is None:
        return Power(width)
    share = shown.share(surface)
    factor = next((factor for factor in FACTORS if fails(shown.scaled(factor, stored))), None)
    if share < SHARE or case.stage != VIEW:
        return Power(width, factor, share)
    verdict = interval_verdict(bounds.outside(shown.scaled(WEAK, stored)), bounds.outliers)
    return Power(width, factor, share, verdict is Verdict.INSIDE)


def _median_width(bounds: Bounds, surface: Flags) -> float:
    lower = bounds.lower[surface]
    upper = bounds.upper[surface]
    widths = np.subtract(upper, lower, out=np.zeros_like(lower), where=upper != lower)  # both may be infinite
    return float(np.median(widths)) if widths.size else 0.0


def _surface(case: Case, shape: tuple[int, ...]) -> Flags:
    """Flags of texels that show a surface, all if depth is not known; depth may have a guard band."""
    depth: Any = {**case.inputs, **case.outputs}.get("depth")
    if depth is None or depth.ndim != 2 or len(shape) != 2:
        return np.ones(shape, np.bool_)
    surface: Flags = np.isfinite(without_guard(depth, (depth.shape[0] - shape[0]) // 2))
    return surface


def _shown_occlusion(name: str, mine: Arrays, case: Case) -> _ShownOcclusion | None:
    """The AO in a texture; None if it has none, or if its image or AO are not known."""
    if is_occlusion(name) or name == "occlusion":
        return _ShownOcclusion(mine[name], case.outputs[name])
    inputs = stage_inputs(mine, case)
    if name != "shaded" or not {"image", "blurred"} <= set(inputs):
        return None
    reference = case.outputs.get("blurred", inputs["blurred"])
    guard = int(case.parameters["guard"])
    light = case.parameters.get("light")
    lit = () if light is None else (without_guard(inputs["normals"], guard), light)
    return _ShownOcclusion(inputs["blurred"], reference, without_guard(inputs["image"], guard), lit)
