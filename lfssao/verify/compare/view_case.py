"""A rendered view as a case, from what its manifest says."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import check_samples, find_estimator, full_parameters
from lfssao.ao.post import MAX_SIGMA
from lfssao.errors import InputError
from lfssao.optics.view import KINDS
from lfssao.samples.rotation import check_rotation
from lfssao.verify.bounds.points import BOUNDED, LINES, is_bounded
from lfssao.verify.case import VIEW, Case, Parameters


def view_case(path: Path, manifest: Mapping[str, Any], entry: Mapping[str, Any]) -> Case:
    """The case of a view from its manifest and its entry there, outputs left out.

    InputError, with the manifest's path, if they do not hold what bounds are made of.
    """
    try:
        parameters = _parameters(manifest["settings"], entry["view"])
        parameters["colored"] = bool(manifest.get("scene", {}).get("colored", False))
        return Case("", VIEW, "", parameters, _tables(manifest["settings"], parameters, entry["view"]), {})
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise not_written(path, error) from error


def not_written(path: Path, error: Exception) -> InputError:
    """The error of a folder or manifest that is not what 'lfssao render' writes, from what it led to."""
    what = f"its manifest has no {error}" if isinstance(error, KeyError) else f"{type(error).__name__}: {error}"
    return InputError(f"{path}: it is not what 'lfssao render' writes ({what:.80})")


def _parameters(settings: Mapping[str, Any], view: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a view, checked."""
    kind, numbers = view["world_to_image_kind"], _numbers(view["world_to_image"])
    back = None if view["screen_to_world"] is None else _numbers(view["screen_to_world"])
    if settings["merge"] != "maximum":
        raise ValueError("merge is not the maximum")
    sigma, guard, size = float(settings["blur_sigma"]), int(view["guard"]), min(view["width"], view["height"])
    if kind not in KINDS or numbers.shape != ((44,) if kind == "display" else (16,)):
        raise ValueError("world_to_image is of no kind or has the wrong length")
    if (back is not None) != (kind == "matrix") or (back is not None and back.shape != (4, 4)):
        raise ValueError("screen_to_world does not fit world_to_image")
    if not 0 <= sigma <= MAX_SIGMA or not 0 <= 2 * guard < size:
        raise ValueError("blur or guard band is out of range")
    check_rotation(settings.get("rotation", "none"), settings.get("rotation_seed", 0))
    return {
        "mapping": {"kind": kind, "numbers": numbers},
        "screen_to_world": back,
        "sigma": sigma,
        "guard": guard,
        "radii": tuple(float(radius) for radius in settings["radii"]),
        "estimator": "lf with neighbours" if settings["neighbours"] else settings["estimator"],
        "options": {},
        "rotation": settings.get("rotation", "none"),  # a manifest without it is of a time when nothing turned
        "rotation_seed": int(settings.get("rotation_seed", 0)),
    }


def _tables(
    settings: Mapping[str, Any], parameters: dict[str, Any], view: Mapping[str, Any]
) -> dict[str, NDArray[np.float64]]:
    """The sample tables of a view; the parameters get what bounds of an estimator's occlusion need."""
    name = parameters["estimator"]
    if name == "lf":
        return {"samples": _numbers(settings["samples"])}
    if name not in BOUNDED:
        return {}
    estimator = find_estimator(name)
    parameters["options"] = full_parameters(estimator, settings["parameters"])
    parameters["view"] = {"cast_from_world": _numbers(view["cast_from_world"]).reshape(3, 4)}
    tables = {"points": _numbers(settings["samples"])}
    if settings["weights"] is not None:
        tables["weights"] = _numbers(settings["weights"])
    check_samples(estimator, tables["points"], tables.get("weights"))
    if name in LINES and "lens" in view:  # a manifest without it is of a time when lines had no intervals
        back, lens = _numbers(view["world_from_cast"]), _numbers(view["lens"])
        if back.shape != (3, 4) or lens.shape != ((32,) if view["world_to_image_kind"] == "display" else (8,)):
            raise ValueError("world_from_cast or lens has the wrong length")
        parameters["view"] |= {"world_from_cast": back, "lens": lens}
    return tables


def _numbers(values: Any) -> NDArray[np.float64]:
    array = np.array(values, np.float64)
    if not np.isfinite(array).all():
        raise ValueError("a number is not finite")
    return array


def knows_occlusion(parameters: Parameters) -> bool:
    """Whether intervals of the occlusion of a view's estimator are known."""
    name, directions = parameters["estimator"], "lens" in parameters.get("view", {})
    return name == "lf" or is_bounded(name, parameters["options"], directions)
