"""The normal-oriented hemisphere: the weights of the range check, and a texel without a frame."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import estimate

RADIUS, HEIGHT = 0.05, scenes.STEP  # of the ball and of the step, which lies beyond x = 0
TOWARDS = np.array([[0.8, 0.0, 0.2]])  # from 0.02 before the step 0.04 to its side and 0.01 above the floor


@pytest.mark.parametrize("sight", ["orthographic", "perspective"])
def test_a_point_under_the_step_has_the_weight_of_the_range_check(sight):
    part = RADIUS / HEIGHT
    seen = scenes.buffers("step", scenes.SIGHTS[sight](96, 72))
    j, i, _ = scenes.nearest(seen, -0.02)
    for check, weight in (("none", 1.0), ("distance", 0.0), ("smoothstep", part * part * (3 - 2 * part))):
        for points, share in ((TOWARDS, 1), (TOWARDS * [1, 1, -1], 1), (np.vstack([TOWARDS, -TOWARDS]), 0.5)):
            made = estimate("oriented-hemisphere", seen, RADIUS, points, range_check=check).texture
            assert made[j, i] == pytest.approx(share * weight, abs=1e-9)


def test_a_normal_along_the_random_vector_has_no_frame_and_no_point_an_image():
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](8, 6), np.float64)
    normals = np.where(np.isfinite(seen.depth)[..., None], [1.0, 0.0, 0.0], 0.0)
    made = estimate("oriented-hemisphere", replace(seen, normals=normals), RADIUS, TOWARDS, background="occludes")
    assert not made.texture.any()
    assert made.outside == np.isfinite(seen.depth).sum()
