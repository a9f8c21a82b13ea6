"""The normal-oriented hemisphere: single points whose places, depths and weights are known."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import estimate

RADIUS, HEIGHT = 0.05, scenes.STEP  # of the ball and of the step, which lies beyond x = 0
TOWARDS = np.array([[0.8, 0.0, 0.2]])  # from 0.02 before the step 0.04 to its side and 0.01 above the floor


def occlusion(sight, points, turn=(1.0, 0.0), hole=None, **options):
    """Occlusion of the texel nearest to x = -0.02, on the floor."""
    seen = scenes.buffers("step", scenes.SIGHTS[sight](96, 72), np.float64, hole)
    j, i, _ = scenes.nearest(seen, -0.02)
    turns = np.zeros((2, 72, 96)) + np.reshape(turn, (2, 1, 1))
    return estimate("oriented-hemisphere", replace(seen, turns=turns), RADIUS, points, **options).texture[j, i]


@pytest.mark.parametrize("sight", ["orthographic", "perspective"])
def test_a_point_under_the_step_has_the_weight_of_the_range_check(sight):
    part = RADIUS / HEIGHT
    for check, weight in (("none", 1.0), ("distance", 0.0), ("smoothstep", part * part * (3 - 2 * part))):
        for points, share in ((TOWARDS, 1), (TOWARDS * [1, 1, -1], 1), (np.vstack([TOWARDS, -TOWARDS]), 0.5)):
            assert occlusion(sight, points, range_check=check) == pytest.approx(share * weight, abs=1e-9)


def test_a_bias_asks_for_a_surface_that_is_nearer_by_that():
    nearer = (HEIGHT - 0.01) / RADIUS  # the step's top is so much nearer than the point, in radii
    for bias, hidden in ((0.0, 1), (nearer - 1e-6, 1), (nearer + 1e-6, 0)):
        assert occlusion("orthographic", TOWARDS, bias=bias, range_check="none") == hidden


def test_points_turn_with_the_frame_of_a_normal():
    """n = z, and r = x, y, -x, -y: t = r and b = n x t, so the step is towards t, -b, -t, b."""
    x, z = TOWARDS[0, 0], TOWARDS[0, 2]
    for k, turn in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
        for m, place in enumerate(((x, 0, z), (0, -x, z), (-x, 0, z), (0, x, z))):
            assert occlusion("orthographic", np.array([place]), turn, range_check="none") == (k == m)


def test_background_hides_where_it_is_at_the_eye():
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](96, 72), np.float64)
    hole = seen.positions[..., 0] > 0.01
    for check, weight in (("none", 1.0), ("distance", 0.0), ("smoothstep", 0.0)):
        for background, factor in (("open", 0.0), ("occludes", 1.0)):
            made = occlusion("orthographic", TOWARDS, hole=hole, range_check=check, background=background)
            assert made == factor * weight


def test_a_normal_along_the_random_vector_has_no_frame_and_no_point_an_image():
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](8, 6), np.float64)
    normals = np.where(np.isfinite(seen.depth)[..., None], [1.0, 0.0, 0.0], 0.0)
    made = estimate("oriented-hemisphere", replace(seen, normals=normals), RADIUS, TOWARDS, background="occludes")
    assert not made.texture.any()
    assert made.outside == np.isfinite(seen.depth).sum()
