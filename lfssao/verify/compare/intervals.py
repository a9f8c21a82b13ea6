"""A rendered view as a case: its parameters from a manifest, and the reasons of what is said of its texels."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import check_samples, find_estimator, full_parameters
from lfssao.errors import InputError
from lfssao.optics.view import KINDS
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.depth import PositionBounds
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.explain import explain
from lfssao.verify.bounds.judge import Rules, view_rules
from lfssao.verify.bounds.points import BOUNDED, is_bounded
from lfssao.verify.case import VIEW, Array, Case, Parameters, described_mapping
from lfssao.verify.compare.layers import Layer

_MOST_BLUR = 1024.0  # texels; 'lfssao render' takes no more
_REASONS = {
    "depth": "expected: a depth between this texel's and a neighbour's in the reference (no mesh given)",
    "positions": "expected: the point of the texel's ray at the depth of the depth texture",
    "color": "expected: a colour between those of this texel and its neighbours",
    "blurred": "expected: the blur of the renderer's own merged texture",
    "shaded": "expected: the image times 1 - blurred, both the renderer's own",
}


def view_case(path: Path, manifest: Mapping[str, Any], entry: Mapping[str, Any]) -> Case:
    """The case of a view, its outputs left out.

    Parameters
    ----------
    path : Path
        Where the manifest is, for messages.
    manifest : mapping
        The manifest, or at least its settings.
    entry : mapping
        What it says of the view.

    Raises
    ------
    InputError
        If it does not hold what bounds are made of.
    """
    try:
        case = _read(manifest["settings"], entry["view"])
        colored = bool(manifest.get("scene", {}).get("colored", False))
        return replace(case, parameters={**case.parameters, "colored": colored})
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise not_written(path, error) from error


def not_written(path: Path, error: Exception) -> InputError:
    """What is said of a folder or manifest that led to an error."""
    what = f"its manifest has no {error}" if isinstance(error, KeyError) else f"{type(error).__name__}: {error}"
    return InputError(f"{path}: it is not what 'lfssao render' writes ({what:.80})")


def _read(settings: Mapping[str, Any], view: Mapping[str, Any]) -> Case:
    kind, numbers = view["world_to_image_kind"], _numbers(view["world_to_image"])
    back = None if view["screen_to_world"] is None else _numbers(view["screen_to_world"])
    if settings["merge"] != "maximum":
        raise ValueError("merge is not the maximum")
    sigma, guard, size = float(settings["blur_sigma"]), int(view["guard"]), min(view["width"], view["height"])
    if kind not in KINDS or numbers.shape != ((44,) if kind == "display" else (16,)):
        raise ValueError("world_to_image is of no kind or has the wrong length")
    if (back is not None) != (kind == "matrix") or (back is not None and back.shape != (4, 4)):
        raise ValueError("screen_to_world does not fit world_to_image")
    if not 0 <= sigma <= _MOST_BLUR or not 0 <= 2 * guard < size:
        raise ValueError("blur or guard band is out of range")
    name = "lf with neighbours" if settings["neighbours"] else settings["estimator"]
    parameters = {
        "mapping": {"kind": kind, "numbers": numbers}, "screen_to_world": back, "sigma": sigma, "guard": guard,
        "radii": tuple(float(radius) for radius in settings["radii"]), "estimator": name, "options": {},
    }  # fmt: skip
    if name not in BOUNDED:
        samples = {"samples": _numbers(settings["samples"])} if name == "lf" else {}
        return Case("", VIEW, "", parameters, samples, {})
    estimator, points, weights = find_estimator(name), _numbers(settings["samples"]), settings["weights"]
    parameters["options"] = full_parameters(estimator, settings["parameters"])
    parameters["view"] = {"cast_from_world": _numbers(view["cast_from_world"]).reshape(3, 4)}
    table = {"points": points} if weights is None else {"points": points, "weights": _numbers(weights)}
    check_samples(estimator, points, table.get("weights"))
    return Case("", VIEW, "", parameters, table, {})


def _numbers(values: Any) -> NDArray[np.float64]:
    array = np.array(values, np.float64)
    if not np.isfinite(array).all():
        raise ValueError("a number is not finite")
    return array


def knows_occlusion(parameters: Parameters) -> bool:
    """Whether intervals of the occlusion of a view's estimator are known."""
    return parameters["estimator"] == "lf" or is_bounded(parameters["estimator"], parameters["options"])


class ViewOracle:
    """What is right of one view, given the textures that a renderer made on the way; made when it is first asked.

    Parameters
    ----------
    view : Case
        Its parameters.
    mine : mapping of Layer
        The renderer's textures.
    reference : iterable of Layer
        The right ones.
    model : ErrorModel
        What float32 arithmetic may do.
    from_mesh : callable
        Makes bounds of depth and colour from the mesh, empty where there is none.
    """

    def __init__(
        self,
        view: Case,
        mine: Mapping[str, Layer],
        reference: Iterable[Layer],
        model: ErrorModel,
        from_mesh: Callable[[], Mapping[str, Bounds]],
    ) -> None:
        self._view, self._layers, self._reference = view, mine, reference
        self._model, self._from_mesh = model, from_mesh

    @cached_property
    def _case(self) -> Case:
        return replace(self._view, outputs={layer.name: layer.texture for layer in self._reference})

    @cached_property
    def _mine(self) -> dict[str, Array]:
        return {name: layer.texture for name, layer in self._layers.items()}

    @cached_property
    def _mesh(self) -> Mapping[str, Bounds]:
        return self._from_mesh()

    @cached_property
    def _rules(self) -> Rules:
        return view_rules(self._case, self._mine, self._model, lambda: self._mesh)

    def allowed(self, name: str) -> Bounds | PositionBounds | None:
        """What a texture is held to.

        Raises
        ------
        InputError
            If the manifest's parameters do not fit the textures.
        """
        return self._rules(name)

    def reason(self, name: str, texel: tuple[int, int], bounds: Bounds | None) -> str:
        """Why a texel (column, row) is what it is, in one sentence; '' where the oracle knows none.

        Parameters
        ----------
        name : str
            The texture.
        texel : (int, int)
            Column and row.
        bounds : Bounds or None
            What the texture was held to.
        """
        (i, j), radii = texel, self._case.parameters["radii"]
        numbers = {f"ao_{k + 1}": k for k in range(len(radii))}
        if name == "merged":
            layers = [self._mine.get(layer, self._case.outputs.get(layer)) for layer in numbers]
            values = ", ".join(f"{layer[j, i]:.7g}" for layer in layers if layer is not None)
            return f"the radii have {values}" if values else ""
        if name in ("depth", "color") and name in self._mesh and bounds is not None:
            missed = name == "depth" and bounds.lower[j, i] == np.inf
            seen = "nothing" if missed else f"this interval of {name}"
            return f"nine rays into the mesh, within {self._model.centre:.2g} texel of the texel's centre, see {seen}"
        if name not in numbers:
            return _REASONS.get(name, "")
        if self._case.parameters["estimator"] == "lf":
            return self._nearest_sample(texel, radii[numbers[name]])
        if bounds is None or bounds.undecided is None:
            return ""
        return f"{bounds.undecided[j, i]} of {len(self._case.inputs['points'])} points are undecided"

    def _nearest_sample(self, texel: tuple[int, int], radius: float) -> str:
        """The sample of a texel that comes nearest to another answer."""
        parameters, guard = self._case.parameters, self._case.parameters["guard"]
        depth, positions = (self._first_whole(name) for name in ("depth", "positions"))
        if depth is None or (positions is None and parameters["screen_to_world"] is None):
            return ""
        place, mapping, samples = (texel[0] + guard, texel[1] + guard), described_mapping(parameters), self._case.inputs
        back = parameters["screen_to_world"]
        found = explain(place, depth, positions, mapping, samples["samples"], radius, self._model, back)
        return str(found[0]) if found else "no surface is seen there"

    def _first_whole(self, name: str) -> Array | None:
        """The renderer's texture, or if it holds NaN the reference's."""
        sides = self._mine.get(name), self._case.outputs.get(name)
        return next((side for side in sides if side is not None and not np.isnan(side).any()), None)
