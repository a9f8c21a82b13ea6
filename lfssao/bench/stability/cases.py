"""Stiff and extreme cases by name, each with its difficulty, its inputs and its degradation."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from lfssao.bench.stability import scalar_cases
from lfssao.bench.stability.exact import CameraAtOrigin
from lfssao.bench.stability.inputs import (
    SIZE,
    STEPS,
    UNCHANGED,
    Inputs,
    along_rays,
    close_to,
    deep,
    display,
    lattice,
    made,
    near,
    on_surface,
    scene,
    seen_by,
    stored_as,
)
from lfssao.bench.stability.refusals import REFUSALS
from lfssao.bench.stability.table import Case, Refusal
from lfssao.core.elementary import sincospi
from lfssao.optics.display import fit_roi
from lfssao.optics.display_file import find_display

AT_THE_SLIT = "the point's own rounding over its distance from the slit, which it cannot say any finer"
NEAR_THE_SURFACE = "far away a sample is nearer to the surface than the rounding of its depth"

_BOX = lattice() * [0.7, 0.4, 0.25]  # points on both sides of the screen
_MEASURED: list[Case] = []


def _case(
    name: str, stiff: str, float32: str = "", both: str = ""
) -> Callable[[Callable[[], Inputs]], Callable[[], Inputs]]:
    """Make a case of a function of inputs: name, difficulty, and the degradation in float32 or on both paths."""
    degraded = {"float32": both, "float64": both} if both else {"float32": float32} if float32 else {}

    def add(inputs: Callable[[], Inputs]) -> Callable[[], Inputs]:
        _MEASURED.append(Case(name, stiff, inputs, degraded))
        return inputs

    return add


@_case("ordinary", "nothing: what the others are compared with")
def _ordinary() -> Inputs:
    yield "a box of 1.4 x 0.8 x 0.5 m on the screen", made(scene, _BOX)


@_case("scene scale", "numbers far from 1")
def _far_scale() -> Inputs:
    for power in (-30, -12, 12, 30):
        size = 10.0**power
        world = UNCHANGED / size
        yield f"a scene of size 1e{power}", made(scene, _BOX * size, physical_from_world=world)


@_case(
    "offset",
    "world coordinates far from 0",
    float32="positions are rounded to float32: its ulp at the offset is what they miss",
)
def _offset() -> Inputs:
    for power in (2, 4, 6, 8):
        world = UNCHANGED.copy()
        world[0, 3] = -(10.0**power)
        yield f"x from 1e{power} - 0.7 to 1e{power} + 0.7", made(scene, _BOX - world[:, 3], physical_from_world=world)


@_case("aspect", "a box much wider than high, or higher than wide")
def _aspect() -> Inputs:
    for power in (-6, -3, 3, 6):
        size = np.array([0.7, 0.7 * 10.0**power, 0.25]) if power < 0 else np.array([0.4 * 10.0**-power, 0.4, 0.25])
        roi = ((-size[0], -size[1], -size[2]), (size[0], size[1], size[2]))
        world = fit_roi(np.array([-7 * size, 7 * size]), roi)
        shown_by = replace(display(), roi=roi)
        yield f"a ROI of width / height 1e{-power}", made(scene, lattice() * size * 7, shown_by, world)
        stretched = UNCHANGED.copy()
        stretched[1] /= 10.0**power
        points = lattice() * [0.7, 0.4 * 10.0**power, 0.25]
        yield f"a world stretched by 1e{power} in height", made(scene, points, physical_from_world=stretched)


@_case("near the lens", "z within 2^-k of m_z", float32=AT_THE_SLIT)
def _near_lens() -> Inputs:
    for k in range(1, STEPS + 1):
        yield f"z = m_z (1 - t 2^-{k})", made(near, "lens", k)
    for k in (10, 20, 30):
        points = close_to(2.0, k, 0) + np.array([0.625, 0.0, 0.0])
        yield f"a lens at m_x = 0.625, z = m_z (1 - t 2^-{k})", made(scene, points, display(0.625, 2.0))


@_case("near the observers", "z within 2^-k of z_o", float32=AT_THE_SLIT)
def _near_observers() -> Inputs:
    for k in range(1, STEPS + 1):
        yield f"z = z_o (1 - t 2^-{k})", made(near, "observers", k)


@_case("radius", "R against the scene", float32="a sample nearer to the surface than the rounding of z counts as on it")
def _radius() -> Inputs:
    for power in (-12, -6, 6, 12):
        offset = np.array([0.0, 0.0, 0.5]) * 10.0**power
        yield f"R = 1e{power}, from points on the surface", made(on_surface, offset)


@_case("turned samples", "a rounded cosine and sine", float32="rounding decides about samples so near to the surface")
def _turned() -> Inputs:
    world = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.8, -0.6, 0.0], [0.0, 0.6, 0.8, 0.0]])
    level = (_BOX * [1.0, 1.0, 0.0]) @ world[:, :3]  # at z = 0, where the tilted world's surface is
    surface, (sine, cosine) = np.zeros((SIZE, SIZE), np.float32), sincospi(5 / 8)
    for behind in (1e-2, 1e-9):
        offset = 0.25, 0.125, behind - 0.75 * (0.25 * sine + 0.125 * cosine)
        case = made(scene, level, physical_from_world=world, offset=offset, depth=surface, turn=(cosine, sine))
        yield f"5/16 of a turn, to {behind:g} m behind", case


@_case("texel edges", "samples exactly between texels")
def _on_edges() -> Inputs:
    shown_by = display(0.0, 2.0)
    points = np.zeros((SIZE, SIZE, 3))
    points[..., 0] = np.arange(-4, 4) / 4
    points[..., 1] = -np.arange(-4, 4)[:, None] / 8
    depth = np.where(np.indices((SIZE, SIZE)).sum(axis=0) % 2, np.float32(-0.5), np.float32(0.5))
    yield "u and v whole numbers, a chessboard of depths", made(scene, points, shown_by, depth=depth)


@_case("on the surface", "samples exactly at the surface's depth; -0")
def _touching() -> Inputs:
    zero = np.zeros((SIZE, SIZE), np.float32)
    yield "samples on the surface itself", made(on_surface, np.zeros(3))
    yield "z = -0, the surface at 0", made(on_surface, np.zeros(3), zero, -0.0)
    yield "z = 0, the surface at -0", made(on_surface, np.zeros(3), -zero, 0.0)


@_case(
    "grazing",
    "a surface nearly along the rays",
    float32="a sample nearer to the surface than the rounding of its depth falls on either side",
)
def _grazing() -> Inputs:
    slope = 5729.577893  # tan 89.99 degrees
    texture = np.tile((np.arange(SIZE) - 3.5) * 0.25 * slope, (SIZE, 1)).astype(np.float32)
    for height in (1e-1, 1e-2, 1e-4):
        for side in (1, -1):
            normal = side * height * np.array([1.0, 0.0, -1 / slope])
            where = "behind" if side < 0 else "before"
            yield (
                f"89.99 degrees, {height:g} m {where} the surface",
                made(on_surface, normal, texture, shown_by=deep()),
            )


@_case("depth range", "near and far depths in one texture", float32=NEAR_THE_SURFACE)
def _depth_range() -> Inputs:
    texture = np.float32(10.0) ** np.linspace(-4, 4, SIZE * SIZE, dtype=np.float32).reshape(SIZE, SIZE)
    for step in (1e-2, 1e-5):
        behind = np.array([0, 0, step])
        yield f"depths 1e-4 to 1e4, samples {step:g} behind", made(on_surface, behind, texture, shown_by=deep())


@_case("stored depth", "a depth texture of few bits", both="a surface is known to half a step of its format")
def _stored() -> Inputs:
    for name, step in (("float16", 2.0**-13), ("uint16", 0.25 / 65535), ("uint24", 0.25 / (2**24 - 1))):
        yield f"{name} over 0.25 m, a quarter of its step behind", made(stored_as, name, step)


@_case("subnormals", "numbers below the normal range, the surface at 0", float32="what is below 2^-150 is 0")
def _subnormal() -> Inputs:
    for size in (1e-40, 5e-324):
        points = np.sign(lattice()) * size
        yield f"coordinates of {size:g}", made(scene, points, depth=np.zeros((SIZE, SIZE), np.float32))


@_case("background", "infinite depths")
def _background() -> Inputs:
    depth = np.where(np.indices((SIZE, SIZE)).sum(axis=0) % 3 == 0, np.float32(np.inf), scene(_BOX).depth)
    seen = made(scene, _BOX, offset=(0.25, 0.125, 0.125), depth=depth)
    yield "a third of the texels without a surface", seen


@_case("wide module", "rays along the screen")
def _wide_module() -> Inputs:
    for place in (10.0, 1e3):
        yield f"a lens at x = {place:g} m, 0.5 m behind the screen", made(scene, _BOX, display(place, 0.5))
    for angle in (120.0, 170.0, 179.9):
        shown_by = display(0.0, 0.5)
        lens = replace(shown_by.modules[0], field_of_view=angle)
        yield f"a field of view of {angle:g} degrees", made(along_rays, replace(shown_by, modules=(lens,)), 0, 0.5)


@_case("curved screen", "modules at the widest angle, near the lens", float32=AT_THE_SLIT)
def _curved() -> Inputs:
    shown_by = find_display("picoarray")
    for part in (0.5, 0.9, 0.999):
        for name, index in (("first", 0), ("last", len(shown_by.modules) - 1)):
            text = f"picoarray's {name} module, {part:g} of the way to the lens"
            yield text, made(along_rays, shown_by, index, part)


@_case("conical diffuser", "near where 1 + kappa is 0", float32=AT_THE_SLIT)
def _conical() -> Inputs:
    for place in (0.25, 1.5):
        shown_by = replace(display(place, 2.5), diffuser="conical")
        for part in (0.25, 0.75, 1 - 2.0**-10, 1 - 2.0**-20):
            text = f"a lens at x = {place:g} m, {part:.9g} of the way to where rays meet"
            yield text, made(along_rays, shown_by, 0, part)


@_case("distortion", "radial, near where it folds")
def _distorted() -> Inputs:
    shown_by = display(0.25, 2.5)
    # With k1 alone it folds at r^2 = -1 / (3 k1), where it reaches 2 / 3 r: for -2 / 27 the texture's corner, sqrt 2.
    for k_1, k_2 in ((0.5, 0.1), (-0.05, 0.0), (-2 / 27 + 2.0**-10, 0.0), (-2 / 27 + 2.0**-40, 0.0)):
        lens = replace(shown_by.modules[0], k1=k_1, k2=k_2)
        yield f"k1 = {k_1:.9f}, k2 = {k_2:g}", made(along_rays, replace(shown_by, modules=(lens,)), 0, 0.4)


@_case(
    "perspective depth",
    "depths of a camera whose planes are far apart",
    both="near the far plane a step of the depth texture is a long way in the world",
)
def _perspective() -> Inputs:
    for power in (1, 2, 4, 8):
        eye = CameraAtOrigin("perspective", 2.0, 1.5, 0.5, 0.5 * 10.0**power, SIZE, SIZE)
        exponent = np.linspace(0, power, SIZE * SIZE).reshape(SIZE, SIZE)[::-1]
        depth = (1 - 10.0**-exponent) / (1 - 10.0**-power)
        yield f"far / near = 1e{power}, samples 0.01 near behind", made(seen_by, eye, depth, (0.002, 0.001, -0.005))


@_case("orthographic depth", "depths of a camera whose planes are far apart", float32=NEAR_THE_SURFACE)
def _orthographic() -> Inputs:
    for power in (1, 4, 8):
        eye = CameraAtOrigin("orthographic", 2.0, 1.5, 0.5, 0.5 * 10.0**power, SIZE, SIZE)
        depth = (10.0 ** np.linspace(0, power, SIZE * SIZE).reshape(SIZE, SIZE) - 1) / (10.0**power - 1)
        yield f"far / near = 1e{power}, samples 0.01 near behind", made(seen_by, eye, depth, (0.02, 0.01, -0.005))


@_case("at the eye", "samples near a camera's eye", both=AT_THE_SLIT)
def _at_the_eye() -> Inputs:
    eye = CameraAtOrigin("perspective", 2.0, 1.5, 0.5, 8.0, SIZE, SIZE)
    for k in (5, 10, 20, 30):
        place = (2.0**-k * 0.1, 2.0**-k * 0.05, 1 - 2.0**-k)  # a surface at z = -1
        yield f"samples within 2^-{k} of the eye's plane", made(seen_by, eye, np.full((SIZE, SIZE), 8 / 15), place)


@_case("blur", "sigma")
def _blur() -> Inputs:
    for sigma in (1e-6, 1e-2, 1.0, 1e1, 1e2, 1024.0):
        yield f"sigma = {sigma:g}", partial(scalar_cases.blurred, sigma)


@_case("counts", "more samples than float32 has whole numbers")
def _counts() -> Inputs:
    for samples in (2**24 + 1, 2**31 - 1):
        yield f"counts up to {samples}", partial(scalar_cases.counted, samples)


@_case("slivers", "triangles a few ulp wide")
def _slivers() -> Inputs:
    yield "edges within 2 ulp of the ray", scalar_cases.slivers


CASES: tuple[Case | Refusal, ...] = (*_MEASURED, *REFUSALS)
