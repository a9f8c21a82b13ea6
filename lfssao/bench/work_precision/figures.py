"""Figures of an occlusion texture against the truth or many samples, and of the textures that need no work."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from skimage.metrics import structural_similarity

from lfssao.ao.textures import Texture
from lfssao.viz.truth import deviation

Surface = NDArray[np.bool_]
FIGURES = ("rmse", "bias", "gain_free", "correlation", "ssim")
MARGIN = 10.0  # a reference serves an error that is at least this many times its own


def figures(occlusion: Texture, truth: Texture, surface: Surface, seen: bool = True) -> list[float]:
    """Return ``FIGURES`` over the surface texels of two (H, W) textures of occlusion, which are 0 elsewhere.

    ``gain_free`` is the RMSE after the factor and offset that make it least; the correlation with a constant is 0.
    ``ssim``, the mean structural similarity of visibility (Wang et al. 2004), is NaN unless it is ``seen``: it takes
    longer than all others.
    """
    found = deviation(occlusion, truth, surface)
    correlation = 0.0 if np.isnan(found.correlation) else found.correlation
    rest = float(truth[surface].std()) * max(1 - correlation * correlation, 0.0) ** 0.5  # of the regression line
    similar = np.nan
    if seen:
        _, each = structural_similarity(1 - occlusion.astype(np.float64), 1 - truth, data_range=1.0, full=True)
        similar = float(each[surface].mean())
    return [found.rmse, found.bias, rest, correlation, similar]


def pooled(found: Sequence[list[float]]) -> list[float]:
    """Root mean squares of errors, means of the other figures, over scenes and seeds."""
    table = np.array(found)
    return [*(rms(table[:, k]) if k in (0, 2) else float(np.nanmean(table[:, k])) for k in range(len(FIGURES)))]


def null_lines(truths: Sequence[tuple[Texture, Texture]]) -> dict[str, float]:
    """RMSE over scenes of no AO and of each scene's best constant, and the standard error of the truths themselves.

    The truths are occlusion of each scene's surface texels and its standard error.
    """
    none, constant, own = zip(*((rms(truth), truth.std(), rms(error)) for truth, error in truths), strict=True)
    return {"none": rms(none), "constant": rms(constant), "truth": rms(own)}


def rms(errors: ArrayLike) -> float:
    """Root mean square; 0 of nothing."""
    numbers: NDArray[Any] = np.asarray(errors, np.float64)
    return float(np.sqrt(np.mean(np.square(numbers)))) if numbers.size else 0.0


def combine_others(textures: Mapping[str, Texture], sampler: str) -> tuple[Texture, float]:
    """A sampler's reference from independent textures of two or more others, (t,) float64 by sampler; its own RMSE.

    The error is by their variance, of equals, over their number; a bias that they share does not show.
    """
    stack = np.stack([texture for name, texture in textures.items() if name != sampler])
    variance = stack.var(axis=0, ddof=1).mean() / len(stack) if stack.size else 0.0
    return stack.mean(axis=0), float(np.sqrt(variance))
