"""Footprints: the texels that triangles may cover, bands of rows, and what is found from them."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast as raycast_twin

from lfssao import find_display
from lfssao.footprints import bend, hits_by_footprint, image_axes, ray_halves
from lfssao.kernels import footprints as footprint_kernels
from lfssao.kernels import hits
from lfssao.kernels.intrinsics import CHUNK
from lfssao.tree import TriangleTree
from lfssao.window import Window

VIEWS = sorted(scenes.VIEWS)


def bits(values):
    return np.atleast_1d(np.asarray(values, np.float64)).view(np.int64)


def texel_rays(view):
    return raycast_twin.texel_rays(view.ray_kind, view.lens, view.width, view.height)


def places_of(view, points, window, scale=9.1):
    """Places of points along columns and rows, (n, 2)."""
    places = bound(view, np.array(points, np.float64), np.zeros((0, 3), np.int32), 1, window, scale)[0]
    return np.stack([places >> 32, places.astype(np.int32)], axis=1)


def image_of(view, point):
    """Where a corner appears, u and v, in fractions."""
    x, y, z = map(Fraction, point)
    lens = [Fraction(number) for number in view.lens.tolist()]
    if view.ray_kind == raycast_twin.FLAT_LINEAR:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
        u = u_scale * (m_x + (x - m_x) / (1 - z / m_z)) + u_0
        return u, v_scale * (y_o + (y - y_o) / (1 - z / z_o)) + v_0
    depth = z if view.ray_kind == raycast_twin.PERSPECTIVE else 1
    return lens[0] * x / depth + lens[2], lens[3] - lens[1] * y / depth


@settings(max_examples=60)
@given(
    name=st.sampled_from(VIEWS),
    first=st.tuples(st.integers(0, 9), st.integers(0, 9)),
    seed=st.integers(0, 2**32),
    deep=st.sampled_from([0.1, 0.9, 1.35]),
)
def test_places_hold_where_a_corner_appears(name, first, seed, deep):
    """And no ray on the wrong side of them finds the corner there: the sign of p tells, as it rounds.

    Corners lie on texels' rays, a few of the last digits beside them, and anywhere.
    """
    view, rng = scenes.VIEWS[name](31, 17), np.random.default_rng(seed)
    window = Window(*first, 31, 17)
    u, v = scenes.centres(view, rng, 40)
    points = np.concatenate([scenes.at(view, u, v, rng.uniform(-deep, deep, 40)), scenes.anywhere(view, rng, 20, deep)])
    points[:30] += points[:30] * rng.integers(-4, 5, (30, 3)) * 2.0**-52
    places = places_of(view, points, window)
    v, u = (n.ravel() + 0.5 for n in np.mgrid[first[1] : 17, first[0] : 31])
    ox, oy, dx, dy, _, _ = raycast_twin.rays_at(view.ray_kind, view.lens, u, v)
    rising = np.sign(view.lens[[4, 6]]) if view.ray_kind == raycast_twin.FLAT_LINEAR else np.array([1.0, -1.0])
    units = footprint_kernels.UNITS
    bounded = places[:, 0] != -(2**31)
    assert bounded.sum() >= 20
    for point, place in zip(points[bounded], places[bounded], strict=True):
        for exact, whole, start in zip(image_of(view, point), place.tolist(), first, strict=True):
            assert whole - Fraction(1, 4) < units * (exact - start - Fraction(1, 2)) < whole + 1 + Fraction(1, 4)
        x, y, z = point
        p, q = x - (ox + dx * z), y - (oy + dy * z)
        for moved, at, sign, whole in ((p, u - first[0], rising[0], place[0]), (q, v - first[1], rising[1], place[1])):
            centre = units * (at - 0.5)
            assert (sign * moved[centre < whole - 1] > 0).all()
            assert (sign * moved[centre > whole + 2] < 0).all()


def test_where_rounding_is_not_bounded_a_triangle_may_cover_anything():
    view = scenes.VIEWS["virtual"](8, 6)
    _, m_z, _, z_o = view.lens[:4]
    window = Window.whole(view)
    for z, bounded in (
        (0.99 * m_z, True), (0.999 * m_z, False), (m_z, False), (2 * m_z, False), (0.999 * z_o, False),
    ):  # fmt: skip
        assert (places_of(view, [[0.0, 0.0, z]], window)[0, 0] != -(2**31)) == bounded
        far_off = np.array([[9.0, 9.0, z, 9.1, 9.0, z, 9.0, 9.1, z]])
        assert tries(view, far_off) == (0 if bounded else 48)
    # Numbers so large that rounding moves corners by a quarter of a unit, and offsets that whole numbers do not hold.
    limits = [image_axes(view, window, scale, 9.1)[0][5] for scale in (9.1, 1e6, 1e9)]
    assert limits[0] == 256 > limits[1] > 1 > limits[2]
    aside = dataclasses.replace(view, lens=view.lens + np.array([0, 0, 0, 0, 0, 2.0**30, 0, 0]))
    assert image_axes(aside, window, 9.1, 9.1)[0][5] == 0


def bound(view, vertices, faces, chunks, window=None, scale=9.1, deep=None, bent=0.0):
    """What bound_triangles finds: all its outputs."""
    window, n = window or Window.whole(view), len(faces)
    places, found = np.empty(len(vertices), np.int64), np.empty((n + chunks, 4), np.int32)
    bands = -(-view.height // footprint_kernels.BAND)
    counts, (kept, area) = np.empty((chunks, 2 * bands + 2), np.int64), np.empty((2, chunks), np.int64)
    footprint_kernels.bound_triangles(
        view.width, view.height, *image_axes(view, window, scale, scale), vertices.reshape(-1), faces.reshape(-1),
        np.zeros(n, np.float32) if deep is None else deep, np.float32(bent), places, found, counts, kept, area,
    )  # fmt: skip
    return places, found, counts, kept, area


def tries(view, corners):
    vertices, faces = corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    return bound(view, vertices, faces, 1)[4][0]


def covered(u, v, columns, rows, delta):
    """Which texels between its bounds a triangle may cover by its edges: bits i + 8 j, -1 where all may be."""
    wide, high = max(u) - min(u), max(v) - min(v)
    if len(columns) > 6 or len(rows) > 4 or wide > 7 * 1024 or high > 5 * 1024 or not delta <= 0.0625:
        return -1
    margin = 4 * (wide + high + 8) + int((delta * np.float32(wide + 4)) * np.float32(high + 4))
    out = 0
    for j, row in enumerate(rows):
        for i, column in enumerate(columns):
            (xa, xb, xc), (ya, yb, yc) = ([k - 1024 * at for k in corners] for corners, at in ((u, column), (v, row)))
            edges = xb * yc - yb * xc, xc * ya - yc * xa, xa * yb - ya * xb
            area = sum(edges)
            surely = abs(area) >= margin and min(edge if area > 0 else -edge for edge in edges) < -margin
            out |= (not surely) << (i + 8 * j)
    return out


def depths(vertices, faces):
    """How far triangles reach along z, or a little farther."""
    tree = TriangleTree(vertices, faces)
    return tree.deep[tree.place_of]


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize(
    "scene", [scenes.soup, scenes.sheet, scenes.shallow_sheet, scenes.beyond], ids=lambda scene: scene.__name__
)
def test_bands_have_each_triangle_with_the_texels_that_it_may_cover(name, scene):
    """In order, those that turn their front first; in few chunks, and in one of more triangles than a block has."""
    view = scenes.VIEWS[name](41, 39)
    vertices, faces = scene(view, np.random.default_rng(5))
    chunks = 1 if len(faces) > CHUNK else 3
    deep, bent = depths(vertices, faces), np.float32(0.9)
    places, found, counts, kept, area = bound(view, vertices, faces, chunks, deep=deep, bent=bent)
    ends = np.cumsum(counts.T).reshape(-1, chunks)
    members = np.empty((ends[-1, -1], 4), np.int32)
    footprint_kernels.sort_into_bands(len(faces), found, kept, np.ascontiguousarray((ends - counts.T).T), members)
    parts = np.split(members, ends[:-1, -1])
    u, v = (places >> 32)[faces], places.astype(np.int32).astype(np.int64)[faces]
    want = [[] for _ in parts]
    texels = few = 0
    for p in range(len(faces)):
        anywhere = (u[p] == -(2**31)).any()
        if anywhere:
            columns, rows = range(41), range(39)
        else:
            columns, rows = (
                [k for k in range(size) if n.min() - 1 <= 1024 * k <= n.max() + 2]
                for n, size in ((u[p], 41), (v[p], 39))
            )
        if columns and rows:
            texels += len(columns) * len(rows)
            among = -1 if anywhere else covered(u[p].tolist(), v[p].tolist(), columns, rows, deep[p] * bent)
            few += among > 0 and among.bit_count() < len(columns) * len(rows)
            # Places rise to the right and downwards.
            (ua, ub, uc), (va, vb, vc) = u[p].astype(np.float32), v[p].astype(np.float32)
            back = (ub - ua) * (vc - va) > (uc - ua) * (vb - va)
            for band in sorted({row // 16 for row in rows if among}):
                want[2 * band + back].append((p, columns[0] + (rows[0] << 16), columns[-1] + (rows[-1] << 16), among))
    assert [[tuple(row) for row in part.tolist()] for part in parts] == want
    assert area.sum() == texels > 100
    assert scene is not scenes.sheet or kept.sum() < len(faces)
    assert scene is not scenes.shallow_sheet or few > 99
    assert sum(map(bool, want[::2])) > 1
    assert sum(map(bool, want[1::2])) > 1


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("first", [(0, 0), (6, 5)])
def test_every_texel_that_a_triangle_is_hit_in_is_among_those_it_may_cover(name, first):
    """Small ones, their corners on texels' rays and a few of the last digits beside them, and everywhere.

    Each by itself: where triangles share an edge, one of them may hide what is missing of the other.
    """
    view, rng = scenes.VIEWS[name](23, 19), np.random.default_rng(3)
    window = Window(*first, 23, 19)
    near = []
    for beside in (0.0, 0.06, 2.0):  # texels, of all corners; of 0.06 what curves an edge decides often
        u, v = rng.integers(0, 23, (400, 1)) + 0.5, rng.integers(0, 19, (400, 1)) + 0.5
        columns, rows = rng.integers(-3, 4, (400, 3)), rng.integers(-2, 3, (400, 3))
        near.append([n + whole + rng.uniform(-beside, beside, (400, 3)) for n, whole in ((u, columns), (v, rows))])
    share = rng.uniform(-0.8, 0.8, (400, 1)) + rng.choice([0.0, 0.012, 0.08], (400, 1)) * rng.uniform(-1, 1, (400, 3))
    vertices = np.concatenate([scenes.at(view, *place, share).reshape(-1, 3) for place in near])
    vertices[::2] += vertices[::2] * rng.integers(-4, 5, (len(vertices) // 2, 3)) * 2.0**-52
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    tree = TriangleTree(vertices, faces)
    view_of = dataclasses.replace(view, width=23 - first[0], height=19 - first[1])
    deep = depths(vertices, faces)
    _, found, _, kept, _ = bound(view_of, vertices, faces, 1, window, deep=deep, bent=bend(view, tree.bounds))
    by_face = {number >> 1: more for number, *more in found[: kept[0]].tolist()}
    rays = texel_rays(view)
    hits_of_small = 0
    for face in faces:
        number = int(face[0]) // 3
        hit = raycast_twin.first_hits(rays, vertices[face][None]).triangle.reshape(19, 23) == 0
        for j, i in np.argwhere(hit[first[1] :, first[0] :]).tolist():
            start, end, among = by_face[number]
            i0, j0, i1, j1 = start & 0xFFFF, start >> 16, end & 0xFFFF, end >> 16
            assert i0 <= i <= i1
            assert j0 <= j <= j1
            assert among == -1 or among >> (i - i0 + 8 * (j - j0)) & 1
            hits_of_small += among != -1
    assert hits_of_small > 300


def test_a_corner_that_may_appear_anywhere_reaches_over_small_textures_too():
    """Of those the bounds are a block's."""
    view = scenes.VIEWS["virtual"](5, 4)
    _, m_z, _, _ = view.lens[:4]
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.999 * m_z]])
    _, found, _, kept, area = bound(view, corners, np.array([[0, 1, 2]], np.int32), 1)
    assert kept.tolist() == [1]
    assert area.tolist() == [20]
    assert found[0].tolist()[2:] == [4 + (3 << 16), -1]


def test_how_much_edges_may_be_curved():
    """log((1 - z / m_z) / (1 - z / z_o)) between any two z of the bounds, in fractions of their distance."""
    view = scenes.VIEWS["virtual"](8, 6)
    _, m_z, _, z_o = view.lens[:4].tolist()
    for low, high in ((-0.5, 0.5), (0.9 * z_o, 0.1), (0.0, 0.99 * m_z)):
        z = np.linspace(low, high, 400)
        ratio = (1 - z / m_z) / (1 - z / z_o)
        kappa = ratio[1:] / ratio[:-1]
        step = (high - low) / 399
        most = float(bend(view, np.array([[-1, -1, low], [1, 1, high]])))
        assert np.abs(kappa - 1).max() <= most * step
        assert np.abs(1 / kappa - 1).max() <= most * step
    assert np.isinf(bend(view, np.array([[-1, -1, -1], [1, 1, m_z]])))
    assert np.isinf(bend(view, np.array([[-1, -1, 1.01 * z_o], [1, 1, 0]])))
    assert bend(scenes.VIEWS["perspective"](8, 6), np.array([[-1, -1, 1], [1, 1, 3]])) == 0


def test_weights_are_left_out_where_none_are_asked_for():
    rng = np.random.default_rng(4)
    view = scenes.VIEWS["perspective"](33, 21)
    tree = TriangleTree(*scenes.soup(view, rng))
    triangle, z, weights = hits_by_footprint(view, tree, np.inf)
    alone, alone_z, none = hits_by_footprint(view, tree, np.inf, weighted=False)
    seen = triangle >= 0
    assert seen.any()
    np.testing.assert_array_equal(alone, triangle)
    np.testing.assert_array_equal(bits(alone_z[seen]), bits(z[seen]))
    assert weights.shape == (len(z), 2)
    assert none.shape == (0, 2)


@pytest.mark.parametrize("name", VIEWS)
def test_surfaces_by_halves_are_the_rays_own(name):
    """With rows of more texels than are looked at together, some of which see nothing."""
    view, rng = scenes.VIEWS[name](201, 5), np.random.default_rng(2)
    size = 201 * 5
    seen, z = rng.integers(0, 9, size).astype(np.int32), rng.uniform(-0.4, 0.4, size) + (view.lens[4] > 0.4)
    seen[rng.random(size) < 0.3], seen[30:420] = -1, -1
    z[seen < 0] = np.nan
    want, got = ((np.zeros(size, np.float32), np.zeros((size, 3), np.float32)) for _ in range(2))
    turn = np.ravel(view.world_from_cast)
    hits.write_surface(view.ray_kind, view.lens, turn, 201, seen, z, *want)
    columns, rows, _, _ = ray_halves(view, Window.whole(view))
    hits.write_surface_by_halves(view.ray_kind, view.lens, turn, columns, rows, seen, z, got[0], got[1].reshape(-1))
    for a, b in zip(got, want, strict=True):
        np.testing.assert_array_equal(a.view(np.int32), b.view(np.int32))
    assert np.isinf(got[0]).sum() == (seen < 0).sum()


def test_footprints_are_left_to_the_tree_where_they_are_large_or_curved():
    rng = np.random.default_rng(1)
    view = scenes.VIEWS["virtual"](20, 15)
    tree = TriangleTree(*scenes.sheet(view, rng, step=1))
    assert hits_by_footprint(view, tree, 0.5) is None
    assert hits_by_footprint(view, tree, 50.0) is not None
    curved = find_display("picoarray").with_resolution(20, 15).view(3, scenes.IDENTITY)
    assert hits_by_footprint(curved, tree, np.inf) is None
    assert hits_by_footprint(dataclasses.replace(view, width=2**15), tree, np.inf) is None
