"""Bent normals: closed forms, exact answers, a march in plain NumPy, and rays."""

from math import acos, atan, cos, pi, sin, sqrt
from types import SimpleNamespace

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import with_one_thread_and_two
from reference import truth
from reference.slices import Slices
from reference.volumetric import Frame

from lfssao import Buffers, Camera, InputError, Occluders, RayCaster, bent_normals, builtin_scene, ray_cast_occlusion
from lfssao.ao.estimators.gtao import _parts
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.optics.view import KINDS
from lfssao.verify.kit.views import view_numbers

NAMES = "gtao", "visibility-bitmask"
WEIGHTINGS = "cosine", "uniform"
CLOSED = 1e-6  # of the radius: within it no texel sees another


def degrees(a, b):
    """Angles between unit vectors."""
    return np.degrees(2 * np.arcsin(np.minimum(np.linalg.norm(np.asarray(a) - b, axis=-1) / 2, 1)))


# Closed forms


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize(("n", "part"), [(0.0, 0.5), (0.0, 1.0), (0.9, 0.2), (0.9, 1.0), (-1.3, 1.0), (-0.4, 0.6)])
def test_a_side_is_the_integral_up_to_its_horizon(weighting, n, part):
    """By a million middles of angles; the normal's part in the slice has the length 0.8."""
    h = part * (n + pi / 2)
    t = (np.arange(10**6) + 0.5) * h / 10**6
    weight = (0.8 * np.cos(t - n) if weighting == "cosine" else 1.0) * np.sin(t) * h / 10**6
    arcs = SimpleNamespace(points=np.array([[1.0, 0.0]]), exact=True, cosine=weighting == "cosine")
    here = None, None, None, (0.8 * sin(n), 0.3, 0.8 * cos(n))
    made = _parts(arcs, SimpleNamespace(arc_cosine=acos), here, 0, cos(h))
    assert made == pytest.approx((np.sum(weight * np.sin(t)), np.sum(weight * np.cos(t))), abs=1e-10)


# Exact answers


def crease(c, weighting):
    """Tangent of the angle from the normal on a face of a right-angle crease, c R from the other."""
    segment = (np.arccos(c) - c * np.sqrt(1 - c * c)) / pi
    if weighting == "uniform":
        return (1 - c * c) / 2 / (1 - segment)
    return 4 * (1 - c * c) ** 1.5 / (pi * (2 - c) * (1 + c) ** 2)


def wall(a, weighting):
    """The same on a floor before a wall that rises to the angle a."""
    return np.tan(a / 2) if weighting == "uniform" else sin(a) ** 2 / (pi - a + sin(a) * cos(a))


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_exact_answers_are_means_of_open_directions(weighting):
    """By directions all over the hemisphere, of heights and azimuths at equal distances."""
    z, turn = np.meshgrid((np.arange(1500) + 0.5) / 1500, (np.arange(1500) + 0.5) * 2 * pi / 1500)
    x = np.sqrt(1 - z * z) * np.cos(turn)
    weight = z if weighting == "cosine" else np.ones_like(z)
    for c in (0.0, 0.3, 0.8):
        shown = weight * (x < c)
        assert -np.sum(shown * x) / np.sum(shown * z) == pytest.approx(crease(c, weighting), rel=2e-3)
    for a in (0.3, 1.2, pi / 2):
        shown = weight * ((x < 0) | (z * cos(a) > x * sin(a)))
        assert -np.sum(shown * x) / np.sum(shown * z) == pytest.approx(wall(a, weighting), rel=2e-3)


@pytest.mark.parametrize("sight", scenes.SIGHTS)
@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("surface", ["facing plane", "tilted plane", "convex crease"])
def test_the_bent_normal_of_what_is_open_is_the_normal(surface, weighting, sight):
    """A radius within a texel. Many slices of gtao have it to rounding, sectors to their width."""
    seen = scenes.buffers(surface, scenes.SIGHTS[sight](9, 7))
    options = {"weighting": weighting, "slices": 64}
    assert degrees(bent_normals("gtao", seen, CLOSED, **options), seen.normals).max() < 1e-5
    assert degrees(bent_normals("visibility-bitmask", seen, CLOSED, **options), seen.normals).max() < 0.5


def test_power_has_no_part_in_it_and_directions_have_no_length():
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](24, 18), np.float32)
    for name in NAMES:
        made = bent_normals(name, seen, 0.2)
        assert_same_bits(made, bent_normals(name, seen, 0.2, power=2.2))
        assert np.abs(np.linalg.norm(made, axis=-1) - 1).max() < 3e-7
        assert made.dtype == np.float32


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_a_crease_bends_normals_away_from_its_other_face(weighting):
    """Faces of 45 degrees seen from above, so that horizons are those of rays; steps must be wide against texels."""
    seen = scenes.buffers("concave crease", scenes.SIGHTS["orthographic"](256, 192))
    x = seen.positions[96, :, 0]
    c = sqrt(2) * np.abs(x) / 0.2
    there = (c > 0.1) & (c < 0.95)
    angle = np.arctan(crease(np.minimum(c, 1), weighting))[:, None]
    away = np.where(x[:, None] > 0, scenes.LEFT, scenes.RIGHT)
    exact = np.cos(angle) * seen.normals[96] + np.sin(angle) * away
    options = {"slices": 16, "steps": 24, "randomize": False, "weighting": weighting}
    assert there.sum() >= 60
    assert np.degrees(angle[there]).max() > 25
    for name, more, most in (("gtao", {}, (0.8, 2.0)), ("visibility-bitmask", {"thickness": 1e3}, (1.3, 3.0))):
        made = bent_normals(name, seen, 0.2, **options, **more)[96]
        assert degrees(made, exact)[there].max() < most[WEIGHTINGS.index(weighting)]


def test_a_pit_has_the_normal_and_a_sphere_bends_alike_on_both_sides():
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["orthographic"](64, 48))
    made = bent_normals("gtao", seen, 0.3, slices=8, randomize=False)
    mirrored = made[:, ::-1] * [-1, 1, 1]
    assert np.median(np.abs(made - mirrored)) < 1e-12
    x = seen.positions[..., 0]
    y = seen.positions[..., 1]
    floor = (np.hypot(x, y) > scenes.BALL) & (np.hypot(x, y) < 0.25)
    outward = (made[..., 0] * x + made[..., 1] * y)[floor]
    assert (outward > 0).mean() > 0.99
    top = seen.positions[24, 32]
    radius = 0.05
    assert degrees(bent_normals("gtao", seen, radius, slices=8)[24, 32], seen.normals[24, 32]) < 1
    assert top[2] > 0.24


# A march in plain NumPy


def described(name, seen, radius, options):
    """A view as the reference takes it."""
    view = seen.view
    mapping = seen.view.world_to_image
    parameters = {
        "estimator": name, "radius": radius, "options": {**ESTIMATORS[name].parameters, **options},
        "mapping": {"kind": KINDS[mapping.kind], "numbers": mapping.numbers.tolist()},
        "viewer_distance": view.viewer_distance().tolist(), "view": view_numbers(view),
    }  # fmt: skip
    inputs = {"depth": seen.depth, "positions": seen.positions, "normals": seen.normals, "directions": seen.directions}
    return parameters, inputs if seen.turns is None else {**inputs, "turns": seen.turns}


def integral(t, n, weighting):
    """Integrals from 0 to t, of either sign, of W |sin t| (sin t, cos t), by angles."""
    side = np.sign(t)
    h = abs(t)
    if weighting == "uniform":
        return (h - sin(h) * cos(h)) / 2, side * sin(h) ** 2 / 2
    odd = sin(h) ** 3 / 3
    even = (8 - 9 * cos(h) + cos(3 * h)) / 12
    return cos(n) * odd + side * sin(n) * even, side * cos(n) * (1 - cos(h) ** 3) / 3 + sin(n) * odd


def marched(seen, radius, **options):
    """Bent normals of gtao by angles, each slice from one horizon to the other."""
    slices = Slices(*described("gtao", seen, radius, options))
    falloff = slices.options["falloff"]
    cosine = slices.options["weighting"]
    made = np.zeros((*seen.depth.shape, 3))
    for j, i in np.argwhere(seen.depth < np.inf).tolist():
        frame = Frame(slices.scene, j, i, slices.r)
        e, f, towards = map(float, slices.normal(frame, j, i))
        for k in range(0, len(slices.sides), 2):
            x, y = map(float, slices.sides[k])
            n = np.arctan2(x * e + y * f, towards)
            length = np.hypot(x * e + y * f, towards)
            along = x * frame.e.astype(float) + y * frame.f.astype(float)
            ends = []
            for side, way in zip((1, -1), slices.sides[k : k + 2], strict=True):
                h = pi / 2 + side * n
                for texel in (each for each in slices.seen(frame, way, j, i)[0] if seen.depth[each] < np.inf):
                    d = (slices.scene.positions[texel] - frame.p).astype(float)
                    size = np.linalg.norm(d)
                    angle = acos(np.clip(-d @ frame.w / size, -1, 1))
                    if falloff:
                        low = cos(pi / 2 + side * n)
                        part = min((1 - size / radius) / falloff, 1)
                        angle = acos(np.clip(low + part * (cos(angle) - low), -1, 1))
                    h = min(h, angle) if size < radius else h
                ends.append(integral(side * h, n, cosine))
            across, ahead = np.subtract(*ends) * (length if cosine == "cosine" else 1)
            made[j, i] += across * along - ahead * frame.w
    length = np.linalg.norm(made, axis=-1, keepdims=True)
    return np.divide(made, length, out=np.zeros_like(made), where=length > 0)


OPTIONS = {"default": {}, "uniform": {"weighting": "uniform", "slices": 3},
           "falloff": {"falloff": 0.6, "distribution": "squared"}}  # fmt: skip


@pytest.mark.parametrize("sight", scenes.SIGHTS)
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_every_texel_has_the_bent_normal_of_a_march_by_angles(sight, options):
    rng = np.random.default_rng(2)
    bends = []
    moves = []
    for surface in ("sphere on a plane", "concave crease"):
        hole = rng.random((12, 16)) < 0.1
        seen = scenes.buffers(surface, scenes.SIGHTS[sight](16, 12), np.float32, hole).turned("hash")
        made = bent_normals("gtao", seen, 0.2, **options)
        exact = marched(seen, 0.2, **options)
        assert np.abs(made - exact).max() < 1e-5
        assert not made[hole].any()
        bends.append(degrees(exact, seen.normals)[~hole].max())
        moves.append(degrees(bent_normals("gtao", seen, 0.2, **options, seed=1), exact)[~hole].max())
    assert max(bends) > 9
    assert max(moves) > 0.5  # other slices would not pass


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", NAMES)
def test_any_number_of_threads_and_extreme_textures(name, dtype):
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["display"](40, 150), dtype)
    one, two = with_one_thread_and_two(lambda: bent_normals(name, seen, 0.3))
    assert_same_bits(one, two)
    assert one.dtype == dtype
    assert not bent_normals(name, seen, 0.0).any()
    wild = seen.positions.copy()
    wild[::3], wild[1::3, ::2] = 1e30, -1e38
    made = bent_normals(name, Buffers(seen.view, seen.depth, wild, 1e30 * seen.normals), 0.3)
    assert np.isfinite(made).all()


def test_float32_is_float64_rounded():
    for name in NAMES:
        made = [
            bent_normals(name, scenes.buffers("step", scenes.SIGHTS["crossed slits"](48, 36), dtype), 0.2)
            for dtype in (np.float32, np.float64)
        ]
        assert np.median(np.abs(made[0] - made[1])) < 1e-6


def test_what_has_no_bent_normals_is_refused():
    seen = scenes.buffers("step", scenes.SIGHTS["display"](4, 3))
    with pytest.raises(InputError, match="estimator hbao has no bent normals: choose one of gtao, visibility-bitmask"):
        bent_normals("hbao", seen, 0.1)
    with pytest.raises(InputError, match="estimator gtao reads normals, and there is no normals texture"):
        bent_normals("gtao", Buffers(seen.view, seen.depth, seen.positions), 0.1)
    with pytest.raises(InputError, match="no parameter 'directions'"):
        bent_normals("gtao", seen, 0.1, directions=3)
    with pytest.raises(InputError, match="radius is -1"):
        bent_normals("gtao", seen, -1.0)


# Rays


@pytest.mark.parametrize("through", ["tree", "embree"])
@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_rays_have_the_exact_answers(weighting, through):
    """4096 rays of a texel in strata: within one degree, and a plane's are as near to its normal."""
    if through == "embree":
        pytest.importorskip("embreex")
    options = {"rounds": (64, 64), "offset": 1e-6 if through == "tree" else 1e-4, "intersector": through, "bent": True}
    hole = np.arange(18)[:, None] != np.full(24, 9)
    seen = scenes.buffers("concave crease", scenes.SIGHTS["orthographic"](24, 18), hole=hole)
    made = ray_cast_occlusion(Occluders(scenes.SURFACES["concave crease"].mesh()), seen, 0.2, weighting, **options)
    x = seen.positions[9, :, 0]
    c = np.minimum(sqrt(2) * np.abs(x) / 0.2, 1)
    angle = np.arctan(crease(c, weighting))[:, None]
    exact = np.cos(angle) * seen.normals[9] + np.sin(angle) * np.where(x[:, None] > 0, scenes.LEFT, scenes.RIGHT)
    assert degrees(made.bent[9], exact).max() < 1
    assert not made.bent[hole].any()
    assert (c == 1).any()
    assert np.degrees(angle).max() > 20
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](24, 18), hole=hole)
    options["offset"] = 1e-9 if through == "tree" else 1e-6
    made = ray_cast_occlusion(Occluders(scenes.SURFACES["step"].mesh()), seen, np.inf, weighting, **options).bent
    x = seen.positions[9, :, 0]
    for k in np.flatnonzero(x < 0):
        angle = atan(wall(atan(scenes.STEP / -x[k]), weighting))
        assert degrees(made[9, k], (-sin(angle), 0, cos(angle))) < 1
    assert degrees(made[9, x > 0], (0, 0, 1)).max() < 1


@pytest.mark.parametrize(("weighting", "falloff"), [("cosine", "constant"), ("uniform", "quadratic")])
def test_rays_add_their_open_parts_in_a_written_order(weighting, falloff):
    """By brute force, bit for bit, with any number of threads; others have no bent normals."""
    hole = np.array([[False, True, False], [False, False, False]])
    seen = scenes.buffers("concave crease", scenes.SIGHTS["perspective"](3, 2), np.float32, hole)
    mesh = scenes.SURFACES["concave crease"].mesh()
    options = {"rounds": (3, 3), "strata": 3, "seed": 7}
    one, two = with_one_thread_and_two(
        lambda: ray_cast_occlusion(Occluders(mesh), seen, 0.3, weighting, falloff, bent=True, **options)
    )
    expected = np.zeros((2, 3, 3))
    for j, i in np.argwhere(~hole):
        origin, axes = truth.begin(seen.positions[j, i], seen.normals[j, i], 1e-3 * 0.3)
        total = np.zeros(3)
        for number in range(3):
            ways = truth.directions_of(3 * int(j) + int(i), number, 3, 7, weighting, axes)
            of_round = np.zeros(3)
            for t, way in zip(truth.distances(origin, ways, 0.3, mesh.vertices[mesh.faces]), ways, strict=True):
                of_round = of_round + (1.0 - truth.covered(t, 0.3, falloff)) * way
            total = total + of_round
        x, y, z = total
        expected[j, i] = total / sqrt((x * x + y * y) + z * z)
    assert_same_bits(one.bent, expected)
    assert_same_bits(two.bent, expected)
    alone = ray_cast_occlusion(Occluders(mesh), seen, 0.3, weighting, falloff, **options)
    assert alone.bent is None
    assert_same_bits(alone.texture, one.texture)


def test_gtao_is_near_to_rays_in_a_corner():
    """A median of MEDIAN degrees, while normals are off by more; both miss what the depth texture does not show."""
    mesh = builtin_scene("corner")
    view = Camera.looking_at(mesh.bounds, "perspective").view(64, 48, 8)
    seen = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric"), view)
    radius = 0.1 * np.linalg.norm(np.subtract(*mesh.bounds))
    rays = ray_cast_occlusion(Occluders(mesh), seen, radius, rounds=(32, 32), bent=True)
    there = (seen.depth < np.inf) & (rays.texture > 0.1)
    there[:12], there[-12:], there[:, :12], there[:, -12:] = False, False, False, False
    assert there.sum() > 200
    ours = degrees(bent_normals("gtao", seen, radius, slices=8, steps=12), rays.bent)[there]
    theirs = degrees(seen.normals, rays.bent)[there]
    assert np.median(ours) < 0.4 * np.median(theirs)
