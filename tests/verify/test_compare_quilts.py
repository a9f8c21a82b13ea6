"""Pictures of all views of a quilt, compared with the files of its views."""

import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
from jobs import edit, manifest_of, render, sentence
from PIL import Image
from quilt_files import QUILT

from lfssao import (
    Buffers,
    Camera,
    compare,
    estimate,
    find_scene,
    find_views,
    fit_roi,
    module_views,
    read_exr,
    write_exr,
)
from lfssao.cli.main import main
from lfssao.optics.view import inverse_of
from lfssao.verify.verdict import Verdict

MINE = QUILT.replace("[24, 32]", "[36, 48]")
ORDER = [3, 4, 5, 0, 1, 2]  # of the views in a picture, from the upper left


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("quilt")
    (path / "mine.toml").write_text(MINE)
    return render(path / "reference", "statue", "--display", str(path / "mine.toml"), "--radii", "5%")


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine").mkdir()
    return tmp_path / "mine"


def tiles(folder, order, make=lambda ao: ao):
    """Codes of the merged occlusion of views in an order."""
    textures = [read_exr(folder / f"view_{k:03d}.exr")["merged"].pixels[..., 0] for k in order]
    return [np.floor(255 * make(texture.astype(np.float64)) + 0.5).astype(np.uint8) for texture in textures]


def save(path, codes, columns, colors=1):
    lines = [np.hstack(codes[k : k + columns]) for k in range(0, len(codes), columns)]
    picture = np.vstack(lines)
    Image.fromarray(picture if colors == 1 else np.repeat(picture[..., None], colors, axis=2)).save(path)


def test_a_picture_stands_for_the_files_of_all_views(folder, mine):
    save(mine / "merged_qs3x2a0.75.png", tiles(folder, ORDER), 3)
    report = compare(mine, folder, layers=["merged"])
    assert report.exit_code == 0
    assert [r.module for r in report.results] == [f"view_{k:03d}" for k in range(6)]
    assert {r.verdict for r in report.results} == {Verdict.INSIDE}
    assert compare(mine / "merged_qs3x2a0.75.png", folder, layers=["merged"]).exit_code == 0
    assert compare(mine, folder).exit_code == 2  # the other layers are missing


def test_another_layout_another_name_colours_and_visibility(folder, mine):
    """2 columns: views 4 and 5 are above."""
    save(mine / "ours_qs2x3.png", tiles(folder, [4, 5, 2, 3, 0, 1], lambda ao: 1 - ao), 2, colors=3)
    rules = {"1-merged": "ours.R"}
    assert compare(mine, folder, layers=["merged"], rules=rules).exit_code == 0
    save(mine / "ours_qs2x3.png", tiles(folder, range(6)), 2)
    (missing, *_) = compare(mine, folder, layers=["merged"]).results
    assert missing.detail.endswith("if it is one of ours.Y, say so by --map, such as --map ours.Y=merged.AO")


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]], ids=["from above", "from the right"])
def test_views_in_another_order_are_wrong(folder, mine, order):
    save(mine / "merged_qs3x2a0.75.png", tiles(folder, order), 3)
    report = compare(mine, folder, layers=["merged"], diagnosis=False)
    assert report.exit_code == 2
    outside = {f"view_{right:03d}" for right, wrong in zip(ORDER, order, strict=True) if right != wrong}
    assert {r.module for r in report.results if r.verdict is Verdict.OUTSIDE} == outside


def test_one_code_too_many_in_one_view_is_wrong_there(folder, mine):
    codes = tiles(folder, ORDER)
    row, column = np.argwhere(codes[4] > 0)[0]  # the fifth from the upper left is view 1
    codes[4][row, column] += 2
    save(mine / "merged_qs3x2a0.75.png", codes, 3)
    report = compare(mine, folder, layers=["merged"], diagnosis=False)
    assert [r.module for r in report.results if r.verdict is Verdict.OUTSIDE] == ["view_001"]


def test_files_of_views_come_first_and_a_part_of_the_views_may_be_the_reference(folder, mine, tmp_path):
    save(mine / "merged_qs3x2a0.75.png", tiles(folder, ORDER[::-1]), 3)
    for k in range(6):
        shutil.copy(folder / f"view_{k:03d}.exr", mine)
    assert compare(mine, folder).exit_code == 0
    (tmp_path / "mine.toml").write_text(MINE)
    job = "statue", "--display", str(tmp_path / "mine.toml"), "--radii", "5%", "--modules", "4:6"
    part = render(tmp_path / "part", *job)
    whole = tmp_path / "whole"
    whole.mkdir()
    save(whole / "merged_qs3x2a0.75.png", tiles(folder, ORDER), 3)
    report = compare(whole, part, layers=["merged"])
    assert (report.exit_code, len(report.results)) == (0, 2)


def test_the_mesh_judges_depth_from_each_eye(folder, mine):
    """One unit in the last place more: the rays of another eye's view would find it wrong."""
    for k in range(6):
        parts = read_exr(folder / f"view_{k:03d}.exr")
        depth = parts["depth"]
        write_exr(mine / f"view_{k:03d}.exr", [replace(depth, pixels=np.nextafter(depth.pixels, np.float32(np.inf)))])
    report = compare(mine, folder, layers=["depth"], diagnosis=False)
    assert {r.verdict for r in report.results} == {Verdict.INSIDE}
    assert report.exit_code == 0


def test_numbers_that_are_not_the_references(folder, mine, tmp_path, capsys):
    codes = tiles(folder, ORDER)
    words = ["compare", str(mine), str(folder), "--layers", "merged"]
    for name, columns, reason in (
        ("merged_qs3x3a0.75.png", 3, "its name says 3 x 3 views, the reference's quilt has 6"),
        (
            "merged_qs6x1a0.75.png",
            3,
            "it has 108x96 texels, but 6 x 1 views of 36x48, as the reference's are, have 216",
        ),
        (
            "merged_qs3x2a0.75.png",
            2,
            "it has 72x144 texels, but 3 x 2 views of 36x48, as the reference's are, have 108",
        ),
    ):
        save(mine / name, codes, columns)
        assert main(words) == 4
        assert sentence(capsys).startswith(f"{mine / name}: {reason}")
        (mine / name).unlink()
    (mine / "merged_qs3x2a0.75.png").write_bytes(b"no picture")
    assert main(words) == 4
    assert "it cannot be read as an image" in sentence(capsys)
    save(mine / "merged_qs3x2a0.75.png", codes, 3)
    changed = shutil.copytree(folder, tmp_path / "changed")
    quilt = manifest_of(folder)["quilt"]
    edit(changed, "quilt", value={**quilt, "roi": None})
    assert main([*words[:2], str(changed)]) == 4
    assert "its manifest is not what 'lfssao render' writes (TypeError: " in sentence(capsys)
    edit(changed, "quilt", value={**quilt, "rows": 0})
    assert main([*words[:2], str(changed)]) == 4
    assert sentence(capsys).startswith(f"{changed}: its manifest: display small: rows is 0, it must be")
    edit(changed, "quilt", value=quilt)
    for wrong in ("view_006", "view_-01", "other"):
        edit(changed, "views", 5, "name", value=wrong)
        assert main([*words[:2], str(changed)]) == 4
        assert "its manifest is not what 'lfssao render' writes (ValueError: " in sentence(capsys)
    edit(changed, "views", 5, "name", value="view_005")
    edit(changed, "quilt", value=None)
    assert main([*words[:2], str(changed)]) == 2  # of no quilt: none of its views is there
    assert "view_000" in capsys.readouterr().out


JOB = "statue", "--radii", "8%", "--rotate", "none", "--estimator", "point", "--layers", "depth,positions,ao"
WRONG = {  # the file's words, and the name and value of the cause
    "view_cone = 37.45": ("view cone", 1.07),
    f"field_of_view = {math.degrees(2 * math.atan(math.tan(math.radians(7)) / 0.96))}": (
        "eyes' distance from the screen", 0.96
    ),
    "screen_height = 0.1696": ("screen height", 1.06),
    "aspect = 0.72": ("screen aspect", 0.96),
    f"screen_height = 0.1504\nfield_of_view = {math.degrees(2 * math.atan(math.tan(math.radians(7)) * 0.94))}": (
        "screen size from the same eyes", 0.94
    ),
    'spacing = "middles"': ("spacing 'middles' in place of 'ends'", None),
}  # fmt: skip


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A reference of the point estimator, which reads positions."""
    path = tmp_path_factory.mktemp("drawn")
    (path / "mine.toml").write_text(MINE)
    return render(path / "reference", *JOB, "--display", str(path / "mine.toml"))


def told_once(report, kind, value):
    """Whether one cause explains all textures with 20 wrong texels and more, its value within a fiftieth."""
    (cause,) = report.causes
    wrong = {result.place for result in report.results if result.outside >= 20}
    values = [] if value is None else [pytest.approx(value, abs=abs(value - 1) / 50)]
    return (cause.kind, list(cause.values)) == (kind, values) and set() < wrong <= set(cause.places)


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_number_of_a_quilt_is_told_once_for_all_views(drawn, tmp_path, words):
    keys = tuple(line.split(" = ")[0] for line in words.splitlines())
    lines = [line for line in MINE.splitlines() if not line.startswith(keys)]
    (tmp_path / "wrong.toml").write_text("\n".join([words, *lines]))
    mine = render(tmp_path / "mine", *JOB, "--display", str(tmp_path / "wrong.toml"))
    assert told_once(compare(mine, drawn), *WRONG[words])


@pytest.mark.parametrize("turned", [True, False])
def test_views_that_are_not_sheared_are_named(drawn, tmp_path, turned):
    """Cameras at the eyes' places that look at the screen's middle, or straight ahead; AO alone is wrong."""
    mesh = find_scene("statue")
    quilt = find_views(drawn.parent / "mine.toml")
    to_world = inverse_of("map", fit_roi(mesh.bounds, quilt.roi))
    settings = manifest_of(drawn)["settings"]
    for k, view in enumerate(module_views(mesh, quilt)):
        x = quilt.eye_x(k)
        unit = to_world[0, 0]
        eye, middle, ahead = (to_world[:, :3] @ p + to_world[:, 3] for p in np.array(
            [[x, 0, -quilt.distance], [0, 0, 0], [x, 0, 0]]))  # fmt: skip
        height = quilt.screen_height * unit * (math.hypot(x, quilt.distance) / quilt.distance if turned else 1)
        camera = Camera(
            "perspective", tuple(eye), tuple(middle if turned else ahead), (0, 1, 0), height, *view.lens[4:6]
        )
        other = camera.view(quilt.width, quilt.height, aspect=quilt.aspect)
        parts = read_exr(drawn / f"{view.name}.exr")
        seen = replace(view, world_to_image=other.world_to_image)
        buffers = Buffers(seen, np.ascontiguousarray(parts["depth"].pixels[..., 0]), parts["positions"].pixels)
        made = estimate("point", buffers, settings["radii"][0], np.array(settings["samples"]))
        np.save(tmp_path / f"{view.name}_ao_1.npy", made.texture)
    kind = "views turned to the screen's middle in place of sheared" if turned else "views without shear"
    report = compare(tmp_path, drawn, layers=["ao_1"])
    if turned:
        assert told_once(report, kind, None)
    else:  # of the outermost views all samples fall outside
        first, second = report.causes
        assert (first.kind, second.kind) == (kind, "ao of 0 everywhere")
        assert len(first.modules) >= 4
