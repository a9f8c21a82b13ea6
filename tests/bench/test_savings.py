"""The bench of the plan's savings: what it runs and compares."""

import json
from dataclasses import replace

import bench_plan as savings
import numpy as np
import pytest

from lfssao import RayCaster, Settings, find_display, render_view
from lfssao.optics.view import seen_rows


def test_what_the_plan_leaves_out_is_done_after_all(statue, monkeypatch):
    """Renders with all rows and with all radii, AO of all texels; how they count is seen below."""
    display = find_display("virtual").with_resolution(8, 6)
    case = savings.Case("case", statue, savings.around(statue, 3), Settings((0.0, 0.2, 0.2)))
    renders, depths, occlusions = [], [], savings.occlusions

    def seen_render(caster, view, settings):
        renders.append((len(seen_rows(view, caster.bounds)) == view.height, len(set(settings.radii))))
        return render_view(caster, view, settings)

    def seen_ao(buffers, settings):
        depths.append(bool(np.isfinite(buffers.depth).all()))
        return occlusions(buffers, settings)

    monkeypatch.setattr(savings, "render_view", seen_render)
    monkeypatch.setattr(savings, "occlusions", seen_ao)
    (found,) = savings.savings([case], display, 5)
    assert found.same
    assert found.milliseconds > 0
    assert set(renders) == {(False, 2), (True, 2), (False, 3)}
    assert set(depths) == {False, True}


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
    assert savings.bits(replace(textures, outside=(7, 9))) != right
    assert savings.bits(replace(textures, ao=(textures.ao[0], -textures.ao[1]))) != right


def test_savings_of_each_rule_and_one_that_changes_bits(statue, monkeypatch, capsys, tmp_path):
    display = find_display("virtual").with_resolution(48, 36)
    box = savings.at_a_tenth(statue, display)
    case = savings.Case("a tenth", statue, box, Settings((0.0, 0.2, 0.2)))
    (made,) = savings.savings([case], display, 2)
    assert made.same
    assert abs(made.cover - 0.1) < 0.02
    assert set(made.ratios) == {"all", *savings.RULES}
    assert all(low <= middle <= high for low, middle, high in made.ratios.values())
    monkeypatch.setattr(savings, "other_radii", lambda radii: (0.1, *radii[1:]))
    monkeypatch.setattr(savings, "cases", lambda *_: [case])
    table = tmp_path / "plan.json"
    with pytest.raises(SystemExit, match="changed bits"):
        savings.main(["--quick", "--repeats", "1", "--json", str(table)])
    assert "BITS DIFFER" in capsys.readouterr().out
    (scene,) = json.loads(table.read_text())["scenes"]
    assert (scene["scene"], scene["same"]) == ("a tenth", False)
