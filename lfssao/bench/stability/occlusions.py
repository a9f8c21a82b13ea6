"""Occlusion of every estimator but ``lf``, against its exact value by the same formulas.

SAO's sampling pass is formulas, and A behind it is compared; the passes after that are kernels.

Both are of the numbers that the kernels get, so that errors are those of the arithmetic alone; ``conditions`` has those
of float32 textures. ``OCCLUSIONS`` says what is stated.
"""

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.estimators.sao.estimator import sample, sampling_pass, scale_of
from lfssao.ao.estimators.sao.sampling import visibility_of
from lfssao.ao.estimators.sao.texel_rays import linear_z
from lfssao.ao.formulas import cast_depth, float_view, words_of
from lfssao.ao.moments import moment_pyramid
from lfssao.ao.textures import Buffers, Texture
from lfssao.bench.stability.conditions import VIEWS, at_corners, buffers_of, texel_size
from lfssao.bench.stability.exact import Formulas
from lfssao.bench.stability.levels import Levels
from lfssao.bench.stability.measure import FINE, PATHS, Measured, error_of
from lfssao.bench.stability.table import Inputs, Stated
from lfssao.bench.stability.tracked import Arithmetic, Tracked

# Samples, and terms of a row, those of a few texels spread over the texture; of one where an estimator has as many.
_SAMPLES = 8
_TERMS = 24


SAMPLING = "sampling pass"
SAMPLED = "sao", "sao-equation-1"  # estimators whose sampling pass alone is formulas
LEVELS = "multiresolution"  # its formulas are those of a level's texels

_NEAR = "rounding may move a sample past a texel's edge or a surface"
_BOX = "M2 - M1^2 cancels: the box is as wide as the root of what is left, over R"
_ESTIMATES: dict[str, tuple[str, Stated]] = {
    "occlusion": (
        "its own arithmetic, against exact numbers",
        {"": (np.inf, _NEAR), "vo-area": (np.inf, _BOX)},
    ),
    SAMPLING: ("its own arithmetic, against exact numbers: A before averages, bytes and bilateral passes", {}),
}
OCCLUSIONS = {f"{what} in {path}": stated for what, stated in _ESTIMATES.items() for path in PATHS}

# Textures of a view by name, and R, texels.
_INPUTS: dict[str, tuple[Callable[[str], Buffers], float]] = {
    "R = 2^2 texels": (buffers_of, 4.0),
    "R = 2^-8 texels": (buffers_of, 2.0**-8),
    "planes an ulp apart, R = 2^2 texels": (partial(buffers_of, surface="planes an ulp apart"), 4.0),
    "points at texels' corners, R = 2^-12 texels": (
        lambda kind: at_corners(kind, buffers_of(kind, "a chessboard", 0.05)), 2.0**-12,
    ),
}  # fmt: skip
_WIDE = {"R = 2^5 texels": (buffers_of, 32.0)}  # taps read levels of z


def occlusions() -> Inputs:
    """Yield inputs of all cases: the name, a text, and a function that runs an estimator by name."""
    for what, inputs in (("occlusion", _INPUTS), (SAMPLING, _INPUTS | _WIDE)):
        for path, kind, text in product(PATHS, VIEWS, inputs):
            yield f"{what} in {path}", f"{kind}, {text}", partial(_measured, what, path, kind, *inputs[text])


def _measured(
    what: str, path: str, kind: str, make: Callable[[str], Buffers], texels: float, name: str
) -> Measured | None:
    """Measure an estimator's occlusion on an input; None if it is another that a row of this name is of."""
    if not (name in SAMPLED if what == SAMPLING else name == LEVELS or find_estimator(name).formulas):
        return None
    textures = make(kind)
    return compare(name, textures, texels * texel_size(textures), path)


def compare(name: str, textures: Buffers, radius: float, path: str) -> Measured:
    """Measure occlusion in 'float32' or 'float64' against the exact one, of some texels; ulp are those of 1.

    It is A before averaging of ``SAMPLED``. Decisions are texels, flipped where the error is more than ``FINE``, and
    undecided where its bound is.
    """
    estimator = find_estimator(name)
    dtype = np.dtype(path)
    arrays = textures.depth, textures.positions, textures.normals
    buffers = Buffers(textures.view, *(array.astype(dtype) for array in arrays if array is not None))
    turned = buffers if estimator.rotation == "none" else buffers.turned(estimator.rotation)
    computed = compute(name, turned, radius, min(estimator.count, _SAMPLES), estimator.options())
    values = computed.texture.ravel()
    visible = np.flatnonzero(computed.depth < np.inf)
    texels = visible[(np.arange(computed.measured) * 2 + 1) * len(visible) // (2 * computed.measured)]
    exact = [computed.exact(int(texel)) for texel in texels]
    errors, ulps = zip(*(error_of(values[t], x.value, dtype) for t, x in zip(texels, exact, strict=True)), strict=True)
    bounds = [x.error for x in exact]
    exceeded = sum(not error <= bound for error, bound in zip(errors, bounds, strict=True))
    flipped, undecided = (sum(not off <= FINE for off in offs) for offs in (errors, bounds))
    return Measured(None, max(ulps), max(errors), max(bounds), exceeded, flipped, undecided, computed.measured)


class Computed(NamedTuple):
    """A texture that kernels make, and its exact value."""

    texture: Texture  # (H, W)
    depth: Texture  # (H * W,), +infinity where there is no surface
    measured: int  # texels, spread over the texture
    exact: Callable[[int], Tracked]  # of a texel that shows a surface


def compute(name: str, buffers: Buffers, radius: float, count: int, options: Any) -> Computed:
    """Return an estimator's occlusion by ``count`` samples; of ``SAMPLED`` A before averaging, by all of their taps.

    A's exact value is of the points, normals and levels of z that the kernels make before the sampling pass.
    """
    estimator = find_estimator(name)
    work = Arithmetic.of(buffers.depth.dtype)
    if name == LEVELS:
        texture = estimate(name, buffers, radius, None, None, "radii", **vars(options)).texture
        return Computed(texture, buffers.depth.ravel(), 2, Levels(buffers, radius, options, work).occlusion)
    if name in SAMPLED:
        z = linear_z(buffers)
        view, numbers = sampling_pass(buffers, z, radius, options)
        texture = sample(buffers, z, radius, options)[0]
        scale = work.given(scale_of(options, z.dtype))
    else:
        assert estimator.formulas is not None
        samples = estimator.default_samples(count)
        numbers = estimator.formulas(buffers, radius, *samples, options)
        view = float_view(buffers, words_of(numbers), options)
        scale = None
        if estimator.filtered:
            view = view._replace(moments_of=moment_pyramid(cast_depth(buffers), options.prefilter))
        texture = estimate(name, buffers, radius, *samples, "radii", **vars(options)).texture
    formulas = Formulas.of(view, numbers, len(buffers.depth), work)

    def exact(texel: int) -> Tracked:
        found = formulas.occlusion(texel)
        return found if scale is None else work.given(0) + visibility_of(scale, found)

    terms = numbers.points.shape[0] * getattr(numbers, "steps", 1)
    return Computed(texture, view.depth, max(1, _TERMS // terms), exact)
