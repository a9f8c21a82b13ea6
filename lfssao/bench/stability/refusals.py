"""Inputs that are refused before the work starts."""

import numpy as np

from lfssao.ao import post, ssao
from lfssao.ao.ssao import Occlusion
from lfssao.bench.stability.table import Refusal
from lfssao.optics.display import Display, Module
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.projection import CROSSED_SLITS
from lfssao.optics.view import WorldToImage
from lfssao.rendering.views import module_views
from lfssao.scene.mesh import Mesh

_MANY = np.broadcast_to(np.zeros((1, 3)), (2**31, 3))
_TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _mesh(vertices: object) -> Mesh:
    return Mesh(np.asarray(vertices, np.float64), np.array([[0, 1, 2]], np.int32))


def _occlusion(
    texture: str = "float32", samples: object = ((0.0, 0.0, 0.5),), radius: float = 1.0, scale: float = 1.0
) -> Occlusion:
    numbers = np.array([scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, 2.0, -4.0, 1.0, 1.0])
    depth, positions = np.zeros((2, 2), texture), np.zeros((2, 2, 3), np.float32)
    return ssao.algorithm2(depth, positions, WorldToImage(CROSSED_SLITS, numbers), np.asarray(samples), radius)


def _display(z: float, far: float, k_1: float = 0.0) -> Display:
    """A flat display with one module at depth z and a region of interest from -0.1 to a depth."""
    lens = Module(0.0, 0.0, z, 8, 8, k1=k_1)
    return Display("bench", 2.0, 1.0, 0.0, -4.0, (lens,), ((-1.0, -1.0, -0.1), (1.0, 1.0, far)))


def _far_views() -> object:
    return module_views(_mesh(_TRIANGLE * 1.4 + 1e8), find_display("virtual"))


REFUSALS = (
    Refusal("scene scale", "a mesh of size 1e31", lambda: _mesh(_TRIANGLE * 1e31), "beyond 1e+30"),
    Refusal("scene scale", "a mesh of size 1e-31", lambda: _mesh(_TRIANGLE * 1e-31), "at least 1e-30"),
    Refusal("scene scale", "a mapping of scale 1e40", lambda: _occlusion(scale=1e40), "leaves the range of float32"),
    Refusal("scene scale", "a mapping of scale 1e-40", lambda: _occlusion(scale=1e-40), "leaves the range of float32"),
    Refusal("radius", "R = infinity", lambda: _occlusion(radius=np.inf), "finite number"),
    Refusal("radius", "R = -0.5", lambda: _occlusion(radius=-0.5), "at least 0"),
    Refusal("samples", "N = 0", lambda: _occlusion(samples=np.zeros((0, 3))), "n at least 1"),
    Refusal("samples", "N = 2^31", lambda: _occlusion(samples=_MANY), "cannot be counted"),
    Refusal("stored depth", "float16", lambda: _occlusion("float16"), "expected an array of float32"),
    Refusal("stored depth", "uint16", lambda: _occlusion("uint16"), "expected an array of float32"),
    Refusal("blur", "sigma = 1025", lambda: post.gaussian_kernel(1025.0), "between 0 and 1024"),
    Refusal("blur", "sigma = -1", lambda: post.gaussian_kernel(-1.0), "between 0 and 1024"),
    Refusal("offset", "a scene of 1.4 at 1e8, 1024 texels across", _far_views, "move it to the origin"),
    Refusal("distortion", "k1 = -2/27 - 2^-30", lambda: _display(2.0, 0.1, -2 / 27 - 2.0**-30), "distortion folds"),
    Refusal("wide module", "a lens on the screen", lambda: _display(0.0, -0.05), "behind the screen"),
    Refusal("near the lens", "a ROI that reaches the lens", lambda: _display(2.0, 2.0), "reaches the lens"),
    Refusal("not finite", "a vertex at infinity", lambda: _mesh([[0, 0, 0], [np.inf, 0, 0], [0, 1, 0]]), "not finite"),
    Refusal("not finite", "R = NaN", lambda: _occlusion(radius=np.nan), "finite number"),
    Refusal("not finite", "a sample at NaN", lambda: _occlusion(samples=[[0.0, 0.0, np.nan]]), "not finite"),
)
