"""Small balls in modules of any display: what is said of them holds, is nearly all that could be said, and why."""

from fractions import Fraction

import numpy as np
import pytest
import test_display
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st
from reference import textbook as display_twin
from test_small_balls import holds

from lfssao import display_motion, find_display
from lfssao.display_rounding import rounded_image, rounded_points
from lfssao.display_slopes import distorted_slopes, ray_points, ray_ways, screen_slopes, texel_slopes
from lfssao.display_window import projected
from lfssao.errors import InputError
from lfssao.kernels.display import map_points, trace_texels, undistort
from lfssao.kernels.rays import DISPLAY
from lfssao.ranges import Range, Rounded
from lfssao.samples import make_samples
from lfssao.small_balls import DecidedRadii, decided_radii
from lfssao.window import Window

pytestmark = pytest.mark.usefixtures("one_thread")

WIDTH, HEIGHT = 24, 18
PRESETS = {"convex": (0, 24, 47), "picoarray": (0, 36), "sample-b": (0, 20, 40)}


def drawn(display):
    """A drawn display with small textures."""
    try:
        return display.with_resolution(WIDTH, HEIGHT)
    except InputError:  # in a texture of another shape its distortion would fold
        reject()


def surfaces(view, physical_from_world, rng, deep):
    """Depth and positions as the ray caster rounds them, of any points on the rays, and a box around them."""
    v, u = (n.ravel() + 0.5 for n in np.mgrid[: view.height, : view.width])
    lines = np.empty((len(u), 6))
    trace_texels(view.lens, u, v, lines)
    z = rng.uniform(-deep, deep, len(u))
    seen = (lines[:, 4] < z) & (z < lines[:, 5]) & (rng.random(len(u)) < 0.8)
    physical = np.column_stack([lines[:, :2] + z[:, None] * lines[:, 2:4], z])
    world = np.linalg.solve(physical_from_world[:, :3], (physical - physical_from_world[:, 3]).T).T
    depth, world = np.where(seen, z, np.inf), np.where(seen[:, None], world, np.inf)
    box = np.stack([world[seen].min(axis=0), world[seen].max(axis=0)]) if seen.any() else np.zeros((2, 3))
    shape = view.height, view.width
    return depth.astype(np.float32).reshape(shape), world.astype(np.float32).reshape(*shape, 3), box


def images(lens, points):
    """Image coordinates of physical points, NaN where there are none."""
    image, answers = np.empty_like(points), np.empty(len(points), np.int64)
    map_points(lens, np.ascontiguousarray(points), 10**9, 10**9, image, answers)
    return image[:, :2]


# What is decided


@settings(max_examples=60)
@given(
    display=test_display.displays(),
    turn=st.sampled_from([0.0, 0.3]),
    deep=st.sampled_from([0.0, 0.02, 0.2]),
    n=st.sampled_from([1, 3, 8]),
    seed=st.integers(0, 2**32),
)
def test_every_sample_of_a_decided_radius_is_counted_so(display, turn, deep, n, seed):
    """Next to both ends of the range, where the bounds are used up."""
    rng = np.random.default_rng(seed)
    linear = (np.diag([1.0, 1.0, -1.0]) + turn * rng.uniform(-1, 1, (3, 3))) * 10 ** rng.uniform(-2, 2)
    world = np.hstack([linear, rng.uniform(-0.1, 0.1, (3, 1))])
    view = drawn(display).view(0, world, guard=int(rng.integers(0, 2)))
    assume(view.ray_kind == DISPLAY)  # flat ones have other numbers, and tests of their own
    samples = rng.uniform(-1, 1, (n, 3)) / np.sqrt(3)
    depth, positions, box = surfaces(view, world, rng, deep)
    if not (depth < np.inf).any():
        return
    radii = np.geomspace(1e-6, 0.2, 40) / np.abs(linear).max()
    low, high, behind, _ = decided = decided_radii(view, box, samples, radii.tolist())
    for radius in (low * 1.0001, np.sqrt(low * high), high * 0.9999) if low < high else ():
        assert radius in decided
        assert holds(view, depth, positions, samples, radius, behind)


@pytest.mark.parametrize(("name", "index"), [(name, index) for name, some in PRESETS.items() for index in some])
def test_radii_of_presets_are_decided_nearly_as_far_as_can_be(name, index):
    """0.85 times the largest ball that leaves no texel, of many points of the room; a tenth more does not hold."""
    display, rng, samples = find_display(name), np.random.default_rng(3), make_samples()
    box, view = np.array(display.roi), display.view(index, np.eye(3, 4))
    points = box[0] + np.where(rng.random((60_000, 3)) < 0.5, rng.random((60_000, 3)), 1) ** 3 * (box[1] - box[0])
    points = np.where(rng.random((60_000, 3)) < 0.5, points, box.sum(axis=0) - points)
    at = images(view.lens, points)
    points = points[((at > 0.5) & (at < [view.width - 0.5, view.height - 0.5])).all(axis=1)]

    def stay(radius):
        moved = [np.abs(images(view.lens, points + radius * s) - images(view.lens, points)).max() for s in samples]
        return max(moved) < 0.5

    low, high = 0.0, 0.01
    for _ in range(12):
        low, high = (0.5 * (low + high), high) if stay(0.5 * (low + high)) else (low, 0.5 * (low + high))
    asked = decided_radii(view, box, samples, (1e-5, 0.85 * low, 1.1 * high))
    assert (asked.behind, 1e-5 in asked, 0.85 * low in asked, 1.1 * high in asked) == (4, True, True, False)


def test_what_is_not_decided_is_told_from_what_is_large():
    view, samples = find_display("sample-b").view(0, np.eye(3, 4)), make_samples()
    box = np.array(find_display("sample-b").roi)
    assert decided_radii(view, box, samples, (1e-4, 1e-5)).open == (1e-4,)
    assert decided_radii(view, box, samples, (0.1,)) == DecidedRadii()
    around = decided_radii(view, box * 8, samples, (1e-5,))  # beyond the lens
    assert (around.high, around.open) == (0.0, (1e-5,))
    assert decided_radii(view, box * 8, samples, ()) == DecidedRadii()


def test_a_mapping_that_is_not_the_rays_inverse():
    """Numbers of the mapping that are not those of the rays; homographies that are no inverses, a little and by far."""
    display, samples = find_display("convex").with_resolution(WIDTH, HEIGHT), make_samples()
    view, box = display.view(3, np.eye(3, 4)), np.array(display.roi)
    radii = np.geomspace(1e-5, 0.02, 60).tolist()
    right, checked = decided_radii(view, box, samples, radii), 0
    assert right.low < right.high
    view.world_to_image.numbers[12] += 1e-9
    assert decided_radii(view, box, samples, radii) == DecidedRadii()
    for number in range(23, 32):
        for wrong in (1e-5, 1e-3, 0.3):
            other = display.view(3, np.eye(3, 4))
            size = np.abs(other.lens[23:32]).max() if number < 29 else np.abs(other.lens[29:32]).max() / WIDTH
            for numbers in (other.lens, other.world_to_image.numbers[12:]):
                numbers[number] += wrong * size
            low, high, behind, _ = decided_radii(other, box, samples, radii)
            if low < high:
                depth, positions, _ = surfaces(other, np.eye(3, 4), np.random.default_rng(1), 0.2)
                within = ((box[0] <= positions) & (positions <= box[1])).all(axis=2)
                depth = np.where(within, depth, np.float32(np.inf))
                assert holds(other, depth, positions, samples, high * 0.9999, behind)
                checked += bool((depth < np.inf).any())
    assert checked > 5


# Numbers that know their rounding


def as_range(a, b):
    return Range(np.array([float(min(a, b))]), np.array([float(max(a, b))]))


singles = st.floats(2**-20, 2**20, width=32)


@settings(max_examples=200)
@given(x=singles, y=singles, share=st.floats(2**-10, 0.25), other=st.floats(2**-10, 0.25), signs=st.integers(0, 3))
def test_rounded_operations_bound_what_errors_do_and_by_no_more_than_that(x, y, share, other, signs):
    """Operands as far off as they may be, exact results by fractions; nothing is rounded, so bounds are reached."""
    x, y = (Fraction(n) * (-1 if signs >> k & 1 else 1) for k, n in enumerate((x, y)))
    e, f = Fraction(share) * abs(x), Fraction(other) * abs(y)
    a, b = (Rounded(as_range(n, n), np.array([float(d)]), 0.0) for n, d in ((x, e), (y, f)))
    for name, operation in {
        "+": (lambda p, q: p + q), "-": (lambda p, q: p - q), "*": (lambda p, q: p * q), "/": (lambda p, q: p / q)
    }.items():  # fmt: skip
        made = operation(a, b)
        exact = operation(x, y)
        low, high = (Fraction(float(end[0])) for end in made.exact)
        assert low <= exact <= high <= low + abs(exact) * Fraction(1, 2**47), name
        worst = float(max(abs(operation(x + s * e, y + t * f) - exact) for s in (1, -1) for t in (1, -1)))
        assert worst <= made.error[0] * (1 + 1e-12) <= worst * (1 + 1e-9), name
    if x > 0:
        made = np.sqrt(a)
        worst = np.sqrt(float(x)) - np.sqrt(float(x - e))
        assert worst <= made.error[0] * (1 + 1e-9) <= worst * (1 + 1e-6)
    square = a * a
    worst = float((abs(x) + e) ** 2 - x * x)
    assert worst <= square.error[0] * (1 + 1e-12) <= worst * (1 + 1e-9)


@settings(max_examples=200)
@given(x=singles, y=singles)
def test_rounded_operations_bound_their_own_rounding(x, y):
    unit = 2.0**-24
    a, b = (Rounded(as_range(n, n), 0.0, unit) for n in (x, y))
    for operation in (lambda p, q: p + q, lambda p, q: p - q, lambda p, q: p * q, lambda p, q: p / q):
        made, exact = operation(a, b), operation(Fraction(x), Fraction(y))
        computed = Fraction(float(operation(np.float32(x), np.float32(y))))
        assert abs(computed - exact) <= Fraction(float(made.error[0])) <= abs(exact) * Fraction(unit * 1.01) + 2**-90
    assert abs(float(np.sqrt(np.float32(x))) - np.sqrt(x)) <= np.sqrt(a).error[0]


def test_constants_are_rounded_once_and_zero_is_exact():
    third = Rounded.constant(1 / 3, 2.0**-24, np.zeros(1, np.bool_))
    assert abs(np.float32(1 / 3) - 1 / 3) <= third.error <= 2.0**-25
    assert Rounded.constant(0.0, 2.0**-24, np.zeros(1, np.bool_)) == 0.0
    assert third != 1 / 3
    assert Rounded(2.0) == 2.0


def test_comparisons_doubt_the_parts_that_they_do_not_hold_for():
    doubt = np.zeros(4, np.bool_)
    low, high = np.array([1.0, 1.0, -1.0, 0.1]), np.array([2.0, 2.0, -0.5, 0.2])
    number = Rounded(Range(low, high), np.array([0.0, 0.5, 0.0, 0.1]), 0.0, doubt)
    assert number > 0.0
    assert doubt.tolist() == [False, False, True, True]
    doubt[:] = False
    assert not number < 0.0
    assert doubt.tolist() == [False, False, True, True]
    doubt[:] = False
    assert 0.0 < number < Rounded(3.0)
    assert doubt.tolist() == [False, False, True, True]
    doubt[:] = False
    assert (number > Rounded(Range(low, high))) in (True, False)
    assert doubt.all()


@settings(max_examples=60)
@given(display=test_display.displays(), seed=st.integers(0, 2**32))
def test_rounded_rays_and_images_hold_the_computed_ones(display, seed):
    """Float32 images of float32 points, and rays of image points, of a part of the texture; no bound is excessive."""
    rng = np.random.default_rng(seed)
    lens = drawn(display).module_numbers(0)
    lens[20:22] = 0.0  # as the rays are taken
    u, v, z = (np.sort(n) for n in rng.uniform([0, 0, -0.2], [WIDTH, HEIGHT, 0.2], (2, 3)).T)
    u[1], v[1], z[1] = u[0] + 0.05 * (u[1] - u[0]), v[0] + 0.05 * (v[1] - v[0]), z[0] + 0.05 * (z[1] - z[0])
    parts = [Range(n[:1], n[1:]) for n in (u, v, z)]
    doubt = np.zeros(1, np.bool_)
    with np.errstate(all="ignore"):
        x, y = rounded_points(lens, *parts, doubt)
        s_x, s_y = projected(lens[23:32], *parts[:2])
        sigma = s_x.plus(-lens[0]).times(1 / lens[2])
        tight = ray_points(lens, s_x, s_y, parts[2])
        image = rounded_image(lens, sigma, *tight, parts[2], doubt)
    if doubt.any():
        return
    single = lens.astype(np.float32)
    lines = np.empty((20, 6))
    trace_texels(lens, rng.uniform(*u, 20), rng.uniform(*v, 20), lines)
    for o_x, o_y, d_x, d_y, near, far in lines:
        c = rng.uniform(*z)
        assert near < far
        point = o_x + c * d_x, o_y + c * d_y
        for place, exact, narrow in zip(point, (x, y), tight, strict=True):
            assert exact.exact.low[0] - 1e-12 <= place <= exact.exact.high[0] + 1e-12
            assert narrow.low[0] - 1e-12 <= place <= narrow.high[0] + 1e-12
            assert 0 < exact.error[0] < 1e-10
        rounded = [np.float32(n) for n in (*point, c)]
        got = display_twin.physical_to_image(single, *rounded)
        want = display_twin.physical_to_image(lens, *(np.float64(n) for n in rounded))
        assert got[2] == want[2] == 0
        for number in range(2):
            assert abs(float(got[number]) - want[number]) <= image[number].error[0]
            assert image[number].error[0] < 0.1


# Derivatives


@settings(max_examples=100)
@given(display=test_display.displays(), seed=st.integers(0, 2**32))
def test_slopes_are_the_mappings_derivatives(display, seed):
    """By differences, at points; and the ranges of a part hold those of the points in it."""
    rng = np.random.default_rng(seed)
    lens = drawn(display).module_numbers(0)
    u, v, z = (
        np.array([a, a + b]) for a, b in zip(rng.uniform([2, 2, -0.2], [20, 14, 0.2]), (2.0, 2.0, 0.05), strict=True)
    )
    inside = [rng.uniform(*n, 8) for n in (u, v, z)]
    parts = [Range(*np.append(n[:, None], [p, p], axis=1)) for n, p in zip((u, v, z), inside, strict=True)]
    with np.errstate(all="ignore"):
        s_x, s_y = projected(lens[23:32], *parts[:2])
        rays, ways = ray_ways(lens, s_x, s_y), np.repeat(rng.choice([0.0, 1.0]) * rng.uniform(-2, 2, (2, 1)), 9, axis=1)
        rows = screen_slopes(lens, s_x, s_y, parts[2], tuple(Range(way, way) for way in ways) if ways.any() else None)
        plain = texel_slopes(lens, s_x, s_y, *parts[:2], rows)
        slopes = distorted_slopes(lens, *parts[:2], plain)
        points = np.column_stack([n.low[1:] for n in (*ray_points(lens, s_x, s_y, parts[2]), parts[2])])
        step = 1e-6
        on = np.column_stack([*(way[1:] for way in rays), np.ones(8)])
        there = images(lens, points + step * on) - images(lens, points - step * on)
        assert not (np.abs(there) > 1e-9 * (WIDTH + np.abs(images(lens, points)))).any()  # NaN is where there is none
        for axis in range(3):
            moved = step * np.column_stack([*ways[:, 1:], np.ones(8)]) if axis == 2 else step * np.eye(3)[axis]
            want = (images(lens, points + moved) - images(lens, points - moved)) / (2 * step)
            there = np.isfinite(want).all(axis=1)
            for coordinate in range(2):
                made, size = slopes[coordinate][axis], np.abs(want).max(axis=1) + WIDTH
                assert (np.abs(made.low[1:] - want[:, coordinate])[there] <= 1e-5 * size[there]).all()
                assert (made.high[1:] - made.low[1:] <= 1e-9 * size)[there].all()
                if np.isfinite([made.low[0], made.high[0]]).all():
                    assert (made.low[0] <= made.low[1:][there] + 1e-9 * size[there]).all()
                    assert (made.high[0] >= made.low[1:][there] - 1e-9 * size[there]).all()


@settings(max_examples=100)
@given(display=test_display.displays(), seed=st.integers(0, 2**32))
def test_undistorted_coordinates_of_a_window_are_held(display, seed):
    rng = np.random.default_rng(seed)
    lens = drawn(display).module_numbers(0)
    (left, right), (top, bottom) = (np.sort(rng.choice(n + 1, 2, replace=False)) for n in (WIDTH, HEIGHT))
    u, v = display_motion._undistorted(lens, Window(int(left), int(top), int(right), int(bottom)))
    places = np.array([undistort(lens, a + 0.5, b + 0.5) for a in range(left, right) for b in range(top, bottom)])
    assert (places >= np.array([u[0], v[0]]) - 1e-9).all()
    assert (places <= np.array([u[1], v[1]]) + 1e-9).all()
    spare = 0.15 * (WIDTH + np.abs([*u, *v]).max())
    assert (places.min(axis=0) - spare <= [u[0], v[0]]).all()
    assert (places.max(axis=0) + spare >= [u[1], v[1]]).all()


@settings(max_examples=50)
@given(
    display=test_display.displays(),
    number=st.integers(23, 31),
    wrong=st.sampled_from([0.0, 1e-8, 1e-5]),
    seed=st.integers(0, 2**32),
)
def test_what_homographies_miss_being_inverses(display, number, wrong, seed):
    rng = np.random.default_rng(seed)
    lens = drawn(display).module_numbers(0)
    lens[number] += wrong * np.abs(lens[23:32]).max()
    u, v = rng.uniform(0, [WIDTH, HEIGHT])
    forth, back = (
        np.array([[Fraction(float(n)) for n in row] for row in lens[k : k + 9].reshape(3, 3)]) for k in (8, 23)
    )
    place = forth @ (back @ np.array([Fraction(float(u)), Fraction(float(v)), Fraction(1)]))
    off = max(
        abs(float(place[0] / place[2] - Fraction(float(u)))), abs(float(place[1] / place[2] - Fraction(float(v))))
    )
    made = float(display_motion._mismatch(lens, as_range(u, u), as_range(v, v))[0])
    if off < 0.01:
        assert off <= made < 20 * off + 1e-9


# What the limit is made of


@settings(max_examples=100)
@given(seed=st.integers(0, 2**32))
def test_a_limit_is_what_the_worst_of_all_derivatives_offsets_and_errors_leaves(seed):
    """By trying all: derivatives at the ends of their ranges, each sample, errors of either sign."""
    rng = np.random.default_rng(seed)
    ends = np.sort(rng.uniform(-1, 1, (3, 2, 1)), axis=1)
    seen, offsets, errors = 0.01 * rng.random((3, 1)), rng.uniform(-1, 1, (4, 3)), 0.05 * rng.random((2, 3))
    made = display_motion._below(np.array([0.5]), tuple(Range(*n) for n in ends), seen, offsets, errors)[0]
    corners = np.array(np.meshgrid(*ends[:, :, 0])).reshape(3, -1)
    reach, off = np.abs(offsets @ corners).max(axis=0), np.abs(ends).max(axis=(1, 2))
    # The largest derivatives need not be those of the farthest sample: errors are added to the worst of both.
    slope, base = reach.max() + off @ errors[1], off @ (seen[:, 0] + errors[0])
    assert made == pytest.approx((0.5 - base) / slope, rel=1e-5)
    assert made <= (0.5 - base) / slope


def test_rounding_mismatch_and_distortion_take_their_part_of_the_half_texel(monkeypatch):
    display, samples = find_display("convex"), make_samples()
    lens = display.module_numbers(20)
    part = np.array([[[500.0], [501.0]], [[300.0], [301.0]], [[0.0], [0.01]]])

    def limit():
        return display_motion._limits(lens, part, 1e-3, samples, np.zeros((2, 3)))[0]

    right, rounded, steps = limit(), display_motion.rounded_image, display_motion._distortion_steps
    assert right > 1e-4

    def worse(*arguments):
        for place in (made := rounded(*arguments)):
            place.error = place.error + 0.25
        return made

    monkeypatch.setattr(display_motion, "rounded_image", worse)
    assert 0.45 * right < limit() < 0.52 * right
    monkeypatch.setattr(display_motion, "rounded_image", rounded)
    monkeypatch.setattr(display_motion, "_distortion_steps", lambda *some: [n + 0.25 for n in steps(*some)])
    assert 0.45 * right < limit() < 0.52 * right
    monkeypatch.setattr(display_motion, "_distortion_steps", steps)
    monkeypatch.setattr(display_motion, "_mismatch", lambda *_: np.array([0.1]))
    assert limit() < 0.85 * right
    monkeypatch.undo()
    # Where the distortion shrinks every way, those of the undistorted coordinates end at the part's margin of 0.75.
    less = lambda _lens, _u, _v, rows: [tuple(n.times(1e-3) for n in row) for row in rows]  # noqa: E731
    monkeypatch.setattr(display_motion, "distorted_slopes", less)
    assert 1.4 * right < limit() < 1.6 * right
    monkeypatch.undo()

    def doubted(*arguments):
        arguments[-1][:] = True
        return rounded(*arguments)

    monkeypatch.setattr(display_motion, "rounded_image", doubted)
    assert limit() == 0.0
