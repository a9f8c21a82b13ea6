"""Alchemy AO (McGuire et al. 2011, as SAO equation 1 gives it).

    A(C) = max(0, 1 - 2 sigma / s  sum_i max(0, v_i . n + z_C beta) / (v_i . v_i + epsilon))^k,  v_i = Q_i - C

and occlusion is 1 - A. SAO says 's points distributed on a ball about C' and no more. The readings taken here:

- The taps are points of a disk of radius R around C that faces the viewer, at right angles to the texel's ray. Each is
  mapped into the image, and Q_i is the positions texture's point at the texel it lands in. On a camera that is the disk
  of SAO equation 5, r' = R S' / -z_C texels, up to perspective's slant; on a module, where horizontally and vertically
  another denominator holds, it is an ellipse.
- The disk's points are SAO's spiral (equations 6 and 7). Its radii are uniform, not its area. The registry turns it by
  equation 8 unless another rotation is asked for, as SAO says that this is Alchemy's hash.
- -z_C is the distance from the viewers along the axis of depth (``View.viewer_distance``). A normal of 0 occludes
  nothing.
- sigma and epsilon are given in units of R and R^2: v . n / (v . v) is one over a length, and what looks right in a
  scene in metres should in one in millimetres.
- Taps outside the texture and on background add 0, as does a tap that lands on C itself (0 / 0 for epsilon = 0).

The limit for many taps, texels that shrink and beta = 0, of a surface z = h(x, y) seen from straight above, is the mean
over taps of uniform radius alpha R and uniform angle theta, each at v = (alpha R cos(theta), alpha R sin(theta), rise
of h):

    1 - A = 2 sigma / (2 pi) integral_0^1 integral_0^2pi max(0, v . n) / (v . v + epsilon) dtheta dalpha

as long as it is at most 1 (sigma in units of R, k = 1). It is 0 on a plane, on a convex crease and on top of a sphere,
where nothing rises above the tangent plane.
"""

from dataclasses import dataclass

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, option, turns_of
from lfssao.ao.estimators.kernels import alchemy as kernels
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers
from lfssao.samples import sample_set


@dataclass(frozen=True)
class AlchemyOptions(Options):
    """Options of ``alchemy``."""

    sigma: float = option(1.0, "strength, in radii", limits=(0, 1e6), power=1)
    beta: float = option(
        1e-4, "how steeply a surface must rise to occlude, a fraction of the distance from the viewers", limits=(0, 1)
    )
    epsilon: float = option(0.01, "guards the division, in squared radii", limits=(0, 1e6), power=2)
    k: float = option(1.0, "contrast: the exponent of A", limits=(0, 100))


def alchemy(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: AlchemyOptions
) -> Occlusion:
    """Return 1 - A on points of the positions texture around each texel; points: (s, 2) taps; weights are not read."""
    depth, dtype, view = buffers.depth, buffers.depth.dtype.type, buffers.view
    assert buffers.normals is not None  # the registry has seen to it
    turns = turns_of(buffers)
    textures = depth, buffers.positions, buffers.normals, buffers.directions
    seen = kernels.Seen(*(np.ascontiguousarray(texture).ravel() for texture in textures))
    with np.errstate(over="ignore"):  # a very large epsilon or sigma is infinite
        strength = kernels.Strength(
            radius=dtype(radius),
            beta=dtype(options.beta),
            epsilon=dtype(options.epsilon * float(radius) * float(radius)),
            scale=dtype(2 * options.sigma * float(radius) / len(points)),
            k=options.k,
        )
    taps, projection = np.ascontiguousarray(points, depth.dtype), view.world_to_image.as_type(depth.dtype)
    away = np.ascontiguousarray(view.viewer_distance(), depth.dtype)
    return run_kernel(kernels.alchemy, depth, seen, taps, turns, projection, away, strength)


ENTRIES = (
    Estimator(
        name="alchemy",
        title="obscurance by points of the surface above the tangent plane",
        source="SAO equation 1, after McGuire et al. 2011",
        formula=(
            "ao = 1 - max(0, 1 - (2 sigma R / taps) sum max(0, v.n - beta d) / (v.v + epsilon R^2))^k, v = Q - C, d "
            "the distance of C from the viewer"
        ),
        run=alchemy,
        options=AlchemyOptions,
        samples=lambda n: (sample_set("disk", "spiral", n).points, None),  # with the most even number of turns
        dimensions=2,
        integrand=("uniform", "linear"),
        count=12,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="sao-hash",
    ),
)
