"""The normal-oriented hemisphere: a texel without a frame."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np

from lfssao import estimate


def test_a_normal_along_the_random_vector_has_no_frame_and_no_point_an_image():
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](8, 6), np.float64)
    normals = np.where(np.isfinite(seen.depth)[..., None], [1.0, 0.0, 0.0], 0.0)
    points = np.array([[0.8, 0.0, 0.2]])
    made = estimate("oriented-hemisphere", replace(seen, normals=normals), 0.05, points, background="occludes")
    assert not made.texture.any()
    assert made.outside == np.isfinite(seen.depth).sum()
