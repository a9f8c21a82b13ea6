"""One scene of a work-precision run: a view of a mesh, its textures and its ray-cast occlusion."""

from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.ao.textures import Buffers, Texture
from lfssao.bench.work_precision.settings import Grid, Inputs
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display_file import find_display
from lfssao.rendering.settings import diagonal
from lfssao.rendering.views import module_views
from lfssao.scene.mesh import Mesh

Integrand = tuple[str, str]  # weighting and falloff of ray-cast occlusion
VISIBILITY: Integrand = ("cosine", "constant")  # the truth that all estimators are held against


class BenchScene:
    """A display's middle view of a mesh, its textures and ray-cast occlusion; radii are fractions of the diagonal."""

    def __init__(self, mesh: Mesh, grid: Grid, threads: int, display: str = "virtual") -> None:
        self.mesh = mesh
        self.grid = grid
        self.unit = diagonal(mesh)
        self.occluders = Occluders(mesh)
        views = module_views(mesh, find_display(display).with_resolution(grid.width, grid.height))
        view = views[len(views) // 2]
        gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric")
        self.buffers = Buffers.of(gbuffer, view)
        self.surface: NDArray[np.bool_] = np.isfinite(self.buffers.depth)
        self._cast = cache(partial(ray_cast_occlusion, self.occluders, self.buffers, tolerance=0.01, rounds=(8, 64)))
        self.turned = cache(self.buffers.turned)  # by rotation and seed

    def truth(self, radii: tuple[float, ...], integrand: Integrand) -> tuple[Texture, Texture]:
        """Ray-cast occlusion and its standard error, (H, W), merged over the radii as textures are."""
        cast = [self._cast(radius * self.unit, *integrand) for radius in radii]
        each = np.array([(truth.texture, truth.error) for truth in cast])
        texture, error = np.take_along_axis(each, each[:, :1].argmax(axis=0, keepdims=True), axis=0)[0]
        return texture, error

    def occlusion(self, estimator: Estimator, radius: float, inputs: Inputs, seed: int = 0) -> Texture:
        """Occlusion by an estimator whose samples turn as they do by default, by a seed."""
        (points, weights), parameters = inputs
        buffers = self.turned(estimator.rotation, seed) if estimator.turns else self.buffers
        return estimate(estimator.name, buffers, radius * self.unit, points, weights, **parameters).texture
