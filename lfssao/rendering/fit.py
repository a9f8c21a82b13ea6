"""Whether textures fit what is said of them, and each other, and what fits better."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import transform_points
from lfssao.optics.kernels.rays import write_directions
from lfssao.rendering.decoding import Double, Single, decoded, directions_of, distances, lengths, points_of, upright
from lfssao.rendering.view_file import CHOICES, Description

_ENOUGH = 0.9  # of the surface's texels must fit: silhouettes and half floats are off in some
_UNIT = 0.05  # by which a normal's length may be off 1
_NEAR = 0.01  # share of the distance by which positions and depth may differ


def others(textures: Mapping[str, Single], said: Description) -> Iterator[tuple[Description, str]]:
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


def fault_of(textures: Mapping[str, Single], said: Description) -> str:
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
    view, surface, points = said.view, np.isfinite(z), points_of(stored, said)
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
    whole = _share(np.abs(lengths(decoded(stored, said.normals_kind)) - 1) < _UNIT)
    if whole < _ENOUGH:
        return f"normals: {100 * whole:.3g} % of them are of length 1"
    x, y, z = (directions_of(stored, said) * directions[surface]).T
    facing = _share((x + y) + z < 0)
    return "" if facing >= _ENOUGH else f"normals: {100 * facing:.3g} % of them face the viewer"


def _share(flags: NDArray[np.bool_]) -> float:
    """Share of those that are true; 1 of none."""
    return float(flags.mean()) if flags.size else 1.0


def agreement(normals: Single, positions: Single) -> float:
    """Mean cosine of normals and those of the triangles between neighbours' positions, which all face one way."""
    p, n = positions.astype(np.float64), normals[:-1, :-1].astype(np.float64)
    with np.errstate(invalid="ignore"):  # infinite where there is no surface
        faces = np.cross(p[:-1, 1:] - p[:-1, :-1], p[1:, :-1] - p[:-1, :-1]).reshape(-1, 3)
        cosines = (faces * n.reshape(-1, 3)).sum(axis=1) / lengths(faces)
    known = cosines[np.isfinite(cosines)]
    return abs(float(known.mean())) if known.size else 0.0
