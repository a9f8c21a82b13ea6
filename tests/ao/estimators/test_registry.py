"""Every estimator of the registry, on every kind of view: bit for bit the reference, and what all of them promise."""

import inspect
import tracemalloc
from dataclasses import replace

import analytic_scenes as scenes
import estimator_cases
import numpy as np
import pytest
from estimator_cases import assert_equals_reference, offsets, radii, with_one_thread_and_two
from hypothesis import given
from hypothesis import strategies as st
from ssao_cases import drawn_turns

from lfssao import Buffers, InputError, estimate
from lfssao.ao.estimators import registry
from lfssao.ao.estimators.look_ups import LOOK_UPS
from lfssao.ao.estimators.registry import ESTIMATORS, estimate_radii, find_estimator, of_one_view
from lfssao.ao.ssao import Occlusion

each = pytest.mark.parametrize("name", ESTIMATORS)
compared = pytest.mark.parametrize("name", [name for name in of_one_view() if name != "lf"])  # tests/ao/test_ssao.py
both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
VALUES = {"epsilon": 0.0}  # parameters of these names take this value where it is extreme


# The numbers to draw from, by the name of the parameter.
NUMBERS = {
    "sigma": [1.0, 0.1, 0.3, 20.0], "intensity": [0.1, 1.0], "beta": [0.0, 1e-4, 0.01, 0.1], "epsilon": [0.0, 0.01],
    "k": [1.0, 0.0, 2.5], "taps": [9, 1, 12], "turns": [7, 1], "log_q": [3, 0, 1], "max_level": [5, 0, 2],
    "quad_edge": [0.02, 0.0, 10.0], "gauss": [3.0, 0.0, 0.5], "sharpness": [2048.0, 20.0], "z_min": [0.0, 1.0],
    "levels": range(1, 6), "kernel": [1, 2], "thickness": [0.0, 0.02, 0.3], "second": [0.0, 0.5],
    "seed": [0, 1, 12345, 2**32 - 1, 2**53], "half_width": [0.0, 1.0, 3**0.5], "directions": range(1, 6),
    "steps": range(1, 5), "bias": [0.0, 0.05, 0.5, 10.0, 45.0, 90.0], "reach": [1.0, 0.0, 2.5],
    "slices": [1, 2, 3], "start": [1.0, 0.5, 0.0], "falloff": [0.0, 0.6, 1.0], "thin": [0.0, 0.7],
    "power": [1.0, 2.2, 0.0], "sectors": [32, 1, 7],
}  # fmt: skip


def check(result, buffers):
    """An occlusion texture: 0 to 1 where there is a surface, 0 elsewhere, no NaN."""
    assert isinstance(result, Occlusion)
    texture = result.texture
    assert (texture.shape, texture.dtype) == (buffers.depth.shape, buffers.depth.dtype)
    assert ((texture >= 0) & (texture <= 1)).all()  # false for NaN
    assert not texture[np.isinf(buffers.depth)].any()
    assert isinstance(result.outside, int)
    assert result.outside >= 0
    return texture


def variants(entry):
    """Its parameters at other values, one at a time; a second radius with each way to make one of two."""
    yield {}
    for parameter, value in entry.parameters.items():
        if isinstance(value, bool):
            yield {parameter: not value}
    for parameter, choices in entry.said("choices").items():
        if parameter in LOOK_UPS:
            continue
        more = {"second": 0.5} if "second" in entry.parameters else {}
        yield from ({parameter: choice, **more} for choice in choices if choice != "cleared")


def memory(name, sight, width, height, options):
    """Most bytes that an estimate of a new view has at once."""
    buffers = scenes.buffers("tilted plane", scenes.SIGHTS[sight](width, height), np.float32)
    tracemalloc.start()
    try:
        estimate(name, buffers, 0.05, **options)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
@each
def test_an_entry_says_how_much_memory_it_takes(name):
    entry = ESTIMATORS[name]
    most = 0.0
    for sight in scenes.SIGHTS:
        for number, options in enumerate(variants(entry)):
            # By the difference of two sizes, so that tables of samples do not count; sizes that nothing is kept of.
            memory(name, sight, 20 + number, 10, options)  # what is made once
            small = (60 + number, 40)
            large = (220 + number, 180)
            needed = memory(name, sight, *large, options) - memory(name, sight, *small, options)
            most = max(most, needed / (large[0] * large[1] - small[0] * small[1]))
    assert abs(most - entry.texel_bytes) < 2


def samples(estimator, rng):
    """A few points of the ball or disk, the middle among them twice, and weights; none where it takes none."""
    if estimator.dimensions == 0:
        return None, None
    points = rng.uniform(-1, 1, (7, estimator.dimensions)) / np.sqrt(estimator.dimensions)
    points[2:4] = 0
    return points, rng.uniform(0, 2, 7)


@both
@compared
@given(data=st.data())
def test_estimators_equal_the_reference(name, dtype, data):
    entry = ESTIMATORS[name]
    points = None
    weights = None
    seen = data.draw(estimator_cases.buffers(dtype))
    radius = data.draw(radii)
    values = {**{key: [False, True] for key in entry.parameters}, **NUMBERS, **entry.said("choices")}
    ranges = {
        key: entry.said("limits").get(key, (-np.inf, np.inf))
        for key in entry.parameters
        if key not in entry.said("choices")
    }
    values |= {key: [x for x in values[key] if low <= x <= high] for key, (low, high) in ranges.items()}
    values |= {key: [entry.parameters[key]] for key in entry.parameters if key in LOOK_UPS}  # test_look_ups.py
    values["background"] = [each for each in values.get("background", ()) if each != "cleared"]
    options = {key: data.draw(st.sampled_from(values[key])) for key in entry.parameters}
    if entry.dimensions:
        points = data.draw(offsets(entry.dimensions)) * data.draw(st.sampled_from([1, entry.dimensions**0.5]))
        if entry.default_samples()[1] is not None and data.draw(st.booleans()):
            weights = np.random.default_rng(len(points)).uniform(0.1, 2, len(points))
    if entry.turns:
        seen = replace(seen, turns=drawn_turns(data.draw, seen.depth))
    made = estimate(name, seen, radius, points, weights, **options)
    assert_equals_reference(name, seen, radius, made, points, weights, **options)


@compared
@pytest.mark.parametrize("surface", ["sphere on a plane", "concave crease"])
def test_every_partial_sum_is_rounded_to_the_textures_precision(name, surface):
    """So many values that sums in another order or in float64, rounded once, would have other bits."""
    seen = scenes.buffers(surface, scenes.SIGHTS["crossed slits"](20, 15), np.float32)
    samples = ESTIMATORS[name].default_samples()
    seen = seen.turned("hash") if ESTIMATORS[name].turns else seen
    made = estimate(name, seen, 0.4, *samples)
    counts = any(word in name for word in ("point", "hemisphere", "bitmask"))  # hardly more values than samples
    assert np.unique(made.texture).size > (3 if counts else 50)
    assert_equals_reference(name, seen, 0.4, made, *samples)


@each
def test_an_entry_says_what_it_is(name):
    entry = ESTIMATORS[name]
    assert entry.name == name
    assert entry.title
    assert entry.source
    assert list(inspect.signature(entry.run).parameters)[:5] == ["buffers", "radius", "points", "weights", "options"]
    assert set(entry.said("meaning")) == set(entry.parameters)
    assert set(entry.said("choices")) == {
        option for option, default in entry.parameters.items() if isinstance(default, str)
    }
    for parameter, (low, high) in entry.said("limits").items():
        assert low <= entry.parameters[parameter] <= high
    for parameter, choices in entry.said("choices").items():
        assert entry.parameters[parameter] in choices
    points, weights = entry.default_samples()
    if entry.dimensions == 0:
        assert points is weights is None
    else:
        assert points.shape == (entry.count, entry.dimensions)
        assert ((points**2).sum(axis=1) <= 1 + 1e-12).all()


@both
@each
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_occlusion_is_a_share_and_zero_on_background_with_any_number_of_threads(name, sight, dtype):
    rng = np.random.default_rng(1)
    sight = scenes.SIGHTS[sight](19, 14)
    buffers = scenes.buffers("sphere on a plane", sight, dtype, rng.random((14, 19)) < 0.15)
    points, weights = samples(ESTIMATORS[name], rng)
    for chosen in (points, None):
        one, two = with_one_thread_and_two(lambda chosen=chosen: estimate(name, buffers, 0.3, chosen))
        assert np.array_equal(check(one, buffers), check(two, buffers))
        assert one.outside == two.outside
    assert one.texture.max() > 0
    if ESTIMATORS[name].samples is not None and ESTIMATORS[name].default_samples()[1] is not None:
        check(estimate(name, buffers, 0.1, points, weights), buffers)


@both
@each
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_several_radii_at_once_are_those_one_by_one(name, sight, dtype):
    buffers = scenes.buffers("sphere on a plane", scenes.SIGHTS[sight](19, 14), dtype)
    radii = (0.3, 0.0, 0.1, 0.7)
    at_once = estimate_radii(name, buffers, radii)
    for radius, found in zip(radii, at_once, strict=True):
        alone = estimate(name, buffers, radius)
        assert found.texture.tobytes() == alone.texture.tobytes()
        assert found.outside == alone.outside
    assert len({found.texture.tobytes() for found in at_once}) > 1
    assert estimate_radii(name, buffers, ()) == []


@pytest.mark.parametrize("name", [name for name, entry in ESTIMATORS.items() if entry.said("power")])
def test_a_scene_in_another_unit_with_lengths_in_that_unit_is_the_same(name):
    """Everything 8 times as large, which rounds nothing, so that lengths are and their squares are 64 times."""
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](20, 15))
    view = seen.view
    size = np.array([8, 8, 8, 1])
    large = replace(
        view,
        cast_from_world=view.cast_from_world / size,
        world_from_cast=view.world_from_cast * 8,
        screen_to_world=view.screen_to_world * size[:, None],
        world_to_image=replace(view.world_to_image, numbers=view.world_to_image.numbers / np.tile(size, 4)),
    )
    larger = Buffers(large, seen.depth, 8 * seen.positions, seen.normals)
    entry = ESTIMATORS[name]
    own = {key: 0.7 * entry.parameters[key] + 0.1 for key in entry.said("power")}
    scaled = {key: (64 if key == "epsilon" else 8) * value for key, value in own.items()}
    one = estimate(name, seen, 0.3, units="world", **own)
    two = estimate(name, larger, 2.4, units="world", **scaled)
    assert one.texture == pytest.approx(two.texture, abs=1e-9)
    assert np.abs(one.texture - estimate(name, seen, 0.3, **own).texture).max() > 1e-3
    both = estimate_radii(name, seen, (0.3, 0.0), units="world", **own)
    assert np.array_equal(both[0].texture, one.texture)
    assert np.array_equal(both[1].texture, estimate(name, seen, 0.0, **own).texture)
    with pytest.raises(InputError, match="units is 'feet': choose one of radii, world"):
        estimate(name, seen, 0.3, units="feet")


def extreme_buffers(view, dtype):
    """Points at the singular planes, on the viewer, beyond both, far away; some texels have no surface or normal."""
    rng = np.random.default_rng(2)
    shape = view.height, view.width
    cast = rng.choice([0.0, -0.0, 0.5, -0.5, 1e-30, 1e6], (*shape, 3))
    cast[..., 2] = rng.choice([0.9, 0.75, -2.0, 0.0, 1.0, 3.0, 2.5, 1e6, -1e6], shape)
    m = view.world_from_cast
    positions = (cast @ m[:, :3].T + m[:, 3]).astype(dtype)
    depth = rng.choice([0.9, 0.75, -2.0, 0.0, 1.0, 1.5, -1e30, 1e30], shape).astype(dtype)
    normals = rng.standard_normal((*shape, 3))
    normals = (normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(dtype)
    normals[rng.random(shape) < 0.2] = 0
    nothing = rng.random(shape) < 0.2
    depth[nothing], positions[nothing], normals[nothing] = np.inf, np.inf, 0
    return Buffers(view, depth, positions, normals)


@both
@each
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_extremes_have_defined_results(name, sight, dtype):
    estimator = ESTIMATORS[name]
    make = scenes.SIGHTS[sight]
    small = make(7, 5)
    one = make(1, 1)
    cases = [
        scenes.buffers("step", small, dtype),
        scenes.buffers("step", small, dtype, np.ones((5, 7), bool)),  # all background
        scenes.buffers("tilted plane", one, dtype),
        scenes.buffers("tilted plane", one, dtype, np.ones((1, 1), bool)),
        extreme_buffers(small.view, dtype),
    ]
    points, _ = samples(estimator, np.random.default_rng(3))
    extreme = {key: value for key, value in VALUES.items() if key in estimator.parameters}
    for buffers in cases:
        for radius in (0.0, 1e-5, 1e3):
            check(estimate(name, buffers, radius, points, **extreme), buffers)
        check(estimate(name, buffers, 1e30), buffers)
        if points is not None:  # all samples coincide with the point
            check(estimate(name, buffers, 0.1, 0 * points, **extreme), buffers)


@each
def test_what_an_estimator_cannot_take_is_refused(name):
    estimator = ESTIMATORS[name]
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](4, 3))
    with pytest.raises(InputError, match="no parameter 'nonsense'"):
        estimate(name, seen, 0.1, nonsense=1)
    for radius in (-1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="radius"):
            estimate(name, seen, radius)
    bad = [np.zeros((0, estimator.dimensions)), np.zeros((2, 5)), np.full((1, max(estimator.dimensions, 1)), np.nan)]
    for points in bad:
        with pytest.raises(InputError, match="sample"):
            estimate(name, seen, 0.1, points)
    for parameter, default in estimator.parameters.items():
        wrong = ["yes", None] if isinstance(default, bool) else [None, 1] if isinstance(default, str) else ["1", True]
        if isinstance(default, float):
            wrong += [np.nan, np.inf]
        if parameter in estimator.said("limits"):
            low, high = estimator.said("limits")[parameter]
            wrong += [x for x in (low - 1, high + 1) if low < x or x > high if abs(x) < 1e300]
        if parameter in estimator.said("choices"):
            wrong.append("nonsense")
        for value in wrong:
            with pytest.raises(InputError, match=parameter):
                estimate(name, seen, 0.1, **{parameter: value})
    if estimator.normals:
        with pytest.raises(InputError, match="normals"):
            estimate(name, Buffers(seen.view, seen.depth, seen.positions), 0.1)
    else:
        check(estimate(name, Buffers(seen.view, seen.depth, seen.positions), 0.1), seen)


def test_names_are_those_of_the_families_entries():
    for family, names in registry._FAMILIES.items():
        module = __import__(f"lfssao.ao.estimators.{family}", fromlist=["ENTRIES"])
        assert tuple(entry.name for entry in module.ENTRIES) == names
    assert len(ESTIMATORS) == len(set(ESTIMATORS))
    with pytest.raises(InputError, match="no estimator 'best': choose one of lf"):
        find_estimator("best")
