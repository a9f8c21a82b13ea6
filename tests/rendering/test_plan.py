"""Parts that a plan leaves out change no bit: with and without it, on displays of every kind, cameras, estimators."""

import json
from dataclasses import replace

import numpy as np
import pytest
import raycast_scenes as scenes
from bits import assert_same_bits
from jobs import manifest_of, render

from lfssao import Buffers, Camera, Mesh, RayCaster, Settings, Textures, display_names, estimate, find_display
from lfssao.ao import post, ssao
from lfssao.ao.estimators.neighbours import algorithm2_with_neighbours
from lfssao.ao.estimators.registry import of_one_view
from lfssao.cli.main import main
from lfssao.gbuffer.caster import DepthCache
from lfssao.optics.kernels.projection import CROSSED_SLITS
from lfssao.optics.view import WorldToImage, seen_rows
from lfssao.rendering.passes import occlusions, render_view
from lfssao.rendering.plan import RULES, background, other_radii, planned, without_background
from lfssao.rendering.views import module_views, neighbour_views
from lfssao.samples import texel_turns


def assert_same(one, other):
    """All textures bit for bit, their shapes and dtypes, and what they count."""
    layers = [(t.merged, t.blurred, t.image, t.shaded, *t.ao, t.gbuffer.depth, t.gbuffer.positions, t.gbuffer.triangle,
               t.gbuffer.color, t.gbuffer.normals) for t in (one, other)]  # fmt: skip
    for a, b in zip(*layers, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            assert a.flags.c_contiguous
            assert_same_bits(a, b)
    assert one.outside == other.outside


def everything(caster, view, options, neighbours=()):
    """The textures that all passes make one by one: of every row, of every radius by all its samples."""
    g = caster.gbuffer(view, options.color_filter, options.normals)
    if neighbours:
        given = g.depth, g.positions, view.world_to_image, neighbours, options.samples
        ao = [algorithm2_with_neighbours(*given, radius) for radius in options.radii]
    else:
        given = options.samples, options.weights
        how = options.rotation, *g.depth.shape, options.rotation_seed, g.depth.dtype
        buffers = replace(Buffers.of(g, view), turns=None if options.rotation == "none" else texel_turns(*how))
        ao = [estimate(options.estimator, buffers, r, *given, **options.parameters) for r in options.radii]
    merged = post.merge([each.texture for each in ao])
    blurred = post.blur(merged, options.blur)
    shaded = post.shade_white(g.depth, blurred) if g.color is None else post.shade(g.color, blurred)
    inner = [slice(view.guard, size - view.guard) for size in (view.height, view.width)]
    made = [np.ascontiguousarray(texture[*inner]) for texture in (merged, blurred, shaded)]
    ao_textures = tuple(np.ascontiguousarray(each.texture[*inner]) for each in ao)
    seen = int((g.triangle >= 0).sum())
    return Textures(view, g, ao_textures, *made, tuple(each.outside for each in ao), seen, options, {})


def check(caster, view, options, neighbours=()):
    """Render with and without what is left out; the cover, and the rows that are cast."""
    made = render_view(caster, view, options, neighbours)
    assert_same(made, everything(caster, view, options, neighbours))
    return (made.gbuffer.triangle >= 0).mean(), seen_rows(view, caster.bounds)


def placed(box, size, moved):
    """A box ``size`` times as large around the scene's, moved by shares of the scene's size: the scene gets smaller."""
    middle = 0.5 * (box[0] + box[1])
    return middle + (box - middle) * size + np.array(moved) * (box[1] - box[0])


# Places of the scene in the texture: all over it, in a corner, across its border, beside it.
PLACES = {"fitted": (1, (0, 0, 0)), "corner": (4, (1, 1, 0.3)), "border": (2, (0, -1.2, 0)), "beside": (3, (40, 0, 0))}


@pytest.mark.parametrize("name", display_names())
@pytest.mark.parametrize("place", PLACES)
def test_displays_of_every_kind(statue, name, place):
    display = find_display(name).with_resolution(48, 36)
    guard = 5 * (place in ("corner", "border"))
    views = module_views(statue, display, None, guard, placed(statue.bounds, *PLACES[place]))
    radii = 0.0, 2e-4, 0.05, 0.05, 0.2
    options = Settings(radii, blur=1.4, normals="smooth" if place == "border" else None)
    caster = RayCaster(statue, views[0].cast_from_world)
    for view in {views[0].name: views[0], views[-1].name: views[-1]}.values():
        cover, rows = check(caster, view, options)
        assert (cover > 0) == (place != "beside")
        assert (not rows) == (place == "beside" and view.rays.kind == CROSSED_SLITS)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("place", PLACES)
def test_cameras(statue, projection, place):
    view = Camera.looking_at(placed(statue.bounds, *PLACES[place]), projection).view(48, 36, 3)
    options = Settings((0.1, 0.0, 1e-3), blur=0.5 * (place != "border"))
    cover, rows = check(RayCaster(statue, view.cast_from_world), view, options)
    assert (cover > 0) == bool(rows) == (place != "beside")


@pytest.mark.parametrize("name", of_one_view())
def test_every_estimator(statue, name):
    view = module_views(statue, find_display("sample-a").with_resolution(32, 24), range(4, 5), 0,
                        placed(statue.bounds, 2, (0.5, 0.2, 0)))[0]  # fmt: skip
    cover, _ = check(RayCaster(statue, view.cast_from_world), view, Settings((0.0, 0.1, 0.1), estimator=name))
    assert 0.01 < cover < 0.3


@pytest.mark.parametrize("place", ["border", "beside"])
def test_neighbours_whose_rays_are_cut_and_modules_that_see_nothing(statue, place):
    display = find_display("sample-a").with_resolution(40, 30)
    box = placed(statue.bounds, *PLACES[place])
    views = module_views(statue, display, None, 0, box)
    asked = neighbour_views(statue, display, 3, None, 0, box)
    caster = RayCaster(statue, views[0].cast_from_world)
    options = Settings((0.0, 0.2), neighbours=3)
    for index in (0, 10):
        whole = [(other.world_to_image, caster.gbuffer(other).depth) for other in asked[index]]
        made = render_view(caster, views[index], options, DepthCache(caster, 7).neighbours(asked[index]))
        assert_same(made, everything(caster, views[index], options, whole))


def test_the_one_sample_of_radius_0_counts_for_all_that_fall_outside(statue):
    """A mapping that is shifted by more than the texture, so that every sample is outside."""
    view = module_views(statue, find_display("virtual").with_resolution(48, 36))[0]
    gbuffer = RayCaster(statue, view.cast_from_world).gbuffer(view)
    numbers = view.world_to_image.numbers.copy()
    numbers[14] += 99
    shifted = replace(view, world_to_image=WorldToImage(view.world_to_image.kind, numbers))
    options = Settings((0.0,))
    (made,) = occlusions(Buffers.of(gbuffer, shifted), options)
    right = ssao.algorithm2(gbuffer.depth, gbuffer.positions, shifted.world_to_image, options.samples, 0.0)
    assert made.outside == right.outside == 8 * (gbuffer.triangle >= 0).sum()
    assert_same_bits(made.texture, right.texture)


@pytest.mark.parametrize("way", scenes.WAYS)
@pytest.mark.parametrize("name", scenes.VIEWS)
def test_gbuffers_of_some_rows(way, name):
    """In them the texture of the whole, elsewhere nothing; by the tree and by rasterisation."""
    rng = np.random.default_rng(2)
    view = scenes.VIEWS[name](37, 26)
    vertices, faces = scenes.sheet(view, rng, 3)
    caster = RayCaster(Mesh(scenes.to_world(view, vertices), faces, normals=vertices), view.cast_from_world)
    whole = caster.gbuffer(view, normals="smooth")
    for rows in (range(9, 22), range(26), range(25, 26), range(0)):
        with scenes.way(way):
            seen = caster.gbuffer(view, normals="smooth", rows=rows)
        inside = np.zeros((26, 37), np.bool_)
        inside[rows.start : rows.stop] = True
        for part, nothing in (("depth", np.inf), ("positions", np.inf), ("normals", 0), ("triangle", -1)):
            got = getattr(seen, part)
            want = getattr(whole, part).copy()
            want[~inside] = nothing
            assert_same_bits(got, want)


# The command and the manifest
RENDER = ["statue", "--display", "sample-a", "--modules", "2:4", "--resolution", "48x36", "--radii",
          "0,0.1,0.1", "--blur", "0.7", "--threads", "1"]  # fmt: skip


def test_the_manifest_lists_what_is_left_out(tmp_path):
    manifest = manifest_of(render(tmp_path, *RENDER))
    left = {each["what"]: (each["left_out"], each["of"]) for each in manifest["plan"]}
    assert left["radii"] == (1, 3)
    assert left["samples of radius 0"] == (7, 8)
    assert left["normals"] == (2, 2)
    surface = sum(view["surface_texels"] for view in manifest["views"])
    assert left["background"] == (2 * 48 * 36 - surface, 2 * 48 * 36)
    assert set(left) == {"radii", "samples of radius 0", "normals", "background"}
    assert all(each["why"] == RULES[each["what"]] for each in manifest["plan"])


def test_nothing_is_said_of_what_is_not_left_out(statue):
    """A view that the scene fills, each radius once, normals asked for, a colour."""
    (view,) = module_views(statue, find_display("virtual"), None, 0, placed(statue.bounds, 0.01, (0, 0, 0)))
    options = Settings((0.1, 0.2), normals="smooth")
    assert planned([view], [statue.bounds], options, True) == {}
    assert background(options, 100, 100) == {}
    assert background(Settings((0.1,), estimator="sao"), 100, 40) == {}
    assert background(options, 100, 40) == {"background": (60, 100)}


def test_modules_that_miss_the_scene_are_left_out(statue):
    display = find_display("sample-a").with_resolution(48, 36)
    views = module_views(statue, display, None, 0, placed(statue.bounds, *PLACES["beside"]))
    middle = placed(statue.bounds, *PLACES["beside"])
    left = planned(views, [statue.bounds, middle], Settings((0.1,), normals="smooth"), False)
    assert left == {"modules": (21, 42), "colour": (21, 21)}
    assert planned(views, [statue.bounds], Settings((0.1,)), True) == {"modules": (21, 21)}
    views = module_views(statue, display, None, 0, placed(statue.bounds, *PLACES["corner"]))
    cast = [len(seen_rows(view, statue.bounds)) for view in views]
    left = planned(views, [statue.bounds], Settings((0.1,), normals="smooth"), True)
    assert left == {"rows": (21 * 36 - sum(cast), 21 * 36)}


def test_a_plan_takes_a_renders_options_and_writes_nothing(tmp_path, capsys):
    before = sorted(tmp_path.iterdir())
    assert main(["plan", *RENDER, "-o", str(tmp_path / "never")]) == 0
    text = capsys.readouterr().out
    assert text.count("\n") <= 10
    assert "radii: 1 of 3; a radius that comes again has the texture of the first" in text
    assert "texels of module_003; AO of a texel without a surface is 0" in text
    assert "module_003: AO takes" in text
    assert main(["plan", *RENDER, "--json", "--neighbours", "1"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert {each["what"] for each in made["left_out"]} >= {"radii", "samples of radius 0", "normals"}
    assert made["view"] == "module_003"
    assert min(made["seconds"], made["ao_seconds"], made["ao_seconds_with_all"]) > 0
    assert sorted(tmp_path.iterdir()) == before
    assert main(["plan", "--why"]) == 0
    assert capsys.readouterr().out.splitlines() == [f"{what}: {why}" for what, why in RULES.items()]


def test_ao_with_all_that_is_left_out_computes_every_texel_by_other_radii(statue):
    (view,) = module_views(statue, find_display("virtual").with_resolution(24, 18))
    gbuffer = RayCaster(statue, view.cast_from_world).gbuffer(view)
    seen = gbuffer.triangle >= 0
    filled = without_background(gbuffer)
    assert np.isfinite(filled.positions).all()
    assert filled.depth[~seen].min() == filled.depth.max() == gbuffer.depth[seen].max()
    np.testing.assert_array_equal(filled.positions[seen], gbuffer.positions[seen])
    samples = np.random.default_rng(1).uniform(-1, 1, (9, 3))
    radii = (0.0, 0.1, 0.1, 0.0, 0.1)
    other = other_radii(radii)
    assert len(set(other)) == 5
    assert 0.0 not in other
    for one, two in zip(radii, other, strict=True):
        np.testing.assert_array_equal((one * samples).astype(np.float32), (two * samples).astype(np.float32))
    nothing = replace(gbuffer, triangle=np.full_like(gbuffer.triangle, -1))
    assert not without_background(nothing).depth.any()
