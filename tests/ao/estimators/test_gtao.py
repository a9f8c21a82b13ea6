"""GTAO against closed forms, against rays on a height field, and beside HBAO.

A view from straight above shows all of a height field, on which a horizon hides exactly what rays find hidden within R.
"""

from functools import cache

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import Buffers, Camera, Mesh, Occluders, RayCaster, builtin_scene, estimate, ray_cast_occlusion


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


def segment(c):
    """Part of the disk beyond a chord at c, by the cosine that is the height of a face's rays."""
    return (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi


@pytest.mark.parametrize(
    ("weighting", "steps", "exact", "off"),
    [("cosine", 24, segment, 0.012), ("uniform", 12, lambda c: (1 - c) / 2, 0.03)],
)
def test_a_crease_hides_what_a_half_plane_within_the_radius_does(weighting, steps, exact, off):
    """Faces of 45 degrees. Steps must be wide against texels, which lie beside the way: a slope hides itself."""
    seen = scenes.buffers("concave crease", scenes.SIGHTS["orthographic"](256, 192))
    options = {"slices": 16, "steps": steps, "randomize": False}
    made = estimate("gtao", seen, 0.2, weighting=weighting, **options).texture[96]
    c = np.sqrt(2) * np.abs(seen.positions[96, :, 0]) / 0.2
    there = (c > 0.1) & (c < 1)
    assert there.sum() > 60
    assert np.abs(made[there] - exact(c[there])).max() < off
    assert abs(np.mean(made[there] - exact(c[there]))) < off / 3


@pytest.mark.parametrize(("surface", "x"), [("facing plane", 0.0), ("sphere on a plane", 0.0), ("step", 0.03)])
def test_nothing_hides_a_plane_that_faces_the_viewer_nor_tops(surface, x):
    seen = scenes.buffers(surface, scenes.SIGHTS["orthographic"](192, 144))
    j, i, _ = scenes.nearest(seen, x)
    for weighting in ("cosine", "uniform"):
        assert estimate("gtao", seen, 0.1, weighting=weighting).texture[j, i] < 1e-3


def test_uniform_horizons_are_those_of_hbao_without_attenuation():
    """Directions of 2 n and sides of n slices are the same, and the tangent plane's cosines cancel."""
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](48, 36)).turned("hash")
    one = estimate("gtao", seen, 0.2, slices=4, steps=6, weighting="uniform").texture
    other = estimate("hbao", seen, 0.2, directions=8, steps=6, attenuation="none").texture
    assert one.max() > 0.1
    assert np.abs(one - other).max() < 1e-12


@cache
def hills():
    """A height field without overhangs, seen from above: textures, and its cosine-weighted occlusion by rays."""
    n = 161
    y = np.linspace(-0.8, 0.8, 161)
    x, y = np.meshgrid(y, y)
    z = 0.12 * np.sin(9 * x + 1) * np.cos(7 * y) + 0.05 * np.sin(23 * y + 4 * x)
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    mesh = Mesh(
        np.stack([x, y, z], -1).reshape(-1, 3), np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    )
    view = Camera("orthographic", (0, 0, 2), (0, 0, 0), (0, 1, 0), 0.9, 1.0, 3.0).view(128, 96, 16)
    seen = Buffers.of(RayCaster(mesh, view.cast_from_world, 1).gbuffer(view, normals="geometric"), view)
    truth = ray_cast_occlusion(Occluders(mesh), seen, 0.15, "cosine", "constant", tolerance=0.004, intersector="embree")
    return seen, truth.texture


def test_many_slices_and_steps_tend_to_occlusion_by_rays():
    """The truth is off by 0.004 itself, and texels are 1/16 of the radius."""
    seen, truth = hills()
    inner = (slice(24, -24), slice(24, -24))
    errors = [
        rms(estimate("gtao", seen, 0.15, slices=n, steps=m, randomize=False).texture[inner] - truth[inner])
        for n, m in ((1, 4), (2, 8), (16, 16))
    ]
    assert errors[0] > 2 * errors[1] > 4 * errors[2]
    assert errors[2] < 0.013


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["corner", "gallery"])
@pytest.mark.parametrize("part", [0.03, 0.1])
def test_gtao_is_nearer_to_the_cosine_weighted_truth_than_hbao(scene, part):
    """Each of 64 taps; both miss what the depth texture does not show, which is most of what is left."""
    mesh = builtin_scene(scene)
    view = Camera.looking_at(mesh.bounds, "perspective").view(96, 72, 12)
    seen = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric"), view)
    radius = part * np.linalg.norm(np.subtract(*mesh.bounds))
    truth = ray_cast_occlusion(
        Occluders(mesh), seen, radius, "cosine", "constant", tolerance=0.01, intersector="embree"
    ).texture
    there = seen.depth < np.inf
    there[:16], there[-16:], there[:, :16], there[:, -16:] = False, False, False, False
    ours = rms(estimate("gtao", seen, radius, slices=4, steps=8).texture[there] - truth[there])
    theirs = rms(estimate("hbao", seen, radius, directions=8, steps=8).texture[there] - truth[there])
    assert ours < 0.95 * theirs
