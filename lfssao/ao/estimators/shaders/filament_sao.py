"""SAO of Filament: filament/src/materials/ssao/saoImpl.fs and PostProcessManager.cpp, 2025, without bent normals.

It is ``sao`` before its passes but for these: taps lie at the squares of even distances, at least a texel away, and a
texel's noise, a number from 0 to 1, moves them outwards and turns them 2.4 times as often; a tap's point is rebuilt
where it lands, and not at a texel's centre; the sum's square root is subtracted from 1, and the rest squared.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import Bordered, check_perspective
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.formulas import summed
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import is_finite, larger, number, power, rounded, select, smaller
from lfssao.core.places import image_place
from lfssao.core.vectors import dot

_TURNS = 2.4  # by noise
_PEAK = 0.1  # of R, where the falloff is largest


@dataclass(frozen=True)
class FilamentOptions(Bordered):
    """Options of ``filament-sao``."""

    taps: int = option(7, "sampleCount", limits=(1, 256))
    turns: float = option(3.0, "spiralTurns", limits=(0.0, 1000.0))
    bias: float = option(0.0005, "bias, part of its depth by which a point is moved up", limits=(0.0, 1.0))
    intensity: float = option(1.0, "intensity", limits=(0.0, 1e6))
    horizon: float = option(0.0, "minHorizonAngleRad, here degrees", limits=(0.0, 90.0))
    power: float = option(1.0, "power, half of that of the visibility", limits=(0.0, 8.0))
    max_level: int = option(7, "maxLevel, of levels of depth", limits=(0, 15))


class Taps(NamedTuple):
    """Taps, (n, 3): cosine and sine of their angle from the first, and number; numbers of the formulas."""

    points: Any
    reach: Any  # R at distance 1, texels
    alpha: Any  # of a tap, 1 / (n - 1/2)
    inverse: Any  # 1 / R^2
    peak: Any  # the square of the distance where the falloff is largest
    bias: Any
    horizon: Any  # the square of the sine
    scale: Any  # of the sum
    exponent: float
    log_q: int

    def start(self, view: Any, texel: Any) -> Any:
        """P, its normal, its bias, R in texels, the texel's place, the first tap's cosine and sine, and the noise."""
        z, (noise, _) = view.surface(texel), view.turn(texel)
        place, reach = (number(view.column(texel), z), number(view.row(texel), z)), rounded(self.reach, 3, z) / z
        first = view.cosine_and_sine(noise * (2 * _TURNS * PI))
        return view.position(texel), view.normal(texel), rounded(self.bias, 0, z) * z, reach, place, first, noise

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.reach > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image point of tap s."""
        u, v, _ = _tap(self, view, here, s)
        return image_place(u, v)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """max(0, 1 - V.V / R^2)^2 max(0, V.n - bias z) / (V.V + peak^2), V from P; 0 near the tangent plane."""
        p, n, bias = here[:3]
        u, v, length = _tap(self, view, here, s)
        deep, there = view.coarse_z(seen, rounded(length, 8, length), self.log_q)
        away = view.apart(view.point_at(u, v, deep), p)
        square, above = dot(away, away), dot(away, n)
        left = larger(0, 1 - square * rounded(self.inverse, 1, square, 1))
        weight = select(above * above >= square * rounded(self.horizon, 2, square), left * left, 0)
        term = weight * (larger(0, above - bias) / (square + rounded(self.peak, 2, square)))
        return select(there & (left > 0) & (term > 0) & is_finite(term), term, 0)

    def background(self) -> Any:
        """No tap is on background: the levels say what it sees."""
        return 0

    def end(self, total: Any) -> Any:
        """1 - (1 - sqrt(2 pi peak intensity / n sum))^(2 power)."""
        root = np.sqrt(larger(0, total * rounded(self.scale, 4, total)))
        return 1 - power(larger(0, smaller(1, 1 - root)), self.exponent)


@formula
def _tap(taps: Any, view: Any, here: Any, s: Any) -> Any:
    """The image point of tap s, and how many texels it is away."""
    _, _, _, reach, (column, row), (cosine, sine), noise = here
    x, y = view.sine_of_angle(taps.points[s, 0]), view.sine_of_angle(taps.points[s, 1])
    alpha = ((noise + taps.points[s, 2]) + 0.5) * rounded(taps.alpha, 0, noise, 1)
    length = larger(1, (alpha * alpha) * reach)
    u = column + (length * (x * cosine - y * sine) + 0.5)
    return u, row + (0.5 - length * (y * cosine + x * sine)), length


def filament_sao(buffers: Buffers, radius: float, points: None, weights: None, options: FilamentOptions) -> Taps:
    """Return the formulas' numbers, in the textures' dtype; it makes its own taps."""
    check_perspective("filament-sao", buffers.view)
    kind, unit, n = buffers.depth.dtype.type, cast_length(buffers.view, 1.0), options.taps
    lens, step = buffers.view.lens, 2 * options.turns / (n - 0.5)
    table = [[*sincospi((i * step) % 2)[::-1], i] for i in range(n)]
    with np.errstate(over="ignore", divide="ignore"):
        return Taps(
            points=np.array(table).astype(kind),
            reach=kind(radius * unit * min(float(lens[0]), float(lens[1]))),
            alpha=kind(1 / (n - 0.5)),
            inverse=kind(1 / np.float64(radius) ** 2),
            peak=kind((_PEAK * radius) ** 2),
            bias=kind(options.bias / unit),
            horizon=kind(sincospi(options.horizon / 180)[0] ** 2),
            scale=kind(2 * PI * _PEAK * radius * options.intensity / n),
            exponent=2 * options.power,
            log_q=3,
        )


ENTRIES = (
    summed(
        "filament-sao",
        filament_sao,
        title="obscurance by taps in a spiral of squared distances, its root subtracted from 1",
        source="Filament, materials/ssao/saoImpl.fs",
        formula=(
            "ao = 1 - (1 - sqrt(0.2 pi R intensity / taps sum of max(0, 1 - v.v / R^2)^2 max(0, v.n - bias z) / "
            "(v.v + (R / 10)^2)))^(2 power), v = Q - P"
        ),
        options=FilamentOptions,
        dimensions=0,
        integrand=("cosine", "linear"),
        count=7,
        converges=False,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="tiles",
    ),
)
