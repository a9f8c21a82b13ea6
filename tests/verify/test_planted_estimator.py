"""A new estimator is one file and a row: by that it has bits, intervals, a name for its errors, and a line in lists."""

import sys
from itertools import product

import numpy as np
import planted_estimator
import pytest
from jobs import render
from test_formulas import missed

import lfssao
from lfssao import Buffers, Camera, RayCaster, builtin_scene, make_samples
from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.cli.main import main
from lfssao.verify.verdict import Verdict

NAME = "crytek-sphere"
RADIUS = 0.2


@pytest.fixture(autouse=True)
def planted(monkeypatch):
    monkeypatch.setitem(sys.modules, "lfssao.ao.estimators.planted", planted_estimator)
    monkeypatch.setitem(ESTIMATORS.data, NAME, "planted")


@pytest.fixture
def seen():
    mesh = builtin_scene("statue")
    view = Camera.looking_at(mesh.bounds).view(32, 24)
    gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, None)
    return Buffers.of(gbuffer, view).turned("hash")


def test_its_bits_are_those_of_the_formula(seen):
    """In float64, written once more for a camera, texel by texel."""
    points = make_samples("latin", 8)
    view = seen.view
    m = view.world_to_image.numbers.reshape(4, 4)
    axis = view.cast_from_world[2]
    made = estimate(NAME, seen, RADIUS, points).texture
    reach = RADIUS * np.linalg.norm(axis[:3])
    total = np.zeros(made.shape)
    there = np.isfinite(seen.depth)[..., None]
    cast = np.append(np.where(there, seen.positions, 0), np.ones((*made.shape, 1)), axis=2) @ axis
    cast = np.where(there[..., 0], cast, np.inf)
    for (j, i), (x, y, z) in product(np.argwhere(np.isfinite(seen.depth)), points):
        c, s = seen.turns[:, j, i].astype(float)
        place = seen.positions[j, i] + RADIUS * np.array([x * c - y * s, x * s + y * c, z])
        u, v, _, q = m @ np.append(place, 1)
        column = int(u // q)
        row = int(v // q)
        if 0 <= column < 32 and 0 <= row < 24 and cast[row, column] < axis @ np.append(place, 1):
            part = min(1.0, reach / max(abs(cast[j, i] - cast[row, column]), 1e-30))
            total[j, i] += part * part * (3 - 2 * part) / len(points)
    assert np.median(abs(made - total)) < 1e-6
    assert (abs(made - total) > 1e-4).mean() < 0.02  # look-ups next to an edge
    assert made.max() > 0.3


def test_renderers_stay_inside_its_intervals_and_leave_those_of_too_small_errors():
    rng = np.random.default_rng(0)
    display = lfssao.find_display("sample-a").with_resolution(4, 3)
    view = lfssao.module_views(builtin_scene("statue"), display, range(4, 5))[0]
    found = [missed(NAME, (view, rng, "shader", 1.0, 3, True), {"reach": 1.0}) for _ in range(12)]
    assert not sum(right for right, _ in found)
    assert sum(weak for _, weak in found) > 3


def test_it_is_listed_rendered_compared_and_named(tmp_path, capsys):
    assert main(["estimators", NAME]) == 0
    assert "reach=1.0" in capsys.readouterr().out
    job = "--estimator", NAME, "--camera", "--resolution", "64x48", "--radii", "6%", "--layers", "depth,positions,ao"
    reference = render(tmp_path / "a", "statue", *job)
    other = render(tmp_path / "b", "statue", *job)
    assert {each.verdict for each in lfssao.compare(other, reference).results} == {Verdict.EQUAL_BITS}
    mine = render(tmp_path / "c", "statue", *job, "--parameter", "reach=0.25")
    (wrong,) = [each for each in lfssao.compare(mine, reference).results if each.layer == "ao_1"]
    assert wrong.interval
    assert (wrong.diagnosis.candidates[0].kind, wrong.diagnosis.fits) == ("reach", True)
    assert wrong.diagnosis.candidates[0].values == pytest.approx([0.25], rel=0.01)
