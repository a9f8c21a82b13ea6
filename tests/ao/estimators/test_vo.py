"""Volumetric Obscurance and horizon-based AO: their parts against the reference, and exact values."""

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import filled_ball, sunflower
from reference import raycast

from lfssao import InputError, estimate
from lfssao.optics.kernels.display import trace_texels
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.kernels.rays import Rays, write_directions

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
        dx = lines[:, 2]
        dy = lines[:, 3]
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
    write_directions(scenes.SIGHTS["perspective"](3, 2).view.rays, np.zeros(12), made)
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
    if name != "vo-area":
        assert estimate(f"{name}-normal", seen, 0.1, points).texture[inner] == pytest.approx(0.0, abs=2e-5)
    if sight == "orthographic":
        assert estimate("hbao", seen, 0.1).texture[inner].max() < 1e-5


@pytest.mark.parametrize(("name", "dimensions"), [("vo-points", 3), ("vo-lines", 2), ("vo-area", 2)])
@pytest.mark.parametrize("weights", [[1.0, -1.0], [0.0, 0.0]])
def test_weights_that_cannot_be_are_refused(name, dimensions, weights):
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](4, 3))
    with pytest.raises(InputError, match="weights"):
        estimate(name, seen, 0.1, np.zeros((2, dimensions)), np.array(weights))
