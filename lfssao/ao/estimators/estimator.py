"""An estimator as the registry knows it; its options are the fields of a frozen dataclass, each said once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers, Texture
from lfssao.errors import InputError

FloatArray = NDArray[np.float64]
Value = float | int | str | bool
UNITS = "radii", "world"  # in which options that are lengths are counted

# run(buffers, radius, points, weights, options)
Run = Callable[..., Occlusion]


def turns_of(buffers: Buffers) -> Texture:
    """The turns of a view's samples as the kernels take them, (2 or 3, H * W): those of angle 0 if there are none."""
    if buffers.turns is not None:
        return np.ascontiguousarray(buffers.turns).reshape(len(buffers.turns), -1)
    still = np.zeros((2, buffers.depth.size), buffers.depth.dtype)
    still[0] = 1
    return still


def at_one_radius(occlusion: Callable[[float], Occlusion], radius: float, options: Any) -> Occlusion:
    """Return occlusion at R, by a function of it, ``Estimator.at_radii`` of estimators that have one radius."""
    return occlusion(radius)


def option(
    default: Value,
    meaning: str,
    *,
    limits: tuple[float, float] | None = None,
    choices: tuple[str, ...] = (),
    power: int = 0,
) -> Any:
    """Return a field of an ``Options`` class, whose values have the type of the default.

    meaning: one line for ``lfssao estimators NAME``; limits: least and greatest value of a number; choices: of a str;
    power: that of the length in which it is counted, radii (``Estimator.in_radii``).
    """
    metadata = {"meaning": meaning, "limits": limits, "choices": choices, "power": power}
    return field(default=default, metadata={key: value for key, value in metadata.items() if value})


@dataclass(frozen=True)
class Options:
    """The options of an estimator, fields made by ``option``; this class is for those that have none."""


@dataclass(frozen=True)
class Estimator:
    """One way to estimate ambient occlusion from a view's textures."""

    name: str  # its name in the registry and on the command line
    title: str  # one line for lists
    source: str  # paper and numbers of the equations, 'LF Algorithm 2' for example
    # Occlusion with its normalisation, before filters: R the radius, world units, C the texel's point, n its normal
    formula: str
    run: Run  # ``run(buffers, radius, points, weights, options)``, after the registry has checked all arguments
    # ``formulas(buffers, radius, points, weights, options)`` where it is written as ``lfssao.ao.formulas.Summed``: the
    # tuple of its numbers, of the textures' dtype
    formulas: Callable[..., Any] | None = None
    filtered: bool = False  # whether they read filtered textures, and not texels
    # ``at_radii(occlusion, radius, options)``: occlusion by a function that gives that of its formulas at a radius
    at_radii: Callable[..., Occlusion] = at_one_radius
    options: type[Options] = Options  # the dataclass of its options
    # ``run_radii(buffers, radii, points, weights, options)``: the bits that ``run`` makes of each radius, in less time
    run_radii: Callable[..., list[Occlusion]] | None = None
    # ``samples(n) -> (points, weights or None)``: its own sample set of n points, float64; None where it takes none
    samples: Callable[[int], tuple[FloatArray, FloatArray | None]] | None = None
    dimensions: int = 3  # coordinates of a sample: 3 in the ball, 2 in the disk, 0 where it takes none
    count: int = 8  # the paper's number of samples, the default n
    normals: bool = False  # whether it reads the normals texture whatever its options are
    # The occlusion by rays, up to strength, that it estimates: weighting and falloff of ``ray_cast_occlusion``
    integrand: tuple[str, str] = ("uniform", "cubic")
    converges: bool = True  # whether it tends to that occlusion; else it tends to none, and that is a near one
    whole_ball: bool = False  # whether a plane hides half: 2 max(0, ao - 1/2) is occlusion of the half space
    # Bytes a texel of the float32 textures that it has in memory at once: what it makes, what it returns and what is
    # kept with the view, the most over all views and parameters, turns included.
    texel_bytes: int = 4
    neighbours: bool = False  # whether it reads depth textures of other modules (``Buffers.neighbours``)
    # Whether its formulas have a field ``axis``: None, or 0 to 2, by which they sum that component of the open
    # directions (``lfssao.bent_normals``); a direction, or a pair, adds no more than 2.
    bent: bool = False
    turns: bool = False  # whether its samples may turn from texel to texel (``Buffers.turns``)
    vectors: bool = False  # whether it reads z of noise vectors
    rotation: str = "none"  # how they do by default, a name of ``lfssao.samples.ROTATIONS``
    # The method of ``make_samples`` whose points of seed 0 are its own sample set; None where it has another set.
    sampling: str | None = None
    text: str = ""  # SHA-256 of the file of one's own that it is read of

    @property
    def parameters(self) -> dict[str, Value]:
        """Names and default values of its options."""
        return {each.name: getattr(self.options, each.name) for each in fields(self.options)}

    @property
    def reads_texels(self) -> bool:
        """Whether it is written as formulas that look each sample up in one texel."""
        return self.formulas is not None and not self.filtered

    def reads_normals(self, parameters: Mapping[str, Value]) -> bool:
        """Whether it reads the normals texture with these parameters."""
        return self.normals or parameters.get("normals") == "buffer"

    def said(self, fact: str) -> dict[str, Any]:
        """A fact of each option that has it: 'meaning', 'limits', 'choices' or 'power', as of ``option``."""
        return {each.name: each.metadata[fact] for each in fields(self.options) if fact in each.metadata}

    def in_radii(self, parameters: Mapping[str, Value], radius: float, units: Value = "world") -> dict[str, Value]:
        """Parameters of ``UNITS``, defaults too, as the estimator takes them: world units over the radius' power.

        They stay as they are where that is 0. Raises InputError for another unit.
        """
        if not isinstance(units, str) or units not in UNITS:
            raise InputError(f"units is '{units!s:.40}': choose one of {', '.join(UNITS)}")
        made = {**self.parameters, **parameters}
        for name, power in self.said("power").items() if units == "world" else ():
            made[name] = float(made[name]) / (power_of(radius, power) or 1.0)
        return made

    def default_samples(self, n: int | None = None) -> tuple[FloatArray | None, FloatArray | None]:
        """Points and weights (None where all weigh the same) of its own sample set, n or ``count`` of them."""
        return (None, None) if self.samples is None else self.samples(self.count if n is None else n)


def power_of(radius: float, power: int) -> float:
    """A radius to a whole power; InputError where that is no finite number."""
    try:
        made = radius**power if radius else 0.0
    except (OverflowError, ZeroDivisionError):
        made = np.inf
    if not np.isfinite(made):
        raise InputError(f"radius is {radius:g}, its power {power} is out of range")
    return made
