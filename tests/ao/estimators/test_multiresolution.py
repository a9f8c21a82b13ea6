"""Multi-resolution occlusion: its parts by hand, and what follows from its definition."""

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import estimate
from lfssao.ao.estimators.kernels import multiresolution as kernels
from lfssao.ao.estimators.multiresolution import COMBINATIONS


def test_a_coarse_texel_is_the_lower_median_of_those_that_see_a_surface():
    depth = np.array([[4.0, 1, np.inf, 7, 5], [3, 2, 6, 6, np.inf], [np.inf, np.inf, 9, np.inf, 8]])
    fine, coarse = np.empty((3, 5), np.int32), np.empty((2, 3), np.int32)
    kernels.first_level(depth, fine)
    assert fine.tolist() == [[0, 1, -1, 3, 4], [5, 6, 7, 8, -1], [-1, -1, 12, -1, 14]]
    kernels.halve(depth, fine, coarse)
    assert coarse.tolist() == [[6, 8, 4], [-1, 12, 14]]  # of 1 2 3 4 the 2; of 6 6 7 the second


@pytest.mark.parametrize("sight", scenes.SIGHTS)
@pytest.mark.parametrize("surface", ["facing plane", "tilted plane", "convex crease"])
def test_flat_and_convex_surfaces_are_open_at_every_resolution(sight, surface):
    seen = scenes.buffers(surface, scenes.SIGHTS[sight]())
    assert estimate("multiresolution", seen, 0.3).texture.max() < 1e-12


def test_coarser_levels_see_farther():
    """A wall that the square of the finest level does not reach."""
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](64, 48))
    one, four = (estimate("multiresolution", seen, 0.3, levels=n, combine="maximum").texture for n in (1, 4))
    j, i, _ = scenes.nearest(seen, -0.1)
    assert one[j, i] == 0
    assert four[j, i] > 0.02
    assert (four >= one).all()


def test_upsampling_stops_at_edges():
    """On the terrace, beside the edge, the floor's occlusion does not leak in."""
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](64, 48))
    made = estimate("multiresolution", seen, 0.2).texture
    upper = seen.positions[..., 2] > 0.1
    assert made[~upper].max() > 0.05
    assert made[upper].max() < 1e-3


def test_combinations():
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["display"]())
    made = {how: estimate("multiresolution", seen, 0.2, combine=how).texture for how in COMBINATIONS}
    assert (made["average"] <= made["maximum"] + 1e-12).all()
    expected = 1 - (1 - made["maximum"]) * (1 - made["average"])
    np.testing.assert_allclose(made["both"], expected, rtol=0, atol=1e-15)
    assert made["both"].max() > made["maximum"].max() > made["average"].max() > 0.05
