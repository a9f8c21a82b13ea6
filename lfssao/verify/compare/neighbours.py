"""Depth textures of the neighbours of the reference's modules: the other renderer's own, as for other stages.

If the renderer has no usable depth of a neighbour, the reference's replaces it. The depth of a module that was not
rendered is cast from the mesh.
"""

from contextlib import suppress
from dataclasses import replace
from functools import lru_cache

import numpy as np

from lfssao.errors import InputError, LfssaoError
from lfssao.gbuffer.caster import DepthCache
from lfssao.optics.view import View
from lfssao.verify.case import Array, Case, depth_of, described_view
from lfssao.verify.compare.background import background_values, with_infinity
from lfssao.verify.compare.layers import Layer, Matcher, Storage
from lfssao.verify.compare.source import Mine, Reference
from lfssao.verify.compare.surface import Surface

_CACHED = 17  # depth textures in memory: modules in turn need twice the number of their neighbours, and one


class Neighbours:
    """Depth textures of the neighbours of a comparison's modules; ``background`` is the argument of ``compare``."""

    def __init__(
        self, reference: Reference, mine: Mine, storage: Storage, surface: Surface | None, background: float | None
    ) -> None:
        self._reference = reference
        self._mine = mine
        self._storage = storage
        self._surface = surface
        self._background = background
        self._depth = lru_cache(_CACHED)(self._find_depth_texture)
        self._views: dict[str, View] = {}  # of modules that were asked, by name
        self._rendered: set[str] = set()  # modules whose depth is the other renderer's

    def with_depths(self, case: Case) -> Case:
        """The case with the depth of each neighbour among its inputs, if it is available."""
        depths: dict[str, Array] = {}
        for neighbour in case.parameters.get("neighbours") or ():
            self._views[neighbour["name"]] = described_view(neighbour)
            depth = self._depth(neighbour["name"])
            if depth is not None:
                depths[depth_of(neighbour["name"])] = depth
        return replace(case, inputs={**case.inputs, **depths})

    def note(self, module: str, case: Case) -> str:
        """A sentence on depth that is not the other renderer's own, or not available; '' if all is its own."""
        neighbours = case.parameters.get("neighbours", ())
        if neighbours is None:
            return f"{module}: no interval of occlusion is known, as the manifest does not say which modules it asks"
        inputs = self.with_depths(case).inputs
        missing = [neighbour["name"] for neighbour in neighbours if depth_of(neighbour["name"]) not in inputs]
        if missing:
            names = ", ".join(missing)
            return f"{module}: no interval of occlusion is known: it asks {names}, whose depth --mesh FILE would give"
        others = ", ".join(neighbour["name"] for neighbour in neighbours if neighbour["name"] not in self._rendered)
        return others and f"{module}: it asks {others}, whose depth is the reference's: the renderer's own is missing"

    def _find_depth_texture(self, module: str) -> Array | None:
        """The depth of a module: the other renderer's, else the reference's, else cast; None if none is available."""
        if module not in self._reference.files:
            return self._cast(module)
        with suppress(InputError):  # a file that cannot be read is named where it is compared
            layers, _ = self._reference.read(module, self._reference.described(module))
            for expected in layers:
                if expected.name == "depth":
                    rendered = self._rendered_depth(module, expected, layers)
                    if rendered is not None:
                        self._rendered.add(module)
                    return expected.texture if rendered is None else rendered
        return self._cast(module)

    def _rendered_depth(self, module: str, expected: Layer, layers: list[Layer]) -> Array | None:
        """The other renderer's depth of a module with the reference's background; None if it is not usable."""
        with suppress(InputError):
            parts = self._mine.parts(module, {expected.planes[0].shape[::-1]})
            layer = Matcher(parts, layers, self._storage.rules).matched(expected, self._storage)
            if layer is None or np.isnan(layer.texture).any():
                return None
            depth = layer.texture
            accepted = self._background
            values = background_values("depth", depth, expected.texture) if accepted is None else [accepted]
            return with_infinity(depth, values)[0] if values else depth
        return None

    def _cast(self, module: str) -> Array | None:
        """The depth of a neighbour, cast from the mesh; None if there is no mesh or the cast fails."""
        entry = next(iter(self._reference.entries.values()))
        caster = None if self._surface is None else self._surface.caster(entry)
        if caster is None:
            return None
        kind = (self._reference.manifest or {})["settings"].get("caster", "exact")
        with suppress(LfssaoError):
            ((_, depth),) = DepthCache(caster, 1).neighbours((self._views[module],), kind)
            return depth
        return None
