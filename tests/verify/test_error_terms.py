"""Each error term of the bounds, one by one: how many errors of a kind a step allows.

Many are too small beside others for any renderer to show that one is missing. So all kinds of errors but one are left
out here, and what is left of an interval's half width, or of the room at a decision, is counted in units of that one.
The numbers are the program's own, held so that no term is lost; ``test_sound`` and the estimators' tests of random
renderers say that they are enough. Those of kernels are tested at the rules of balls.
"""

from dataclasses import replace
from types import SimpleNamespace as Given

import numpy as np
import pytest

from lfssao import Camera, WorldToImage
from lfssao.core.balls import FLUSHED
from lfssao.verify.bounds import depth, points, post, sao, stored
from lfssao.verify.bounds.bounds import exact_bounds
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels import point_bounds

ULP = 2.0**-23
QUARTER = np.float32([0.25])
SLITS = np.array([1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0.5, 1.5, -0.5, 0, 0])  # a crossed-slits mapping


def edge(holds):
    """Up to which number a decision holds."""
    low = 0.0
    high = 2.0**-3
    for _ in range(42):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def room(decide):
    """How far around 0 a decision (may, must) is open, on average; it grows with its number."""
    return (edge(lambda t: decide(-t)[0]) + edge(lambda t: not decide(t)[1])) / 2


def half(ends):
    return (ends[1] - ends[0]) / 2


def width(bounds):
    return np.ravel(half((bounds.lower.astype(float), bounds.upper)))[0]


def linear_z(model, projection):
    camera = Camera(projection, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1.0, 20.0).view(1, 1)
    return half(sao._linear_z(Given(buffers=Given(depth=np.float32([[0.5]]), view=camera), model=model)))[0, 0]


def averaged(model, x):
    """Whether a texel of light 1 may be, and is for sure, averaged with one of light 0 that is 1 - x deeper."""
    light = np.array([[1.0, 0]])
    z = np.array([[0, 1 - x]])
    low, high = sao._averaged((light, light), (z, z), 1.0, model)
    return low[0, 0] < 0.9, high[0, 0] < 0.9


def code(model, light, key=0.25):
    return sao._stored((np.array(light),) * 2, (np.array(key),) * 2, model)


def blurred(model):
    """A texel of light 1 beside one of light 0 that weighs half as much, by the distance of their keys."""
    light = np.array([[1.0, 1, 1, 0]])
    keys = np.array([[0.0, 0, 0, 0.05]])
    weights = np.array([0, 0, 0, 1.0, 1, 0, 0])
    options = Given(packed=False, sharpness=10.0)
    return half(sao._reconstructed((light, light), (keys, keys), weights, options, model))[0, 0]


def fits(model, u=0.5, z=0.5):
    """Whether a position that lands on (u, 1/2) and image z 1/2 may be that of a texel of depth z."""
    of = depth.PositionBounds(WorldToImage(0, SLITS), np.float32([[z]]), model)
    return not of.outside(np.float32([[[u, 0.5, 0]]])).any()


def by_mesh(model, judge):
    """Depth or colour of a triangle of z = 1/4 and of colour 1/2; it is 9 wide."""
    made = Given(triangle=np.zeros((1, 1), np.int32), color=np.full((1, 1, 3), 0.5))
    mesh = Given(vertices=np.array([[-9.0, -9, 0.25], [9, -9, 0.25], [0, 9, 0.25]]), faces=np.array([[0, 1, 2]]))
    view = Camera("orthographic", (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1.0, 20.0).view(1, 1)
    caster = Given(mesh=mesh, gbuffer=lambda *_, **__: made)
    return width(judge(caster, replace(view, cast_from_world=np.eye(3, 4)), model=model))


NOTHING = ErrorModel("", "", False, 0.0, 0.0, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, 0.0)
EVEN = (np.full((2, 2), 0.5),) * 2
FLAT = np.full((2, 2), 0.5, "f4")
RAMP = np.arange(1, 6, dtype="f4")
CLIFF = np.float32([[1, 1, 9, 9]])
LOW = np.array([[0, 0, 1, 1]], "f4")
TIE = 10.5 / 65280
TWO_RADII = {"second": 0.5, "combine": "product"}
PASSES = {
    "blur": (lambda m: width(post.blur_bounds(exact_bounds(2 * FLAT), 1.0, m)),
             dict(operation=39.97, quotient=5.98, constant=4, slope=1.99, smallest=48)),
    "shading": (lambda m: width(post.shade_bounds(np.ones((1, 1, 3), "f4"), exact_bounds(QUARTER[None]), m)),
                dict(operation=1.75, smallest=4)),
    "light": (lambda m: half(sao.visibility_of_sum(EVEN, 0.5, 5, m))[0, 0], dict(operation=2.75, quotient=0.25)),
    "power": (lambda m: sao._power_end(np.array([0.25]), 2.0, 1, m)[0] - 0.0625,
              dict(constant=0.0625, slope=0.25, without=1.75 * ULP)),
    "power of more than 1": (lambda m: sao._power_end(np.array([1 + 2.0**-10]), 2.0, 1, m)[0] - 1,
                             dict(constant=1, without=2.0**-8)),
    "lacking": (lambda m: width(sao.occlusion_of_visibility((EVEN[0] / 4,) * 2, 1.0, None, m)), dict(operation=0.875)),
    "z": (lambda m: linear_z(m, "perspective") + linear_z(m, "orthographic"),
          dict(operation=35.92 + 63, quotient=1.905)),
    "level": (lambda m: half(sao._hierarchy(EVEN, 1.5, Given(mip="arithmetic", max_level=1), m)[:2])[4],
              dict(operation=16, quotient=4)),
    "average": (lambda m: half(sao._averaged(EVEN, EVEN, 1.0, m))[0, 0], dict(operation=8)),
    "averaged": (lambda m: room(lambda x: averaged(m, x)), dict(operation=8)),
    "key": (lambda m: half(sao._keys(EVEN, 0.0, 2.0, m))[0, 0], dict(operation=1.5, quotient=0.25)),
    "key by surfaces": (lambda m: half(sao._keys((EVEN[0], 2 * EVEN[1]), 0.0, 0.0, m))[0, 0],
                        dict(operation=1.5, quotient=0.25, without=0.25)),
    "bytes": (lambda m: sum(map(half, code(m, 0.2))), dict(operation=1.8, quotient=0.45)),
    "next byte": (lambda m: room(lambda x: [end > 0.1 for end in code(m, 0.1 + x)[0][::-1]]),
                  dict(operation=4 * 256 / 255, quotient=256 / 255)),
    "next byte of a key": (lambda m: room(lambda x: [end > TIE for end in code(m, 0.2, TIE + x)[1][::-1]]),
                           dict(operation=1 / 16, quotient=1 / 64)),
    "bilateral": (blurred, dict(operation=35.556, quotient=1.333)),
    "two radii": (lambda m: width(points._two_radii_bounds(
        Given(options=TWO_RADII, model=m), 1.0, bounds_at=lambda *_: exact_bounds(FLAT))), dict(operation=4)),
    "depth by the mesh": (lambda m: by_mesh(m, depth.depth_bounds), dict(operation=16 * 9 * 3 / 19)),
    "colour by the mesh": (lambda m: by_mesh(m, depth.color_bounds), dict(operation=8)),
    "depth": (lambda m: width(depth.texture_depth_bounds(RAMP[None], m)), dict(operation=80, centre=8)),
    "colour": (lambda m: width(depth.texture_color_bounds(np.repeat(RAMP, 3).reshape(1, 5, 3), None, m)),
               dict(operation=32, centre=8)),
    "depths over a jump": (lambda m: np.diff(depth.texture_depth_bounds(CLIFF, m).ranges, axis=0)[0, :, 0, 1].sum() / 2,
                           dict(operation=9 * 16 * 9, centre=9 * 8 * 8)),
    "jump": (lambda m: edge(lambda t: not np.ptp(
        depth.texture_depth_bounds(1 + LOW * np.float32(t), m).ranges[0][:, :, 1])),
             dict(operation=64)),
    "outlier": (lambda m: edge(lambda t: depth.outlier_limit(1 + LOW * np.float32(t), replace(m, centre=1.0)) == 0),
              dict(operation=64)),
    "position of a texel": (lambda m: edge(lambda t: fits(m, u=0.5 + t)),
                            dict(operation=10.25, quotient=0.5, centre=1)),
    "position of a depth": (lambda m: edge(lambda t: fits(m, z=0.5 + t)), dict(operation=8.5)),
    "outliers": (lambda m: depth.outlier_limit(np.float32([[1, 9]] * 2000), replace(m, centre=2.0**-8)),
                 dict(without=70)),
    "visibility": (lambda m: half(stored.TextureFormat("float", True).ends(QUARTER, QUARTER, m))[0],
                   dict(quotient=0.75)),
    "codes": (lambda m: half(stored.TextureFormat("unorm8").ends(4 * QUARTER, 4 * QUARTER, m))[0],
              dict(without=2.0**-18)),
}  # fmt: skip


@np.errstate(invalid="ignore")
def assert_counted(case, nothing, errors, unit):
    """A step holds as many errors of each kind as are counted, and what is said of it without any."""
    step, right = case
    without = step(nothing)
    found = {kind: (step(error) - without) / unit for kind, error in errors.items()}
    found = {"without": without, "flushed": without / FLUSHED} | found
    for kind in {*errors, *right}:  # ends of intervals are float32 numbers
        loose = {"rtol": 2e-3, "atol": 1e-2} if kind in errors else {"rtol": 0.05}
        np.testing.assert_allclose(found[kind], right.get(kind, 0), **loose, err_msg=kind)


@pytest.mark.parametrize(("size", "unit", "holds"), [
    (2.0**24, 1.0, True), (2.0**24, 0.5, False), (1.5 * 2.0**24, 1.0, False), (1.5 * 2.0**24, 2.0, True),
    (2.0**-126, 2.0**-126, True), (2.0**-126, 2.0**-127, False),
])  # fmt: skip
def test_24_bits_hold_sums_of_multiples(size, unit, holds):
    assert point_bounds.fits(size, unit) == holds


@pytest.mark.parametrize("name", PASSES)
def test_passes_hold_the_errors_that_are_counted(name):
    nothing = NOTHING
    unit = 2.0**-16
    kinds = {kind: replace(nothing, **{kind: unit}) for kind in ("operation", "quotient", "root", "centre", "smallest")}
    kinds["constant"], kinds["slope"] = (replace(nothing, exponential=pair) for pair in ((unit, 0.0), (0.0, unit)))
    assert_counted(PASSES[name], nothing, kinds, unit)


def test_terms_of_second_order_are_there():
    """Errors of one sixteenth, at which products of two of them count: by powers of 1 + r, as renderers round."""
    r = 2.0**-4
    n = 20
    coarse = replace(NOTHING, operation=r)
    assert sao.sum_error(n, coarse) >= (1 + r) ** (n + 3) - 1
    white = np.ones((1, 1, 3), "f4")
    assert width(post.shade_bounds(white, exact_bounds(0 * FLAT[:1, :1]), coarse)) >= (1 + r) ** 2 - 1
    assert width(post.shade_bounds(white, exact_bounds(2 * FLAT[:1, :1]), coarse)) >= r
