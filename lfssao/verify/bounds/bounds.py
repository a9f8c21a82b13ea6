"""Acceptance intervals: between which values every conforming float32 renderer must fall, stage by stage.

The AO of a texel is a count of decisions ``surDepth < smp.z``. ``kernels.ssao_bounds`` finds which of them no
arithmetic of a model can get wrong: k_lo are occluded for sure, k_hi may be. What makes k / N of them, the maximum over
the radii, the blur and the product with the image adds its own rounding (``error_model`` lists what is admitted).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import passes
from lfssao.ao.kernels import blur as blur_kernels
from lfssao.core import elementary
from lfssao.core.affine import Matrix
from lfssao.errors import InputError
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import WorldToImage
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels import projection_bounds
from lfssao.verify.bounds.kernels import ssao_bounds as outcomes
from lfssao.verify.bounds.kernels.pairs import SAFETY

Texture = NDArray[np.float32]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bounds:
    """The values that a stage's texture may have.

    Attributes
    ----------
    lower, upper : (H, W) or (H, W, 3) float32
        Smallest and largest value, both admitted.
    undecided : (H, W) int32 or None
        How many samples rounding decides, over all radii that went in; None behind the blur.
    strays : int
        How many texels of a right texture may leave the bounds.
    ranges : pair of (K, H, W) float32, or None
        Smallest and largest values of K ranges: a value must lie in one of them, and not just between their ends.
    """

    lower: Texture
    upper: Texture
    undecided: NDArray[np.int32] | None = None
    strays: int = 0
    ranges: tuple[Texture, Texture] | None = None

    def outside(self, texture: Texture) -> NDArray[np.bool_]:
        """Where a texture leaves the bounds; everywhere it is not a number.

        Raises
        ------
        InputError
            If it is of another shape.
        """
        if texture.shape != self.lower.shape:
            raise InputError(f"a texture has shape {texture.shape}, its bounds have {self.lower.shape}")
        if self.ranges is not None:
            inside: NDArray[np.bool_] = np.any((texture >= self.ranges[0]) & (texture <= self.ranges[1]), axis=0)
            return ~inside
        return ~((texture >= self.lower) & (texture <= self.upper))

    def crop(self, guard: int) -> "Bounds":
        """The bounds without a guard band of so many texels."""
        if guard == 0:
            return self
        inner = slice(guard, -guard), slice(guard, -guard)
        undecided = None if self.undecided is None else self.undecided[inner]
        return Bounds(self.lower[inner], self.upper[inner], undecided)


def exactly(texture: Texture) -> Bounds:
    """The bounds of a texture that is given, a point each."""
    return Bounds(texture, texture)


def ao_bounds(
    depth: Texture,
    positions: Texture | None,
    world_to_image: WorldToImage,
    samples: NDArray[np.floating[Any]],
    radius: float,
    model: str | ErrorModel = "shader",
    screen_to_world: Matrix | None = None,
) -> Bounds:
    """Bounds of LF's Algorithm 2, or of Algorithm 1 with ``screen_to_world``, on given textures.

    Parameters
    ----------
    depth : (H, W) float32
        Image z, +infinity where there is no surface.
    positions : (H, W, 3) float32 or None
        World coordinates of the visible surface; not read by Algorithm 1.
    world_to_image : WorldToImage
        The mapping; renderers have its numbers rounded to float32.
    samples : (n, 3)
        Offsets in the unit ball.
    radius : float
        R, world units.
    model : str or ErrorModel
        What float32 arithmetic may do (``lfssao.verify.bounds.error_model``).
    screen_to_world : (4, 4), optional
        The inverse mapping, rounded to float32 likewise: Algorithm 1.

    Returns
    -------
    Bounds
        lower = k_lo / n and upper = k_hi / n as they may round, and the number of undecided samples, k_hi - k_lo.

    Raises
    ------
    InputError
        If a shape, a dtype, the radius or the model is wrong.
    """
    chosen = find_model(model)
    inputs = sample_inputs(depth, positions, world_to_image, samples, radius, screen_to_world)
    if chosen.exact:
        if screen_to_world is None:
            made = passes.algorithm2(depth, inputs.positions, world_to_image, samples, radius)
        else:
            forth = world_to_image.numbers.reshape(4, 4)
            made = passes.algorithm1(depth, screen_to_world, forth, samples, radius)
        return Bounds(made.texture, made.texture, np.zeros(depth.shape, np.int32))
    fewest, most = np.empty(depth.shape, np.int32), np.empty(depth.shape, np.int32)
    outcomes.count_outcomes(inputs, chosen.errors, fewest, most)
    low, high = fraction_bounds(len(samples), chosen)
    return Bounds(low[fewest], high[most], most - fewest)


def sample_inputs(
    depth: Texture,
    positions: Texture | None,
    world_to_image: WorldToImage,
    samples: NDArray[np.floating[Any]],
    radius: float,
    screen_to_world: Matrix | None = None,
) -> outcomes.Inputs:
    """The arguments of ``ao_bounds``, checked and rounded as a renderer's are.

    Parameters
    ----------
    depth, positions, world_to_image, samples, radius, screen_to_world
        As of ``ao_bounds``.

    Raises
    ------
    InputError
        As ``ao_bounds``.
    """
    _check_single("depth", depth, 2)
    back, places = np.empty(0), np.empty((0, 0, 3), np.float32)
    if screen_to_world is not None:
        if np.shape(screen_to_world) != (4, 4):
            raise InputError(f"screen_to_world has shape {np.shape(screen_to_world)}, expected (4, 4)")
        if world_to_image.kind != MATRIX:
            raise InputError("Algorithm 1 needs a mapping that is a matrix")
        back = np.ravel(screen_to_world).astype(np.float32).astype(np.float64)
    elif positions is None:
        raise InputError("Algorithm 2 reads positions, and there are none")
    else:
        places = np.ascontiguousarray(positions)
        _check_single("positions", places, 3)
        if places.shape != (*depth.shape, 3):
            raise InputError(f"positions have shape {places.shape}, expected {(*depth.shape, 3)}")
    offsets, is_exact = _offsets(samples, radius)
    kind, numbers = world_to_image.kind, _rounded(world_to_image)
    return outcomes.Inputs(np.ascontiguousarray(depth), places, back, offsets, is_exact, kind, numbers)


def _offsets(samples: NDArray[np.floating[Any]], radius: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """R s in float64, and where no float32 arithmetic can make anything else of it."""
    passes.check_radius(radius)
    table = np.asarray(samples, np.float64)
    if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0:
        raise InputError(f"samples have shape {table.shape}, expected (n, 3) with n at least 1")
    if not np.isfinite(table).all():
        raise InputError("samples: a coordinate is not finite")
    offsets = np.ascontiguousarray(radius * table)
    with np.errstate(over="ignore"):  # what float32 cannot hold is not exact
        exact = (np.float32(radius) == radius) & (table.astype(np.float32) == table)
        exact &= offsets.astype(np.float32) == offsets
    for factor in (np.float64(radius), table):
        exact &= (factor == 0) | (np.abs(factor) >= 2.0**-126)  # else it may be flushed
    return offsets, exact.all(axis=1)


def project_positions(
    positions: FloatArray, allowance: FloatArray, world_to_image: WorldToImage, model: ErrorModel
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Image points of positions, how far they may be off, and whether they lie in the mapping's domain for sure.

    Parameters
    ----------
    positions : (..., 3)
        World coordinates.
    allowance : (..., 3)
        How far each coordinate may be off by itself.
    world_to_image : WorldToImage
        The mapping; renderers have its numbers rounded to float32.
    model : ErrorModel
        Not an exact one.

    Returns
    -------
    image, error : (..., 3)
        u, v, z and their errors; that of u is minus infinity where a position is outside the domain for sure.
    sure : (...) bool
        Whether it lies in the domain for sure.
    """
    shape = positions.shape
    points, off = positions.reshape(-1, 3), allowance.reshape(-1, 3)
    image, error, sure = np.empty_like(points), np.empty_like(points), np.empty(len(points), np.bool_)
    projection_bounds.map_positions(
        points, off, world_to_image.kind, _rounded(world_to_image), model.errors, image, error, sure
    )
    return image.reshape(shape), error.reshape(shape), sure.reshape(shape[:-1])


def _rounded(world_to_image: WorldToImage) -> FloatArray:
    """A mapping's numbers as a renderer has them."""
    return world_to_image.as_type(np.float32).astype(np.float64)


def _check_single(name: str, texture: Texture, dimensions: int) -> None:
    passes.check_texture(name, texture, dimensions)
    if texture.dtype != np.float32:
        raise InputError(f"{name} is of {texture.dtype}, the oracle judges float32")


def fraction_bounds(n: int, model: ErrorModel) -> tuple[Texture, Texture]:
    """Smallest and largest float32 that k of n samples may make, (n + 1,) each, for k = 0 to n.

    k / n is a quotient, k (1 / n), or 1 / n added k times: two roundings of 1 / n at most (``quotient`` has both), and
    k - 1 of the sum. 0 is exact.

    Parameters
    ----------
    n : int
        How many samples.
    model : ErrorModel
        Not an exact one.
    """
    k = np.arange(n + 1)
    relative = model.quotient + k * model.operation * (1 + k * model.operation)
    fraction = k / n
    low, high = fraction * (1 - relative * SAFETY), fraction * (1 + relative * SAFETY)
    return up_to_single(low), down_to_single(high)


def up_to_single(values: FloatArray) -> Texture:
    """The smallest float32 that is not below each value: the lower end of what a float32 above it can be."""
    single = values.astype(np.float32)
    return np.where(single < values, np.nextafter(single, np.float32(np.inf)), single)


def down_to_single(values: FloatArray) -> Texture:
    """The largest float32 that is not above each value."""
    single = values.astype(np.float32)
    return np.where(single > values, np.nextafter(single, np.float32(-np.inf)), single)


def merge_bounds(layers: Sequence[Bounds]) -> Bounds:
    """Bounds of the maximum over radii: the maximum rounds nothing and grows with each layer, so it is taken of both.

    Parameters
    ----------
    layers : list of Bounds
        One a radius, at least one, all of one size.

    Raises
    ------
    InputError
        If there is none, or sizes differ.
    """
    lower, upper = passes.merge([b.lower for b in layers]), passes.merge([b.upper for b in layers])
    counts = [b.undecided for b in layers if b.undecided is not None]
    return Bounds(lower, upper, sum(counts[1:], counts[0]) if len(counts) == len(layers) else None)


def blur_bounds(occlusion: Bounds, sigma: float, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of the Gaussian blur, horizontal then vertical, each pass rounded to a float32 texture.

    A pass sums n products w a. It grows with each a, as weights are positive. Each term is rounded n times at most (as
    a product and in n - 1 sums, in any order), and its weight is off by ``weight_errors``. So the sum is off by at most
    the sum of w max(abs(a)) ((1 + weight error) (1 + r)^n - 1), which is added to the pass over the bounds.

    Parameters
    ----------
    occlusion : Bounds
        What is blurred.
    sigma : float
        Standard deviation, texels; 0 changes nothing.
    model : str or ErrorModel
        What float32 arithmetic may do.

    Raises
    ------
    InputError
        If sigma or the model is wrong.
    """
    chosen = find_model(model)
    weights = passes.gaussian_kernel(sigma)
    if len(weights) == 1:
        return Bounds(occlusion.lower, occlusion.upper)
    if chosen.exact:
        return Bounds(passes.blur(occlusion.lower, sigma), passes.blur(occlusion.upper, sigma))
    n = len(weights)
    growth = float(np.cumprod(np.full(n, 1 + chosen.operation))[-1])  # from the first to the last: equal bits anywhere
    terms = (1 + weight_errors(sigma, chosen)) * growth - 1
    room = weights * terms * SAFETY + chosen.smallest * (weights > 0)  # small weights may be flushed
    lower, upper = occlusion.lower.astype(np.float64), occlusion.upper.astype(np.float64)
    for run in (blur_kernels.blur_horizontal, blur_kernels.blur_vertical):
        size = np.maximum(np.abs(lower), np.abs(upper))
        below, above, error = np.empty_like(lower), np.empty_like(lower), np.empty_like(lower)
        run(lower, weights, below)
        run(upper, weights, above)
        run(size, room, error)
        error += (2 * n + 2) * chosen.smallest * (error > 0)  # sums of zeros are zero
        lower = up_to_single(below - error).astype(np.float64)
        upper = down_to_single(above + error).astype(np.float64)
    return Bounds(lower.astype(np.float32), upper.astype(np.float32))


def weight_errors(sigma: float, model: ErrorModel) -> FloatArray:
    """How far, relatively, the weights of a renderer's blur may be off the float64 table.

    The table's weights rounded to float32 are off by 2^-24. A renderer that makes them itself has x = -k^2 / (2
    sigma^2) with up to five roundings and a quotient (sigma rounded, k / sigma, its square, the half), so exp(x) is off
    by abs(x) times those, and by its own error; and divides by the sum, whose error is the weights' mean and n - 1
    roundings.

    Parameters
    ----------
    sigma : float
        Standard deviation, texels, positive.
    model : ErrorModel
        Not an exact one.
    """
    weights, r = passes.gaussian_kernel(sigma), model.operation
    radius = len(weights) // 2
    x = 0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2
    x = np.where(weights > 0, x, 0.0)  # where exp is 0 in float64 no error makes more of it
    argument = x * (2 * model.quotient + 6 * r)
    constant, slope = model.exponential
    own = (1 + constant + slope * x) * np.array([elementary.exp(a) for a in argument], np.float64) - 1
    # The total is off by the mean of its terms' errors, and by its sums.
    total = float(np.cumsum(weights * own)[-1]) + (2 * radius) * r * (1 + 2 * radius * r)
    return (1 + own) * (1 + total / (1 - total)) * (1 + model.quotient) - 1 + 2.0**-24


def shade_bounds(rgb: Texture, occlusion: Bounds, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of rgb (1 - ao).

    1 - ao falls with ao, so for rgb >= 0 the largest ao makes the least. (1 - ao) rgb is rounded twice; rgb - rgb ao
    rounds rgb ao and the difference: r abs(rgb ao) + r abs(rgb (1 - ao)) more. Both are within
    r abs(rgb) (abs(ao) + 2 abs(1 - ao)) (1 + r).

    Parameters
    ----------
    rgb : (H, W, 3) float32
        Linear colour, given.
    occlusion : Bounds
        Of the occlusion that it is multiplied with.
    model : str or ErrorModel
        What float32 arithmetic may do.

    Raises
    ------
    InputError
        If sizes or the model are wrong.
    """
    chosen = find_model(model)
    if chosen.exact:
        ends = [passes.shade(rgb, end) for end in (occlusion.lower, occlusion.upper)]
        return Bounds(np.minimum(*ends), np.maximum(*ends))
    _check_single("rgb", rgb, 3)
    if rgb.shape != (*occlusion.lower.shape, 3):
        raise InputError(f"rgb has shape {rgb.shape}, expected {(*occlusion.lower.shape, 3)}")
    r, color = chosen.operation, rgb.astype(np.float64)
    below, above = [], []
    for end in (occlusion.lower, occlusion.upper):
        ao = end.astype(np.float64)[..., None]
        exact = color * (1 - ao)
        error = np.abs(color) * (np.abs(ao) + 2 * np.abs(1 - ao)) * (r * (1 + 4 * r))
        error += 4 * chosen.smallest * (color != 0)
        below.append(exact - error)
        above.append(exact + error)
    return Bounds(up_to_single(np.minimum(*below)), down_to_single(np.maximum(*above)))
