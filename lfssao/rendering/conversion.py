"""Conversion of another renderer's textures to depth, world positions and world normals.

The arithmetic is float64 in a written order, rounded once to float32. A texture that needs no conversion keeps its
bits. Distances and reversed depth become the depth of a linear view: screen space z would lose their digits.
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
def buffers_of(textures: Mapping[str, Single], description: Description) -> Buffers:
    """Return the textures as estimators take them; the description must be of their size.

    Textures are 'depth' (H, W), 'positions' (H, W, 3), or left out and rebuilt on the texels' rays, and 'normals' (H,
    W, 3), or (H, W, 2) octahedral, float32. No surface: infinite depth, 1 of a window's kinds, 0 of 'reversed', 0 or
    from the far plane on of 'linear', 'view-z', 'radial' and 'logarithmic', ``Description.background``, or a value that
    more texels share than a surface has, which is noted (InputWarning). These kinds and 'reversed' make depth and view
    linear (``linear_view``). InputError if a number is not finite where there is a surface, or textures do not fit
    their description, or each other; the sentence names a description that fits better.

    >>> from lfssao.optics.camera import Camera
    >>> seen = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9).view(4, 2)
    >>> buffers = buffers_of({"depth": np.full((2, 4), 4, np.float32)}, Description(seen, depth_kind="linear"))
    >>> buffers.positions[0, 0]
    array([-1.5,  0.5,  0. ], dtype=float32)
    >>> buffers.view.depth_kind
    'linear z: distance along the axis, world units, perspective'
    """
    description = checked(textures, description)
    view = description.view
    from_above = upright(textures, description)
    kind = description.depth_kind
    # Screen space z of an orthographic camera has the digits of its reversed depth.
    linear = kind in DISTANCES or (kind == "reversed" and not view.lens[6])
    if kind != "image" and view.linear != linear:
        view = linear_view(view, linear)
    stored = from_above["depth"]
    z = distances(stored, description)
    surface = np.isfinite(z)
    placed = from_above.get("positions")
    depth = np.empty_like(stored)
    positions = np.empty((*z.shape, 3), np.float32)
    write_surface(view.rays, np.ravel(view.world_from_cast), np.where(surface, 0, -1), z, depth, positions)
    if kind == "image":
        depth = np.where(surface, stored, np.float32(np.inf))
    if not np.isfinite(positions[surface]).all():
        raise InputError("positions: rebuilt from depth, they leave the range of float32")
    if placed is not None:
        positions[surface] = points_of(placed[surface], description)
    normals = None
    if "normals" in from_above:
        normals = normals_of(from_above["normals"], surface, description)
    return Buffers(view, np.ascontiguousarray(depth), positions, normals)
