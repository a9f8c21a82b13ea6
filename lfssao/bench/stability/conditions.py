"""Every estimator of the registry in float32 against float64, on textures and parameters that strain it.

``CONDITIONS`` says what is stated of float32 under each.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import chain, product
from types import MappingProxyType
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Value
from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.ao.textures import Buffers
from lfssao.bench.stability.inputs import UNCHANGED, display
from lfssao.bench.stability.measure import FINE, PATHS, Measured
from lfssao.bench.stability.table import Inputs, Run, Stated
from lfssao.core.affine import transform_points
from lfssao.optics.camera import PROJECTIONS, Camera
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.rays import image_depth, texel_ray

VIEWS = ("linear", "conical", "curved", *PROJECTIONS)  # flat displays by their diffuser, picoarray, cameras


def on(
    kind: str,
    texels: float = 0.0,
    radius: float = 0.0,
    changed: Callable[[Buffers], Buffers] | None = None,
    parameters: Mapping[str, Value] = MappingProxyType({}),
    **how: Any,
) -> Run:
    """Return a function that compares an estimator by name on textures of ``seen``, ``changed``, or gives None.

    R is a number of texels or in world units. None is for an estimator that does not have the parameters.
    """

    def run(name: str) -> Measured | None:
        if not set(parameters) <= set(ESTIMATORS[name].parameters):
            return None
        textures = buffers_of(kind, **how)
        size = texels * texel_size(textures) if texels else radius
        return compare(name, changed(textures) if changed else textures, size, parameters)

    return run


def compare(name: str, textures: Buffers, radius: float, parameters: Mapping[str, Value]) -> Measured:
    """Measure an estimator's float32 against its float64; texels outside [0, 1] exceed every bound.

    Decisions are texels, flipped where occlusion differs by more than ``FINE``, a code of a texture of 8 bits.
    """
    occlusions = []
    rotation = ESTIMATORS[name].rotation
    for path in PATHS:
        arrays = textures.depth, textures.positions, textures.normals
        buffers = Buffers(textures.view, *(array.astype(path) for array in arrays if array is not None))
        turned = buffers if rotation == "none" else buffers.turned(rotation)
        occlusions.append(estimate(name, turned, radius, None, None, "radii", **parameters).texture.astype(np.float64))
    error = np.abs(occlusions[0] - occlusions[1])
    outside = sum(int((~((texture >= 0) & (texture <= 1))).sum()) for texture in occlusions)
    rms = float(np.sqrt((error * error).mean()))
    flipped = int((~(error <= FINE)).sum())
    return Measured(None, None, float(error.max()), FINE, outside, flipped, 0, error.size, rms)


def _hills(s: FloatArray, t: FloatArray, odd: FloatArray) -> FloatArray:
    """Return a slanted wall with a ball and a step before it and a hole."""
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


@cache
@np.errstate(divide="ignore", invalid="ignore")
def buffers_of(kind: str, surface: str = "hills", relief: float = 0.25, size: tuple[int, int] = (48, 36)) -> Buffers:
    """Float64 textures of one of ``VIEWS`` on one of ``SURFACES``, whose 1 is ``relief`` metres; size: width, rows."""
    if kind in PROJECTIONS:
        view = Camera(kind, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.5, 1.0, 3.0).view(*size)
    else:
        shown_by = find_display("picoarray") if kind == "curved" else replace(display(), diffuser=kind)
        view = shown_by.with_resolution(*size).view(0, UNCHANGED)
    s, t = np.meshgrid(*((np.arange(n) + 0.5) * 2 / n - 1 for n in size))
    heights = SURFACES[surface](s, t, np.indices(s.shape).sum(axis=0) % 2.0)
    depth = np.full(s.shape, np.inf)
    cast = np.full((*s.shape, 3), np.inf)
    for (j, i), z in np.ndenumerate((2.0 if kind in PROJECTIONS else 0.0) + relief * heights):
        x, y, _, across, down, _, near, far = texel_ray(view.rays, i + 0.5, j + 0.5)
        if near < z < far:
            depth[j, i], cast[j, i] = image_depth(view.rays, z), (x + z * across, y + z * down, z)
    points = transform_points(view.world_from_cast, cast.reshape(-1, 3)).reshape(cast.shape)
    look = Buffers(view, depth, cast).directions
    place = np.pad(points, ((1, 1), (1, 1), (0, 0)), mode="edge")
    normals = np.cross(place[1:-1, 2:] - place[1:-1, :-2], place[2:, 1:-1] - place[:-2, 1:-1])
    normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True))
    normals = np.where(np.isfinite(normals).all(axis=2, keepdims=True), normals, look)  # at the hole's edge
    normals *= np.where((normals * look).sum(axis=2, keepdims=True) > 0, -1, 1)
    visible = np.expand_dims(np.isfinite(depth), 2)
    return Buffers(view, depth, np.where(visible, points, np.inf), np.where(visible, normals, 0))


def texel_size(textures: Buffers) -> float:
    """Median distance between points of neighbours in a row, world units; 1/16 where there are none."""
    steps = np.diff(np.where(np.isinf(textures.positions), np.nan, textures.positions), axis=1)
    return float(np.nanmedian(np.sqrt((steps * steps).sum(axis=2)))) if steps.size else 1 / 16


# RMS errors of occlusion up to which a sentence excuses flipped texels.
FEW = 2.0**-7, "rounding moves a sample past a texel's edge or a surface"
_SMALL = "the ball is smaller than the rounding of the surface's points"
_AT_A_POINT = dict.fromkeys(("lf", "point", "hemisphere", "vo-area"), (0.75, _SMALL))
_EDGE_ON = dict.fromkeys(("sao", "sao-equation-1"), (0.25, "a face normal that is edge-on turns either way"))

CONDITIONS: dict[str, tuple[str, Stated]] = {
    "balls": ("R of 2^4 texels to 1", {"": FEW}),
    "balls below a texel": ("R of 2^-2 and 2^-4 texels", {"": FEW}),
    "balls of rounding": ("R of 2^-8 and 2^-12 texels", {"": (0.125, _SMALL)}),
    "R to infinity": ("its products overflow", {"": (0.25, "R times the mapping leaves the range of float32")}),
    "R to 0": ("the ball is a point on the surface", {"": FEW, **_AT_A_POINT}),
    "epsilon": ("to 0: a division by v . v alone", {"": FEW}),
    "passes": ("bilateral weights, packed bytes, harmonic and other means of depth", {"": FEW}),
    "normals": ("edge-on as at silhouettes, turned away, none or short", {"": FEW}),
    "texels' corners": ("points on them, over a chessboard of depths", {"": (0.25, "rounding picks a texel")}),
    "coplanar": ("a plane at one depth, two layers, doubled surfaces an ulp apart", {"": FEW}),
    "not finite": ("infinity in a seventh of the texels, and in all", {"": FEW, **_EDGE_ON}),
    "sizes": ("textures of one texel, row or column, and 10^4 wide", {"": FEW}),
}


def conditions() -> Inputs:
    """Yield inputs of all conditions: the name, a text, and a function that runs an estimator by name."""
    for kind in VIEWS:
        for name, text, run in chain(_radii(kind), _parameters(kind), _textures(kind)):
            yield name, f"{kind}, {text}", run


def _radii(kind: str) -> Inputs:
    powers = {"balls": (4, 2, 0), "balls below a texel": (-2, -4), "balls of rounding": (-8, -12)}
    for name, power in ((ball, power) for ball in powers for power in powers[ball]):
        yield name, f"R = 2^{power} texels", on(kind, 2.0**power)
    for radius in (1e3, 1e18, 1e30, 1e38):
        yield "R to infinity", f"R = {radius:g}", on(kind, radius=radius)
    for radius in (1e-30, 5e-324, 0.0):
        yield "R to 0", f"R = {radius:g}", on(kind, radius=radius)


def _parameters(kind: str) -> Inputs:
    for power, epsilon in product((2, -12), (1e-30, 0.0)):
        text = f"R = 2^{power} texels, beta = 0, epsilon = {epsilon:g}"
        guards = {"epsilon": epsilon, "beta": 0.0}
        yield "epsilon", text, on(kind, 2.0**power, parameters=guards)
    passes: dict[str, tuple[Value, ...]] = {
        "sharpness": (0.0, 1e9), "gauss": (1e-3, 1e2), "packed": (False,), "z_min": (1e-6, 1e12),
        "mip": ("arithmetic", "harmonic", "min", "max"),
    }  # fmt: skip
    for option, value in ((name, value) for name in passes for value in passes[name]):
        yield "passes", f"{option} = {value}", on(kind, 16.0, parameters={option: value})
    relief = 0.99 if kind in PROJECTIONS else 2.4  # to both ends of the depths there are
    for mip in ("rotated", "harmonic"):
        text = f"depths of the whole range, mip = {mip}"
        yield "passes", text, on(kind, 16.0, relief=relief, parameters={"mip": mip})


def _textures(kind: str) -> Inputs:
    yield "normals", "edge-on", on(kind, 4.0, changed=_edge_on)
    for scale in (-1.0, 0.0, 1e-30):
        scaled = partial(lambda k, t: replace(t, normals=k * np.asarray(t.normals)), scale)
        yield "normals", f"{scale:g} n", on(kind, 4.0, changed=scaled)
    for power in (2, -12):
        board = on(kind, 2.0**power, changed=partial(at_corners, kind), surface="a chessboard", relief=0.05)
        yield "texels' corners", f"R = 2^{power} texels", board
    for surface in ("a plane", "two layers", "planes an ulp apart"):
        yield "coplanar", surface, on(kind, 4.0, surface=surface)
    for name, wrong, every in product(("depth", "positions", "normals"), (np.inf, -np.inf), (7, 1)):
        text = f"{name} {wrong}, one in {every}"
        yield "not finite", text, on(kind, 4.0, changed=partial(_spoilt, name, wrong, every))
    for size in ((1, 1), (9, 1), (1, 9), (10_000, 2)):
        yield "sizes", "{} x {}".format(*size), on(kind, 4.0, size=size)


def _edge_on(textures: Buffers) -> Buffers:
    edge = np.cross(textures.directions, np.asarray(textures.normals))
    return replace(textures, normals=edge / np.maximum(np.sqrt((edge * edge).sum(axis=2)), 1e-9)[..., None])


def at_corners(kind: str, textures: Buffers) -> Buffers:
    """Return positions of a plane in the texels' upper left corners, where there are some."""
    flat = buffers_of(kind, "a plane", 0.05).positions.copy()
    flat[1:, 1:] = (flat[1:, 1:] + flat[:-1, 1:] + flat[1:, :-1] + flat[:-1, :-1]) / 4
    return replace(textures, positions=flat)


def _spoilt(name: str, wrong: float, every: int, textures: Buffers) -> Buffers:
    texture = getattr(textures, name).copy()
    texture.reshape(textures.depth.size, -1)[every // 2 :: every] = wrong
    return replace(textures, **{name: texture})
