"""Ray-cast occlusion: bit for bit against brute force, and against exact answers."""

from dataclasses import replace
from functools import cache
from itertools import product

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import with_one_thread_and_two
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import NEEDS_EMBREE
from reference import truth

from lfssao import Buffers, Camera, InputError, Mesh, RayCaster, find_display, module_views
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, of_one_view
from lfssao.ao.ground_truth import FALLOFFS, INTERSECTORS, WEIGHTINGS, Occluders, ray_cast_occlusion
from lfssao.samples import make_samples, sample_set
from lfssao.viz.truth import half_space

BELOW = 1e-6  # of R: how far off the surface rays begin where positions are float64
# The same for exact answers, of R and of the mesh's diagonal where R is infinite: Embree's coordinates are float32.
CLOSE = {"tree": BELOW, "embree": 1e-4}
CLOSE_WITHOUT_END = {"tree": 1e-9, "embree": 1e-6}
THROUGH = pytest.mark.parametrize("through", ["tree", pytest.param("embree", marks=NEEDS_EMBREE)])


@st.composite
def meshes(draw):
    """A surface, or triangles anywhere, some with corners on a lattice and in planes of the axes."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from(["crease", "soup", "lattice"]))
    if kind == "crease":
        return scenes.SURFACES["concave crease"].mesh()
    n = draw(st.integers(1, 40))
    corners = rng.uniform(-0.4, 0.4, (3 * n, 3)) if kind == "soup" else rng.integers(-4, 5, (3 * n, 3)) / 8
    corners[0:3] = [[0, 0, 0], [0.25, 0, 0], [0, 0.25, 0]]  # one with an area
    return Mesh(corners, np.arange(3 * n).reshape(-1, 3))


@settings(max_examples=25)
@given(data=st.data())
def test_ray_cast_occlusion_equals_brute_force(data):
    dtype = data.draw(st.sampled_from([np.float32, np.float64]))
    sight = scenes.SIGHTS[data.draw(st.sampled_from(list(scenes.SIGHTS)))](3, 2)
    hole = np.array(data.draw(st.lists(st.booleans(), min_size=6, max_size=6))).reshape(2, 3)
    seen = scenes.buffers(data.draw(st.sampled_from(["concave crease", "facing plane"])), sight, dtype, hole)
    mesh = data.draw(meshes())
    weighting = data.draw(st.sampled_from(WEIGHTINGS))
    falloff = data.draw(st.sampled_from(FALLOFFS))
    radius = data.draw(st.sampled_from([0.3, 1e-3, 5.0]))
    strata = data.draw(st.integers(1, 4))
    seed = data.draw(st.integers(0, 2**64 - 1))
    options = {"tolerance": 0.05, "rounds": (2, 5), "strata": strata, "offset": 1e-3, "seed": seed}
    made = ray_cast_occlusion(Occluders(mesh), seen, radius, weighting, falloff, **options)
    occlusion = np.zeros((2, 3))
    error = np.zeros((2, 3))
    rays = np.zeros((2, 3), np.int64)
    for j, i in np.argwhere(seen.depth < np.inf):
        occlusion[j, i], error[j, i], rays[j, i] = truth.texel(
            3 * int(j) + int(i), seen.positions[j, i], seen.normals[j, i], mesh.vertices[mesh.faces], radius,
            1e-3 * radius, weighting, falloff, strata, (2, 5), 0.05, seed,
        )  # fmt: skip
    assert_same_bits(made.texture, occlusion)
    assert_same_bits(made.error, error)
    assert np.array_equal(made.rays, rays)


# Exact answers


def segment(c):
    """S(c), by cosine."""
    c = min(c, 1.0)
    return (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi


def crease(c, weighting, falloff):
    if c >= 1:
        return 0.0
    if falloff == "shell":  # the ball less the inner one
        return (crease(c, weighting, "cubic") - 0.512 * crease(c / 0.8, weighting, "cubic")) / 0.488
    root = np.sqrt(1 - c * c)
    constant = segment(c) if weighting == "cosine" else (1 - c) / 2
    lost = {
        "constant": {"cosine": 0.0, "uniform": 0.0},
        "linear": {"cosine": 2 * c / np.pi * (np.log((1 + root) / c) - root), "uniform": -c * np.log(c) / 2},
        "quadratic": {"cosine": 2 * c / np.pi * (root - c * np.arccos(c)), "uniform": (c - c * c) / 2},
        "cubic": {"cosine": (c * root - c**3 * np.log((1 + root) / c)) / np.pi, "uniform": (c - c**3) / 4},
    }
    return constant - lost[falloff][weighting]


def cast_at(surface, sight, xs, radius, weighting, falloff="constant", **options):
    """Occlusion with no other texels than those nearest to (x, 0), these, and their points."""
    seen = scenes.buffers(surface, scenes.SIGHTS[sight]())
    found = [scenes.nearest(seen, x) for x in xs]
    depth = np.full_like(seen.depth, np.inf)
    for j, i, _ in found:
        depth[j, i] = seen.depth[j, i]
    alone = Buffers(seen.view, depth, seen.positions, seen.normals)
    occluders = Occluders(scenes.SURFACES[surface].mesh())
    made = ray_cast_occlusion(occluders, alone, radius, weighting, falloff, rounds=(16, 64), **options)
    return made, [(j, i) for j, i, _ in found], np.array([at for _, _, at in found])


def assert_near(made, texels, exact, bound):
    """Each within five of its standard errors and the bound that rays' beginning off the surface stands for."""
    for (j, i), value in zip(texels, exact, strict=True):
        assert abs(made.texture[j, i] - value) <= 5 * made.error[j, i] + bound


@pytest.mark.parametrize("sight", ["perspective", "display"])
@pytest.mark.parametrize("surface", ["facing plane", "tilted plane", "convex crease"])
@THROUGH
def test_what_no_ray_meets_is_open(through, surface, sight):
    seen = scenes.buffers(surface, scenes.SIGHTS[sight](8, 6))
    occluders = Occluders(scenes.SURFACES[surface].mesh())
    close = CLOSE_WITHOUT_END[through]
    made = ray_cast_occlusion(occluders, seen, np.inf, offset=close, intersector=through)
    assert not made.texture.any()
    assert not made.error.any()
    assert (made.rays == 8 * 64).all()


@pytest.mark.parametrize(("radius", "falloff"), [(0.2, "constant"), *product([0.2], FALLOFFS[1:]), (2.0, "constant")])
@pytest.mark.parametrize("weighting", WEIGHTINGS)
@THROUGH
def test_a_crease(through, weighting, radius, falloff):
    where = "concave crease", "crossed slits", [-0.2, -0.13, -0.1, -0.05, -0.03, -0.01, 0.04, 0.11], radius
    options = {"falloff": falloff, "offset": CLOSE[through], "intersector": through}
    made, texels, at = cast_at(*where, weighting, **options)
    exact = [crease(abs(x) * np.sqrt(2) / radius, weighting, falloff) for x in at[:, 0]]
    assert_near(made, texels, exact, 1e-5)
    assert (max(exact) > 0.49) == (radius == 2.0)  # half without end
    assert (min(exact) == 0) == (radius == 0.2)
    if radius == 0.2 and falloff == "constant":  # the other weighting would not pass
        other, *_ = cast_at(*where, WEIGHTINGS[weighting == "cosine"], **options)
        apart = [abs(other.texture[texel] - value) for texel, value in zip(texels, exact, strict=True)]
        assert max(apart) > 0.03 > 5 * made.error.max()


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@THROUGH
def test_a_sphere_on_a_plane(through, weighting):
    """Its mesh lies within 2e-4 of its radius inside it."""
    options = {"offset": CLOSE_WITHOUT_END[through], "intersector": through}
    where = "sphere on a plane", "orthographic", [-0.16, -0.2, -0.3, 0.18, 0.25], np.inf
    made, texels, at = cast_at(*where, weighting, **options)
    assert (at[:, 2] == 0).all()
    sine = scenes.BALL / np.linalg.norm(at - [0, 0, scenes.BALL], axis=1)
    assert_near(made, texels, sine**3 if weighting == "cosine" else 1 - np.sqrt(1 - sine**2), 1e-3)


@THROUGH
def test_threads_and_seeds(through):
    seen = scenes.buffers("step", scenes.SIGHTS["crossed slits"](20, 18), np.float32)
    occluders = Occluders(scenes.SURFACES["step"].mesh())
    options = {"rounds": (2, 4), "intersector": through}
    one, two = with_one_thread_and_two(lambda: ray_cast_occlusion(occluders, seen, 0.1, **options))
    assert_same_bits(one.texture, two.texture)
    assert {"tree", "embree"} & set(vars(occluders)) == {through}  # the other one is not built
    other = ray_cast_occlusion(occluders, seen, 0.1, seed=1, **options)
    assert (other.texture != one.texture).any()
    assert np.abs(other.texture - one.texture).max() < 0.2


@NEEDS_EMBREE
def test_on_a_real_mesh_no_ray_meets_the_surface_that_it_begins_on(statue):
    """The statue's positions are float32: with rays that begin on them about half of a flat face would be covered."""
    view = module_views(statue, find_display("virtual").with_resolution(24, 18))[0]
    seen = Buffers.of(RayCaster(statue, view.cast_from_world).gbuffer(view, None, "geometric"), view)
    made = ray_cast_occlusion(Occluders(statue), seen, 1e-2, rounds=(2, 2))
    there = seen.depth < np.inf
    assert np.median(made.texture[there]) == 0
    assert made.texture.max() > 0.1
    flawed = ray_cast_occlusion(Occluders(statue), seen, 1e-2, rounds=(2, 2), offset=0.0)
    assert flawed.texture[there].mean() > made.texture[there].mean()


@THROUGH
def test_extremes(through):
    sight = scenes.SIGHTS["perspective"](4, 3)
    occluders = Occluders(scenes.SURFACES["step"].mesh())
    empty = scenes.buffers("step", sight, np.float32, np.ones((3, 4), bool))
    seen = scenes.buffers("step", sight, np.float32)
    wild = seen.normals.copy()
    wild[0, 0], wild[1, 1, 0] = -np.inf, np.inf
    small = (1e-30, 1e-6) if through == "tree" else ()  # rays would begin too near for Embree
    for buffers in (empty, seen, replace(seen, normals=0 * seen.normals), replace(seen, normals=wild)):
        for radius in (0.0, *small, 0.1, 1e6, 1e30, 1e300):
            made = ray_cast_occlusion(occluders, buffers, radius, rounds=(2, 2), strata=2, intersector=through)
            assert ((made.texture >= 0) & (made.texture <= 1)).all()
            assert np.isfinite(made.error).all()
            assert not made.texture[np.isinf(buffers.depth)].any()
    assert not ray_cast_occlusion(occluders, empty, 0.1, intersector=through).rays.any()
    assert not ray_cast_occlusion(occluders, seen, 0.0, offset=0.0, intersector=through).texture.any()


@pytest.mark.parametrize(("wrong", "said"), [
    ({"radius": -1.0}, "radius"),
    ({"radius": np.inf, "falloff": "linear"}, "radius"),
    ({"weighting": "even"}, "weighting"),
    ({"falloff": "steep"}, "falloff"),
    ({"intersector": "optix"}, f"there is no intersector 'optix': choose one of {', '.join(INTERSECTORS)}"),
    ({"rounds": (1, 4)}, "rounds"),
    ({"rounds": (8, 4)}, "rounds"),
    ({"strata": 0}, "strata"),
    ({"tolerance": np.nan}, "tolerance"),
    ({"offset": -1.0}, "offset"),
    ({"seed": -1}, "seed"),
    ({"seed": 2**64}, "seed"),
])  # fmt: skip
def test_wrong_arguments_are_refused(wrong, said):
    seen = scenes.buffers("step", scenes.SIGHTS["perspective"](2, 2))
    occluders = Occluders(scenes.SURFACES["step"].mesh())
    with pytest.raises(InputError, match=said):
        ray_cast_occlusion(occluders, seen, **{"radius": 0.1, **wrong})
    with pytest.raises(InputError, match="normals"):
        ray_cast_occlusion(occluders, Buffers(seen.view, seen.depth, seen.positions), 0.1)


# The integrands of the estimators


@cache
def steep_crease():
    """A floor before a wall, seen nearly along the wall, where texels are 1/64 of the radius 1: textures, and a
    floor's texels with their distances from the wall."""
    corners = [[-20, 0, 0], [20, 0, 0], [20, 0, 20], [-20, 0, 20], [-20, 20, 0], [20, 20, 0]]
    mesh = Mesh(np.array(corners, float), np.array([[0, 2, 1], [0, 3, 2], [0, 1, 5], [0, 5, 4]]))
    view = Camera("orthographic", (0, 6.5, 2.6), (0, 0, 0), (0, 1, 0), 6.0, 0.1, 40.0).view(384, 384)
    buffers = Buffers.of(RayCaster(mesh, view.cast_from_world, 1).gbuffer(view, normals="geometric"), view)
    x, y, z = np.moveaxis(buffers.positions.astype(float), -1, 0)
    floor = (np.abs(y) < 1e-3) & (np.abs(x) < 0.2) & (z > 0.03) & (z < 1.15)
    return buffers, floor, z[floor]


# The factor of these is a matter of taste, and left out.
UP_TO_STRENGTH = ("alchemy", "sao", "sao-equation-1", "multiresolution")


TOLD = [name for name, estimator in of_one_view().items() if estimator.converges and not name.startswith("vo-area")]


@pytest.mark.parametrize("name", TOLD)
def test_the_integrand_told_is_the_one_nearest_to_the_estimator_before_a_wall(name):
    """Each other weighting and falloff is further off, and what no strength is left out of is within 0.016."""
    estimator, (buffers, floor, away) = ESTIMATORS[name], steep_crease()
    points = sample_set("ball" if estimator.dimensions == 3 else "disk", "sobol", 1024, 1).points
    if name in ("lf", "point", "hemisphere"):
        points = make_samples("sobol", 1024, 1)
    elif name == "alchemy":  # taps have equal numbers at all radii
        points = points * np.sqrt((points**2).sum(axis=1, keepdims=True))
    more = {
        "oriented-hemisphere": {"bias": 1e-3, "range_check": "none"}, "hbao": {"directions": 32, "steps": 32},
        "gtao": {"slices": 16, "steps": 32},
    }.get(name, {})  # fmt: skip
    more = {"taps": 256, "turns": 0} if name.startswith("sao") else more
    texture = estimate(name, buffers, 1.0, points if estimator.dimensions else None, **more).texture
    ours = (half_space(texture) if estimator.whole_ball else texture)[floor].astype(float)

    def residual(weighting, falloff):
        exact = np.array([crease(c, weighting, falloff) for c in away])
        factor = (exact @ ours) / (exact @ exact) if name in UP_TO_STRENGTH else 1.0
        return np.sqrt(np.mean((factor * exact - ours) ** 2))

    residuals = {integrand: residual(*integrand) for integrand in product(WEIGHTINGS, FALLOFFS)}
    nearest, second = sorted(residuals, key=residuals.get)[:2]
    assert nearest == estimator.integrand, residuals
    assert residuals[second] > 1.2 * residuals[nearest]
    assert name in UP_TO_STRENGTH or residuals[nearest] < 0.016


def test_the_integrand_of_mean_and_variance_is_that_of_lines():
    """VO section 4.2 puts them in the place of many lines."""
    assert ESTIMATORS["vo-area"].integrand == ESTIMATORS["vo-lines"].integrand
