"""What a plan leaves out changes no bit: with and without it, on displays of every kind, cameras and estimators."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast as raycast_twin

from lfssao import Camera, Mesh, RayCaster, Settings, builtin_scene, display_names, find_display
from lfssao.bench import savings
from lfssao.cli import main
from lfssao.estimators.registry import ESTIMATORS
from lfssao.kernels.rays import FLAT_LINEAR
from lfssao.neighbours import DepthCache
from lfssao.plan import make_plan
from lfssao.rendering import module_views, neighbour_views, render_planned, render_view
from lfssao.view import WorldToImage
from lfssao.view_plan import ViewPlan, subpixel_radii
from lfssao.window import Window, cast_box, seen_window

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def statue():
    return builtin_scene("statue")


def bits(array):
    return array.view(np.int32) if array.dtype == np.float32 else array


def assert_same(one, other):
    """All textures bit for bit, their shapes and dtypes, and what they count."""
    layers = [(t.merged, t.blurred, t.image, t.shaded, *t.ao, t.gbuffer.depth, t.gbuffer.positions, t.gbuffer.triangle,
               t.gbuffer.color, t.gbuffer.normals) for t in (one, other)]  # fmt: skip
    for a, b in zip(*layers, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            assert (a.shape, a.dtype, a.flags.c_contiguous) == (b.shape, b.dtype, True)
            np.testing.assert_array_equal(bits(a), bits(b))
    assert one.outside == other.outside


def check(caster, view, options, neighbours=()):
    """Render with and without a plan; the cover and the plan."""
    plan = ViewPlan.of(view, caster.bounds, options)
    made = render_view(caster, view, options, neighbours, plan)
    assert_same(made, render_view(caster, view, options, neighbours, ViewPlan.everything(view, options)))
    return (made.gbuffer.triangle >= 0).mean(), plan


def placed(box, size, moved):
    """A box ``size`` times as large around the scene's, moved by shares of the scene's size: the scene gets smaller."""
    middle = 0.5 * (box[0] + box[1])
    return middle + (box - middle) * size + np.array(moved) * (box[1] - box[0])


# Where the scene is in the texture: all over it, in a corner, across its border, beside it.
PLACES = {"fitted": (1, (0, 0, 0)), "corner": (4, (1, 1, 0.3)), "border": (3, (-1.5, 0, 0)), "beside": (3, (40, 0, 0))}


@pytest.mark.parametrize("name", display_names())
@pytest.mark.parametrize("place", PLACES)
def test_displays_of_every_kind(statue, name, place):
    display, guard = find_display(name).with_resolution(48, 36), 5 * (place == "corner")
    views = module_views(statue, display, None, guard, placed(statue.bounds, *PLACES[place]))
    radii = 0.0, 2e-4, 0.05, 0.05, 0.2
    options = Settings(radii, blur=1.4, normals="smooth" if place == "border" else None)
    caster = RayCaster(statue, views[0].cast_from_world)
    for view in {views[0].name: views[0], views[-1].name: views[-1]}.values():
        cover, plan = check(caster, view, options)
        assert (cover > 0) == (place != "beside")
        assert (not plan.window.texels) == (place == "beside" and view.ray_kind == FLAT_LINEAR)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("place", PLACES)
def test_cameras(statue, projection, place):
    view = Camera.looking_at(placed(statue.bounds, *PLACES[place]), projection).view(48, 36, 3)
    options = Settings((0.1, 0.0, 1e-3), blur=0.5 * (place != "border"))
    cover, plan = check(RayCaster(statue, view.cast_from_world), view, options)
    assert (cover > 0) == (plan.window.texels > 0) == (place != "beside")


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator(statue, name):
    view = module_views(statue, find_display("sample-a").with_resolution(32, 24), range(4, 5), 0,
                        placed(statue.bounds, 2, (0.5, 0.2, 0)))[0]  # fmt: skip
    cover, plan = check(RayCaster(statue, view.cast_from_world), view, Settings((0.0, 0.1, 0.1), estimator=name))
    assert 0.01 < cover < 0.3
    assert plan.same_as == (0, 1, 1)


@pytest.mark.parametrize("place", ["border", "beside"])
def test_neighbours_whose_rays_are_cut_and_modules_that_see_nothing(statue, place):
    display = find_display("sample-a").with_resolution(40, 30)
    box = placed(statue.bounds, *PLACES[place])
    views, asked = module_views(statue, display, None, 0, box), neighbour_views(statue, display, 3, None, 0, box)
    caster, options = RayCaster(statue, views[0].cast_from_world), Settings((0.0, 0.2), neighbours=3)
    for index in (0, 10):
        made = [
            render_planned(caster, views[index], options, DepthCache(caster, 7, plan), asked[index], plan)
            for plan in (True, False)
        ]
        assert_same(*made)


def test_the_one_sample_of_radius_0_counts_for_all_that_fall_outside(statue):
    """A mapping that is shifted by more than the texture, so that every sample is outside."""
    view = module_views(statue, find_display("virtual").with_resolution(48, 36))[0]
    numbers = view.world_to_image.numbers.copy()
    numbers[14] += 99
    view = replace(view, world_to_image=WorldToImage(view.world_to_image.kind, numbers))
    options = Settings((0.0,))
    check(RayCaster(statue, view.cast_from_world), view, options)
    made = render_view(RayCaster(statue, view.cast_from_world), view, options)
    assert made.outside == (8 * (made.gbuffer.triangle >= 0).sum(),)


# The bench


def test_savings_of_each_cut_and_a_cut_that_changes_bits(statue, monkeypatch, capsys, tmp_path):
    display = find_display("virtual").with_resolution(48, 36)
    box = savings.at_a_tenth(statue, display)
    case = savings.Case("a tenth", statue, box, Settings((0.0, 1e-3, 0.2)))
    (made,) = savings.savings([case], display, 2)
    assert made.same
    assert abs(made.cover - 0.1) < 0.02
    assert set(made.ratios) == {"plan", *savings.CUTS}
    assert all(low <= middle <= high for low, middle, high in made.ratios.values())
    plan = ViewPlan.of(savings.middle_view(statue, display, box), statue.bounds, case.settings)
    monkeypatch.setattr(ViewPlan, "of", lambda *_: replace(plan, same_as=(0, 0, 0)))
    monkeypatch.setattr(savings, "cases", lambda *_: [case])
    table = tmp_path / "plan.json"
    assert main(["bench", "plan", "--quick", "--repeats", "1", "--json", str(table)]) == 1
    assert "BITS DIFFER" in capsys.readouterr().out
    (scene,) = json.loads(table.read_text())["scenes"]
    assert (scene["scene"], scene["same"]) == ("a tenth", False)


# Windows


def cast(view, vertices, faces):
    hits = raycast_twin.first_hits(
        raycast_twin.texel_rays(view.ray_kind, view.lens, view.width, view.height), vertices[faces]
    )
    return hits.triangle.reshape(view.height, view.width) >= 0


BOX_FACES = np.array([(0, 1, 3), (0, 3, 2), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 3, 7), (2, 7, 6),
                      (0, 2, 6), (0, 6, 4), (1, 3, 7), (1, 7, 5)])  # fmt: skip


@settings(max_examples=80)
@given(
    name=st.sampled_from(list(scenes.VIEWS)),
    size=st.sampled_from([(20, 15), (33, 9), (1, 1), (24, 18)]),
    seed=st.integers(0, 2**32),
)
def test_no_ray_outside_the_window_hits_what_is_in_the_box(name, size, seed):
    """Boxes anywhere, drawn as their six sides, by brute force; the window is at most 3 texels too large."""
    view, rng = scenes.VIEWS[name](*size), np.random.default_rng(seed)
    points = scenes.anywhere(view, rng, 2, 0.6)
    points = points[0] + (points - points[0]) * rng.choice([1.0, 0.3, 0.02])
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    x, y, z = (n.ravel() for n in np.meshgrid(*box.T, indexing="ij"))
    hit = cast(view, np.column_stack([x, y, z]), BOX_FACES)
    window = seen_window(view, box)
    if hit.any():
        columns, rows = np.flatnonzero(hit.any(axis=0)), np.flatnonzero(hit.any(axis=1))
        held = (
            (window.left, columns[0], columns[-1] + 1, window.right),
            (window.top, rows[0], rows[-1] + 1, window.bottom),
        )
        for (first, low, high, last), most in zip(held, size, strict=True):
            assert first <= low < high <= last
            if first > 0 and last < most:  # not cut off by the texture's border
                assert low - first <= 3
                assert last - high <= 3


def test_a_box_that_nearly_reaches_one_singular_plane_has_no_window():
    """The observers' line alone, the lens alone; x and y so large that rounding of either is half a texel."""
    view = scenes.VIEWS["virtual"](20, 15)
    m_z, z_o = view.lens[1], view.lens[3]
    middle = np.array([[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]])
    assert seen_window(view, middle) != Window.whole(view)
    for axis, end, value in ((2, 0, z_o * (1 - 1e-4)), (2, 1, m_z * (1 - 1e-4)), (0, 1, 1e14), (1, 1, 1e14)):
        box = middle.copy()
        box[end, axis] = value
        box[1 - end, axis] = box[1 - end, axis] if axis == 2 else value * (1 - 1e-3)
        window = seen_window(view, box)
        assert window == Window.whole(view), (axis, end)


def test_a_box_at_the_eye_has_no_window():
    for name, view in ((name, make(20, 15)) for name, make in scenes.VIEWS.items()):
        far = view.lens[5] if name in ("perspective", "orthographic") else view.lens[1]
        around = np.array([[-9.0, -9.0, -9.0], [9.0, 9.0, far + 9.0]])
        assert seen_window(view, around) == Window.whole(view)


@settings(max_examples=100)
@given(seed=st.integers(0, 2**32), offset=st.sampled_from([0.0, 1.0, 1e8]), scale=st.sampled_from([1e-6, 1.0, 1e6]))
def test_a_cast_box_holds_all_vertices(seed, offset, scale):
    """Maps that turn and stretch, worlds far from 0: every moved vertex lies in the box."""
    rng = np.random.default_rng(seed)
    points = (rng.uniform(-1, 1, (50, 3)) + offset * rng.uniform(-1, 1, 3)) * scale
    matrix = np.hstack([rng.uniform(-1, 1, (3, 3)), rng.uniform(-1, 1, (3, 1)) * offset * scale])
    box = cast_box(matrix, np.stack([points.min(axis=0), points.max(axis=0)]))
    moved = np.stack(raycast_twin.affine(matrix, *points.T), axis=1)
    assert (box[0] <= moved).all()
    assert (moved <= box[1]).all()


@pytest.mark.parametrize("way", scenes.WAYS)
@pytest.mark.parametrize("name", scenes.VIEWS)
def test_gbuffers_cast_in_a_window(way, name):
    """Any window: in its rows the texture of the whole, elsewhere nothing; by the tree and by rasterisation."""
    rng = np.random.default_rng(2)
    view = scenes.VIEWS[name](37, 26)
    vertices, faces = scenes.sheet(view, rng, 3)
    caster = RayCaster(Mesh(scenes.to_world(view, vertices), faces, normals=vertices), view.cast_from_world)
    whole = caster.gbuffer(view, normals="smooth")
    for window in (
        Window(5, 9, 30, 22),
        Window(36, 0, 37, 26),
        Window(0, 25, 37, 26),
        Window(3, 3, 3, 9),
        Window(0, 0, 0, 0),
    ):
        with scenes.way(way):
            seen = caster.gbuffer(view, normals="smooth", window=window)
        inside = np.zeros((26, 37), np.bool_)
        inside[window.top : window.bottom if window.texels else window.top] = True
        for part, background in (("depth", np.inf), ("positions", np.inf), ("normals", 0), ("triangle", -1)):
            got, want = getattr(seen, part), getattr(whole, part).copy()
            want[~inside] = background
            np.testing.assert_array_equal(bits(got), bits(want))


# The command and the manifest

RENDER = ["render", "statue", "--display", "sample-a", "--modules", "2:4", "--resolution", "48x36", "--radii",
          "0,0.1,0.1", "--blur", "0.7", "--threads", "1"]  # fmt: skip


def test_render_with_and_without_a_plan(tmp_path):
    made = {}
    for name, more in (("with", []), ("without", ["--no-plan"])):
        assert main([*RENDER, *more, "-o", str(tmp_path / name)]) == 0
        made[name] = json.loads((tmp_path / name / "manifest.json").read_text())
    one, other = made["with"], made["without"]
    assert other["plan"] is None
    assert {cut["what"] for cut in one["plan"]} >= {"modules", "rays", "radii", "samples", "blur"}
    for a, b in zip(one["views"], other["views"], strict=True):
        assert {n: t["sha256"] for n, t in a["textures"].items()} == {n: t["sha256"] for n, t in b["textures"].items()}
        assert a["samples_outside"] == b["samples_outside"]


def test_a_plan_takes_a_renders_options_and_renders_nothing(monkeypatch, capsys):
    def no(*_):
        raise AssertionError

    monkeypatch.setattr(RayCaster, "__init__", no)
    assert main(["plan", *RENDER[1:], "-o", "/nonexistent/never"]) == 0
    text = capsys.readouterr().out
    assert all(word in text for word in ("modules", "rays", "radii", "samples", "left out", "saved", "planned"))
    assert main(["plan", *RENDER[1:], "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    cuts = {cut["what"]: cut for cut in made["cuts"]}
    assert cuts["radii"]["left_out"] == 2
    assert cuts["samples"]["left_out"] == 2 * 7
    assert cuts["rays"]["run"] + cuts["rays"]["left_out"] == 2 * 48 * 36
    assert cuts["rays"]["run"] == sum(Window(*view["window"]).texels for view in made["views"])
    assert [view["name"] for view in made["views"]] == ["module_002", "module_003"]
    assert made["views"][0]["size"] == [48, 36]


def test_radii_below_half_a_texel_everywhere(statue):
    """Of an orthographic camera half a texel is the same everywhere, of a module largest where the box is nearest."""
    camera = Camera.looking_at(statue.bounds, "orthographic")
    half = 0.5 * camera.extent / 36
    radii, boxes = (0.0, 0.5 * half, 0.999 * half, 1.001 * half, 1.0), [statue.bounds]
    assert subpixel_radii([camera.view(48, 36)], boxes, radii) == radii[1:3]
    assert subpixel_radii([camera.view(48, 36), camera.view(64, 48)], boxes, radii) == radii[1:2]
    for name in display_names():
        (view,) = module_views(statue, find_display(name).with_resolution(48, 36), range(1))
        corners = np.array([[x, y, z] for x, y, z in itertools.product(*statue.bounds.T)])
        aside = np.random.default_rng(1).normal(size=(400, 3))
        ball = view.world_to_image(corners[:, None] + 1e-4 * aside / np.linalg.norm(aside, axis=1)[:, None])
        moved = np.abs(ball - view.world_to_image(corners)[:, None])[..., :2].max()
        limit = 1e-4 * 0.5 / moved  # from below: 400 directions miss the farthest by little
        assert subpixel_radii([view], boxes, (0.9 * limit, 1.01 * limit)) == (0.9 * limit,)
        assert subpixel_radii([view], [*boxes, statue.bounds * 100], (0.9 * limit,)) == ()  # behind the lens too


def test_a_job_warns_of_such_radii_once(tmp_path, capsys):
    job = ["render", "statue", "--display", "sample-a", "--modules", "2:4", "--resolution", "32x24", "--frames", "2",
           "-o", str(tmp_path)]  # fmt: skip
    assert main([*job, "--radii", "0.0001,0.1"]) == 0
    said = capsys.readouterr().err
    assert said.count("radius 0.0001 is less than half a texel everywhere: its AO says nothing") == 1
    assert said.count("half a texel") == 1
    assert main([*job, "--radii", "0,0.1"]) == 0
    assert "half a texel" not in capsys.readouterr().err


def test_modules_that_miss_the_scene_are_named(statue):
    display = find_display("sample-a").with_resolution(48, 36)
    views = module_views(statue, display, None, 0, placed(statue.bounds, *PLACES["beside"]))
    made = make_plan(statue, views, Settings((0.1,)))
    modules = next(cut for cut in made.cuts if cut.what == "modules")
    assert (modules.run, modules.left_out, modules.saving) == (0, 21, 1.0)
    assert "module_000" in modules.where
    assert sum(plan.window.texels for _, plan in made.views) == 0
