"""Every estimator of the registry in float32 against float64, on textures and parameters that strain it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Value
from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.ao.textures import Buffers
from lfssao.bench.stability.inputs import UNCHANGED, display
from lfssao.bench.stability.measure import FINE, PATHS, Measured
from lfssao.bench.stability.table import Run
from lfssao.core.affine import transform_points
from lfssao.optics.camera import PROJECTIONS, Camera
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.rays import image_depth, texel_ray
from lfssao.optics.view import View

VIEWS = ("linear", "conical", "curved", *PROJECTIONS)  # flat displays by their diffuser, picoarray, cameras


def on(
    kind: str,
    texels: float = 0.0,
    radius: float = 0.0,
    changed: Callable[[Buffers], Buffers] | None = None,
    parameters: Mapping[str, Value] = MappingProxyType({}),
    **how: Any,
) -> Run:
    """Return a function that compares an estimator, given by name, on textures of ``seen``.

    R is a number of texels, or a radius in world units; ``changed`` makes other textures of them. An estimator that
    does not have the parameters gives None.
    """

    def run(name: str) -> Measured | None:
        if not set(parameters) <= set(ESTIMATORS[name].parameters):
            return None
        textures = seen(kind, **how)
        size = texels * _texel(textures) if texels else radius
        return compare(name, changed(textures) if changed else textures, size, parameters)

    return run


def compare(name: str, textures: Buffers, radius: float, parameters: Mapping[str, Value]) -> Measured:
    """Measure an estimator's float32 against its float64; texels outside [0, 1] exceed every bound.

    Decisions are texels, flipped where occlusion differs by more than ``FINE``, a code of a texture of 8 bits.
    """
    made, rotation = [], ESTIMATORS[name].rotation
    for path in PATHS:
        arrays = textures.depth, textures.positions, textures.normals
        buffers = Buffers(textures.view, *(array.astype(path) for array in arrays if array is not None))
        turned = buffers if rotation == "none" else buffers.turned(rotation)
        made.append(estimate(name, turned, radius, None, None, "radii", **parameters).texture.astype(np.float64))
    error = np.abs(made[0] - made[1])
    outside = sum(int((~((texture >= 0) & (texture <= 1))).sum()) for texture in made)
    rms, flipped = float(np.sqrt((error * error).mean())), int((~(error <= FINE)).sum())
    return Measured(None, None, float(error.max()), FINE, outside, flipped, 0, error.size, rms)


def _hills(s: FloatArray, t: FloatArray, odd: FloatArray) -> FloatArray:
    """A slanted wall with a ball and a step before it and a hole."""
    bump = np.sqrt(np.maximum(0.25 - (s - 0.2) ** 2 - t * t, 0))
    heights = 0.3 * s - 0.2 * t - 0.6 * bump - 0.4 * (s > 0.6) + 0 * odd
    return np.where((s < -0.7) & (t < -0.6), np.inf, heights)


# Heights at u and v, from -1 to 1 over the texture, and where the sum of column and row is odd, 1, or even, 0.
SURFACES: dict[str, Callable[[FloatArray, FloatArray, FloatArray], FloatArray]] = {
    "hills": _hills,
    "a plane": lambda s, t, odd: 0.3 + 0 * odd,
    "a chessboard": lambda s, t, odd: 0.3 + odd,
    "two layers": lambda s, t, odd: np.where(odd, _hills(s, t, odd), 0.3),
    "planes an ulp apart": lambda s, t, odd: 0.3 + 2.0**-23 * odd,
}


def _view(kind: str, width: int, height: int) -> View:
    if kind in PROJECTIONS:
        return Camera(kind, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.5, 1.0, 3.0).view(width, height)
    shown_by = find_display("picoarray") if kind == "curved" else replace(display(), diffuser=kind)
    return shown_by.with_resolution(width, height).view(0, UNCHANGED)


@cache
@np.errstate(divide="ignore", invalid="ignore")
def seen(kind: str, surface: str = "hills", relief: float = 0.25, size: tuple[int, int] = (48, 36)) -> Buffers:
    """Float64 textures of one of ``VIEWS`` on one of ``SURFACES``, whose 1 is ``relief`` metres; size: width, rows."""
    view = _view(kind, *size)
    s, t = np.meshgrid(*((np.arange(n) + 0.5) * 2 / n - 1 for n in size))
    heights = SURFACES[surface](s, t, np.indices(s.shape).sum(axis=0) % 2.0)
    depth, cast = np.full(s.shape, np.inf), np.full((*s.shape, 3), np.inf)
    for (j, i), z in np.ndenumerate((2.0 if kind in PROJECTIONS else 0.0) + relief * heights):
        x, y, _, across, down, _, near, far = texel_ray(view.rays, i + 0.5, j + 0.5)
        if near < z < far:
            depth[j, i], cast[j, i] = image_depth(view.rays, z), (x + z * across, y + z * down, z)
    points = transform_points(view.world_from_cast, cast.reshape(-1, 3)).reshape(cast.shape)
    look, place = Buffers(view, depth, cast).directions, np.pad(points, ((1, 1), (1, 1), (0, 0)), mode="edge")
    normals = np.cross(place[1:-1, 2:] - place[1:-1, :-2], place[2:, 1:-1] - place[:-2, 1:-1])
    normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True))
    normals = np.where(np.isfinite(normals).all(axis=2, keepdims=True), normals, look)  # at the hole's edge
    normals *= np.where((normals * look).sum(axis=2, keepdims=True) > 0, -1, 1)
    there = np.expand_dims(np.isfinite(depth), 2)
    return Buffers(view, depth, np.where(there, points, np.inf), np.where(there, normals, 0))


def _texel(textures: Buffers) -> float:
    """Median distance between points of neighbours in a row, world units; 1/16 where there are none."""
    steps = np.diff(np.where(np.isinf(textures.positions), np.nan, textures.positions), axis=1)
    return float(np.nanmedian(np.sqrt((steps * steps).sum(axis=2)))) if steps.size else 1 / 16
