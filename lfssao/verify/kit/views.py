"""Displays, cameras and noise that the cases are made of, and the recipe of a case."""

from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import multiply, to_4x4
from lfssao.core.philox import random_unit
from lfssao.optics.camera import Camera
from lfssao.optics.display import Display, Module
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY, MATRIX
from lfssao.optics.view import KINDS, View, WorldToImage
from lfssao.verify.case import ORTHOGRAPHIC, Arrays
from lfssao.verify.kit.scenes import Scene

Problem = tuple[dict[str, Any], Arrays]
_ROI = ((-0.4, -0.3, -0.3), (0.4, 0.3, 0.3))
MODULE = Module(0.3, 0.05, 0.7, 32, 24)

# World -> physical: turned, mirrored and of a scale that differs from axis to axis, so that the ball is an ellipsoid.
WORLD = np.array([[0.5, 0.1, 0.0, -0.1], [-0.1, 0.45, 0.05, 0.0], [0.0, 0.1, -0.6, 0.05]])
RADIUS = 0.2


class Recipe:
    """A case's name, stage and title, and ``build(*arguments)``, which makes its parameters and inputs."""

    def __init__(self, name: str, stage: str, title: str, build: Callable[..., Problem], *arguments: Any) -> None:
        self.name = name
        self.stage = stage
        self.title = title
        self.build = build
        self.arguments = arguments


def make_display(module: Module = MODULE, **options: Any) -> Display:
    """A display of one module, flat with a linear diffuser unless the options say otherwise."""
    settings: dict[str, Any] = {"observer_height": 0.1, "observer_z": -2.0, **options}
    return Display("kit", 1.0, 0.75, modules=(module,), roi=_ROI, **settings)


DISPLAYS = {
    "crossed_slits": make_display(),
    "conical": make_display(diffuser="conical"),
    "convex": make_display(screen_curvature=0.7, observer_curvature=0.3),
    "concave": make_display(screen_curvature=-0.6, observer_curvature=0.4),
    "projector": make_display(replace(MODULE, field_of_view=65.0, yaw=-20.0, pitch=3.0, roll=5.0)),
    "calibrated": make_display(
        replace(MODULE, homography=(32.5, 0.6, 16.2, -0.4, -31.2, 12.3, 0.02, -0.03, 1.0), k1=-0.06, k2=0.01)
    ),
    # All nine numbers of the other sign, w = 0 at a place that samples reach, and a fold that k2 alone makes.
    "negated": make_display(
        replace(MODULE, homography=(-32.5, -0.6, -16.2, 0.4, 31.2, -12.3, -0.9, 0.03, -1.0), k2=-0.02, width=30)
    ),
}


def described(to_image: WorldToImage) -> dict[str, Any]:
    """A mapping as JSON."""
    return {"kind": KINDS[to_image.kind], "numbers": to_image.numbers.tolist()}


_RAY_KINDS = {CROSSED_SLITS: 0, MATRIX: 1, DISPLAY: 3}


def view_numbers(view: View) -> dict[str, Any]:
    """All of a view but its mapping, as JSON: the kind of its rays is a number, and infinity among theirs is null."""
    kind = _RAY_KINDS[view.rays.kind]
    numbers = [number if isfinite(number) else None for number in view.rays.numbers.tolist()]
    if view.rays.kind == MATRIX and numbers[6] == 1.0:
        kind = ORTHOGRAPHIC
        numbers[6] = 0.0
    return {
        "name": view.name,
        "width": view.width,
        "height": view.height,
        "ray_kind": kind,
        "lens": numbers,
        "cast_from_world": view.cast_from_world.tolist(),
        "world_from_cast": view.world_from_cast.tolist(),
        "screen_to_world": None if view.screen_to_world is None else view.screen_to_world.tolist(),
        "depth_kind": view.depth_kind,
        "guard": view.guard,
    }


def module_view(display: Display, guard: int = 0) -> View:
    """The view of the one module of a display into the turned world."""
    return display.view(0, WORLD, guard)


def make_camera(projection: str, width: int = 32, height: int = 24, z: float = 5.0) -> View:
    """The view of a camera that looks down on the world's middle from before it, or from behind (z < 0)."""
    camera = Camera(projection, (1.0, 2.0, z), (0.1, 0.0, 0.0), (0.0, 1.0, 0.1), 2.0, 3.0, 8.0)
    return camera.view(width, height)


def without_far_plane(view: View) -> View:
    """A perspective camera's view with the far plane at infinity."""
    f_u, f_v, c_u, c_v, near = view.lens[:5].tolist()
    forth = np.array([[f_u, 0, c_u, 0], [0, -f_v, c_v, 0], [0, 0, 1, -near], [0, 0, 1, 0]])
    back = np.array(
        [[1 / f_u, 0, 0, -c_u / f_u], [0, -1 / f_v, 0, c_v / f_v], [0, 0, 0, 1], [0, 0, -1 / near, 1 / near]]
    )
    return replace(
        view,
        lens=np.array([*view.lens[:5], inf, *view.lens[6:]]),
        world_to_image=WorldToImage(MATRIX, multiply(forth, to_4x4(view.cast_from_world)).ravel()),
        screen_to_world=multiply(to_4x4(view.world_from_cast), back),
        depth_kind="screen space z: 0 at the near plane, 1 at infinity, perspective",
    )


# SCENE in a camera's eye space: twice as large, around the target.
CAMERA_SCENE = Scene((0.16 * 2.0 + 5.4, 0.2, -0.1, 0.72), (((-0.24, 0.1, 5.5), 0.28), ((0.4, -0.2, 5.16), 0.22)))

# The flat display with a texture of 16 x 12 texels.
SMALL = DISPLAYS["crossed_slits"].with_resolution(16, 12)

# Lens and observers so near that samples pass them.
NEAR = make_display(replace(MODULE, z=0.42), observer_z=-0.5)

# A lens outside the screen's cylinder: lines from it can miss it.
MISSED = make_display(replace(MODULE, z=1.4), screen_curvature=1.8, observer_z=-0.5)

# The same with texels that look past the cylinder, along no line at all.
WIDE = make_display(replace(MODULE, z=1.4, field_of_view=80.0), screen_curvature=1.8, observer_z=-0.5)


def noise(stream: int, *shape: int) -> NDArray[np.float32]:
    """Numbers in (0, 1) by the counter-based generator."""
    flat = [random_unit(np.uint64(6), stream, k) for k in range(int(np.prod(shape)))]
    return np.array(flat, np.float64).reshape(shape).astype(np.float32)
