"""What cannot be served, and is refused before the work starts."""

from collections.abc import Callable

import numpy as np

from lfssao import passes
from lfssao.display import Display, Module
from lfssao.display_file import find_display
from lfssao.rendering import module_views
from lfssao.scene.mesh import Mesh
from lfssao.view import View, WorldToImage

_TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _mesh(vertices: object) -> Mesh:
    return Mesh(np.asarray(vertices, np.float64), np.array([[0, 1, 2]], np.int32))


def _occlusion(
    depth: object = None, position: float = 0.0, samples: object = ((0.0, 0.0, 0.5),), radius: float = 1.0,
    scale: float = 1.0,
) -> passes.Occlusion:  # fmt: skip
    texture = np.zeros((2, 2), np.float32) if depth is None else depth
    positions = np.full((2, 2, 3), position, np.float32)
    numbers = np.array([scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, 2.0, -4.0, 1.0, 1.0])
    mapping = WorldToImage(0, numbers)
    return passes.algorithm2(texture, positions, mapping, np.asarray(samples), radius)  # type: ignore[arg-type]


def _many_samples() -> passes.Occlusion:
    return _occlusion(samples=np.broadcast_to(np.zeros((1, 3)), (2**31, 3)))


def _lens_on_the_screen() -> Display:
    roi = ((-1.0, -1.0, -0.1), (1.0, 1.0, -0.05))
    return Display("bench", 2.0, 1.0, 0.0, -4.0, (Module(0.0, 0.0, 0.0, 8, 8),), roi)


def _roi_at_the_lens() -> Display:
    roi = ((-1.0, -1.0, -0.1), (1.0, 1.0, 2.0))
    return Display("bench", 2.0, 1.0, 0.0, -4.0, (Module(0.0, 0.0, 2.0, 8, 8),), roi)


def _folded() -> Display:
    lens = Module(0.0, 0.0, 2.0, 8, 8, k1=-2 / 27 - 2.0**-30)
    roi = ((-1.0, -1.0, -0.1), (1.0, 1.0, 0.1))
    return Display("bench", 2.0, 1.0, 0.0, -4.0, (lens,), roi)


def _far_from_the_origin() -> list[View]:
    return module_views(_mesh(_TRIANGLE * 1.4 + 1e8), find_display("virtual"))


# Name, what is stiff, input, attempt, a part of the sentence.
REFUSALS: tuple[tuple[str, str, str, Callable[[], object], str], ...] = (
    ("scene scale", "numbers far from 1", "a mesh of size 1e31", lambda: _mesh(_TRIANGLE * 1e31), "beyond 1e+30"),
    ("scene scale", "numbers far from 1", "a mesh of size 1e-31", lambda: _mesh(_TRIANGLE * 1e-31), "at least 1e-30"),
    (
        "scene scale", "numbers far from 1", "a mapping of scale 1e40",
        lambda: _occlusion(scale=1e40), "leaves the range of float32",
    ),
    (
        "scene scale", "numbers far from 1", "a mapping of scale 1e-40",
        lambda: _occlusion(scale=1e-40), "leaves the range of float32",
    ),
    ("radius", "R beside the scene", "R = infinity", lambda: _occlusion(radius=np.inf), "finite number"),
    ("radius", "R beside the scene", "R = -0.5", lambda: _occlusion(radius=-0.5), "at least 0"),
    ("samples", "none, or too many to count", "N = 0", lambda: _occlusion(samples=np.zeros((0, 3))), "n at least 1"),
    ("samples", "none, or too many to count", "N = 2^31", _many_samples, "cannot be counted"),
    (
        "stored depth", "a depth texture of few bits", "float16",
        lambda: _occlusion(np.zeros((2, 2), np.float16)), "expected an array of float32",
    ),
    (
        "stored depth", "a depth texture of few bits", "uint16",
        lambda: _occlusion(np.zeros((2, 2), np.uint16)), "expected an array of float32",
    ),
    ("blur", "sigma", "sigma = 1e7", lambda: passes.gaussian_kernel(1e7), "between 0 and 1e+06"),
    ("blur", "sigma", "sigma = -1", lambda: passes.gaussian_kernel(-1.0), "between 0 and 1e+06"),
    (
        "offset", "world coordinates far from 0", "a scene of 1.4 at 1e8, 1024 texels across", _far_from_the_origin,
        "move it to the origin",
    ),
    ("distortion", "radial, near where it folds", "k1 = -2/27 - 2^-30", _folded, "folds inside the texture"),
    ("wide module", "rays along the screen", "a lens on the screen", _lens_on_the_screen, "behind the screen"),
    ("near the lens", "z within 2^-k of m_z", "a ROI that reaches the lens", _roi_at_the_lens, "reaches the lens"),
    (
        "infinity", "coordinates that are no numbers", "a vertex at infinity",
        lambda: _mesh([[0, 0, 0], [np.inf, 0, 0], [0, 1, 0]]), "not finite",
    ),
)  # fmt: skip
