"""Layers that are asked for: which are made, kept, written, compared and taken up again."""

import shutil

import numpy as np
import pytest
from exr_parts import read_parts, write_parts
from jobs import digests_of, manifest_of, render, sentence

from lfssao import RayCaster, Settings, find_display, module_views, render_view
from lfssao.cli.main import main
from lfssao.rendering.settings import ASKED
from lfssao.rendering.settings import LAYERS as ALL

LAYERS = tuple(name for name in ALL if name not in ASKED)  # others: test_bent_layer.py
PASS_OF = {"ao": "ao", "merged": "merge", "blurred": "blur", "shaded": "shade"}
NEEDED = {  # by hand: what each layer is made of
    "depth": set(), "positions": set(), "color": set(), "normals": set(), "ao": set(), "merged": {"ao"},
    "blurred": {"ao", "merged"}, "shaded": {"ao", "merged", "blurred"},
}  # fmt: skip


def layers_of(textures):
    """Every layer's texture by its name, None where it is not kept."""
    made = {name: getattr(textures, name) for name in ("merged", "blurred", "shaded")}
    made |= {name: getattr(textures.gbuffer, name) for name in ("positions", "color", "normals")}
    made["ao"] = np.stack(textures.ao) if textures.ao else None
    return {**made, "depth": textures.gbuffer.depth}


@pytest.mark.parametrize("estimator", ["lf", "hbao"])  # hbao reads normals
@pytest.mark.parametrize("place", ["seen", "unseen"])
def test_only_layers_that_are_asked_for_are_kept_and_only_what_they_read_is_computed(statue, estimator, place):
    box = statue.bounds + (place == "unseen") * np.array([90.0, 0, 0])
    (view,) = module_views(statue, find_display("virtual").with_resolution(64, 48), None, 4, box)
    caster = RayCaster(statue, view.cast_from_world)
    cast = []

    class Caster(RayCaster):
        def __init__(self):
            self.bounds = statue.bounds

        def gbuffer(self, *look):
            cast.append(look)
            return caster.gbuffer(*look)

    radii = (0.1, 0.3)
    whole = layers_of(render_view(caster, view, Settings(radii, normals="geometric", estimator=estimator)))
    some = [(name,) for name in LAYERS] + [("merged", "depth"), ("shaded", "ao"), ("positions", "normals", "blurred")]
    for asked in some:
        made = render_view(Caster(), view, Settings(radii, estimator=estimator, layers=asked))
        needed = set().union(*(NEEDED[name] | {name} for name in asked))
        expected = {PASS_OF[name] for name in needed & set(PASS_OF)} if place == "seen" else set()
        assert set(made.seconds) == {"ray_cast", *expected}
        color, normals, _, _, positions = cast[-1][1:]
        assert (color is not None) == bool({"color", "shaded"} & set(asked))
        assert (normals is not None) == ("normals" in asked or (estimator == "hbao" and "ao" in needed))
        assert positions == bool({"positions", "ao"} & needed)
        assert made.layers == tuple(name for name in LAYERS if name in asked)
        assert len(made.outside) == (2 if "ao" in needed else 0)
        for name, texture in layers_of(made).items():
            if name in asked or name == "depth":
                assert np.array_equal(texture.view(np.int32), whole[name].view(np.int32)), (asked, name)
            else:
                assert texture is None, (asked, name)


RENDER = ["statue", "--display", "sample-a", "--modules", "2:4", "--resolution", "48x36", "--radii", "3%,6%"]


@pytest.fixture(scope="module")
def whole_folder(tmp_path_factory):
    return render(tmp_path_factory.mktemp("layers") / "whole", *RENDER)


@pytest.mark.parametrize("asked", ["depth", "merged", "ao,positions", "shaded", "blurred,depth,color,shaded"])
def test_folders_of_some_layers(whole_folder, tmp_path, capsys, asked):
    """Their parts are the whole folder's; they can be taken up, compared, and viewed if they have a picture."""
    folder = render(tmp_path / "some", *RENDER, "--layers", asked)
    wanted = asked.split(",")
    sheet = {"blurred", "depth", "color", "shaded"} <= set(wanted)
    assert ("contact.png" in capsys.readouterr().out) == (folder / "contact.png").is_file() == sheet
    names = {part for name in wanted for part in (("ao_1", "ao_2") if name == "ao" else (name,))}
    manifest = manifest_of(folder)
    whole = manifest_of(whole_folder)
    assert set(manifest["settings"]["layers"]) == set(wanted)
    for one, all_ in zip(manifest["views"], whole["views"], strict=True):
        assert one["textures"] == {name: all_["textures"][name] for name in one["textures"]}
        assert set(one["textures"]) == names
        assert one["surface_texels"] == all_["surface_texels"]
        assert one["samples_outside"] == (all_["samples_outside"] if "ao" in wanted else [])
        parts = {spec.get_string_attribute("name") for spec, _ in read_parts(folder / one["file"])}
        assert parts == names
    (folder / "module_003.exr").unlink()
    again = manifest_of(render(folder, *RENDER, "--layers", asked, "--resume"))
    assert [v["textures"] for v in again["views"]] == [v["textures"] for v in manifest["views"]]
    assert "verify" in again["views"][0]["seconds"]
    assert main(["compare", str(folder), str(folder)]) == 0
    assert main(["compare", str(whole_folder), str(folder)]) == 1
    assert "passes, with warnings" in capsys.readouterr().out  # of layers that the reference does not have
    capsys.readouterr()
    for layer in ("shaded", "merged", "ao_2"):
        there = layer in names
        assert main(["view", str(folder), "--layer", layer, "--width", "32"]) == (0 if there else 2)
        said = capsys.readouterr().err.splitlines()
        assert any(f"has no '{layer}' to show" in line for line in said) != there


@pytest.mark.parametrize(("asked", "without"), [
    ("blurred", "blurred"),
    ("ao,depth", "ao_1, ao_2"),
    ("positions", "positions"),
    ("merged,blurred,shaded", "merged, shaded"),
    ("depth,positions,ao,merged,blurred,shaded", "shaded"),
    ("depth,positions,merged,color", None),
])  # fmt: skip
def test_a_comparison_says_which_intervals_need_other_layers(whole_folder, tmp_path, capsys, asked, without):
    """A renderer whose numbers are off by an ulp: intervals tell that this is right."""
    render(tmp_path / "some", *RENDER, "--layers", asked)
    (tmp_path / "mine").mkdir()
    for name in ("module_002.exr", "module_003.exr"):
        parts = read_parts(whole_folder / name)
        for _, pixels in parts:
            seen = np.isfinite(pixels) & (pixels != 0)
            pixels[seen] = np.nextafter(pixels[seen], np.float32(2))
        write_parts(tmp_path / "mine" / name, parts)
    capsys.readouterr()
    assert main(["compare", str(tmp_path / "mine"), str(tmp_path / "some")]) == (1 if without is None else 2)
    said = capsys.readouterr().out
    note = f"no interval is known of {without}: the reference was rendered without layers they are made of"
    assert said.count("no interval is known of") == (without is not None)
    assert (note in said) == (without is not None)


def test_a_job_of_other_layers_is_not_taken_up_and_leaves_no_sheet(whole_folder, tmp_path, capsys):
    folder = shutil.copytree(whole_folder, tmp_path / "copy")
    render(folder, *RENDER, "--layers", "depth,merged", "--resume", code=2)
    assert "it was rendered with other parameters (layers)" in sentence(capsys)
    assert (folder / "contact.png").is_file()
    render(folder, *RENDER, "--layers", "depth,merged")
    assert not (folder / "contact.png").exists()


def test_colour_alone_of_a_mesh_without_any_is_refused(tmp_path, capsys):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    job = [str(tmp_path / "a.obj"), "--resolution", "16x12", "--layers"]
    render(tmp_path / "out", *job, "color", code=2)
    assert sentence(capsys) == f"{tmp_path}/a.obj has no colour, and no other layer was asked for"
    assert set(digests_of(render(tmp_path / "out", *job, "color,depth"))[0]) == {"depth"}
