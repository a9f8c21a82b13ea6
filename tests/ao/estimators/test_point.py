"""Point sampling with options: what they do to flat surfaces, decisions and occluders out of reach."""

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits

from lfssao import estimate, make_samples
from lfssao.ao.estimators.point import SURFACES

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@both
@pytest.mark.parametrize("sight", ["crossed slits", "display"])
def test_without_options_it_is_lf_on_modules(dtype, sight):
    seen = scenes.buffers("step", scenes.SIGHTS[sight](), dtype)
    one, other = estimate("lf", seen, 0.1), estimate("point", seen, 0.1)
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


def line7_differences(seen, points):
    """How many decisions, one a texel and sample, the two forms of LF's line 7 take differently."""
    made = [[estimate("point", seen, 0.1, one[None], surface=form).texture for one in points] for form in SURFACES]
    return np.count_nonzero(np.array(made[0]) != np.array(made[1]))


@both
def test_the_two_forms_of_line_7_differ_by_rounding_only(dtype):
    """A camera's depth is no coordinate: samples at the point itself hang on its last bit, those off it on nothing."""
    at, off = np.zeros((1, 3)), np.array([[0.6, 0.2, 0.4], [0.1, -0.6, 0.5], [-0.3, 0.1, -0.6]])
    camera = scenes.buffers("facing plane", scenes.SIGHTS["perspective"](24, 18), dtype)
    tilted = scenes.buffers("tilted plane", scenes.SIGHTS["perspective"](24, 18), dtype)
    assert line7_differences(camera, off) == 0
    assert 0 < line7_differences(tilted, at) < 24 * 18
    assert line7_differences(tilted, np.concatenate([at, at])) == 2 * line7_differences(tilted, at)
    module = scenes.buffers("tilted plane", scenes.SIGHTS["crossed slits"](24, 18), dtype)
    assert line7_differences(module, at) == 0  # its depth is the position's -z, which no rounding moves


def test_an_occluder_out_of_reach_is_ignored():
    """Before a step of height h the terrace hides what is beyond its edge: not once sqrt(l^2 + h^2) > R everywhere."""
    shell = make_samples("jittered", 2048, 3)
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](96, 72))
    j, i, _ = scenes.nearest(seen, -0.05)
    assert estimate("hemisphere", seen, 0.12, shell).texture[j, i] > 0.05
    assert estimate("hemisphere", seen, 0.12, shell, range_check=True).texture[j, i] == 0  # h = 0.125
    assert estimate("point", seen, 0.12, shell, range_check=True).texture[j, i] < 0.5
    far = estimate("hemisphere", seen, 0.3, shell, range_check=True).texture[j, i]
    assert 0 < far < estimate("hemisphere", seen, 0.3, shell).texture[j, i]
