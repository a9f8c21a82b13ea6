"""Algorithm 2 on one texel: the image points of its samples, the depths there, and the samples behind them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View
from lfssao.verify.bounds.explain import Sample, explain

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

    InputError if the texel shows no surface.
    """
    if not np.isfinite(gbuffer.depth[texel[1], texel[0]]):
        raise InputError(f"texel {texel} shows no surface")
    return explain(texel, gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius)


def occluded_fraction(samples: Sequence[Sample]) -> float:
    """Fraction of a texel's samples that are occluded: Algorithm 2's ambient occlusion, but for rounding."""
    return sum(s.outcome == "occluded" for s in samples) / len(samples)


def draw_texel(texel: tuple[int, int], depth: Texture, samples: Sequence[Sample]) -> Figure:
    """Return a figure of the steps: the texel in its texture, its samples' image points, their z and the depth there.

    The texel is (column, row), depth (H, W) in metres behind the screen, and samples are those of ``trace_texel``.
    """
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    whole, near, side = figure.subplots(1, 3, width_ratios=(1, 1, 1.1))
    window = _window(texel, samples)
    shown = np.ma.masked_invalid(depth)
    whole.imshow(shown, cmap="gray_r", extent=_extent(depth))
    u, v, half = window
    frame = Rectangle((u - half, v - half), 2 * half, 2 * half, fill=False, color="tab:green", linewidth=1.5)
    whole.add_patch(frame)
    whole.set(title="1. the texel in the depth texture", xlabel="u, texels", ylabel="v, texels")
    _draw_near(near, shown, texel, samples, window)
    _draw_depths(side, depth, texel, samples)
    figure.legend(loc="outside lower center", ncols=5, fontsize="small")
    figure.suptitle(f"texel {texel}: {occluded_fraction(samples):.3g} of {len(samples)} samples are occluded")
    return figure


def _extent(depth: Texture) -> tuple[float, float, float, float]:
    return 0.0, float(depth.shape[1]), float(depth.shape[0]), 0.0


def _window(texel: tuple[int, int], samples: Sequence[Sample]) -> tuple[float, float, float]:
    """Middle and half the edge of the square of texels that holds all image points in the texture."""
    u, v = texel[0] + 0.5, texel[1] + 0.5
    away = [max(abs(s.u - u), abs(s.v - v)) for s in samples if s.texel is not None]
    return u, v, float(np.ceil(max(away, default=0.0))) + 1.5


def _draw_near(
    axes: Any, shown: Any, texel: tuple[int, int], samples: Sequence[Sample], window: tuple[float, float, float]
) -> None:
    u, v, half = window
    axes.imshow(shown, cmap="gray_r", extent=_extent(shown))
    axes.plot(u, v, "+", color="tab:green", markersize=12, markeredgewidth=2, label="P")
    for outcome, color in _COLORS.items():
        places = [(s.u, s.v) for s in samples if s.texel is not None and s.outcome == outcome]
        if places:
            axes.plot(*zip(*places, strict=True), "o", color=color, markeredgecolor="white", label=_NAMES[outcome])
    for sample in samples:
        if sample.texel is not None:
            label = {"textcoords": "offset points", "fontweight": "bold"}
            axes.annotate(str(sample.number), (sample.u, sample.v), (4, 4), **label)
    axes.set(xlim=(u - half, u + half), ylim=(v + half, v - half))
    axes.set(title="2. the samples, mapped into it", xlabel="u, texels", ylabel="v, texels")


def _draw_depths(axes: Any, depth: Texture, texel: tuple[int, int], samples: Sequence[Sample]) -> None:
    for sample in samples:
        color = _COLORS[sample.outcome]
        if sample.texel is None:
            continue
        surface = float(depth[sample.texel[1], sample.texel[0]])
        if np.isfinite(surface):
            axes.plot([sample.number] * 2, [surface, sample.z], color=color, linewidth=1.5)
            axes.plot(sample.number, surface, "_", color="black", markersize=16, markeredgewidth=2)
        axes.plot(sample.number, sample.z, "o", color=color)
    axes.axhline(float(depth[texel[1], texel[0]]), color="tab:green", linewidth=0.8, linestyle="--")
    axes.plot([], [], "_", color="black", markersize=12, markeredgewidth=2, label="surface there")
    axes.set(title="3. their z, and the surface's there", xlabel="sample", ylabel="z, metres")
    axes.xaxis.get_major_locator().set_params(integer=True)
