"""Which modules are a module's neighbours, and their depth textures."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import Neighbour
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.view import View, seen_rows


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
