"""The image of a box on any display: no point of the box, and no ray that meets it, is left out."""

import numpy as np
import pytest
import test_display
from hypothesis import given, settings
from hypothesis import strategies as st

from lfssao import find_display
from lfssao.display_window import Range, image_range
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
