"""Decoding of another renderer's textures: z of cast space, world points and unit normals, float64."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import invert_affine, multiply, transform_points
from lfssao.optics.kernels.projection import CROSSED_SLITS
from lfssao.optics.view import View
from lfssao.rendering.kernels.depth import write_logarithmic
from lfssao.rendering.view_file import Description

Single = NDArray[np.float32]
Double = NDArray[np.float64]
Texels = NDArray[np.intp] | None

DISTANCES = ("linear", "view-z", "radial", "logarithmic")  # kinds of depth whose background is 0 or at the far plane

_EDGE = 1e-3  # largest distance of halves before the near plane, in distances of that plane


def upright(textures: Mapping[str, Single], description: Description) -> dict[str, Single]:
    """Return the textures with row 0 above."""
    return {name: texture[:: -1 if description.rows == "below" else 1] for name, texture in textures.items()}


def distances(depth: Single, description: Description, rows: Texels = None, columns: Texels = None) -> Double:
    """Return cast space z of a depth texture: infinite without a surface, NaN where a number is no depth.

    ``depth`` may be some texels, (n, m), of ``rows`` and ``columns`` in the whole texture, row 0 above.
    """
    view = description.view
    kind = description.depth_kind
    with np.errstate(invalid="ignore", over="ignore"):  # of a NaN that signals, and a value that no texture has
        d = depth.astype(np.float64)
        if description.background is not None:
            d = np.where(depth == np.float32(description.background), np.inf, d)
    if view.screen_to_world is None:
        low, high = _reach(view)
        return np.where((d > low) & (d < high) | (d == np.inf), d, np.nan)
    if kind == "image" and view.linear:
        return np.where(d > 0, d, np.nan)
    near, far, orthographic = view.lens[4:7].tolist()
    if kind in DISTANCES:
        z = along_axis(d, description, rows, columns)
        none = (z == 0) | (z >= far * (1 - 2.0**-22)) | np.isinf(d)
        return np.where(none, np.inf, np.where(z >= near - _EDGE * abs(near), z, np.nan))
    with np.errstate(all="ignore"):
        share = 0.5 * d + 0.5 if kind == "window-gl" else 1 - d if kind == "reversed" else d
        z = near + share * (far - near) if orthographic else near / (1 - share * (1 - near / far))
    background = np.isposinf(d) | ((share == 1) & (kind != "image"))
    inside = (share > 0) | ((share == 0) & (description.depth_bits is not None))  # codes are clamped to the planes
    return np.where(background, np.inf, np.where(inside & (share < 1), z, np.nan))


def along_axis(d: Double, description: Description, rows: Texels = None, columns: Texels = None) -> Double:
    """Return cast space z of a kind among ``DISTANCES``, beyond the far plane too; arguments as of ``distances``."""
    view = description.view
    kind = description.depth_kind
    if kind == "view-z" and description.eye is not None:
        return np.asarray(d * np.sign(multiply(view.cast_from_world[2:, :3], description.eye[2:, :3].T)))
    if kind == "radial":
        f_u, f_v, c_u, c_v = view.lens[:4].tolist()
        i = np.arange(view.width)[None] if columns is None else columns
        j = np.arange(view.height)[:, None] if rows is None else rows
        x = (i + 0.5 - c_u) / f_u
        y = (c_v - (j + 0.5)) / f_v
        return np.asarray(d / np.sqrt((x * x + y * y) + 1.0))
    if kind == "logarithmic":
        z = np.empty_like(d)
        write_logarithmic(d, description.depth_constant, float(view.lens[5]), z)
        return z
    return d


def _reach(view: View) -> tuple[float, float]:
    """Return physical z of a module's observers, or of the far side of their circle, and of its lens."""
    if view.world_to_image.kind == CROSSED_SLITS:
        return float(view.lens[3]), float(view.lens[1])
    z_o = float(view.lens[4])
    curvature = abs(float(view.lens[6]))
    return z_o - 2 / curvature if curvature else z_o, float(view.lens[2])


def points_of(stored: Single, description: Description) -> Double:
    """Return world coordinates of stored positions, (n, 3)."""
    points = stored.astype(np.float64)
    if description.eye is None or description.positions_space == "world":
        return points
    return transform_points(invert_affine(description.eye), points)


def normals_of(stored: Single, surface: NDArray[np.bool_], description: Description) -> Single:
    """Return the normals texture, (H, W, 3), 0 where there is no surface."""
    normals = np.zeros((*surface.shape, 3), np.float32)
    normals[surface] = directions_of(stored[surface], description)
    return normals


def directions_of(stored: Single, description: Description) -> Double:
    """Return unit normals in world space, (n, 3); those that are stored so keep their bits."""
    n = decoded(stored, description.normals_kind)
    if description.eye is not None and description.normals_space == "view":
        return units(multiply(n, invert_affine(description.eye)[:, :3].T))
    return n if description.normals_kind == "xyz" else units(n)


def decoded(stored: Single, kind: str) -> Double:
    """Return normals as three numbers; octahedral ones have the lower half folded over the upper one's corners."""
    n = stored.astype(np.float64)
    n = 2 * n - 1 if kind.endswith("unorm") else n
    if not kind.startswith("octahedral"):
        return n
    x = n[:, 0]
    y = n[:, 1]
    z = (1 - np.abs(x)) - np.abs(y)
    fold = np.maximum(-z, 0)
    return units(np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=-1))


def units(n: Double) -> Double:
    """Return vectors, (n, 3), scaled to length 1."""
    return n / np.maximum(lengths(n), np.finfo(np.float64).tiny)[:, None]


def lengths(n: Double) -> Double:
    """Return lengths, (n,), of vectors, (n, 3)."""
    x, y, z = n.T
    return np.asarray(np.sqrt((x * x + y * y) + z * z))
