"""A rendered view as a case, from its manifest."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.registry import ESTIMATORS, check_samples, find_estimator, full_parameters
from lfssao.ao.post import MAX_SIGMA, Light
from lfssao.errors import InputError, errors_of
from lfssao.optics.view import KINDS, View
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.manifest import NOISE, view_of
from lfssao.samples.noise_file import read_noise
from lfssao.samples.rotation import check_rotation, noise_turns
from lfssao.verify.case import VIEW, Case


def view_case(path: Path, manifest: Mapping[str, Any], entry: Mapping[str, Any]) -> Case:
    """The case of a view, without outputs, from its manifest and its entry; InputError if they are incomplete."""
    with reading_manifest(path), errors_of(f"{path}: its manifest"):
        parameters = _parameters(manifest["settings"], entry["view"])
        if parameters["estimator"] == "lf-neighbours":
            parameters["neighbours"] = _neighbours(manifest["settings"], entry)
        parameters["colored"] = bool(manifest.get("scene", {}).get("colored", False))
        tables: dict[str, NDArray[Any]] = {**_tables(manifest["settings"], parameters)}
        file = NOISE.get(manifest["settings"].get("rotation", "none"))
        if file is not None:
            size = (entry["view"]["height"], entry["view"]["width"])
            noise = read_noise(path / file, False)
            tables["turns"] = noise_turns(noise, *size, np.dtype(np.float32))
        return Case("", VIEW, "", parameters, tables, {})


def _parameters(settings: Mapping[str, Any], view: Mapping[str, Any]) -> dict[str, Any]:
    if settings["merge"] != "maximum":
        raise ValueError("merge is not the maximum")
    sigma = float(settings["blur_sigma"])
    described = view_of("", view)
    if not 0 <= sigma <= MAX_SIGMA:
        raise ValueError("blur_sigma is out of range")
    rotation = settings.get("rotation", "none")  # early versions had no rotation
    rotation = "none" if rotation in NOISE else rotation  # turns are an input then
    check_rotation(rotation, settings.get("rotation_seed", 0))
    return {
        **view_parameters(described),
        "sigma": sigma,
        "guard": described.guard,
        "radii": tuple(float(radius) for radius in settings["radii"]),
        "estimator": "lf-neighbours" if settings["neighbours"] else settings["estimator"],
        "options": {},
        "units": settings.get("units", "radii"),
        "rotation": rotation,
        "rotation_seed": int(settings.get("rotation_seed", 0)),
        "light": None if settings.get("light") is None else Light(**settings["light"]),
    }


def _neighbours(settings: Mapping[str, Any], entry: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """The neighbours of a view, by name and view; None if an early manifest does not list them."""
    views = [
        (str(neighbour["name"]), view_of(neighbour["name"], neighbour["view"]))
        for neighbour in entry.get("neighbours", ())
    ]
    neighbours = [{"name": name, **view_parameters(view)} for name, view in views]
    return neighbours if len(neighbours) == settings["neighbours"] else None


def view_parameters(view: View) -> dict[str, Any]:
    """A view among the parameters of a case."""
    return {
        "mapping": {"kind": KINDS[view.world_to_image.kind], "numbers": view.world_to_image.numbers},
        "screen_to_world": view.screen_to_world,
        "view": {name: value for name, value in vars(view).items() if name != "world_to_image"},
    }


def _read_estimator(name: str, text: str | None) -> Estimator:
    """The estimator of a name; ``text`` is the SHA-256 of a user's file, which runs only if the user gives it."""
    if text is not None and (name not in ESTIMATORS or not find_estimator(name).text):
        raise InputError(f"the reference's estimator '{name}' is one of one's own: give its file by --estimator")
    if text is not None and find_estimator(name).text != text:
        raise InputError(f"the file of estimator '{name}' is another one than the reference was made with")
    return find_estimator(name)


def _tables(settings: Mapping[str, Any], parameters: dict[str, Any]) -> dict[str, NDArray[np.float64]]:
    """The sample tables of a view; the parameters get the estimator's options."""
    name = parameters["estimator"]
    estimator = _read_estimator(name, settings.get("estimator_sha256"))
    points = "samples" if name == "lf" else "points"
    parameters["options"] = full_parameters(estimator, settings["parameters"])
    tables_of_manifest = {points: settings["samples"], "weights": settings["weights"]}
    tables = {key: np.array(table, np.float64) for key, table in tables_of_manifest.items() if table is not None}
    if estimator.dimensions:
        check_samples(estimator, tables[points], tables.get("weights"))
    return tables
