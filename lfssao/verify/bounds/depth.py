"""Bounds of depth, positions and colour: a renderer may sample a texel's surface a little off its centre.

``ErrorModel.centre`` is the largest distance, in texels: float32 rays and rasterisers that snap corners miss the
centre. On a slope the distance changes the depth; at a silhouette it shows another triangle. All bounds allow for the
rounding of the depth itself: ``ROUNDINGS`` operations on numbers as large as the largest coordinate.

With a mesh, rays go through the centre, the corners and the edge midpoints of a box about the centre. Each triangle
that a ray hits gives a range of depths. Every depth between the nearest and the farthest range is right, as small
triangles between the rays may connect them. Limit: no ray finds a triangle in front of all others that is thinner than
the rays' distance (1/256 of a texel for ``shader``).

With a reference depth texture alone, a texel's slope is estimated from its neighbours. At a jump of depth the
neighbour's surface, extrapolated, is right, too, and depths between the two surfaces are wrong. Such bounds are not
sound: they miss surfaces thinner than a texel, and slopes more than ``SLOPES`` times as steep in a texel as around it.
So the judge accepts as many texels outside as may show another surface at an edge (``outlier_limit``). It does not
notice a shift by less than a texel at silhouettes.
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

# Without a mesh: largest ratio of the slope inside a texel to the slope towards its neighbours.
SLOPES = 8


def depth_bounds(caster: RayCaster, view: View, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of a view's depth texture, cast from the caster's mesh, which is in the view's cast space."""
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
    # Rounding of z in cast space: ROUNDINGS operations on the largest operands.
    largest = float(np.abs(vertices).max() + np.abs(view.cast_from_world[:, 3]).max())
    rounding = ROUNDINGS * error_model.operation * largest
    # The factor is the largest derivative of screen space z, times three: two are for the roundings of z itself.
    if view.screen_to_world is not None and not view.linear:
        near, far, orthographic = view.lens[4:7].tolist()
        rounding *= 3 * (1.0 if orthographic else far / near) / (far - near)
    low = np.min(lower - rounding, axis=0)
    high = np.max(upper + rounding, axis=0)
    return Bounds(up_to_single(low).reshape(shape), down_to_single(high).reshape(shape))


def distance_ends(view: View, lower: FloatArray, upper: FloatArray, model: ErrorModel) -> tuple[FloatArray, FloatArray]:
    """Least and largest distance along a camera's axis that a renderer may compute from screen z between two ends."""
    camera = Pinhole(*view.lens.tolist())
    near = camera.near
    far = camera.far
    constants = (0.0, far - near, near) if camera.orthographic else plane_constants(near, far)

    def denominator(depth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The sum d c_1 + c_2 and its largest error."""
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
    """Bounds of a view's colour texture: the range of nine rays through a texel, widened by its width on each side.

    Limit: the rays do not resolve a texture that changes within 1/256 of a texel (``shader``). ``color`` is the filter
    of the mesh's textures, 'bilinear' or 'nearest'. InputError if there is no such filter or the mesh has no colour.
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
    """The view whose texels show the image points (du, dv) texels to the right of and below the given view's."""
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
    """Bounds of a depth texture without a mesh, estimated from the reference's texture, (H, W)."""
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
    """Bounds of a colour texture without a mesh, estimated from the reference's texture, (H, W, 3).

    A texel may have any colour in the range of itself and its eight neighbours. The range is widened by ``SLOPES``
    times ``model.centre`` of its width and by ROUNDINGS operations. At jumps of the reference's depth some texels may
    be outside.
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
    """Largest number of texels outside that a right depth or colour texture may have without a mesh.

    A texel shows another surface where an edge passes through the box of half width c, ``ErrorModel.centre``, about its
    centre. An edge of L texels, in any direction, meets at most 2 sqrt(2) c L boxes on average, and at least L texels
    along it count as jumps. So the mean number m is at most 2 sqrt(2) c times the texels at a jump of depth. The limit
    is m + 4 sqrt(m), four standard deviations above the mean; 0 for an exact model.
    """
    error_model = find_model(model)
    reference = depth.astype(np.float64)
    if error_model.exact:
        return 0
    jumps = [step.jump for step in _neighbour_steps(reference, ROUNDINGS * error_model.operation * _largest(reference))]
    mean = 2 * sqrt(2) * error_model.centre * int(np.count_nonzero(np.any(jumps, axis=0)))
    return int(mean + 4 * sqrt(mean))


class _Step(NamedTuple):
    """One direction from each texel: depths of the first and the second neighbour, and flags of depth jumps."""

    neighbour: FloatArray
    second: FloatArray
    jump: NDArray[np.bool_]


def _neighbour_steps(reference: FloatArray, rounding: float) -> list[_Step]:
    """The steps to the eight neighbours; a jump is larger than the slopes on both sides of it explain."""
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
    """Sizes of differences, 0 where one of the two texels shows no surface."""
    return np.nan_to_num(np.abs(difference), nan=0.0, posinf=0.0)


def _largest(texture: NDArray[np.floating[Any]]) -> float:
    """The largest size of a finite number in a texture."""
    return float(np.max(np.abs(texture), where=np.isfinite(texture), initial=0.0))


@dataclass(frozen=True, eq=False)
class PositionBounds:
    """Bounds of positions that belong to a depth texture: points on the texels' rays at those depths.

    Each position is mapped into the image. Allowed errors are ROUNDINGS operations on each coordinate, on numbers as
    large as the texture's largest, ``model.centre`` of a texel, and ROUNDINGS operations on depth. ``depth_error`` is
    the further error of a depth that is stored in fewer bits. No texel may be outside. The mapping includes the guard
    band; the model is not an exact one.
    """

    world_to_image: WorldToImage
    depth: Texture
    model: ErrorModel
    outliers: int = 0
    depth_error: FloatArray | float = 0.0

    @np.errstate(invalid="ignore")  # of a NaN that signals, and where there is no surface
    def outside(self, positions: Texture) -> NDArray[np.bool_]:
        """Whether each texel's position is outside, (H, W, 3)."""
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
