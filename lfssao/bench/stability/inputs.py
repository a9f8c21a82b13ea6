"""Inputs of the stiff and extreme cases."""

from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench.stability.measure import Measured, Stiff, measure
from lfssao.bench.stability.table import Inputs
from lfssao.core.affine import Matrix
from lfssao.core.elementary import sincospi
from lfssao.optics.camera import Camera
from lfssao.optics.display import Display, Module, fit_roi
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.projection import DISPLAY
from lfssao.optics.view import View, WorldToImage

SIZE = 8
STEPS = 60

UNCHANGED = np.hstack([np.eye(3), np.zeros((3, 1))])


def measured(make: Callable[..., Stiff], *arguments: Any, **named: Any) -> Callable[[str], Measured]:
    """Return a function that makes a case and measures a path of it."""
    return lambda path: measure(make(*arguments, **named), path)


def lattice() -> NDArray[np.float64]:
    """(8, 8, 3) points of the open cube (-1, 1)^3, spread evenly by multiples of irrational numbers, in 2^-20 steps."""
    steps = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
    k = np.arange(1, SIZE * SIZE + 1)[:, None]
    cell = np.floor((k * steps) % 1.0 * 2**19) + 0.5
    return np.asarray((cell / 2**18 - 1.0).reshape(SIZE, SIZE, 3))


def display(
    module_x: float = 0.25, module_z: float = 2.5, observer_y: float = 0.125, observer_z: float = -4.0
) -> Display:
    """Return a flat display of 2 x 1 m with one module of 8 x 8 texels, and observers."""
    roi = ((-0.8, -0.4, -0.3), (0.8, 0.4, 0.3))
    return Display("bench", 2.0, 1.0, observer_y, observer_z, (Module(module_x, 0.0, module_z, SIZE, SIZE),), roi)


ORDINARY = display()
DEEP = display(0.0, 4e4, 0.0, -4e4)  # 40 km, its texels are 0.25 m: slopes of 89.99 degrees fit in


def scene(
    points: NDArray[np.float64],
    shown_by: Display = ORDINARY,
    physical_from_world: Matrix = UNCHANGED,
    offset: Any = (0.0, 0.0, 0.0),
    depth: NDArray[np.float32] | None = None,
    turn: tuple[float, ...] = (),
) -> Stiff:
    """Points, (8, 8, 3) world, on a display; without a depth texture the surface has depths between the points'."""
    z = points @ physical_from_world[2, :3] + physical_from_world[2, 3]
    if depth is None:
        place = (lattice()[::-1, ::-1, 1] + 1) / 2
        depth = (z.min() + place * (z.max() - z.min())).astype(np.float32)
    view = shown_by.view(0, physical_from_world)
    return Stiff(view, points, np.array(offset, np.float64), depth, turn=turn)


def near(slit: float, k: int, axis: int) -> Stiff:
    """Return points within 2^-k of a slit, the lens or the observers, of a module in the middle."""
    return scene(close_to(slit, k, axis), display(0.0, 2.5, 0.0, -5.0))


def close_to(slit: float, k: int, axis: int) -> NDArray[np.float64]:
    """Return points within 2^-k of a slit at 0 along the axis, on the texture; in float32 as long as that can tell."""
    points = lattice() * [0.7, 0.4, 0.0]
    points[..., axis] *= 2.0**-k
    points[..., 2] = slit * (1 - (3 + 0.987654321 * lattice()[..., 2]) / 4 * 2.0**-k)
    return points.astype(np.float32 if k < 23 else np.float64).astype(np.float64)


def on_surface(
    offset: NDArray[np.float64],
    texture: NDArray[np.float32] | None = None,
    z: float | None = None,
    shown_by: Display = ORDINARY,
) -> Stiff:
    """Return points at the centres of the texels, at the depths of the texture or all at z."""
    texture = (lattice()[..., 1] / 4).astype(np.float32) if texture is None else texture
    v, u = np.indices(texture.shape) + 0.5
    origin, direction, _ = shown_by.texel_ray(0, u, v)
    places = texture.astype(np.float64) if z is None else np.full(texture.shape, z)
    points = origin + places[..., None] * direction
    points[..., 2] = places
    return Stiff(shown_by.view(0, UNCHANGED), points, offset, texture)


def stored_as(name: str, step: float) -> Stiff:
    """Return samples a quarter of a step behind a surface whose depths are stored in a format of that step."""
    depth = ((lattice()[..., 1] + 1) / 8).astype(np.float32)
    wide = depth.astype(np.float64)
    rounded = wide.astype(np.float16) if name == "float16" else np.rint(wide / step) * step
    case = on_surface(np.array([0, 0, step / 4]), depth)
    return replace(case, stored=np.asarray(rounded, np.float32), step=step / 2 + 2.0**-26)


def along_rays(shown_by: Display, index: int, part: float) -> Stiff:
    """Return points on rays of 8 x 8 texels, and of the corners, at a part of the way from observers to lens.

    Samples lie a hundredth of the rest of the way towards the lens, the surfaces on both sides of them.
    """
    module = shown_by.modules[index]
    columns, rows = (np.unique(np.linspace(0, size - 1, SIZE).astype(int)) for size in (module.width, module.height))
    v, u = np.indices((module.height, module.width)) + 0.5
    origin, direction, span = shown_by.texel_ray(index, u, v)
    z = span[..., :1] + part * (span[..., 1:] - span[..., :1])
    points = origin + z * direction
    points[..., 2] = z[..., 0]
    step = (1 - part) * 0.01 * float(np.abs(span[..., 1] - span[..., 0]).max())
    middle = direction[module.height // 2, module.width // 2]
    towards = (np.indices(u.shape).sum(axis=0) % 2) * 2.0
    depth = (points[..., 2] + step * towards).astype(np.float32)
    texels = [(int(j), int(i)) for j in rows for i in columns if span[j, i, 0] < span[j, i, 1]]
    return Stiff(general_view(shown_by, index), points, step * middle, depth, texels=texels)


def general_view(shown_by: Display, index: int) -> View:
    """A module's view in physical coordinates, its mapping of kind DISPLAY even where a display has a simpler one."""
    numbers = np.concatenate([np.eye(3, 4).ravel(), shown_by.module_numbers(index)])
    return replace(shown_by.view(index, np.eye(3, 4)), lens=numbers[12:], world_to_image=WorldToImage(DISPLAY, numbers))


def camera_at_origin(projection: str, far: float) -> Camera:
    """Return a camera at the origin that looks along -Z, near plane at 0.5, 1.5 high at the distance 2."""
    return Camera(projection, (0.0, 0.0, 0.0), (0.0, 0.0, -2.0), (0.0, 1.0, 0.0), 1.5, 0.5, far)


def seen_by(eye: Camera, depth: NDArray[np.float64], offset: Any) -> Stiff:
    """Return the texels of a camera with a depth texture, each with a sample."""
    texture = depth.astype(np.float32)
    v, u = np.indices(texture.shape) + 0.5
    return Stiff(eye.view(SIZE, SIZE), np.stack([u, v, texture.astype(np.float64)], axis=-1), np.array(offset), texture)


_BOX = lattice() * [0.7, 0.4, 0.25]  # points on both sides of the screen


def mapped() -> Inputs:
    """Yield inputs of all cases of a mapping and of LF's decisions."""
    yield from chain(_worlds(), _mappings(), _surfaces(), _cameras())


def _worlds() -> Inputs:
    yield "ordinary", "a box of 1.4 x 0.8 x 0.5 m on the screen", measured(scene, _BOX)
    for power in (-30, -12, 12, 30):
        scaled = measured(scene, _BOX * 10.0**power, physical_from_world=UNCHANGED / 10.0**power)
        yield "scene scale", f"a scene of size 1e{power}", scaled
    for power in (2, 4, 6, 8):
        world = UNCHANGED - 10.0**power * np.eye(3, 4, 3)
        points = _BOX - world[:, 3]
        yield "offset", f"x from 1e{power} - 0.7 to 1e{power} + 0.7", measured(scene, points, physical_from_world=world)
    for power in (-6, -3, 3, 6):
        size = np.array([0.7, 0.7 * 10.0**power, 0.25]) if power < 0 else np.array([0.4 * 10.0**-power, 0.4, 0.25])
        roi = ((-size[0], -size[1], -size[2]), (size[0], size[1], size[2]))
        shown_by = replace(display(), roi=roi)
        fitted = fit_roi(np.array([-7 * size, 7 * size]), roi)
        yield "aspect", f"a ROI of width / height 1e{-power}", measured(scene, lattice() * size * 7, shown_by, fitted)
        high = np.array([1.0, 10.0**power, 1.0])
        world = UNCHANGED / high[:, None]
        yield (
            "aspect",
            f"a world stretched by 1e{power} in height",
            measured(scene, _BOX * high, physical_from_world=world),
        )


def _mappings() -> Inputs:
    for k in range(1, STEPS + 1):
        yield "near the lens", f"z = m_z (1 - t 2^-{k})", measured(near, 2.5, k, 0)
        yield "near the observers", f"z = z_o (1 - t 2^-{k})", measured(near, -5.0, k, 1)
    for k in (10, 20, 30):
        points = close_to(2.0, k, 0) + np.array([0.625, 0.0, 0.0])
        text = f"a lens at m_x = 0.625, z = m_z (1 - t 2^-{k})"
        yield "near the lens", text, measured(scene, points, display(0.625, 2.0))
    for place in (10.0, 1e3):
        text = f"a lens at x = {place:g} m, 0.5 m behind the screen"
        yield "wide module", text, measured(scene, _BOX, display(place, 0.5))
    for angle in (120.0, 170.0, 179.9):
        yield "wide module", f"a field of view of {angle:g} degrees", _along(0.5, 0.0, 0.5, field_of_view=angle)
    curved = find_display("picoarray")
    for part in (0.5, 0.9, 0.999):
        for name, index in (("first", 0), ("last", len(curved.modules) - 1)):
            text = f"picoarray's {name} module, {part:g} of the way to the lens"
            yield "curved screen", text, measured(along_rays, curved, index, part)
    for place in (0.25, 1.5):
        shown_by = replace(display(place, 2.5), diffuser="conical")
        for part in (0.25, 0.75, 1 - 2.0**-10, 1 - 2.0**-20):
            text = f"a lens at x = {place:g} m, {part:.9g} of the way to where rays meet"
            yield "conical diffuser", text, measured(along_rays, shown_by, 0, part)
    # With k1 alone it folds at r^2 = -1 / (3 k1), where it reaches 2 / 3 r: for -2 / 27 the texture's corner, sqrt 2.
    for k_1, k_2 in ((0.5, 0.1), (-0.05, 0.0), (-2 / 27 + 2.0**-10, 0.0), (-2 / 27 + 2.0**-40, 0.0)):
        yield "distortion", f"k1 = {k_1:.9f}, k2 = {k_2:g}", _along(0.4, 0.25, 2.5, k1=k_1, k2=k_2)


def _along(part: float, module_x: float, module_z: float, **lens: float) -> Any:
    """Return points on rays of a flat display's module with a lens of other numbers."""
    shown_by = display(module_x, module_z)
    other = replace(shown_by, modules=(replace(shown_by.modules[0], **lens),))  # type: ignore[arg-type]
    return measured(along_rays, other, 0, part)


def _surfaces() -> Inputs:
    zero = np.zeros((SIZE, SIZE), np.float32)
    chess = np.indices(zero.shape).sum(axis=0)
    for power in (-12, -6, 6, 12):
        offset = np.array([0.0, 0.0, 0.5]) * 10.0**power
        yield "radius", f"R = 1e{power}, from points on the surface", measured(on_surface, offset)
    world = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.8, -0.6, 0.0], [0.0, 0.6, 0.8, 0.0]])
    level = (_BOX * [1.0, 1.0, 0.0]) @ world[:, :3]  # at z = 0, where the tilted world's surface is
    sine, cosine = sincospi(5 / 8)
    for behind in (1e-2, 1e-9):
        offset = np.array([0.25, 0.125, behind - 0.75 * (0.25 * sine + 0.125 * cosine)])
        turned = measured(scene, level, physical_from_world=world, offset=offset, depth=zero, turn=(cosine, sine))
        yield "turned samples", f"5/16 of a turn, to {behind:g} m behind", turned
    corners = np.stack([*np.meshgrid(np.arange(-4, 4) / 4, -np.arange(-4, 4) / 8), zero], axis=-1)
    depth = np.where(chess % 2, np.float32(-0.5), np.float32(0.5))
    edges = measured(scene, corners, display(0.0, 2.0), depth=depth)
    yield "texel edges", "u and v whole numbers, a chessboard of depths", edges
    yield "on the surface", "samples on the surface itself", measured(on_surface, np.zeros(3))
    yield "on the surface", "z = -0, the surface at 0", measured(on_surface, np.zeros(3), zero, -0.0)
    yield "on the surface", "z = 0, the surface at -0", measured(on_surface, np.zeros(3), -zero, 0.0)
    slope = 5729.577893  # tan 89.99 degrees
    texture = np.tile((np.arange(SIZE) - 3.5) * 0.25 * slope, (SIZE, 1)).astype(np.float32)
    for height in (1e-1, 1e-2, 1e-4):
        for side, where in ((1, "before"), (-1, "behind")):
            normal = side * height * np.array([1.0, 0.0, -1 / slope])
            grazing = measured(on_surface, normal, texture, shown_by=DEEP)
            yield "grazing", f"89.99 degrees, {height:g} m {where} the surface", grazing
    texture = np.float32(10.0) ** np.linspace(-4, 4, SIZE * SIZE, dtype=np.float32).reshape(SIZE, SIZE)
    for step in (1e-2, 1e-5):
        ranging = measured(on_surface, np.array([0, 0, step]), texture, shown_by=DEEP)
        yield "depth range", f"depths 1e-4 to 1e4, samples {step:g} behind", ranging
    for name, step in (("float16", 2.0**-13), ("uint16", 0.25 / 65535), ("uint24", 0.25 / (2**24 - 1))):
        yield "stored depth", f"{name} over 0.25 m, a quarter of its step behind", measured(stored_as, name, step)
    for size in (1e-40, 5e-324):
        yield "subnormals", f"coordinates of {size:g}", measured(scene, np.sign(lattice()) * size, depth=zero)
    depth = np.where(chess % 3 == 0, np.float32(np.inf), scene(_BOX).depth)
    open_third = measured(scene, _BOX, offset=(0.25, 0.125, 0.125), depth=depth)
    yield "background", "a third of the texels without a surface", open_third


def _cameras() -> Inputs:
    upward = np.arange(SIZE * SIZE).reshape(SIZE, SIZE) / (SIZE * SIZE - 1)
    for power in (1, 2, 4, 8):
        eye = camera_at_origin("perspective", 0.5 * 10.0**power)
        depth = (1 - 10.0 ** (-power * upward[::-1])) / (1 - 10.0**-power)
        text = f"far / near = 1e{power}, samples 0.01 near behind"
        behind = (0.002, 0.001, -0.005)
        yield "perspective depth", text, measured(seen_by, eye, depth, behind)
        eye = replace(eye, projection="orthographic")
        depth = (10.0 ** (power * upward) - 1) / (10.0**power - 1)
        yield "orthographic depth", text, measured(seen_by, eye, depth, (0.02, 0.01, -0.005))
    eye = camera_at_origin("perspective", 8.0)
    for k in (5, 10, 20, 30):
        place = (2.0**-k * 0.1, 2.0**-k * 0.05, 1 - 2.0**-k)  # a surface at z = -1
        text = f"samples within 2^-{k} of the eye's plane"
        yield "at the eye", text, measured(seen_by, eye, np.full((SIZE, SIZE), 8 / 15), place)
