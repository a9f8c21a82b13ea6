"""``lfssao compare`` with the mesh of its reference, and without: depth judged by rays or by estimates."""

import numpy as np
import pytest
from compare_folders import changed, compare, different, poke, remade, single, with_entry, without_scene
from jobs import render

import lfssao
from lfssao.gbuffer.caster import RayCaster
from lfssao.verify.bounds.depth import depth_bounds, displaced, outlier_limit
from lfssao.verify.compare import surface
from lfssao.verify.verdict import Verdict


def off_centre(reference, target, du, dv, scene="statue"):
    """The reference's depth texture, looked at (du, dv) texels off its texels' centres."""
    mesh = lfssao.builtin_scene(scene)
    views = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(48, 32), range(3, 6))
    depth = RayCaster(mesh, views[1].cast_from_world).gbuffer(displaced(views[1], du, dv), color=None).depth
    return changed(reference, target, "module_004", remade("depth", lambda _: depth[..., None]))


def test_depth_is_judged_by_the_mesh(tmp_path, capsys, reference):
    near = off_centre(reference, tmp_path / "near", 0.0035, -0.003)
    half = off_centre(reference, tmp_path / "half", 0.5, 0.5)
    report = lfssao.compare(near, reference)
    assert different(report) == {("module_004", "depth"): Verdict.INSIDE}
    assert report.exit_code == 0
    reason = report.first_difference.worst[0].reason
    assert reason.endswith("0.0039 texel of the texel's centre, see this interval of depth")
    strict = lfssao.compare(near, reference, model="strict", diagnosis=False)
    assert {texel.reason for texel in strict.first_failure.worst} == {""}
    report = lfssao.compare(half, reference, diagnosis=False)
    assert ("module_004", "depth") in {(r.module, r.layer) for r in report.results if r.verdict is Verdict.OUTSIDE}
    reasons = {texel.reason for texel in report.first_failure.worst}
    assert "nine rays into the mesh, within 0.0039 texel of the texel's centre, see nothing" in reasons
    assert compare(near, without_scene(reference, tmp_path / "file"), "--mesh", "statue") == 0
    assert compare(near, reference, "--mesh", "ammonite") == 4
    assert "ammonite is not the scene that the reference was rendered of, statue" in capsys.readouterr().err
    assert compare(near / "module_003.exr", near / "module_004.exr", "--mesh", "statue") == 4
    assert "is not what 'lfssao render' writes" in capsys.readouterr().err


def test_a_placed_camera_is_judged_by_the_mesh(tmp_path):
    folder = tmp_path / "reference"
    render(folder, "statue", "--camera", "--eye=-3,2,4", "--resolution", "48x32", "--layers", "depth")
    seen = np.argwhere(np.isfinite(single(folder, "camera", "depth")[..., 0]))[40]
    report = lfssao.compare(changed(folder, tmp_path / "mine", "camera", poke("depth", tuple(seen), 0.9)), folder)
    assert "nine rays into the mesh" in report.first_failure.worst[0].reason


def test_rays_are_cast_only_where_depth_or_colour_differ(tmp_path, monkeypatch, reference):
    cast = []
    monkeypatch.setattr(surface, "depth_bounds", lambda *given: cast.append(1) or depth_bounds(*given))
    for layer, count in (("blurred", 0), ("depth", 1)):
        mine = changed(reference, tmp_path / layer, "module_004", poke(layer, (8, 8), 0.7))
        assert different(lfssao.compare(mine, reference, diagnosis=False))
        assert len(cast) == count


@pytest.mark.parametrize(("place", "value", "code"), [
    (("scene", "name"), "ammonite", 1),  # another version's scene of that name: as if there were none
    (("scene", "name"), [], 4),
    (("scene",), None, 4),
    (("views", 1, "view", "cast_from_world"), [[1]], 4),
    (("views", 1, "view", "width"), 10**9, 1),
    (("frame",), {"world_from_scene": 5}, 4),
    (("settings", "color_filter"), 7, 4),
], ids=str)  # fmt: skip
def test_a_manifest_that_does_not_give_the_mesh_its_view(tmp_path, capsys, reference, place, value, code):
    folder = with_entry(reference, tmp_path / "reference", place, value)
    seen = np.argwhere(np.isfinite(single(reference, "module_004", "depth")[..., 0]))[40]
    mine = changed(reference, tmp_path / "mine", "module_004", poke("depth", tuple(seen), 2.0))
    assert compare(mine, folder, "--layers", "depth") == code
    assert ("manifest" in capsys.readouterr().err) == (code == 4)


def test_without_the_mesh_a_texel_that_cannot_be_judged_is_a_warning_and_many_are_a_failure(tmp_path, reference):
    unknown = without_scene(reference, tmp_path / "file")
    depth = single(reference, "module_004", "depth")[..., 0]
    limit = outlier_limit(depth)
    assert limit > 0
    for count in (limit, limit + 1):
        seen = np.argwhere(np.isfinite(depth))[5::15][:count]
        assert len(seen) == count
        mine = changed(reference, tmp_path / f"mine_{count}", "module_004", poke("depth", tuple(seen.T), -1.5))
        report = lfssao.compare(mine, unknown, diagnosis=False)
        if count == limit:
            assert different(report) == {("module_004", "depth"): Verdict.INSIDE}
            assert report.notes == (
                f"module_004, depth: {limit} texels outside the interval, which only the mesh can judge (--mesh FILE); "
                f"up to {limit} may look past an edge (4 standard deviations)",
            )
            assert report.exit_code == 1
        else:
            assert different(report) == {("module_004", "depth"): Verdict.OUTSIDE}
        assert lfssao.compare(mine, reference, diagnosis=False).first_failure.layer == "depth"
