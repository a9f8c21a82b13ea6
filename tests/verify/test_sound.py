"""The oracle's bounds hold: 3,840 float32 renderers that round, fuse and order as they like, none outside.

Scenes are drawn so that rounding matters: every texel's point is placed so that one of its samples falls on a texel's
edge or at a surface's depth but for the last digits.
"""

import dataclasses

import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
from hypothesis import given, settings
from hypothesis import strategies as st

from lfssao import Camera, Display, Mesh, Module, Paint, RayCaster, builtin_scene, find_display, fit_roi, module_views
from lfssao.ao.post import blur_weights
from lfssao.core.jit import kernel
from lfssao.verify.bounds import post, ssao
from lfssao.verify.bounds.bounds import exact_bounds
from lfssao.verify.bounds.depth import PositionBounds, color_bounds, depth_bounds, displaced, outlier_limit
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.kernels.images import certain, linear_room
from lfssao.verify.bounds.kernels.point_bounds import trace_samples

EXAMPLES, RENDERERS = 60, 64  # not as many as samples: arrays are told apart by that
DISPLAY = Display("drawn", 1.0, 0.75, 0.1, -2.0, (Module(0.3, 0.0, 1.0, 4, 3),), oracle.ROI)
MODULE_VIEW = DISPLAY.view(0, fit_roi(oracle.WORLD_BOX, oracle.ROI))
pytestmark = pytest.mark.slow


@st.composite
def drawn_scenes(draw):
    height, width = draw(st.sampled_from([(3, 4), (1, 11), (5, 2), (4, 4)]))
    view = oracle.drawn_view(draw, height, width)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    model = draw(st.sampled_from(["shader", "shader", "nearest"]))
    radius = float(draw(st.sampled_from([0.01, 0.3, 1.0])))
    n = draw(st.sampled_from([1, 3, 7, 12, 33, 100]))
    sigma = draw(st.sampled_from([0.3, 0.6, 1.0]))
    return view, rng, model, radius, n, sigma, draw(st.booleans())


def assert_points_inside(points, depth, inputs, errors):
    """Image points of renderers, u, v, z, valid, lie in the boxes of the kernel, and so do their validities."""
    u, v, z, valid = points
    found = np.empty((u.shape[-1], 9))
    for j, i in np.argwhere(np.isfinite(depth)):
        trace_samples(*inputs, j, i, errors, found)
        may = found[:, 6] > 0
        must = found[:, 7] > 0
        assert not (valid[:, j, i] & ~may).any(), "valid where nothing may be"
        assert not (~valid[:, j, i] & must).any(), "not valid where all must be"
        for name, k, values in (("u", 0, u), ("v", 2, v), ("z", 4, z)):
            off = np.abs(values[:, j, i] - found[:, k])
            beyond = valid[:, j, i] & ~(off <= found[:, k + 1])
            assert not beyond.any(), f"{name}: off by {off[beyond].max()}"


def check(drawn, renderers, alter=lambda model: model):
    """Let renderers draw a scene, and hold every stage against the bounds of an altered model.

    Returns how many samples are undecided, and of how many the renderers counted some and some did not.
    """
    view, rng, name, radius, n, sigma, turning = drawn
    turns = oracle.random_turns(rng, (view.height, view.width)) if turning else None
    moved = (lambda samples, number: oracle.turned(samples[number], turns)) if turning else None
    depth, positions, samples = oracle.critical_scene(rng, view, n, radius, moved)
    back = None if positions is not None else view.screen_to_world
    model = alter(MODELS[name])
    mapping = view.world_to_image
    ar = oracle.arithmetic(name, rng, renderers)
    made = []
    allowed = []
    for r in (radius, 0.7 * radius):
        seen = ssao.with_depth_ends(ssao.checked_view(depth, positions, mapping, r, back, turns), model)
        numbers = None if back is None else back.ravel()
        points = rr.image_points(ar, depth, positions, mapping.kind, mapping.numbers, samples, r, numbers, turns)
        assert_points_inside(points, depth, (seen, ssao.sample_points(samples, r)), model.errors)
        made.append(rr.occlusion(ar, depth, *points))
        allowed.append(ssao.ao_bounds(depth, positions, mapping, samples, r, model, back, turns))
        oracle.assert_inside(made[-1], allowed[-1], "ao")
    merged = np.maximum(*made)
    merged_bounds = post.merge_bounds(allowed)
    oracle.assert_inside(merged, merged_bounds, "merged")
    table = blur_weights(sigma)
    blurred, light = rr.blur(ar, merged, sigma, len(table) // 2, table)
    blurred_bounds = post.blur_bounds(merged_bounds, sigma, model)
    oracle.assert_inside(blurred, blurred_bounds, "blurred")
    rgb = rng.random((*depth.shape, 3)).astype(np.float32)
    oracle.assert_inside(rr.shade(ar, rgb, blurred, light), post.shade_bounds(rgb, blurred_bounds, model), "shaded")
    # The later stages by themselves, all renderers on one texture.
    one = merged[0].astype(np.float32)
    blur, _ = rr.blur(ar, one, sigma, len(table) // 2, table)
    oracle.assert_inside(blur, post.blur_bounds(exact_bounds(one), sigma, model), "blur")
    one = blurred[0].astype(np.float32)
    oracle.assert_inside(rr.shade(ar, rgb, ar.full(one)), post.shade_bounds(rgb, exact_bounds(one), model), "shade")
    counts = [np.rint(m * n) for m in made]
    return int(sum(a.undecided.sum() for a in allowed)), sum(int((c.max(0) - c.min(0)).sum()) for c in counts)


@settings(max_examples=EXAMPLES)
@given(drawn_scenes())
def test_no_renderer_of_a_model_leaves_its_bounds(drawn):
    check(drawn, RENDERERS)


PLANES = [(0.1, 50.0), (0.01, 1000.0), (2.0, 20.0), (0.001, 3000.0)]


def perspective(planes, width=4, height=3):
    return Camera("perspective", (0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 3.0, *planes).view(width, height)


def window_depth(planes, z):
    near, far = planes
    return far / (far - near) * (1 - near / z)


@settings(max_examples=30)
@given(st.sampled_from(PLANES), st.integers(0, 2**32), st.sampled_from(["shader", "nearest"]), st.booleans())
def test_no_renderer_that_compares_distances_leaves_the_bounds(planes, seed, name, nearby):
    """Distances are made of window depths in float32, of both or of the surface's alone."""
    view = perspective(planes)
    rng = np.random.default_rng(seed)
    n = 7
    far = np.minimum(planes[1], 9.0)
    levels = window_depth(planes, planes[0] * rng.uniform(1.1, 3, 4) if nearby else rng.uniform(2.1, far, 4))
    depth, positions, samples = oracle.critical_scene(rng, view, n, 0.3, levels=levels)
    back = None if positions is not None else view.screen_to_world
    mapping = view.world_to_image
    ar = oracle.arithmetic(name, rng, RENDERERS)
    given = depth, positions, mapping.kind, mapping.numbers, samples, 0.3, None if back is None else back.ravel()
    points = rr.image_points(ar, *given)
    allowed = ssao.ao_bounds(depth, positions, mapping, samples, 0.3, name, back)
    here = rr.texel_points(ar, depth, positions, given[-1])
    offsets = rr.offsets_of(ar, samples, 0.3)
    eye = rr.row(ar, rr.single(mapping.numbers), 3, here, offsets)
    for way in rr.WAYS:
        oracle.assert_inside(rr.occlusion(ar, depth, *points, way, planes), allowed, way)
    for way in rr.WAYS[1:-1]:
        oracle.assert_inside(rr.occlusion(ar, depth, *points, way, planes, eye), allowed, f"{way} and eye space")


@kernel
def rooms(numbers, depths, by, room):
    """Twice ``linear_room`` of depths, (n,)."""
    for k in range(len(depths)):
        room[k] = 2.0 * linear_room(numbers, 8, 12, certain(depths[k], by), by)


@pytest.mark.parametrize("name", ["shader", "nearest"])
@pytest.mark.parametrize("planes", PLANES)
def test_room_for_distances_is_enough_and_not_five_times_what_is_needed(planes, name):
    """Renderers' order of two window depths, next to each other, by distances."""
    rng, near, far = np.random.default_rng(0), *planes
    surface = np.float64(np.float32(window_depth(planes, near * (far / near) ** rng.uniform(0, 0.9, 4000))))
    numbers = rr.single(perspective(planes).world_to_image.numbers)
    by = MODELS[name].errors
    room = np.empty(surface.shape)
    rooms(numbers, surface, by, room)
    sample = np.float64(np.float32(surface + room * rng.uniform(-1.2, 1.2, surface.shape)))
    apart = np.abs(sample - surface) / room
    needed = 0.0
    for way in rr.WAYS:
        ar = oracle.arithmetic(name, rng, RENDERERS)
        first, second = (rr.distance(ar, way, planes, ar.full(d)) for d in (surface, sample))
        wrong = np.any((first < second) != (surface < sample), axis=0) & (sample != surface)
        needed = max(needed, apart[wrong].max(initial=0))
    assert 0.2 < needed < 1


def test_half_the_errors_would_be_too_few():
    """The renderers come near enough to the bounds to tell: with half of every error some scene is refused."""

    def halved(model):
        own = {name: getattr(model, name) / 2 for name in ("operation", "quotient", "root")}
        return dataclasses.replace(model, exponential=tuple(e / 2 for e in model.exponential), **own)

    refused = 0
    for seed in range(20):
        try:
            check((MODULE_VIEW, np.random.default_rng(seed), "shader", 0.3, 4, 0.6, False), RENDERERS, halved)
        except AssertionError:
            refused += 1
    assert refused > 0


def test_renderers_of_a_model_differ_where_samples_are_undecided():
    """Bounds that are a point would be sound as well if all renderers agreed: they do not."""
    found = np.array(
        [
            check((MODULE_VIEW, np.random.default_rng(s), "shader", 0.3, 4, 0.6, s % 2 == 1), RENDERERS)
            for s in range(10)
        ]
    )
    undecided, differing = found.sum(axis=0)
    assert undecided >= differing > undecided / 4 > 10


@settings(max_examples=15)
@given(st.data())
def test_no_ray_off_a_centre_leaves_the_depth_bounds(data):
    """G-buffers of rays up to ``centre`` texels off, rounded to float32, against depth, positions and colour bounds."""
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    view = oracle.drawn_view(data.draw, 24, 32)
    depths = (0.4, 0.6) if view.screen_to_world is not None else (-0.2, 0.2)
    corners = oracle.world_points(view, rng.uniform(-3, 35, 60), rng.uniform(-3, 27, 60), rng.uniform(*depths, 60))
    faces = rng.integers(0, 60, (40, 3)).astype(np.int32)
    colors = Paint.from_vertex_colors(rng.random((60, 3), np.float32), len(faces))
    caster = RayCaster(Mesh(corners, faces, colors), view.cast_from_world)
    allowed = depth_bounds(caster, view)
    allowed_color = color_bounds(caster, view)
    assert not allowed.outside(caster.gbuffer(view).depth).any()
    reach = MODELS["shader"].centre
    for _ in range(4):
        seen = caster.gbuffer(displaced(view, *rng.uniform(-reach, reach, 2)))
        # A sliver that shows between the nine rays is the bounds' stated limit.
        assert np.count_nonzero(allowed.outside(seen.depth)) <= 1
        assert np.count_nonzero(allowed_color.outside(seen.color).any(axis=-1)) <= 1
        fitting = PositionBounds(view.world_to_image, seen.depth, MODELS["shader"])
        assert not fitting.outside(seen.positions).any()


def test_triangles_smaller_than_a_texel_leave_no_depth_out():
    """If two surfaces show in a texel, the triangles of the limb between them may show, too: between the rays."""
    mesh = builtin_scene("gallery")
    view = module_views(mesh, find_display("sample-a").with_resolution(96, 64))[4]
    caster = RayCaster(mesh, view.cast_from_world)
    seen = caster.gbuffer(displaced(view, 0.9 * 2.0**-8, -0.7 * 2.0**-8), color=None).depth
    assert not depth_bounds(caster, view).outside(seen).any()


@pytest.mark.parametrize("seed", range(4))
def test_edges_are_met_off_centres_on_average_no_more_often_than_the_limit_says(seed):
    """Straight edges in every direction: texels whose box of half width c an edge crosses, against the mean's bound."""
    rng = np.random.default_rng(seed)
    reach = 2.0**-4
    size = 64
    model = dataclasses.replace(MODELS["shader"], centre=reach)
    v, u = np.indices((size, size)) + 0.5
    met = limits = 0
    for _ in range(40):
        angle = rng.uniform(0, 2 * np.pi)
        sine = np.sin(angle)
        cosine = np.cos(angle)
        away = cosine * u + sine * v - (cosine + sine) * size / 2 - rng.uniform(-10, 10)
        depth = np.where(away > 0, np.float32(1), np.float32(2))
        crossed = np.abs(away) <= reach * (abs(cosine) + abs(sine))
        met = met + np.count_nonzero(crossed)
        limits = limits + outlier_limit(depth, model)
    assert met <= limits < 16 * met
    assert outlier_limit(np.ones((9, 9), np.float32)) == outlier_limit(depth, "strict") == 0
