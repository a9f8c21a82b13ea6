"""Checks whether textures fit their description and each other, and a search for one that fits better."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import transform_points
from lfssao.errors import InputError
from lfssao.optics.kernels.rays import write_directions
from lfssao.rendering import doubts
from lfssao.rendering.cleared import beyond_far, cleared_value, surface_or_sky
from lfssao.rendering.decoding import Double, Single, decoded, directions_of, distances, lengths, points_of, upright
from lfssao.rendering.slopes import angle_to_normals, planes_that_fit
from lfssao.rendering.view_file import CHOICES, Description

_ENOUGH = 0.9  # share of the surface's texels that must fit: silhouettes and half floats may be off
_UNIT = 0.05  # largest difference of a normal's length from 1
_NEAR = 0.01  # largest difference of positions and depth, relative to the distance
_STEEP = 30.0  # degrees between normals and surface, median; no smooth or mapped normals reach them
_SLIGHT = 0.5  # degrees between normals and surface, median, that are no fault
_ALIKE = 2.0  # degrees; descriptions that fit differ by no more
_CONSTANTS = tuple(float(f"{digit}e{power}") for power in range(-3, 3) for digit in (1, 2, 5))

Textures = Mapping[str, Single]


def checked(textures: Textures, description: Description) -> Description:
    """Return the description, with the cleared value of the background where that is not one of its kind.

    An InputWarning names such a value. InputError if textures do not fit their description, or each other; the sentence
    names a description that fits.
    """
    from_above = upright(textures, description)
    value = cleared_value(from_above, description)
    cleared = replace(description, background=value) if value is not None else description
    fault = fault_of(textures, description)
    unfit = fault_of(textures, cleared)
    # Depth alone does not tell a cleared value from the background of another kind.
    is_open = value is not None and abs(value) <= 1 and {"positions", "normals"}.isdisjoint(textures)
    if fault and (unfit or is_open):
        fits = _fitting(textures, description)
        if fits or unfit:
            raise InputError(f"{fault}{fits}" if fits else f"{unfit}{_fitting(textures, cleared)}")
    description = cleared
    if "normals" in from_above and (better := _better(textures, description)):
        raise InputError(better)
    doubts.warn(surface_or_sky(from_above, description, value), 4)
    return description


def _fitting(textures: Textures, description: Description) -> str:
    """Return the end of a sentence with the descriptions that fit; '' if none does."""
    found = [(other, words) for other, words in _others(textures, description) if not fault_of(textures, other)]
    if "normals" in textures and found:
        angles = [angle_to_normals(upright(textures, other), other)[0] for other, _ in found]
        is_log = [other.depth_kind == "logarithmic" for other, _ in found]
        # Constants that are near 0 are much alike, so the best one alone is named.
        least_log = min((angle for angle, log in zip(angles, is_log, strict=True) if log), default=0.0)
        limits = [min(angles) + _ALIKE if not log else min(least_log, min(angles) + _ALIKE) for log in is_log]
        found = [pair for pair, angle, limit in zip(found, angles, limits, strict=True) if angle <= limit]
    least = min((words.count("=") for _, words in found), default=0)
    fits = " or ".join(words for _, words in found if words.count("=") == least)
    return f": it fits with {fits}" if fits else ""


def _better(textures: Textures, description: Description) -> str:
    """Return a sentence on another description by which normals and depth agree better, or ''."""
    from_above = upright(textures, description)
    angle, count, smooth = angle_to_normals(from_above, description)
    if angle <= _SLIGHT or not smooth:  # planes that flatten grass make it fit
        return ""
    clearly = min(0.3 * angle, angle - 0.5)
    enough = max(min(0.8 * angle, angle - 1), clearly)
    found = [each for each in planes_that_fit(from_above, description) if each[0] <= clearly and each[1] >= 0.5 * count]
    for other, words in _others(textures, description, 1):
        least, texels, _ = angle_to_normals(upright(textures, other), other)
        if least <= enough and texels >= 0.5 * count and not fault_of(textures, other):
            found.append((least, texels, words))
    if not found:
        return ""
    least, _, words = min(found)
    off = f"normals: they are {angle:.2g} degrees off the surface of depth (median)"
    return f"{off}, and {least:.1f} by another reading: it fits with {words}"


def _others(textures: Textures, description: Description, most: int = 2) -> Iterator[tuple[Description, str]]:
    """Yield descriptions that differ in one or two fields that matter to these textures, each with its difference."""
    tried = {"depth_kind": description.view.screen_to_world is not None, "rows": True}
    tried |= {"positions_space": "positions" in textures and description.eye is not None}
    tried |= {
        "normals_space": "normals" in textures and description.eye is not None,
        "normals_kind": "normals" in textures,
    }
    names = [name for name in tried if tried[name]]
    for values in product(*(CHOICES[name] for name in names)):
        changes: dict[str, Any] = {n: v for n, v in zip(names, values, strict=True) if getattr(description, n) != v}
        possible = description.eye is not None or changes.get("depth_kind") != "view-z"
        possible &= "logarithmic" not in (changes.get("depth_kind"), description.depth_kind) or "depth_kind" in changes
        if "normals_kind" in changes:
            possible &= ("octahedral" in changes["normals_kind"]) == (textures["normals"].shape[2] == 2)
        if possible and 1 <= len(changes) <= most:
            yield from _changed(description, changes)
    if tried["depth_kind"] and description.depth_kind == "logarithmic":
        yield from _changed(description, {"depth_kind": "logarithmic"})


def _changed(description: Description, changes: dict[str, Any]) -> Iterator[tuple[Description, str]]:
    """Yield a changed description and the words for its changes; logarithmic depth has one for each usual constant."""
    kind = changes.get("depth_kind", description.depth_kind)
    constants = (
        (None,) if kind != "logarithmic" else _CONSTANTS if len(changes) == 1 else (description.depth_constant or 1.0,)
    )
    for constant in constants:
        fields = {**changes, **({} if constant is None else {"depth_constant": constant})}
        words = " and ".join(f"{n} = {v if n == 'depth_constant' else repr(v)}" for n, v in fields.items()
                             if getattr(description, n) != v)  # fmt: skip
        with suppress(InputError):  # radial depth of an orthographic camera
            yield replace(description, **{"depth_constant": None, **fields}), words


def fault_of(textures: Textures, description: Description) -> str:
    """Return a sentence on textures that do not fit their description, or each other; '' if they fit."""
    view = description.view
    from_above = upright(textures, description)
    z = distances(from_above["depth"], description)
    for j, i in np.argwhere(np.isnan(z))[:1]:
        planes = f" between planes at {view.lens[4]:g} and {view.lens[5]:g}" if view.screen_to_world is not None else ""
        stored = f"{from_above['depth'][j, i]:g} at column {i}, row {j} from above"
        return f"depth: {stored} is no depth of depth_kind = '{description.depth_kind}'{planes}"
    surface = np.isfinite(z)
    for name, texture in from_above.items():
        if not np.isfinite(texture[surface]).all():
            return f"{name}: a number is not finite where there is a surface"
    fault = beyond_far(from_above["depth"], z, description)
    if not fault and "positions" in from_above:
        fault = _fault_of_positions(from_above["positions"][surface], z, description)
    if not fault and "normals" in from_above:
        fault = _fault_of_normals(from_above["normals"][surface], surface, description)
        if not fault and (angle := angle_to_normals(from_above, description)).smooth and angle.degrees > _STEEP:
            fault = f"normals: they are {angle.degrees:.2g} degrees off the surface of depth (median)"
    return fault


def _fault_of_positions(stored: Single, z: Double, description: Description) -> str:
    """Return a sentence on positions, (n, 3) of the surface's texels, that view and z do not have, or ''."""
    view = description.view
    surface = np.isfinite(z)
    points = points_of(stored, description)
    away = np.abs(view.world_to_image(points)[:, :2] - (np.argwhere(surface)[:, ::-1] + 0.5))
    landing = _share(np.maximum(away[:, 0], away[:, 1]) < 1)
    if landing < _ENOUGH:
        return f"positions: {100 * landing:.3g} % of them land on their own texels in the view"
    along = transform_points(view.cast_from_world, points)[:, 2]
    size = np.abs(z[surface])
    size = size if view.screen_to_world is not None else size.max(initial=0)
    agreeing = _share(np.abs(along - z[surface]) <= _NEAR * size)
    return "" if agreeing >= _ENOUGH else f"depth: {100 * agreeing:.3g} % of it is that of the positions"


def _fault_of_normals(stored: Single, surface: NDArray[np.bool_], description: Description) -> str:
    """Return a sentence on normals, (n, 3) or (n, 2), that are no unit vectors or face away, or ''."""
    directions = np.empty((*surface.shape, 3))
    write_directions(description.view.rays, np.ravel(description.view.world_from_cast), directions)
    whole = _share(np.abs(lengths(decoded(stored, description.normals_kind)) - 1) < _UNIT)
    if whole < _ENOUGH:
        return f"normals: {100 * whole:.3g} % of them are of length 1"
    x, y, z = (directions_of(stored, description) * directions[surface]).T
    facing = _share((x + y) + z < 0)
    return "" if facing >= _ENOUGH else f"normals: {100 * facing:.3g} % of them face the viewer"


def _share(flags: NDArray[np.bool_]) -> float:
    """Return the share of flags that are true; 1 if there are none."""
    return float(flags.mean()) if flags.size else 1.0
