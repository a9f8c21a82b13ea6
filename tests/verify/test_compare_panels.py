"""The texture of a panel behind lenses, compared with the files of its lenses."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from jobs import edit, manifest_of, render, sentence
from lenslet_files import LENSES
from PIL import Image

from lfssao import compare, read_exr, write_exr
from lfssao.cli.main import main
from lfssao.verify.verdict import Verdict

NAMES = [f"lens_{k:03d}" for k in range(15)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("lenses")
    (path / "small.toml").write_text(LENSES)
    return render(path / "reference", "statue", "--display", str(path / "small.toml"), "--radii", "10%")


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine").mkdir()
    return tmp_path / "mine"


def test_two_folders_and_a_panel_for_the_files_of_its_lenses(folder, mine):
    layers = {"depth", "positions", "color", "ao_1", "merged", "blurred", "shaded"}
    shutil.copy(folder / "panel.exr", mine)
    copy = shutil.copytree(folder, mine.parent / "copy")
    panel = "panel.exr"
    for other, reference in (
        (copy, folder),
        (mine, folder),
        (mine / panel, folder),
        (mine / panel, folder / panel),
        (mine, folder / panel),
    ):
        report = compare(other, reference)
        assert report.exit_code == 0
        assert {r.verdict for r in report.results} == {Verdict.EQUAL_BITS}
        assert sorted((r.module, r.layer) for r in report.results) == sorted((n, c) for n in NAMES for c in layers)


def test_one_texel_of_the_panel_is_wrong_in_its_lens(folder, mine):
    """Row 10 and column 26: in lens 8, in the first column of its image."""
    parts = read_exr(folder / "panel.exr")
    merged = parts["merged"]
    pixels = merged.pixels.copy()
    pixels[10, 26] += 0.25
    write_exr(mine / "panel.exr", [replace(merged, pixels=pixels)])
    report = compare(mine, folder, layers=["merged"], diagnosis=False)
    assert [r.module for r in report.results if r.verdict is Verdict.OUTSIDE] == ["lens_008"]
    write_exr(mine / "panel.exr", [replace(merged, pixels=np.roll(merged.pixels, 12, axis=1))])
    assert compare(mine, folder, layers=["merged"], diagnosis=False).exit_code == 2


def test_a_file_of_one_layer_inside_intervals(folder, mine):
    """Codes of 8 bits, which move each texel by up to half a code."""
    merged = read_exr(folder / "panel.exr")["merged"].pixels[..., 0]
    Image.fromarray(np.rint(255 * merged).astype(np.uint8)).save(mine / "panel_merged.png")
    report = compare(mine, folder, layers=["merged"])
    assert {r.verdict for r in report.results} == {Verdict.INSIDE}
    assert (report.exit_code, len(report.results)) == (0, 15)
    Image.fromarray(np.rint(255 * merged + 2 * (merged > 0)).astype(np.uint8)).save(mine / "panel_merged.png")
    assert compare(mine, folder, layers=["merged"], diagnosis=False).exit_code == 2


def test_each_stage_of_another_radius(folder, tmp_path):
    """Depth and positions are equal and occlusion is not; later stages are what they should be of it."""
    (tmp_path / "small.toml").write_text(LENSES)
    job = "statue", "--display", str(tmp_path / "small.toml"), "--radii", "12%"
    found = compare(render(tmp_path / "other", *job), folder, diagnosis=False).results
    assert {r.verdict for r in found if r.layer in ("depth", "positions", "color")} == {Verdict.EQUAL_BITS}
    assert {r.verdict for r in found if r.layer == "ao_1"} == {Verdict.OUTSIDE}
    assert {r.verdict for r in found if r.layer in ("merged", "blurred", "shaded")} == {Verdict.INSIDE}


def test_lenses_that_ask_others_have_intervals(tmp_path):
    """Those that were not rendered are cast from the mesh, each from its own place."""
    (tmp_path / "small.toml").write_text(LENSES)
    job = "statue", "--display", str(tmp_path / "small.toml"), "--radii", "10%", "--neighbours", "4"
    some = render(tmp_path / "some", *job, "--modules", "7")
    (tmp_path / "mine").mkdir()
    codes = np.rint(255 * read_exr(some / "lens_007.exr")["ao_1"].pixels[..., 0]).astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "mine" / "lens_007_ao_1.png")
    (result,) = compare(tmp_path / "mine", some, layers=["ao_1"]).results
    assert result.verdict is Verdict.INSIDE
    codes[codes > 0] += 32  # a sample of eight
    Image.fromarray(codes).save(tmp_path / "mine" / "lens_007_ao_1.png")
    (result,) = compare(tmp_path / "mine", some, layers=["ao_1"], diagnosis=False).results
    assert result.verdict is Verdict.OUTSIDE


def test_what_is_no_panel_of_the_reference(folder, mine, tmp_path, capsys):
    words = ["compare", str(mine), str(folder), "--layers", "merged"]
    np.save(mine / "panel_merged.npy", np.zeros((30, 41), np.float32))
    assert main(words) == 4
    reason = "it has 41x30 texels, but the reference's panel has 40x30"
    assert sentence(capsys).startswith(f"{mine / 'panel_merged.npy'}: {reason}")
    np.save(mine / "panel_merged.npy", np.zeros((30, 40), np.float32))
    changed = shutil.copytree(folder, tmp_path / "changed")
    display = manifest_of(folder)["lenslet"]
    edit(changed, "lenslet", value={**display, "gap": 0})
    assert main([*words[:2], str(changed)]) == 4
    assert sentence(capsys).startswith(f"{changed}: its manifest: display small: gap: it is 0, it must be from")
    edit(changed, "lenslet", value={**display, "gaps": 0})
    assert main([*words[:2], str(changed)]) == 4
    assert "its manifest is not what 'lfssao render' writes (TypeError: " in sentence(capsys)
    edit(changed, "lenslet", value=display)
    for wrong in ("lens_015", "lens_-01", "view_014"):
        edit(changed, "views", 14, "name", value=wrong)
        assert main([*words[:2], str(changed)]) == 4
        assert "its manifest is not what 'lfssao render' writes (ValueError: " in sentence(capsys)
