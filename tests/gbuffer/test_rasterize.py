"""Conservative rasterisation: the texels in which triangles can be hit, bands of rows, and what is found from them."""

import dataclasses
from fractions import Fraction
from math import ceil, floor

import numpy as np
import pytest
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast

from lfssao import find_display
from lfssao.gbuffer.kernels import rasterize as kernels
from lfssao.gbuffer.rasterize import candidate_pairs, image_axes
from lfssao.gbuffer.trees import TriangleTree

VIEWS = sorted(scenes.VIEWS)


def bound(view, vertices, faces, rows=None, scale=9.1):
    """Texels of corners, and bounds of triangles."""
    rows = rows or range(view.height)
    texels = np.empty((len(vertices), 4), np.int32)
    bounds = np.empty((len(faces), 4), np.int32)
    axes = image_axes(view, rows, scale, scale)
    kernels.bound_corners(view.width, len(rows), *axes, np.array(vertices), texels)
    kernels.bound_triangles(view.width, len(rows), faces, texels, bounds)
    return texels, bounds


def image_of(view, point):
    """The image point of a corner, u and v, in fractions."""
    x, y, z = map(Fraction, point)
    lens = [Fraction(number) for number in view.lens.tolist()]
    if view.rays.kind == raycast.CROSSED_SLITS:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
        u = u_scale * (m_x + (x - m_x) / (1 - z / m_z)) + u_0
        return u, v_scale * (y_o + (y - y_o) / (1 - z / z_o)) + v_0
    depth = z if not view.lens[6] else 1
    return lens[0] * x / depth + lens[2], lens[3] - lens[1] * y / depth


@settings(max_examples=60)
@given(
    name=st.sampled_from(VIEWS),
    top=st.integers(0, 9),
    seed=st.integers(0, 2**32),
    deep=st.sampled_from([0.1, 0.9, 1.35]),
)
def test_texels_of_corners_hold_their_images(name, top, seed, deep):
    """And no ray on the wrong side of them finds the corner there: the sign of p tells, as it rounds.

    Corners lie on texels' rays, a few of the last digits beside them, and anywhere.
    """
    view = scenes.VIEWS[name](31, 17)
    rng = np.random.default_rng(seed)
    u, v = scenes.centres(view, rng, 40)
    points = np.concatenate([scenes.at(view, u, v, rng.uniform(-deep, deep, 40)), scenes.anywhere(view, rng, 20, deep)])
    points[:30] += points[:30] * rng.integers(-4, 5, (30, 3)) * 2.0**-52
    texels, _ = bound(view, points, np.zeros((0, 3), np.int32), range(top, 17))
    columns = np.arange(31)
    rows = np.arange(top, 17)
    ox, _, dx, _, _, _ = raycast.rays_at(*view.rays, columns + 0.5, np.full(1, 0.5))
    _, oy, _, dy, _, _ = raycast.rays_at(*view.rays, np.full(1, 0.5), rows + 0.5)
    rising = np.sign(view.lens[[4, 6]]) if view.rays.kind == raycast.CROSSED_SLITS else np.array([1.0, -1.0])
    bounded = (texels[:, 1] - texels[:, 0] < 2) & (texels[:, 3] - texels[:, 2] < 2)
    assert bounded.sum() >= 20
    for point, held in zip(points[bounded], texels[bounded].reshape(-1, 2, 2).tolist(), strict=True):
        x, y, z = point
        p = rising[0] * (x - (ox + dx * z))
        q = rising[1] * (y - (oy + dy * z))
        for exact, start, moved, (low, high) in zip(image_of(view, point), (0, top), (p, q), held, strict=True):
            size = len(moved)
            place = exact - start - Fraction(1, 2)
            margins = Fraction(1, 2048), Fraction(3, 2048)
            lows = [min(max(ceil(place - margin), -1), size) for margin in margins]
            highs = [min(max(floor(place + margin), -1), size) for margin in margins]
            assert lows[1] <= low <= lows[0]
            assert highs[0] <= high <= highs[1]
            assert (moved[: max(low, 0)] > 0).all()
            assert (moved[high + 1 :] < 0).all()


def test_where_rounding_is_not_bounded_a_triangle_may_cover_anything():
    view = scenes.VIEWS["virtual"](8, 6)
    _, m_z, _, z_o = view.lens[:4]
    rows = range(view.height)
    face = np.array([[0, 1, 2]], np.int32)
    for z, bounded in (
        (0.99 * m_z, True), (0.997 * m_z, False), (m_z, False), (2 * m_z, False), (0.999 * z_o, False),
    ):  # fmt: skip
        aside = np.array([[9.0, 9.0, 0.0], [9.1, 9.0, z], [9.0, 9.1, 0.0]])
        texels, bounds = bound(view, aside, face)
        assert (texels[1].tolist() == [0, 7, 0, 5]) != bounded
        assert kernels.count_candidates(bounds, np.zeros(1, np.int64)) == (0 if bounded else 48)
    # Numbers so large that rounding moves corners by a quarter of the margin, and offsets of more than 30 bits.
    limits = [image_axes(view, rows, scale, 9.1)[0][5] for scale in (9.1, 1e6, 1e9)]
    assert limits[0] == 256 > limits[1] > 1 > limits[2]
    aside = dataclasses.replace(view, lens=view.lens + np.array([0, 0, 0, 0, 0, 2.0**30, 0, 0]))
    assert image_axes(aside, rows, 9.1, 9.1)[0][5] == 0


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize(
    "scene", [scenes.soup, scenes.sheet, scenes.shallow_sheet, scenes.beyond], ids=lambda scene: scene.__name__
)
def test_bands_have_each_triangle_that_reaches_into_them(name, scene):
    """In order, with the texels between its corners, within the texture."""
    view = scenes.VIEWS[name](41, 39)
    vertices, faces = scene(view, np.random.default_rng(5))
    texels, bounds = bound(view, vertices, faces)
    counts = np.zeros(3, np.int64)
    pairs = kernels.count_candidates(bounds, counts)
    ends = np.cumsum(counts)
    members = np.empty(ends[-1], np.int32)
    kernels.sort_into_bands(bounds, ends - counts, members)
    first = np.maximum(texels[faces][..., [0, 2]].min(axis=1), 0)
    last = np.minimum(texels[faces][..., [1, 3]].max(axis=1), [40, 38])
    np.testing.assert_array_equal(bounds, np.stack([first, last], axis=-1).reshape(-1, 4))
    covered = np.maximum(last - first + 1, 0).prod(axis=1)
    assert pairs == covered.sum() > 100
    assert scene is not scenes.sheet or not covered.all()
    for band, found in enumerate(np.split(members, ends[:-1])):
        reached = (first[:, 1] // 16 <= band) & (band <= last[:, 1] // 16)
        np.testing.assert_array_equal(found, np.flatnonzero(reached & (covered > 0)))
        assert found.size


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("top", [0, 5])
def test_every_texel_that_a_triangle_is_hit_in_is_a_candidate(name, top):
    """Small ones, their corners on texels' rays and a few of the last digits beside them, and everywhere.

    Each by itself: where triangles share an edge, one of them may hide what is missing of the other.
    """
    view = scenes.VIEWS[name](23, 19)
    rng = np.random.default_rng(3)
    near = []
    for beside in (0.0, 0.06, 2.0):  # texels, of all corners
        u = rng.integers(0, 23, (400, 1)) + 0.5
        v = rng.integers(0, 19, (400, 1)) + 0.5
        columns = rng.integers(-3, 4, (400, 3))
        rows = rng.integers(-2, 3, (400, 3))
        near.append([n + whole + rng.uniform(-beside, beside, (400, 3)) for n, whole in ((u, columns), (v, rows))])
    share = rng.uniform(-0.8, 0.8, (400, 1)) + rng.choice([0.0, 0.012, 0.08], (400, 1)) * rng.uniform(-1, 1, (400, 3))
    vertices = np.concatenate([scenes.at(view, *place, share).reshape(-1, 3) for place in near])
    vertices[::2] += vertices[::2] * rng.integers(-4, 5, (len(vertices) // 2, 3)) * 2.0**-52
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    tree = TriangleTree(vertices, faces)
    bounds = candidate_pairs(view, tree, range(top, 19)).bounds[tree.arrays.place_of]
    rays = scenes.texel_rays(view)
    found = 0
    for face, (i0, i1, j0, j1) in zip(faces, bounds.tolist(), strict=True):
        hit = raycast.first_hits(rays, vertices[face][None]).triangle.reshape(19, 23) == 0
        rows, columns = np.nonzero(hit[top:])
        found += len(rows)
        if len(rows):
            assert i0 <= columns.min() <= columns.max() <= i1
            assert j0 <= rows.min() <= rows.max() <= j1
    assert found > 1500


def test_rays_that_are_not_separable_have_no_candidates():
    tree = TriangleTree(*scenes.sheet(scenes.VIEWS["virtual"](20, 15), np.random.default_rng(1), step=1))
    curved = find_display("picoarray").with_resolution(20, 15).view(3, scenes.IDENTITY)
    assert candidate_pairs(curved, tree, range(15)) is None
