"""Scalable Ambient Obscurance, whole (SAO sections 2.2 to 2.4 and its appendix): all passes from depth to blurred A.

    depth -> z (equation 2) -> hierarchy of z (table 1)          sao.kernels.linear_depth, z_pyramid
    z -> positions, face normals (equations 3 and 4)             lfssao.ao.estimators.sao.kernels.reconstruct
    s taps in the hierarchy -> A (equations 5 to 10)             lfssao.ao.estimators.sao.kernels.scalable, spiral
    2x2 average                                                  lfssao.ao.estimators.sao.kernels.quad
    A and z packed into three bytes                              lfssao.ao.estimators.sao.kernels.packing
    two bilateral passes of seven taps, stride three             lfssao.ao.estimators.sao.kernels.bilateral

What is decided here, as the paper is written for cameras and metres:

- Lengths are in radii. The appendix's A has the unit 1 / metre, its beta = 1 cm and epsilon = 1 cm are for a human
  scale; with r = 1 m they are ours, beta = 0.01 r, epsilon = 0.01 r^2 and the factor 1 / metre = 1 / r
  (``intensity``). For another r in metres intensity is 1 / r, beta 0.01 / r, epsilon 0.01 / r^2.
- A module's z is its depth texture, C and the face normals come from its positions texture, and a tap's Q stands on
  the tapped texel's own line at the hierarchy's z: a level holds z only, as in the paper, and the line takes the place
  of equation 3 (``sao.kernels.reconstruct``). The ball's image is an ellipse there, equation 5 with the length of a
  texel across and down at C's depth. Distances from the viewer, which the harmonic mean, equation 1's z_C beta and the
  packing need, are counted from the observers.
- Levels: the paper prints no MAX_MIP; 5 here. q' = 2^3, the least of the range it found to be equivalent.
- Neither the 2x2 average's threshold nor the Gaussian's width is printed: a depth difference of 0.02 r, and a
  standard deviation of three taps. z_min, 'the farthest plane at which sharp features are desired', is the view's
  farthest surface unless given.

Limits for s -> infinity, texels -> 0, before averaging and blur are means over the spiral's radius alpha in (0, 1) and,
over the hashed rotations, theta in (0, 2 pi): the density of taps per area falls off as 1 / h. One texel's taps with a
fixed number of turns tend to a mean along its spiral, not over the disk. With u = v / r of a tap, in radii, of a
surface z = h(x, y) seen from straight above by an orthographic camera, u = (alpha cos t, alpha sin t, rise of h):

    occlusion = min(1, (5 intensity / (2 pi)) int_0^1 int_0^2pi max(1 - u.u, 0)^3 max(u.n - beta, 0)
                       / (u.u + epsilon) dt d alpha)

with 2 sigma / (2 pi), without the cubed factor and with beta d for beta by equation 1.

- Plane, convex crease, top of a sphere: u.n <= 0 for all taps, so that the occlusion is 0, for every beta >= 0.
- Crease of two planes that meet at a right angle, seen along its bisector, C at a distance a r from it, measured across
  the view: a tap lies on C's plane for alpha cos t <= a, where its term is 0. Beyond, u.n = sqrt 2 (alpha cos t - a)
  and u.u = alpha^2 + (2 a - alpha cos t)^2.
- Floor at a distance a r before a step up of height H r: u.n = H and u.u = alpha^2 + H^2 where alpha cos t > a, an
  angle of 2 arccos(a / alpha); else u.n = 0.
- Floor beside a sphere of radius s that stands on it: u.n r = s + sqrt(s^2 - q^2) for taps at a distance q < s from
  below its middle, else 0; the integral has no shorter form.
"""

from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.sao.kernels import bilateral, packing, scalable, z_pyramid
from lfssao.ao.estimators.sao.kernels.face_normals import face_normals
from lfssao.ao.estimators.sao.kernels.quad import average_quads
from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE
from lfssao.ao.estimators.sao.texel_rays import TexelLines, linear_z, positions_of, texel_lines
from lfssao.ao.kernels.blur import gaussian_weights
from lfssao.ao.passes import Occlusion
from lfssao.ao.textures import Buffers, Texture
from lfssao.samples import best_turns
from lfssao.samples.kernels import spiral

FILTERS = {
    "none": -1,
    "rotated": z_pyramid.ROTATED,
    "arithmetic": z_pyramid.ARITHMETIC,
    "harmonic": z_pyramid.HARMONIC,
    "min": z_pyramid.MIN,
    "max": z_pyramid.MAX,
}
HASHES = {"paper": spiral.PAPER, "common": spiral.COMMON}
TAPS_RADIUS, STRIDE = 3, 3  # of a bilateral pass: seven taps, three texels apart


def z_hierarchy(z: Texture, mip: str, max_level: int, origin: float = 0.0) -> list[Texture]:
    """The levels of z, each half of the last, rounded up, until one texel or ``max_level``.

    Parameters
    ----------
    z : (H, W) float32 or float64
        Level 0, +infinity where there is no surface.
    mip : str
        A key of ``FILTERS``; 'none' makes level 0 only.
    max_level : int
        The last level at most.
    origin : float
        z from which the harmonic mean counts distances.
    """
    levels = [z]
    while mip != "none" and len(levels) <= max_level and max(levels[-1].shape) > 1:
        height, width = levels[-1].shape
        target = np.empty(((height + 1) // 2, (width + 1) // 2), z.dtype)
        z_pyramid.next_level(levels[-1], FILTERS[mip], z.dtype.type(origin), target)
        levels.append(target)
    return levels


@lru_cache(maxsize=2)
def _rotations(height: int, width: int, variant: int, dtype: np.dtype[Any]) -> Texture:
    """Equation 8's rotations: they depend on nothing but the texel's place, so that a size's are made once."""
    rotations = np.empty((2, height, width), dtype)
    scalable.write_rotations(variant, rotations)
    return rotations


def sample(
    buffers: Buffers,
    z: Texture,
    lines: TexelLines,
    radius: float,
    bias: tuple[float, float],
    scale: float,
    falloff: bool,
    taps: int,
    turns: int,
    hashed: str,
    mip: str,
    log_q: int,
    max_level: int,
    epsilon: float,
) -> tuple[Texture, int]:
    """The sampling pass before averaging: A, (H, W), and how many taps fell outside the texture.

    Parameters
    ----------
    buffers, z, lines : Buffers, (H, W), TexelLines
        The view, its linear z and its texels' lines.
    radius : float
        r, world units, above 0.
    bias : two floats
        What is taken off u.n, and what times the distance from the viewer in radii.
    scale : float
        The sum's factor.
    falloff : bool
        The appendix's falloff, or equation 1.
    taps, turns, hashed, mip, log_q, max_level, epsilon : int, int, str, str, int, int, float
        The parameters of those names.
    """
    dtype = z.dtype
    with np.errstate(over="ignore", under="ignore", divide="ignore"):  # of radii that the dtype does not hold
        one = dtype.type
        inverse = one(1 / radius) if radius > 0 and isfinite(1 / radius) else one(np.inf)
        units = lines.units if lines.kind == SEPARABLE else np.ones(3)
        reach_u, reach_v = one(radius / units[0]), one(radius / units[1])
        depth_bias = one(bias[1] * float(lines.units[2]) / radius) if bias[1] > 0 else one(0)
    positions = positions_of(buffers, z, lines)
    normals = np.empty_like(positions)
    face_normals(z, positions, lines.kind, lines.numbers, lines.table, lines.world, normals)
    levels = z_hierarchy(z, mip, max_level, lines.origin)
    first = np.cumsum([0, *(level.size for level in levels[:-1])]).astype(np.int32)
    table = np.empty((taps, 3), dtype)
    spiral.unit_taps(turns or best_turns(taps), table)
    visibility, outside = np.empty_like(z), np.empty(z.shape[0], np.int64)
    separable = lines.kind == SEPARABLE
    run = scalable.scalable_visibility if separable else scalable.scalable_visibility_table
    run(
        z, np.concatenate([level.ravel() for level in levels]), first, positions, normals,
        _rotations(*z.shape, HASHES[hashed], dtype), table, lines.numbers if separable else lines.table, lines.world,
        reach_u, reach_v, inverse, log_q, one(falloff), one(bias[0]), depth_bias, one(lines.origin), one(epsilon),
        one(scale), visibility, outside,
    )  # fmt: skip
    return visibility, int(outside.sum())


def average(visibility: Texture, z: Texture, edge: float) -> Texture:
    """The 2x2 average of A; ``edge``: the depth difference, units of z, from which on texels are kept apart."""
    averaged = np.empty_like(visibility)
    with np.errstate(over="ignore"):
        average_quads(visibility, z, z.dtype.type(edge), averaged)
    return averaged


def keys_of(z: Texture, origin: float, z_min: float) -> Texture:
    """Bilateral and packing key of each texel, (H, W), 0 at ``origin`` to 1 at ``z_min`` and beyond.

    Parameters
    ----------
    z : (H, W) float32 or float64
        +infinity where there is no surface.
    origin, z_min : float
        z of key 0; distance of key 1 from it, 0: that of the farthest surface.
    """
    if z_min == 0:
        z_min = float(np.max(z, initial=-np.inf, where=z < np.inf)) - origin
    keys = np.empty_like(z)
    scale = 1 / z_min if z_min > 0 and isfinite(1 / z_min) else 1.0
    with np.errstate(over="ignore", under="ignore"):
        packing.depth_keys(z, z.dtype.type(origin), z.dtype.type(scale), keys)
    return keys


def pack(visibility: Texture, keys: Texture) -> NDArray[np.uint8]:
    """A and key, (H, W) each, in three bytes a texel: (H, W, 3) uint8 (``sao.kernels.packing``)."""
    rgb = np.empty((*keys.shape, 3), np.uint8)
    packing.pack(visibility, keys, rgb)
    return rgb


def unpack(rgb: NDArray[np.uint8], dtype: np.dtype[Any]) -> tuple[Texture, Texture]:
    """A and key, (H, W) of a dtype, from three bytes a texel."""
    visibility, keys = np.empty(rgb.shape[:2], dtype), np.empty(rgb.shape[:2], dtype)
    packing.unpack(rgb, visibility, keys)
    return visibility, keys


def reconstruct(visibility: Texture, keys: Texture, gauss: float, sharpness: float, packed: bool) -> Texture:
    """The two bilateral passes, horizontal then vertical (section 2.4).

    Parameters
    ----------
    visibility, keys : (H, W)
        A and depth between 0 and 1, +infinity where there is no surface.
    gauss : float
        Standard deviation of the Gaussian weights, taps.
    sharpness : float
        What the depth difference is multiplied by.
    packed : bool
        Whether the input and the first pass' output go through three bytes a texel.
    """
    weights = np.empty(2 * TAPS_RADIUS + 1)
    gaussian_weights(gauss, TAPS_RADIUS, weights)
    weights = weights.astype(visibility.dtype)
    sharp = visibility.dtype.type(sharpness)
    for one_pass in (bilateral.bilateral_horizontal, bilateral.bilateral_vertical):
        if packed:
            visibility, keys = unpack(pack(visibility, keys), visibility.dtype)
        target = np.empty_like(visibility)
        one_pass(visibility, keys, weights, STRIDE, sharp, target)
        visibility = target
    return visibility


def _whole(
    buffers: Buffers,
    radius: float,
    bias: tuple[float, float],
    scale: float,
    falloff: bool,
    k: float,
    sampling: dict[str, Value],
    quad_edge: float,
    gauss: float,
    sharpness: float,
    z_min: float,
    packed: bool,
) -> Occlusion:
    """All passes; a standard deviation ``gauss`` of 0 leaves the bilateral ones out."""
    z = linear_z(buffers)
    if radius == 0:  # an empty ball holds nothing
        return Occlusion(np.zeros_like(z), 0)
    lines = texel_lines(buffers.view, z.dtype)
    visibility, outside = sample(buffers, z, lines, radius, bias, scale, falloff, **sampling)  # type: ignore[arg-type]
    occlusion = np.empty_like(z)
    visibility = average(visibility, z, quad_edge * radius / float(lines.units[2]))
    if gauss > 0:
        visibility = reconstruct(visibility, keys_of(z, lines.origin, z_min), gauss, sharpness, packed)
    scalable.occlusion_of(visibility, z, k, occlusion)
    return Occlusion(occlusion, outside)


def sao(
    buffers: Buffers,
    radius: float,
    points: None,
    weights: None,
    intensity: float,
    beta: float,
    epsilon: float,
    taps: int,
    turns: int,
    hashed: str,
    mip: str,
    log_q: int,
    max_level: int,
    quad_edge: float,
    gauss: float,
    sharpness: float,
    z_min: float,
    packed: bool,
) -> Occlusion:
    """SAO with the appendix's falloff: A = max(0, 1 - 5 intensity / s sum (1 - u.u)^3 max((u.n - beta) / (u.u + eps), 0)).

    Parameters
    ----------
    buffers : Buffers
        The view's textures; a camera's positions are not read.
    radius : float
        r, world units.
    points, weights : None
        It has its own taps.
    intensity, beta, epsilon : float
        Strength (radii), bias (radii) and what keeps the quotient finite (radii squared).
    taps, turns : int
        s and tau, equation 6; 0 turns: the most even number (``lfssao.samples.best_turns``).
    hashed : str
        Equation 8 as C reads it, 'paper', or as other renderers ship it, 'common'.
    mip : str
        Filter of the z hierarchy, table 1, or 'none'.
    log_q, max_level : int
        log2 of q' (equation 9), and the last level.
    quad_edge : float
        Depth difference, radii, from which on the 2x2 average keeps texels apart; 0: no average.
    gauss : float
        Standard deviation of the bilateral passes, taps; 0: no such passes.
    sharpness, z_min : float
        Constant of their depth weight, and the distance from the viewer, units of linear z, that it is relative to;
        0: the farthest surface.
    packed : bool
        Whether A and z go through three bytes a texel between the passes.
    """  # noqa: E501
    sampling: dict[str, Value] = {
        "taps": taps, "turns": turns, "hashed": hashed, "mip": mip, "log_q": log_q, "max_level": max_level,
        "epsilon": epsilon,
    }  # fmt: skip
    scale = 5 * intensity / taps
    return _whole(
        buffers, radius, (beta, 0.0), scale, True, 1.0, sampling, quad_edge, gauss, sharpness, z_min, packed
    )  # fmt: skip


def sao_equation1(
    buffers: Buffers,
    radius: float,
    points: None,
    weights: None,
    sigma: float,
    beta: float,
    k: float,
    epsilon: float,
    taps: int,
    turns: int,
    hashed: str,
    mip: str,
    log_q: int,
    max_level: int,
    quad_edge: float,
    gauss: float,
    sharpness: float,
    z_min: float,
    packed: bool,
) -> Occlusion:
    """SAO as first published: A = max(0, 1 - 2 sigma / s sum max(0, u.n - beta d) / (u.u + epsilon))^k, equation 1.

    d is the distance from the viewer along the axis, in radii: the paper's v.n + z_C beta. The power is taken last,
    after averaging and blur: it is 1 by default, and the paper does not say when.

    Parameters
    ----------
    buffers : Buffers
        The view's textures; a camera's positions are not read.
    radius : float
        r, world units.
    points, weights : None
        It has its own taps.
    sigma, beta : float
        Strength, radii, and bias, a share of the distance from the viewer.
    k : float
        The power of A.
    epsilon : float
        What keeps the quotient finite, radii squared.
    taps, turns, hashed, mip, log_q, max_level, quad_edge, gauss, sharpness, z_min, packed : as in sao
        The passes.
    """
    sampling: dict[str, Value] = {
        "taps": taps, "turns": turns, "hashed": hashed, "mip": mip, "log_q": log_q, "max_level": max_level,
        "epsilon": epsilon,
    }  # fmt: skip
    scale = 2 * sigma / taps
    return _whole(
        buffers, radius, (0.0, beta), scale, False, k, sampling, quad_edge, gauss, sharpness, z_min, packed
    )  # fmt: skip


_PASSES: dict[str, Value] = {
    "taps": 9, "turns": 7, "hashed": "paper", "mip": "rotated", "log_q": 3, "max_level": 5, "quad_edge": 0.02,
    "gauss": 3.0, "sharpness": 2048.0, "z_min": 0.0, "packed": True,
}  # fmt: skip
_MOST = 1e6
_LIMITS = {
    "intensity": (0.0, _MOST), "sigma": (0.0, _MOST), "beta": (0.0, _MOST), "epsilon": (0.0, _MOST), "k": (0.0, 100.0),
    "taps": (1, 999), "turns": (0, 999), "log_q": (0, 15), "max_level": (0, 15), "quad_edge": (0.0, _MOST),
    "gauss": (0.0, 100.0), "sharpness": (0.0, 1e9), "z_min": (0.0, 1e12),
}  # fmt: skip
_CHOICES = {"hashed": tuple(HASHES), "mip": tuple(FILTERS)}


def _entry(name: str, title: str, source: str, run: Any, own: dict[str, Value]) -> Estimator:
    parameters = {**own, **_PASSES}
    limits = {key: value for key, value in _LIMITS.items() if key in parameters}
    return Estimator(
        name,
        title,
        source,
        run,
        dimensions=0,
        count=9,
        parameters=parameters,
        limits=limits,
        choices=_CHOICES,
        texel_bytes=96,  # where a table has the texels' lines; 47 elsewhere
    )


ENTRIES = (
    _entry(
        "sao",
        "Scalable Ambient Obscurance with its updated falloff",
        "SAO equations 2 to 10 and appendix",
        sao,
        {"intensity": 1.0, "beta": 0.01, "epsilon": 0.01},
    ),
    _entry(
        "sao-equation-1",
        "Scalable Ambient Obscurance with the falloff first published",
        "SAO equations 1 to 10",
        sao_equation1,
        {"sigma": 1.0, "beta": 1e-4, "k": 1.0, "epsilon": 0.01},
    ),
)
