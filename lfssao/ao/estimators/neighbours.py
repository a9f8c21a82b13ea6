"""Algorithm 2 where a sample is occluded only if it lies behind the surface in every module's texture it falls into.

Not in LF. A module's texture is a surface without a back, so a sample behind it may lie in the open, and another
module may see it there. Modules agree better that way (benchmarks/README.md, "From module to module"). Without other
modules occlusion is that of Algorithm 2, bit for bit. More of them never add occlusion to a sample that falls into the
module's own texture.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Options
from lfssao.ao.estimators.kernels.neighbours import Views, hidden_fraction
from lfssao.ao.estimators.lf import LF
from lfssao.ao.ssao import Occlusion, run_kernel, scaled_offsets
from lfssao.ao.textures import Buffers, Neighbour, Texture, check_fit, check_neighbours, check_texture
from lfssao.errors import InputError, check_type
from lfssao.optics.view import WorldToImage


def algorithm2_with_neighbours(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    neighbours: Sequence[Neighbour],
    samples: Texture,
    radius: float,
) -> Occlusion:
    """Algorithm 2 on the textures of several modules: a sample is occluded if it is behind the surface in each.

    neighbours: mapping and depth texture, (H_k, W_k) of depth's dtype, of each other module; all else as for
    ``algorithm2``. Raises InputError as that, and if a neighbour is none or all have 2^31 texels.
    """
    check_type("world_to_image", world_to_image, WorldToImage)
    check_texture("depth", depth, 2)
    check_fit("positions", positions, depth, 3)
    check_neighbours(neighbours, depth)
    views = [(world_to_image, depth), *neighbours]
    numbers = np.zeros((len(views), 44), depth.dtype)  # as many as kind DISPLAY has
    for row, (mapping, _) in zip(numbers, views, strict=True):
        row[: len(mapping.numbers)] = mapping.as_type(depth.dtype).numbers
    sizes = np.array([(other.shape[1], other.shape[0]) for _, other in views], np.int64)
    texels = sizes[:, 0] * sizes[:, 1]
    ends = np.cumsum(texels)
    if ends[-1] >= 2**31:  # the kernel's numbers of texels are of 32 bits
        raise InputError(f"depth textures of {len(views)} modules have {ends[-1]} texels, 2^31 or more in all")
    depths = np.concatenate([other.ravel() for _, other in views])
    kinds = np.array([mapping.kind for mapping, _ in views], np.int64)
    given = np.ascontiguousarray(depth), np.ascontiguousarray(positions), scaled_offsets(samples, radius, depth.dtype)
    return run_kernel(hidden_fraction, depth, *given, Views(kinds, numbers, sizes, ends - texels, depths))


def _run(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: Options
) -> Occlusion:
    """Return occlusion at R; points, (n, 3), are offsets in the unit ball, which all weigh 1 / n."""
    depth, mapping = buffers.view.image_z(buffers.depth), buffers.view.world_to_image
    return algorithm2_with_neighbours(depth, buffers.positions, mapping, buffers.neighbours, points, radius)


ENTRIES = (
    replace(
        LF,
        name="lf-neighbours",
        title="share of samples in the ball that no module sees in the open",
        source="LF Algorithm 2, on the depth textures of several modules",
        formula="ao = (number of samples with surDepth < smp.z in all textures they fall into, one or more) / (number)",
        run=_run,
        run_radii=None,
        neighbours=True,
        turns=False,
        rotation="none",
        texel_bytes=8,
    ),
)
