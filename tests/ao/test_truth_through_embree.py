"""Ray-cast occlusion through Embree against our tree.

Both cast the same rays. One is answered differently in float32 than in float64 if it passes an outline, or its end lies
before or behind a triangle, within some 1e-7 of the scene's size: fewer than one ray in 100,000 (MISSED).
"""

import time
from threading import Lock

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits

from lfssao import Buffers, InputError, Mesh
from lfssao.ao.ground_truth import _CLEAR, FALLOFFS, INTERSECTORS, WEIGHTINGS, Occluders, ray_cast_occlusion
from lfssao.core.threads import in_chunks
from lfssao.gbuffer.trees import CentredScene

pytest.importorskip("embreex", reason="Embree has no wheel here")

MISSED = 1e-5


def both(occluders, seen, radius, *names, **options):
    return [ray_cast_occlusion(occluders, seen, radius, *names, **options, intersector=n) for n in INTERSECTORS]


def moved_by(seen, positions):
    return Buffers(seen.view, seen.depth, positions, seen.normals)


# Beside the tree


@pytest.mark.parametrize("falloff", FALLOFFS)
@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("sight", list(scenes.SIGHTS))
def test_textures_of_displays_and_cameras(sight, weighting, falloff):
    """The radius is one that float32 rounds down: a ray that meets nothing goes less far than the falloff does."""
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS[sight](20, 15))
    occluders = Occluders(scenes.sphere_mesh(4))
    tree, embree = both(occluders, seen, 0.21, weighting, falloff, rounds=(2, 4))
    assert float(np.float32(0.21)) < 0.21
    assert tree.texture.max() > 0.1
    agree(tree, embree, falloff)
    assert len(np.unique(tree.rays)) > 1


def agree(tree, embree, falloff):
    apart = np.abs(tree.texture - embree.texture)
    if falloff == "constant":
        assert (apart * tree.rays).sum() <= MISSED * tree.rays.sum()
        same = apart == 0
        assert_same_bits(tree.error[same], embree.error[same])
        assert np.array_equal(tree.rays[same], embree.rays[same])
    else:
        assert np.sqrt(np.mean(apart**2)) < MISSED
        assert not embree.texture[tree.texture == 0].any()
        assert np.mean(tree.rays != embree.rays) < 0.01  # an error next to the tolerance may fall to its other side


@pytest.mark.parametrize("falloff", ["constant", "linear"])
def test_far_from_the_origin(falloff):
    """Steps of float32 are 0.06 to 0.25 there, as large as the radius; those of positions, float64, are 5e-10."""
    seen = scenes.buffers("step", scenes.SIGHTS["orthographic"](16, 12))
    mesh = scenes.SURFACES["step"].mesh()
    away = np.array([1e6, -2e6, 3e6])
    options = {"falloff": falloff, "rounds": (4, 4), "tolerance": 0.0}
    near = ray_cast_occlusion(Occluders(mesh), seen, 0.2, **options)
    far = Occluders(Mesh(mesh.vertices + away, mesh.faces))
    embree = ray_cast_occlusion(far, moved_by(seen, seen.positions + away), 0.2, **options, intersector="embree")
    assert near.texture.max() > 0.25
    agree(near, embree, falloff)


@pytest.mark.parametrize("power", [-90, 90])
def test_no_size_is_special(power):
    """All numbers times a power of two: float32 would have lost them at 2^-90 squared, and the hits with them."""
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](12, 9))
    mesh = scenes.sphere_mesh(3)
    scale = 2.0**power
    made = [
        ray_cast_occlusion(
            Occluders(Mesh(factor * mesh.vertices, mesh.faces)), moved_by(seen, factor * seen.positions), factor * 0.2,
            falloff="linear", rounds=(2, 4), intersector="embree",
        )
        for factor in (1.0, scale)
    ]  # fmt: skip
    assert made[0].texture.max() > 0.1
    for name in ("texture", "error", "rays"):
        assert_same_bits(getattr(made[1], name).astype(np.float64), getattr(made[0], name).astype(np.float64))


# How near to the surface rays may begin


def planes(rng, count):
    """Triangles on random planes with corners anywhere, points in them, unit normals; a mesh and buffers of each."""
    for _ in range(count):
        corners = rng.uniform(-1, 1, (3, 3)) * 10.0 ** rng.uniform(-3, 3) + rng.uniform(-1, 1, 3)
        weights = rng.dirichlet(np.ones(3), (4, 5))
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normals = np.broadcast_to(normal / np.linalg.norm(normal), (4, 5, 3))
        view = scenes.SIGHTS["perspective"](5, 4).view
        yield Mesh(corners, np.array([[0, 1, 2]])), Buffers(view, np.zeros((4, 5)), weights @ corners, normals)


def test_from_the_least_offset_no_plane_hides_itself():
    """40 planes, 20 points of each, 512 rays: where rays begin on it a plane hides half of the points' surroundings."""
    for mesh, seen in planes(np.random.default_rng(21), 40):
        occluders = Occluders(mesh)
        least = _CLEAR * occluders.embree.unit * (1 + 1e-9)
        for radius in (least, 2 * float(np.ptp(mesh.bounds, axis=0).max())):
            options = {"weighting": "uniform", "rounds": (8, 8), "intersector": "embree"}
            assert not ray_cast_occlusion(occluders, seen, radius, offset=least / radius, **options).texture.any()
            with pytest.raises(InputError, match=r"rays begin .* off the surface, and Embree's float32 needs"):
                ray_cast_occlusion(occluders, seen, radius, offset=0.999 * least / radius, **options)


def test_rays_do_not_slip_through_between_triangles():
    """Rays from afar through vertices and edges of a sheet without holes, inside its rim.

    Robust traversal loses one of 1,700 of them with any instruction set; the other one of 6, and of 50 on diagonals.
    """
    rng = np.random.default_rng(11)
    n = 20_000
    side = 65
    x, y = np.meshgrid(*[np.linspace(-1, 1, side)] * 2, indexing="ij")
    corners = np.stack([x, y, rng.uniform(-0.005, 0.005, x.shape)], axis=-1).reshape(-1, 3)
    first = np.arange(side**2).reshape(side, side)[:-1, :-1].ravel()
    squares = np.stack([first, first + 1, first + side + 1, first + side], axis=1)
    sheet = CentredScene(Mesh(corners, np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])))
    inner = squares[(np.abs(corners[squares, :2]) < 0.9).all(axis=(1, 2))]
    share = np.round(rng.random((n, 1)), 1)
    for ends in ([0, 1], [0, 2], [0, 3]):  # along a row, the diagonal, along a column
        low, high = np.moveaxis(corners[rng.choice(inner, n)][:, ends], 1, 0)
        origins = np.column_stack([rng.uniform(-25, 25, (n, 2)), np.full(n, 100.0)])
        ways = low + share * (high - low) - origins
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        origins = (origins - sheet.middle) / sheet.unit
        for any_hit in (False, True):
            met = sheet.distances(origins.astype(np.float32), ways.astype(np.float32), np.inf, any_hit)
            assert np.isinf(met).mean() < 1 / 500


# Batches


@pytest.mark.parametrize("strata", [8, 256])
def test_batches_are_small_and_full(strata, monkeypatch):
    """No more than 65,536 rays are made at a time, one texel's if it must be; texels that are done leave the batch."""
    seen = scenes.buffers(
        "step", scenes.SIGHTS["orthographic"](44, 34) if strata == 8 else scenes.camera("orthographic", 3, 2)
    )
    occluders = Occluders(scenes.SURFACES["step"].mesh())
    sizes = []
    distances = type(occluders.embree).distances
    monkeypatch.setattr(type(occluders.embree), "distances", lambda *a: [sizes.append(len(a[1])), distances(*a)][1])
    made = ray_cast_occlusion(occluders, seen, 0.1, rounds=(2, 3), strata=strata, tolerance=0.003, intersector="embree")
    assert max(sizes) == 65_536
    assert sum(sizes) == made.rays.sum()


def test_a_failure_keeps_the_rest_from_being_begun():
    begun = []
    lock = Lock()

    def work(start, _stop):
        with lock:
            begun.append(start)
        if start == 0:
            raise KeyboardInterrupt
        time.sleep(0.01)

    for threads in (1, 2):
        begun.clear()
        with pytest.raises(KeyboardInterrupt):
            in_chunks(work, 1000, 10, threads)
        assert len(begun) < 50
