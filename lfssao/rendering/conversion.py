"""Textures as somebody's renderer stores them, turned into depth, world positions and world normals.

All in float64 and a written order, rounded once to float32; what is stored as it is wanted keeps its bits. Distances,
and reversed depth, which has their digits, become the depth of a linear view: screen space z would lose them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import Buffers
from lfssao.core.affine import invert_affine, multiply, transform_points
from lfssao.errors import InputError
from lfssao.gbuffer.kernels.surface import write_surface
from lfssao.optics.camera import linear_view
from lfssao.optics.kernels.rays import write_directions
from lfssao.rendering.view_file import CHOICES, Description

Single = NDArray[np.float32]
Double = NDArray[np.float64]

_ENOUGH = 0.9  # of the surface's texels must fit: silhouettes and half floats are off in some
_UNIT = 0.05  # by which a normal's length may be off 1
_NEAR = 0.01  # share of the distance by which positions and depth may differ
_BETTER = 0.05  # by which the cosine of normals and surface must be greater for a space to be told
_EDGE = 1e-3  # share of the near plane's distance by which halves may lie before it


def buffers_of(textures: Mapping[str, Single], said: Description) -> Buffers:
    """The textures as estimators take them; what they hold is said, and must be of their size.

    Textures are 'depth' (H, W), 'positions' (H, W, 3), or left out and rebuilt on the texels' rays, and 'normals' (H,
    W, 3), or (H, W, 2) octahedral, float32. No surface: infinite depth, 1 of a window's kinds, 0 of 'reversed', 0 or
    from the far plane on of 'linear' and 'view-z'. These and 'reversed' make depth and view linear (``linear_view``).
    InputError if a number is not finite where there is a surface, or textures do not fit what is said of them, or each
    other; the sentence names what fits better.

    >>> from lfssao.optics.camera import Camera
    >>> seen = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9).view(4, 2)
    >>> buffers = buffers_of({"depth": np.full((2, 4), 4, np.float32)}, Description(seen, depth_kind="linear"))
    >>> buffers.positions[0, 0]
    array([-1.5,  0.5,  0. ], dtype=float32)
    >>> buffers.view.depth_kind
    'linear z: distance along the axis, world units, perspective'
    """
    fault = _fault(textures, said)
    if fault:
        better = [words for other, words in _others(textures, said) if not _fault(textures, other)]
        least = min((words.count("=") for words in better), default=0)
        fits = " or ".join(words for words in better if words.count("=") == least)
        raise InputError(f"{fault}{': it fits with ' if fits else ''}{fits}")
    view, there, kind = said.view, upright(textures, said), said.depth_kind
    # Screen space z of an orthographic camera has the digits of its reversed depth.
    linear = kind in ("linear", "view-z") or (kind == "reversed" and not view.lens[6])
    if kind != "image" and view.linear != linear:
        view = linear_view(view, linear)
    stored = there["depth"]
    z = distances(stored, said)
    surface, placed = np.isfinite(z), there.get("positions")
    depth, positions = np.empty_like(stored), np.empty((*z.shape, 3), np.float32)
    write_surface(view.rays, np.ravel(view.world_from_cast), np.where(surface, 0, -1), z, depth, positions)
    if kind == "image":
        depth = stored
    if placed is not None:
        positions[surface] = _points(placed[surface], said)
    normals = None
    if "normals" in there:
        normals = _normals(there["normals"], surface, said)
        if said.eye is not None:
            (other,) = (space for space in CHOICES["normals_space"] if space != said.normals_space)
            turned = _normals(there["normals"], surface, replace(said, normals_space=other))
            if _agreement(turned, positions) > _agreement(normals, positions) + _BETTER:
                raise InputError(f"normals: they fit the surface better by normals_space = '{other}'")
    return Buffers(view, np.ascontiguousarray(depth), positions, normals)


def _others(textures: Mapping[str, Single], said: Description) -> Iterator[tuple[Description, str]]:
    """Other descriptions that differ in one or two fields which these textures read, each with its difference."""
    tried = {"depth_kind": said.view.screen_to_world is not None, "rows": True}
    tried |= {"positions_space": "positions" in textures and said.eye is not None}
    tried |= {"normals_space": "normals" in textures and said.eye is not None, "normals_kind": "normals" in textures}
    names = [name for name in tried if tried[name]]
    for values in product(*(CHOICES[name] for name in names)):
        changes: dict[str, Any] = {n: v for n, v in zip(names, values, strict=True) if getattr(said, n) != v}
        possible = said.eye is not None or changes.get("depth_kind") != "view-z"
        if "normals_kind" in changes:
            possible &= ("octahedral" in changes["normals_kind"]) == (textures["normals"].shape[2] == 2)
        if possible and 1 <= len(changes) <= 2:
            yield replace(said, **changes), " and ".join(f"{n} = '{v}'" for n, v in changes.items())


def upright(textures: Mapping[str, Single], said: Description) -> dict[str, Single]:
    """The textures, row 0 above."""
    return {name: texture[:: -1 if said.rows == "below" else 1] for name, texture in textures.items()}


def _fault(textures: Mapping[str, Single], said: Description) -> str:
    """A sentence on textures that do not fit what is said of them, or each other; '' if they do."""
    view, there = said.view, upright(textures, said)
    z = distances(there["depth"], said)
    for j, i in np.argwhere(np.isnan(z))[:1]:
        planes = f" between planes at {view.lens[4]:g} and {view.lens[5]:g}" if view.screen_to_world is not None else ""
        stored = f"{there['depth'][j, i]:g} at column {i}, row {j} from above"
        return f"depth: {stored} is no depth of depth_kind = '{said.depth_kind}'{planes}"
    surface = np.isfinite(z)
    for name, texture in there.items():
        if not np.isfinite(texture[surface]).all():
            return f"{name}: a number is not finite where there is a surface"
    fault = _fault_of_positions(there["positions"][surface], z, said) if "positions" in there else ""
    return fault or (_fault_of_normals(there["normals"][surface], surface, said) if "normals" in there else "")


def _fault_of_positions(stored: Single, z: Double, said: Description) -> str:
    """A sentence on positions, (n, 3) of the surface's texels, that are not those of the view and of z, or ''."""
    view, surface, points = said.view, np.isfinite(z), _points(stored, said)
    away = np.abs(view.world_to_image(points)[:, :2] - (np.argwhere(surface)[:, ::-1] + 0.5))
    landing = _share(np.maximum(away[:, 0], away[:, 1]) < 1)
    if landing < _ENOUGH:
        return f"positions: {100 * landing:.3g} % of them land on their own texels in the view"
    along, size = transform_points(view.cast_from_world, points)[:, 2], np.abs(z[surface])
    size = size if view.screen_to_world is not None else size.max(initial=0)
    agreeing = _share(np.abs(along - z[surface]) <= _NEAR * size)
    return "" if agreeing >= _ENOUGH else f"depth: {100 * agreeing:.3g} % of it is that of the positions"


def _fault_of_normals(stored: Single, surface: NDArray[np.bool_], said: Description) -> str:
    """A sentence on normals, (n, 3) or (n, 2) of the surface's texels, that are no units or face away, or ''."""
    directions = np.empty((*surface.shape, 3))
    write_directions(said.view.rays, np.ravel(said.view.world_from_cast), directions)
    whole = _share(np.abs(_lengths(_decoded(stored, said.normals_kind)) - 1) < _UNIT)
    if whole < _ENOUGH:
        return f"normals: {100 * whole:.3g} % of them are of length 1"
    x, y, z = (_directions(stored, said) * directions[surface]).T
    facing = _share((x + y) + z < 0)
    return "" if facing >= _ENOUGH else f"normals: {100 * facing:.3g} % of them face the viewer"


def _share(flags: NDArray[np.bool_]) -> float:
    """Share of those that are true; 1 of none."""
    return float(flags.mean()) if flags.size else 1.0


def _agreement(normals: Single, positions: Single) -> float:
    """Mean cosine of normals and those of the triangles between neighbours' positions, which all face one way."""
    p, n = positions.astype(np.float64), normals[:-1, :-1].astype(np.float64)
    with np.errstate(invalid="ignore"):  # infinite where there is no surface
        faces = np.cross(p[:-1, 1:] - p[:-1, :-1], p[1:, :-1] - p[:-1, :-1]).reshape(-1, 3)
        cosines = (faces * n.reshape(-1, 3)).sum(axis=1) / _lengths(faces)
    known = cosines[np.isfinite(cosines)]
    return abs(float(known.mean())) if known.size else 0.0


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


def _points(stored: Single, said: Description) -> Double:
    """World coordinates of positions, (n, 3)."""
    points = stored.astype(np.float64)
    if said.eye is None or said.positions_space == "world":
        return points
    return transform_points(invert_affine(said.eye), points)


def _normals(stored: Single, surface: NDArray[np.bool_], said: Description) -> Single:
    """The normals texture, (H, W, 3): 0 where there is no surface."""
    normals = np.zeros((*surface.shape, 3), np.float32)
    normals[surface] = _directions(stored[surface], said)
    return normals


def _directions(stored: Single, said: Description) -> Double:
    """Unit normals in world space, (n, 3); those that are stored as they are wanted stay what they are."""
    n = _decoded(stored, said.normals_kind)
    if said.eye is not None and said.normals_space == "view":
        return _units(multiply(n, invert_affine(said.eye)[:, :3].T))
    return n if said.normals_kind == "xyz" else _units(n)


def _decoded(stored: Single, kind: str) -> Double:
    """Normals as three numbers; of octahedral ones the lower half is folded over the upper one's corners."""
    n = stored.astype(np.float64)
    n = 2 * n - 1 if kind.endswith("unorm") else n
    if not kind.startswith("octahedral"):
        return n
    x, y = n[:, 0], n[:, 1]
    z = (1 - np.abs(x)) - np.abs(y)
    fold = np.maximum(-z, 0)
    return _units(np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=-1))


def _units(n: Double) -> Double:
    return n / np.maximum(_lengths(n), np.finfo(np.float64).tiny)[:, None]


def _lengths(n: Double) -> Double:
    x, y, z = n.T
    return np.asarray(np.sqrt((x * x + y * y) + z * z))
