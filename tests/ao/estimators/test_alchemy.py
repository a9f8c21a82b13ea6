"""Alchemy AO: where taps land, and how far the viewers are."""

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import estimate


@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_the_distance_from_the_viewers_is_along_the_axis_of_depth(sight):
    """Cameras stand at z = 2 and look down; the modules' observers stand at physical z = -2, world z = 2."""
    seen = scenes.buffers("tilted plane", scenes.SIGHTS[sight](6, 5))
    row = seen.view.viewer_distance()
    found = seen.positions @ row[:3] + row[3]
    np.testing.assert_allclose(found, 2 - seen.positions[..., 2], rtol=0, atol=1e-12)


@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_taps_land_on_the_disk_that_faces_the_viewer(sight):
    """On a surface at right angles to a texel's ray all taps are in the surface: v . n = 0 but for the texels' size."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS[sight](96, 72))
    assert not estimate("alchemy", seen, 0.1, beta=0.0).texture.any()
    step = scenes.buffers("step", scenes.SIGHTS[sight](96, 72))
    made = estimate("alchemy", step, 0.1, beta=0.0).texture
    near = scenes.nearest(step, -0.03)[:2]
    far = scenes.nearest(step, -0.2)[:2]
    assert made[near] > 0.1
    assert made[far] == 0


@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_an_infinite_epsilon_occludes_nothing(sight):
    """Epsilon R^2 is beyond float32; each term is over it."""
    seen = scenes.buffers("step", scenes.SIGHTS[sight](), np.float32)
    assert not estimate("alchemy", seen, 1e30).texture.any()
