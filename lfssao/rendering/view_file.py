"""The mapping world -> image of somebody's own renderer: a TOML file, or one of a folder that ``render`` wrote."""

from fractions import Fraction
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.core.affine import Matrix
from lfssao.errors import InputError, no_such
from lfssao.optics.display_file import parse_toml, read_text
from lfssao.optics.kernels.projection import DISPLAY, MATRIX
from lfssao.optics.view import KINDS, WorldToImage, finite_numbers
from lfssao.rendering.folder import load_manifest
from lfssao.rendering.manifest import MANIFEST


def read_mapping(path: Path, view: str) -> tuple[WorldToImage, Matrix | None]:
    """A mapping and, of a matrix, its inverse; InputError, with the file and the key, if a value is wrong.

    ``path`` is a folder that 'lfssao render' wrote, of which ``view`` is taken, or a TOML file: ``kind``, one of
    ``KINDS``, and the arguments of ``WorldToImage``'s method of that name; a matrix may have ``screen_to_world``, too.
    """
    if path.is_dir() or path.name == MANIFEST:
        return _of_view(path if path.is_dir() else path.parent, view)
    values = parse_toml(read_text(path), str(path))
    try:
        return _of_values(values)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _of_values(values: dict[str, Any]) -> tuple[WorldToImage, Matrix | None]:
    """The mapping that the values of a TOML file describe."""
    kind, back = values.pop("kind", None), None
    if kind not in KINDS:
        raise InputError(f"kind is {kind!r:.40}, it must be one of {', '.join(KINDS)}")
    if kind == KINDS[MATRIX] and "screen_to_world" in values:
        back = finite_numbers("screen_to_world", values.pop("screen_to_world"), 4, 4)
    make = getattr(WorldToImage, kind.replace(" ", "_"))
    parameters = signature(make).parameters
    for name in values:
        if name not in parameters:
            raise no_such("key", name, ("kind", *parameters, *["screen_to_world"] * (kind == KINDS[MATRIX])))
    for name, parameter in parameters.items():
        if parameter.default is Parameter.empty and name not in values:
            raise InputError(f"{name} is missing")
    mapping: WorldToImage = make(**values)
    return mapping, _inverse(mapping) if kind == KINDS[MATRIX] and back is None else back


def _of_view(folder: Path, name: str) -> tuple[WorldToImage, Matrix | None]:
    """The mapping of a view of a rendered folder, by the numbers of its manifest."""
    manifest = load_manifest(folder)
    try:
        views = {str(entry["name"]): entry["view"] for entry in manifest["views"]}
        if name not in views:
            raise no_such("view", name, views)
        described = views[name]
        kind, back = KINDS.index(described["world_to_image_kind"]), described["screen_to_world"]
        numbers = finite_numbers("world_to_image", described["world_to_image"], 44 if kind == DISPLAY else 16)
        back = None if back is None else finite_numbers("screen_to_world", back, 4, 4)
        return WorldToImage(kind, numbers), back
    except InputError as error:
        raise InputError(f"{folder}: {error}") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{folder / MANIFEST}: it is not what 'lfssao render' writes ({error!r:.80})") from error


def _inverse(mapping: WorldToImage) -> Matrix:
    """The inverse of a matrix by exact fractions, each entry rounded once, so that it is the same on every machine."""
    identity = np.eye(4, dtype=int).tolist()
    rows = [[*map(Fraction, m), *i] for m, i in zip(mapping.numbers.reshape(4, 4).tolist(), identity, strict=True)]
    for k in range(4):
        rows[k:] = sorted(rows[k:], key=lambda row: row[k] == 0)  # one that is not 0 there, if any, comes first
        if rows[k][k] == 0:
            raise InputError("M has no inverse")
        pivot = rows[k] = [entry / rows[k][k] for entry in rows[k]]
        rows = [r if r is pivot else [a - r[k] * b for a, b in zip(r, pivot, strict=True)] for r in rows]
    try:
        return np.array([[float(entry) for entry in row[4:]] for row in rows])
    except OverflowError:
        raise InputError("M has no inverse of finite numbers") from None
