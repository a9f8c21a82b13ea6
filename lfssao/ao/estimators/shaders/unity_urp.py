"""SSAO of Unity's Universal Render Pipeline: SSAO.hlsl and ScreenSpaceAmbientOcclusion.cs, with blue noise, 2025.

It is ``alchemy`` but for these: points lie in the half ball around the normal, in directions along the axes of world
space that a number of noise makes, another one each sample; beyond the border a point is seen at it, and rebuilt there;
a surface farther along the axis than R from its point is not seen; occlusion fades out far away.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import Bordered
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.formulas import sum_formulas, summed
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, power, rounded, select, smaller, surely
from lfssao.core.vectors import Vector, dot
from lfssao.errors import InputError

FIRST = 0, 87, 193, 145, 252, 19, 61, 164, 92, 130, 98, 252  # SSAORandomUV, in 256ths, of the height of a direction
SECOND = 238, 195, 34.1333248, 4, 0, 27, 164, 191, 174, 90, 126, 32  # and of its angle
MOST_TAPS = 12  # SAMPLE_COUNT of Samples: High
RANGE_CHECKS = "distance", "none"


@dataclass(frozen=True)
class UnityOptions(Bordered):
    """Options of ``unity-urp``."""

    taps: int = option(8, "SAMPLE_COUNT", limits=(1, MOST_TAPS))
    beta: float = option(0.004, "kBeta, part of its depth by which a point is moved up", limits=(0.0, 1.0))
    epsilon: float = option(0.0001, "kEpsilon, square of a length in world units", limits=(1e-12, 1e12))
    intensity: float = option(3.0, "Intensity", limits=(0.0, 1e6))
    falloff: float = option(100.0, "Falloff, distance along the axis at which occlusion ends", limits=(1e-6, 1e12))
    contrast: float = option(0.6, "kContrast, power of the occlusion", limits=(0.05, 8.0))
    range_check: str = option(
        "distance", "weight of a surface, d = |z_Q - z_S|: 1 if d < R, else 0; or 1", choices=RANGE_CHECKS
    )
    tile: int = option(256, "texels of a side of the tile of noise", limits=(1, 256))
    shifted: bool = option(True, "whether sample i of n reads noise i / n of the tile further right and up")


class Taps(NamedTuple):
    """Taps, (n, 4): the first random number, from which noise on their sum is 1, the second, and the length.

    reach: R along the axis, unless any is inside. right, bottom: the texture's size. scale: of the sum.
    """

    points: Any
    reach: Any
    any_inside: bool
    right: Any
    bottom: Any
    beta: Any
    epsilon: Any
    nearer: Any  # 1 / falloff
    full_turns: Any  # 200 pi
    scale: Any
    contrast: float
    width: int
    tile: int
    shift: int  # the tile's side, or 0

    def start(self, view: Any, texel: Any) -> Any:
        """P, its image, its normal, how far its tangent plane is moved up, its fading, and the noise of all taps."""
        p, z = view.position(texel), view.surface(texel)
        near = larger(0, 1 - z * rounded(self.nearer, 0, z, 1))
        noises = (
            _noise(self, view, texel, 0), _noise(self, view, texel, 1), _noise(self, view, texel, 2),
            _noise(self, view, texel, 3), _noise(self, view, texel, 4), _noise(self, view, texel, 5),
            _noise(self, view, texel, 6), _noise(self, view, texel, 7), _noise(self, view, texel, 8),
            _noise(self, view, texel, 9), _noise(self, view, texel, 10), _noise(self, view, texel, 11),
        )  # fmt: skip
        return p, view.at(p), view.normal(texel), rounded(self.beta, 0, z) * z, near * near, noises

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius, and an intensity."""
        return self.scale > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R l v, v on the normal's side."""
        way, length = _way(self, view, here[5], s)
        return here[1] + select(view.fork(dot(here[2], way) >= 0), length, -length) * view.along(way)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """max(0, V.n - beta z) / (V.V + epsilon) and the fading, V from P to the point that the tap sees."""
        p, _, n, up, fading, _ = here
        u, v, _ = view.image(self.place(view, here, s))
        u, v = smaller(self.right, larger(0, u)), smaller(self.bottom, larger(0, v))
        deep = view.surface(seen)
        away = view.apart(view.point_at(u, v, deep), p)
        term = larger(0, dot(away, n) - up) / (dot(away, away) + rounded(self.epsilon, 0, z))
        return select((abs(z - deep) < rounded(self.reach, 0, z)) | self.any_inside, term * fading, 0)

    def background(self) -> Any:
        """The term of a tap before background."""
        return 0

    def end(self, total: Any) -> Any:
        """(R intensity / n sum)^contrast."""
        return power(smaller(1, larger(0, total * rounded(self.scale, 3, total))), self.contrast)


@formula
def _noise(taps: Any, view: Any, texel: Any, s: Any) -> Any:
    """The noise of tap s, of another texel of the tile: of that which the upper left corner of the texture holds."""
    moved, tile = (s * taps.shift) // taps.points.shape[0], taps.tile
    row, column = (np.int64(view.row(texel)) - moved) % tile, (np.int64(view.column(texel)) + moved) % tile
    return view.turn(np.uint32(row * taps.width + column))[0]


@formula
def _way(taps: Any, view: Any, noises: Any, s: Any) -> Any:
    """The direction of tap s, of two random numbers and noise, and its length."""
    noise = noises[0]
    for k in range(1, MOST_TAPS):
        noise = select(s == k, noises[k], noise)
    whole = select(surely(noise >= taps.points[s, 1]), number(1, noise), 0)
    height = 2 * ((noise + taps.points[s, 0]) - whole) - 1
    across = np.sqrt(larger(0, 1 - height * height))
    cosine, sine = view.cosine_and_sine((noise + taps.points[s, 2]) * rounded(taps.full_turns, 1, noise))
    return Vector(across * cosine, across * sine, height), rounded(taps.points[s, 3], 6, noise)


def unity_urp(buffers: Buffers, radius: float, points: None, weights: None, options: UnityOptions) -> Taps:
    """Return the formulas' numbers, in the textures' dtype; it makes its own taps."""
    if buffers.view.screen_to_world is None:
        raise InputError("estimator unity-urp measures distances along a camera's axis, and this view is of a display")
    (height, width), n = buffers.depth.shape, options.taps
    tile = min(options.tile, height, width)
    kind, unit, s = buffers.depth.dtype.type, cast_length(buffers.view, 1.0), np.arange(n)
    first, lengths = np.array(FIRST[:n]) / 256, (0.1 + 0.9 * (s / n) ** 2) * radius
    return Taps(
        points=np.stack([first, 1 - first, np.array(SECOND[:n]) / 256, lengths], axis=1).astype(kind),
        reach=kind(radius * unit),
        any_inside=options.range_check == "none",
        right=kind(width),
        bottom=kind(height),
        beta=kind(options.beta / unit),
        epsilon=kind(options.epsilon),
        nearer=kind(1 / (options.falloff * unit)),
        full_turns=kind(200 * PI),
        scale=kind(radius * options.intensity / n),
        contrast=options.contrast,
        width=width,
        tile=tile,
        shift=tile if options.shifted else 0,
    )


def run_on_tiles(buffers: Buffers, radius: float, points: Any, weights: Any, options: UnityOptions) -> Occlusion:
    """Return the occlusion of a view; InputError if its texture does not hold a whole tile of noise."""
    height, width = buffers.depth.shape
    if min(height, width) < options.tile:
        raise InputError(
            f"estimator unity-urp reads noise of other texels, and the texture of {width}x{height} texels does not "
            f"hold a tile of {options.tile}x{options.tile}: --parameter tile=N says its size"
        )
    return sum_formulas(unity_urp, buffers, radius, points, weights, options)


ENTRIES = (
    replace(
        summed(
            "unity-urp",
            unity_urp,
            title="obscurance by points in the half ball around the normal, of another noise each",
            source="Unity URP, SSAO.hlsl",
            formula=(
                "ao = (R intensity max(0, 1 - z / falloff)^2 / taps sum of (|z_Q - z_S| < R) max(0, v.n - beta z) / "
                "(v.v + epsilon))^contrast, v = S - P"
            ),
            options=UnityOptions,
            dimensions=0,
            integrand=("cosine", "linear"),
            count=8,
            converges=False,
            normals=True,
            texel_bytes=24,
            turns=True,
            rotation="tiles",
        ),
        run=run_on_tiles,
    ),
)
