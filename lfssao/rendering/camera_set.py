"""Sets of cameras as MPEG's test data for immersive video describe them in JSON: of RVS, TMIV and OpenDIBR.

The world has x forward, y left and z up (OMAF). A camera that is not turned looks along x, and its point p is at
Rz(yaw) Ry(pitch) Rx(roll) p + position. Codes of depth are of normalised disparity, 0 at the far plane.
"""

from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.core.affine import Matrix, invert_affine, multiply, to_4x4
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError, check_choice
from lfssao.optics.camera import view_of_matrix
from lfssao.optics.display_file import Table
from lfssao.optics.view import View

MOST_BITS = 16
_NAMES = ("Name", "NameDepth", "NameColor")
_EYE_FROM_CAMERA = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # x right, y up, z forward


def camera_of_set(values: Any, name: str, size: tuple[int, int, int]) -> tuple[View, int, int]:
    """Return the view of a set's camera, and the bits of its codes of depth and of colour.

    ``name`` is the camera's, or that of one of its files, with or without ending, or its number from 0. InputError,
    with the key, if there is none, its projection or axes are others, or its textures have not the ``size``.
    """
    if not isinstance(values, dict) or not isinstance(values.get("cameras"), list):
        raise InputError("it has no list 'cameras', and is no set of them")
    root = Table(values)
    root.choice("Axial_system", ("OMAF",), "OMAF")
    cameras = root.tables("cameras")
    known = [{camera.text(key, None) for key in _NAMES} - {None} for camera in cameras]
    found = [k for k, names in enumerate(known) if name in names | {Path(each).stem for each in names}]
    if not found:
        check_choice("camera", name, [*map(str, range(len(cameras))), *(min(names) for names in known if names)])
        found = [int(name)] if name.isdigit() and int(name) < len(cameras) else found
    if len(found) != 1:
        raise InputError(f"cameras: {len(found)} of them are called '{name[:40]}': give a number from 0 on by --view")
    camera = cameras[found[0]]
    camera.choice("Projection", ("Perspective",))
    width, height = camera.resolution("Resolution")
    if (width, height, 0) != size:
        declared = "{}x{} texels and a guard band of {}".format(*size)
        raise camera.wrong("Resolution", f"it is {width:g}x{height:g}, the textures have {declared}")
    near, far = camera.numbers("Depth_range", 2)
    focal = camera.numbers("Focal", 2)
    middle = camera.numbers("Principle_point", 2)
    bits = camera.whole("BitDepthDepth", MOST_BITS), camera.whole("BitDepthColor", MOST_BITS)
    eye_from_world = _eye_from_world(camera.numbers("Position", 3), camera.numbers("Rotation", 3))
    if not 0 < near < far or not 0 < near * far < inf:
        raise camera.wrong("Depth_range", f"it is {near:g} to {far:g}, it must be 0 < near < far")
    if not min(focal) > 0:
        raise camera.wrong("Focal", f"it is {list(focal)}, it must be positive")
    f_u, f_v = focal
    c_u, c_v = middle
    a = far / (far - near)
    screen_from_eye = [[f_u, 0, c_u, 0], [0, -f_v, c_v, 0], [0, 0, a, -a * near], [0, 0, 1, 0]]
    return view_of_matrix(multiply(screen_from_eye, to_4x4(eye_from_world)), width, height), *bits


def _eye_from_world(position: tuple[float, ...], rotation: tuple[float, ...]) -> Matrix:
    """World -> eye space, (3, 4), of place and yaw, pitch and roll, degrees."""
    (a, b), (c, d), (e, f) = (sincospi(angle / 180) for angle in rotation)
    about_z = [[b, -a, 0], [a, b, 0], [0, 0, 1]]
    about_y = [[d, 0, c], [0, 1, 0], [-c, 0, d]]
    world_from_camera = multiply(multiply(about_z, about_y), [[1, 0, 0], [0, f, -e], [0, e, f]])
    camera_from_world = invert_affine(np.column_stack([world_from_camera, position]))
    return multiply(_EYE_FROM_CAMERA, camera_from_world)
