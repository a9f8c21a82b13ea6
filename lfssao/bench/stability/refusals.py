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

_TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _mesh(vertices: object) -> Mesh:
    return Mesh(np.asarray(vertices, np.float64), np.array([[0, 1, 2]], np.int32))


def _occlusion(
    texture: str = "float32", samples: object = ((0.0, 0.0, 0.5),), radius: float = 1.0, scale: float = 1.0
) -> Occlusion:
    numbers = np.array([scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, 2.0, -4.0, 1.0, 1.0])
    depth, positions = np.zeros((2, 2), texture), np.zeros((2, 2, 3), np.float32)
    return ssao.algorithm2(depth, positions, WorldToImage(CROSSED_SLITS, numbers), np.asarray(samples), radius)


def _display(lens: Module, near: float, far: float) -> Display:
    """A flat display with one module and a region of interest between two depths."""
    return Display("bench", 2.0, 1.0, 0.0, -4.0, (lens,), ((-1.0, -1.0, near), (1.0, 1.0, far)))


_SCALE = "scene scale", "numbers far from 1"
_RADIUS = "radius", "R against the scene"
_SAMPLES = "samples", "none, or too many to count"
_STORED = "stored depth", "a depth texture of few bits"

REFUSALS = (
    Refusal(*_SCALE, "a mesh of size 1e31", lambda: _mesh(_TRIANGLE * 1e31), "beyond 1e+30"),
    Refusal(*_SCALE, "a mesh of size 1e-31", lambda: _mesh(_TRIANGLE * 1e-31), "at least 1e-30"),
    Refusal(*_SCALE, "a mapping of scale 1e40", lambda: _occlusion(scale=1e40), "leaves the range of float32"),
    Refusal(*_SCALE, "a mapping of scale 1e-40", lambda: _occlusion(scale=1e-40), "leaves the range of float32"),
    Refusal(*_RADIUS, "R = infinity", lambda: _occlusion(radius=np.inf), "finite number"),
    Refusal(*_RADIUS, "R = -0.5", lambda: _occlusion(radius=-0.5), "at least 0"),
    Refusal(*_SAMPLES, "N = 0", lambda: _occlusion(samples=np.zeros((0, 3))), "n at least 1"),
    Refusal(
        *_SAMPLES, "N = 2^31", lambda: _occlusion(samples=np.broadcast_to(np.zeros((1, 3)), (2**31, 3))),
        "cannot be counted",
    ),
    Refusal(*_STORED, "float16", lambda: _occlusion("float16"), "expected an array of float32"),
    Refusal(*_STORED, "uint16", lambda: _occlusion("uint16"), "expected an array of float32"),
    Refusal("blur", "sigma", "sigma = 1025", lambda: post.gaussian_kernel(1025.0), "between 0 and 1024"),
    Refusal("blur", "sigma", "sigma = -1", lambda: post.gaussian_kernel(-1.0), "between 0 and 1024"),
    Refusal(
        "offset", "world coordinates far from 0", "a scene of 1.4 at 1e8, 1024 texels across",
        lambda: module_views(_mesh(_TRIANGLE * 1.4 + 1e8), find_display("virtual")), "move it to the origin",
    ),
    Refusal(
        "distortion", "radial, near where it folds", "k1 = -2/27 - 2^-30",
        lambda: _display(Module(0.0, 0.0, 2.0, 8, 8, k1=-2 / 27 - 2.0**-30), -0.1, 0.1), "folds inside the texture",
    ),
    Refusal(
        "wide module", "rays along the screen", "a lens on the screen",
        lambda: _display(Module(0.0, 0.0, 0.0, 8, 8), -0.1, -0.05), "behind the screen",
    ),
    Refusal(
        "near the lens", "z within 2^-k of m_z", "a ROI that reaches the lens",
        lambda: _display(Module(0.0, 0.0, 2.0, 8, 8), -0.1, 2.0), "reaches the lens",
    ),
    Refusal(
        "infinity", "coordinates that are no numbers", "a vertex at infinity",
        lambda: _mesh([[0, 0, 0], [np.inf, 0, 0], [0, 1, 0]]), "not finite",
    ),
)  # fmt: skip
