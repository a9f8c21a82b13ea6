"""All estimators by name, and the one call that runs any of them on any view."""

from collections import UserDict
from collections.abc import Mapping, Sequence
from importlib import import_module
from math import isfinite
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, Value
from lfssao.ao.ssao import Occlusion, check_radius
from lfssao.ao.textures import Buffers
from lfssao.core.arguments import as_numbers
from lfssao.errors import InputError, check_choice, check_type

# A family is a file of this folder. It is imported when one of its estimators is asked for: the default needs one.
_FAMILIES: dict[str, tuple[str, ...]] = {
    "lf": ("lf",),
    "point": ("point", "hemisphere"),
    "alchemy": ("alchemy",),
    "sao.estimator": ("sao", "sao-equation-1"),
    "multiresolution": ("multiresolution",),
    "vo.points": ("vo-points", "vo-points-normal"),
    "vo.lines": ("vo-lines", "vo-lines-normal"),
    "vo.area": ("vo-area",),
    "horizon": ("hbao",),
    "gtao": ("gtao",),
    "bitmask": ("visibility-bitmask",),
    "oriented": ("oriented-hemisphere",),
    "neighbours": ("lf-neighbours",),
}


# Estimators that are formulas of one published shader (``published``): they are found, and not listed.
_SHADERS = {
    "threejs-ssao": "shaders.threejs_ssao",
    "sascha-willems": "shaders.sascha_willems",
    "threejs-gtao": "shaders.threejs_gtao",
    "nvidia-hbao": "shaders.nvidia_hbao",
    "babylon-ssao2": "shaders.babylon_ssao2",
    "xegtao": "shaders.xegtao",
    "bevy-ssao": "shaders.bevy",
    "filament-sao": "shaders.filament_sao",
    "filament-gtao": "shaders.filament_gtao",
    "godot-4": "shaders.godot_4",
    "unity-urp": "shaders.unity_urp",
    "n8ao": "shaders.n8ao",
}


class _Registry(UserDict[str, Any]):
    """The estimators by name; their names are listed without importing them."""

    def __contains__(self, name: object) -> bool:
        return name in self.data or name in _SHADERS

    def __getitem__(self, name: str) -> Any:
        known = self.data[name] if name in self.data else _SHADERS[name]
        if isinstance(known, Estimator):  # of one's own
            return known
        entries = import_module(f"lfssao.ao.estimators.{known}").ENTRIES
        return next(entry for entry in entries if entry.name == name)


ESTIMATORS = _Registry({name: family for family, of in _FAMILIES.items() for name in of})


def register(estimator: Estimator) -> None:
    """Let an estimator of one's own be found by its name, in this process."""
    ESTIMATORS.data[estimator.name] = estimator


def find_estimator(name: str) -> Estimator:
    """Return the estimator of a name; raises InputError if there is none."""
    check_choice("estimator", name, ESTIMATORS)
    found: Estimator = ESTIMATORS[name]
    return found


def of_one_view() -> dict[str, Estimator]:
    """Return this package's estimators by name that read the textures of one view alone."""
    return {name: found for name, found in ESTIMATORS.items() if not found.neighbours and not found.text}


def estimate(
    name: str | Estimator,
    buffers: Buffers,
    radius: float,
    points: FloatArray | None = None,
    weights: FloatArray | None = None,
    units: Value = "radii",
    **parameters: Value,
) -> Occlusion:
    """Return ambient occlusion of one view by the estimator of a name.

    Parameters
    ----------
    name : str or Estimator
        One of ``ESTIMATORS``, or one of one's own (``lfssao.read_estimator``).
    buffers : Buffers
        The view's textures; their dtype is the arithmetic's. Samples turn by their ``turns`` and not without: for the
        rotation that a render has by default, hand over ``buffers.turned(find_estimator(name).rotation)``.
    radius : float
        R, world units.
    points : (n, d) float64, optional
        Samples in the unit ball (d = 3) or disk (d = 2); the estimator's own set of its paper's size otherwise.
    weights : (n,) float64, optional
        The samples' weights, for estimators that read them; they need not sum to 1.
    units : str
        'radii', or 'world' for options that are lengths, defaults too, in world units.
    parameters : numbers or str
        The estimator's options by name, in place of their defaults (``lfssao estimators NAME`` lists them).

    Returns
    -------
    Occlusion
        Texture (H, W) in depth's dtype, 0 open to 1 covered, 0 where there is no surface.

    Raises
    ------
    InputError
        If the name, a sample set, a parameter or the radius is wrong, normals are needed and not there, or samples
        that cannot are to turn.

    Examples
    --------
    >>> textures = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))[0]
    >>> buffers = lfssao.Buffers.of(textures.gbuffer, textures.view)
    >>> lfssao.estimate("sao", buffers, radius=0.1, taps=12).texture.shape
    (48, 64)
    """
    return estimate_radii(name, buffers, (radius,), points, weights, units, **parameters)[0]


def estimate_radii(
    name: str | Estimator,
    buffers: Buffers,
    radii: Sequence[float],
    points: FloatArray | None = None,
    weights: FloatArray | None = None,
    units: Value = "radii",
    **parameters: Value,
) -> list[Occlusion]:
    """Return ``estimate`` of each of several radii; together they may take less time."""
    estimator = name if isinstance(name, Estimator) else find_estimator(name)
    options = options_at(estimator, buffers, radii, units, parameters)
    check_samples(estimator, points, weights)
    if points is None:
        points, weights = estimator.default_samples()
    if estimator.run_radii is not None and len(set(options)) == 1 < len(radii):
        return estimator.run_radii(buffers, radii, points, weights, options[0])
    return [estimator.run(buffers, r, points, weights, own) for r, own in zip(radii, options, strict=True)]


def options_at(
    estimator: Estimator, buffers: Buffers, radii: Sequence[float], units: Value, parameters: Mapping[str, Value]
) -> list[Options]:
    """Return the options of an estimator at each radius; InputError if it cannot be run on the view with them."""
    check_type("buffers", buffers, Buffers)
    for radius in radii:
        check_radius(radius)
    parameters = full_parameters(estimator, parameters)
    options = [estimator.options(**estimator.in_radii(parameters, radius, units)) for radius in radii]
    if estimator.reads_normals(parameters) and buffers.normals is None:
        raise InputError(f"estimator {estimator.name} reads normals, and there is no normals texture")
    if buffers.turns is not None:
        check_turning(estimator, len(buffers.turns) == 3)
    return options


def check_bent(estimator: Estimator) -> None:
    """Refuse an estimator, by an InputError, that has no bent normals."""
    if not estimator.bent:
        able = ", ".join(name for name, each in ESTIMATORS.items() if each.bent)
        raise InputError(f"estimator {estimator.name} has no bent normals: choose one of {able}")


def check_turning(estimator: Estimator, vectors: bool = False) -> None:
    """Refuse an estimator, by an InputError, whose samples do not turn from texel to texel, or not by vectors' z."""
    if not estimator.turns:
        able = ", ".join(name for name, each in ESTIMATORS.items() if each.turns)
        raise InputError(f"rotation: samples of estimator {estimator.name} do not turn by it: choose one of {able}")
    if vectors and not estimator.vectors:
        raise InputError(f"rotation: a vector has a z other than 0, and estimator {estimator.name} reads x and y alone")


def full_parameters(estimator: Estimator, parameters: Mapping[str, Value]) -> dict[str, Value]:
    """All parameters of an estimator, in the default's type; InputError if a name or a value is wrong."""
    defaults = estimator.parameters
    unknown = sorted(set(parameters) - set(defaults))
    if unknown:
        known = ", ".join(defaults) or "none"
        raise InputError(f"estimator {estimator.name} has no parameter '{unknown[0]}': it has {known}")
    return {**defaults, **{name: _checked(estimator, name, value) for name, value in parameters.items()}}


def _checked(estimator: Estimator, name: str, value: Any) -> Value:
    """A parameter's value in the type of its default."""
    kind = type(estimator.parameters[name])
    wrong = f"estimator {estimator.name}: {name} is {value!r}, "
    if isinstance(value, bool | np.bool_) or kind in (bool, str):
        if kind is int or not isinstance(value, kind):  # True is an int, and no whole number
            raise InputError(f"{wrong}it must be of type {kind.__name__}")
    elif not isinstance(value, int | np.integer if kind is int else int | float | np.integer | np.floating):
        raise InputError(f"{wrong}it must be a {'whole ' if kind is int else ''}number")
    try:
        checked: Value = kind(value)
    except OverflowError:  # of a whole number
        raise InputError(f"{wrong}it must be finite") from None
    if isinstance(checked, float) and not isfinite(checked):
        raise InputError(f"{wrong}it must be finite")
    low, high = estimator.said("limits").get(name, (checked, checked))
    if not low <= checked <= high:
        raise InputError(f"{wrong}it must be from {low:g} to {high:g}")
    choices = estimator.said("choices").get(name, (checked,))
    if checked not in choices:
        raise InputError(f"{wrong}choose one of {', '.join(choices)}")
    return checked


def check_samples(estimator: Estimator, points: Any, weights: Any) -> None:
    """Refuse samples and weights, by an InputError, that are none; None stands for the estimator's own."""
    own, d = f"estimator {estimator.name}", estimator.dimensions
    if points is None:
        if weights is not None:
            raise InputError(f"{own}: weights are given, and no samples that they are of")
        return
    if d == 0:
        raise InputError(f"{own} takes no samples")
    table = as_numbers(f"{own}: samples", points)
    if table.ndim != 2 or table.shape[1] != d or len(table) == 0:
        raise InputError(f"{own}: samples have shape {table.shape}, expected (n, {d}) with n at least 1")
    if not np.isfinite(table).all():
        raise InputError(f"{own}: a sample is not finite")
    if weights is None:
        return
    weighs = as_numbers(f"{own}: weights", weights)
    if weighs.shape != table.shape[:1] or not np.isfinite(weighs).all():
        raise InputError(f"{own}: weights must be {len(table)} finite numbers")
    if (weighs < 0).any() or not weighs.any():
        raise InputError(f"{own}: weights must be positive or 0, and not all 0")
