"""Point sampling with options: bit for bit against its twin, and against exact volumes of balls."""

import analytic_scenes as scenes
import numpy as np
import point_twin
import pytest
from estimator_cases import assert_same_bits, buffers, offsets, radii
from hypothesis import given
from hypothesis import strategies as st

from lfssao import estimate, make_samples
from lfssao.estimators.point import SURFACES, line7_differences

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@both
@given(data=st.data())
def test_all_options_equal_the_twin(dtype, data):
    seen, radius, points = data.draw(buffers(dtype)), data.draw(radii), data.draw(offsets(3))
    half, remap, check = data.draw(st.tuples(*[st.booleans()] * 3))
    options = {"range_check": check, "surface": data.draw(st.sampled_from(SURFACES))}
    if not half:
        options["remap"] = remap
    made = estimate("hemisphere" if half else "point", seen, radius, points, **options)
    mapping = seen.view.world_to_image
    expected, outside = point_twin.share_behind(
        seen.depth, seen.positions, seen.normals if half else None, (radius * points).astype(dtype), mapping.kind,
        mapping.as_type(dtype), dtype(radius * radius if check else np.inf), options["surface"] == "positions",
        remap and not half,
    )  # fmt: skip
    assert_same_bits(made.texture, expected)
    assert made.outside == outside


@both
@pytest.mark.parametrize("sight", ["crossed slits", "display"])
def test_without_options_it_is_lf_on_modules(dtype, sight):
    seen = scenes.buffers("step", scenes.SIGHTS[sight](), dtype)
    one, other = estimate("lf", seen, 0.1), estimate("point", seen, 0.1)
    assert_same_bits(other.texture, one.texture)
    assert other.outside == one.outside


@both
@pytest.mark.parametrize("sight", scenes.SIGHTS)
def test_a_remapped_flat_surface_is_open(dtype, sight):
    """Of each pair +d, -d one lies behind; near the border samples leave the texture, which opens it further."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS[sight](), dtype)
    points = make_samples("latin", 50)
    points = np.concatenate([points, -points])
    assert not estimate("point", seen, 0.05, points, remap=True).texture.any()
    assert estimate("point", seen, 0.05, points).texture[18, 24] == 0.5
    assert not estimate("hemisphere", seen, 0.05).texture.any()


@both
def test_the_two_forms_of_line_7_differ_by_rounding_only(dtype):
    """A camera's depth is no coordinate: samples at the point itself hang on its last bit, those off it on nothing."""
    at, off = np.zeros((1, 3)), np.array([[0.6, 0.2, 0.4], [0.1, -0.6, 0.5], [-0.3, 0.1, -0.6]])
    camera = scenes.buffers("facing plane", scenes.SIGHTS["perspective"](24, 18), dtype)
    tilted = scenes.buffers("tilted plane", scenes.SIGHTS["perspective"](24, 18), dtype)
    assert line7_differences(camera, 0.1, off) == 0
    assert 0 < line7_differences(tilted, 0.1, at) < 24 * 18
    assert line7_differences(tilted, 0.1, np.concatenate([at, at])) == 2 * line7_differences(tilted, 0.1, at)
    module = scenes.buffers("tilted plane", scenes.SIGHTS["crossed slits"](24, 18), dtype)
    assert line7_differences(module, 0.1, at) == 0  # its depth is the position's -z, which no rounding moves


# Limits for n to infinity, from straight above: the table in lfssao/estimators/point.py


def cap(d, r):
    """Share of a ball of radius r beyond a plane at distance d from its middle."""
    t = np.clip(d / r, -1, 1)
    return (1 - t) ** 2 * (2 + t) / 4


def shell_cap(d, radius, r_min=0.8):
    """The same of LF's shell."""
    inner = r_min * radius
    return (radius**3 * cap(d, radius) - inner**3 * cap(d, inner)) / (radius**3 - inner**3)


RADIUS = 0.1  # less than the step's height
POINTS = 2048
PLACES = (-0.01, -0.03, -0.06, -0.09, -0.15)


@pytest.fixture(scope="module")
def shell():
    return make_samples("jittered", POINTS, 3)


def seen_from_above(surface):
    return scenes.buffers(surface, scenes.SIGHTS["orthographic"](96, 72))


def wall_distance(surface, x):
    """Distance of a surface point from the other face of a crease, or from the step's wall."""
    return abs(x) if surface == "step" else abs(x) * np.sqrt(2)


def own_error(share):
    """Three standard errors of independent points (these are stratified), and a fifth of a texel's share of a radius.

    Seen edge on a wall is found to within half a texel, 0.005, whose slice of the shell is 0.05 of its volume at most.
    """
    return 3 * np.sqrt(share * (1 - share) / POINTS) + 0.02


@pytest.mark.parametrize("surface", ["facing plane", "tilted plane", "concave crease", "convex crease", "step"])
def test_the_limit_is_the_volume_behind_the_surface(shell, surface):
    seen = seen_from_above(surface)
    made = [
        estimate(name, seen, RADIUS, shell, **options).texture
        for name, options in (("lf", {}), ("point", {}), ("point", {"remap": True}), ("hemisphere", {}))
    ]
    for x in PLACES:
        j, i, at = scenes.nearest(seen, x)
        beyond = 0.0 if "plane" in surface else shell_cap(wall_distance(surface, at[0]), RADIUS)
        ball = 0.5 - beyond / 2 if surface == "convex crease" else 0.5 + beyond / 2
        half = 0.0 if surface == "convex crease" else beyond
        expected = np.array([ball, ball, max(0.0, 2 * ball - 1), half])
        found = np.array([texture[j, i] for texture in made])
        assert (np.abs(found - expected) < own_error(ball) * np.array([1, 1, 2, 2])).all(), (x, found, expected)


def test_the_limit_at_a_sphere_on_a_plane_is_the_volume_under_the_height(shell):
    """By quadrature: 20,000 directions of a Fibonacci lattice times 20 radii of the shell."""
    seen, radius = seen_from_above("sphere on a plane"), 0.12
    k = np.arange(20_000) + 0.5
    z, turn = 1 - 2 * k / 20_000, np.pi * k * (5**0.5 - 1)
    way = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], -1)
    cube = 0.8**3 + (np.arange(20) + 0.5) / 20 * (1 - 0.8**3)
    ball = estimate("point", seen, radius, shell).texture
    half = estimate("hemisphere", seen, radius, shell).texture
    for x in (-0.2, -0.16, -0.14, -0.1, 0.0, 0.05):
        j, i, at = scenes.nearest(seen, x)
        points = at + radius * np.cbrt(cube)[:, None, None] * way
        behind = points[..., 2] < scenes.SURFACES["sphere on a plane"].height(points[..., 0], points[..., 1])
        assert abs(ball[j, i] - behind.mean()) < own_error(behind.mean())
        above = way @ seen.normals[j, i] > 0
        assert abs(half[j, i] - behind[:, above].mean()) < 2 * own_error(behind.mean())


def test_an_occluder_out_of_reach_is_ignored(shell):
    """Before a step of height h the terrace hides what is beyond its edge: not once sqrt(l^2 + h^2) > R everywhere."""
    seen = seen_from_above("step")
    j, i, at = scenes.nearest(seen, -0.05)
    assert shell_cap(abs(at[0]), 0.12) > 0.05
    assert estimate("hemisphere", seen, 0.12, shell).texture[j, i] > 0.05
    assert estimate("hemisphere", seen, 0.12, shell, range_check=True).texture[j, i] == 0  # h = 0.125
    assert estimate("point", seen, 0.12, shell, range_check=True).texture[j, i] < 0.5
    far = estimate("hemisphere", seen, 0.3, shell, range_check=True).texture[j, i]
    assert 0 < far < estimate("hemisphere", seen, 0.3, shell).texture[j, i]
