"""A module's nearest modules, their depth textures, and renders that ask them."""

from inspect import signature

import numpy as np
import pytest
from bits import assert_same_bits
from jobs import NEEDS_EMBREE, manifest_of
from jobs import render as render_files
from lenslet_files import LENSES

from lfssao import RayCaster, Settings, find_display, make_samples, module_views, parse_display, read_exr
from lfssao.ao import ssao
from lfssao.ao.estimators import neighbours
from lfssao.errors import InputError
from lfssao.gbuffer.caster import DepthCache, textures_kept
from lfssao.rendering.passes import render
from lfssao.rendering.views import nearest_modules, neighbour_views

SAMPLE_A = find_display("sample-a")


def test_nearest_modules_and_how_many_there_are():
    assert nearest_modules(SAMPLE_A, 10, 4) == [9, 11, 8, 12]
    assert nearest_modules(SAMPLE_A, 0, 3) == [1, 2, 3]
    assert nearest_modules(SAMPLE_A, 5, 0) == []
    with pytest.raises(InputError, match="sample-a has 20 modules besides"):
        nearest_modules(SAMPLE_A, 5, 21)


# In a render


def test_command_and_library_render_what_the_pass_makes_of_the_nearest_modules(statue, tmp_path):
    words = "--display", "sample-a", "--modules", "9:13", "--resolution", "60x36", "--radii", "0.3"
    render_files(tmp_path, "statue", *words, "--neighbours", "2")
    display = SAMPLE_A.with_resolution(60, 36)
    views = module_views(statue, display)
    caster = RayCaster(statue, views[0].cast_from_world)
    seen = {k: caster.gbuffer(views[k]) for k in range(8, 14)}
    made = render(statue, display, Settings((0.3,), neighbours=2), range(9, 13))
    for index, textures in zip(range(9, 13), made, strict=True):
        asked = [(views[k].world_to_image, seen[k].depth) for k in (index - 1, index + 1)]
        own = seen[index].depth, seen[index].positions, views[index].world_to_image
        expected = neighbours.algorithm2_with_neighbours(*own, asked, make_samples(), 0.3)
        found = read_exr(tmp_path / f"module_{index:03d}.exr")["ao_1"].pixels[..., 0]
        assert_same_bits(found, expected.texture)
        assert_same_bits(textures.ao[0], expected.texture)
        assert textures.view.name == f"module_{index:03d}"
        assert (found < ssao.algorithm2(*own, make_samples(), 0.3).texture).any()
    manifest = manifest_of(tmp_path)
    assert (manifest["settings"]["estimator"], manifest["settings"]["neighbours"]) == ("lf-neighbours", 2)
    asked = [sorted(other["name"] for other in entry["neighbours"]) for entry in manifest["views"]]
    assert asked == [[f"module_{k:03d}" for k in (index - 1, index + 1)] for index in range(9, 13)]
    others = {other["name"]: other["view"] for other in manifest["views"][0]["neighbours"]}
    assert others["module_010"] == manifest["views"][1]["view"]


def test_depths_are_cast_once_as_long_as_they_are_kept(statue):
    display = SAMPLE_A.with_resolution(20, 12)
    views = module_views(statue, display)
    texels = RayCaster(statue, views[0].cast_from_world)
    cast = []

    class Counting:
        bounds = texels.bounds

        def of_view(self, view):
            return self

        def gbuffer(self, view, color, rows, caster, positions):
            cast.append(view.name)
            assert (color, caster, positions) == (None, "exact", False)
            return texels.gbuffer(view, color, rows=rows)

    cache = DepthCache(Counting(), 3)
    for asked in ((0, 1), (1, 2), (0, 2), (5,), (1,)):
        found = cache.neighbours(tuple(views[k] for k in asked))
        for k, (mapping, depth) in zip(asked, found, strict=True):
            assert mapping is views[k].world_to_image
            np.testing.assert_array_equal(depth, texels.gbuffer(views[k]).depth)
    assert [int(name[-3:]) for name in cast] == [0, 1, 2, 5, 1]


def test_all_textures_of_lenses_are_kept_and_those_of_modules_in_turn(statue):
    display = parse_display(LENSES, "small.toml")
    asked = neighbour_views(statue, display, 4, range(6, 9))
    names = sorted({int(view.name[-3:]) for views in asked for view in views})
    assert names == [1, 2, 3, 5, 6, 7, 8, 9, 11, 12, 13]
    assert textures_kept(asked) == 11
    large = neighbour_views(statue, SAMPLE_A.with_resolution(4096, 2048), 2, range(8))
    assert textures_kept(large) == 5


@NEEDS_EMBREE
def test_neighbours_are_seen_by_the_caster_of_the_settings(statue, monkeypatch):
    real = RayCaster.gbuffer
    asked = []

    def recorded(self, *options, **named):
        asked.append(signature(real).bind(self, *options, **named).arguments["caster"])
        return real(self, *options, **named)

    monkeypatch.setattr(RayCaster, "gbuffer", recorded)
    display = SAMPLE_A.with_resolution(20, 12)
    for caster in ("exact", "embree"):
        render(statue, display, Settings((0.1,), neighbours=2, caster=caster), range(3, 4))[0]
    assert asked == ["exact"] * 3 + ["embree"] * 3
