"""Inputs of the stiff and extreme cases."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench.stability.exact import CameraAtOrigin, CrossedSlits, GeneralDisplay
from lfssao.bench.stability.measure import Measured, Stiff, measure
from lfssao.core.affine import Matrix
from lfssao.optics.display import Display, Module

SIZE = 8
STEPS = 60

Run = Callable[[str], Measured]
Inputs = Iterator[tuple[str, Run]]

UNCHANGED = np.hstack([np.eye(3), np.zeros((3, 1))])


def made(make: Callable[..., Stiff], *arguments: Any, **named: Any) -> Run:
    """Return a function that makes a case and measures a path of it."""
    return lambda path: measure(make(*arguments, **named), path)


def lattice() -> NDArray[np.float64]:
    """(8, 8, 3) points of the open cube (-1, 1)^3, spread evenly by multiples of irrational numbers, in 2^-20 steps."""
    steps = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
    k = np.arange(1, SIZE * SIZE + 1)[:, None]
    cell = np.floor((k * steps) % 1.0 * 2**19) + 0.5
    points: NDArray[np.float64] = (cell / 2**18 - 1.0).reshape(SIZE, SIZE, 3)
    return points


def display(
    module_x: float = 0.25, module_z: float = 2.5, observer_y: float = 0.125, observer_z: float = -4.0
) -> Display:
    """A flat display of 2 x 1 m with one module of 8 x 8 texels, and observers."""
    roi = ((-0.8, -0.4, -0.3), (0.8, 0.4, 0.3))
    return Display("bench", 2.0, 1.0, observer_y, observer_z, (Module(module_x, 0.0, module_z, SIZE, SIZE),), roi)


ORDINARY = display()


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
    return Stiff(CrossedSlits(shown_by, physical_from_world, turn), points, np.array(offset, np.float64), depth)


SLITS = {"lens": (2.5, 0), "observers": (-5.0, 1)}  # z, and the axis along which it is at 0


def near(slit: str, k: int) -> Stiff:
    """Points within 2^-k of one of ``SLITS``: the lens of a module in the middle, observers at height 0."""
    return scene(close_to(SLITS[slit][0], k, SLITS[slit][1]), display(0.0, 2.5, 0.0, -5.0))


def close_to(slit: float, k: int, axis: int) -> NDArray[np.float64]:
    """Points within 2^-k of a slit at 0 along the axis, which stay on the texture.

    They are float32 numbers as long as float32 can tell them from the slit.
    """
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
    """Points at the centres of the texels, at the depths of the texture or all at z."""
    texture = (lattice()[..., 1] / 4).astype(np.float32) if texture is None else texture
    v, u = np.indices(texture.shape) + 0.5
    origin, direction, _ = shown_by.texel_ray(0, u, v)
    places = texture.astype(np.float64) if z is None else np.full(texture.shape, z)
    points = origin + places[..., None] * direction
    points[..., 2] = places
    return Stiff(CrossedSlits(shown_by, UNCHANGED), points, offset, texture)


def deep() -> Display:
    """A display 40 km deep, whose texels are 0.25 m: slopes of 89.99 degrees fit in."""
    return display(0.0, 4e4, 0.0, -4e4)


def stored_as(name: str, step: float) -> Stiff:
    """Samples a quarter of a step behind a surface whose depths are stored in a format of that step."""
    depth = ((lattice()[..., 1] + 1) / 8).astype(np.float32)
    wide = depth.astype(np.float64)
    rounded = wide.astype(np.float16) if name == "float16" else np.rint(wide / step) * step
    case = on_surface(np.array([0, 0, step / 4]), depth)
    return replace(case, stored=np.asarray(rounded, np.float32), step=step / 2 + 2.0**-26)


def along_rays(shown_by: Display, index: int, part: float) -> Stiff:
    """Points on rays of 8 x 8 texels, and of the corners, at a part of the way from observers to lens.

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
    middle, towards = direction[module.height // 2, module.width // 2], (np.indices(u.shape).sum(axis=0) % 2) * 2.0
    depth = (points[..., 2] + step * towards).astype(np.float32)
    texels = [(int(j), int(i)) for j in rows for i in columns if span[j, i, 0] < span[j, i, 1]]
    return Stiff(GeneralDisplay(shown_by, index), points, step * middle, depth, texels=texels)


def seen_by(eye: CameraAtOrigin, depth: NDArray[np.float64], offset: Any) -> Stiff:
    """The texels of a camera with a depth texture, each with a sample."""
    texture = depth.astype(np.float32)
    v, u = np.indices(texture.shape) + 0.5
    return Stiff(eye, np.stack([u, v, texture.astype(np.float64)], axis=-1), np.array(offset), texture)
