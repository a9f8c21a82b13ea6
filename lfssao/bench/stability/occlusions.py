"""Occlusion of every estimator that is written as formulas, against its exact value by the same formulas.

Both are of the numbers that the kernels get, so that errors are those of the arithmetic alone; ``conditions`` has those
of float32 textures. ``OCCLUSIONS`` says what is stated.
"""

from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np

from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.textures import Buffers
from lfssao.bench.stability.conditions import VIEWS, at_corners, seen, texel_size
from lfssao.bench.stability.exact import Formulas
from lfssao.bench.stability.measure import FINE, PATHS, Measured, error_of
from lfssao.bench.stability.table import Inputs, Stated
from lfssao.bench.stability.tracked import Arithmetic

# Samples, and terms of a row, those of a few texels spread over the texture; of one where an estimator has as many.
_SAMPLES, _TERMS = 8, 24


_NEAR = "rounding may move a sample past a texel's edge or a surface"
OCCLUSIONS: dict[str, tuple[str, Stated]] = {
    f"occlusion in {path}": ("its own arithmetic, against exact numbers", {"": (np.inf, _NEAR)}) for path in PATHS
}

# Textures of a view by name, and R, texels.
_INPUTS: dict[str, tuple[Callable[[str], Buffers], float]] = {
    "R = 2^2 texels": (seen, 4.0),
    "R = 2^-8 texels": (seen, 2.0**-8),
    "planes an ulp apart, R = 2^2 texels": (partial(seen, surface="planes an ulp apart"), 4.0),
    "points at texels' corners, R = 2^-12 texels": (
        lambda kind: at_corners(kind, seen(kind, "a chessboard", 0.05)), 2.0**-12,
    ),
}  # fmt: skip


def occlusions() -> Inputs:
    """Inputs of all cases: the name, a text, and a function that runs an estimator by name."""
    for path, kind, text in product(PATHS, VIEWS, _INPUTS):
        yield f"occlusion in {path}", f"{kind}, {text}", partial(_measured, path, kind, text)


def _measured(path: str, kind: str, text: str, name: str) -> Measured | None:
    """Measure an estimator's occlusion on an input; None if it has no formulas of texels."""
    if not find_estimator(name).reads_texels:
        return None
    textures, texels = _INPUTS[text][0](kind), _INPUTS[text][1]
    return compare(name, textures, texels * texel_size(textures), path)


def compare(name: str, textures: Buffers, radius: float, path: str) -> Measured:
    """Measure occlusion in 'float32' or 'float64' against the exact one, of some texels; ulp are those of 1.

    Decisions are texels, flipped where the error is more than ``FINE``, and undecided where its bound is.
    """
    estimator, dtype = find_estimator(name), np.dtype(path)
    arrays = textures.depth, textures.positions, textures.normals
    buffers = Buffers(textures.view, *(array.astype(dtype) for array in arrays if array is not None))
    turned = buffers if estimator.rotation == "none" else buffers.turned(estimator.rotation)
    assert estimator.formulas is not None
    samples = estimator.default_samples(min(estimator.count, _SAMPLES))
    numbers = estimator.formulas(turned, radius, *samples, estimator.options())
    made = estimate(name, turned, radius, *samples, "radii").texture.ravel()
    view = float_view(turned, words_of(numbers), estimator.options())
    formulas = Formulas.of(view, numbers, len(turned.depth), Arithmetic.of(dtype))
    there = np.flatnonzero(view.depth < np.inf)
    count = max(1, _TERMS // (numbers.points.shape[0] * getattr(numbers, "steps", 1)))
    texels = there[(np.arange(count) * 2 + 1) * len(there) // (2 * count)]
    exact = [formulas.occlusion(int(texel)) for texel in texels]
    errors, ulps = zip(*(error_of(made[t], x.value, dtype) for t, x in zip(texels, exact, strict=True)), strict=True)
    bounds = [x.error for x in exact]
    exceeded = sum(not error <= bound for error, bound in zip(errors, bounds, strict=True))
    flipped, undecided = (sum(not off <= FINE for off in offs) for offs in (errors, bounds))
    return Measured(None, max(ulps), max(errors), max(bounds), exceeded, flipped, undecided, count)
