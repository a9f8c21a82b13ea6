"""Volumetric Obscurance and horizon-based AO: their parts against the reference, and exact values."""

from dataclasses import replace
from itertools import pairwise
from math import pi, sqrt

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import filled_ball, sunflower
from reference import raycast

from lfssao import Camera, InputError, estimate
from lfssao.optics.kernels.directions import write_directions
from lfssao.optics.kernels.display import trace_texels
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.kernels.rays import Rays
from lfssao.samples import repulsion_table

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


# The parts that no texture shows


@both
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_viewing_directions_equal_the_reference(sight, dtype):
    view = scenes.SIGHTS[sight](7, 40).view
    if sight == "display":
        v, u = (n.ravel() + 0.5 for n in np.mgrid[:40, :7])
        lines = np.empty((280, 6))
        trace_texels(view.lens, u, v, lines)
        dx, dy = lines[:, 2], lines[:, 3]
    else:
        _, _, dx, dy, _, _ = raycast.texel_rays(*view.rays, 7, 40)
    x, y, z = ((row[0] * dx + row[1] * dy) + row[2] for row in view.world_from_cast.tolist())
    length = np.sqrt((x * x + y * y) + z * z)
    made = np.empty((40, 7, 3), dtype)
    write_directions(view.rays, np.ravel(view.world_from_cast), made)
    assert_same_bits(made, np.stack([x / length, y / length, z / length], -1).reshape(40, 7, 3).astype(dtype))


def test_a_texel_that_looks_nowhere_has_no_direction():
    made = np.ones((2, 3, 3), np.float32)
    pinhole = Rays(MATRIX, np.array([np.nan, 1.0, 1.0, 1.0, 1.0, 2.0, 0.0, 0.0]))
    write_directions(pinhole, np.eye(3, 4).ravel(), made)
    assert not made.any()


# Exact values


@both
@pytest.mark.parametrize("name", ["vo-points", "vo-lines", "vo-area"])
@pytest.mark.parametrize("sight", ["orthographic", "perspective", "crossed slits", "display"])
def test_a_plane_through_the_point_hides_half_and_nothing_above_it(name, sight, dtype):
    seen = scenes.buffers("facing plane", scenes.SIGHTS[sight](), dtype)
    inner = np.s_[12:-12, 14:-14]
    points = filled_ball(3) if name == "vo-points" else np.concatenate([sunflower(5), -sunflower(5)])
    assert estimate(name, seen, 0.1, points).texture[inner] == pytest.approx(0.5, abs=2e-5)
    assert estimate(f"{name}-normal", seen, 0.1, points).texture[inner] == pytest.approx(0.0, abs=2e-5)
    if sight == "orthographic":
        assert estimate("hbao", seen, 0.1).texture[inner].max() < 1e-5


def test_thickness_leaves_a_slab():
    """A plane of thickness T through P hides 3/4 (tau - tau^3 / 3) of the ball, tau = T / R, and 1/2 from R on."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS["orthographic"](), np.float64)
    radius, middle = 0.1, (18, 24)
    for tau in (0.1, 0.5, 1.0, 2.0):
        want = 0.75 * (min(tau, 1) - min(tau, 1) ** 3 / 3)
        lines = estimate("vo-lines", seen, radius, sunflower(3000), thickness=tau * radius)
        points = estimate("vo-points", seen, radius, filled_ball(4000), thickness=tau * radius)
        area = estimate("vo-area", seen, radius, sunflower(3000), thickness=tau * radius)
        assert lines.texture[middle] == pytest.approx(want, abs=2e-3)
        assert area.texture[middle] == pytest.approx(want, abs=2e-3)
        assert points.texture[middle] == pytest.approx(want, abs=0.03)  # 5 standard errors


@both
def test_an_area_without_spread_is_a_line(dtype):
    """Over a plane that faces the viewers M2 - M1^2 is rounding alone: areas of any size give the lines' occlusion."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS["crossed slits"](), dtype)
    inner = np.s_[15:-15, 20:-20]
    for points in (sunflower(1), sunflower(5)):
        for values in ({}, {"thickness": 0.03}):
            line = estimate("vo-lines", seen, 0.05, points, **values).texture[inner]
            assert estimate("vo-area", seen, 0.05, points, **values).texture[inner] == pytest.approx(line, abs=1e-5)


def test_the_box_has_the_variance_of_the_area():
    """One area over a tilted plane: the share hidden of one line by a box of half-width h = sqrt(3) sigma about P."""
    seen = scenes.buffers("concave crease", scenes.SIGHTS["orthographic"](240, 60), np.float64)
    texel, radius = scenes.nearest(seen, 0.0)[:2], 0.1
    value = estimate("vo-area", seen, radius, np.zeros((1, 2))).texture[texel]
    # |x| over a square of area pi R^2: mean s / 4 and variance s^2 / 48, s = sqrt(pi) R, here towards the viewer.
    side = sqrt(pi)
    low, high = -side / 4 - sqrt(3 / 48) * side, -side / 4 + sqrt(3 / 48) * side
    want = ((1 - max(high, -1)) + (min(high, 1) - max(low, -1)) / 2) / 2
    assert value == pytest.approx(want, abs=0.05)  # the pyramid's squares are not centred on P
    narrow = estimate("vo-area", seen, radius, np.zeros((1, 2)), half_width=0.0).texture[texel]
    assert narrow == pytest.approx((1 + side / 4) / 2, abs=0.05)


def test_weights_are_those_of_cells_not_of_lengths():
    """The fraction of each line counts, times its weight: z_s is in the weight, and not a second time."""
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](120, 40), np.float64)
    points, weights = np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 0.9]]), np.array([2.0, 1.0, 1.0])
    texel = scenes.nearest(seen, -0.02)[:2]
    # The first line meets the step's top, 0.125 before P and above the ball: it is hidden whole; the others by half.
    made = estimate("vo-lines", seen, 0.1, points, weights, randomize=False).texture[texel]
    assert made == pytest.approx((2 * 1.0 + 1 * 0.5 + 1 * 0.5) / 4, abs=1e-6)
    equal = estimate("vo-lines", seen, 0.1, points, 7 * weights, randomize=False).texture[texel]
    assert equal == pytest.approx(made, abs=1e-12)


@pytest.mark.parametrize("name", ["vo-points", "vo-lines", "vo-area"])
def test_two_radii_multiply_or_take_the_smaller(name):
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["crossed slits"](24, 18), np.float64)
    one, two = (estimate(name, seen, r).texture for r in (0.2, 0.05))
    product = estimate(name, seen, 0.2, second=0.25).texture
    least = estimate(name, seen, 0.2, second=0.25, combine="minimum").texture
    there = np.isfinite(seen.depth)
    np.testing.assert_allclose(product[there], 1 - ((1 - one) * (1 - two))[there], atol=1e-12)
    assert np.array_equal(least, np.maximum(one, two))
    assert not np.array_equal(least, one)
    assert not np.array_equal(least, two)


@pytest.mark.parametrize(("name", "dimensions"), [("vo-points", 3), ("vo-lines", 2), ("vo-area", 2)])
@pytest.mark.parametrize("weights", [[1.0, -1.0], [0.0, 0.0]])
def test_weights_that_cannot_be_are_refused(name, dimensions, weights):
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](4, 3))
    with pytest.raises(InputError, match="weights"):
        estimate(name, seen, 0.1, np.zeros((2, dimensions)), np.array(weights))


def test_lines_of_no_length_hide_nothing():
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](4, 3))
    assert not estimate("vo-lines", seen, 0.1, np.array([[1.0, 0.0], [0.0, 1.0]])).texture.any()


# VO's claims for its samples (4.1, 4.5, 5), on a small scene; ``benchmarks/papers_vo.py`` has a large one


def moved_to_the_right(texels):
    """A sphere on a plane as the orthographic sight sees it from so many texels further right, 96 x 72."""
    sight, step = scenes.SIGHTS["orthographic"](96, 72), texels * 0.75 / 72
    view = Camera("orthographic", (step, 0, 2), (step, 0, 0), (0, 1, 0), 0.75, 1.0, 3.0).view(96, 72)
    return scenes.buffers("sphere on a plane", replace(sight, view=view, origin=sight.origin + np.array([step, 0, 0])))


def rms(difference):
    return np.sqrt(np.mean(difference**2))


def test_5_lines_err_less_than_12_points_and_change_less_when_the_camera_moves():
    seen = [moved_to_the_right(shift) for shift in (0.0, 0.25, 0.5, 0.75)]
    truth = estimate("vo-lines", seen[0], 0.12, sunflower(1000)).texture
    inside = np.s_[12:-12, 12:-12]
    error, change = {}, {}
    for name, n, domain in (("vo-lines", 5, "disk"), ("vo-points", 12, "ball"), ("vo-points", 13, "ball")):
        table = repulsion_table(domain, n)
        made = [estimate(name, b, 0.12, table.points, table.weights, randomize=False).texture[inside] for b in seen]
        error[n] = np.mean(
            [rms(estimate(name, seen[0], 0.12, table.points, table.weights, seed=k).texture[inside] - truth[inside])
             for k in range(5)]
        )  # fmt: skip
        change[n] = np.mean([rms(b - a) for a, b in pairwise(made)])
    assert error[5] < error[12] < error[13]
    assert change[5] < change[12]
