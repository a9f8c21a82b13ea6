"""Normals, the nearest colour filter and the guard band of the G-buffer."""

import numpy as np
import pytest
from reference.scalable import scaled
from reference.volumetric import cross

from lfssao import Camera, InputError, Mesh, Paint, RayCaster, find_display, module_views

RESOLUTION = 64, 48
# A triangle and a camera before it.
CORNERS = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1.5, 0]])
BEFORE = Camera.looking_at(np.array([[-1.0, -1, -1], [1, 1.5, 1]]), "orthographic").view(*RESOLUTION)


def view_of(mesh, guard=0):
    return module_views(mesh, find_display("sample-a").with_resolution(*RESOLUTION), range(3, 4), guard)[0]


def test_geometric_normals_are_the_triangles_and_face_the_viewer(statue):
    view = view_of(statue)
    seen = RayCaster(statue, view.cast_from_world).gbuffer(view, None, "geometric")
    texels = np.argwhere(seen.triangle >= 0)
    assert len(texels) > 300
    for j, i in texels:
        a, b, c = statue.vertices[statue.faces[seen.triangle[j, i]]]
        expected = scaled(*cross(b - a, c - a)).astype(np.float32)
        found = seen.normals[j, i]
        same = np.array_equal(found.view(np.int32), expected.view(np.int32))
        assert same or np.array_equal(found.view(np.int32), (-expected).view(np.int32))
    display = find_display("sample-a").with_resolution(*RESOLUTION)
    _, direction, _ = display.texel_ray(3, texels[:, 1] + 0.5, texels[:, 0] + 0.5)
    into_scene = direction * [1, 1, -1]  # the ROI is fitted by one scale and z turned round
    assert ((seen.normals[seen.triangle >= 0] * into_scene).sum(axis=1) <= 1e-6).all()
    assert not seen.normals[seen.triangle < 0].any()


def test_a_surface_seen_from_behind_has_its_normal_turned():
    for faces in ([[0, 1, 2]], [[0, 2, 1]]):
        caster = RayCaster(Mesh(CORNERS, np.array(faces)), BEFORE.cast_from_world)
        seen = caster.gbuffer(BEFORE, None, "geometric")
        assert (seen.normals[seen.triangle >= 0] == [0, 0, 1]).all()


def test_smooth_normals_are_those_of_the_vertices():
    normals = np.array([[-3.0, 0, 4], [3, 0, 4], [0, 5, 0.0]])
    mesh = Mesh(CORNERS, np.array([[0, 1, 2]]), normals=normals)
    seen = RayCaster(mesh, BEFORE.cast_from_world).gbuffer(BEFORE, None, "smooth")
    j, i = np.argwhere(seen.triangle >= 0)[50]
    # Barycentric weights from the position, another way than the kernel's.
    x, y = seen.positions[j, i, :2].astype(float)
    c = (y + 1) / 2.5
    b = (x + (1 - c)) / 2
    expected = scaled(*((1 - b - c) * normals[0] + b * normals[1] + c * normals[2]))
    np.testing.assert_allclose(seen.normals[j, i], expected, atol=1e-6)
    # Without normals at the vertices smooth ones are the triangles'.
    bare = RayCaster(Mesh(CORNERS, mesh.faces), BEFORE.cast_from_world).gbuffer(BEFORE, None, "smooth")
    assert (bare.normals[bare.triangle >= 0] == [0, 0, 1]).all()


def test_nearest_filter_gives_only_colours_of_the_texture():
    texture = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [0, 0, 1]]], np.float32)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    paint = Paint(np.ones((1, 3), np.float32), np.zeros(2, np.int32), (texture,), corners[:, :2].copy())
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), paint)
    view = Camera.looking_at(mesh.bounds + np.array([[0, 0, -0.1], [0, 0, 0.1]]), "orthographic").view(40, 40)
    caster = RayCaster(mesh, view.cast_from_world)
    nearest = caster.gbuffer(view, "nearest")
    bilinear = caster.gbuffer(view, "bilinear")
    surface = nearest.triangle >= 0
    x = nearest.positions[surface][:, 0]
    y = nearest.positions[surface][:, 1]
    clear = (np.abs(x - 0.5) > 1e-3) & (np.abs(y - 0.5) > 1e-3)
    expected = texture[(y < 0.5).astype(int), (x > 0.5).astype(int)]
    assert np.array_equal(nearest.color[surface][clear], expected[clear])
    assert len(np.unique(bilinear.color[surface], axis=0)) > 4


def test_unknown_layers_are_refused(statue):
    view = view_of(statue)
    caster = RayCaster(statue, view.cast_from_world)
    with pytest.raises(InputError, match=r"normals is 'round'.*geometric, smooth"):
        caster.gbuffer(view, None, "round")
    with pytest.raises(InputError, match=r"color is 'cubic'.*bilinear, nearest"):
        caster.gbuffer(view, "cubic")


@pytest.mark.parametrize("guard", [1, 7, 32])
def test_a_guard_band_adds_texels_and_changes_none(statue, guard):
    plain = view_of(statue)
    banded = view_of(statue, guard)
    caster = RayCaster(statue, plain.cast_from_world)
    inner = caster.gbuffer(plain)
    outer = caster.gbuffer(banded)
    crop = slice(guard, -guard), slice(guard, -guard)
    assert outer.depth.shape == (48 + 2 * guard, 64 + 2 * guard)
    for name in ("depth", "positions", "color"):
        a = getattr(inner, name)
        b = np.ascontiguousarray(getattr(outer, name)[crop])
        assert np.array_equal(a.view(np.int32), b.view(np.int32))
    assert np.array_equal(inner.triangle, outer.triangle[crop])
