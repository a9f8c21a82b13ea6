"""The parts of the estimators' error, on a floor seen from straight above: each against a value known apart.

The floor is z = 0; beside the view stands a wall, or a plate hangs above one half of it. cap, shell and segment are
closed forms of ``lfssao.ao.estimators.point`` and ``lfssao.ao.ground_truth``, of a distance in radii.
"""

import json
from functools import cache
from math import pi

import error_parts
import layers
import numpy as np
import pytest
from analytic_scenes import strip
from error_parts import PARTS, Sight, parts_of, shares_of, stages_of

import lfssao
from lfssao import Camera, Mesh
from lfssao.ao.estimators.registry import find_estimator
from lfssao.samples import texel_turns

R = 0.15
WIDTH = 64
HEIGHT = 48
GUARD = 16
TEXEL = 0.75 / HEIGHT
SIDE = WIDTH * TEXEL / 2  # x of the view's right border


def box(low, high):
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return Mesh(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def joined(*meshes):
    starts = np.cumsum([0, *(len(each.vertices) for each in meshes)])
    faces = [each.faces + start for each, start in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([each.vertices for each in meshes]), np.concatenate(faces))


@cache
def sight(*boxes):
    """A floor and boxes, from an orthographic camera at z = 2."""
    camera = Camera("orthographic", (0, 0, 2), (0, 0, 0), (0, 1, 0), 0.75, 1.0, 3.0)
    mesh = joined(strip((-4.0, 0.0), (4.0, 0.0)), *(box(*each) for each in boxes))
    return Sight(mesh, camera.view(WIDTH, HEIGHT), camera.view(WIDTH, HEIGHT, GUARD))


def plate(bottom, top):
    return sight(((0, -4, bottom), (4, 4, top)))


def wall():
    return sight(((SIDE, -4, -1), (4, 4, 0.5)))


def by_column(sight_, texture, distances):
    """Means over the rows that are R and more from the border, of the columns at distances left of an edge, radii."""
    inside = slice(int(R / TEXEL) + 1, -int(R / TEXEL) - 1)
    columns = np.zeros(sight_.surface.shape)
    columns[sight_.surface] = texture
    return columns[inside, distances].mean(axis=0)


def columns_before(edge):
    """Columns whose centres lie less than R left of x = edge, and their distances from it, radii."""
    x = (np.arange(WIDTH) + 0.5) * TEXEL - SIDE
    chosen = np.flatnonzero((x < edge) & (x > edge - R))
    return chosen, (edge - x[chosen]) / R


def measured(sight_, name, edge, few=((None, None), {})):
    """Parts by columns, and the distances of these."""
    parts = parts_of(stages_of(sight_, find_estimator(name), R, few), sight_.surface)
    columns, away = columns_before(edge)
    return {p: None if t is None else by_column(sight_, t, columns) for p, t in zip(PARTS, parts, strict=True)}, away


def cap(a):
    return np.where(a < 1, (1 - a) ** 2 * (2 + a) / 4, 0)


def shell(a):
    return (cap(a) - 0.8**3 * cap(a / 0.8)) / (1 - 0.8**3)


def segment(a):
    return (np.arccos(a) - a * np.sqrt(1 - a * a)) / pi


VOLUMES = {"lf": shell, "hemisphere": shell, "vo-points": cap, "vo-points-normal": cap, "vo-lines": cap}


@pytest.mark.parametrize("name", [*VOLUMES, "vo-lines-normal", "oriented-hemisphere"])
def test_what_hides_behind_a_plate_that_is_out_of_reach(name):
    """A plate whose bottom is farther than R hides a depth texture's samples, and nothing of the rays."""
    parts, away = measured(plate(0.25, 0.375), name, 0.0)
    known = VOLUMES.get(name, cap)(away)
    if name == "oriented-hemisphere":  # its range check sees the plate's top
        x = R / 0.375
        known = known * (x * x * (3 - 2 * x))
    assert parts["missing layers"] == pytest.approx(known, abs=0.025)
    assert parts["missing layers"].sum() == pytest.approx(known.sum(), rel=0.05)
    for other in ("form", "integrand"):
        assert parts[other] == pytest.approx(0 * away, abs=0.01)


def over_directions(away, value, end, behind=0.0):
    """Mean over directions of a value of the distance, radii, at which each passes the plate's edge, up to an end.

    behind: how far behind the edge, along x, a texel has its centre.
    """
    angles = (np.arange(4096) + 0.5) / 4096 * 2 * pi
    x = away[:, None] + behind
    y = away[:, None] * np.tan(angles)
    distances = np.where(np.cos(angles) > 0, np.hypot(x, y), np.inf)
    return np.where(distances < end, value(np.minimum(distances, end)), 0).mean(axis=1)


def test_a_horizon_below_a_plate():
    """The top is farther than R and the bottom is not: on all layers its nearest texels' centres are the horizon."""
    low = 0.1 / R
    parts, away = measured(plate(0.1, 0.3), "hbao", 0.0)

    def risen(d):
        return (1 - d * d - low * low) * low / np.hypot(d, low)

    known = over_directions(away, risen, np.sqrt(1 - low * low), TEXEL / 2 / R)
    assert -parts["missing layers"] == pytest.approx(known, abs=0.02)
    assert -parts["missing layers"].sum() == pytest.approx(known.sum(), rel=0.05)


def test_the_largest_term_of_points_of_surfaces():
    """Taps above a plate see its top; those of all layers its bottom, too, whose term is larger here."""
    low = 0.1 / R
    high = 0.3 / R
    parts, away = measured(plate(0.1, 0.3), "alchemy", 0.0)
    taps = (np.arange(512) + 0.5) / 512

    def more(edge):
        at = np.where(taps > edge[..., None], taps, np.nan)
        terms = [h / (at * at + h * h + 0.01) for h in (high, low)]
        return 2 * np.nansum(np.maximum(*terms) - terms[0], axis=-1) / 512

    assert -parts["missing layers"] == pytest.approx(over_directions(away, more, 1.0), rel=0.05, abs=0.02)


@pytest.mark.parametrize("name", VOLUMES)
def test_a_wall_beside_the_view(name):
    """Samples beyond the border are open without a guard band, and in the wall with it."""
    parts, away = measured(wall(), name, SIDE)
    known = VOLUMES[name](away)
    assert -parts["edge"] == pytest.approx(known, abs=0.025)
    assert parts["missing layers"] == pytest.approx(0 * away, abs=0.01)
    assert parts["form"] == pytest.approx(0 * away, abs=0.035)
    assert parts["integrand"] == pytest.approx(known - segment(away), abs=0.02)
    assert -parts["edge"].sum() == pytest.approx(known.sum(), rel=0.05)


def test_one_sample_is_hidden_where_its_turn_leads_under_the_plate():
    scene = plate(0.25, 0.375)
    point = (0.9, 0.0, 0.3)
    stages = stages_of(scene, find_estimator("hemisphere"), R, ((np.array([point]), None), {}))
    columns, away = columns_before(0.0)
    cosine = texel_turns("hash", HEIGHT, WIDTH, 0, np.dtype(np.float64))[0][12:-12, columns]
    sure = np.abs(0.9 * cosine - away) > TEXEL / R  # the texel that it lands in decides of others
    hidden = 0.9 * cosine > away
    texture = np.zeros(scene.surface.shape)
    texture[scene.surface] = parts_of(stages, scene.surface)[0]
    assert np.abs(texture[12:-12, columns] - (hidden - shell(away)))[sure].max() < 0.1
    assert 0.1 < hidden.mean() < 0.5


@pytest.mark.parametrize("name", ["lf", "sao", "multiresolution"])
def test_parts_sum_to_the_whole(name):
    scene = wall()
    estimator = find_estimator(name)
    stages = stages_of(scene, estimator, R)
    parts = parts_of(stages, scene.surface)
    shares = shares_of(parts_of(stages, scene.surface))
    error = stages.default[scene.surface].astype(float) - stages.cosine[scene.surface]
    assert sum(part for part in parts if part is not None) == pytest.approx(error, abs=1e-12)
    assert sum(share for share in shares.values() if share is not None) == pytest.approx(1)
    assert (shares["missing layers"] is None) == (name not in layers.RULES)
    assert (shares["sampling"] is None) == (name == "multiresolution")


@pytest.mark.parametrize("name", ["hemisphere", "oriented-hemisphere", "alchemy", "hbao"])
def test_on_the_first_layer_alone_an_estimator_is_itself(name):
    scene = plate(0.05, 0.1)
    estimator = find_estimator(name)
    hits, points, begins, ends = scene.layers
    first = layers.Layers(hits[:1], points[:1], begins[:1], np.full_like(ends[:1], np.inf))
    inputs = error_parts.many_of(estimator)
    found = layers.on_all_layers(estimator, scene.buffers, R, inputs, first)
    known = lfssao.estimate(name, scene.buffers, R, *inputs[0], **inputs[1]).texture
    assert np.mean(found != known) < 0.02  # depths that a camera rounds once more
    assert np.abs(found - known).max() < 0.02
    assert known.max() > 0.1


def test_two_rules_of_points_agree():
    """The first solid not passed hides what lies in solids, where terms do not depend on the surface's distance."""
    scene = sight(((0, -4, 0.05), (4, 4, 0.1)), ((0.05, -4, 0.08), (4, 4, 0.2)), ((-4, 0, 0.3), (4, 4, 0.4)))
    point = find_estimator("point")
    inputs = ((lfssao.make_samples("sobol", 64), None), {})
    first, second = (
        layers.on_all_layers(point, scene.buffers, R, inputs, scene.layers, rule)
        for rule in (layers._on_solids, layers._on_peeled)
    )
    assert np.abs(first - second).max() < 1e-6
    assert first[scene.surface].std() > 0.1


def test_solids_that_overlap_are_one_and_backs_alone_hide_nothing():
    scene = sight(((0, -4, 0.05), (4, 4, 0.1)), ((0.05, -4, 0.08), (4, 4, 0.2)))
    z = 2 - scene.layers.begins[:, 24, -4], 2 - scene.layers.ends[:, 24, -4]
    assert z[0].tolist() == pytest.approx([0.2, 0.0])
    assert z[1].tolist() == pytest.approx([0.05, -np.inf])
    depths = np.array([1.0, 2, 3])[:, None, None]
    front = np.array([False, True, False])[:, None, None]
    begins, ends = layers._solids(depths, front)
    assert (begins.ravel().tolist(), ends.ravel().tolist()) == ([2.0], [3.0])


def test_the_section_has_all_estimators_and_its_shares_sum_to_1():
    found = json.loads(error_parts.NUMBERS.read_text())
    for name, by_scene in found["estimators"].items():
        assert f"| {name} |" in error_parts.parts_text()
        for entries in by_scene.values():
            for entry in entries.values():
                assert sum(share or 0 for share in entry["shares"].values()) == pytest.approx(1, abs=1e-3)
    assert not found["quick"]
