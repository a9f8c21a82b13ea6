"""Numbers of textures as somebody's renderer stores them: z of cast space, world points and unit normals, float64."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import invert_affine, multiply, transform_points
from lfssao.rendering.view_file import Description

Single = NDArray[np.float32]
Double = NDArray[np.float64]

_EDGE = 1e-3  # share of the near plane's distance by which halves may lie before it


def upright(textures: Mapping[str, Single], said: Description) -> dict[str, Single]:
    """The textures, row 0 above."""
    return {name: texture[:: -1 if said.rows == "below" else 1] for name, texture in textures.items()}


def distances(depth: Single, said: Description) -> Double:
    """Cast space z of a depth texture: infinite where there is no surface, NaN where a number is no depth."""
    view, kind = said.view, said.depth_kind
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        d = depth.astype(np.float64)
    if view.screen_to_world is None:
        return np.where(d == -np.inf, np.nan, d)
    if kind == "image" and view.linear:
        return np.where(d > 0, d, np.nan)
    near, far, orthographic = view.lens[4:7].tolist()
    with np.errstate(all="ignore"):
        if kind in ("linear", "view-z"):
            forward = view.cast_from_world[2:, :3]
            z = d if said.eye is None or kind == "linear" else d * np.sign(multiply(forward, said.eye[2:, :3].T))
            z = np.where((z == 0) | (z >= far * (1 - 2.0**-22)), np.inf, z)
            return np.where(z >= near * (1 - _EDGE), z, np.nan)
        share = 0.5 * d + 0.5 if kind == "window-gl" else 1 - d if kind == "reversed" else d
        z = near + share * (far - near) if orthographic else near / (1 - share * (1 - near / far))
    background = np.isposinf(d) | ((share == 1) & (kind != "image"))
    return np.where(background, np.inf, np.where((share > 0) & (share < 1), z, np.nan))


def points_of(stored: Single, said: Description) -> Double:
    """World coordinates of positions, (n, 3)."""
    points = stored.astype(np.float64)
    if said.eye is None or said.positions_space == "world":
        return points
    return transform_points(invert_affine(said.eye), points)


def normals_of(stored: Single, surface: NDArray[np.bool_], said: Description) -> Single:
    """The normals texture, (H, W, 3): 0 where there is no surface."""
    normals = np.zeros((*surface.shape, 3), np.float32)
    normals[surface] = directions_of(stored[surface], said)
    return normals


def directions_of(stored: Single, said: Description) -> Double:
    """Unit normals in world space, (n, 3); those that are stored as they are wanted stay what they are."""
    n = decoded(stored, said.normals_kind)
    if said.eye is not None and said.normals_space == "view":
        return units(multiply(n, invert_affine(said.eye)[:, :3].T))
    return n if said.normals_kind == "xyz" else units(n)


def decoded(stored: Single, kind: str) -> Double:
    """Normals as three numbers; of octahedral ones the lower half is folded over the upper one's corners."""
    n = stored.astype(np.float64)
    n = 2 * n - 1 if kind.endswith("unorm") else n
    if not kind.startswith("octahedral"):
        return n
    x, y = n[:, 0], n[:, 1]
    z = (1 - np.abs(x)) - np.abs(y)
    fold = np.maximum(-z, 0)
    return units(np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=-1))


def units(n: Double) -> Double:
    """Vectors, (n, 3), of length 1."""
    return n / np.maximum(lengths(n), np.finfo(np.float64).tiny)[:, None]


def lengths(n: Double) -> Double:
    """Lengths, (n,), of vectors, (n, 3)."""
    x, y, z = n.T
    return np.asarray(np.sqrt((x * x + y * y) + z * z))
