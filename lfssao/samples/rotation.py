"""Turning the sample set from texel to texel, so that neighbours do not err alike: textures of angles.

LF turns nothing, SAO turns its spiral by a hash of the texel (equation 8), VO turns by a texture of random numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from lfssao.errors import InputError, no_such
from lfssao.samples.kernels import dither
from lfssao.samples.kernels.spiral import COMMON, PAPER
from lfssao.samples.method import fill
from lfssao.samples.sets import FloatArray

TILE = 64  # texels a side of the blue noise tile


@dataclass(frozen=True)
class Decorrelation:
    """One way to give every texel an angle."""

    name: str  # its name in the registry and on the command line
    title: str  # one line for lists
    source: str  # the publication that describes it
    # ``angles(height, width) -> (height, width)`` float64, half-turns in [0, 2)
    angles: Callable[[int, int], FloatArray]
    tile: int | None  # texels a side after which it repeats; None where it does not


def _none(height: int, width: int) -> FloatArray:
    return np.zeros((height, width))


def _hashed(variant: int) -> Callable[[int, int], FloatArray]:
    return lambda height, width: fill(dither.hashed_angles, (height, width), variant)


def _repeated(tile: Callable[[], FloatArray]) -> Callable[[int, int], FloatArray]:
    def angles(height: int, width: int) -> FloatArray:
        made = tile()
        return made[np.ix_(np.arange(height) % made.shape[0], np.arange(width) % made.shape[1])]

    return angles


@cache
def _interleaved() -> FloatArray:
    ranks = np.empty((4, 4), np.int64)
    dither.ordered(ranks)
    return ranks / 8.0  # sixteenths of a turn, in half-turns


@cache
def _blue_noise() -> FloatArray:
    ranks = np.empty((TILE, TILE), np.int64)
    dither.void_and_cluster(np.uint64(0), ranks)
    return np.asarray((ranks + 0.5) / (TILE * TILE / 2.0), np.float64)


_BLUE_NOISE = f"4096 angles in a tile of {TILE} x {TILE} by void and cluster"

DECORRELATIONS = {
    entry.name: entry
    for entry in (
        Decorrelation("none", "the same samples at every texel", "LF section 6", _none, 1),
        Decorrelation("hash", "turned by a hash of the texel", "SAO equation 8", _hashed(PAPER), None),
        Decorrelation(
            "common-hash",
            "turned by the hash that other renderers ship",
            "SAO equation 8, varied",
            _hashed(COMMON),
            None,
        ),
        Decorrelation("interleaved", "16 angles in tiles of 4 x 4", "Bayer 1973", _repeated(_interleaved), 4),
        Decorrelation("blue-noise", _BLUE_NOISE, "Ulichney 1993", _repeated(_blue_noise), TILE),
    )
}


def texel_angles(name: str, height: int, width: int) -> FloatArray:
    """Return the angle by which the samples of each texel are turned: (height, width) float64, half-turns in [0, 2).

    Parameters
    ----------
    name : str
        'none', 'hash', 'common-hash', 'interleaved' or 'blue-noise'.
    height, width : int
        Texels, at least 1 each.

    Raises
    ------
    InputError
        If there is no decorrelation of that name, or the size is not one.
    """
    if name not in DECORRELATIONS:
        raise no_such("decorrelation", name, DECORRELATIONS)
    if height < 1 or width < 1:
        raise InputError(f"the texture has {width} x {height} texels, it must have at least one each way")
    return DECORRELATIONS[name].angles(height, width)
