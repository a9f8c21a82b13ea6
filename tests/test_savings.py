"""The bench of the plan's savings: what it times, divides and compares, with renders and a clock that are made up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lfssao import Settings, builtin_scene, find_display
from lfssao.bench import savings
from lfssao.view_plan import ViewPlan


@pytest.fixture(scope="module")
def statue():
    return builtin_scene("statue")


def made(texture=0.0, outside=3):
    """Textures of a view, one value each."""
    one = np.full((2, 2), texture, np.float32)
    seen = SimpleNamespace(depth=one, positions=one, triangle=np.array([[0, 1], [-1, -1]]), color=None, normals=one)
    return SimpleNamespace(merged=one, blurred=one, image=one, shaded=one, ao=(one, one), gbuffer=seen, outside=outside)


@pytest.mark.parametrize("wrong", [False, True])
def test_times_are_medians_of_the_warm_turns_and_ratios_quartiles_of_each_turns(statue, monkeypatch, wrong):
    """Everything takes 12, 8 and 10 s, the plan a half of the first and a quarter of the others; 100 s cold."""
    view = savings.middle_view(statue, find_display("virtual").with_resolution(8, 6), statue.bounds)
    everything, clock, calls = ViewPlan.everything(view, Settings((0.1,))), [0.0], []
    seconds = {0: (100, 100), 1: (12, 6), 2: (8, 2), 3: (10, 2.5)}

    def render(_caster, _view, _settings, _neighbours, plan):
        turn = (len(calls) - 1) // 4
        calls.append(plan)
        clock[0] += seconds[turn][plan != everything] if len(calls) > 1 else 1000
        return made(float(wrong and plan.window != everything.window))

    monkeypatch.setattr(savings, "render_view", render)
    monkeypatch.setattr(savings, "time", SimpleNamespace(process_time=lambda: clock[0]))
    monkeypatch.setattr(ViewPlan, "of", lambda *_: replace(everything, window=None))
    case = savings.Case("case", statue, statue.bounds, Settings((0.1,)))
    result = savings._saving(case, SimpleNamespace(bounds=statue.bounds), view, everything, 3)
    assert len(calls) == 1 + 4 * 4
    assert result.milliseconds["all"] == 10_000
    assert result.milliseconds["plan"] == 2_500
    assert result.ratios["plan"] == (3.0, 4.0, 4.0)
    assert set(result.ratios) == {"plan", "rays", "radii"}
    assert result.ratios["radii"] == (1.0, 1.0, 1.0)  # the same plan as everything's
    assert result.cover == 0.5
    assert result.same != wrong


def test_textures_that_differ_anywhere_are_not_equal():
    assert savings.equal_bits(made(), made())
    assert not savings.equal_bits(made(), made(outside=4))
    for part in ("merged", "blurred", "image", "shaded"):
        for other in (None, np.full((2, 2), -0.0, np.float32)):
            one = made()
            setattr(one, part, other)
            assert not savings.equal_bits(one, made())
            assert not savings.equal_bits(made(), one)
    for part in ("depth", "positions", "triangle", "color", "normals"):
        one = made()
        setattr(one.gbuffer, part, np.ones((2, 2), np.float32) if part == "color" else None)
        assert not savings.equal_bits(one, made())
        assert not savings.equal_bits(made(), one)
    one = made()
    one.ao = (one.ao[0], np.ones((2, 2), np.float32))
    assert not savings.equal_bits(one, made())


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
