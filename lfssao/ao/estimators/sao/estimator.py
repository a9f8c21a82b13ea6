"""Scalable Ambient Obscurance, whole (SAO sections 2.2 to 2.4 and its appendix): all passes from depth to blurred A.

    depth -> z (equation 2) -> hierarchy of z (table 1)          sao/kernels/reconstruct, z_pyramid
    z -> positions, face normals (equations 3 and 4)             sao/kernels/reconstruct
    s taps in the hierarchy -> A (equations 5 to 10)             sao/sampling, samples/kernels/spiral
    2x2 average                                                  sao/kernels/passes
    A and z packed into three bytes                              sao/kernels/passes
    two bilateral passes of seven taps, stride three             sao/kernels/passes

``sao`` has the appendix's falloff, ``sao-equation-1`` the one first published. With u = v / r and n the normal,

    sao              A = max(0, 1 - 5 intensity / s sum (1 - u.u)^3 max((u.n - beta) / (u.u + epsilon), 0))
    sao-equation-1   A = max(0, 1 - 2 sigma / s sum max(0, u.n - beta d) / (u.u + epsilon))^k

where d is the distance from the viewer along the axis, in radii: the paper's v.n + z_C beta. Decided here, as the paper
is written for cameras and metres:

- Lengths are in radii. The appendix's A has the unit 1 / metre, its beta = 1 cm and epsilon = 1 cm are for a human
  scale; with r = 1 m they are ours. For another r in metres intensity is 1 / r, beta 0.01 / r, epsilon 0.01 / r^2.
- A module's z is its depth texture, C and the face normals come from its positions texture, and a tap's Q stands on
  the tapped texel's own ray at the hierarchy's z, which takes the place of equation 3. The ball's image is an ellipse
  there: equation 5 with a texel's length across and down at C's depth. Distances from the viewer are counted from the
  observers.
- Published shaders land taps otherwise, read n from a texture, write 6.28 for 2 pi and add angles in float32, which
  rounds them by up to 2 at 1920 x 1080: ``landing``, ``normals``, ``full_turn`` and ``angle_sum``.
- The paper prints no MAX_MIP (5 here), neither the 2x2 average's threshold (0.02 r of depth) nor the Gaussian's width
  (three taps). q' = 2^3 is the least of the range it found equivalent. z_min, 'the farthest plane at which sharp
  features are desired', is the view's farthest surface unless given. k = 1 and the power is taken last.

Limits for s -> infinity, texels -> 0, before averaging and blur are means over the spiral's radius alpha in (0, 1) and,
over all turns, theta in (0, 2 pi). One texel's taps tend to a mean along its spiral, not over the disk. For a surface
z = h(x, y) seen from straight above by an orthographic camera, u = (alpha cos t, alpha sin t, rise of h):

    occlusion = min(1, (5 intensity / (2 pi)) int_0^1 int_0^2pi max(1 - u.u, 0)^3 max(u.n - beta, 0)
                       / (u.u + epsilon) dt d alpha)

with 2 sigma / (2 pi), without the cubed factor and with beta d for beta by equation 1: 0 on planes, convex creases and
the top of a sphere, as u.n <= 0 for all taps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Options, option
from lfssao.ao.estimators.look_ups import Bordered
from lfssao.ao.estimators.sao.hierarchy import FILTERS, levels_of, z_hierarchy
from lfssao.ao.estimators.sao.kernels import passes
from lfssao.ao.estimators.sao.kernels.passes import average_quads, bilateral
from lfssao.ao.estimators.sao.kernels.reconstruct import face_normals, rebuild_positions
from lfssao.ao.estimators.sao.sampling import Sao, visibility_of
from lfssao.ao.estimators.sao.texel_rays import linear_z, texel_rays
from lfssao.ao.formulas import float_view
from lfssao.ao.kernels.float_view import FloatView
from lfssao.ao.kernels.sums import sum_samples
from lfssao.ao.kernels.texel_rays import TexelRays
from lfssao.ao.reference import gaussian_weights
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.distinct import distinct
from lfssao.core.elementary import PI, sincospi
from lfssao.optics.kernels.projection import MATRIX
from lfssao.samples import best_turns
from lfssao.samples.kernels import spiral

LANDINGS = {"floor": -1, "truncate": 0, "nearest": 1}
TAPS_RADIUS, STRIDE = 3, 3  # of a bilateral pass: seven taps, three texels apart
_MOST = 1e6


@dataclass(frozen=True)
class SaoOptions(Bordered):
    """Options of the passes, of both falloffs."""

    taps: int = option(9, "s, equation 6", limits=(1, 999))
    turns: int = option(7, "tau, equation 6; 0: the most even number", limits=(0, 999))
    landing: str = option(
        "floor",
        "a tap's texel: x' + h u cut down, as in equation 10; or h u cut towards 0, or at the nearest whole number",
        choices=tuple(LANDINGS),
    )
    sine: str = option(
        "down",
        "where equation 6's sine is in the image: up where shaders count rows from below",
        choices=("down", "up"),
    )
    normals: str = option("face", "n: equation 4's, or that of the normals texture", choices=("face", "buffer"))
    reach: float = option(1.0, "radius of the taps in the image over that of equation 5", limits=(0.0, _MOST))
    full_turn: str = option("exact", "2 pi in equation 6, or what shaders write for it", choices=("exact", "6.28"))
    angle_sum: str = option(
        "exact",
        "a tap's angle and its texel's; float32: rounded, as shaders add the common hash, by which alone it turns",
        choices=("exact", "float32"),
    )
    mip: str = option("rotated", "filter of the z hierarchy, table 1, or none", choices=tuple(FILTERS))
    log_q: int = option(3, "log2 of q', equation 9", limits=(0, 15))
    max_level: int = option(5, "last level of the hierarchy", limits=(0, 15))
    quad_edge: float = option(0.02, "depth edge of the 2x2 average, in radii; 0: none", limits=(0.0, _MOST), power=1)
    gauss: float = option(3.0, "standard deviation of the bilateral passes, taps; 0: none", limits=(0.0, 100.0))
    sharpness: float = option(2048.0, "constant of their depth weight", limits=(0.0, 1e9))
    z_min: float = option(
        0.0, "distance, linear z, that this constant is relative to; 0: the farthest surface", limits=(0.0, 1e12)
    )
    packed: bool = option(True, "whether A and z go through three bytes a texel between the passes")


@dataclass(frozen=True)
class _Appendix(Options):
    intensity: float = option(1.0, "strength, in radii", limits=(0.0, _MOST), power=1)
    beta: float = option(0.01, "bias, in radii", limits=(0.0, _MOST), power=1)
    epsilon: float = option(0.01, "guards the division, in squared radii", limits=(0.0, _MOST), power=2)


@dataclass(frozen=True)
class _Equation1(Options):
    sigma: float = option(1.0, "strength, in radii", limits=(0.0, _MOST), power=1)
    beta: float = option(1e-4, "bias, a fraction of the distance from the viewer", limits=(0.0, _MOST))
    k: float = option(1.0, "contrast: the exponent of A", limits=(0.0, 100.0))
    epsilon: float = option(0.01, "guards the division, in squared radii", limits=(0.0, _MOST), power=2)


@dataclass(frozen=True)
class AppendixOptions(SaoOptions, _Appendix):
    """Options of ``sao``."""


@dataclass(frozen=True)
class Equation1Options(SaoOptions, _Equation1):
    """Options of ``sao-equation-1``."""


AnyOptions = AppendixOptions | Equation1Options


def sao_view(buffers: Buffers, z: Texture, options: SaoOptions) -> FloatView:
    """Return a view with z in place of depth, points and, where options say so, face normals made of it.

    A module's points are those of its positions texture. Places are image points.
    """
    rays = texel_rays(buffers.view, z.dtype)
    view = float_view(buffers, (), options)._replace(kind=MATRIX, depth=z.ravel(), surfaces=z.ravel(), rays=rays)
    made = np.empty((*z.shape, 3), z.dtype)
    if buffers.view.screen_to_world is not None:
        rebuild_positions(view, made)
        view = view._replace(positions=made.ravel())
    if options.normals == "face":
        made = np.empty_like(made)
        face_normals(view, made)
        view = view._replace(normals=made.ravel())
    return view


def sampling_pass(
    buffers: Buffers, z: Texture, radius: float, options: AnyOptions, change: Callable[[Sao], Sao] | None = None
) -> tuple[FloatView, Sao]:
    """Return a view with the hierarchy of z, and the numbers of taps and terms, changed by a function.

    radius: r > 0, world units.
    """
    view = sao_view(buffers, z, options)
    levels = levels_of(z_hierarchy(z, options.mip, options.max_level, view.rays.origin))
    numbers = sao_numbers(options, view.rays, radius, z)
    return view._replace(levels=levels), distinct(numbers if change is None else change(numbers))


def sample(
    buffers: Buffers, z: Texture, radius: float, options: AnyOptions, change: Callable[[Sao], Sao] | None = None
) -> tuple[Texture, int]:
    """Return A before averaging, (H, W), and how many taps fell outside; arguments are those of ``sampling_pass``."""
    sums = run_kernel(sum_samples, z, *sampling_pass(buffers, z, radius, options, change))
    return visibility_of(scale_of(options, z.dtype), sums.texture), sums.outside


def unit_taps(options: SaoOptions, dtype: np.dtype[Any]) -> Texture:
    """Taps at angle 0 (equations 6 and 7), (s, 3)."""
    taps = np.empty((options.taps, 3), dtype)
    spiral.unit_taps(options.turns or best_turns(options.taps), taps)
    if options.full_turn == "6.28":
        taps[:, :2] = [sincospi(angle / PI)[::-1] for angle in tap_angles(options).tolist()]
    return taps


def tap_angles(options: SaoOptions) -> NDArray[np.float64]:
    """Angles of the taps, radians, (s,): equation 6 without phi."""
    tau, half = options.turns or best_turns(options.taps), PI if options.full_turn == "exact" else 3.14
    return np.array([half * ((2 * i + 1) * tau / options.taps) for i in range(options.taps)])


def scale_of(options: AnyOptions, dtype: np.dtype[Any]) -> Any:
    """The factor of the sum of terms in A."""
    strength = 2 * options.sigma if isinstance(options, Equation1Options) else 5 * options.intensity
    with np.errstate(over="ignore"):
        return dtype.type(strength / options.taps)


def sao_numbers(options: AnyOptions, rays: TexelRays, radius: float, z: Texture) -> Sao:
    """Numbers of taps and terms, made in float64, in the dtype of z."""
    one, first = z.dtype.type, isinstance(options, Equation1Options)
    units, slope = rays.units if rays.table is None else np.ones(3), options.beta if first else 0.0
    with np.errstate(over="ignore", under="ignore", divide="ignore"):  # of radii that the dtype does not hold
        return Sao(
            points=unit_taps(options, z.dtype),
            angles=tap_angles(options) if options.angle_sum == "float32" else None,
            landing=LANDINGS[options.landing],
            up=options.sine == "up",
            height=z.shape[0],
            width=z.shape[1],
            reach_u=one(options.reach * radius / units[0]),
            reach_v=one(options.reach * radius / units[1]),
            inverse=one(1 / radius) if isfinite(1 / radius) else one(np.inf),
            cubed=not first,
            bias=one(0.0 if first else options.beta),
            depth_bias=one(slope * float(rays.units[2]) / radius) if slope > 0 else one(0),
            origin=one(rays.origin),
            epsilon=one(options.epsilon),
            log_q=options.log_q,
        )


def keys_of(z: Texture, origin: float, z_min: float) -> Texture:
    """Bilateral and packing key, (H, W): 0 at ``origin`` to 1 at ``z_min`` from it (0: at the farthest surface)."""
    if z_min == 0:
        z_min = float(np.max(z, initial=-np.inf, where=z < np.inf)) - origin
    number, scale = z.dtype.type, 1 / z_min if z_min > 0 and isfinite(1 / z_min) else 1.0
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        keys = (z - number(origin)) * number(scale)
        return np.where(z < np.inf, np.where(keys > 0, np.minimum(keys, 1), 0), z)  # of NaN 0, as GPUs have it


def reconstruct(visibility: Texture, keys: Texture, gauss: float, sharpness: float, packed: bool) -> Texture:
    """A after the bilateral passes along rows, then columns (2.4), packed before each where asked (``SaoOptions``)."""
    weights = gaussian_weights(gauss, TAPS_RADIUS).astype(visibility.dtype)
    sharp = visibility.dtype.type(sharpness)
    for step in ((STRIDE, 0), (0, STRIDE)):
        if packed:
            stored = np.empty_like(visibility), np.empty_like(keys)
            passes.through_bytes(visibility, keys, *stored)
            visibility, keys = stored
        target = np.empty_like(visibility)
        bilateral(visibility, keys, weights, step, sharp, target)
        visibility = target
    return visibility


def sao(
    buffers: Buffers,
    radius: float,
    points: None,
    weights: None,
    options: AnyOptions,
    change: Callable[[Sao], Sao] | None = None,
) -> Occlusion:
    """Return occlusion by all passes; a camera's positions are not read, and it takes no samples but its own taps.

    change: a function by which the numbers of these are changed.
    """
    z = linear_z(buffers)
    if radius == 0:  # an empty ball holds nothing
        return Occlusion(np.zeros_like(z), 0)
    rays = texel_rays(buffers.view, z.dtype)
    visibility, outside = sample(buffers, z, radius, options, change)
    averaged = np.empty_like(visibility)
    with np.errstate(over="ignore"):
        edge = z.dtype.type(options.quad_edge * radius / float(rays.units[2]))
    average_quads(visibility, z, edge, averaged)
    visibility = averaged
    if options.gauss > 0:
        keys = keys_of(z, rays.origin, options.z_min)
        visibility = reconstruct(visibility, keys, options.gauss, options.sharpness, options.packed)
    occlusion = np.empty_like(z)
    passes.occlusion_of(visibility, z, options.k if isinstance(options, Equation1Options) else 1.0, occlusion)
    return Occlusion(occlusion, outside)


_SAO = Estimator(
    name="sao",
    title="Scalable Ambient Obscurance with its updated falloff",
    source="SAO equations 2 to 10 and appendix",
    formula=(
        "A = max(0, 1 - (5 intensity / taps) sum max(0, 1 - v.v)^3 max(0, v.n - beta) / (v.v + epsilon)), "
        "v = (Q - C) / R; ao = 1 - A after the average and the bilateral passes"
    ),
    run=sao,
    options=AppendixOptions,
    dimensions=0,
    integrand=("cosine", "linear"),
    count=9,
    turns=True,
    rotation="sao-hash",
    texel_bytes=96,  # where a table has the texels' lines; 47 elsewhere
)

ENTRIES = (
    _SAO,
    replace(
        _SAO,
        name="sao-equation-1",
        title="Scalable Ambient Obscurance with the falloff first published",
        source="SAO equations 1 to 10",
        formula=(
            "A = max(0, 1 - (2 sigma / taps) sum max(0, v.n - beta d / R) / (v.v + epsilon)), v = (Q - C) / R, d the "
            "distance of C from the viewer; ao = 1 - A^k after the average and the bilateral passes"
        ),
        options=Equation1Options,
        integrand=("uniform", "linear"),
    ),
)
