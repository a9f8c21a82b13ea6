"""Triangles of polygons of every shape."""

import numpy as np
import pytest

from lfssao.errors import InputError
from lfssao.scene.polygons import Polygons, triangulate

RNG = np.random.default_rng(11)


def cut(*outlines):
    """The triangles of polygons, (T, 3, 3), and the polygon of each."""
    vertices = np.concatenate(outlines)
    counts = np.array([len(outline) for outline in outlines])
    places, owner = triangulate(str, vertices, Polygons(np.arange(len(vertices)), counts))
    return vertices[places], owner


def normals(triangles):
    """Twice the areas of triangles, as vectors."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def flat(*points):
    return np.array([[x, y, 0.0] for x, y in points])


def star(corners, turned):
    """A polygon around the origin whose corners have any distances, and twice its area by the shoelace formula."""
    angle = 2 * np.pi * (np.arange(corners) + RNG.uniform(0.1, 0.9, corners)) / corners
    distance = RNG.uniform(0.2, 3, corners)
    x = distance * np.cos(angle)
    y = distance * np.sin(angle)
    size = abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    return np.stack([x, y, np.zeros(corners)], axis=1) @ turned.T + RNG.normal(size=3), size


def test_any_polygon_around_a_point_in_any_plane_keeps_its_area_and_side():
    for _ in range(150):
        turned = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
        outline, size = star(int(RNG.integers(4, 15)), turned)
        triangles, owner = cut(outline)
        sizes = normals(triangles) @ np.cross(turned[:, 0], turned[:, 1])
        assert (sizes >= -1e-9).all()
        assert sizes.sum() == pytest.approx(size, rel=1e-9)
        assert (owner == 0).all()


@pytest.mark.parametrize(("outline", "size"), [
    (flat((0, 0), (1, -1), (1, 1), (-1, 1), (-1, -1)), 3),
    (flat((3, 0), (3, 1), (1, 1), (1, 3), (0, 3), (0, 0)), 5),
    (flat((0, 0), (1, 0), (2, 0), (2, 2), (1, 1), (0, 2)), 3),  # a corner on an edge
    (flat((0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)), 15),  # a bridge to a hole
    (flat((0, 0), (4, 0), (1, 1), (0, 4)), 4),  # a quad
])  # fmt: skip
def test_concave_polygons(outline, size):
    for scale, each in (
        (1, outline),
        (1, outline[::-1]),
        (1, np.roll(outline, 2, axis=0)),
        (1e-6, outline[:, [2, 0, 1]]),
    ):
        assert np.linalg.norm(normals(cut(each * scale + 5)[0]).sum(axis=0)) / 2 == pytest.approx(
            size * scale**2, rel=1e-6
        )


def test_convex_polygons_are_fans():
    angle = 2 * np.pi * np.arange(7) / 7
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    places, owner = triangulate(
        str, circle, Polygons(np.array([0, 1, 2, 6, 0, 2, 4, *range(7), 5, 1]), np.array([3, 4, 7, 2]))
    )
    assert places.tolist() == [[0, 1, 2], [3, 4, 5], [5, 6, 3], *([7, 7 + k, 8 + k] for k in range(1, 6))]
    assert owner.tolist() == [0, 1, 1, 2, 2, 2, 2, 2]


def test_many_polygons_keep_their_order():
    outlines = [star(int(RNG.integers(3, 9)), np.eye(3)) for _ in range(50)]
    triangles, owner = cut(*(outline for outline, _ in outlines))
    assert (np.diff(owner) >= 0).all()
    sizes = np.bincount(owner, normals(triangles)[:, 2])
    assert sizes == pytest.approx(np.array([size for _, size in outlines]), rel=1e-9)


@pytest.mark.parametrize("outline", [
    flat((0, 0), (1, 1), (1, 0), (0, 1)),
    flat((0, 0), (3, 1), (3, 0), (0, 1)),
    flat(*((np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5))),
])  # fmt: skip
def test_polygons_that_cross_themselves_are_refused(outline):
    with pytest.raises(InputError, match=r"^0 is a polygon of . corners that crosses itself"):
        cut(outline)


def test_vertices_that_do_not_exist_are_refused():
    for wrong in (3, -1):
        with pytest.raises(InputError, match=f"^1 names vertex {wrong}, but there are 3 vertices"):
            triangulate(str, np.eye(3), Polygons(np.array([0, 1, 2, 0, wrong, 1]), np.array([3, 3])))
