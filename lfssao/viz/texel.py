"""Algorithm 2 on one texel: the image points of its samples, the depths there, and the samples behind them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from lfssao.core.arguments import check_whole
from lfssao.errors import InputError, shown
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View
from lfssao.verify.bounds.explain import Sample, explainer

Texture = NDArray[np.floating[Any]]

_COLORS = {"occluded": "tab:red", "clear": "tab:blue", "undecided": "tab:orange"}
_NAMES = {
    "occluded": "behind the surface there: occluded",
    "clear": "before it, or before none: clear",
    "undecided": "undecided, by rounding",
}


def trace_texel(
    texel: tuple[int, int], view: View, gbuffer: GBuffer, samples: NDArray[np.float64], radius: float
) -> list[Sample]:
    """Return the samples of a texel, (column, row), with their image points and the depths there.

    InputError if the texel is not of the view, or shows no surface, or samples or radius are none.
    """
    if not isinstance(texel, tuple | list) or len(texel) != 2:
        raise InputError(f"texel is {shown(texel)}, it must be a column and a row")
    column = check_whole("texel: its column", texel[0], 0, view.width - 1)
    texel = column, check_whole("texel: its row", texel[1], 0, view.height - 1)
    if not np.isfinite(gbuffer.depth[texel[1], texel[0]]):
        raise InputError(f"texel {texel} shows no surface")
    return explainer(gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius)(texel)


def occluded_fraction(samples: Sequence[Sample]) -> float:
    """Fraction of a texel's samples, at least one, that are occluded: Algorithm 2's occlusion, but for rounding."""
    if len(samples) == 0:
        raise InputError("there are no samples")
    return sum(s.outcome == "occluded" for s in samples) / len(samples)


def draw_texel(texel: tuple[int, int], depth: Texture, samples: Sequence[Sample]) -> Figure:
    """Return a figure of the steps: the texel in its texture, its samples' image points, their z and the depth there.

    The texel is (column, row), depth (H, W) in metres behind the screen, and samples are those of ``trace_texel``.
    """
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    whole, near, side = figure.subplots(1, 3, width_ratios=(1, 1, 1.1))
    landed = [sample for sample in samples if sample.texel is not None]
    u = texel[0] + 0.5
    v = texel[1] + 0.5
    # Half the edge of the square of texels, about this one, that holds all image points in the texture.
    half = float(np.ceil(max((max(abs(s.u - u), abs(s.v - v)) for s in landed), default=0.0))) + 1.5
    for axes in (whole, near):
        axes.imshow(np.ma.masked_invalid(depth), cmap="gray_r", extent=(0, depth.shape[1], depth.shape[0], 0))
        axes.set(xlabel="u, texels", ylabel="v, texels")
    frame = Rectangle((u - half, v - half), 2 * half, 2 * half, fill=False, color="tab:green", linewidth=1.5)
    whole.add_patch(frame)
    whole.set(title="1. the texel in the depth texture")
    near.plot(u, v, "+", color="tab:green", markersize=12, markeredgewidth=2, label="P")
    near.set(xlim=(u - half, u + half), ylim=(v + half, v - half), title="2. the samples, mapped into it")
    _draw_near(near, landed)
    _draw_depths(side, depth, texel, landed)
    figure.legend(loc="outside lower center", ncols=5, fontsize="small")
    figure.suptitle(f"texel {texel}: {occluded_fraction(samples):.3g} of {len(samples)} samples are occluded")
    return figure


def _draw_near(axes: Any, landed: Sequence[Sample]) -> None:
    for outcome, color in _COLORS.items():
        places = [(s.u, s.v) for s in landed if s.outcome == outcome]
        if places:
            axes.plot(*zip(*places, strict=True), "o", color=color, markeredgecolor="white", label=_NAMES[outcome])
    for s in landed:
        axes.annotate(str(s.number), (s.u, s.v), (4, 4), textcoords="offset points", fontweight="bold")


def _draw_depths(axes: Any, depth: Texture, texel: tuple[int, int], landed: Sequence[Sample]) -> None:
    for sample in landed:
        color = _COLORS[sample.outcome]
        surface = sample.z - sample.depth_behind
        if np.isfinite(surface):
            axes.plot([sample.number] * 2, [surface, sample.z], color=color, linewidth=1.5)
            axes.plot(sample.number, surface, "_", color="black", markersize=16, markeredgewidth=2)
        axes.plot(sample.number, sample.z, "o", color=color)
    axes.axhline(float(depth[texel[1], texel[0]]), color="tab:green", linewidth=0.8, linestyle="--")
    axes.plot([], [], "_", color="black", markersize=12, markeredgewidth=2, label="surface there")
    axes.set(title="3. their z, and the surface's there", xlabel="sample", ylabel="z, metres")
    axes.xaxis.get_major_locator().set_params(integer=True)
