"""The difference picture of one module: both textures of each stage, their difference, and each texel's verdict."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_whole
from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.metrics import difference, span
from lfssao.verify.verdict import FAILED, Judgement, Verdict, texels

WIDTH = 480  # largest side of a panel, pixels
WORST_RANK = 2  # of panels that show what is wrong
_MOST_ROWS = 12
_FORMATS = (".png", ".svg", ".pdf")
_COLORS = ("#e6e6e6", "#5b8def", "#d62728")
_MEANINGS = ("equal bits", "differs, right", "outside, or differs where no interval is known")


class Panels:
    """The small panels of one module: textures as 8-bit colours, and maxima of differences and verdicts."""

    def __init__(self, module: str) -> None:
        self.module = module
        self.rank = 0
        self.rows: list[dict[str, Any]] = []

    def offer(self, mine: Layer, reference: Layer, judgement: Judgement) -> None:
        """Keep a stage; of stages with equal bits only the first, until a stage differs."""
        verdict = judgement.verdict
        rank = 0 if verdict is Verdict.EQUAL_BITS else 1 if verdict.code < FAILED else WORST_RANK
        if (self.rows and rank == 0) or len(self.rows) >= _MOST_ROWS:
            return
        if self.rank == 0:
            self.rows = []
        self.rank = max(self.rank, rank)
        differing = texels(judgement.differing)
        outside = texels(judgement.outside)
        step = step_of(differing.shape)
        self.rows.append(
            {
                "title": f"{reference.name}: {verdict.title}",
                "reference": colors_of(reference, reference, step),
                "mine": colors_of(mine, reference, step),
                "difference": largest(difference(mine.planes, reference.planes), step),
                "verdict": largest(differing.astype(np.uint8) + outside, step),
            }
        )


def step_of(shape: tuple[int, ...]) -> int:
    """The side, texels, of the blocks that a preview of a texture, (H, W), shows as one pixel."""
    return max(1, -(-max(shape) // WIDTH))


def colors_of(layer: Layer, reference: Layer, step: int) -> NDArray[np.uint8]:
    """Codes (H, W, 3) of each ``step``-th texel, scaled by the reference's range: colours in sRGB, others unchanged.

    Infinity is white. Layers whose channels are the reference's R, G and B are colours.
    """
    low, high = span(reference.texture)
    planes = [plane[::step, ::step] for plane in (layer.planes[:3] if len(layer.planes) >= 3 else layer.planes[:1] * 3)]
    with np.errstate(all="ignore"):
        scaled = [(plane.astype(np.float64) - low) / ((high - low) or 1.0) for plane in planes]
    image = np.stack([np.nan_to_num(s, nan=1.0, posinf=1.0, neginf=0.0) for s in scaled], axis=-1)
    if layer.planes[0].dtype == np.float32 and [c.rpartition(".")[2] for c in reference.channels[:3]] == list("RGB"):
        return to_codes(image.astype(np.float32))
    return (np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8)


def scale_of(difference: NDArray[np.float64]) -> tuple[float, float]:
    """Ends of a logarithmic scale of a difference's magnitudes, at most ten decades."""
    finite = difference[(difference > 0) & np.isfinite(difference)]
    high = float(finite.max(initial=0)) or 1.0
    return min(max(float(finite.min(initial=high)), 1e-10 * high), 0.9 * high), high


def largest(array: NDArray[Any], step: int) -> NDArray[Any]:
    """The largest value of each block of step x step texels, none negative: one wrong texel stays visible."""
    rows, columns = (np.arange(0, size, step) for size in array.shape)
    most: NDArray[Any] = np.maximum.reduceat(np.maximum.reduceat(array, rows, axis=0), columns, axis=1)
    return most


def save_panels(panels: Panels | None, path: Path) -> None:
    """Draw the picture into a .png, .svg or .pdf; InputError if there is nothing to draw or it cannot be written."""
    if path.suffix not in _FORMATS:
        raise InputError(f"{path}: its name must end in one of {', '.join(_FORMATS)}")
    if panels is None or not panels.rows:
        raise InputError(f"{path}: no texture could be compared, there is nothing to draw")
    from matplotlib.colors import ListedColormap  # late: takes a second to import
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    rows = panels.rows
    figure = Figure(figsize=(14, 1.0 + 2.7 * len(rows)), layout="constrained")
    grid = figure.subplots(len(rows), 4, squeeze=False)
    for axes, row in zip(grid, rows, strict=True):
        for plot, name in zip(axes, ("reference", "mine"), strict=False):
            plot.imshow(row[name], interpolation="nearest")
            plot.set_title(name, fontsize="medium")
        axes[0].set_ylabel(row["title"], fontsize="medium")
        _draw_difference(figure, axes[2], row["difference"])
        axes[3].imshow(row["verdict"], cmap=ListedColormap(_COLORS), vmin=0, vmax=2, interpolation="nearest")
        axes[3].set_title("verdict", fontsize="medium")
        for plot in axes:
            plot.set_xticks([])
            plot.set_yticks([])
    figure.suptitle(panels.module)
    patches = [Patch(color=c, label=text) for c, text in zip(_COLORS, _MEANINGS, strict=True)]
    figure.legend(handles=patches, loc="outside lower center", ncols=3, fontsize="medium")
    write_whole(path, lambda part: figure.savefig(part, dpi=100))


def _draw_difference(figure: Any, axes: Any, difference: NDArray[np.float64]) -> None:
    """Draw magnitudes on a logarithmic scale; 0 is grey, infinite magenta."""
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm

    axes.set_title("difference (magenta: NaN or infinity)", fontsize="medium")
    colors = colormaps["viridis"].with_extremes(bad="#e6e6e6", over="magenta")
    low, high = scale_of(difference)
    # Equal numbers are masked, as a logarithm has no place for them; infinite ones are `over`.
    clipped = np.where(np.isfinite(difference), np.clip(difference, low, high), 2 * high)
    shown = np.ma.masked_array(clipped, difference == 0)
    image = axes.imshow(shown, cmap=colors, norm=LogNorm(low, high), interpolation="nearest")
    figure.colorbar(image, ax=axes, shrink=0.8)
