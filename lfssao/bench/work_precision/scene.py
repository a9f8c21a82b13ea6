"""The scene of a work-precision run: one view of a mesh, its textures and its ray-cast occlusion."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.ground_truth import GroundTruth, Occluders, ray_cast_occlusion
from lfssao.ao.textures import Buffers, Texture
from lfssao.bench.work_precision.references import rmse
from lfssao.bench.work_precision.settings import Grid
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display_file import find_display
from lfssao.rendering.settings import diagonal
from lfssao.rendering.views import module_views
from lfssao.scene.mesh import Mesh
from lfssao.viz.truth import half_space

# Estimators of the whole ball's occlusion, of which a plane hides half. Their model error is that of the half space.
WHOLE_BALL = ("lf", "point", "vo-points", "vo-lines", "vo-area")

# Falloff of ray-cast occlusion that is nearest to the estimator's own; the others' is constant.
_FALLOFFS = dict.fromkeys(("multiresolution", "hbao", "sao", "sao-equation-1", "alchemy"), "quadratic")

# The rotation of estimators whose taps are a spiral, few a texel: their papers have no other. All others' sets are
# measured as they are, and turned by ``rotations``.
SPIRAL = "sao-hash"

# Points and weights, None where the estimator makes its own; and its parameters.
Inputs = tuple[tuple[FloatArray | None, FloatArray | None], dict[str, Value]]


class BenchScene:
    """A display's middle view of a mesh, its textures in each arithmetic and its ray-cast occlusion."""

    def __init__(self, mesh: Mesh, grid: Grid, threads: int, display: str = "virtual") -> None:
        self.mesh = mesh
        self.unit = diagonal(mesh)
        views = module_views(mesh, find_display(display).with_resolution(grid.width, grid.height))
        view = views[len(views) // 2]
        gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric")
        single = Buffers.of(gbuffer, view)
        assert single.normals is not None
        textures = (single.depth, single.positions, single.normals)
        self.buffers = {
            name: Buffers(view, *(texture.astype(name) for texture in textures)) for name in ("float32", "float64")
        }
        self.surface: NDArray[np.bool_] = np.isfinite(single.depth)
        self._truth: dict[tuple[float, str], GroundTruth] = {}

    @cached_property
    def occluders(self) -> Occluders:
        """The mesh for rays."""
        return Occluders(self.mesh)

    @cached_property
    def _turned(self) -> dict[str, Buffers]:
        """The textures with the turns of SAO's spiral, in each arithmetic."""
        return {dtype: buffers.turned(SPIRAL) for dtype, buffers in self.buffers.items()}

    def truth(self, radius: float, falloff: str) -> GroundTruth:
        """Ray-cast occlusion; the radius is a fraction of the scene's diagonal, here and below."""
        if (radius, falloff) not in self._truth:
            self._truth[radius, falloff] = ray_cast_occlusion(
                self.occluders, self.buffers["float32"], radius * self.unit, falloff=falloff, tolerance=0.01
            )
        return self._truth[radius, falloff]

    def truth_error(self) -> float:
        """The largest RMS standard error of all ray-cast occlusion up to now."""
        errors = [rmse(self.of_surface(truth.error), np.zeros(1)) for truth in self._truth.values()]
        return max(errors, default=0.0)

    def of_surface(self, texture: Texture) -> FloatArray:
        """A texture's numbers at the texels that see a surface, float64."""
        return np.asarray(texture[self.surface], np.float64)

    def occlusion(self, estimator: Estimator, dtype: str, radius: float, inputs: Inputs) -> Texture:
        """Occlusion by an estimator."""
        (points, weights), parameters = inputs
        buffers = (self._turned if estimator.rotation == SPIRAL else self.buffers)[dtype]
        return estimate(estimator.name, buffers, radius * self.unit, points, weights, **parameters).texture

    def model_error(self, estimator: Estimator, radii: tuple[float, ...], texture: Texture) -> float:
        """RMSE against ray-cast occlusion, merged over the radii as the textures are."""
        falloff = _FALLOFFS.get(estimator.name, "constant")
        truth = np.maximum.reduce([self.truth(radius, falloff).texture for radius in radii])
        ours = half_space(texture) if estimator.name in WHOLE_BALL else texture
        return rmse(self.of_surface(ours), self.of_surface(truth))
