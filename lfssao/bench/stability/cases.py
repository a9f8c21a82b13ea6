"""Stiff and extreme cases by name, each with its difficulty, its inputs and its degradation; and refused inputs."""

from collections.abc import Iterator
from functools import partial
from itertools import chain
from math import inf

import numpy as np

from lfssao.ao import post, ssao
from lfssao.ao.estimators.registry import of_one_view
from lfssao.ao.ssao import Occlusion
from lfssao.bench.stability import scalar_cases
from lfssao.bench.stability.conditions import CONDITIONS, conditions
from lfssao.bench.stability.inputs import mapped
from lfssao.bench.stability.measure import PATHS
from lfssao.bench.stability.occlusions import OCCLUSIONS, SAMPLED, occlusions
from lfssao.bench.stability.table import Case, Inputs, NotExact, Refusal, Stated
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
    texture: str = "float32",
    samples: object = ((0.0, 0.0, 0.5),),
    radius: float = 1.0,
    scale: float = 1.0,
    hole: float = 0.0,
) -> Occlusion:
    numbers = np.array([scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, 2.0, -4.0, 1.0, 1.0])
    depth = np.full((2, 2), hole, texture)
    positions = np.zeros((2, 2, 3), np.float32)
    return ssao.algorithm2(depth, positions, WorldToImage(CROSSED_SLITS, numbers), np.asarray(samples), radius)


def _display(z: float, far: float, k_1: float = 0.0) -> Display:
    """Return a flat display with one module at depth z and a region of interest from -0.1 to a depth."""
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
    Refusal("not finite", "a depth of NaN", lambda: _occlusion(hole=np.nan), "no texture may hold a NaN"),
    Refusal("not finite", "a sample at NaN", lambda: _occlusion(samples=[[0.0, 0.0, np.nan]]), "not finite"),
)


def _degraded(why: str, path: str = "float32") -> Stated:
    """Return a sentence on one path, or on both if that is ''; error analysis bounds how large errors are."""
    return {path: (inf, why)}


_AT_THE_SLIT = "the point's own rounding over its distance from the slit, which it cannot say any finer"
_NEAR_THE_SURFACE = "rounding decides about a sample nearer to the surface than the rounding of its depth"
_AT_THE_FAR_PLANE = "near the far plane a step of the depth texture is a long way in the world"

_DIFFICULTIES: dict[str, tuple[str, Stated]] = {
    "ordinary": ("nothing: what the others are compared with", {}),
    "scene scale": ("numbers far from 1", {}),
    "offset": ("world coordinates far from 0", _degraded("positions are rounded: an ulp at the offset is missed")),
    "aspect": ("a box much wider than high, or higher than wide", {}),
    "near the lens": ("z within 2^-k of m_z", _degraded(_AT_THE_SLIT)),
    "near the observers": ("z within 2^-k of z_o", _degraded(_AT_THE_SLIT)),
    "wide module": ("rays along the screen", {}),
    "curved screen": ("modules at the widest angle, near the lens", _degraded(_AT_THE_SLIT)),
    "conical diffuser": ("near where 1 + kappa is 0", _degraded(_AT_THE_SLIT)),
    "distortion": ("radial, near where it folds", {}),
    "radius": ("R against the scene", _degraded(_NEAR_THE_SURFACE)),
    "turned samples": ("a rounded cosine and sine", _degraded(_NEAR_THE_SURFACE)),
    "texel edges": ("samples exactly between texels", {}),
    "on the surface": ("samples exactly at the surface's depth; -0", {}),
    "grazing": ("a surface nearly along the rays", _degraded(_NEAR_THE_SURFACE)),
    "depth range": ("near and far depths in one texture", _degraded(_NEAR_THE_SURFACE)),
    "stored depth": ("a texture of few bits", _degraded("a surface is known to half a step of its format", "")),
    "subnormals": ("numbers below the normal range, the surface at 0", _degraded("what is below 2^-150 is 0")),
    "background": ("infinite depths", {}),
    "perspective depth": ("depths of a camera whose planes are far apart", _degraded(_AT_THE_FAR_PLANE, "")),
    "orthographic depth": ("depths of a camera whose planes are far apart", _degraded(_NEAR_THE_SURFACE)),
    "at the eye": ("samples near a camera's eye", _degraded(_AT_THE_SLIT, "")),
    "blur": ("sigma", {}),
    "counts": ("more samples than float32 has whole numbers", {}),
    "moments": ("M2 - M1^2 of vo-area", _degraded("it cancels where depths differ by 2^-20 of themselves", "")),
    "slivers": ("triangles a few ulp wide", {}),
}


def _scalars() -> Inputs:
    for sigma in (1e-6, 1e-2, 1.0, 1e1, 1e2, 1024.0):
        yield "blur", f"sigma = {sigma:g}", partial(scalar_cases.blurred, sigma)
    for samples in (2**24 + 1, 2**31 - 1):
        yield "counts", f"counts up to {samples}", partial(scalar_cases.counted, samples)
    for power in (0, -8, -16, -20, -22):
        yield "moments", f"depths from 1 to 1 + 2^{power}", partial(scalar_cases.spread, 2.0**power)
    yield "slivers", "edges within 2 ulp of the ray", scalar_cases.slivers


def _cases() -> Iterator[Case]:
    inputs = list(chain(mapped(), _scalars(), occlusions(), conditions()))
    for name, (stiff, stated) in (_DIFFICULTIES | OCCLUSIONS | CONDITIONS).items():
        paths = PATHS if name in _DIFFICULTIES else tuple(of_one_view())
        yield Case(name, stiff, [(text, run) for case, text, run in inputs if case == name], stated, paths)


def _not_exact() -> Iterator[NotExact]:
    """Passes of ``sao`` that are no formulas; decisions of ``lf`` are those of the cases of a mapping."""
    for name in SAMPLED:
        behind = "behind its sampling pass: the 2x2 average, the bytes and the bilateral passes are kernels"
        yield NotExact("formulas", name, behind)


CASES: tuple[Case | NotExact | Refusal, ...] = (*_cases(), *_not_exact(), *REFUSALS)
