"""How far the images of a tile's points lie apart, of modules of any display: bounds that hold and are worth it."""

import display_twin
import numpy as np
import pytest
import test_display
import tiles_twin
from hypothesis import given, settings
from hypothesis import strategies as st
from test_ssao import assert_same_bits

from lfssao import make_samples
from lfssao.kernels import tiled_ssao
from lfssao.kernels.display import physical_to_image
from lfssao.kernels.tile_images import BLOCK, SLOPES, middle_of
from lfssao.tile_slopes import tile_slopes

pytestmark = pytest.mark.usefixtures("one_thread")

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
PLAIN = np.eye(3, 4).ravel()


def points_of(rng, middle, size, n, dtype):
    """Points of a box, its corners among them."""
    share = rng.uniform(-1, 1, (n, 3))
    share[: n // 2] = np.sign(share[: n // 2])
    return (middle + size * share).astype(dtype)


def slopes_of(numbers, offsets, points):
    """The one tile's slopes and box."""
    box = np.stack([points.min(axis=0), points.max(axis=0)], axis=1).ravel()
    return tile_slopes(numbers, offsets, box.reshape(1, 1, 6))[0, 0], box


def worst(numbers, offsets, points, rounded=True):
    """Shares of what u and v of a tile's points are off the middle's, of what is said at most; None if nothing is.

    ``rounded``: whether what is said of rounding is reckoned with.
    """
    slopes, _ = slopes_of(numbers, offsets, points)
    slopes[[3, 7]] *= rounded
    if np.isnan(slopes[:8]).any():
        return None
    *middle, of_u, of_v = tiles_twin.middle_of(points, slopes)
    found = []
    for offset in offsets:  # the mapping's affine half leaves points and samples as they are
        u, v, answer = physical_to_image(numbers[12:], *(np.asarray(middle) + offset))
        assert answer == display_twin.VALID
        for point in points + offset:
            a, b, answer = physical_to_image(numbers[12:], *point)
            assert answer == display_twin.VALID
            found.append((abs(float(a) - float(u)) / float(of_u), abs(float(b) - float(v)) / float(of_v)))
    return np.max(found, axis=0)


@both
@settings(max_examples=80)
@given(
    display=test_display.displays(),
    size=st.sampled_from([0.0, 1e-7, 1e-6, 1e-4, 0.003, 0.02]),
    radius=st.sampled_from([0.0, 1e-3, 0.03]),
    seed=st.integers(0, 2**32),
)
def test_images_of_all_points_lie_around_the_middles(dtype, display, size, radius, seed):
    """Also where boxes reach the lens, the observers or where the screen ends: there nothing must be said."""
    rng = np.random.default_rng(seed)
    lens = display.module_numbers(0)
    numbers = np.concatenate([PLAIN, lens]).astype(dtype)
    offsets = (radius * rng.uniform(-1, 1, (3, 3))).astype(dtype)
    for ends in ([-0.2, 0.2], [lens[4], lens[2]]):
        middle = rng.uniform([-0.5, -0.4, ends[0]], [0.5, 0.4, ends[1]])
        points = points_of(rng, middle, size * rng.uniform(0, 1, 3), 16, dtype)
        made = worst(numbers, offsets, points)
        assert made is None or (made <= 1).all()


@both
@settings(max_examples=60)
@given(data=st.data())
def test_numbers_of_no_display_are_not_reckoned_with_or_held(dtype, data):
    """Ties, singular planes, numbers that overflow: nothing fails, and what is said holds."""
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    with np.errstate(all="ignore"):
        numbers = np.concatenate([PLAIN, test_display.numbers_of_any_kind(data.draw, dtype)]).astype(dtype)
        points = points_of(rng, data.draw(test_display.coordinates(dtype)), 0.01, 8, dtype)
        made = worst(numbers, np.zeros((1, 3), dtype), points)
    assert made is None or (made <= 1).all()


def test_products_that_float32_does_not_hold_are_not_reckoned_with():
    """The image is a place in exact arithmetic, but not of the homography's float32 products."""
    lens = test_display.PRESETS["picoarray"].module_numbers(36)
    points = points_of(np.random.default_rng(1), [0.0, 30.0, 0.1], 0.01, 8, np.float32)
    lens[8:17], lens[20:22] = 1e35 * lens[8:17], 0.0
    exact = display_twin.physical_to_image(lens, *points[0].astype(np.float64))
    assert exact[2] == display_twin.VALID
    assert np.isfinite(exact[:2]).all()
    numbers = np.concatenate([PLAIN, lens]).astype(np.float32)
    assert np.isinf(physical_to_image(numbers[12:], *points[0])[1])
    assert worst(numbers, np.zeros((1, 3), np.float32), points) is None


@pytest.mark.parametrize(("name", "index"), [("convex", 24), ("convex", 2), ("sample-b", 0), ("picoarray", 36)])
@both
def test_bounds_of_presets_are_not_much_wider_than_what_images_do(dtype, name, index):
    numbers = np.concatenate([PLAIN, test_display.PRESETS[name].module_numbers(index)]).astype(dtype)
    rng, offsets = np.random.default_rng(2), (0.02 * make_samples("latin", 8)).astype(dtype)
    made = [worst(numbers, offsets, points_of(rng, rng.uniform(-0.1, 0.1, 3), 0.004, 40, dtype)) for _ in range(3)]
    assert np.min(made) > 0.8
    assert np.max(made) <= 1


@pytest.mark.parametrize(
    ("name", "index", "place"), [("convex", 24, [0.015, -0.273, -0.225]), ("picoarray", 0, [-0.082, -0.009, 0.098])]
)
def test_points_next_to_each_other_lie_apart_by_rounding(name, index, place):
    numbers = np.concatenate([PLAIN, test_display.PRESETS[name].module_numbers(index)]).astype(np.float32)
    points, offsets = points_of(np.random.default_rng(3), place, 3e-8, 40, np.float32), np.zeros((1, 3), np.float32)
    made = worst(numbers, offsets, points)
    assert 0.001 < made.max() <= 1
    assert worst(numbers, offsets, points, rounded=False).max() > 1


def test_where_optics_fold_nothing_is_said():
    lens, said = test_display.PRESETS["convex"].module_numbers(24), []
    lens[20:23] = -0.3, 0.0, 1 / 0.9
    numbers, rng = np.concatenate([PLAIN, lens]).astype(np.float32), np.random.default_rng(6)
    for x in np.linspace(0.3, 0.9, 40):
        made = worst(numbers, np.zeros((1, 3), np.float32), points_of(rng, [x, 0, 0], 0.02, 16, np.float32))
        said.append(made is not None)
        assert made is None or (made <= 1).all()
    assert 10 < sum(said) < 30
    assert said == sorted(said, reverse=True)


def test_a_conical_diffuser_on_a_curved_screen_is_no_display():
    lens, points = test_display.PRESETS["sample-b"].module_numbers(20), np.zeros((1, 3), np.float32)
    for number, said in ((0, True), (5, False), (6, False)):
        lens[number] += 0.1
        assert (worst(np.concatenate([PLAIN, lens]).astype(np.float32), points, points) is not None) == said


def test_slopes_are_those_of_blocks_of_tiles():
    """Of the box around the tiles of a block that have points; of others they are not known."""
    numbers = np.concatenate([PLAIN, test_display.PRESETS["convex"].module_numbers(24)]).astype(np.float32)
    offsets, rng = (0.02 * make_samples("latin", 8)).astype(np.float32), np.random.default_rng(4)
    boxes = np.empty((2 * BLOCK + 1, 3 * BLOCK, 6), np.float32)
    boxes[..., ::2], boxes[..., 1::2] = np.inf, -np.inf
    for place in [(0, 0), (1, 1), (0, 2 * BLOCK), (2 * BLOCK, 1)]:
        points = points_of(rng, rng.uniform(-0.1, 0.1, 3), 0.01, 8, np.float32)
        boxes[place] = slopes_of(numbers, offsets, points)[1]
    boxes[1, 2 * BLOCK + 1] = [0, np.inf] * 3
    made = tile_slopes(numbers, offsets, boxes)
    assert made.shape == (3, 3, SLOPES)
    known = np.isfinite(made[..., :8]).all(axis=2)
    assert known.tolist() == [[True, False, False], [False, False, False], [True, False, False]]
    assert np.isnan(made[~known]).all()
    both = np.stack([boxes[0, 0], boxes[1, 1]])
    around = np.stack([both[:, ::2].min(axis=0), both[:, 1::2].max(axis=0)], axis=1).ravel()
    assert_same_bits(made[0, 0], tile_slopes(numbers, offsets, around.reshape(1, 1, 6))[0, 0])


@both
def test_boxes_of_tiles(dtype):
    rng = np.random.default_rng(5)
    depth, positions = rng.uniform(-0.1, 0.1, (13, 30)).astype(dtype), rng.uniform(-1, 1, (13, 30, 3)).astype(dtype)
    depth[rng.random(depth.shape) < 0.2], depth[:8, 8:16] = np.inf, np.inf
    positions[rng.random(positions.shape) < 0.02] = rng.choice([np.nan, np.inf, -3.0])
    m = rng.uniform(-1, 1, 44).astype(dtype)
    boxes = np.empty((2, 4, 6), dtype)
    tiled_ssao.tile_boxes(depth, positions, m, BLOCK, boxes)
    np.testing.assert_array_equal(boxes, tiles_twin.boxes(depth, positions, m))


@both
@given(seed=st.integers(0, 2**32))
def test_middles_of_tiles_equal_the_twin_and_lie_between_the_points(dtype, seed):
    """Also where a point has NaN and numbers, far from all others."""
    rng = np.random.default_rng(seed)
    points, slopes = rng.uniform(-0.01, 0.01, (64, 3)).astype(dtype), rng.uniform(-2, 2, 2 * SLOPES).astype(dtype)
    if rng.random() < 0.7:
        points[5, 2], points[5, 0] = 0.2, np.nan
    points[rng.random(64) < 0.2] = np.nan
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    box = tuple(np.stack([low, high], axis=1).ravel())
    made = middle_of(64, *np.ascontiguousarray(points.T), box, slopes, 1)
    assert_same_bits(np.array(made, dtype), np.array(tiles_twin.middle_of(points, slopes[SLOPES:]), dtype))
    assert ((low <= made[:3]) & (made[:3] <= high)).all()


@pytest.mark.parametrize("every", [2, 4, 6])
def test_boxes_of_the_blocks_with_tiles_that_are_asked(every):
    rng = np.random.default_rng(6)
    depth, positions = np.zeros((140, 170), np.float32), rng.uniform(-1, 1, (140, 170, 3)).astype(np.float32)
    m, made = rng.uniform(-1, 1, 44).astype(np.float32), np.empty((18, 22, 6), np.float32)
    tiled_ssao.tile_boxes(depth, positions, m, every, made)
    every_tile = np.empty_like(made)
    tiled_ssao.tile_boxes(depth, positions, m, BLOCK, every_tile)
    asked = np.zeros((18, 22), bool)
    for k, row in enumerate(range(0, 18, every)):
        for column in range(k % every, 22, every):
            corner = row // BLOCK * BLOCK, column // BLOCK * BLOCK
            asked[corner[0] : corner[0] + BLOCK, corner[1] : corner[1] + BLOCK] = True
    assert asked.mean() < 0.3 or every == BLOCK
    nothing = np.array([np.inf, -np.inf] * 3, np.float32)
    np.testing.assert_array_equal(made, np.where(asked[..., None], every_tile, nothing))
