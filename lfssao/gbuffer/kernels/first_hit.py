"""First hits by packet traversal of a bounding volume hierarchy, with an exact test of a ray and a triangle.

A packet is the rays of one tile of texels. One triangle is proposed for each tile, by Embree where it is installed, and
tested on all of the tile's texels: a hit bounds the depth of nearer ones. The packet then goes down the tree, nearer
boxes first. Each triangle of a leaf is tested on the texels of the sub-tiles whose packets can meet its box, unless it
lies behind the hits found so far.

The result is that of testing every triangle on every ray, whatever was proposed: a packet's bounds are those of its
rays' own numbers, and a box is compared with numbers that are rounded as hit_triangle rounds them (``_may_meet``).
"""

from typing import NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.gbuffer.kernels.bvh import LEAF
from lfssao.gbuffer.kernels.triangle import hit_triangle, triangle_at
from lfssao.optics.kernels.rays import texel_ray

TILE = 8  # texels along a tile's edge
SUB = 2  # and along a sub-tile's; both by measurement
_SUBS = TILE // SUB
_STACK = 128  # two nodes a level


class Tile(NamedTuple):
    """First column and row of a tile in its view, and how many it has."""

    left: int
    top: int
    columns: int
    rows: int


@formula
def _product_range(a_low, a_high, b_low, b_high):
    """Smallest and largest a b of a and b in two ranges."""
    p, q, r, s = a_low * b_low, a_low * b_high, a_high * b_low, a_high * b_high
    return min(p, q, r, s), max(p, q, r, s)


@formula
def _may_meet(packet, row, x0, y0, z0, x1, y1, z1):
    """Whether a packet of rays can meet a box.

    packet[:, row]: smallest and largest o_x, d_x, o_y, d_y; smallest z at which a ray begins, largest at which one
    ends. The ranges of x and y are those over all of the box's z. They hold every number o + d z that hit_triangle
    makes of a corner, to the bit, as rounding keeps the order of numbers.
    """
    low, high = _product_range(packet[2, row], packet[3, row], z0, z1)
    in_x = (packet[0, row] + low <= x1) & (packet[1, row] + high >= x0)
    low, high = _product_range(packet[6, row], packet[7, row], z0, z1)
    in_y = (packet[4, row] + low <= y1) & (packet[5, row] + high >= y0)
    return (z0 <= packet[9, row]) & (z1 >= packet[8, row]) & in_x & in_y


@formula
def _widen(packet, row, ox, oy, dx, dy, z0, z1):
    """Add a ray from z0 to z1 to a packet."""
    packet[0, row], packet[1, row] = min(packet[0, row], ox), max(packet[1, row], ox)
    packet[2, row], packet[3, row] = min(packet[2, row], dx), max(packet[3, row], dx)
    packet[4, row], packet[5, row] = min(packet[4, row], oy), max(packet[5, row], oy)
    packet[6, row], packet[7, row] = min(packet[6, row], dy), max(packet[7, row], dy)
    packet[8, row], packet[9, row] = min(packet[8, row], z0), max(packet[9, row], z1)


@formula
def _start_tile(rays, tile, tree, proposed, ray, best, packet):
    """Write rays, hits of the proposed triangle and packets of a tile's texels.

    proposed: number of a triangle, or -1. ray[place]: o_x, o_y, d_x, d_y, near. best[place]: z and triangle of the hit,
    the ray's far end and -1 where the proposal is not hit; z is -infinity where there is no texel or no ray.
    """
    for k in range(0, 10, 2):
        for row in range(packet.shape[1]):
            packet[k, row], packet[k + 1, row] = np.inf, -np.inf
    for place in range(TILE * TILE):
        i, j = place % TILE, place // TILE
        best[place, 0], best[place, 1] = -np.inf, -1.0
        if i >= tile.columns or j >= tile.rows:
            continue
        ox, oy, _, dx, dy, _, near, far = texel_ray(rays, (tile.left + i) + 0.5, (tile.top + j) + 0.5)
        if not near < far:
            continue
        best[place, 0] = far
        if proposed >= 0:
            hit, z = hit_triangle(ox, oy, dx, dy, triangle_at(tree.corners, tree.place_of[proposed]))
            if hit and near < z < far:
                best[place, 0], best[place, 1] = z, proposed
        ray[place, 0], ray[place, 1], ray[place, 2], ray[place, 3], ray[place, 4] = ox, oy, dx, dy, near
        _widen(packet, _SUBS * _SUBS, ox, oy, dx, dy, near, best[place, 0])
        _widen(packet, (j // SUB) * _SUBS + i // SUB, ox, oy, dx, dy, near, best[place, 0])


@formula
def _test_triangle(face, t, ray, best, packet, meets):
    """Test one triangle on every texel of the sub-tiles whose packets can meet its box."""
    x0, y0, z0 = min(t.ax, t.bx, t.cx), min(t.ay, t.by, t.cy), min(t.az, t.bz, t.cz)
    x1, y1, z1 = max(t.ax, t.bx, t.cx), max(t.ay, t.by, t.cy), max(t.az, t.bz, t.cz)
    for sub in range(_SUBS * _SUBS):  # no branch here, so that LLVM makes vectors of it
        meets[sub] = np.int64(_may_meet(packet, sub, x0, y0, z0, x1, y1, z1))
    for sub in range(_SUBS * _SUBS):
        if meets[sub] == 0:
            continue
        corner = (sub // _SUBS) * SUB * TILE + (sub % _SUBS) * SUB
        for k in range(SUB * SUB):
            place = corner + (k // SUB) * TILE + k % SUB
            if z0 > best[place, 0]:
                continue
            hit, z = hit_triangle(ray[place, 0], ray[place, 1], ray[place, 2], ray[place, 3], t)
            first = z < best[place, 0] or (z == best[place, 0] and face < best[place, 1])
            if hit and first and ray[place, 4] < z:
                best[place, 0], best[place, 1] = z, face


@formula
def _search_tile(tree, stack, ray, best, packet, meets):
    """Go down the tree with the tile's packet and test every triangle of the leaves that it can meet."""
    boxes, whole = tree.boxes, _SUBS * _SUBS
    first_leaf = (boxes.shape[0] + 1) // 2 - 1
    stack[0] = 0
    top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        x0, y0, z0 = boxes[node, 0], boxes[node, 1], boxes[node, 2]
        x1, y1, z1 = boxes[node, 3], boxes[node, 4], boxes[node, 5]
        if not _may_meet(packet, whole, x0, y0, z0, x1, y1, z1):
            continue
        if node < first_leaf:
            # The nearer child goes on top: boxes behind its hits are skipped.
            near = 2 * node + 1 + np.int64(boxes[2 * node + 2, 2] < boxes[2 * node + 1, 2])
            stack[top], stack[top + 1] = 4 * node + 3 - near, near
            top += 2
            continue
        start = LEAF * (node - first_leaf)
        for p in range(start, min(start + LEAF, tree.order.shape[0])):
            _test_triangle(tree.order[p], triangle_at(tree.corners, p), ray, best, packet, meets)
        _shorten(best, packet)


@formula
def _shorten(best, packet):
    """End packets at the deepest hit of their texels."""
    tile_far = -np.inf
    for sub in range(_SUBS * _SUBS):
        corner = (sub // _SUBS) * SUB * TILE + (sub % _SUBS) * SUB
        far = -np.inf
        for k in range(SUB * SUB):
            far = max(far, best[corner + (k // SUB) * TILE + k % SUB, 0])
        packet[9, sub] = far
        tile_far = max(tile_far, far)
    packet[9, _SUBS * _SUBS] = tile_far


@kernel(rows="lines", few=256)
def first_depths(begin, stop, lines, tree, z):
    """Write z of the first triangle that each of n lines hits, float64, infinity for none.

    lines: (n, 6), o_x, o_y, d_x, d_y and the z between which the line lies.
    """
    boxes = tree.boxes
    first_leaf = (boxes.shape[0] + 1) // 2 - 1
    stack, packet = np.empty(_STACK, np.int64), np.empty((10, 1))
    for k in range(begin, stop):
        ox, oy, dx, dy, near, best = lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3], lines[k, 4], lines[k, 5]
        packet[0:2, 0], packet[2:4, 0], packet[4:6, 0], packet[6:8, 0] = ox, dx, oy, dy
        packet[8, 0], packet[9, 0], z[k] = near, best, np.inf
        stack[0], top = 0, 1
        while top > 0 and near < lines[k, 5]:
            top -= 1
            node = stack[top]
            x0, y0, z0 = boxes[node, 0], boxes[node, 1], boxes[node, 2]
            x1, y1, z1 = boxes[node, 3], boxes[node, 4], boxes[node, 5]
            if not _may_meet(packet, 0, x0, y0, z0, x1, y1, z1):
                continue
            if node < first_leaf:
                stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
                top += 2
                continue
            start = LEAF * (node - first_leaf)
            for p in range(start, min(start + LEAF, tree.order.shape[0])):
                hit, at = hit_triangle(ox, oy, dx, dy, triangle_at(tree.corners, p))
                if hit and near < at < packet[9, 0]:
                    packet[9, 0], z[k] = at, at


@kernel(rows="proposal")
def first_hits(begin, stop, rays, width, height, tree, proposal, triangle, z, top=0):
    """Write the first triangle of every texel's ray: the smallest z, and of equal z the smallest number.

    proposal: (ceil(H / TILE), ceil(W / TILE)) int32, a triangle that is likely to be hit first in each tile, or -1; it
    saves time and changes nothing. triangle, z: (H, W) int32 and float64, -1 and the ray's end where there is no hit.
    top: the view's row that row 0 is.
    """
    for tile_row in range(begin, stop):
        ray, best = np.empty((TILE * TILE, 5)), np.empty((TILE * TILE, 2))
        packet = np.empty((10, _SUBS * _SUBS + 1))  # of the sub-tiles, then of the tile
        stack, meets = np.empty(_STACK, np.int64), np.empty(_SUBS * _SUBS, np.int64)
        for tile_column in range(proposal.shape[1]):
            i0, j0 = tile_column * TILE, tile_row * TILE
            tile = Tile(i0, top + j0, min(TILE, width - i0), min(TILE, height - j0))
            _start_tile(rays, tile, tree, proposal[tile_row, tile_column], ray, best, packet)
            _search_tile(tree, stack, ray, best, packet, meets)
            for j in range(tile.rows):
                for i in range(tile.columns):
                    z[j0 + j, i0 + i], triangle[j0 + j, i0 + i] = best[j * TILE + i, 0], np.int32(best[j * TILE + i, 1])
