"""Points followed from module to module: textures of known content, and what walls between them hide."""

import bench_agreement
import numpy as np
import pytest

from lfssao import Mesh, RayCaster, find_display
from lfssao.errors import InputError
from lfssao.viz import agreement

WORLD = np.eye(3, 4)
DISPLAY = find_display("sample-a").with_resolution(80, 48)


def scene():
    """A card, |x| < 0.1 and |y| < 0.1 at z = -0.2, before a wall at z = 0.2."""
    card = np.array([[-0.1, -0.1, -0.2], [0.1, -0.1, -0.2], [0.1, 0.1, -0.2], [-0.1, 0.1, -0.2]])
    wall = np.array([[-2.0, -2.0, 0.2], [2.0, -2.0, 0.2], [2.0, 2.0, 0.2], [-2.0, 2.0, 0.2]])
    return Mesh(np.concatenate([card, wall]), [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])


@pytest.fixture(scope="module")
def seen():
    views = [DISPLAY.view(k, WORLD) for k in range(21)]
    caster = RayCaster(scene(), views[0].cast_from_world)
    return views, [caster.gbuffer(view) for view in views]


def test_textures_that_depend_on_the_place_alone_agree(seen):
    """The card is 1 and the wall 0 in all of them: points on either, away from edges, have no spread."""
    views, gbuffers = seen
    textures = [(g.positions[..., 2] < 0).astype(np.float32) for g in gbuffers]
    points = agreement.surface_points(gbuffers[10])
    values = agreement.over_modules(points, views, gbuffers, textures, 0.02)
    assert (np.nanmax(values[points[:, 2] < 0], axis=1) == 1).all()
    found = agreement.spread(values)
    assert (found.deviation, found.deviation_95, found.range) == (0, 0, 0)
    assert found.points > 1000
    assert 5 < found.views < 21


def test_what_a_module_does_not_see_is_left_out(seen):
    views, gbuffers = seen
    behind = np.array([[0.0, 0.0, 0.2], [0.35, 0.0, 0.2], [0.0, 0.0, -0.2], [0.0, 0.0, 5.0]])
    ones = [np.ones((48, 80), np.float32)] * 21
    values = agreement.over_modules(behind, views, gbuffers, ones, 0.02)
    assert np.isnan(values[0, 10])  # behind the card for the module in the middle
    assert values[1, 10] == values[2, 10] == 1
    assert np.isnan(values[3]).all()  # beyond the lenses
    assert np.isnan(values[2]).sum() < 21


def test_spread_by_hand():
    values = np.array([[0.0, 1.0, np.nan], [0.5, 0.5, 0.5], [np.nan, np.nan, 7.0], [0.0, 0.0, 0.3]])
    found = agreement.spread(values)
    deviations = [0.5, 0.0, np.sqrt(0.02)]
    np.testing.assert_allclose(agreement.point_deviations(values), [0.5, 0.0, np.nan, np.sqrt(0.02)], atol=1e-15)
    assert found.points == 3
    assert found.views == pytest.approx(8 / 3)
    assert found.deviation == pytest.approx(np.mean(deviations))
    assert found.range == pytest.approx(1.3 / 3)
    assert found.deviation_95 == pytest.approx(np.percentile(deviations, 95))
    with pytest.raises(InputError, match="two views"):
        agreement.spread(values[2:3])


@pytest.mark.slow
def test_an_eye_that_walks_sees_each_modules_number():
    """Module k's texture is k all over: with the nearest module's, a point near the screen takes what the eye meets."""
    textures = {k: np.full((48, 80), k, np.float32) for k in range(21)}
    points = np.array([[0.0, 0.0, -0.2], [0.0, 0.0, 5.0]])
    stops = bench_agreement.path(DISPLAY, scene(), WORLD, [-0.6, 0.0, 0.6], 80)
    values = bench_agreement.along_path(points, DISPLAY, textures, stops, 0.02, "nearest")
    # The line from the eye (x, -2) through (0, -0.2) meets the lenses, z = 0.7, at -x / 2, modules 0.1 apart from -1.
    np.testing.assert_array_equal(values[0], [13, 10, 7])
    assert np.isnan(values[1]).all()
