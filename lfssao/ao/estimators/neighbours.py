"""The neighbours of a module: which they are, and their depth textures, each cast once as long as it is needed."""

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.view import View, WorldToImage
from lfssao.optics.window import seen_rows

Neighbour = tuple[WorldToImage, NDArray[np.float32]]


def nearest_modules(display: Display, index: int, count: int) -> list[int]:
    """The modules whose lenses are nearest to one module's, without itself; of equally near ones the lower first.

    Raises
    ------
    InputError
        If the display does not have so many others.
    """
    if not 0 <= count < len(display.modules):
        raise InputError(
            f"neighbours is {count}: {display.name} has {len(display.modules) - 1} modules besides module {index}"
        )
    here = display.modules[index]
    away = {
        k: (m.x - here.x) ** 2 + (m.y - here.y) ** 2 + (m.z - here.z) ** 2
        for k, m in enumerate(display.modules)
        if k != index
    }
    return sorted(away, key=lambda k: (away[k], k))[:count]


class DepthCache:
    """Depth textures of views, the ones that were asked for last.

    Parameters
    ----------
    caster : RayCaster
        The scene, in the views' cast space.
    size : int
        How many to keep: twice the neighbours of a module and one, where modules come one after the other.
    """

    def __init__(self, caster: RayCaster, size: int) -> None:
        self._caster = caster
        self._size = size
        self._kept: OrderedDict[str, NDArray[np.float32]] = OrderedDict()

    def neighbours(self, views: tuple[View, ...], caster: str = "exact") -> list[Neighbour]:
        """Mapping and depth texture of each view; ``caster`` as of ``RayCaster.gbuffer``."""
        return [(view.world_to_image, self._depth(view, caster)) for view in views]

    def _depth(self, view: View, caster: str) -> NDArray[np.float32]:
        if view.name not in self._kept:
            rows = seen_rows(view, self._caster.bounds)
            seen = self._caster.gbuffer(view, None, rows=rows, caster=caster, positions=False)
            self._kept[view.name] = seen.depth
        self._kept.move_to_end(view.name)
        while len(self._kept) > self._size:
            self._kept.popitem(last=False)
        return self._kept[view.name]
