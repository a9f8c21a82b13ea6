"""Parameters of published shaders, in the names of the estimators here: TOML files, with the source of each value."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from lfssao.ao.estimators.estimator import Value, power_of
from lfssao.ao.estimators.registry import find_estimator, full_parameters
from lfssao.errors import InputError, check_choice, errors_of
from lfssao.files.whole import read_text
from lfssao.optics.display_file import parse_toml
from lfssao.samples import ROTATIONS

_FILES = resources.files("lfssao.ao.estimators").joinpath("shaders")
_KEYS = {"estimator": str, "rotate": str, "radius": float, "samples": int, "parameters": dict}


@dataclass(frozen=True)
class Published:
    """A shader's choices."""

    estimator: str  # its name
    radius: float  # the shader's own radius R, world units, to which its lengths belong
    parameters: dict[str, Value]  # all of the estimator, lengths in world units
    rotate: str | None = None  # how samples turn, a name of ``lfssao.samples.ROTATIONS``; None: as the estimator's own
    samples: int | None = None  # number of samples; None: the estimator's own

    def parameters_in(self, units: str) -> dict[str, Value]:
        """The parameters with lengths in 'world' units or in 'radii' of the shader's own radius."""
        if units == "world":
            return self.parameters
        return find_estimator(self.estimator).in_radii(self.parameters, self.radius)


def published_names() -> list[str]:
    """Names of the shaders whose parameters are known."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FILES.iterdir() if entry.name.endswith(".toml"))


def published_text(name: str) -> str:
    """The TOML file of a shader, each value with its source; InputError if there is none of that name."""
    check_choice("shader", name, published_names())
    return _FILES.joinpath(f"{name}.toml").read_text(encoding="utf-8")


def find_published(name: str) -> Published:
    """A shader by its name, or by a file whose name ends in .toml; InputError if a key or value is wrong."""
    text = read_text(Path(name)) if name.endswith(".toml") else published_text(name)
    values: dict[str, Any] = parse_toml(text, name)
    with errors_of(name):
        for key, value in values.items():
            check_choice("key", key, _KEYS)
            if type(value) is not _KEYS[key]:
                raise InputError(f"{key} is {value!r:.40}, it must be of type {_KEYS[key].__name__}")
        for key in ("estimator", "radius"):
            if key not in values:
                raise InputError(f"{key} is missing")
        if not 0 < values["radius"] < float("inf"):
            raise InputError(f"radius is {values['radius']:g}, it must be positive")
        if "rotate" in values:
            check_choice("rotation", values["rotate"], ROTATIONS)
        estimator = find_estimator(values["estimator"])
        # Defaults are in radii, those of the file in world units.
        units = {option: power_of(values["radius"], power) for option, power in estimator.said("power").items()}
        defaults = {option: float(estimator.parameters[option]) * unit for option, unit in units.items()}
        parameters = full_parameters(estimator, {**defaults, **values.get("parameters", {})})
        return Published(**{**values, "parameters": parameters})
