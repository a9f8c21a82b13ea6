"""Each error term of the bounds, one by one: how many errors of a kind a step allows.

Many are too small beside others for any renderer to show that one is missing. So all kinds of errors but one are left
out here, and what is left of an interval's half width, or of the room at a decision, is counted in units of that one.
The numbers are the program's own, held so that no term is lost; ``test_sound`` and the estimators' tests of random
renderers say that they are enough. Kernels run uncompiled: to compile each step would take longer than all of them do.
"""

import itertools
import sys
from dataclasses import replace
from types import SimpleNamespace as Given

import numba
import numpy as np
import pytest

import lfssao.verify.bounds
from lfssao import Camera, WorldToImage
from lfssao.verify.bounds import depth, points, post, sao, stored
from lfssao.verify.bounds.bounds import exactly
from lfssao.verify.bounds.error_model import ErrorModel

with pytest.MonkeyPatch.context() as patch:
    patch.setattr(numba.config, "DISABLE_JIT", 1)
    patch.setattr(lfssao.verify.bounds, "kernels", None)
    for name in [name for name in sys.modules if name.startswith("lfssao.verify.bounds.kernels")]:
        patch.delitem(sys.modules, name)
    from lfssao.verify.bounds.kernels import (
        ball_bounds,
        disk_bounds,
        pairs,
        point_bounds,
        projection_bounds,
        sao_bounds,
        seen,
    )
    from lfssao.verify.bounds.kernels.pairs import FLUSHED, Errors, Pair, exact, triple

X, Y, Z, NOWHERE, ONES = (triple(v) for v in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0), (1, 1, 1)))
ULP, UNIT, STILL, QUARTER = 2.0**-23, 2.0**-30, np.array([[[1.0] * 2], [[0.0] * 2]]), np.float32([0.25])
# Two texels whose positions land on (x, y); the second's is off the first's by (0.3, 0, -0.4), and nearer to viewers.
SEEN = seen.Seen(
    depth=np.float32([[1, 1]]), positions=np.array([[[0.5, 0.5, 0], [0.8, 0.5, -0.4]]]), turns=np.empty((2, 0, 0)),
    back=np.empty(0), kind=0, numbers=np.array([1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0.5, 1.5, -0.5, 0, 0]), radius=1.0,
    normals=np.array([[[0.0, 0, -1]] * 2]), directions=np.array([[[0.0, 0, 1]] * 2]), axis=np.float64([0, 0, 1, 0]),
    right=np.array([1, 0, 0]), low=np.array([[0, -0.5]]), high=np.array([[0, -0.5]]),
)  # fmt: skip
ODD = SEEN._replace(positions=np.array([[[1.0, 2, 3]]]), directions=np.array([[[1.0, 2, 3]]]), radius=2.0,
                    axis=np.array([1, -1, 1, 0]), turns=np.array([[[1.0]], [[2.0]]]))  # fmt: skip
SAMPLE = Given(offsets=[(1.0, 2.0, 3.0)])


def edge(holds):
    """Up to which number a decision holds."""
    low, high = 0.0, 2.0**-3
    for _ in range(42):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def room(decide):
    """How far around 0 a decision (may, must) is open, on average; it grows with its number."""
    return (edge(lambda t: decide(-t)[0]) + edge(lambda t: not decide(t)[1])) / 2


def half(ends):
    return (ends[1] - ends[0]) / 2


def row(place, by):
    return projection_bounds.row_of(np.array([2.0, 3.0, 5.0, 7.0]), 0, place, by.operation).error


def disk_row(by):
    offset = disk_bounds.offset_of(SEEN, 1.0, 2.0, (1.0, 1.0), (X, Y), 0, 0, by.angle, by)
    return row(disk_bounds.place_of(ONES, 4.0, offset), by)


def ball_rows(by):
    """Rows of a point above the tangent plane, and of one that is lifted over it."""
    ball = Given(offsets=np.array([[1.0, 2, 3]]), mirrors=np.array([[[1]], [[0]], [[0]]]), tangent=True)
    still = ODD._replace(turns=np.empty((2, 0, 0)))
    shown = [still._replace(normals=side * ODD.positions) for side in (1, -1)]
    return sum(row(ball_bounds.ball_place(each, ball, 0, 0, 0, by), by) for each in shown)


def turning(by, x):
    offset = Pair(1.0, by.root), Pair(-1.0 - x, by.root), Pair(0.0, by.root)
    return projection_bounds.Place(ONES, offset, (3, 4, 5), 3)


def hides(by, z, low=0.0):
    """Whether a surface there, 2 thick, hides a point of cast depth z."""
    shown = SEEN._replace(low=np.array([[low]]), high=np.array([[low]]))
    box = seen.Box(1.0, 0.0, True, 1, 1, 0, 0)
    return ball_bounds.is_hidden(shown, Pair(z, by.root), box, Pair(2.0, by.quotient), by)


def step(by, far):
    """Ends of the rise by a surface at a part of the radius, and of the horizon behind it."""
    fan, v = Given(linear=0.5, quadratic=0.5), triple((0.3, 0.4, 0))
    return disk_bounds.step_of(fan, 0.5 / far, v, triple((0, -0.5, 0)), 0.0, 0.0, by)


def summed(kernel, shown, *given, by):
    """The least and largest sum of the first texel, and the number in doubt."""
    sums = np.zeros((3, 1, 2))
    kernel(shown, *given, by, sums)
    return sums[:, 0, 0]


def rises(by, x=1.0):
    fan = Given(around=np.array([[x, 0]]), mirrors=STILL, steps=1, sine_bias=0, cosine_bias=1, linear=0, quadratic=0)
    return summed(disk_bounds.sum_rises, SEEN, fan, by=by)


def lengths(by):
    disk = Given(places=np.array([[1.0, 0]]), half=np.ones(1), weights=[2 * FLUSHED], mirrors=STILL, tangent=False)
    return summed(disk_bounds.sum_lengths, SEEN, disk, np.inf, by=by)


def taps(by, shown=SEEN, x=1.5, **changes):
    """SAO's terms; by their z, 0 and -1/2, a camera sees the texels at (1/2, 1/2) and (3/2, 1/2)."""
    lines, z = np.array([0, 0, 1, 0, 0, 0, 0, 1, 0, 0.0]), np.array([0, -0.5, -0.5])
    rays, tap = (0, lines, None, np.eye(3, 4).ravel(), -1.0), np.array([[x, 0.5, 1]])
    given = sao_bounds.Pass(*rays, z, z, np.array([0, 2]), 0, tap, 1.0, 1.0, 0.5, 0.0, 0.0, 0.125, 0.75)
    return summed(sao_bounds.sum_taps, shown, given._replace(**changes), None, by=by)


def depths(by):
    low, high = np.empty((2, 1, 2))
    shown = SEEN._replace(kind=1, numbers=np.eye(4).ravel(), axis=np.array([1, 0, 0, 0]))
    seen.write_depths(shown, seen.CAST, np.inf, by, low, high)
    return half((low[0, 0], high[0, 0]))


TEXELS = list(itertools.product(range(3), range(3)))


@pytest.mark.parametrize("texel", TEXELS)
def test_a_normal_is_that_of_the_pair_also_at_the_borders(texel):
    """Along a row of three z falls by a half within the pair and by 1 to the last texel; columns have other steps."""
    row, column = np.indices((3, 3))
    z = -np.array([0, 0.5, 1.5])[column] + np.array([0, 0.25, 1])[row]
    places = np.stack([column, row, z], axis=-1).astype(float)
    shown = SEEN._replace(depth=np.ones((3, 3), "f4"), positions=places, normals=seen.NOTHING)
    lines = np.array([0, 0, 1, 0, 0, 0, 0, 1, 0, 0.0])
    given = sao_bounds.Pass(0, lines, None, np.eye(3, 4).ravel(), -1.0, z.ravel(), z.ravel(), np.array([0]), *[0] * 9)
    normal, sure = sao_bounds.normal_of(shown, given, *texel, triple(places[texel]), Errors(*[UNIT] * 6))
    slope = np.array([-1.0 if texel[1] == 2 else -0.5, 0.75 if texel[0] == 2 else 0.25, -1])
    assert [part.value for part in normal] == pytest.approx((slope / np.linalg.norm(slope)).tolist(), abs=1e-12)
    assert sure


@pytest.mark.parametrize("texel", TEXELS)
def test_a_radius_is_counted_in_steps_to_the_next_texel_or_at_the_border_to_the_one_before(texel):
    """Rays of a table, along z; their columns lie at 0, 1 and 3, their rows at 0, 1/2 and 2."""
    row, column = texel
    x, y = np.meshgrid([0.0, 1, 3], [0, 0.5, 2])
    table = np.stack([x, np.zeros((3, 3)), y, np.zeros((3, 3))]).reshape(4, 9)
    given = sao_bounds.Pass(1, None, table, np.eye(3, 4).ravel(), *[None] * 6, 6.0, 3.0, *[None] * 5)
    across, down = sao_bounds.reaches_of(given, (3, 3), *texel, exact(0.0), Errors(*[UNIT] * 6))
    assert (across.value, down.value) == pytest.approx(((6, 3, 3)[column], (6, 2, 2)[row]), rel=1e-12)


# By step: how many errors of each kind it holds, in ``all`` that SAFETY multiplies, in flushed numbers, and with none.
KERNELS = {
    "row of a disk": (disk_row, dict(operation=3482, angle=120, flushed=584)),
    "rows of a ball": (ball_rows, dict(operation=1704 + 39976, flushed=2 * 74)),
    "row of a sample": (lambda by: row(point_bounds.sample_place(ODD, SAMPLE, ONES, 0, 0, 0, by), by),
                        dict(operation=540, offset=37)),
    "side": (lambda by: room(lambda x: point_bounds.is_below(turning(by, x), ONES, by)),
             dict(operation=42, root=3, all=45)),
    "range": (lambda by: room(lambda x: point_bounds.in_range(NOWHERE, triple((2 - x, 0, 0)), 2.0, by)),
              dict(operation=6, root=2, without=ULP)),
    "reach": (lambda by: ball_bounds.reach_of(ODD, 5.0, 0, 0, by).error,
              dict(operation=240, quotient=30, flushed=6, all=270)),
    "hidden": (lambda by: room(lambda x: hides(by, 1 + x, 1.0)) + room(lambda x: hides(by, 3 - x, 1.0)),
               dict(operation=2, quotient=1, root=2)),
    "hidden, flushed": (lambda by: int(hides(by, 2.0**-125)[1]), dict(without=0)),
    "other side": (lambda by: sum(part.error for part in point_bounds.on_side(turning(by, 0.0), -1.0).offset),
                   dict(root=3)),
    "way": (lambda by: sum(part.error for part in disk_bounds.way_of(SEEN, 0, 0)), dict(without=24 * ULP)),
    "deep": (lambda by: disk_bounds.deep_of(ODD, ONES, by)[0].error, dict(operation=22)),
    "plane": (lambda by: disk_bounds.plane_of(Z, (*NOWHERE[:2], Pair(-2.0, by.root)), triple((1, 2, 3)), by).error,
              dict(operation=9, quotient=1.5, root=0.75, all=5.25)),
    "length": (lambda by: half(disk_bounds.length_of(np.inf, 4.0, (5.0, 5.0), Pair(2.0, by.root), by)),
               dict(operation=6, root=1, all=1)),
    "length behind": (lambda by: half(disk_bounds.length_of(5.0, 9.0, (9.0, 9.0), Pair(2.0, by.root), by)),
                      dict(operation=27, quotient=5, root=2, all=24)),
    "no length": (lambda by: disk_bounds.length_of(np.inf, 4.0, (FLUSHED,) * 2, exact(0.0), by)[1], dict(flushed=2)),
    "sum of lengths": (lambda by: sum(lengths(by)), dict(flushed=8)),
    "infinite": (lambda by: disk_bounds.term_of(X, X, exact(0.0), Pair(0.8 * 2.0**126, 2.0**124), False, by)[0],
                 dict(without=0)),
    "no bound": (lambda by: disk_bounds.term_of(X, X, exact(0.0), Pair(-0.5, 1.0), False, by)[0], dict(without=0)),
    "rise and horizon": (lambda by: half(step(by, 0.5)[:2]) + half(step(by, 0.5)[2:]),
                         dict(operation=4.825 + 1.8, quotient=0.45 + 0.4, root=0.45 + 0.4, all=3.125 + 2.6)),
    "far": (lambda by: edge(lambda t: step(by, 1 - t)[0] == 0) + edge(lambda t: step(by, 1 + t)[1] > 0),
            dict(operation=8.167 + 5.5, quotient=2, root=2, all=15)),
    "rise from a plane": (lambda by: half(rises(by)), dict(operation=19.6, quotient=8.8, root=8.8)),
    "rise at the eye": (lambda by: disk_bounds.step_of(None, 1.0, NOWHERE, Z, 0.0, 0.0, by)[1], dict(without=1)),
    "end of a step": (lambda by: edge(lambda t: rises(by, 1.5 - t)[2] == 1),
                      dict(operation=104.75, quotient=5, root=1.5, coordinate=2, angle=1.5)),
    "line": (lambda by: sum(part.error for part in sao_bounds.line_of(np.arange(1.0, 6), 0, 2.5, by)),
             dict(operation=204)),
    "SAO's term": (lambda by: half(taps(by, SEEN._replace(positions=seen.NOTHING))),
                   dict(operation=21.709, quotient=0.7266)),
    "SAO's tap": (lambda by: edge(lambda t: taps(by, SEEN._replace(turns=STILL), 2 - t)[2] == 1),
                  dict(operation=17, quotient=4, coordinate=1, angle=3, all=24)),
    "SAO's level": (lambda by: edge(lambda t: taps(by, x=0.75, reach_u=2 - t)[2] == 1),
                    dict(operation=10, quotient=4, all=14)),
    "SAO's whole offset": (lambda by: edge(lambda t: sao_bounds.tap_coordinate(0, Pair(2 + t, by.root), 0, by)[1] > 0),
                           dict(operation=1, root=1, all=1)),
    "depth": (depths, dict(operation=1, all=1)),
}  # fmt: skip


def width(bounds):
    return np.ravel(half((bounds.lower.astype(float), bounds.upper)))[0]


def linear_z(model, projection):
    camera = Camera(projection, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1.0, 20.0).view(1, 1)
    return half(sao._linear_z(Given(seen=Given(depth=np.float32([[0.5]]), view=camera), model=model)))[0, 0]


def averaged(model, x):
    """Whether a texel of light 1 may be, and is for sure, averaged with one of light 0 that is 1 - x deeper."""
    light, z = np.array([[1.0, 0]]), np.array([[0, 1 - x]])
    low, high = sao._averaged((light, light), (z, z), 1.0, model)
    return low[0, 0] < 0.9, high[0, 0] < 0.9


def code(model, light, key=0.25):
    return sao._stored((np.array(light),) * 2, (np.array(key),) * 2, model)


def blurred(model):
    """A texel of light 1 beside one of light 0 that weighs half as much, by the distance of their keys."""
    light, keys, weights = np.array([[1.0, 1, 1, 0]]), np.array([[0.0, 0, 0, 0.05]]), np.array([0, 0, 0, 1.0, 1, 0, 0])
    options = Given(packed=False, sharpness=10.0)
    return half(sao._reconstructed((light, light), (keys, keys), weights, options, model))[0, 0]


def fits(model, u=0.5, z=0.5):
    """Whether a position that lands on (u, 1/2) and image z 1/2 may be that of a texel of depth z."""
    of = depth.PositionBounds(WorldToImage(0, SEEN.numbers), np.float32([[z]]), model)
    return not of.outside(np.float32([[[u, 0.5, 0]]])).any()


def by_mesh(model, judge):
    """Depth or colour of a triangle of z = 1/4 and of colour 1/2; it is 9 wide."""
    made = Given(triangle=np.zeros((1, 1), np.int32), color=np.full((1, 1, 3), 0.5))
    mesh = Given(vertices=np.array([[-9.0, -9, 0.25], [9, -9, 0.25], [0, 9, 0.25]]), faces=np.array([[0, 1, 2]]))
    view = Camera("orthographic", (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1.0, 20.0).view(1, 1)
    caster = Given(mesh=mesh, gbuffer=lambda *_, **__: made)
    return width(judge(caster, replace(view, cast_from_world=np.eye(3, 4)), model=model))


NOTHING = ErrorModel("", "", False, 0.0, 0.0, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, 0.0)
EVEN, FLAT, RAMP = (np.full((2, 2), 0.5),) * 2, np.full((2, 2), 0.5, "f4"), np.arange(1, 6, dtype="f4")
CLIFF, LOW = np.float32([[1, 1, 9, 9]]), np.array([[0, 0, 1, 1]], "f4")
TIE, TWO_RADII = 10.5 / 65280, {"second": 0.5, "combine": "product"}
PASSES = {
    "blur": (lambda m: width(post.blur_bounds(exactly(2 * FLAT), 1.0, m)),
             dict(operation=39.97, quotient=5.98, constant=4, slope=1.99, smallest=48)),
    "shading": (lambda m: width(post.shade_bounds(np.ones((1, 1, 3), "f4"), exactly(QUARTER[None]), m)),
                dict(operation=1.75, smallest=4)),
    "light": (lambda m: half(sao.left_of(EVEN, 0.5, 5, m))[0, 0], dict(operation=2.75, quotient=0.25)),
    "power": (lambda m: sao._raised(np.array([0.25]), 2.0, 1, m)[0] - 0.0625,
              dict(constant=0.0625, slope=0.25, without=1.75 * ULP)),
    "power of more than 1": (lambda m: sao._raised(np.array([1 + 2.0**-10]), 2.0, 1, m)[0] - 1,
                             dict(constant=1, without=2.0**-8)),
    "lacking": (lambda m: width(sao.lacking((EVEN[0] / 4,) * 2, 1.0, None, m)), dict(operation=0.875)),
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
    "remap": (lambda m: sum(sign * points._remapped(np.float32([0.75]), m, sign)[0] for sign in (-1, 1)),
              dict(operation=1)),
    "two radii": (lambda m: width(points._hidden_volume(Given(options=TWO_RADII, model=m), 1.0, tangent=False,
                                                        at=lambda *_: exactly(FLAT))), dict(operation=4)),
    "sum": (lambda m: width(points._summed(Given(sums=lambda *_: (EVEN, None), points=range(5), model=m), None)),
            dict(operation=4, quotient=0.5)),
    "depth by the mesh": (lambda m: by_mesh(m, depth.depth_bounds), dict(operation=16 * 9 * 3 / 19)),
    "colour by the mesh": (lambda m: by_mesh(m, depth.color_bounds), dict(operation=8)),
    "depth": (lambda m: width(depth.depth_bounds_of(RAMP[None], m)), dict(operation=80, centre=8)),
    "colour": (lambda m: width(depth.color_bounds_of(np.repeat(RAMP, 3).reshape(1, 5, 3), None, m)),
               dict(operation=32, centre=8)),
    "depths over a jump": (lambda m: np.diff(depth.depth_bounds_of(CLIFF, m).ranges, axis=0)[0, :, 0, 1].sum() / 2,
                           dict(operation=9 * 16 * 9, centre=9 * 8 * 8)),
    "jump": (lambda m: edge(lambda t: not np.ptp(depth.depth_bounds_of(1 + LOW * np.float32(t), m).ranges[0][:, :, 1])),
             dict(operation=64)),
    "stray": (lambda m: edge(lambda t: depth.stray_limit(1 + LOW * np.float32(t), replace(m, centre=1.0)) == 0),
              dict(operation=64)),
    "position of a texel": (lambda m: edge(lambda t: fits(m, u=0.5 + t)),
                            dict(operation=10.25, quotient=0.5, centre=1)),
    "position of a depth": (lambda m: edge(lambda t: fits(m, z=0.5 + t)), dict(operation=8.5)),
    "strays": (lambda m: depth.stray_limit(np.float32([[1, 9]] * 2000), replace(m, centre=2.0**-8)), dict(without=70)),
    "visibility": (lambda m: half(stored.Stored("float", True).ends(QUARTER, QUARTER, m))[0], dict(quotient=0.75)),
    "codes": (lambda m: half(stored.Stored("unorm8").ends(4 * QUARTER, 4 * QUARTER, m))[0], dict(without=2.0**-18)),
}  # fmt: skip


@np.errstate(invalid="ignore")
def assert_counted(case, nothing, errors, unit, also=lambda step: {}):
    """A step holds as many errors of each kind as are counted, and what is said of it without any."""
    step, right = case
    without = step(nothing)
    found = {kind: (step(error) - without) / unit for kind, error in errors.items()} | also(step)
    found = {"without": without, "flushed": without / FLUSHED, "all": 0} | found
    for kind in {*errors, *right}:  # ends of intervals are float32 numbers
        loose = {"rtol": 2e-3, "atol": 1e-2} if kind in errors else {"rtol": 0.05}
        np.testing.assert_allclose(found[kind], right.get(kind, 0), **loose, err_msg=kind)


@pytest.mark.parametrize("name", KERNELS)
def test_steps_of_kernels_hold_the_errors_that_are_counted(name, monkeypatch):
    nothing, everything = Errors(*[0.0] * 6), Errors(*[UNIT] * 6)

    def safe(step):
        once = step(everything)
        for module in (ball_bounds, disk_bounds, pairs, point_bounds, projection_bounds, sao_bounds, seen):
            monkeypatch.setattr(module, "SAFETY", 2.0, raising=False)
        return {"all": (step(everything) - once) / UNIT}

    kinds = {kind: nothing._replace(**{kind: UNIT}) for kind in Errors._fields}
    assert_counted(KERNELS[name], nothing, kinds, UNIT, safe)


@pytest.mark.parametrize(("size", "unit", "holds"), [
    (2.0**24, 1.0, True), (2.0**24, 0.5, False), (1.5 * 2.0**24, 1.0, False), (1.5 * 2.0**24, 2.0, True),
    (2.0**-126, 2.0**-126, True), (2.0**-126, 2.0**-127, False),
])  # fmt: skip
def test_24_bits_hold_sums_of_multiples(size, unit, holds):
    assert point_bounds.fits(size, unit) == holds


@pytest.mark.parametrize("name", PASSES)
def test_passes_hold_the_errors_that_are_counted(name):
    nothing, unit = NOTHING, 2.0**-16
    kinds = {kind: replace(nothing, **{kind: unit}) for kind in ("operation", "quotient", "root", "centre", "smallest")}
    kinds["constant"], kinds["slope"] = (replace(nothing, exponential=pair) for pair in ((unit, 0.0), (0.0, unit)))
    assert_counted(PASSES[name], nothing, kinds, unit)


def test_terms_of_second_order_are_there():
    """Errors of one sixteenth, at which products of two of them count: by powers of 1 + r, as renderers round."""
    r, n = 2.0**-4, 20
    coarse = replace(NOTHING, operation=r)
    assert pairs.dot(ONES, ONES, Errors(r, *[0.0] * 5)).error >= 3 * ((1 + r) ** 3 - 1)
    assert sao.growth(n, coarse) >= (1 + r) ** (n + 3) - 1
    white = np.ones((1, 1, 3), "f4")
    assert width(post.shade_bounds(white, exactly(0 * FLAT[:1, :1]), coarse)) >= (1 + r) ** 2 - 1
    assert width(post.shade_bounds(white, exactly(2 * FLAT[:1, :1]), coarse)) >= r
