"""SSAO of Godot 4 at quality 'low' and full size: ssao.glsl and ss_effects.cpp, 2025, Intel's ASSAO of 2016.

Texels of four passes, by the parity of column and row, read texels of their own pass alone. Three pairs of taps on both
sides of a texel lie at fixed places, which one of five turns and scales of the pass rotates, at whole texels of the
pass, mirrored at its border. All passes rebuild points as if their texels had the same centres. The radius shrinks near
the eye; the texel's own point is drawn towards it, along the axis alone. Obscurance is the weighted mean of
max(0, cos - horizon) max(0, 1 - (d / R)^2), which is clamped, fades far away, and leaves visibility^power.

Higher qualities weigh taps by what they see: a mean of two sums, which no fold here keeps. They read neighbours and
edges, too, and 'high' ones levels of depth of their own. These stay out, as do half size, 'very low', depths of 16 bits
and the blur.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Options, option
from lfssao.ao.estimators.look_ups import check_perspective
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.formulas import folded
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, power, rounded, select, smaller
from lfssao.core.places import image_place
from lfssao.core.vectors import cross, dot
from lfssao.errors import InputError

# sample_pattern: place on the disk, and weight.
TAPS = (0.78488064, 0.56661671, 1.5), (0.26022232, -0.29575172, 1.5), (0.10459357, 0.08372527, 1.11)
_SUBPASSES = 0, 1, 4, 3, 2  # spmap
_INSIDE, _NEAR_LIMIT, _NEARER, _CLAMP = 0.85, 1.8, 0.99, 0.98
_SUDDEN = 1e-6  # radii, least distance over which obscurance fades
_CENTRE = 1.5  # half_screen_pixel_size_x025, texels
_ORDERS = 3  # roundings of a texel's size, a difference of coordinates from 0 to 1, per texel of a row


@dataclass(frozen=True)
class GodotOptions(Options):
    """Options of ``godot-4``."""

    intensity: float = option(2.0, "ssao_intensity", limits=(0.0, 16.0))
    power: float = option(1.5, "ssao_power, of the visibility", limits=(0.0, 16.0))
    horizon: float = option(0.06, "ssao_horizon, cosine to the normal from which a tap counts", limits=(0.0, 1.0))
    fade_from: float = option(50.0, "fadeout_from, radii", limits=(0.0, 1e9), power=1)
    fade_to: float = option(300.0, "fadeout_to, radii", limits=(0.0, 1e9), power=1)


class Taps(NamedTuple):
    """Taps, (6, 4): place on the disk, weight, side; numbers of the formulas."""

    points: Any
    steps: int
    sides: int
    spins: Any  # (20, 2), cosine and sine of each pass' five turns, with their scale
    size: Any  # (2,), texels of a pass across and down
    roundings: int
    radius: Any
    close: Any  # 1 over the distance from which R is whole
    reach: Any  # 0.85 at distance 1, texels of a pass
    toward: Any  # part of z that the texel's point moves, world units
    horizon: Any
    slope: Any  # of the fading, by z, and its value at 0
    level: Any
    scale: Any  # intensity over the weights' sum
    exponent: float

    def start(self, view: Any, texel: Any) -> Any:
        """P drawn near, n, the texel's place in its pass, its parities, R in texels turned, 1 / R^2, and the fading."""
        z, column, row = view.surface(texel), view.column(texel), view.row(texel)
        x, y = number(column // 2, z), number(row // 2, z)
        p = view.point_at(2 * x + _CENTRE, 2 * y + _CENTRE, z)
        eye = view.apart(p, view.point_at(2 * x + _CENTRE, 2 * y + _CENTRE, number(0, z)))
        near = smaller(1, np.sqrt(dot(eye, eye)) * rounded(self.close, 3, z, 1))
        r = (near * 0.8 + 0.2) * rounded(self.radius, 0, z)
        reach = r * (rounded(self.reach, self.roundings, z, 1) / z)
        spin = 5 * (2 * (row % 2) + column % 2) + (2 * (row // 2) + column // 2) % 5
        turned = rounded(self.spins[spin, 0], 4, z) * reach, rounded(self.spins[spin, 1], 4, z) * reach
        p = p - (rounded(self.toward, 1, z) * z) * cross(view.upward(), view.rightward())
        n, odd = view.normal(texel), (number(column % 2, z), number(row % 2, z))
        fading = smaller(1, larger(0, z * rounded(self.slope, 2, z, 1) + rounded(self.level, 1, z, 1)))
        return p, (1 / np.sqrt(dot(n, n))) * n, (x, y), odd, turned, 1 / (r * r), fading

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.radius > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The centre of a tap's texel, mirrored at the border of the pass."""
        (x, y), (right, down) = _tap(self, here, s), here[3]
        return image_place(
            2 * _mirrored(x, self.size[0]) + (right + 0.5), 2 * _mirrored(y, self.size[1]) + (down + 0.5)
        )

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """A sum of nothing."""
        return number(0, here[6])

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """All of the way."""
        return number(1, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the sum with a tap's obscurance."""
        x, y = _tap(self, here, s)
        away = view.apart(view.point_at(2 * x + _CENTRE, 2 * y + _CENTRE, view.surface(seen)), here[0])
        square = dot(away, away)
        above = larger(0, dot(here[1], away) / np.sqrt(square) - rounded(self.horizon, 0, square))
        term = (above * larger(0, 1 - square * here[5])) * rounded(self.points[s, 2], 0, square)
        return 0, select(square > 0, state + term, state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The mean, its strength, and the fading."""
        return smaller(_CLAMP, state * rounded(self.scale, 8, state, 1)) * here[6]

    def end(self, total: Any) -> Any:
        """1 - visibility^power."""
        return 1 - power(smaller(1, larger(0, 1 - total)), self.exponent)


@formula
def _tap(taps: Any, here: Any, s: Any) -> Any:
    """Column and row of a tap in its pass, whole numbers, which may lie beyond its border."""
    (column, row), (cosine, sine) = here[2], here[4]
    a, b, side = taps.points[s, 0], taps.points[s, 1], taps.points[s, 3]
    x, y = np.floor(a * cosine - b * sine + 0.5), np.floor(0.5 - (a * sine + b * cosine))
    return column + side * x, row + side * y


@formula
def _mirrored(place: Any, size: Any) -> Any:
    """The column or row inside that stands for one outside."""
    folded_back = select(place < 0, -1 - place, select(place >= size, (2 * size - 1) - place, place))
    return smaller(size - 1, larger(0, folded_back))


def spins() -> FloatArray:
    """Return cosine and sine of the turns of four passes, five each, with their scale, (20, 2)."""
    passes = [(a, b) for a in range(4) for b in _SUBPASSES]
    return np.array(
        [(1 + (a - 1.5 + (b - 2) / 5) * 0.07) * np.array(sincospi(a / 2 + b / 10)[::-1]) for a, b in passes]
    )


def godot_4(buffers: Buffers, radius: float, points: None, weights: None, options: GodotOptions) -> Taps:
    """Return the formulas' numbers, in the textures' dtype; it makes its own taps."""
    check_perspective("godot-4", buffers.view)
    (height, width), lens = buffers.depth.shape, buffers.view.lens
    if height % 2 or width % 2:
        raise InputError(f"estimator godot-4 has passes of a half, and the texture has {width} x {height} texels")
    kind, unit, world = buffers.depth.dtype.type, cast_length(buffers.view, 1.0), np.float64(radius)
    span = max(options.fade_to - options.fade_from, _SUDDEN)
    with np.errstate(all="ignore"):
        return Taps(
            points=np.array([(*tap, side) for tap in TAPS for side in (1, -1)]).astype(kind),
            steps=1,
            sides=2 * len(TAPS),
            spins=spins().astype(kind),
            size=np.array([width // 2, height // 2]).astype(kind),
            roundings=_ORDERS * width + 8,
            radius=kind(radius),
            close=kind(height / (2 * float(lens[1])) / (_NEAR_LIMIT * world)),
            reach=kind(_INSIDE * unit * float(lens[0]) / 2),
            toward=kind((1 - _NEARER) / unit),
            horizon=kind(options.horizon),
            slope=kind(-_NEARER / (span * world * unit)),
            level=kind(options.fade_from / span + 1),
            scale=kind(options.intensity / (2 * sum(weight for _, _, weight in TAPS))),
            exponent=options.power,
        )


ENTRIES = (
    folded(
        "godot-4",
        godot_4,
        title="obscurance of taps at fixed places, in four interleaved passes",
        source="Godot 4, ssao.glsl, and Intel's ASSAO",
        formula="ao = 1 - (1 - min(0.98, intensity mean of max(0, n.v / |v| - horizon) max(0, 1 - v.v / R^2)))^power",
        options=GodotOptions,
        integrand=("cosine", "linear"),
        converges=False,
        count=6,
        normals=True,
        texel_bytes=24,
    ),
)
