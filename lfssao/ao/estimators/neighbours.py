"""Algorithm 2 on the depth textures of several modules."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.ssao import Occlusion, run_kernel, scaled_offsets
from lfssao.ao.textures import Texture, check_fit, check_texture
from lfssao.errors import InputError, check_type, shown
from lfssao.optics.view import WorldToImage

Neighbour = tuple[WorldToImage, NDArray[np.float32]]


def algorithm2_with_neighbours(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    neighbours: Sequence[tuple[WorldToImage, Texture]],
    samples: Texture,
    radius: float,
) -> Occlusion:
    """Algorithm 2 on the textures of several modules: a sample is occluded if it is behind the surface in each.

    Not in LF. A neighbour may see in the open a sample that the module's own texture hides; with no neighbours the
    result is that of ``algorithm2``, bit for bit. More neighbours never add occlusion to a sample that falls into the
    module's own texture.

    neighbours: mapping and depth texture, (H_k, W_k) of depth's dtype, of each other module; all else as for
    ``algorithm2``. Raises InputError as that, and if a neighbour is none or all have 2^31 texels.
    """
    from lfssao.ao.estimators.kernels.neighbours import Views, hidden_fraction  # late: the default does not need it

    check_type("world_to_image", world_to_image, WorldToImage)
    check_texture("depth", depth, 2)
    check_fit("positions", positions, depth, 3)
    for number, neighbour in enumerate(neighbours):
        if not isinstance(neighbour, tuple | list) or len(neighbour) != 2:
            raise InputError(f"neighbour {number} is {shown(neighbour)}, it must be a mapping and a depth texture")
        check_type(f"mapping of neighbour {number}", neighbour[0], WorldToImage)
        check_texture(f"depth of neighbour {number}", neighbour[1], 2)
        if neighbour[1].dtype != depth.dtype:
            raise InputError(f"depth of neighbour {number} is of {neighbour[1].dtype}, expected {depth.dtype}")
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
