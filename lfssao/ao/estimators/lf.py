"""LF's Algorithms 1 and 2: the fraction of samples of the ball around each visible point behind the visible surface.

``point`` has their limits.
"""

from collections.abc import Sequence

from lfssao.ao import ssao
from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples


def lf_radii(
    buffers: Buffers, radii: Sequence[float], points: FloatArray, weights: FloatArray | None, options: Options
) -> list[Occlusion]:
    """Return LF's occlusion of each radius, by Algorithm 1 where the mapping has an inverse, else by Algorithm 2.

    points: (n, 3), offsets in the unit ball, which all weigh 1 / n; weights are not read.
    """
    view, depth = buffers.view, buffers.view.image_z(buffers.depth)
    positions = buffers.positions if view.screen_to_world is None else ssao.unprojected(depth, view.screen_to_world)
    return ssao.algorithm2_of_radii(depth, positions, view.world_to_image, points, radii, buffers.turns)


LF = Estimator(
    name="lf",
    title="share of samples in the ball behind the surface",
    source="LF Algorithms 1 and 2",
    formula="ao = (number of samples with surDepth < smp.z) / (number of samples)",
    run=lambda buffers, radius, points, weights, options: lf_radii(buffers, (radius,), points, weights, options)[0],
    run_radii=lf_radii,
    samples=lambda n: (make_samples("latin", n), None),
    sampling="latin",
    integrand=("uniform", "shell"),
    whole_ball=True,
    turns=True,
    texel_bytes=16,
    rotation="hash",  # LF section 4 spawns random samples at each pixel
)

ENTRIES = (LF,)
