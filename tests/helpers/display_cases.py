"""Displays that hypothesis draws, one of each kind by hand, and the presets."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

from lfssao import Display, Module, display_names, find_display
from lfssao.errors import InputError

PRESETS = {name: find_display(name) for name in display_names()}
presets = pytest.mark.parametrize("display", PRESETS.values(), ids=PRESETS)
# Limit of the ray and the mapping together, about 60 operations, of which a curved screen's crossing magnifies some: of
# 2,000 drawn displays the worst has 185.
ROUNDINGS = 512
ROI = ((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05))
SHAPES = {
    "flat": Display("flat", 0.8, 0.6, 0.1, -2.0, (Module(-0.3, 0.0, 0.7, 97, 61),), ROI),
    "convex": Display(
        "convex", 0.8, 0.6, 0.1, -2.0, (Module(-0.3, 0.0, 0.9, 97, 61, k1=-0.03),), ROI, "linear", 1.0, 0.4
    ),
    "concave": Display("concave", 0.8, 0.6, 0.0, -2.0, (Module(0.2, 0.1, 0.9, 97, 61),), ROI, "linear", -0.8, 0.5),
    "conical": Display("conical", 0.8, 0.6, 0.1, -1.0, (Module(-0.3, 0.2, 0.7, 97, 61, k1=0.05),), ROI, "conical"),
    "projector": Display(
        "projector", 0.8, 0.6, 0.1, -2.0,
        (Module(-0.3, 0.1, 0.7, 97, 61, yaw=25.0, pitch=-8.0, roll=3.0, field_of_view=60.0),), ROI,
    ),
}  # fmt: skip
unit = st.floats(-1, 1)


def calibrated(module, scale=1.0):
    """The same module by its homography, times any number: a calibration may hand out either sign."""
    one = Display("one", 1.0, 1.0, 0.0, -2.0, (module,), ROI)
    homography = tuple((scale * one.module_numbers(0)[8:17]).tolist())
    return replace(module, yaw=0.0, pitch=0.0, roll=0.0, field_of_view=None, homography=homography)


@st.composite
def modules(draw):
    x = draw(unit)
    y = draw(st.floats(-0.3, 0.3))
    z = draw(st.floats(0.4, 1.5))
    module = Module(x, y, z, draw(st.integers(100, 1000)), draw(st.integers(10, 100)))
    kind = draw(st.sampled_from(["aligned", "projector", "homography"]))
    if kind != "aligned":
        yaw = math.degrees(math.atan2(-x, z))
        pitch = math.degrees(math.atan2(-y, z))
        a, b, c = draw(st.tuples(*[st.floats(-5, 5)] * 3))
        module = replace(module, yaw=yaw + a, pitch=pitch + b, roll=c, field_of_view=draw(st.floats(20, 90)))
    if draw(st.booleans()):
        module = replace(module, k1=draw(st.floats(-0.04, 0.1)), k2=draw(st.floats(-0.005, 0.02)))
    return calibrated(module, draw(st.sampled_from([-3.0, 0.01, 1.0]))) if kind == "homography" else module


@st.composite
def displays(draw):
    """A display of one module: flat with either diffuser, or curved; the observers on a line or an arc."""
    screen = draw(st.sampled_from(["flat", "convex", "concave", "conical"]))
    width = draw(st.floats(0.5, 1.6))
    height = draw(st.floats(0.3, 1.0))
    z_o = draw(st.floats(-3, -1))
    y_o = draw(st.floats(-0.5, 0.5))
    radius = width * draw(st.floats(0.75, 5))
    curvature = {"convex": 1 / radius, "concave": -1 / radius}.get(screen, 0.0)
    share = 0.0 if screen == "conical" else draw(st.one_of(st.just(0.0), st.floats(-0.2, 1)))
    diffuser = "conical" if screen == "conical" else "linear"
    made = draw(modules())
    try:
        return Display("drawn", width, height, y_o, z_o, (made,), ROI, diffuser, curvature, -share / z_o)
    except InputError as error:  # the lens passes the observers' arc by: rare
        assume("does not reach" not in str(error) and "behind the observers" not in str(error))
        raise


def texels(module, seed):
    """Image points u and v: corner texels of a module's texture, its middle, and ten points anywhere in it."""
    corners = [[0.5, module.width - 0.5, 0.5, module.width - 0.5], [0.5, 0.5, module.height - 0.5, module.height - 0.5]]
    anywhere = np.random.default_rng(seed).uniform(0, 1, (2, 10)) * [[module.width], [module.height]]
    return np.hstack([corners, [[module.width / 2], [module.height / 2]], anywhere])


def round_trip_error(display, index, u, v):
    """Largest distance, in roundings, of the images of points of texels' rays from the texels; which have a ray.

    A rounding moves the image by 2^-53 times its size, and as 2^-53 of the point's size in each coordinate does.
    """
    origin, direction, span = display.texel_ray(index, u, v)
    there = span[:, 0] < span[:, 1]
    shares = np.array([1e-3, 2e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.998, 0.999])
    z = span[there, :1] + shares * (span[there, 1:] - span[there, :1])
    points = origin[there, None] + z[..., None] * direction[there, None]
    size = (np.abs(origin[there, None]) + np.abs(z[..., None] * direction[there, None])).max(-1)[..., None]
    image = display.physical_to_image(index, points)[0][..., :2]  # NaN where there is none
    step = 1e-5 * size
    moved = np.abs(image)
    for axis in np.eye(3):
        ends = [display.physical_to_image(index, points + sign * step * axis)[0][..., :2] for sign in (-1, 1)]
        moved = moved + 1e5 * np.nan_to_num(np.fmax(*(np.abs(end - image) for end in ends)))  # NaN beyond a fold
    away = np.abs(image - np.stack([u, v], axis=-1)[there, None])
    return (away / (2.0**-53 * moved)).max(initial=0.0), there
