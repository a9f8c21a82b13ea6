"""Textures as somebody's renderer stores them, turned into depth, world positions and world normals.

All in float64 and a written order, rounded once to float32; what is stored as it is wanted keeps its bits. Distances,
and reversed depth, which has their digits, become the depth of a linear view: screen space z would lose them.
"""

from collections.abc import Mapping

import numpy as np

from lfssao.ao.textures import Buffers
from lfssao.errors import InputError
from lfssao.gbuffer.kernels.surface import write_surface
from lfssao.optics.camera import linear_view
from lfssao.rendering.decoding import DISTANCES, Single, distances, normals_of, points_of, upright
from lfssao.rendering.fit import checked
from lfssao.rendering.view_file import Description


@np.errstate(all="ignore")  # what is not finite is refused
def buffers_of(textures: Mapping[str, Single], said: Description) -> Buffers:
    """The textures as estimators take them; what they hold is said, and must be of their size.

    Textures are 'depth' (H, W), 'positions' (H, W, 3), or left out and rebuilt on the texels' rays, and 'normals' (H,
    W, 3), or (H, W, 2) octahedral, float32. No surface: infinite depth, 1 of a window's kinds, 0 of 'reversed', 0 or
    from the far plane on of 'linear', 'view-z', 'radial' and 'logarithmic', ``Description.background``, or a value that
    more texels share than a surface has, which is noted (InputWarning). These kinds and 'reversed' make depth and view
    linear (``linear_view``). InputError if a number is not finite where there is a surface, or textures do not fit what
    is said of them, or each other; the sentence names what fits better.

    >>> from lfssao.optics.camera import Camera
    >>> seen = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9).view(4, 2)
    >>> buffers = buffers_of({"depth": np.full((2, 4), 4, np.float32)}, Description(seen, depth_kind="linear"))
    >>> buffers.positions[0, 0]
    array([-1.5,  0.5,  0. ], dtype=float32)
    >>> buffers.view.depth_kind
    'linear z: distance along the axis, world units, perspective'
    """
    said = checked(textures, said)
    view = said.view
    there = upright(textures, said)
    kind = said.depth_kind
    # Screen space z of an orthographic camera has the digits of its reversed depth.
    linear = kind in DISTANCES or (kind == "reversed" and not view.lens[6])
    if kind != "image" and view.linear != linear:
        view = linear_view(view, linear)
    stored = there["depth"]
    z = distances(stored, said)
    surface = np.isfinite(z)
    placed = there.get("positions")
    depth = np.empty_like(stored)
    positions = np.empty((*z.shape, 3), np.float32)
    write_surface(view.rays, np.ravel(view.world_from_cast), np.where(surface, 0, -1), z, depth, positions)
    if kind == "image":
        depth = np.where(surface, stored, np.float32(np.inf))
    if not np.isfinite(positions[surface]).all():
        raise InputError("positions: rebuilt from depth, they leave the range of float32")
    if placed is not None:
        positions[surface] = points_of(placed[surface], said)
    normals = None
    if "normals" in there:
        normals = normals_of(there["normals"], surface, said)
    return Buffers(view, np.ascontiguousarray(depth), positions, normals)
