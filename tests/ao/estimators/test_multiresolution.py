"""Multi-resolution occlusion: what follows from its definition."""

import analytic_scenes as scenes
import pytest

from lfssao import estimate


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
