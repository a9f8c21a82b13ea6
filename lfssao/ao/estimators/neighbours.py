"""Algorithm 2 on several modules: which are a module's neighbours, their depth textures, and the occlusion by all."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.ssao import Occlusion, run_kernel, scaled_offsets
from lfssao.ao.textures import Texture, check_fit, check_texture
from lfssao.errors import InputError, check_type, shown
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.view import View, WorldToImage, seen_rows

Neighbour = tuple[WorldToImage, NDArray[np.float32]]


def nearest_modules(display: Display, index: int, count: int) -> list[int]:
    """Modules whose lenses are nearest to one's, without itself; of equals the lower first. InputError if too few."""
    others = len(display.modules) - 1
    if not 0 <= count <= others:
        raise InputError(f"neighbours is {count}: {display.name} has {others} modules besides module {index}")
    here = display.modules[index]
    away = [(m.x - here.x) ** 2 + (m.y - here.y) ** 2 + (m.z - here.z) ** 2 for m in display.modules]
    return sorted(set(range(len(away))) - {index}, key=lambda k: (away[k], k))[:count]


class DepthCache:
    """Depth textures of a caster's scene, the last ``size``: modules in turn need twice their neighbours, and one."""

    def __init__(self, caster: RayCaster, size: int) -> None:
        def depth(view: View, how: str) -> NDArray[np.float32]:
            rows = seen_rows(view, caster.bounds)
            return caster.gbuffer(view, None, rows=rows, caster=how, positions=False).depth

        self._depth = lru_cache(size)(depth)

    def neighbours(self, views: tuple[View, ...], caster: str = "exact") -> list[Neighbour]:
        """Mapping and depth texture of each view; ``caster`` as of ``RayCaster.gbuffer``."""
        return [(view.world_to_image, self._depth(view, caster)) for view in views]


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
