"""Whether textures fit what is said of them, and each other, and what fits better."""

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

_ENOUGH = 0.9  # of the surface's texels must fit: silhouettes and half floats are off in some
_UNIT = 0.05  # by which a normal's length may be off 1
_NEAR = 0.01  # share of the distance by which positions and depth may differ
_STEEP = 30.0  # degrees between normals and surface, in the median, that no smooth or mapped normals explain
_SLIGHT = 0.5  # degrees that nothing is made of
_ALIKE = 2.0  # degrees by which descriptions that fit differ
_CONSTANTS = tuple(float(f"{digit}e{power}") for power in range(-3, 3) for digit in (1, 2, 5))

Textures = Mapping[str, Single]


def checked(textures: Textures, said: Description) -> Description:
    """The description with the value that the background was cleared to, if that is none of its kind, which is noted.

    InputError if textures do not fit what is said of them, or each other; the sentence names what fits.
    """
    there = upright(textures, said)
    value = cleared_value(there, said)
    cleared = replace(said, background=value) if value is not None else said
    fault = fault_of(textures, said)
    unfit = fault_of(textures, cleared)
    # A value that none of its kind has may be the background of another kind, if nothing else tells them apart.
    is_open = value is not None and abs(value) <= 1 and {"positions", "normals"}.isdisjoint(textures)
    if fault and (unfit or is_open):
        fits = _fitting(textures, said)
        if fits or unfit:
            raise InputError(f"{fault}{fits}" if fits else f"{unfit}{_fitting(textures, cleared)}")
    said = cleared
    if "normals" in there and (better := _better(textures, said)):
        raise InputError(better)
    doubts.warn(surface_or_sky(there, said, value), 4)
    return said


def _fitting(textures: Textures, said: Description) -> str:
    """The end of a sentence with the descriptions that fit; '' if none does."""
    found = [(other, words) for other, words in _others(textures, said) if not fault_of(textures, other)]
    if "normals" in textures and found:
        angles = [angle_to_normals(upright(textures, other), other)[0] for other, _ in found]
        found = [pair for pair, angle in zip(found, angles, strict=True) if angle <= min(angles) + _ALIKE]
    least = min((words.count("=") for _, words in found), default=0)
    fits = " or ".join(words for _, words in found if words.count("=") == least)
    return f": it fits with {fits}" if fits else ""


def _better(textures: Textures, said: Description) -> str:
    """A sentence on another description by which normals and depth agree better, or ''."""
    there = upright(textures, said)
    angle, count, smooth = angle_to_normals(there, said)
    if angle <= _SLIGHT or not smooth:  # planes that flatten grass make it fit
        return ""
    clearly = min(0.3 * angle, angle - 0.5)
    enough = max(min(0.8 * angle, angle - 1), clearly)
    found = [each for each in planes_that_fit(there, said) if each[0] <= clearly and each[1] >= 0.5 * count]
    for other, words in _others(textures, said, 1):
        least, texels, _ = angle_to_normals(upright(textures, other), other)
        if least <= enough and texels >= 0.5 * count and not fault_of(textures, other):
            found.append((least, texels, words))
    if not found:
        return ""
    least, _, words = min(found)
    off = f"normals: they are {angle:.2g} degrees off the surface of depth (median)"
    return f"{off}, and {least:.1f} by another reading: it fits with {words}"


def _others(textures: Textures, said: Description, most: int = 2) -> Iterator[tuple[Description, str]]:
    """Other descriptions that differ in one or two fields which these textures read, each with its difference."""
    tried = {"depth_kind": said.view.screen_to_world is not None, "rows": True}
    tried |= {"positions_space": "positions" in textures and said.eye is not None}
    tried |= {"normals_space": "normals" in textures and said.eye is not None, "normals_kind": "normals" in textures}
    names = [name for name in tried if tried[name]]
    for values in product(*(CHOICES[name] for name in names)):
        changes: dict[str, Any] = {n: v for n, v in zip(names, values, strict=True) if getattr(said, n) != v}
        possible = said.eye is not None or changes.get("depth_kind") != "view-z"
        possible &= "logarithmic" not in (changes.get("depth_kind"), said.depth_kind) or "depth_kind" in changes
        if "normals_kind" in changes:
            possible &= ("octahedral" in changes["normals_kind"]) == (textures["normals"].shape[2] == 2)
        if possible and 1 <= len(changes) <= most:
            yield from _changed(said, changes)
    if tried["depth_kind"] and said.depth_kind == "logarithmic":
        yield from _changed(said, {"depth_kind": "logarithmic"})


def _changed(said: Description, changes: dict[str, Any]) -> Iterator[tuple[Description, str]]:
    """A changed description, or of logarithmic depth those of the usual constants, and the words for its changes."""
    kind = changes.get("depth_kind", said.depth_kind)
    constants = (None,) if kind != "logarithmic" else _CONSTANTS if len(changes) == 1 else (said.depth_constant or 1.0,)
    for constant in constants:
        told = {**changes, **({} if constant is None else {"depth_constant": constant})}
        words = " and ".join(f"{n} = {v if n == 'depth_constant' else repr(v)}" for n, v in told.items()
                             if getattr(said, n) != v)  # fmt: skip
        with suppress(InputError):  # radial depth of an orthographic camera
            yield replace(said, **{"depth_constant": None, **told}), words


def fault_of(textures: Textures, said: Description) -> str:
    """A sentence on textures that do not fit what is said of them, or each other; '' if they do."""
    view = said.view
    there = upright(textures, said)
    z = distances(there["depth"], said)
    for j, i in np.argwhere(np.isnan(z))[:1]:
        planes = f" between planes at {view.lens[4]:g} and {view.lens[5]:g}" if view.screen_to_world is not None else ""
        stored = f"{there['depth'][j, i]:g} at column {i}, row {j} from above"
        return f"depth: {stored} is no depth of depth_kind = '{said.depth_kind}'{planes}"
    surface = np.isfinite(z)
    for name, texture in there.items():
        if not np.isfinite(texture[surface]).all():
            return f"{name}: a number is not finite where there is a surface"
    fault = beyond_far(there["depth"], z, said)
    if not fault and "positions" in there:
        fault = _fault_of_positions(there["positions"][surface], z, said)
    if not fault and "normals" in there:
        fault = _fault_of_normals(there["normals"][surface], surface, said)
        if not fault and (angle := angle_to_normals(there, said)).smooth and angle.degrees > _STEEP:
            fault = f"normals: they are {angle.degrees:.2g} degrees off the surface of depth (median)"
    return fault


def _fault_of_positions(stored: Single, z: Double, said: Description) -> str:
    """A sentence on positions, (n, 3) of the surface's texels, that are not those of the view and of z, or ''."""
    view = said.view
    surface = np.isfinite(z)
    points = points_of(stored, said)
    away = np.abs(view.world_to_image(points)[:, :2] - (np.argwhere(surface)[:, ::-1] + 0.5))
    landing = _share(np.maximum(away[:, 0], away[:, 1]) < 1)
    if landing < _ENOUGH:
        return f"positions: {100 * landing:.3g} % of them land on their own texels in the view"
    along = transform_points(view.cast_from_world, points)[:, 2]
    size = np.abs(z[surface])
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
