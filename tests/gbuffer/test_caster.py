"""G-buffers against brute force, bit for bit, and equal bits whatever traces the rays; colour at the hits."""

import json
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import golden
import numpy as np
import pytest
import raycast_scenes as scenes
from bits import assert_same_bits
from jobs import NEEDS_EMBREE, python
from reference import raycast

from lfssao import Camera, Mesh, Paint, RayCaster, builtin_scene, display_names, find_display, fit_roi, module_views
from lfssao.errors import InputError
from lfssao.gbuffer import rasterize
from lfssao.gbuffer.kernels import first_hit

VIEWS = list(scenes.VIEWS)


def brute_force(mesh, view, rays=None):
    rays = scenes.texel_rays(view) if rays is None else rays
    cast = np.stack(raycast.affine(view.cast_from_world, *mesh.vertices.T), axis=1)
    hits = raycast.first_hits(rays, cast[mesh.faces])
    return hits, *raycast.surface(*view.rays, rays, view.world_from_cast, hits)


def assert_same_surface(seen, triangle, depth, positions):
    """Triangles, and all bits of depths and positions, given for each texel in any shape."""
    np.testing.assert_array_equal(seen.triangle.ravel(), triangle.ravel())
    assert_same_bits(seen.depth.ravel(), depth.ravel())
    assert_same_bits(seen.positions.ravel(), positions.ravel())


def check(mesh, view, rays=None):
    """Every texel by the tree and by rasterisation."""
    hits, depth, positions = brute_force(mesh, view, rays)
    caster = RayCaster(mesh, view.cast_from_world)
    for way in scenes.WAYS:
        with scenes.way(way):
            seen = caster.gbuffer(view)
        assert seen.triangle.shape == seen.depth.shape == seen.positions.shape[:2] == (view.height, view.width)
        assert seen.triangle.dtype == np.int32
        assert_same_surface(seen, hits.triangle, depth, positions)
    return hits


def in_world(scene, view, rng):
    vertices, faces = scene(view, rng)
    return Mesh(scenes.to_world(view, vertices), faces)


def soup_in(box, rng, n=300):
    """Triangles of all sizes in a box, (2, 3)."""
    size = box[1] - box[0]
    middle = box[0] + rng.random((n, 1, 3)) * size
    corners = middle + size * 10 ** rng.uniform(-2, -0.3, (n, 1, 1)) * rng.uniform(-1, 1, (n, 3, 3))
    return Mesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


# Brute force


@pytest.mark.parametrize("name", display_names())
def test_displays_of_every_kind(name):
    """Curved screens, arcs, turned modules: their rays are taken as given."""
    display = find_display(name).with_resolution(37, 26)
    mesh = soup_in(np.array(display.roi), np.random.default_rng(13), 200)
    v, u = (n.ravel() + 0.5 for n in np.mgrid[:26, :37])
    for index in {0, len(display.modules) // 2, len(display.modules) - 1}:
        origin, direction, span = display.texel_ray(index, u, v)
        view = display.view(index, scenes.IDENTITY)
        if view.rays.kind == raycast.CROSSED_SLITS:
            continue  # above
        rays = *origin[:, :2].T, *direction[:, :2].T, *span.T
        hits = check(mesh, view, rays)
        assert (hits.triangle >= 0).mean() > 0.05


@pytest.mark.parametrize("where", [0.0, 1e6, 1e8])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_far_away_tiny_and_huge_worlds(where, scale):
    """World offsets of 1e6 and 1e8, with triangles that float64 alone can tell apart, or none can."""
    middle = where * np.array([1.0, -1.0, 0.5])
    box = np.array([[-1.0, -0.75, -1.0], [1.0, 0.75, 1.0]]) * scale + middle
    mesh = soup_in(box, np.random.default_rng(5))
    display = find_display("sample-a").with_resolution(35, 22)
    world = fit_roi(mesh.bounds, display.roi)
    views = [display.view(k, world) for k in (0, 10, 20)]
    eye, target = (tuple(middle + scale * np.array(place)) for place in ((2.0, 3.0, 4.0), (0.1, -0.2, 0.3)))
    askew = eye, target, (0.1, 1.0, 0.2), 2.5 * scale, 2.0 * scale, 7.0 * scale
    views += [Camera(kind, *askew).view(35, 22) for kind in ("perspective", "orthographic")]
    for view in views:
        hits = check(mesh, view)
        assert (hits.triangle >= 0).mean() > 0.1


def test_a_wide_view_from_near_by():
    """Rays so slanted (5,000 sideways for 1 ahead) that their rounding errors are larger than those of corners."""
    camera = Camera("perspective", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 1e4, 1e-6, 1e3)
    view = camera.view(17, 13)
    for seed in range(10):
        for scene in (scenes.pits, scenes.rows, scenes.sheet, scenes.slivers):
            rng = np.random.default_rng(seed)
            check(in_world(scene, view, rng), view)


def test_coordinates_beyond_float32_are_refused():
    view = scenes.VIEWS["virtual"](4, 3)
    mesh = Mesh([[0, 0, 0], [1e20, 0, 0], [0, 1e20, 0]], [[0, 1, 2]])
    with pytest.raises(InputError, match="float32"):
        RayCaster(mesh, 1e20 * view.cast_from_world)


# Embree's answers do not matter


@NEEDS_EMBREE
@pytest.mark.parametrize("name", ["sample-a", "convex", "picoarray"])
def test_embree_that_lies(monkeypatch, name):
    """Its answers replaced by misses, by other triangles, by one triangle for all."""
    display = find_display(name).with_resolution(61, 45)
    mesh = soup_in(np.array(display.roi), np.random.default_rng(14))
    view = display.view(0, scenes.IDENTITY)
    caster = RayCaster(mesh, view.cast_from_world)
    monkeypatch.setattr(rasterize, "MOST_PAIRS", 0.0)  # rasterisation does not ask Embree
    truth = caster.gbuffer(view)
    assert len(np.unique(truth.triangle)) > 10
    rng = np.random.default_rng(0)
    asked = []
    for lie in (
        lambda n: np.full(n, -1, np.int32),
        lambda n: rng.integers(-1, len(mesh.faces), n).astype(np.int32),
        lambda n: np.full(n, truth.triangle.max(), np.int32),
    ):
        monkeypatch.setattr(caster, "_trace", lambda origins, *_, lie=lie: [asked.append(1), lie(len(origins))][1])
        assert_same_surface(caster.gbuffer(view), truth.triangle, truth.depth, truth.positions)
    assert len(asked) == 3


@NEEDS_EMBREE
def test_embrees_tree_is_built_only_when_it_is_asked(monkeypatch):
    """It takes a third of a second for 200,000 triangles, and small triangles are found without it."""
    view = scenes.VIEWS["left"](61, 45)
    built = []
    monkeypatch.setattr(RayCaster, "_scene", property(built.append))
    caster = RayCaster(in_world(scenes.soup, view, np.random.default_rng(14)), view.cast_from_world)
    monkeypatch.setattr(rasterize, "MOST_PAIRS", np.inf)
    assert (caster.gbuffer(view).triangle >= 0).any()
    assert built == []
    monkeypatch.setattr(rasterize, "MOST_PAIRS", 0.0)
    with pytest.raises(AttributeError, match="'NoneType' object has no attribute 'run'"):
        caster.gbuffer(view)
    assert built == [caster]


@NEEDS_EMBREE
def test_embree_proposes_what_is_seen():
    """Or its tracing would be in vain: in the middle of a tile, away from edges, it names the right triangle."""
    mesh = builtin_scene("ammonite")
    display = find_display("virtual").with_resolution(160, 120)
    world = fit_roi(mesh.bounds, display.roi)
    view = display.view(0, world)
    caster = RayCaster(mesh, world)
    middles = slice(first_hit.TILE // 2, None, first_hit.TILE)
    seen = caster.gbuffer(view).triangle[middles, middles]
    proposals = caster._seen_by_embree(view, range(view.height), first_hit.TILE)
    assert proposals.shape == seen.shape
    assert (seen >= 0).mean() > 0.2
    assert (proposals == seen).mean() > 0.99


# Embree's own answers


@pytest.mark.parametrize("scene", [scenes.soup, scenes.edge_on])
@pytest.mark.parametrize("name", ["left", "perspective", "orthographic"])
def test_depths_on_given_triangles_equal_the_reference(monkeypatch, scene, name):
    """Triangles that rays hit, pass by, and see from behind or edge on."""
    view = scenes.VIEWS[name](31, 22)
    rng = np.random.default_rng(3)
    mesh = in_world(scene, view, rng)
    mesh = Mesh(mesh.vertices, mesh.faces, painted(rng, mesh, textured=False, colored=True))
    caster = RayCaster(mesh, view.cast_from_world)
    given = rng.integers(-1, len(mesh.faces), (22, 31)).astype(np.int32)
    monkeypatch.setattr(caster, "_seen_by_embree", lambda view, window, step: given.copy())
    seen = caster.gbuffer(view, caster="embree")
    rays = scenes.texel_rays(view)
    cast = np.stack(raycast.affine(view.cast_from_world, *mesh.vertices.T), axis=1)
    hits = raycast.on_triangles(rays, cast[mesh.faces], given.ravel())
    depth, positions = raycast.surface(*view.rays, rays, view.world_from_cast, hits)
    assert_same_surface(seen, hits.triangle, depth, positions)
    assert ((seen.color >= 0) & (seen.color <= 1)).all()
    assert (seen.triangle >= 0).any()


@NEEDS_EMBREE
@pytest.mark.parametrize("name", ["sample-a", "convex"])
def test_embrees_own_answers_differ_in_few_texels(name):
    mesh = builtin_scene("ammonite")
    display = find_display(name).with_resolution(160, 120)
    (view,) = module_views(mesh, display, range(3, 4))
    caster = RayCaster(mesh, view.cast_from_world)
    exact, embree = (caster.gbuffer(view, normals="smooth", caster=name) for name in ("exact", "embree"))
    same = exact.triangle == embree.triangle
    assert (exact.triangle >= 0).sum() > 1000
    assert same.mean() > 0.999
    for part in ("depth", "positions", "color", "normals"):
        assert_same_bits(getattr(exact, part)[same], getattr(embree, part)[same])


# The processor's flags that Embree needs for each of its instruction sets, and how many rays it takes then. Asked
# for a set that the processor lacks it would silently take another: then there is nothing to compare.
ISAS = {
    "sse2": ({"sse2"}, "4"),
    "avx2": ({"avx2", "fma", "f16c", "bmi1", "bmi2"}, "4 8"),
    "avx512": ({"avx512f", "avx512dq", "avx512cd", "avx512bw", "avx512vl"}, "4 8 16"),
}


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    """The library that stands between embreex and Embree."""
    library = tmp_path_factory.mktemp("shim") / "embree_isa.so"
    gcc = shutil.which("gcc")
    assert gcc, "this test needs gcc"
    source = str(Path(__file__).with_name("embree_isa.c"))
    subprocess.run([gcc, "-O1", "-Wall", "-Werror", "-shared", "-fPIC", source, "-o", str(library), "-ldl"], check=True)
    return str(library)


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="LD_PRELOAD and /proc/cpuinfo of Linux on x86-64"
)
@pytest.mark.slow
@NEEDS_EMBREE
@pytest.mark.parametrize("isa", ISAS)
def test_all_of_embrees_instruction_sets_see_the_same(isa, shim):
    """On a curved screen, where Embree proposes."""
    needs, widths = ISAS[isa]
    if not needs <= set(Path("/proc/cpuinfo").read_text().split()):
        pytest.skip(f"this processor has no {isa}")
    done = python(golden.__file__, "convex", LD_PRELOAD=shim, EMBREE_CONFIG=f"verbose=1,isa={isa}")
    log, _, printed = done.stdout.rpartition("\n{\n")
    # It took effect: Embree itself says so, as to the device it made and in its log.
    assert set(done.stderr.splitlines()) == {f"embree_isa verbose=1,isa={isa} widths {widths}"}
    best = next(line for line in log[log.index("Config\n") :].splitlines() if "Targets" in line)
    assert best.replace("(supported)", "").split()[-1].lower() == isa
    assert json.loads("{" + printed)["convex"] == json.loads(golden.GOLDEN.read_text())["convex"]


# Colour


def painted(rng, mesh, textured, colored):
    """Three materials, the first and the last with one texture that goes on in other ways."""
    n = len(mesh.vertices)
    texture = rng.random((5, 3, 3), np.float32) if textured else None
    return Paint(
        factors=rng.random((3, 3), np.float32),
        face_material=rng.integers(0, 3, len(mesh.faces)).astype(np.int32),
        textures=(texture, None, texture),
        samplers=(("repeat", "repeat", False), ("clamp", "clamp", True), ("mirror", "clamp", False)),
        uv=rng.uniform(-2, 2, (n, 2)) if textured else None,
        vertex_colors=rng.random((n, 3), np.float32) if colored else None,
    )


@pytest.mark.parametrize("name", ["right", "perspective", "orthographic"])
@pytest.mark.parametrize(("textured", "colored"), [(True, True), (True, False), (False, True), (False, False)])
def test_colour_equals_the_reference(name, textured, colored):
    rng = np.random.default_rng(7)
    view = scenes.VIEWS[name](31, 22)
    bare = in_world(scenes.sheet if textured else scenes.soup, view, rng)
    paint = painted(rng, bare, textured, colored)
    mesh = Mesh(bare.vertices, bare.faces, paint)
    assert mesh.degenerate == 0
    hits, *_ = brute_force(mesh, view)
    caster = RayCaster(mesh, view.cast_from_world)
    want = raycast.colors(
        hits, mesh.faces, paint.factors, paint.face_material, paint.vertex_colors, paint.uv, paint.textures,
        paint.samplers,
    )  # fmt: skip
    assert_same_bits(caster.gbuffer(view).color, want.reshape(22, 31, 3))
    assert len(np.unique(want, axis=0)) > 5 or not (textured or colored)
    assert caster.gbuffer(view, color=None).color is None
    assert RayCaster(bare, view.cast_from_world).gbuffer(view).color is None
