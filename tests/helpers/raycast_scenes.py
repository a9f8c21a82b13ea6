"""Scenes that a ray caster may stumble over, in the cast space of a view.

A scene is a function of a view and a random generator that gives vertices (V, 3) float64 and faces (F, 3) int32.
"""

import functools
from contextlib import contextmanager

import numpy as np
from reference import raycast

from lfssao import Camera, find_display
from lfssao.gbuffer import rasterize
from lfssao.gbuffer.kernels import first_hit

IDENTITY = np.eye(3, 4)


@functools.cache
def resized(name, width, height):
    return find_display(name).with_resolution(width, height)


def display(name, index):
    return lambda width, height: resized(name, width, height).view(index, IDENTITY)


def camera(projection):
    """A camera whose eye space is the world with z turned round: the map between them rounds nothing."""
    return Camera(projection, (0.0, 0.0, 0.0), (0.0, 0.0, -2.0), (0.0, 1.0, 0.0), 1.0, 0.5, 4.0).view


# sample-a's outermost modules lie at x = -1 and 1, beside its screen: no ray of theirs is straight.
VIEWS = {
    "virtual": display("virtual", 0),
    "left": display("sample-a", 0),
    "right": display("sample-a", 20),
    "perspective": camera("perspective"),
    "orthographic": camera("orthographic"),
}


def at(view, u, v, share):
    """Points on the rays through image points, exactly; share -1 is near, 1 far, but inside the range of z."""
    u, v, share = np.broadcast_arrays(*(np.asarray(n, float) for n in (u, v, share)))
    ox, oy, dx, dy, _, far = raycast.rays_at(*view.rays, u, v)
    z = 0.5 * share if far.flat[0] < 2 else 2.2 + 1.5 * share
    return np.stack([ox + dx * z, oy + dy * z, z], axis=-1)


def texel_rays(view):
    return raycast.texel_rays(*view.rays, view.width, view.height)


def anywhere(view, rng, n, deep=0.9):
    """Points in the view and a little beside it."""
    u, v = rng.uniform(-0.1, 1.1, (2, n)) * [[view.width], [view.height]]
    return at(view, u, v, rng.uniform(-deep, deep, n))


def centres(view, rng, n):
    return rng.integers(0, view.width, n) + 0.5, rng.integers(0, view.height, n) + 0.5


def shuffled(vertices, faces, rng):
    """The same triangles in any order, each from any corner on, either way round."""
    faces = np.asarray(faces, np.int32).reshape(-1, 3)[rng.permutation(len(faces))]
    turned = np.take_along_axis(faces, (np.arange(3) - rng.integers(3, size=(len(faces), 1))) % 3, axis=1)
    turned = np.where(rng.random((len(faces), 1)) < 0.5, turned, turned[:, ::-1])
    return np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(turned, np.int32)


def separate(corners, rng):
    """Triangles that share nothing; corners (F, 3, 3)."""
    return shuffled(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), rng)


def soup(view, rng):
    """1 to 2,000 triangles, from specks to ones that fill the texture."""
    n = int(2000 ** rng.random())
    middle = anywhere(view, rng, n)
    size = 10 ** rng.uniform(-3, 0, (n, 1, 1))
    return separate(middle[:, None] + size * rng.uniform(-0.5, 0.5, (n, 3, 3)), rng)


def sheet(view, rng, step=None, bumpy=0.5):
    """A surface over the whole texture, its vertices dead centre on every step-th texel: at z of its own each."""
    step = step or int(rng.integers(1, 5))
    u = np.arange(-step, view.width + 2 * step, step) + 0.5
    v = np.arange(-step, view.height + 2 * step, step) + 0.5
    v, u = (n.ravel() for n in np.meshgrid(v, u, indexing="ij"))
    columns = len(np.unique(u))
    vertices = at(view, u, v, rng.uniform(-bumpy, bumpy, len(u)))
    faces = []
    for a in range(len(u) - columns):
        if (a + 1) % columns:
            b = a + 1
            c = a + columns
            d = a + columns + 1
            faces += [(a, b, c), (b, d, c)] if rng.random() < 0.5 else [(a, b, d), (a, d, c)]
    return shuffled(vertices, faces, rng)


def flat_sheet(view, rng):
    """The same at one z: on the screen of 'virtual' at 64 x 48 every number is exact and so is every edge."""
    return sheet(view, rng, bumpy=0.0)


def shallow_sheet(view, rng):
    """The same of small steps in z: edges that are a little curved in the image of a display go through centres."""
    return sheet(view, rng, step=int(rng.integers(2, 4)), bumpy=0.06)


def pits(view, rng):
    """Fans of triangles around vertices dead centre on texels; some edges run along x, y or z."""
    vertices = []
    faces = []
    for u, v in zip(*centres(view, rng, 12), strict=True):
        n = int(rng.integers(3, 9))
        first = len(vertices)
        angle = np.sort(rng.uniform(0, 2 * np.pi, n))
        middle = at(view, u, v, rng.uniform(-0.6, 0.6))
        ring = rng.uniform(0.01, 0.4) * np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(-1, 1, n)])
        ring[rng.random((n, 3)) < 0.2] = 0.0
        vertices += [middle, *(middle + ring)]
        faces += [(first, first + 1 + k, first + 1 + (k + 1) % n) for k in range(n)]
    return shuffled(np.array(vertices), faces, rng)


def slivers(view, rng):
    """Triangles a million and a thousand million times as long as wide, through texels' centres and anywhere."""
    n = 150
    middle = np.concatenate([at(view, *centres(view, rng, n), rng.uniform(-0.6, 0.6, n)), anywhere(view, rng, n)])
    along, aside = rng.uniform(-0.5, 0.5, (2, 2 * n, 3))
    aside *= rng.choice([1e-6, 1e-9], (2 * n, 1))
    corners = np.stack(
        [middle - along, middle + along, middle + rng.uniform(-1, 1, (2 * n, 1)) * along + aside], axis=1
    )
    return separate(corners, rng)


def duplicates(view, rng):
    """Each triangle up to four times, from other corners on; half of them with all corners at one z."""
    corners = anywhere(view, rng, 90).reshape(30, 3, 3)
    corners[::2, 1:, 2] = corners[::2, :1, 2]
    return separate(np.repeat(corners, rng.integers(1, 5, 30), axis=0), rng)


def coplanar(view, rng):
    """Triangles of other shapes that overlap in three planes, one of constant z."""
    corners = anywhere(view, rng, 120).reshape(3, 40, 3)
    for plane, (a, b) in zip(corners.reshape(3, -1, 3), [(0.0, 0.0), (0.25, -0.5), (0.3, 0.1)], strict=True):
        plane[:, 2] = plane[0, 2] + a * plane[:, 0] + b * plane[:, 1]
    return separate(corners.reshape(40, 3, 3), rng)


def sheets(view, rng):
    """Surfaces that go through one another, 1e-7 apart."""
    vertices, faces = sheet(view, rng, step=3, bumpy=0.2)
    other = vertices + rng.uniform(-1e-7, 1e-7, vertices.shape) * [0, 0, 1]
    return shuffled(np.concatenate([vertices, other]), np.concatenate([faces, faces + len(vertices)]), rng)


def edge_on(view, rng):
    """Triangles in the plane of a texel's ray, or 1e-12 off it, and such as have two corners on a ray."""
    n = 60
    u, v = centres(view, rng, n)
    first = at(view, u, v, rng.uniform(-0.9, 0.0, n))
    second = at(view, u, v, rng.uniform(0.0, 0.9, n))
    third = at(view, u, v, rng.uniform(-0.9, 0.9, n)) + rng.uniform(-0.3, 0.3, (n, 3)) * [[1, 1, 0]]
    third += rng.choice([0.0, 1e-12], (n, 1)) * rng.uniform(-1, 1, (n, 3))
    corners = np.stack([first, second, third], axis=1)
    corners[::3, :, 0] = first[::3, :1]  # x of all three the same: seen edge on by a whole column of a straight view
    return separate(corners, rng)


def stadium(view, rng):
    """Thousands of tiny triangles, one behind them that fills the view, one that goes through them."""
    n = 1500
    tiny = anywhere(view, rng, n, 0.3)[:, None] + 3e-3 * rng.uniform(-1, 1, (n, 3, 3))
    size = np.array([view.width, view.height]) * 3
    behind = at(view, *(size * [[-1, -1], [2, -1], [-1, 2]]).T, [0.7, 0.5, 0.6])
    through = at(view, *(size * [[-1, -1], [2, -1], [-1, 2]]).T, [-0.9, 0.9, 0.9])
    return separate(np.concatenate([tiny, behind[None], through[None]]), rng)


def beyond(view, rng):
    """Triangles that cross the first and the last z of the rays, or lie beyond them; z up to a million."""
    n = 60
    corners = anywhere(view, rng, 3 * n).reshape(n, 3, 3)
    *_, near, far = (float(line[0]) for line in raycast.rays_at(*view.rays, *np.full((2, 1), 0.5)))
    corners[:, :, 2] += rng.choice([0.0, near, far, near - 1, far + 1, 1e6, -1e6], (n, 3))
    corners[:8, :, 2] = rng.choice([near, far], (8, 1))
    corners[8:16, 0, 2] = near
    return separate(corners, rng)


def rows(view, rng):
    """Triangles with edges along x or y exactly through texels' centres, and corners on edges of others."""
    n = 40
    u, v = centres(view, rng, n)
    middle = at(view, u, v, rng.uniform(-0.5, 0.5, n))
    along = np.zeros((n, 3))
    along[np.arange(n), rng.integers(0, 2, n)] = 2.0 ** -rng.integers(1, 6, n)
    along[:, 2] = rng.choice([0.0, 0.125], n)
    left = middle - rng.choice([0, 1, 1], (n, 1)) * along
    right = middle + along
    one, other = rng.uniform(-0.3, 0.3, (2, n, 3))
    return separate(
        np.concatenate([np.stack([left, right, middle + one], 1), np.stack([right, left, middle + other], 1)]), rng
    )


def single(view, rng):
    two = at(view, *centres(view, rng, 2), rng.uniform(-0.8, 0.8, 2))
    return separate(np.concatenate([two, anywhere(view, rng, 1)])[None], rng)


def nothing(view, rng):
    """Beside the view, or behind the viewer."""
    corners = anywhere(view, rng, 30).reshape(10, 3, 3)
    corners[:5] += [10.0, 20.0, 0.0]
    corners[5:, :, 2] -= 10.0
    return separate(corners, rng)


SCENES = [
    soup, sheet, flat_sheet, shallow_sheet, pits, slivers, duplicates, coplanar, sheets, edge_on, stadium, beyond, rows,
    single, nothing,
]  # fmt: skip


# Ways of the ray caster


def to_world(view, points):
    """World coordinates of cast space, for the views above."""
    return points * [1.0, 1.0, view.world_from_cast[2, 2]]


def rasterized(view, tree):
    """Triangle and z of each texel by rasterisation, however many candidates there are."""
    triangle = np.full((view.height, view.width), -9, np.int32)
    z = np.full((view.height, view.width), np.nan)
    rasterize.first_hits(rasterize.candidate_pairs(view, tree, range(view.height)), tree, triangle, z)
    return triangle.ravel(), z.ravel()


def tiles(view):
    """Shape of the proposals."""
    return -(-view.height // first_hit.TILE), -(-view.width // first_hit.TILE)


def traced(view, tree, proposal):
    """Triangle and z of each texel by the tree; proposal: a triangle a tile, or -1 for none."""
    proposal = np.ascontiguousarray(np.broadcast_to(proposal, tiles(view)), np.int32)
    triangle = np.full((view.height, view.width), -9, np.int32)
    z = np.full((view.height, view.width), np.nan)
    first_hit.first_hits(view.rays, view.width, view.height, tree.arrays, proposal, triangle, z)
    return triangle.ravel(), z.ravel()


# Most candidate pairs a texel for rasterisation: none, so that the tree is taken, or any number.
WAYS = {"tree": 0.0, "rasterisation": np.inf}


@contextmanager
def way(name):
    before = rasterize.MOST_PAIRS
    rasterize.MOST_PAIRS = WAYS[name]
    try:
        yield
    finally:
        rasterize.MOST_PAIRS = before
