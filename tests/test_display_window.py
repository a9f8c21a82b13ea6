"""The image of a box on any display: no point of the box, and no ray that meets it, is left out."""

from fractions import Fraction

import numpy as np
import pytest
import test_display
from hypothesis import given, settings
from hypothesis import strategies as st

from lfssao import Display, Module, find_display
from lfssao.display_window import Range, image_range, projected
from lfssao.kernels.display import map_points, trace_texels
from lfssao.kernels.rays import DISPLAY
from lfssao.window import Window, seen_window

IDENTITY = np.eye(3, 4)


def any_box(rng, deep=0.5):
    """A box of physical space, from a speck to all of the display."""
    points = rng.uniform(-1, 1, (2, 3)) * [0.8, 0.5, deep]
    points = points[0] + (points - points[0]) * 10 ** rng.uniform(-4, 0.3, 3)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def within(box, rng, n):
    """Points of a box, its corners among them."""
    share = rng.random((n, 3))
    share[: n // 2] = np.round(share[: n // 2])
    return np.ascontiguousarray(box[0] + share * (box[1] - box[0]))


def images(lens, points):
    """Image coordinates of those that have any."""
    image, answers = np.empty_like(points), np.empty(len(points), np.int64)
    map_points(lens, points, 10**9, 10**9, image, answers)
    return image[np.isfinite(image[:, 0]), :2]


@settings(max_examples=300)
@given(display=test_display.displays(), seed=st.integers(0, 2**32))
def test_the_images_of_all_points_of_a_box_lie_in_its_range(display, seed):
    rng = np.random.default_rng(seed)
    lens, box = display.module_numbers(0), any_box(rng)
    found = image_range(lens, box)
    if found is None:
        return
    u_low, u_high, v_low, v_high = found
    seen = images(lens, within(box, rng, 200))
    assert ((seen[:, 0] >= u_low) & (seen[:, 0] <= u_high)).all()
    assert ((seen[:, 1] >= v_low) & (seen[:, 1] <= v_high)).all()


@settings(max_examples=150)
@given(display=test_display.displays(), seed=st.integers(0, 2**32))
def test_every_ray_that_meets_a_box_lies_in_its_window(display, seed):
    rng = np.random.default_rng(seed)
    module = display.modules[0]
    small = display.with_resolution(24, 18)
    view = small.view(0, IDENTITY, guard=int(rng.integers(0, 3)))
    lens, box = small.module_numbers(0, view.guard), any_box(rng)
    v, u = (n.ravel() + 0.5 for n in np.mgrid[: view.height, : view.width])
    lines = np.empty((len(u), 6))
    trace_texels(lens, u, v, lines)
    o, d, near, far = lines[:, :2], lines[:, 2:4], lines[:, 4], lines[:, 5]
    z = np.linspace(np.maximum(near, box[0, 2]), np.minimum(far, box[1, 2]), 33)[1:-1]  # between what bounds the ray
    x, y = (o[:, k] + z * d[:, k] for k in range(2))
    meets = (x >= box[0, 0]) & (x <= box[1, 0]) & (y >= box[0, 1]) & (y <= box[1, 1]) & (z >= box[0, 2])
    meets = (meets & (z <= box[1, 2]) & (z > near) & (z < far)).any(axis=0).reshape(view.height, view.width)
    window = seen_window(view, box)
    assert window.part(meets).sum() == meets.sum(), module


@given(seed=st.integers(0, 2**32))
def test_images_of_a_homography_whose_sums_cancel_are_held(seed):
    rng = np.random.default_rng(seed)
    rows, (p, q) = rng.uniform(-1, 1, (3, 3)), rng.uniform(-1, 1, 2)
    rows[:, 2] = rng.uniform(0, 10.0 ** rng.uniform(-15, 0, 3)) - (rows[:, 0] * p + rows[:, 1] * q)
    sums = [Fraction(g) * Fraction(p) + Fraction(h) * Fraction(q) + Fraction(i) for g, h, i in rows.tolist()]
    with np.errstate(all="ignore"):
        made = projected(rows.ravel(), *(Range(np.array([n]), np.array([n])) for n in (p, q)))
    for place, top in zip(made, sums, strict=False):
        if sums[2] > 2**-40 and np.isfinite(place.low[0]):
            assert Fraction(float(place.low[0])) <= top / sums[2] <= Fraction(float(place.high[0]))


def lens_of(diffuser="linear", screen=0.0, arc=0.0, **module):
    """Numbers of a turned module of a display with these curvatures."""
    turned = {"yaw": -15.0, "pitch": -8.0, "roll": 3.0, "field_of_view": 60.0} if "homography" not in module else {}
    one = Module(**{"x": 0.3, "y": 0.2, "z": 1.0, "width": 800, "height": 600, **turned, **module})
    return Display("one", 1.2, 0.8, 0.4, -2.0, (one,), test_display.ROI, diffuser, screen, arc).module_numbers(0)


# Modules, and by how much ranges of u and of v are too large at the most, in shares of what they hold: half as much
# again as they are. Ranges of half as many parts, or of one fewer term that is known, are larger than that.
WIDTHS = {
    "flat": (lens_of(), 0.004, 0.003),
    "conical": (lens_of("conical"), 0.006, 0.003),
    "conical, from below": (lens_of("conical", x=-0.4, y=-0.3, yaw=20.0, pitch=15.0), 0.003, 0.015),
    "convex": (lens_of(screen=1.0), 0.012, 0.05),
    "concave": (lens_of(screen=-0.8), 0.006, 0.06),
    "lens behind the screen's axis": (lens_of(screen=1.25, z=1.4), 0.013, 0.05),
    "lens outside the screen's circle": (lens_of(screen=1.6, z=1.4), 0.016, 0.06),
    "observers around": (lens_of(arc=0.5), 0.015, 0.18),
    "observers' arc the other way": (lens_of(arc=-0.2), 0.007, 0.06),
    "both": (lens_of(screen=1.6, arc=0.45, z=1.4), 0.024, 0.16),
    "cushion": (lens_of(k1=0.08, k2=0.02), 0.035, 0.009),
    "barrel": (lens_of(k1=-0.04), 0.018, 0.025),
}


@pytest.mark.parametrize("name", WIDTHS)
def test_ranges_are_hardly_larger_than_what_they_hold(name):
    lens, *most = WIDTHS[name]
    for middle, half in (
        ((0.05, -0.1, 0.02), (0.03, 0.03, 0.03)),
        ((0.0, 0.0, 0.0), (0.3, 0.25, 0.2)),
        ((0.35, -0.15, -0.1), (0.1, 0.1, 0.1)),
    ):
        box = np.array([middle, middle]) + np.array([[-1], [1]]) * half
        points = np.stack(np.meshgrid(*np.linspace(*box, 9).T), axis=-1).reshape(-1, 3)
        seen = images(lens, points)
        assert len(seen) == len(points)
        low, high = seen.min(axis=0), seen.max(axis=0)
        ends = np.array(image_range(lens, box)).reshape(2, 2)
        assert ((ends[:, 0] <= low) & (high <= ends[:, 1])).all()
        assert (ends[:, 1] - ends[:, 0] <= (high - low) * (1 + np.array(most))).all()


@pytest.mark.parametrize("name", WIDTHS)
def test_ranges_of_points_hold_their_images_as_they_are_rounded_and_little_more(name):
    """Points so near to the origin that next to the lens's numbers theirs are none, and others."""
    rng, lens = np.random.default_rng(3), WIDTHS[name][0]
    for point in np.concatenate([rng.uniform(-0.2, 0.2, (20, 3)), rng.uniform(-1e-9, 1e-9, (20, 3))]):
        u_low, u_high, v_low, v_high = image_range(lens, np.array([point, point]))
        (u, v), *_ = images(lens, point[None])
        assert u_low <= u <= u_high <= u_low + 1e-6
        assert v_low <= v <= v_high <= v_low + 1e-6


def test_homographies_are_inverses_to_a_sixteenth_of_a_texel_or_nothing_is_known():
    """Inverses that miss by one number, of any size in any scale: by fractions, how far at the ends of a texture."""
    rng, box, answers = np.random.default_rng(7), np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]]), set()
    lens, size = lens_of(), 10_000
    forth = [[Fraction(n) for n in row] for row in lens[8:17].reshape(3, 3).tolist()]
    for number in range(400):
        i, j = divmod(number % 9, 3)
        wrong = np.eye(3)
        wrong[i, j] += rng.choice([-1, 1]) * 10 ** rng.uniform(-6, 1) / [1, size, size**2][(i == 2) + (j < 2)]
        other = lens.copy()
        other[23:32] = ((lens[23:32].reshape(3, 3)[:, :, None] * wrong).sum(axis=1) * rng.choice([0.25, 1, 8])).ravel()
        back = [[Fraction(n) for n in row] for row in other[23:32].reshape(3, 3).tolist()]
        product = [[sum(row[k] * back[k][n] for k in range(3)) for n in range(3)] for row in forth]
        off = 0
        for corner in ((0, 0, 1), (size, 0, 1), (0, size, 1), (size, size, 1)):
            x, y, w = (sum(a * b for a, b in zip(row, corner, strict=True)) for row in product)
            off = max(off, abs(x / w - corner[0]), abs(y / w - corner[1]))
        known = image_range(other, box) is not None
        answers.add((i, j, known))
        assert off < 1 / 16 if known else off > 1e-4
    assert len(answers) == 18


@pytest.mark.parametrize("name", ["convex", "picoarray", "sample-b"])
def test_the_windows_of_presets_are_tight(name):
    """A small box's window is no more than a few texels too large; of a module beside which it lies it is empty."""
    display, rng = find_display(name), np.random.default_rng(5)
    room = np.array(display.roi)
    middle, half = room.mean(axis=0), 0.1 * (room[1] - room[0])
    box = np.stack([middle - half, middle + half])
    for index in (0, len(display.modules) // 2, len(display.modules) - 1):
        view = display.view(index, IDENTITY)
        assert view.ray_kind == DISPLAY
        seen = images(view.lens, within(box, rng, 2000))
        low, high = np.floor(seen.min(axis=0)), np.ceil(seen.max(axis=0))
        window = seen_window(view, box)
        assert window.left <= low[0] < window.left + 9
        assert window.top <= low[1] < window.top + 17
        assert window.right - 9 < high[0] <= window.right
        assert window.bottom - 17 < high[1] <= window.bottom
        above = box + np.array([0.0, 2.0 * (room[1] - room[0])[1], 0.0])
        assert seen_window(view, above) == Window(0, 0, 0, 0)


def test_nothing_is_known_of_a_box_that_reaches_the_lens_or_the_observers():
    for name in ("convex", "picoarray", "sample-b"):
        view = find_display(name).view(0, IDENTITY)
        for z in ((0.0, 9.0), (-9.0, 0.0)):
            box = np.array([[-0.1, -0.1, z[0]], [0.1, 0.1, z[1]]])
            assert image_range(view.lens, box) is None
            assert seen_window(view, box) == Window.whole(view)
        broken = view.lens.copy()
        broken[23] *= 1.01  # rays by another homography
        assert image_range(broken, np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]])) is None


def test_nothing_is_known_of_a_box_that_reaches_the_line_that_a_homography_takes_to_infinity():
    """Its divisor is 1 - s_x: points of a box around s_x = 1 appear beyond all that its corners do."""
    lens = lens_of(homography=(16.0, 0.0, 16.0, 0.0, -16.0, 12.0, -1.0, 0.0, 1.0))
    for x, known in ((0.8, True), (0.91, False), (1.0, False), (1.3, False)):
        found = image_range(lens, np.array([[x - 0.1, -0.1, 0.0], [x + 0.1, 0.1, 0.0]]))
        assert (found is not None) == known


numbers = st.floats(-10, 10).map(lambda x: x if abs(x) > 1e-100 else 0.0)  # squares do not flush


@given(st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers, numbers))
def test_operations_on_ranges_hold_those_on_their_numbers(a, b):
    """For the ends and a number between: a sum, a product and so on of the numbers is in the range's."""
    first, second = (Range(np.array([min(n)]), np.array([max(n)])) for n in (a, b))
    results = {
        "plus": lambda x, y: x + y,
        "minus": lambda x, y: x - y,
        "times": lambda x, y: x * y,
    }
    for name, operation in results.items():
        made = getattr(first, name)(second)
        for x in a:
            for y in b:
                assert made.low[0] <= operation(x, y) <= made.high[0]
    with np.errstate(all="ignore"):
        quotient, square, root = first.over(second), first.squared(), first.squared().root()
    if min(b) > 1e-6:
        slack = 1e-12 * max(map(abs, a)) / min(b)  # 1 / y is rounded
        assert all(quotient.low[0] - slack <= x / y <= quotient.high[0] + slack for x in a for y in b)
    elif min(b) <= 0:
        assert np.isnan(quotient.low[0])
    assert all(square.low[0] <= x * x <= square.high[0] for x in a)
    assert all(root.low[0] * (1 - 1e-15) <= abs(x) <= root.high[0] * (1 + 1e-15) for x in a)
