"""Acceptance intervals of LF's Algorithms 1 and 2.

The AO of a texel counts decisions ``surDepth < smp.z``. ``kernels.point_bounds`` separates the decisions that a model's
rounding cannot change: k_lo samples are certainly occluded, k_hi may be. The division by N adds its own rounding.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.ssao import algorithm1, algorithm2, check_radius, scaled_offsets
from lfssao.ao.textures import check_turns
from lfssao.core.affine import Matrix
from lfssao.core.balls import SAFETY
from lfssao.errors import InputError
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import View, WorldToImage
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, check_single, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels.images import map_positions
from lfssao.verify.bounds.kernels.point_bounds import Points, count_hidden
from lfssao.verify.bounds.kernels.seen import IMAGE, NOTHING, Seen, write_depths


def ao_bounds(
    depth: Texture,
    positions: Texture | None,
    world_to_image: WorldToImage,
    samples: NDArray[np.floating[Any]],
    radius: float,
    model: str | ErrorModel = "shader",
    screen_to_world: Matrix | None = None,
    turns: Texture | None = None,
    depth_error: float = 0.0,
) -> Bounds:
    """Bounds of LF's Algorithm 2, or of Algorithm 1 with ``screen_to_world``: k_lo / n to k_hi / n, with rounding.

    Arguments are those of ``lfssao.algorithm2`` and ``lfssao.algorithm1``, textures in float32, and ``depth_error``,
    the relative error of depth (``image_depth``). Renderers round the numbers of the mapping and of
    ``screen_to_world`` to float32 and use the turns as they are. Algorithm 1 does not read positions. InputError if a
    shape, a dtype, the radius or the model is wrong.
    """
    error_model = find_model(model)
    points = sample_points(samples, radius)
    seen = checked_view(depth, positions, world_to_image, radius, screen_to_world, turns, depth_error)
    if error_model.exact:
        if screen_to_world is None:
            exact = algorithm2(depth, seen.positions, world_to_image, samples, radius, turns)
        else:
            world_to_screen = world_to_image.numbers.reshape(4, 4)
            exact = algorithm1(depth, screen_to_world, world_to_screen, samples, radius, turns)
        return Bounds(exact.texture, exact.texture, np.zeros(depth.shape, np.int32))
    fractions = fraction_bounds(len(samples), error_model)
    return count_bounds(with_depth_ends(seen, error_model), points, fractions, error_model)


def count_bounds(seen: Seen, points: Points, fractions: tuple[Texture, Texture], model: ErrorModel) -> Bounds:
    """Bounds of occlusion from counts of hidden samples; ``fractions`` are the ends of k / n for each count k."""
    fewest = np.empty(seen.depth.shape, np.int32)
    most = np.empty(seen.depth.shape, np.int32)
    count_hidden(seen, points, model.errors, fewest, most)
    return Bounds(fractions[0][fewest], fractions[1][most], most - fewest)


def checked_view(
    depth: Texture,
    positions: Texture | None,
    world_to_image: WorldToImage,
    radius: float,
    screen_to_world: Matrix | None = None,
    turns: Texture | None = None,
    depth_error: float = 0.0,
) -> Seen:
    """The arguments of ``ao_bounds``, checked, with numbers rounded as a renderer's."""
    check_single("depth", depth, 2)
    check_turns(turns, depth)
    check_radius(radius)
    inverse = np.empty(0)
    world_positions = NOTHING
    if screen_to_world is not None:
        if np.shape(screen_to_world) != (4, 4):
            raise InputError(f"screen_to_world has shape {np.shape(screen_to_world)}, expected (4, 4)")
        if world_to_image.kind != MATRIX:
            raise InputError("Algorithm 1 needs a mapping that is a matrix")
        inverse = rounded_to_single(screen_to_world).ravel()
    elif positions is None:
        raise InputError("Algorithm 2 reads positions, and there are none")
    else:
        world_positions = np.ascontiguousarray(positions)
        check_single("positions", world_positions, 3)
        if world_positions.shape != (*depth.shape, 3):
            raise InputError(f"positions have shape {world_positions.shape}, expected {(*depth.shape, 3)}")
    return Seen(
        depth=np.ascontiguousarray(depth),
        positions=world_positions,
        turns=np.empty((2, 0, 0), np.float32) if turns is None else np.ascontiguousarray(turns),
        back=inverse,
        kind=world_to_image.kind,
        numbers=rounded_to_single(world_to_image.numbers),
        radius=float(radius),
        room=float(depth_error),
    )


def distance_error(model: ErrorModel) -> float:
    """Relative error of distances along a camera's axis.

    Renderers may compute n f / (n + d (f - n)) from reversed depth, with rounded constants; the reference rounds once.
    """
    return model.quotient + 6 * model.operation


def image_depth(view: View, depth: Texture, model: ErrorModel) -> tuple[Texture, float]:
    """Image z of a view's depth texture, and the largest relative difference of a renderer's image z.

    A renderer divides for -1 / distance, and may round the quotient otherwise. Or it compares distances, which round
    less.
    """
    image = view.image_z(depth)
    return image, 0.0 if image is depth or model.exact else distance_error(model) + model.quotient + 2.0**-24


def with_depth_ends(seen: Seen, model: ErrorModel, kind: int = IMAGE) -> Seen:
    """The view with the ends of its surfaces' depths (``write_depths``)."""
    low = np.empty(seen.depth.shape)
    high = np.empty(seen.depth.shape)
    write_depths(seen, kind, model.errors, low, high)
    return seen._replace(low=low, high=high)


def sample_points(samples: NDArray[np.floating[Any]], radius: float) -> Points:
    """Samples R s as kernels take them, each with a flag: every float32 arithmetic computes it exactly."""
    offsets = np.asarray(scaled_offsets(samples, radius, np.dtype(np.float64)), np.float64)
    table = np.asarray(samples, np.float64)
    with np.errstate(over="ignore"):  # a number beyond float32's range is not exact
        exact = rounded_to_single(radius) == radius
        exact = exact & (rounded_to_single(table) == table) & (rounded_to_single(offsets) == offsets)
    for factor in (np.float64(radius), table):
        exact &= (factor == 0) | (np.abs(factor) >= 2.0**-126)  # smaller numbers may be flushed
    return Points(offsets, exact.all(axis=1))


def project_positions(
    positions: FloatArray, coordinate_error: FloatArray, world_to_image: WorldToImage, model: ErrorModel
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Image points of positions (..., 3), their errors, and whether they certainly lie in the mapping's domain.

    ``coordinate_error`` (..., 3) is the error of each coordinate itself; the model is not an exact one. The error of u
    is minus infinity for a position that is certainly outside the domain.
    """
    shape = positions.shape
    points = positions.reshape(-1, 3)
    errors = coordinate_error.reshape(-1, 3)
    image = np.empty_like(points)
    error = np.empty_like(points)
    certain = np.empty(len(points), np.bool_)
    kind = world_to_image.kind
    numbers = rounded_to_single(world_to_image.numbers)
    map_positions(points, errors, kind, numbers, model.errors, image, error, certain)
    return image.reshape(shape), error.reshape(shape), certain.reshape(shape[:-1])


def rounded_to_single(numbers: Any) -> FloatArray:
    """Numbers as a renderer has them, rounded to float32; the array is float64."""
    return np.asarray(numbers).astype(np.float32, order="C").astype(np.float64)


def fraction_bounds(n: int, model: ErrorModel) -> tuple[Texture, Texture]:
    """Smallest and largest float32 values of k / n for k = 0 to n, (n + 1,) each.

    A renderer computes a quotient, k (1 / n), or adds 1 / n k times. 1 / n rounds at most twice (``quotient`` includes
    both), and the sum k - 1 times. 0 is exact. The model is not an exact one.
    """
    k = np.arange(n + 1)
    relative_error = model.quotient + k * model.operation * (1 + k * model.operation)
    fraction = k / n
    low = fraction * (1 - relative_error * SAFETY)
    high = fraction * (1 + relative_error * SAFETY)
    return up_to_single(low), down_to_single(high)
