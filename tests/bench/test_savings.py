"""The bench of the plan's savings: what it times, divides and compares, with renders and a clock that are made up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lfssao import RayCaster, Settings, builtin_scene, find_display, render_view
from lfssao.bench import savings
from lfssao.optics.window import seen_rows


@pytest.fixture(scope="module")
def statue():
    return builtin_scene("statue")


@pytest.mark.parametrize("wrong", [False, True])
def test_times_are_medians_of_the_warm_turns_and_ratios_quartiles_of_each_turns(statue, monkeypatch, wrong):
    """Renders take 12, 8 and 10 s, with all rows twice, with all radii 1.5 times as long; AO 1 s, of all texels 5 s."""
    display, clock, calls = find_display("virtual").with_resolution(8, 6), [0.0], []
    case = savings.Case("case", statue, statue.bounds, Settings((0.0, 0.2)))
    view = savings.middle_view(statue, display, case.box)
    caster, render, occlusions = RayCaster(statue, view.cast_from_world), savings.render_view, savings.occlusions
    seconds = {0: 100, 1: 12, 2: 8, 3: 10}

    def timed_render(by, view, settings):
        turn = (len(calls) - 1) // 5
        calls.append(by)
        textures = render(by, view, settings)
        if by is not caster:
            assert seen_rows(view, by.bounds) == range(view.height)
        assert settings.radii[0] == 0 or len(set(settings.radii)) == 2
        clock[0] += seconds.get(turn, 0) * (1 + (by is not caster) + 0.5 * (settings.radii[0] > 0))
        return replace(textures, outside=(9, 9)) if wrong and by is not caster else textures

    def timed_ao(buffers, settings):
        calls.append(buffers)
        clock[0] += 5 if np.isfinite(buffers.depth).all() else 1
        return occlusions(buffers, settings)

    monkeypatch.setattr(savings, "render_view", timed_render)
    monkeypatch.setattr(savings, "occlusions", timed_ao)
    monkeypatch.setattr(savings, "time", SimpleNamespace(process_time=lambda: clock[0]))
    result = savings._saving(case, caster, view, 3)
    assert len(calls) == 1 + 4 * 5
    assert result.milliseconds == 10_000
    assert result.ratios["rows"] == (2.0, 2.0, 2.0)
    assert result.ratios["radii"] == (1.5, 1.5, 1.5)
    np.testing.assert_allclose(result.ratios["background"], np.percentile([16 / 12, 12 / 8, 14 / 10], [25, 50, 75]))
    np.testing.assert_allclose(result.ratios["all"], np.add(result.ratios["background"], 1.5))
    assert result.cover == (caster.gbuffer(view).triangle >= 0).mean()
    assert result.same != wrong


def test_all_that_a_render_makes_is_compared(statue):
    view = savings.middle_view(statue, find_display("virtual").with_resolution(8, 6), statue.bounds)
    textures = render_view(RayCaster(statue, view.cast_from_world), view, Settings((0.1, 0.2), normals="smooth"))
    seen, right = textures.gbuffer, savings.bits(textures)
    assert right == savings.bits(replace(textures))
    for part in ("merged", "blurred", "shaded"):
        assert savings.bits(replace(textures, **{part: -getattr(textures, part)})) != right
    for part in ("depth", "positions", "triangle", "color", "normals"):
        other = replace(seen, **{part: getattr(seen, part) + 1})
        assert savings.bits(replace(textures, gbuffer=other)) != right
    assert savings.bits(replace(textures, outside=(0, 1))) != right
    assert savings.bits(replace(textures, ao=(textures.ao[0], -textures.ao[1]))) != right


def test_boxes_around_a_scene(statue):
    low, high = statue.bounds
    np.testing.assert_allclose(savings.around(statue, 1), statue.bounds, rtol=1e-12)
    box = savings.around(statue, 3, (40, 0, -1))
    np.testing.assert_allclose(box[1] - box[0], 3 * (high - low))
    np.testing.assert_allclose(box.mean(axis=0), 0.5 * (low + high) + np.array([40, 0, -1]) * (high - low))


def test_the_wall_is_one_sheet_of_the_boxs_front():
    sheet = savings.wall(4)
    assert len(sheet.faces) == 2 * 16
    assert sorted(np.unique(sheet.faces)) == list(range(25))
    a, b, c = (sheet.vertices[sheet.faces[:, k], :2] for k in range(3))
    area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    np.testing.assert_allclose(area, 0.5)  # all the same way round, together the whole of 4 x 4
    assert np.abs(sheet.vertices[:, :2]).max() == 2
