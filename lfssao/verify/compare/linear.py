"""Another renderer's distances along a camera's axis, where the reference's depth is screen space z.

Distances are judged by the interval that a renderer may compute from screen z. Later stages read the distances and are
judged in a linear view: between planes at 0.1 and 50, the error of screen z at 5 is 50 times that of float32.
"""

from dataclasses import replace

import numpy as np

from lfssao.errors import InputError
from lfssao.gbuffer.kernels.surface import write_surface
from lfssao.optics.camera import linear_view
from lfssao.optics.view import View
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, down_to_single, exact_bounds, up_to_single
from lfssao.verify.bounds.depth import distance_ends, texture_depth_bounds
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.case import VIEW, Array, Arrays, Case, described_view
from lfssao.verify.compare.view_case import view_parameters

_FARTHEST = 1 - 2.0**-22  # share of the far plane's distance from which there is no surface


def check_camera(case: Case) -> None:
    """Refuse (InputError) cases that are not of a camera's view: their depth is no distance along an axis."""
    if case.stage != VIEW or case.parameters["screen_to_world"] is None:
        raise InputError("--stored: depth cannot be 'linear': the reference is not of a camera")


def linear_case(case: Case, mine: Arrays, model: ErrorModel) -> tuple[Case, dict[str, Array]]:
    """The case of a linear view, and the renderer's textures with distances as depth, infinite without a surface.

    Infinity, 0 and distances from the far plane on mean no surface. If the renderer has no positions, they are computed
    from its distances. The case includes the bounds of depth.
    """
    view = described_view(case.parameters)
    distances = mine["depth"]
    far = float(view.lens[5])
    distances = np.where((distances == 0) | (distances >= far * _FARTHEST), distances.dtype.type(np.inf), distances)
    mine = {**mine, "depth": distances}
    if view.linear:
        return case, mine
    linear = linear_view(view)
    depth = case.outputs["depth"]
    outputs = dict(case.outputs)
    outputs["depth"] = _distances_of_depth(view, depth).astype(np.float32)
    if "positions" in outputs and "positions" not in mine and not np.isnan(distances).any():
        outputs["positions"] = _positions(linear, distances)
    parameters = {
        **case.parameters,
        **view_parameters(linear),
        "distance_off": _conversion_error(view, distances, model),
    }
    depth_bounds = case.bounds.get("depth") or texture_depth_bounds(depth, model)
    bounds = exact_bounds(outputs["depth"]) if model.exact else _distance_bounds(view, depth_bounds, model)
    return replace(case, parameters=parameters, outputs=outputs, bounds={**case.bounds, "depth": bounds}), mine


def _distances_of_depth(view: View, depth: Texture) -> FloatArray:
    """Distances of screen space z."""
    d = np.where(depth < np.inf, depth.astype(np.float64), 0.0)
    return np.where(depth < np.inf, view.cast_z(d), np.inf)


def _positions(view: View, distances: Texture) -> Texture:
    """World positions, (H, W, 3) float32, of distances on the texels' rays."""
    triangle = np.where(np.isfinite(distances), 0, -1)
    depth = np.empty_like(distances)
    positions = np.empty((*distances.shape, 3), np.float32)
    write_surface(view.rays, np.ravel(view.world_from_cast), triangle, distances.astype(np.float64), depth, positions)
    return positions


@np.errstate(all="ignore")  # a wrong distance may be any number
def _conversion_error(view: View, distances: Texture, model: ErrorModel) -> FloatArray:
    """Largest error of distances that a renderer computes from screen space z, (H, W); 0 without a surface."""
    z = distances.astype(np.float64)
    screen = view.depth_at(z)
    lower, upper = distance_ends(view, screen, screen, model)
    return np.where(np.isfinite(z), np.fmax(upper - z, z - lower), 0.0)


def _distance_bounds(view: View, bounds: Bounds, model: ErrorModel) -> Bounds:
    """Bounds of the distances that renderers compute from screen space z within bounds."""

    def ends(lower: Texture, upper: Texture) -> tuple[Texture, Texture]:
        low, high = distance_ends(view, lower.astype(np.float64), upper.astype(np.float64), model)
        return up_to_single(low), down_to_single(high)

    lower, upper = ends(bounds.lower, bounds.upper)
    return replace(bounds, lower=lower, upper=upper, ranges=None if bounds.ranges is None else ends(*bounds.ranges))
