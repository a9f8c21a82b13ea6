"""Point sampling: what its options do to flat surfaces, and without them the occlusion of lf."""

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits

from lfssao import estimate, make_samples

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@both
@pytest.mark.parametrize("sight", ["crossed slits", "display"])
def test_without_options_it_is_lf_on_modules(dtype, sight):
    seen = scenes.buffers("step", scenes.SIGHTS[sight](), dtype)
    one = estimate("lf", seen, 0.1)
    other = estimate("point", seen, 0.1)
    assert_same_bits(other.texture, one.texture)
    assert other.outside == one.outside


@both
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_a_remapped_flat_surface_is_open(dtype, sight):
    """One of each pair +d, -d lies behind; near the border samples leave the texture, which opens it further."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS[sight](), dtype)
    points = make_samples("latin", 50)
    points = np.concatenate([points, -points])
    assert not estimate("point", seen, 0.05, points, remap=True).texture.any()
    assert estimate("point", seen, 0.05, points).texture[18, 24] == 0.5
    assert not estimate("hemisphere", seen, 0.05).texture.any()
