"""Ray-cast occlusion at the points that views share: the differences between views with correct values.

The occlusion is the same for all views, but each reads it at its nearest texels. Weights and falloff of the rays are
those that the reference's estimator approximates, at its radius. An estimator of the whole ball gives 1/2 on a flat
surface, so its truth is 1/2 + rays / 2.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np

from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError
from lfssao.optics.view import without_guard
from lfssao.rendering.points import Places, Texture, Values
from lfssao.verify.agree.measure import Shared, mean_over_pairs
from lfssao.verify.agree.views import RenderedView, occlusion_case
from lfssao.verify.compare.surface import Surface

# Standard error of a value; that of a difference is 0.0042. The margin to 0.005 is for texels whose rays agree by
# chance: the error against a crease's exact occlusion is 1.05 to 1.2 times the estimated one.
NOISE = 0.003


class Truth:
    """Ray-cast occlusion of the views of one scene; InputError without a mesh, or if the layer has several radii."""

    def __init__(self, rendered: RenderedView, mesh: str | None) -> None:
        folder = rendered.folder
        case, radius = occlusion_case(rendered)
        if radius is None:
            raise InputError(f"--truth: rays are of one radius, ao_1 or another, not of {folder.layer}")
        self._estimator = find_estimator(case.parameters["estimator"])
        self._radius = radius
        self._surface = Surface(folder.path, folder.manifest, mesh)
        if self._surface.mesh is None:
            raise InputError(f"--truth: the scene of {folder.path} is no embedded one: give its file by --mesh")
        self._occluders = Occluders(self._surface.mesh)

    def cast(self, rendered: RenderedView, places: Places) -> tuple[Texture, Texture]:
        """The truth at the texels of the points in a view, and its standard error, (H, W); 0 elsewhere."""
        view = rendered.view
        caster = self._surface.caster(rendered.entry)
        assert caster is not None
        gbuffer = caster.gbuffer(view, color=None, normals="geometric")
        wanted = np.zeros(rendered.arrays[rendered.folder.layer].shape, np.bool_)
        wanted.reshape(-1)[places[places >= 0]] = True
        depth = np.where(np.pad(wanted, view.guard), gbuffer.depth, np.float32(np.inf))
        buffers = Buffers.of(replace(gbuffer, depth=depth), view)
        scale = 2.0 if self._estimator.whole_ball else 1.0
        accuracy: dict[str, Any] = {"tolerance": scale * NOISE, "rounds": (16, 1024)}
        rays = ray_cast_occlusion(self._occluders, buffers, self._radius, *self._estimator.integrand, **accuracy)
        offset = 0.5 if self._estimator.whole_ball else 0.0
        return without_guard(offset + rays.texture / scale, view.guard), without_guard(rays.error / scale, view.guard)


def noise(shared: Shared, errors: Sequence[Texture]) -> float:
    """Root mean square standard error of the pairs' differences, from the standard errors of all values."""
    read: Values = shared.read(errors, "rays")
    return sqrt(mean_over_pairs(read, lambda a, b: a * a + b * b))
