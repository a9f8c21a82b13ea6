"""Radii whose samples are decided before anything is looked up: what the kernels count, up to the ends of the range."""

from dataclasses import replace

import numpy as np
import pytest
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast as raycast_twin

from lfssao import Camera, Settings, builtin_scene, find_display, passes, small_balls
from lfssao.rendering import diagonal, module_views
from lfssao.samples import make_samples
from lfssao.small_balls import DecidedRadii, decided_radii
from lfssao.view import WorldToImage
from lfssao.view_plan import ViewPlan
from lfssao.window import Window

pytestmark = pytest.mark.usefixtures("one_thread")

WIDTH, HEIGHT = 24, 18


def placed_view(name, rng):
    """A view of a world that is turned, stretched and moved away from the origin, and the map world -> cast space."""
    view = scenes.VIEWS[name](WIDTH, HEIGHT)
    if view.screen_to_world is None:
        linear = rng.uniform(-1, 1, (3, 3)) + 2 * np.eye(3)
        physical_from_world = np.hstack([linear * 10 ** rng.uniform(-2, 2), rng.uniform(-0.5, 0.5, (3, 1))])
        index = {"virtual": 0, "left": 0, "right": 20}[name]
        display = find_display("virtual" if name == "virtual" else "sample-a").with_resolution(WIDTH, HEIGHT)
        return display.view(index, physical_from_world)
    size = 10 ** rng.uniform(-2, 2)
    eye = size * 10 ** rng.uniform(-1, 2) * rng.uniform(-1, 1, 3)
    target = eye + size * rng.normal(size=3)
    camera = Camera(name, tuple(eye.tolist()), tuple(target.tolist()), (0.1, 1.0, 0.2), size, 0.5 * size, 4.0 * size)
    return camera.view(WIDTH, HEIGHT)


def surfaces(name, view, rng, spread):
    """Depth and positions as the ray caster rounds them, of any points on the texels' rays, and a box around them."""
    u, v = (n.ravel() + 0.5 for n in np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)))
    near, far = (view.lens[4], view.lens[5]) if view.screen_to_world is not None else (0.0, 1.0)
    shares = rng.uniform(0.5 - spread, 0.5 + spread, WIDTH * HEIGHT)
    if view.screen_to_world is None:
        cast = scenes.at(view, u, v, shares - 0.5)
    else:
        unit = raycast_twin.rays_at(view.ray_kind, view.lens, u, v)
        z = near + (far - near) * shares
        cast = np.stack([unit[0] + unit[2] * z, unit[1] + unit[3] * z, z], axis=-1)
    seen = rng.random(WIDTH * HEIGHT) < 0.8
    seen[0] = True
    world = np.stack(raycast_twin.affine(view.world_from_cast, *cast.T), axis=1)
    z = cast[:, 2]
    if view.screen_to_world is not None:
        z = far / (far - near) * (1 - near / z) if name == "perspective" else (z - near) / (far - near)
    depth = np.where(seen, z, np.inf)
    box = np.stack([world[seen].min(axis=0), world[seen].max(axis=0)])
    shape = HEIGHT, WIDTH
    return depth.astype(np.float32).reshape(shape), world.astype(np.float32).reshape(*shape, 3), box


def occlusion(view, depth, positions, samples, radius):
    if view.screen_to_world is not None:
        forth = view.world_to_image.numbers.reshape(4, 4)
        return passes.algorithm1(depth, view.screen_to_world, forth, samples, radius)
    return passes.algorithm2(depth, positions, view.world_to_image, samples, radius)


def holds(view, depth, positions, samples, radius, behind):
    made = occlusion(view, depth, positions, samples, radius)
    share = np.float32(behind) / np.float32(len(samples))
    return made.outside == 0 and (made.texture == np.where(depth < np.inf, share, np.float32(0))).all()


@settings(max_examples=120)
@given(
    name=st.sampled_from(list(scenes.VIEWS)),
    spread=st.sampled_from([0.0, 0.01, 0.4]),
    n=st.sampled_from([1, 2, 3, 8, 33]),
    seed=st.integers(0, 2**32),
)
def test_every_sample_of_a_decided_radius_is_counted_so(name, spread, n, seed):
    """Next to both ends of the range, where the bounds are used up; the texels' points at any depth."""
    rng = np.random.default_rng(seed)
    view = placed_view(name, rng)
    samples = rng.uniform(-1, 1, (n, 3)) / np.sqrt(3)
    depth, positions, box = surfaces(name, view, rng, spread)
    low, high, behind, _ = decided = decided_radii(view, box, samples)
    for radius in (low * 1.0001, np.sqrt(low * high), high * 0.9999) if low < high else ():
        assert radius in decided
        assert holds(view, depth, positions, samples, radius, behind)
    assert low not in decided
    assert high not in decided


@pytest.mark.parametrize("name", scenes.VIEWS)
def test_beyond_the_range_a_sample_reads_another_texel_or_rounds_to_the_other_side(name):
    """The bounds are no caution alone: nothing holds at 1.4 times the upper end, nor far below the lower one."""
    rng = np.random.default_rng(4)
    view, samples = scenes.VIEWS[name](WIDTH, HEIGHT), make_samples()
    depth, positions, box = surfaces(name, view, rng, 0.4)
    decided = decided_radii(view, box, samples)
    assert 0 < 5 * decided.low < decided.high
    assert decided.behind == (4 if name != "right" else decided.behind)
    assert not holds(view, depth, positions, samples, 1.4 * decided.high, decided.behind)
    assert not holds(view, depth, positions, samples, 1e-4 * decided.low, decided.behind)


def test_a_mapping_that_is_not_the_rays_inverse():
    """What a wrong number shifts a point by, or moves it in depth, is no less than an offset."""
    view, samples, decisions = scenes.VIEWS["virtual"](WIDTH, HEIGHT), make_samples(), 0
    depth, positions, box = surfaces("virtual", view, np.random.default_rng(1), 0.2)
    for number in range(16):
        for wrong in (1e-5, 0.01, 0.6):
            numbers = view.world_to_image.numbers.copy()
            numbers[number] += wrong * max(abs(numbers[number]), 1.0)
            other = replace(view, world_to_image=WorldToImage(0, numbers))
            low, high, behind, _ = decided_radii(other, box, samples)
            for radius in (low * 1.0001, high * 0.9999) if low < high else ():
                decisions += 1
                assert holds(other, depth, positions, samples, radius, behind)
        assert number < 12 or low >= high  # 0.6 texels, or other planes
    assert decisions > 10
    camera, turned = scenes.VIEWS["perspective"](WIDTH, HEIGHT), np.array([[-0.1, -0.1, -2.1], [0.1, 0.1, -1.9]])
    right = decided_radii(camera, turned, samples)
    assert right.low < right.high
    shifted = camera.screen_to_world.copy()
    shifted[0, 3] += 1.0
    low, high, *_ = decided_radii(replace(camera, screen_to_world=shifted), turned, samples)
    assert low >= high


def test_nothing_is_decided_where_nothing_is_proven():
    """A sample beside its point, a box that reaches the eye or the singular planes, numbers beyond float32."""
    none = DecidedRadii()
    samples, flat = make_samples(), np.array([[0.1, 0.2, 0.0], [0.0, 0.0, 0.3]])
    for name, make in scenes.VIEWS.items():
        view = make(WIDTH, HEIGHT)
        box = np.array([[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]])
        box -= np.array([0.0, 0.0, 2.0]) * (view.screen_to_world is not None)
        low, high, *_ = decided_radii(view, box, samples)
        assert low < high
        assert decided_radii(view, box, flat) == none, name
        assert decided_radii(view, box * 1e31, samples) == none
        if name == "orthographic":  # which has no such place
            continue
        around = decided_radii(view, np.array([[-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]]), samples)
        assert not around.low < around.high


def test_who_may_take_the_cut():
    """LF's estimator alone, without neighbours, which may see a sample in the open; not radius 0."""
    mesh = builtin_scene("statue")
    view = module_views(mesh, find_display("sample-a").with_resolution(48, 36))[10]
    radii = 0.0, 1e-3 * diagonal(mesh), 0.5 * diagonal(mesh)
    assert ViewPlan.of(view, mesh.bounds, Settings(radii)).behind == (None, 4, None)
    for other in (Settings(radii, neighbours=1), Settings(radii, estimator="point"), Settings(radii, estimator="hbao")):
        assert ViewPlan.of(view, mesh.bounds, other).behind == (None,) * 3
    assert ViewPlan.everything(view, Settings(radii)).behind == (None,) * 3
    away = mesh.bounds + np.array([1e3, 0.0, 0.0])
    assert ViewPlan.of(view, away, Settings(radii)) == ViewPlan(
        Window(0, 0, 0, 0), Window.whole(view), (0, 1, 2), (True, False, False), (None,) * 3
    )


@given(seed=st.integers(0, 2**32))
def test_a_radius_is_decided_where_every_sample_is_farther_off_than_the_error(seed):
    """At the least depth and at the greatest one, on one side of the point at both; the error grows with the radius."""
    rng = np.random.default_rng(seed)
    near, far = rng.uniform(0.2, 1, (2, 5)) * rng.choice([-1, 1], 5)
    base, slope, high = rng.uniform([0, 0, 0.5], [0.1, 0.25, 2])
    low, top, behind, _ = small_balls._between(high, near, far, small_balls._Line(base, slope))
    least = np.minimum(np.abs(near), np.abs(far)).min()
    if slope < least:
        assert low * least == pytest.approx(base + slope * low, rel=1e-5)
        assert high * (1 - 1e-5) < top < high
        assert behind == (near > 0).sum()
    else:
        assert low == np.inf
    far[2] = -far[2]
    assert small_balls._between(high, near, far, small_balls._Line(base, 0.0)) == DecidedRadii()
    assert small_balls._between(high, far, near, small_balls._Line(base, 0.0)) == DecidedRadii()


@given(seed=st.integers(0, 2**32))
def test_the_largest_ball_uses_up_half_a_texel(seed):
    """Of the formula of the file's first lines: what samples move by and all errors are half of what divides them."""
    rng = np.random.default_rng(seed)
    numerator, divisor = rng.uniform(-1, 1, (2, 6))
    least, a, d = (small_balls._Line(*n) for n in ((5.0, -0.3), rng.uniform(0, 0.01, 2), rng.uniform(0, 0.01, 2)))
    right = float(rng.uniform(0, 9))
    u_0 = right + 0.1
    radius = small_balls._largest(numerator, divisor, least, a, d, 16, u_0, right)
    ends = 0.5 - right, 15.5 - right
    moved = max(np.abs(numerator - t * divisor).max() for t in ends) * radius
    off = moved + (a.base + a.slope * radius) + max(map(abs, ends)) * (d.base + d.slope * radius)
    room = (least.base + least.slope * radius) - (d.base + d.slope * radius)
    assert off == pytest.approx(0.4 * room, rel=2e-5)  # the quotient's own rounding is in it
