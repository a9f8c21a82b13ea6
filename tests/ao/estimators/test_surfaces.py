"""Consequences of the estimators' definitions on surfaces with known answers, and the viewing directions."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import filled_ball, sunflower
from reference import raycast

from lfssao import InputError, estimate, make_samples
from lfssao.optics.kernels.display import trace_texels
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.kernels.rays import Rays, write_directions

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


# Viewing directions


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
    write_directions(scenes.SIGHTS["perspective"](3, 2).view.rays, np.zeros(12), made)
    assert not made.any()


# Volumetric Obscurance and horizon-based AO


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


@pytest.mark.parametrize(("name", "dimensions"), [("vo-points", 3), ("vo-lines", 2), ("vo-area", 2)])
@pytest.mark.parametrize("weights", [[1.0, -1.0], [0.0, 0.0]])
def test_weights_that_cannot_be_are_refused(name, dimensions, weights):
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](4, 3))
    with pytest.raises(InputError, match="weights"):
        estimate(name, seen, 0.1, np.zeros((2, dimensions)), np.array(weights))


# Points in the ball


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


# Alchemy


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
    near, far = scenes.nearest(step, -0.03)[:2], scenes.nearest(step, -0.2)[:2]
    assert made[near] > 0.1
    assert made[far] == 0


@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_an_infinite_epsilon_occludes_nothing(sight):
    """Epsilon R^2 is beyond float32; each term is over it."""
    seen = scenes.buffers("step", scenes.SIGHTS[sight](), np.float32)
    assert not estimate("alchemy", seen, 1e30).texture.any()


# Several resolutions


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


# The hemisphere around the normal

RADIUS, HEIGHT = 0.05, scenes.STEP  # of the ball and of the step, which lies beyond x = 0
TOWARDS = np.array([[0.8, 0.0, 0.2]])  # from 0.02 before the step 0.04 to its side and 0.01 above the floor


@pytest.mark.parametrize("sight", ["orthographic", "perspective"])
def test_a_point_under_the_step_has_the_weight_of_the_range_check(sight):
    part, seen = RADIUS / HEIGHT, scenes.buffers("step", scenes.SIGHTS[sight](96, 72))
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
