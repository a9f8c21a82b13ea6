"""Layers beside depth and positions: normals, colour filters, and the guard band around every texture."""

import json
import math
import shutil

import numpy as np
import pytest
from exr_parts import read_parts, write_parts

from lfssao import (
    Buffers,
    Camera,
    InputError,
    Mesh,
    Paint,
    RayCaster,
    Settings,
    builtin_scene,
    estimate,
    find_display,
    make_samples,
    module_views,
    render_view,
)
from lfssao.cli.main import main
from lfssao.rendering.settings import LAYERS

RESOLUTION = (64, 48)


@pytest.fixture(scope="module")
def statue():
    return builtin_scene("statue")


def view_of(mesh, guard=0, module=3):
    return module_views(mesh, find_display("sample-a").with_resolution(*RESOLUTION), range(module, module + 1), guard)[
        0
    ]


def unit(x, y, z):
    """The kernel's normalisation again: by the largest component, then by the length."""
    size = max(abs(x), abs(y), abs(z))
    x, y, z = x / size, y / size, z / size
    length = math.sqrt((x * x + y * y) + z * z)
    return x / length, y / length, z / length


def geometric(mesh, face):
    a, b, c = (mesh.vertices[corner].tolist() for corner in mesh.faces[face])
    e, f = [q - p for p, q in zip(a, b, strict=True)], [q - p for p, q in zip(a, c, strict=True)]
    return unit(e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])


def test_geometric_normals_are_the_triangles_and_face_the_viewer(statue):
    view = view_of(statue)
    seen = RayCaster(statue, view.cast_from_world).gbuffer(view, None, "geometric")
    texels = np.argwhere(seen.triangle >= 0)
    assert len(texels) > 300
    for j, i in texels:
        expected = np.array(geometric(statue, seen.triangle[j, i]), np.float32)
        found = seen.normals[j, i]
        same = np.array_equal(found.view(np.int32), expected.view(np.int32))
        assert same or np.array_equal(found.view(np.int32), (-expected).view(np.int32))
    display = find_display("sample-a").with_resolution(*RESOLUTION)
    _, direction, _ = display.texel_ray(3, texels[:, 1] + 0.5, texels[:, 0] + 0.5)
    into_scene = direction * [1, 1, -1]  # the ROI is fitted by one scale and z turned round
    assert ((seen.normals[seen.triangle >= 0] * into_scene).sum(axis=1) <= 1e-6).all()
    assert not seen.normals[seen.triangle < 0].any()


def test_a_surface_seen_from_behind_has_its_normal_turned():
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1.5, 0]])
    for faces in ([[0, 1, 2]], [[0, 2, 1]]):
        mesh = Mesh(corners, np.array(faces))
        view = Camera.looking_at(np.array([[-1.0, -1, -1], [1, 1.5, 1]])).view(16, 12)
        seen = RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric")
        assert (seen.normals[seen.triangle >= 0] == [0, 0, 1]).all()


def test_smooth_normals_are_those_of_the_vertices():
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1.5, 0]])
    normals = np.array([[-3.0, 0, 4], [3, 0, 4], [0, 5, 0.0]])
    mesh = Mesh(corners, np.array([[0, 1, 2]]), normals=normals)
    view = Camera.looking_at(np.array([[-1.0, -1, -1], [1, 1.5, 1]]), "orthographic").view(64, 48)
    caster = RayCaster(mesh, view.cast_from_world)
    seen = caster.gbuffer(view, None, "smooth")
    j, i = np.argwhere(seen.triangle >= 0)[50]
    # Barycentric weights from the position, another way than the kernel's.
    x, y = seen.positions[j, i, :2].astype(float)
    c = (y + 1) / 2.5
    b = (x + (1 - c)) / 2
    expected = np.array(unit(*((1 - b - c) * normals[0] + b * normals[1] + c * normals[2]).tolist()))
    np.testing.assert_allclose(seen.normals[j, i], expected, atol=1e-6)
    # Without normals at the vertices smooth ones are the triangles'.
    bare = RayCaster(Mesh(corners, mesh.faces), view.cast_from_world).gbuffer(view, None, "smooth")
    assert (bare.normals[bare.triangle >= 0] == [0, 0, 1]).all()


def test_nearest_filter_gives_only_colours_of_the_texture():
    texture = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [0, 0, 1]]], np.float32)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    paint = Paint(np.ones((1, 3), np.float32), np.zeros(2, np.int32), (texture,), corners[:, :2].copy())
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), paint)
    view = Camera.looking_at(mesh.bounds + np.array([[0, 0, -0.1], [0, 0, 0.1]]), "orthographic").view(40, 40)
    caster = RayCaster(mesh, view.cast_from_world)
    nearest, bilinear = caster.gbuffer(view, "nearest"), caster.gbuffer(view, "bilinear")
    surface = nearest.triangle >= 0
    x, y = nearest.positions[surface][:, 0], nearest.positions[surface][:, 1]
    clear = (np.abs(x - 0.5) > 1e-3) & (np.abs(y - 0.5) > 1e-3)
    expected = texture[(y < 0.5).astype(int), (x > 0.5).astype(int)]
    assert np.array_equal(nearest.color[surface][clear], expected[clear])
    assert len(np.unique(bilinear.color[surface], axis=0)) > 4


def test_unknown_layers_are_refused(statue):
    view = view_of(statue)
    caster = RayCaster(statue, view.cast_from_world)
    with pytest.raises(InputError, match=r"normals is 'round'.*geometric, smooth"):
        caster.gbuffer(view, None, "round")
    with pytest.raises(InputError, match=r"color is 'cubic'.*bilinear, nearest"):
        caster.gbuffer(view, "cubic")


@pytest.mark.parametrize("guard", [1, 7, 32])
def test_a_guard_band_adds_texels_and_changes_none(statue, guard):
    plain, banded = view_of(statue), view_of(statue, guard)
    caster = RayCaster(statue, plain.cast_from_world)
    inner, outer = caster.gbuffer(plain), caster.gbuffer(banded)
    crop = slice(guard, -guard), slice(guard, -guard)
    assert outer.depth.shape == (48 + 2 * guard, 64 + 2 * guard)
    for name in ("depth", "positions", "color"):
        a, b = getattr(inner, name), np.ascontiguousarray(getattr(outer, name)[crop])
        assert np.array_equal(a.view(np.int32), b.view(np.int32))
    assert np.array_equal(inner.triangle, outer.triangle[crop])


def test_a_guard_band_lets_occluders_outside_be_seen():
    # A floor towards the viewer and a wall that only the guard band sees.
    display = find_display("virtual").with_resolution(64, 48)
    floor = np.array([[-0.6, -0.5, 0.0], [0.6, -0.5, 0.0], [0.6, 0.5, 0.0], [-0.6, 0.5, 0.0]])
    wall = floor + np.array([1.12, 0.0, 0.06])
    mesh = Mesh(np.concatenate([floor, wall]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]))
    world = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0]])
    settings = Settings((0.1,), make_samples("latin", 64), blur=0)
    plain, banded = display.view(0, world), display.view(0, world, 16)
    caster = RayCaster(mesh, world)
    without, with_band = render_view(caster, plain, settings), render_view(caster, banded, settings)
    assert with_band.ao[0].shape == without.ao[0].shape == (48, 64)
    assert with_band.outside[0] < without.outside[0]
    assert (with_band.ao[0][10:-10, 10:50] == without.ao[0][10:-10, 10:50]).all()
    assert with_band.ao[0][:, 60:].sum() > without.ao[0][:, 60:].sum()


def test_exr_windows_say_where_the_guard_band_is(tmp_path):
    arguments = ["render", "statue", "-o", str(tmp_path), "--resolution", "32x24", "--guard", "5", "--normals"]
    assert main([*arguments, "--samples", "2", "--radii", "2%"]) == 0
    found = {}
    for spec, _ in read_parts(tmp_path / "module_000.exr"):
        found[spec.get_string_attribute("name")] = (
            (spec.x, spec.y, spec.width, spec.height), (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
        )  # fmt: skip
    banded = {"depth", "positions", "color", "normals"}
    assert banded < set(found)
    for name, (data, shown) in found.items():
        assert shown == (0, 0, 32, 24)
        assert data == ((-5, -5, 42, 34) if name in banded else (0, 0, 32, 24))


def test_command_line_layers(tmp_path, capsys):
    common = ["render", "ammonite", "--resolution", "32x24", "--samples", "2", "--radii", "2%"]
    assert main([*common, "-o", str(tmp_path / "a"), "--normals", "smooth", "--filter", "nearest"]) == 0
    for wrong, word in (
        (["--normals", "up"], "normals"),
        (["--filter", "cubic"], "color_filter"),
        (["--caster", "vulkan"], "caster is 'vulkan': choose one of exact, embree"),
        (["--guard", "-1"], "--guard"),
    ):
        assert main([*common, "-o", str(tmp_path / "b"), *wrong]) == 2
        assert word in capsys.readouterr().err
    assert not (tmp_path / "b").exists()


# Layers that are asked for

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
    (view,) = module_views(statue, find_display("virtual").with_resolution(*RESOLUTION), None, 4, box)
    caster, cast = RayCaster(statue, view.cast_from_world), []

    class Caster:
        bounds = statue.bounds

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


def test_layers_by_default_and_those_that_there_are_not(statue):
    assert Settings((0.1,)).kept == tuple(name for name in LAYERS if name != "normals")
    assert Settings((0.1,), normals="smooth").kept == LAYERS
    assert Settings((0.1,), estimator="hbao").kept == LAYERS
    asked = Settings((0.1,), layers=("shaded", "normals", "shaded"))
    assert asked.kept == ("normals", "shaded")
    assert asked.normals == "geometric"
    for wrong in (("ao_1",), ("depth", "best"), ()):
        with pytest.raises(InputError, match="layers: "):
            Settings((0.1,), layers=wrong)
    view = view_of(statue)
    made = render_view(RayCaster(statue, view.cast_from_world), view, Settings((0.1,), layers=("shaded",)))
    assert made._repr_png_() is None
    with pytest.raises(InputError, match="color is not among the layers shaded"):
        _ = made.image
    with pytest.raises(InputError, match="no positions"):
        estimate("lf", Buffers.of(made.gbuffer, view), 0.1)


RENDER = ["render", "statue", "--display", "sample-a", "--modules", "2:4", "--resolution", "48x36", "--radii", "3%,6%"]


@pytest.fixture(scope="module")
def whole_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("layers") / "whole"
    assert main([*RENDER, "-o", str(folder)]) == 0
    return folder


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text())


@pytest.mark.parametrize("asked", ["depth", "merged", "ao,positions", "shaded", "blurred,depth,color,shaded"])
def test_folders_of_some_layers(whole_folder, tmp_path, capsys, asked):
    """Their parts are the whole folder's; they can be taken up, compared, and viewed if they have a picture."""
    folder, wanted = tmp_path / "some", asked.split(",")
    assert main([*RENDER, "--layers", asked, "-o", str(folder)]) == 0
    sheet = {"blurred", "depth", "color", "shaded"} <= set(wanted)
    assert ("contact.png" in capsys.readouterr().out) == (folder / "contact.png").is_file() == sheet
    names = {part for name in wanted for part in (("ao_1", "ao_2") if name == "ao" else (name,))}
    manifest, whole = manifest_of(folder), manifest_of(whole_folder)
    assert set(manifest["settings"]["layers"]) == set(wanted)
    for one, all_ in zip(manifest["views"], whole["views"], strict=True):
        assert one["textures"] == {name: all_["textures"][name] for name in one["textures"]}
        assert set(one["textures"]) == names
        assert one["surface_texels"] == all_["surface_texels"]
        assert one["samples_outside"] == (all_["samples_outside"] if "ao" in wanted else [])
        parts = {spec.get_string_attribute("name") for spec, _ in read_parts(folder / one["file"])}
        assert parts == names
    (folder / "module_003.exr").unlink()
    assert main([*RENDER, "--layers", asked, "-o", str(folder), "--resume"]) == 0
    again = manifest_of(folder)
    assert [v["textures"] for v in again["views"]] == [v["textures"] for v in manifest["views"]]
    assert "verify" in again["views"][0]["seconds"]
    assert main(["compare", str(folder), str(folder)]) == 0
    assert main(["compare", str(whole_folder), str(folder)]) == 1
    assert "conforms, with warnings" in capsys.readouterr().out  # of layers that the reference does not have
    capsys.readouterr()
    for layer in ("shaded", "merged", "ao_2"):
        there = layer in names
        assert main(["view", str(folder), "--layer", layer, "--width", "32"]) == (0 if there else 2)
        said = capsys.readouterr().err.splitlines()
        assert any(f"has no '{layer}' to show" in line for line in said) != there


@pytest.mark.parametrize(
    ("asked", "without"),
    [
        ("blurred", "blurred"),
        ("ao,depth", "ao_1, ao_2"),
        ("positions", "positions"),
        ("merged,blurred,shaded", "merged, shaded"),
        ("depth,positions,ao,merged,blurred,shaded", "shaded"),
        ("depth,positions,merged,color", None),
    ],
)
def test_a_comparison_says_which_intervals_need_other_layers(whole_folder, tmp_path, capsys, asked, without):
    """A renderer whose numbers are off by an ulp: intervals tell that this is right."""
    assert main([*RENDER, "--layers", asked, "-o", str(tmp_path / "some")]) == 0
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
    folder = tmp_path / "copy"
    shutil.copytree(whole_folder, folder)
    job = [*RENDER, "--layers", "depth,merged", "-o", str(folder)]
    assert main([*job, "--resume"]) == 2
    assert "it was rendered with other parameters (layers)" in capsys.readouterr().err
    assert (folder / "contact.png").is_file()
    assert main(job) == 0
    assert not (folder / "contact.png").exists()


def test_colour_alone_of_a_mesh_without_any_is_refused(tmp_path, capsys):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    job = ["render", str(tmp_path / "a.obj"), "-o", str(tmp_path / "out"), "--resolution", "16x12", "--layers"]
    assert main([*job, "color"]) == 2
    assert capsys.readouterr().err == f"lfssao: {tmp_path}/a.obj has no colour, and no other layer was asked for\n"
    assert main([*job, "color,depth"]) == 0
    assert set(manifest_of(tmp_path / "out")["views"][0]["textures"]) == {"depth"}


def test_no_radius_is_warned_of_where_no_ao_is_asked_for(tmp_path, capsys):
    assert main([*RENDER[:-1], "0.00001", "--layers", "depth", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().err == ""
