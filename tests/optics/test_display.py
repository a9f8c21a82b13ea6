"""Displays of all kinds: the reference, round trips, limits, singular surfaces, refusals, presets."""

import math
from dataclasses import replace

import numba
import numpy as np
import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st
from reference import mapping as reference
from reference import textbook
from reference.passes import algorithm2

from lfssao import Display, Mesh, Module, RayCaster, WorldToImage, display_names, find_display, make_samples
from lfssao.ao import ssao
from lfssao.errors import InputError
from lfssao.optics.kernels import display as kernels
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.lens import fold_radius

VALID, BEHIND_MODULE, BEHIND_OBSERVER, MISSES_SCREEN, FOLDED, OUTSIDE = range(6)
PRESETS = {name: find_display(name) for name in display_names()}
presets = pytest.mark.parametrize("display", PRESETS.values(), ids=PRESETS)
both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
ROI = ((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05))
unit = st.floats(-1, 1)


def bits(values):
    values = np.asarray(values)
    return values.view(np.int32 if values.dtype == np.float32 else np.int64)


# Strategies


@st.composite
def modules(draw, kinds=("aligned", "projector", "homography"), distorted=True):
    x, y, z = draw(unit), draw(st.floats(-0.3, 0.3)), draw(st.floats(0.4, 1.5))
    width, height = draw(st.integers(100, 1000)), draw(st.integers(10, 100))
    kind = draw(st.sampled_from(kinds))
    extra = {}
    if kind != "aligned":
        facing = math.degrees(math.atan2(-x, z)), math.degrees(math.atan2(-y, z))
        a, b, c = draw(st.tuples(*[st.floats(-5, 5)] * 3))
        extra = {"yaw": facing[0] + a, "pitch": facing[1] + b, "roll": c, "field_of_view": draw(st.floats(20, 90))}
    if distorted and draw(st.booleans()):
        extra |= {"k1": draw(st.floats(-0.04, 0.1)), "k2": draw(st.floats(-0.005, 0.02))}
    module = Module(x, y, z, width, height, **extra)
    if kind == "homography":
        one = Display("one", 1.0, 1.0, 0.0, -2.0, (module,), ROI)
        h = one.module_numbers(0)[8:17] * draw(st.sampled_from([-3.0, 0.01, 1.0]))  # only ratios matter
        module = Module(x, y, z, width, height, homography=tuple(h.tolist()), k1=module.k1, k2=module.k2)
    return module


@st.composite
def displays(draw, screens=("flat", "convex", "concave", "conical"), arcs=(0.0, 1.0), module=None):
    """A display of one module: flat with either diffuser, or curved; the observers on a line or an arc."""
    screen = draw(st.sampled_from(screens))
    width, height = draw(st.floats(0.5, 1.6)), draw(st.floats(0.3, 1.0))
    z_o, y_o = draw(st.floats(-3, -1)), draw(st.floats(-0.5, 0.5))
    radius = width * draw(st.floats(0.75, 5))
    curvature = {"convex": 1 / radius, "concave": -1 / radius}.get(screen, 0.0)
    share = 0.0 if screen == "conical" else draw(st.one_of(st.just(arcs[0]), st.floats(-0.2, arcs[1])))
    made = draw(modules() if module is None else module)
    try:
        return Display(
            "drawn", width, height, y_o, z_o, (made,), ROI, "conical" if screen == "conical" else "linear", curvature,
            -share / z_o if arcs[1] else 0.0,
        )  # fmt: skip
    except InputError as error:  # the lens passes the observers' arc by: rare
        assume("does not reach" not in str(error) and "behind the observers" not in str(error))
        raise


def numbers_of_any_kind(draw, dtype):
    """A module's 32 numbers: of a drawn display, or from a pool with ties, edges and extreme values."""
    if draw(st.booleans()):
        return draw(displays()).module_numbers(0).astype(dtype)
    width = 32 if dtype == np.float32 else 64
    lattice = st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, -2.0, 0.5, 3.0])
    wild = st.floats(width=width)
    pool = draw(st.sampled_from([lattice, st.one_of(lattice, st.floats(-8, 8, width=width), wild)]))
    d = np.array(draw(st.lists(pool, min_size=32, max_size=32)), dtype)
    if draw(st.booleans()):  # so that most get as far as the optics
        d[2], d[4], d[14:17] = abs(d[2]) + 1, -abs(d[4]) - 1, (0, 0, 1)
    return d


def named(display, index=0):
    return kernels.display_module(display.module_numbers(index))


def coordinates(dtype):
    width = 32 if dtype == np.float32 else 64
    special = st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, -2.0])
    return st.tuples(*[st.one_of(st.floats(-2, 2, width=width), special, st.floats(width=width))] * 3)


# The reference


@pytest.mark.slow
@both
@settings(max_examples=500)
@given(data=st.data())
def test_physical_to_image_equals_the_reference(dtype, data):
    d = numbers_of_any_kind(data.draw, dtype)
    for point in data.draw(st.lists(coordinates(dtype), min_size=1, max_size=6)):
        x, y, z = np.array(point, dtype)
        with np.errstate(all="ignore"):
            actual = kernels.physical_to_image(kernels.display_module.py_func(d), x, y, z)
            want = reference.physical_to_image(d, x, y, z)
        assert actual[2] == want[2]
        for a, b in zip(actual[:2], want[:2], strict=True):
            assert type(b) is dtype
            assert (math.isnan(a) and math.isnan(b)) or bits(dtype(a)) == bits(b)


def optics_of(d):
    return (tuple(d[:3]), tuple(d[3:5]), tuple(d[5:7]), bool(d[7]), tuple(d[8:17]), tuple(d[17:22]))


@settings(max_examples=150)
@given(display=displays(), data=st.data())
def test_physical_to_image_is_the_textbook_formula(display, data):
    """1e-9 texel, or that share of coordinates far outside the texture; z from 0.9 z_o to 0.9 m_z."""
    d = display.module_numbers(0)
    lens_z, size = d[2], display.modules[0].width
    assume(((np.abs(d[5:7]) > 0.01) | (d[5:7] == 0)).all())  # circles larger than that cost the oracle's formula digits
    points = data.draw(st.lists(st.tuples(unit, unit, st.floats(0.9 * d[4], 0.9 * lens_z)), min_size=1, max_size=8))
    image, answers = display.physical_to_image(0, points)
    for point, (u, v, depth), answer in zip(points, image.tolist(), answers.tolist(), strict=True):
        if answer not in (VALID, OUTSIDE) or abs(u) + abs(v) > 20 * size:
            continue
        want = textbook.image(*optics_of(d.tolist()), point)
        np.testing.assert_allclose([u, v], want, rtol=1e-11, atol=1e-9)
        assert depth == point[2]


def test_the_textbook_module_on_the_observer_line_is_a_pinhole():
    """The oracle's own check: m_z = z_o and m_y = y_o project centrally from there."""
    lens, point = (0.3, 0.1, -2.0), (0.5, 0.4, -0.7)
    s = textbook.screen(lens, lens[1:], (0, 0), False, point)
    t = 2.0 / 1.3
    np.testing.assert_allclose(s, [0.3 + t * 0.2, 0.1 + t * 0.3, 0], rtol=0, atol=1e-15)


@both
@settings(max_examples=60)
@given(data=st.data())
def test_algorithm2_of_any_display_equals_the_reference(dtype, data):
    display = data.draw(displays())
    height, width = data.draw(st.sampled_from([(1, 1), (9, 13), (17, 3), (2, 40)]))
    try:
        display = display.with_resolution(width, height)
    except InputError:  # in a texture of another shape its distortion would fold
        reject()
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    world = np.hstack([np.diag([0.5, 0.4, -0.6]), rng.uniform(-0.05, 0.05, (3, 1))])
    depth, positions = textures(display, rng, world)
    depth, positions = depth.astype(dtype), positions.astype(dtype)
    numbers = np.concatenate([world.ravel(), display.module_numbers(0)])
    samples, radius = make_samples("random", 7, 3), data.draw(st.sampled_from([0.02, 0.5, 10.0]))
    actual = ssao.algorithm2(depth, positions, WorldToImage(mapping.DISPLAY, numbers), samples, radius)
    offsets = (radius * samples).astype(dtype)
    occlusion, answers = algorithm2(depth, positions, offsets, "display", numbers.astype(dtype))
    np.testing.assert_array_equal(bits(actual.texture), bits(occlusion))
    assert actual.outside == answers[:, 1:].sum()
    assert not np.isnan(actual.texture).any()


def textures(display, rng, world):
    """A wavy surface through the screen seen by module 0: depth, and world positions; a tenth of it is missing."""
    m = display.modules[0]
    j, i = np.mgrid[: m.height, : m.width]
    origin, direction, span = display.texel_ray(0, i + 0.5, j + 0.5)
    z = 0.06 * np.sin(9.0 * i / m.width) * np.cos(7.0 * j / m.height) + rng.uniform(-0.02, 0.02, i.shape)
    there = (span[..., 0] < z) & (z < span[..., 1]) & (rng.random(i.shape) < 0.9)
    physical = origin + direction * z[..., None]
    positions = np.linalg.solve(world[:, :3], (physical - world[:, 3]).reshape(-1, 3).T).T.reshape(physical.shape)
    return np.where(there, z, np.inf), np.where(there[..., None], positions, np.inf)


# Round trips

ENDS = (1e-3, 2e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.998, 0.999)  # shares of the span between singular planes


def round_trip_error(display, index, u, v, shares=ENDS):
    """Largest distance, in texels, of the images of points of texels' rays from the texels; how many have a ray."""
    origin, direction, span = display.texel_ray(index, u, v)
    there = span[:, 0] < span[:, 1]
    worst = 0.0
    for share in shares:
        z = span[there, :1] + share * (span[there, 1:] - span[there, :1])
        image, answers = display.physical_to_image(index, origin[there] + z * direction[there])
        inside = (u >= 0) & (u <= display.modules[index].width) & (v >= 0) & (v <= display.modules[index].height)
        assert np.isin(answers[inside[there]], (VALID, OUTSIDE)).all()  # at a texture's very edge rounding decides
        error = np.abs(image[:, :2] - np.stack([u, v], axis=-1)[there])
        worst = max(worst, float(error.max(initial=0.0)))
    return worst, int(there.sum())


@presets
def test_points_of_a_presets_rays_land_on_their_texels(display):
    """Every module; texels at the corners, the middle and anywhere; to 1e-3 of the span from both its ends."""
    rng = np.random.default_rng(32)
    for index, m in enumerate(display.modules):
        u = np.array([0.5, m.width - 0.5, 0.5, m.width - 0.5, m.width / 2, *(rng.integers(0, m.width, 20) + 0.5)])
        v = np.array([0.5, 0.5, m.height - 0.5, m.height - 0.5, m.height / 2, *(rng.integers(0, m.height, 20) + 0.5)])
        # The outer texels of picoarray's outer modules light no part of the screen; some pass the observers before it.
        s_x, s_y = (np.array(matrix) for matrix in kernels.apply_homography(named(display, index).inverse, u, v)[:2])
        on_screen = (np.abs(s_x) <= display.screen_width / 2 + 1e-9) & (np.abs(s_y) <= display.screen_height / 2 + 1e-9)
        assert on_screen.all() or display.name == "picoarray"
        worst, count = round_trip_error(display, index, u[on_screen], v[on_screen])
        assert count == on_screen.sum() >= 3
        assert worst < 1e-9
        assert round_trip_error(display, index, u, v)[0] < 1e-8


@settings(max_examples=200)
@given(display=displays(), seed=st.integers(0, 2**32))
def test_points_of_a_texels_ray_land_on_it(display, seed):
    m, rng = display.modules[0], np.random.default_rng(seed)
    u = np.array([0.5, m.width - 0.5, 0.5, m.width - 0.5, m.width / 2, *rng.uniform(0, m.width, 10)])
    v = np.array([0.5, 0.5, m.height - 0.5, m.height - 0.5, m.height / 2, *rng.uniform(0, m.height, 10)])
    worst, count = round_trip_error(display, 0, u, v)
    assert count >= 1
    if display.screen_curvature == display.observer_curvature == 0 and m.field_of_view is m.homography is None:
        assert count == len(u)
    assert worst < 1e-9


@settings(max_examples=150)
@given(display=displays(), points=st.lists(st.tuples(unit, unit, st.floats(-0.9, 0.9)), min_size=4, max_size=12))
def test_rays_of_images_go_through_their_points(display, points):
    """The other way round: what physical_to_image calls valid, texel_ray knows."""
    m = display.modules[0]
    points = np.array(points) * [0.8, 0.5, 1.0]
    points[:, 2] *= np.where(points[:, 2] > 0, m.z, -display.observer_z)
    image, answers = display.physical_to_image(0, points)
    keep = (answers == VALID) | (answers == OUTSIDE)
    keep &= (np.abs(np.nan_to_num(image[:, :2])) < 20 * m.width).all(axis=1)
    origin, direction, span = display.texel_ray(0, image[keep, 0], image[keep, 1])
    z = points[keep, 2:]
    assert ((span[:, :1] < z) & (z < span[:, 1:])).all()
    np.testing.assert_allclose(origin + z * direction, points[keep], rtol=0, atol=1e-8)


# Limits

FLAT = Display("flat", 1.0, 0.6, 0.1, -2.0, (Module(-0.8, 0.05, 0.7, 1000, 600, k1=0.02),), ROI)


@pytest.mark.parametrize("which", ["screen_curvature", "observer_curvature"])
@pytest.mark.parametrize("sign", [1, -1])
def test_growing_radii_lead_to_the_flat_display_at_the_rate_of_one_over_the_radius(which, sign):
    points = np.random.default_rng(33).uniform([-0.4, -0.25, -1.0], [0.4, 0.25, 0.4], (200, 3))
    want, answers = FLAT.physical_to_image(0, points)
    assert np.isin(answers, (VALID, OUTSIDE)).all()
    u, v = np.array([0.5, 300, 999.5]), np.array([0.5, 200, 599.5])
    flat_rays = np.hstack(FLAT.texel_ray(0, u, v))
    errors, ray_errors = [], []
    for radius in (1e3, 1e6, 1e9, 1e12):
        curved = replace(FLAT, **{which: sign / radius})
        errors.append(np.abs(curved.physical_to_image(0, points)[0] - want).max())
        ray_errors.append(np.abs(np.hstack(curved.texel_ray(0, u, v)) - flat_rays).max())
    for found, floor in ((errors, 1e-9), (ray_errors, 1e-11)):
        assert found[0] > 0
        assert found[0] / found[1] == pytest.approx(1e3, rel=0.02)
        assert found[1] / found[2] == pytest.approx(1e3, rel=0.02)
        assert found[3] < floor


# Textures


def some_mesh(seed=35, count=150, size=0.25, side=0.1):
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-size, size, (count, 1, 3))
    vertices = (middle + rng.uniform(-side, side, (count, 3, 3))).reshape(-1, 3)
    return Mesh(vertices, np.arange(3 * count).reshape(-1, 3))


WORLD = np.hstack([np.diag([1.0, 1.0, -1.0]), np.zeros((3, 1))])
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


@pytest.mark.parametrize("name", SHAPES)
def test_textures_hold_no_nan_even_of_a_mesh_that_reaches_behind_everything(name):
    """Triangles through the modules, the observers and beyond: what is seen lies on the texels' rays' spans."""
    display, mesh = SHAPES[name], some_mesh(36, 60, 2.0, 1.5)
    view = display.view(0, WORLD, guard=5)
    g = RayCaster(mesh, WORLD).gbuffer(view)
    assert not np.isnan(g.depth).any()
    assert not np.isnan(g.positions).any()
    seen = g.triangle >= 0
    assert 20 < seen.sum() < seen.size
    assert ((g.depth[seen] > display.observer_z) & (g.depth[seen] < display.modules[0].z)).all()
    ao = ssao.algorithm2(g.depth, g.positions, view.world_to_image, make_samples("random", 16, 1), 2.0)
    assert not np.isnan(ao.texture).any()
    assert 0 < ao.outside <= 16 * seen.sum()


# Singular surfaces: exactly there, just before, beyond


def answer_at(display, *point):
    image, answer = display.physical_to_image(0, point)
    assert np.isnan(image).all() == (int(answer) not in (VALID, OUTSIDE))
    return int(answer)


@given(display=displays(screens=("flat", "convex", "concave")), x=st.floats(-0.1, 0.1))
def test_behind_the_module_there_is_no_image(display, x):
    m_x, m_z = display.modules[0].x, display.modules[0].z
    for z in (m_z, np.nextafter(m_z, 9), 2 * m_z, math.inf, math.nan):
        assert answer_at(display, m_x + x, 0.0, z) == BEHIND_MODULE
    before = answer_at(display, m_x, 0.0, m_z * (1 - 1e-12))  # straight towards the viewers: in front of the lens
    assert before != BEHIND_MODULE


@given(display=displays(screens=("flat", "convex", "concave"), arcs=(0.0, 0.0)), x=st.floats(-0.4, 0.4))
def test_behind_the_observer_line_there_is_no_image(display, x):
    z_o, step = display.observer_z, 4 * np.spacing(display.modules[0].z - display.observer_z)
    for z in (z_o, z_o - step, 3 * z_o, -math.inf):
        assert answer_at(display, x, 0.1, z) in (BEHIND_OBSERVER, MISSES_SCREEN if z == -math.inf else BEHIND_OBSERVER)
    assert answer_at(display, x, display.observer_height, z_o + step) != BEHIND_OBSERVER


@pytest.mark.parametrize("angle", [-40.0, -5.0, 0.0, 20.0, 50.0])
def test_behind_the_observer_arc_there_is_no_image(angle):
    """The arc of radius 2 around the screen's middle; a lens on the same diameter."""
    s, c = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    module = Module(-0.6 * s, 0.0, 0.6 * c, 100, 100, yaw=angle, field_of_view=60.0)
    display = Display("arc", 1.0, 1.0, 0.0, -2.0, (module,), ROI, observer_curvature=0.5)
    for radius, want in ((1.0, VALID), (2 - 1e-12, VALID), (2 + 1e-12, BEHIND_OBSERVER), (3.0, BEHIND_OBSERVER)):
        assert answer_at(display, radius * s, 0.0, -radius * c) == want


def test_lines_that_pass_by_the_observers_arc_have_no_image():
    lens = Module(3.0, 0.0, 0.5, 100, 100, yaw=-80.5, field_of_view=20.0)  # outside the arc, looking through it
    display = Display("arc", 1.0, 1.0, 0.0, -2.0, (lens,), ROI, observer_curvature=0.5)
    assert answer_at(display, 2.0, 0.0, -2.5) == BEHIND_OBSERVER
    assert display.texel_ray(0, 50.0, 50.0)[2].tolist()[1] == 0.5


@pytest.mark.parametrize("s_y", [-0.3, 0.0, 0.1, 0.4])
def test_the_conical_diffusers_surface(s_y):
    """1 + kappa = 0 at z = -z_o h_m / h_e, before the lens for a screen point nearer to it than to the observers."""
    m = Module(0.2, 0.4, 0.5, 100, 100)
    display = Display("conical", 1.0, 1.0, -0.4, -1.0, (m,), ROI, "conical")
    z_s = math.hypot(s_y - 0.4, 0.5) / math.hypot(s_y + 0.4, 1.0)
    for share, want in ((0.5, {VALID, OUTSIDE}), (1 - 1e-12, {VALID, OUTSIDE}), (1 + 1e-12, {BEHIND_MODULE})):
        z = min(z_s, 0.5) * share
        y = -0.4 + (s_y + 0.4) * (z + 1.0)
        assert answer_at(display, 0.21, y, z) in want
    *_, near, far = kernels.display_ray(named(display), 60.0, 100 * (0.5 - s_y))
    assert (near, far) == (-1.0, pytest.approx(min(z_s, 0.5), abs=1e-14))


def test_lines_that_miss_or_graze_a_curved_screen():
    """A lens beside a concave screen; lines turned by 1e-9 and 1e-7 about the tangent."""
    radius, lens = 1.0, np.array([1.2, 0.3])
    display = Display("concave", 1.0, 0.6, 0.0, -3.0, (Module(*lens[:1], 0.0, lens[1], 100, 100),), ROI, "linear", -1.0)
    to_centre = np.array([0.0, -radius]) - lens
    distance = np.hypot(*to_centre)
    for turn in (1e-9, 1e-7, 1e-3, -1e-9, -1e-7, -1e-3):
        # The tangent point that is seen first from the right: the line turns clockwise to it from the centre.
        angle = math.atan2(to_centre[1], to_centre[0]) - math.asin(radius / distance) + turn
        x, z = lens + math.sqrt(distance**2 - radius**2) * np.array([math.cos(angle), math.sin(angle)])
        assert z < lens[1]
        answer = answer_at(display, x, 0.0, z)
        assert (answer == MISSES_SCREEN) == (turn < 0), turn
    assert answer_at(display, 2.5, 0.0, 0.2) == MISSES_SCREEN  # away from the screen


def test_a_screen_behind_the_observers_shows_nothing():
    """The line passes the observers' arc before it comes to the flat screen's plane."""
    display = PRESETS["picoarray"]
    image, answers = display.physical_to_image(35, [[0.8, 0.05, 0.3], [-0.8, 0.05, 0.2]])
    assert answers.tolist() == [MISSES_SCREEN, MISSES_SCREEN]
    assert np.isnan(image).all()


@pytest.mark.parametrize(("k1", "k2"), [(-0.03, 0.0), (0.0, -0.01), (-0.02, -0.003), (0.1, -0.02)])
def test_beyond_the_fold_there_is_no_image(k1, k2):
    m = Module(0.0, 0.0, 1.0, 100, 100, k1=k1, k2=k2)
    display = Display("folds", 2.0, 2.0, 0.0, -2.0, (m,), ROI)
    radii = np.linspace(0, 10, 1_000_001)
    value = radii * (1 + k1 * radii**2 + k2 * radii**4)
    fold = radii[np.argmax(np.diff(value) < 0)]  # by a scan, to 1e-5
    for angle in (0.0, 0.7, 2.0, 3.5):
        c, s = math.cos(angle), math.sin(angle)
        for share, want in ((0.9, OUTSIDE), (1 - 2e-5, OUTSIDE), (1 + 2e-5, FOLDED), (2.0, FOLDED)):
            assert answer_at(display, share * fold * c, share * fold * s, 0.0) == want
        top = value.max()
        for share, there in ((0.999, True), (1.001, False)):
            u, v = 50 + 50 * share * top * c, 50 - 50 * share * top * s
            _, _, (near, far) = display.texel_ray(0, u, v)
            assert (near < far) == there
    assert math.sqrt(named(display).fold) == pytest.approx(fold, rel=1e-5)


@settings(max_examples=200)
@given(st.floats(-0.1, 0.3), st.floats(-0.02, 0.1), st.floats(0, 2), st.floats(0, 7))
def test_undistort_undoes_distort(k1, k2, r, angle):
    fold = min(fold_radius(k1, k2), kernels.NEVER)
    d = named(PRESETS["virtual"])._replace(c_u=512.0, c_v=384.0, unit=512.0, k1=k1, k2=k2, fold=fold)
    assume(r * r < 0.99 * fold)
    u, v = 512 + 512 * r * math.cos(angle), 384 + 512 * r * math.sin(angle)
    a, b, r2 = kernels.distort(d, u, v)
    assert r2 < fold
    slope = 1 + r * r * (3 * k1 + 5 * k2 * r * r)
    np.testing.assert_allclose(kernels.undistort(d, a, b), [u, v], rtol=0, atol=1e-11 / slope)


def test_behind_a_projector_there_is_no_image():
    """A projector turned by 60 degrees: its horizon crosses the screen's plane."""
    m = Module(0.0, 0.0, 1.0, 100, 100, yaw=60.0, field_of_view=100.0)
    display = Display("turned", 1.0, 1.0, 0.0, -2.0, (m,), ROI)
    horizon = -1.0 / math.tan(math.radians(60))
    assert answer_at(display, horizon + 1e-9, 0.0, 0.0) == OUTSIDE
    assert answer_at(display, horizon - 1e-9, 0.0, 0.0) == FOLDED
    for diffuser in ("linear", "conical"):  # and texels that look away from the screen have no ray
        _, _, span = replace(display, diffuser=diffuser).texel_ray(0, np.array([50.0, 70.0, 99.5]), 50.0)
        assert (span[:, 0] < span[:, 1]).tolist() == [True, True, False]


def test_outside_the_texture_is_said_and_has_its_coordinates():
    display = Display("square", 2.0, 2.0, 0.0, -2.0, (Module(0.0, 0.0, 1.0, 8, 8),), ROI)
    points = [(-1, 1, 0), (1, 0, 0), (1 - 1e-12, 0, 0), (0, -1, 0), (-1.5, 0, 0), (0, 1.25, 0)]
    image, answers = display.physical_to_image(0, np.array(points, float))
    assert answers.tolist() == [VALID, OUTSIDE, VALID, OUTSIDE, OUTSIDE, OUTSIDE]
    np.testing.assert_array_equal(image[[0, 1, 3, 4, 5], :2], [[0, 0], [8, 4], [4, 8], [-2, 4], [4, -1]])


@settings(max_examples=200)
@given(display=displays(), points=st.lists(st.tuples(*[st.floats()] * 3), min_size=1, max_size=6))
def test_any_numbers_get_an_answer(display, points):
    image, answers = display.physical_to_image(0, points)
    good = np.isin(answers, (VALID, OUTSIDE))
    assert np.isnan(image[~good]).all()
    assert np.isfinite(np.array(points)[answers == VALID]).all()
    assert np.isfinite(image[answers == VALID]).all()


# From other people's kernels, and from arrays


@numba.njit
def darken_what_a_module_shows(numbers, width, height, points, out):
    """A user's kernel: how often each texel is hit."""
    module = kernels.display_module(numbers)
    for k in range(points.shape[0]):
        u, v, answer = kernels.physical_to_image(module, points[k, 0], points[k, 1], points[k, 2])
        if answer == kernels.VALID and 0 <= u < width and 0 <= v < height:
            out[int(v), int(u)] += 1


@both
def test_physical_to_image_is_callable_from_other_kernels(dtype):
    display = SHAPES["convex"]
    points = np.random.default_rng(37).uniform(-0.4, 0.4, (5000, 3)).astype(dtype)
    counts = np.zeros((61, 97), np.int64)
    darken_what_a_module_shows(display.module_numbers(0).astype(dtype), 97, 61, points, counts)
    image, answers = display.physical_to_image(0, points)
    want = np.zeros_like(counts)
    np.add.at(want, tuple(image[answers == VALID, 1::-1].astype(int).T), 1)
    assert want.sum() > 1000
    assert np.abs(counts - want).sum() <= (0 if dtype == np.float64 else 10)


def test_arrays_of_any_shape():
    display = SHAPES["conical"]
    points = np.random.default_rng(38).uniform(-0.3, 0.3, (4, 5, 3))
    image, answers = display.physical_to_image(0, points)
    assert (image.shape, answers.shape) == ((4, 5, 3), (4, 5))
    for place in np.ndindex(4, 5):
        one, answer = display.physical_to_image(0, points[place].tolist())
        np.testing.assert_array_equal(one, image[place])
        assert (one.shape, answer) == ((3,), answers[place])
    turned, _ = display.physical_to_image(0, points.transpose(1, 0, 2))
    np.testing.assert_array_equal(turned, image.transpose(1, 0, 2))
    assert display.physical_to_image(0, np.zeros((0, 3)))[0].shape == (0, 3)
    origin, direction, span = display.texel_ray(0, np.full((2, 1), 3.5), np.array([1.5, 2.5, 3.5]))
    assert (origin.shape, direction.shape, span.shape) == ((2, 3, 3), (2, 3, 3), (2, 3, 2))
    assert [a.shape for a in display.texel_ray(0, 1.5, 2.5)] == [(3,), (3,), (2,)]
    np.testing.assert_array_equal(display.texel_ray(0, 3.5, 2.5)[1], direction[0, 1])


@pytest.mark.parametrize("name", SHAPES)
def test_a_guard_band_moves_the_mapping_and_the_rays(name):
    display = SHAPES[name]
    plain, wide = display.view(0, WORLD), display.view(0, WORLD, guard=7)
    assert (wide.width, wide.height) == (plain.width + 14, plain.height + 14)
    points = np.random.default_rng(41).uniform(-0.1, 0.1, (30, 3))
    np.testing.assert_allclose(
        wide.world_to_image(points), plain.world_to_image(points) + np.array([7, 7, 0]), rtol=0, atol=1e-9
    )  # fmt: skip
    g, w = (RayCaster(some_mesh(), WORLD).gbuffer(view) for view in (plain, wide))
    assert (w.triangle[7:-7, 7:-7] != g.triangle).sum() <= 2


@pytest.mark.parametrize("scale", [-2.0, -1.0, 0.25, 8.0])
def test_only_the_ratios_of_a_homography_matter(scale):
    """Powers of two, so that no digit is rounded; a calibration may hand out either sign."""
    m = replace(SHAPES["projector"].modules[0], yaw=0.0, pitch=0.0, roll=0.0, field_of_view=None)
    h = SHAPES["projector"].module_numbers(0)[8:17]
    one, other = (
        replace(SHAPES["projector"], modules=(replace(m, homography=tuple((s * h).tolist())),)) for s in (1.0, scale)
    )
    points = np.random.default_rng(43).uniform(-0.1, 0.1, (30, 3))
    assert (one.physical_to_image(0, points)[1] == VALID).any()
    for a, b in zip(one.physical_to_image(0, points), other.physical_to_image(0, points), strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(one.texel_ray(0, 9.5, 3.5), other.texel_ray(0, 9.5, 3.5), strict=True):
        np.testing.assert_array_equal(a, b)


def test_calibrated_optics_scale_with_the_resolution():
    """Twice as many columns, three times as many rows; a projector keeps square texels, so it is scaled evenly."""
    d = SHAPES["projector"].module_numbers(0)
    m = replace(SHAPES["projector"].modules[0], yaw=0.0, pitch=0.0, roll=0.0, field_of_view=None)
    calibrated = replace(SHAPES["projector"], modules=(replace(m, homography=tuple(d[8:17].tolist()), k1=0.02),))
    points = np.random.default_rng(42).uniform(-0.1, 0.1, (30, 3))
    undistorted = replace(calibrated, modules=(replace(calibrated.modules[0], k1=0.0),))
    image, larger = (
        undistorted.with_resolution(*size).physical_to_image(0, points)[0] for size in ((97, 61), (194, 183))
    )
    np.testing.assert_allclose(larger[:, :2], image[:, :2] * [2, 3], rtol=0, atol=1e-9)
    for display in (calibrated, SHAPES["projector"]):
        image, larger = (
            display.with_resolution(*size).physical_to_image(0, points)[0] for size in ((97, 61), (194, 122))
        )
        np.testing.assert_allclose(larger[:, :2], 2 * image[:, :2], rtol=0, atol=1e-9)


# What is refused (by files: test_display_file.py)

M = Module(0.0, 0.0, 0.5, 64, 48)
REFUSED = {
    "observers at the screen": ({"observer_z": 0.0}, "observer.distance"),
    "observers behind the screen": ({"observer_z": 1.0}, "observer.distance"),
    "observers behind a concave screen's edges": ({"screen_curvature": -1.9, "observer_z": -0.3}, "observer.distance"),
    "an arc through the screen": ({"observer_z": -0.3, "observer_curvature": 3.0}, "observer.distance"),
    "undefined height": ({"observer_height": math.nan}, "observer.height"),
    "no width": ({"screen_width": 0.0}, "screen.width"),
    "infinite height": ({"screen_height": math.inf}, "screen.height"),
    "unknown diffuser": ({"diffuser": "round"}, "diffuser"),
    "conical and curved": ({"diffuser": "conical", "screen_curvature": 0.1}, "diffuser"),
    "conical and an arc": ({"diffuser": "conical", "observer_curvature": 0.1}, "diffuser"),
    "too curved": ({"screen_curvature": 2.0}, "screen.radius"),
    "no modules": ({"modules": ()}, "modules"),
    "module at the screen": ({"modules": (replace(M, z=0.0),)}, "modules[0].z"),
    "module in front": ({"modules": (M, replace(M, z=-0.5))}, "modules[1].z"),
    "module before a convex screen's side": (
        {"screen_curvature": 1.9, "modules": (replace(M, x=0.45, z=0.2),)}, "modules[0].z"),
    "module nowhere": ({"modules": (replace(M, x=math.nan),)}, "modules[0]"),
    "module without texels": ({"modules": (replace(M, height=0),)}, "modules[0].resolution"),
    "field of view": ({"modules": (replace(M, field_of_view=180.0),)}, "modules[0].field_of_view"),
    "turned without": ({"modules": (replace(M, roll=1.0),)}, "modules[0].yaw"),
    "both": ({"modules": (replace(M, field_of_view=9.0, homography=(1.0,) * 9),)}, "modules[0].homography"),
    "singular": ({"modules": (replace(M, homography=(1.0,) * 9),)}, "modules[0].homography"),
    "undefined optics": ({"modules": (replace(M, k1=math.nan),)}, "modules[0]"),
    "folds": ({"modules": (replace(M, k1=-0.2),)}, "modules[0].k1"),
    "folds at the corner": ({"modules": (replace(M, k1=-0.0949),)}, "modules[0].k1"),
    "looks away": ({"modules": (replace(M, yaw=120.0, field_of_view=40.0),)}, "modules[0]"),
    "flat ROI": ({"roi": ((-0.1, -0.1, 0.1), (0.1, 0.1, 0.1))}, "roi"),
    "ROI at the observers": ({"roi": ((-0.1, -0.1, -2.0), (0.1, 0.1, 0.1))}, "roi.min"),
    "ROI at the modules": ({"roi": ((-0.1, -0.1, -0.2), (0.1, 0.1, 0.5))}, "roi.max"),
    "ROI beyond the arc": ({"observer_curvature": 0.5, "roi": ((-1.9, -0.1, -1.0), (1.9, 0.1, 0.1))}, "roi"),
    "ROI through a curved singular surface": (
        {"diffuser": "conical", "observer_z": -1.0, "modules": (replace(M, y=0.5),),
         "roi": ((-0.1, 0.0, -0.1), (0.1, 1.5, 0.46))}, "roi"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_impossible_displays_are_refused_by_their_key(case):
    changes, key = REFUSED[case]
    fine = Display("fine", 1.0, 0.6, 0.0, -2.0, (M,), ((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)))
    with pytest.raises(InputError) as caught:
        replace(fine, **changes)
    assert str(caught.value).startswith(f"display fine: {key}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("k1", [-0.0948, 0.0, 0.5])
def test_distortion_that_just_reaches_the_corner_is_taken(k1):
    """Height / width = 3 / 4: the corner is at r = 1.25; the fold reaches r = (2 / 3) / sqrt(-3 k1)."""
    module = replace(M, k1=k1)
    display = Display("fine", 1.0, 0.6, 0.0, -2.0, (module,), ROI)
    corners = np.array([0.0, 64.0]), np.array([0.0, 48.0])
    _, _, span = display.texel_ray(0, *corners)
    assert (span[:, 0] < span[:, 1]).all()
    assert (k1 == 0) or round_trip_error(display, 0, *corners, (0.1, 0.5))[0] < 1e-9


# The presets' geometry


@presets
def test_the_rays_of_a_presets_modules_reach_the_observers_through_the_screen(display):
    for index, m in enumerate(display.modules):
        origin, direction, (near, far) = display.texel_ray(index, m.width / 2, m.height / 2)
        assert near < 0 < far <= m.z
        eye = origin + near * direction
        assert eye[1] == pytest.approx(display.observer_height, abs=1e-12)
        assert abs(origin[0]) < 0.05 * display.screen_width
        assert abs(origin[1]) < 0.05 * display.screen_height
    assert [m.x for m in display.modules] == sorted(m.x for m in display.modules)  # from left to right


@presets
def test_every_module_of_a_preset_sees_much_of_the_roi(display):
    axes = [np.linspace(a, b, 9) for a, b in zip(*display.roi, strict=True)]
    points = np.stack(np.meshgrid(*axes), axis=-1)
    seen = np.array([display.physical_to_image(k, points)[1] == VALID for k in range(len(display.modules))])
    fractions = seen.mean(axis=(1, 2, 3))
    assert fractions.min() > 0.4
    np.testing.assert_allclose(fractions, fractions[::-1], rtol=0, atol=0.02)
    assert seen.any(axis=0).mean() > 0.8


def steps_from_the_middle(display):
    return np.diff(np.degrees([math.atan2(m.x, m.z) for m in display.modules]))


def test_c80_serves_forty_degrees_from_every_point_of_the_screen():
    """From the screen's right edge to its rightmost module 20 degrees, from the left edge likewise."""
    display = PRESETS["c80"]
    last, half = display.modules[-1], 0.5 * display.screen_width
    assert len(display.modules) == 80
    assert 2 * math.degrees(math.atan2(last.x - half, last.z)) == pytest.approx(40, abs=0.2)
    assert 0.7 < steps_from_the_middle(display).min() < steps_from_the_middle(display).max() < 1.7


def test_picoarray_has_its_published_angles():
    display = PRESETS["picoarray"]
    np.testing.assert_allclose(steps_from_the_middle(display), 1.66, rtol=0, atol=1e-3)
    assert {round(math.hypot(m.x, m.z), 12) for m in display.modules} == {0.6}
    for m in display.modules:  # each looks at the screen's middle
        assert m.yaw == pytest.approx(-math.degrees(math.atan2(m.x, m.z)), abs=1e-12)
    corners = [(x, y, 0.0) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    assert (display.physical_to_image(35, corners)[1] == VALID).all()  # the middle ones cover the screen


def test_convex_modules_stand_behind_their_screen():
    display = PRESETS["convex"]
    for m in display.modules:
        assert math.hypot(m.x, m.z - 1.5) == pytest.approx(0.7, abs=1e-12)
        assert 0.7 < m.z - (1.5 - math.sqrt(1.5**2 - m.x**2)) < 1.2
    assert np.degrees(np.diff([math.atan2(m.x, 1.5 - m.z) for m in display.modules])) == pytest.approx(100 / 47)


@pytest.mark.parametrize(
    ("name", "count", "size", "places"),
    [
        ("virtual", 1, (1024, 768), [0.0]),
        ("sample-a", 21, (1000, 600), np.arange(-1000, 1001, 100) / 1000),
        ("sample-b", 41, (800, 600), np.arange(-1000, 1001, 50) / 1000),
    ],
)
def test_published_numbers(name, count, size, places):
    display = PRESETS[name]
    assert len(display.modules) == count
    assert {(m.width, m.height) for m in display.modules} == {size}
    np.testing.assert_allclose([m.x for m in display.modules], places, rtol=0, atol=1e-15)
