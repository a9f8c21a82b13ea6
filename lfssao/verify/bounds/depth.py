"""Bounds of depth, positions and colour: a texel's surface may be looked at a little off its centre.

``ErrorModel.centre`` is how far, in texels: float32 rays and rasterisers that snap corners do not meet centres exactly.
On a slope that moves the depth; at a silhouette another triangle is as right. All bounds allow for the rounding of the
depth itself: ``ROUNDINGS`` operations on numbers of the size of the largest coordinate.

From a mesh: rays are cast through the centre, corners and edge middles of the box of that half width; every triangle
that one of them hits gives a range. All between the nearest and the farthest is right, as small triangles that join
them may show between the rays. Limit: a triangle in front of all that the rays hit, and thinner than their distance
(1/256 of a texel for ``shader``), is not found.

From a reference depth texture alone: the texel's slope is that of its neighbours. Next to a jump the neighbour's
surface, carried on, is as right, and what lies between the two is wrong. No such bound can be sound: it misses
surfaces thinner than a texel, and slopes more than ``SLOPES`` times steeper in a texel than around it. So the judge
lets as many texels leave the bounds as may look across an edge (``outlier_limit``). A shift by less than a texel is not
noticed at silhouettes.
"""

from dataclasses import dataclass, replace
from itertools import product
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from lfssao.ao.estimators.sao.texel_rays import plane_constants
from lfssao.core.affine import transform_points
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY
from lfssao.optics.kernels.rays import Pinhole
from lfssao.optics.view import View, WorldToImage
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, down_to_single, exact_bounds, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels import depth_bounds as depth_kernels
from lfssao.verify.bounds.ssao import project_positions

ROUNDINGS = 16

# Without a mesh: how much steeper a surface may be inside a texel than from it to its neighbours.
SLOPES = 8


def depth_bounds(caster: RayCaster, view: View, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of the depth texture of a view of the mesh that the caster holds in the view's cast space."""
    error_model = find_model(model)
    if error_model.exact:
        return exact_bounds(caster.gbuffer(view, color=None).depth)
    shape = view.height, view.width
    half_width = error_model.centre
    triangles = np.empty((9, view.height * view.width), np.int32)
    for k, (v, u) in enumerate(product((-half_width, 0.0, half_width), repeat=2)):
        triangles[k] = caster.gbuffer(displaced(view, u, v), color=None).triangle.ravel()
    vertices = transform_points(view.cast_from_world, caster.mesh.vertices)
    lower = np.empty(triangles.shape)
    upper = np.empty(triangles.shape)
    depth_kernels.depth_ranges(view.rays, view.width, half_width, vertices, caster.mesh.faces, triangles, lower, upper)
    # Rounding of z in cast space: ROUNDINGS operations on the largest numbers that make it.
    largest = float(np.abs(vertices).max() + np.abs(view.cast_from_world[:, 3]).max())
    rounding = ROUNDINGS * error_model.operation * largest
    # Screen space z changes with z by so much at most; twice more for its own roundings.
    if view.screen_to_world is not None and not view.linear:
        near, far, orthographic = view.lens[4:7].tolist()
        rounding *= 3 * (1.0 if orthographic else far / near) / (far - near)
    low = np.min(lower - rounding, axis=0)
    high = np.max(upper + rounding, axis=0)
    return Bounds(up_to_single(low).reshape(shape), down_to_single(high).reshape(shape))


def distance_ends(view: View, lower: FloatArray, upper: FloatArray, model: ErrorModel) -> tuple[FloatArray, FloatArray]:
    """Least and largest distance along a camera's axis that a renderer may make of screen z between two ends."""
    camera = Pinhole(*view.lens.tolist())
    near = camera.near
    far = camera.far
    constants = (0.0, far - near, near) if camera.orthographic else plane_constants(near, far)

    def denominator(depth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sum d c_1 + c_2, and how far it may be off."""
        product = np.where(depth < np.inf, depth, 0.0) * constants[1]
        return product + constants[2], 6 * model.operation * (np.abs(product) + abs(constants[2]))

    low, low_error = denominator(lower)
    high, high_error = denominator(upper)
    if camera.orthographic:
        low = low - low_error
        high = high + high_error
    else:
        relative_error = model.quotient + 2 * model.operation
        low = low + low_error
        high = high - high_error
        with np.errstate(divide="ignore"):
            low = np.where(low > 0, constants[0] * (1 - relative_error) / np.abs(low), np.inf)
            high = np.where(high > 0, constants[0] * (1 + relative_error) / np.abs(high), np.inf)
    return np.where(lower < np.inf, low, np.inf), np.where(upper < np.inf, high, np.inf)


def color_bounds(caster: RayCaster, view: View, color: str = "bilinear", model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of the colour texture of a view: the span of nine rays through a texel, widened by itself each way.

    Limit: a texture that changes within 1/256 of a texel (``shader``) is not followed. ``color`` is how the mesh's
    textures are read, 'bilinear' or 'nearest'. InputError if there is no such filter or the mesh has no colour.
    """
    error_model = find_model(model)
    low: Any = np.inf
    high: Any = -np.inf
    for v, u in product((0.0,) if error_model.exact else (-error_model.centre, 0.0, error_model.centre), repeat=2):
        texture = caster.gbuffer(displaced(view, u, v), color).color
        if texture is None:
            raise InputError(f"{caster.mesh.name} has no colour")
        low = np.minimum(low, texture)
        high = np.maximum(high, texture)
    if error_model.exact:
        return exact_bounds(high)
    low = low.astype(np.float64)
    high = high.astype(np.float64)
    margin = (high - low) + ROUNDINGS * error_model.operation * high
    return Bounds(up_to_single(low - margin), down_to_single(high + margin))


def displaced(view: View, du: float, dv: float) -> View:
    """The view whose texels look at the image points (du, dv) texels right of and below the given one's."""
    lens = view.lens.copy()
    if view.rays.kind == CROSSED_SLITS:
        lens[[5, 7]] -= du, dv
    elif view.rays.kind == DISPLAY:
        # The distortion's centre moves back, so its result is moved forth: texels -> screen after T(du, dv).
        lens[[17, 18]] -= du, dv
        for row in (23, 26, 29):
            lens[row + 2] += lens[row] * du + lens[row + 1] * dv
    else:
        lens[[2, 3]] -= du, dv
    return replace(view, lens=lens)


def texture_depth_bounds(depth: Texture, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of a depth texture (H, W) without a mesh, from the reference's."""
    error_model = find_model(model)
    if error_model.exact:
        return exact_bounds(depth)
    reference = depth.astype(np.float64)
    rounding = ROUNDINGS * error_model.operation * _largest(reference)
    steps = _neighbour_steps(reference, rounding)
    with np.errstate(invalid="ignore"):  # infinity less infinity, between two texels without surface
        slope = np.max([_finite_size(step.neighbour - reference) for step in steps], axis=0)
        margin = slope * SLOPES * error_model.centre + rounding
        lower = [reference - margin]
        upper = [reference + margin]
        for neighbour, second, jump in steps:
            extrapolated = np.where(np.isfinite(second) & np.isfinite(neighbour), 2 * neighbour - second, neighbour)
            lower.append(np.where(jump, np.minimum(neighbour, extrapolated) - margin, lower[0]))
            upper.append(np.where(jump, np.maximum(neighbour, extrapolated) + margin, upper[0]))
    low = up_to_single(np.array(lower))
    high = down_to_single(np.array(upper))
    return Bounds(low.min(axis=0), high.max(axis=0), outliers=outlier_limit(depth, error_model), ranges=(low, high))


def texture_color_bounds(color: Texture, depth: Texture | None, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of a colour texture (H, W, 3) without a mesh, from the reference's.

    Each texel may have any colour between those of it and its eight neighbours, and beyond them by ``SLOPES`` times
    ``model.centre`` of their span and by ROUNDINGS operations. At jumps of the reference's depth some may stray.
    """
    error_model = find_model(model)
    if error_model.exact:
        return exact_bounds(color)
    values = color.astype(np.float64)
    low, high = (extreme(values, (3, 3, 1), mode="nearest") for extreme in (minimum_filter, maximum_filter))
    rounding = ROUNDINGS * error_model.operation * np.maximum(np.abs(low), np.abs(high))
    margin = rounding + SLOPES * error_model.centre * (high - low)
    outliers = 0 if depth is None else outlier_limit(depth, error_model)
    return Bounds(up_to_single(low - margin), down_to_single(high + margin), outliers=outliers)


def outlier_limit(depth: Texture, model: str | ErrorModel = "shader") -> int:
    """Number of texels of a right depth or colour texture that may leave the bounds that the reference's own gives.

    A texel shows another surface where an edge passes through the box of half width c, ``ErrorModel.centre``, about its
    centre. An edge that is L texels long, in any direction, meets at most 2 sqrt(2) c L boxes on average, and at most L
    texels next to it count here. So the mean number m is at most 2 sqrt(2) c times the texels at a jump of depth; the
    limit is m + 4 sqrt(m), four standard deviations above it; 0 for an exact model.
    """
    error_model = find_model(model)
    reference = depth.astype(np.float64)
    if error_model.exact:
        return 0
    jumps = [step.jump for step in _neighbour_steps(reference, ROUNDINGS * error_model.operation * _largest(reference))]
    mean = 2 * sqrt(2) * error_model.centre * int(np.count_nonzero(np.any(jumps, axis=0)))
    return int(mean + 4 * sqrt(mean))


class _Step(NamedTuple):
    """From each texel one step in a direction: the next texel's depth, that of the one beyond, where the step jumps."""

    neighbour: FloatArray
    second: FloatArray
    jump: NDArray[np.bool_]


def _neighbour_steps(reference: FloatArray, rounding: float) -> list[_Step]:
    """The steps to the eight neighbours; a jump is more than the slopes before and behind it explain."""
    padded = np.pad(reference, 2, mode="edge")
    height, width = reference.shape

    def shifted(j: int, i: int) -> FloatArray:
        return padded[2 + j : 2 + j + height, 2 + i : 2 + i + width]

    steps = []
    with np.errstate(invalid="ignore"):  # infinity less infinity
        for j, i in product((-1, 0, 1), repeat=2):
            if (j, i) == (0, 0):
                continue
            neighbour = shifted(j, i)
            second = shifted(2 * j, 2 * i)
            opposite = shifted(-j, -i)
            slopes = _finite_size(second - neighbour) + _finite_size(reference - opposite)
            jump = (neighbour != reference) & ~(np.abs(neighbour - reference) <= 4 * (slopes + rounding))
            steps.append(_Step(neighbour, second, jump))
    return steps


def _finite_size(difference: FloatArray) -> FloatArray:
    """Sizes of differences, 0 where one of the two is no surface."""
    return np.nan_to_num(np.abs(difference), nan=0.0, posinf=0.0)


def _largest(texture: NDArray[np.floating[Any]]) -> float:
    """The largest size of a finite number in a texture."""
    return float(np.max(np.abs(texture), where=np.isfinite(texture), initial=0.0))


@dataclass(frozen=True, eq=False)
class PositionBounds:
    """Bounds of the positions that fit a depth texture: points of the texels' rays at its depths.

    A position is mapped into the image. Each coordinate may be off by ROUNDINGS operations on numbers of the size of
    the largest in the texture, the texel's centre by ``model.centre``, and depth by ROUNDINGS operations, and by
    ``depth_error`` where it was stored in fewer bits than made. No texel may be outside. The mapping includes the
    guard band; the model is not an exact one.
    """

    world_to_image: WorldToImage
    depth: Texture
    model: ErrorModel
    outliers: int = 0
    depth_error: FloatArray | float = 0.0

    @np.errstate(invalid="ignore")  # of a NaN that signals, and where there is no surface
    def outside(self, positions: Texture) -> NDArray[np.bool_]:
        """Whether each texel's position does not fit, (H, W, 3)."""
        depth = self.depth
        operation = self.model.operation
        height, width = self.depth.shape
        coordinate_error = np.full(positions.shape, ROUNDINGS * operation * _largest(positions))
        exact_positions = np.ascontiguousarray(positions, np.float64)
        image, error, _ = project_positions(exact_positions, coordinate_error, self.world_to_image, self.model)
        centre = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        depth_margin = ROUNDINGS * operation * _largest(depth) + self.depth_error
        violations = [~(np.abs(image[..., 2] - depth) <= error[..., 2] + depth_margin)]
        violations += [~(np.abs(image[..., k] - centre[k]) <= error[..., k] + self.model.centre) for k in range(2)]
        finite = np.any(positions != np.inf, axis=-1)
        wrong = np.where(depth < np.inf, np.any(violations, axis=0), finite)
        return np.stack([wrong] * 3, axis=-1)
