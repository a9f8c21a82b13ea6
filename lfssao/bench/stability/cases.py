"""Stiff and extreme cases by name, each with its difficulty, its inputs and its degradation."""

from collections.abc import Iterator
from functools import partial
from itertools import chain
from math import inf

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.bench.stability import scalar_cases
from lfssao.bench.stability.conditions import CONDITIONS, conditions
from lfssao.bench.stability.inputs import mapped
from lfssao.bench.stability.measure import PATHS
from lfssao.bench.stability.refusals import REFUSALS
from lfssao.bench.stability.table import Case, Inputs, Refusal, Stated


def _degraded(why: str, path: str = "float32") -> Stated:
    """A sentence on one path, or on both if that is ''; error analysis bounds how large errors are."""
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
    """All cases with the inputs of their names."""
    inputs = list(chain(mapped(), _scalars(), conditions()))
    for name, (stiff, stated) in (_DIFFICULTIES | CONDITIONS).items():
        paths = tuple(ESTIMATORS) if name in CONDITIONS else PATHS
        yield Case(name, stiff, [(text, run) for case, text, run in inputs if case == name], stated, paths)


CASES: tuple[Case | Refusal, ...] = (*_cases(), *REFUSALS)
