"""The analytic textures that other tests rest on: against the views' mappings, and against the ray caster."""

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import RayCaster

both = pytest.mark.parametrize("sight", scenes.SIGHTS)
all_surfaces = pytest.mark.parametrize("name", scenes.SURFACES)


@both
@all_surfaces
def test_positions_land_on_their_own_texels_and_on_the_surface(name, sight):
    sight = scenes.SIGHTS[sight]()
    seen = scenes.buffers(name, sight)
    j, i = np.nonzero(seen.depth < np.inf)
    assert len(j) > 0.9 * seen.depth.size
    image = sight.view.world_to_image(seen.positions[j, i])
    np.testing.assert_allclose(image, np.stack([i + 0.5, j + 0.5, seen.depth[j, i]], -1), rtol=0, atol=1e-9)
    assert (np.abs(np.linalg.norm(seen.normals[j, i], axis=-1) - 1) < 1e-12).all()
    assert ((seen.normals[j, i] * sight.direction[j, i]).sum(-1) <= 0).all()
    x, y, z = seen.positions[j, i].T
    above = scenes.SURFACES[name].height(x, y)
    if name not in ("step", "sphere on a plane"):
        np.testing.assert_allclose(z, above, rtol=0, atol=1e-12)
    beside = scenes.SURFACES[name].height(x + 1e-12, y)  # the step's wall, to within rounding
    assert (z <= np.maximum(above, beside) + 1e-12).all()


@both
@all_surfaces
def test_the_ray_caster_sees_the_same(name, sight):
    """But on the sphere, which the mesh cuts short: a chord of an edge of length e lies e^2 / 8 r below it."""
    sight = scenes.SIGHTS[sight]()
    seen = scenes.buffers(name, sight)
    mesh = scenes.SURFACES[name].mesh()
    cast = RayCaster(mesh, sight.view.cast_from_world).gbuffer(sight.view, None, "geometric")
    same = np.abs(cast.normals - seen.normals).max(-1) < 1e-6
    there = (seen.depth < np.inf) & (cast.depth < np.inf)
    if name == "sphere on a plane":
        there &= same
    assert there.mean() > 0.85
    assert same[there].mean() > 0.99  # edges apart
    at = there & same
    np.testing.assert_allclose(cast.positions[at], seen.positions[at], rtol=0, atol=1e-6)
    np.testing.assert_allclose(cast.depth[at], seen.depth[at], rtol=0, atol=1e-6)
