"""Which modules, or lenses, are the neighbours of one, and their depth textures."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import Neighbour
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.lenslet import LensletDisplay
from lfssao.optics.view import View, seen_rows

_MOST_KEPT = 2**24  # texels


def nearest_modules(display: Display | LensletDisplay, index: int, count: int) -> list[int]:
    """Modules whose lenses are nearest to one's, without itself; of equals the lower first. InputError if too few.

    The lenses of a lenslet display are its modules.
    """
    if isinstance(display, LensletDisplay):
        lenses, (one, several) = display.lenses, display.WORDS
    else:
        lenses, (one, several) = [(m.x, m.y, m.z) for m in display.modules], ("module", "modules")
    others = len(lenses) - 1
    if not 0 <= count <= others:
        raise InputError(f"neighbours is {count}: {display.name} has {others} {several} besides {one} {index}")
    x, y, z = lenses[index]
    away = [(a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2 for a, b, c in lenses]
    return sorted(set(range(len(away))) - {index}, key=lambda k: (away[k], k))[:count]


def textures_kept(asked: Sequence[Sequence[View]]) -> int:
    """How many depth textures to keep for views that in turn ask these: all if they are small, as those of lenses are.

    Else twice as many as one of them asks, and one: modules in a row need no more.
    """
    texels = {view.name: view.width * view.height for views in asked for view in views}
    return len(texels) if sum(texels.values()) <= _MOST_KEPT else 2 * max(map(len, asked)) + 1


class DepthCache:
    """Depth textures of a caster's scene, the last ``size``."""

    def __init__(self, caster: RayCaster, size: int) -> None:
        def depth(view: View, how: str) -> NDArray[np.float32]:
            rows = seen_rows(view, caster.bounds)
            return caster.of_view(view).gbuffer(view, None, rows=rows, caster=how, positions=False).depth

        self._depth = lru_cache(size)(depth)

    def neighbours(self, views: tuple[View, ...], caster: str = "exact") -> list[Neighbour]:
        """Mapping and depth texture of each view; ``caster`` as of ``RayCaster.gbuffer``."""
        return [(view.world_to_image, self._depth(view, caster)) for view in views]
