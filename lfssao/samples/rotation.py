"""Turning the sample set from texel to texel, so that neighbours do not err alike: textures of angles.

LF spawns random samples in the shader (section 4), SAO turns its spiral by a hash of the texel (equation 8), VO turns
by a texture of random numbers. An angle is a function of the texel's place alone, so that any renderer can make it.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.arguments import MOST_TEXELS, check_seed, check_unmasked, check_whole
from lfssao.core.elementary import PI
from lfssao.errors import InputError, check_choice, errors_of, shown
from lfssao.samples.kernels import spiral
from lfssao.samples.kernels.square import R2
from lfssao.samples.sets import FloatArray, fill, read_table

TILE = 64  # texels a side of the blue noise tile
LARGEST_ANGLE = 2.0**32  # radians
MOST_TILE = 256  # texels a side of a tile of one's own: another file that does not fit is a mistake
_LONGEST = 1024.0  # a coordinate of a noise vector

# 1 / (2 pi) in units of 2**-64 and the next 64 bits of it, the latter in two halves.
_INVERSE_TURN = 0x28BE60DB9391054A, 0x7F09D5F4, 0x7D4D3770


@dataclass(frozen=True)
class Rotation:
    """One way to give every texel an angle."""

    name: str  # its name in the registry and on the command line
    title: str  # one line for lists
    source: str  # the publication that describes it
    # ``angles(height, width, seed) -> (height, width)`` float64, half-turns in [0, 2)
    angles: Callable[[int, int, int], FloatArray]
    tile: int | None  # texels a side after which it repeats; None where it does not


def hash_radians(x: NDArray[np.int64], y: NDArray[np.int64], common: bool) -> NDArray[np.int32]:
    """Return radians by which SAO's spiral is turned at texels (x, y), whole numbers: equation 8 as C reads it.

    The hash is (30 x) ^ (y + 10 x y); in ``common`` renderers it is 10 ((3 x) ^ (y + x y)). It wraps to 32 bits,
    signed, as a shader's int does; textures of up to 14,000 texels a side stay below that.
    """
    word = 10 * ((3 * x) ^ (y + x * y)) if common else (30 * x) ^ (y + 10 * x * y)
    return np.asarray(word.astype(np.int32))


def float32_rounding(name: str, height: int, width: int) -> float:
    """By how many radians float32 rounds a rotation's angle added to a sample's own, at most; 0 but for hashes.

    That is half of float32's spacing at the largest of the texture's, and half more where float32 does not hold the
    hash itself.

    >>> float32_rounding("common-hash", 1080, 1920)
    2.0
    """
    if name not in ("common-hash", "sao-hash"):
        return 0.0
    y, x = np.indices((height, width))
    largest = np.abs(hash_radians(x, y, name == "common-hash").astype(np.float64)).max()
    spacing = float(np.spacing(np.float32(largest)))
    return spacing if spacing > 1 else 0.5 * spacing


def half_turns(radians: NDArray[np.int32]) -> FloatArray:
    """Return angles of whole numbers of radians in half-turns: float64 in [0, 2).

    The product with 1 / (2 pi) is taken in 128-bit integers modulo one turn and cut, once, to a multiple of 2**-52.
    """
    high, middle, low = (np.uint64(part) for part in _INVERSE_TURN)
    size = np.abs(radians.astype(np.int64)).astype(np.uint64)
    bits = np.uint64(32)
    turn = size * high + ((size * middle + ((size * low) >> bits)) >> bits)
    turn = np.where(radians < 0, ~turn + np.uint64(1), turn)
    return np.asarray((turn >> np.uint64(11)) * 2.0**-52)


def _hashed(common: bool, height: int, width: int, seed: int) -> FloatArray:
    y, x = np.indices((height, width))
    return half_turns(hash_radians(x, y, common))


def _random(height: int, width: int, seed: int) -> FloatArray:
    return fill(spiral.random_angles, (height, width), np.uint64(seed))


def _repeated(tile: Callable[[], FloatArray], height: int, width: int, seed: int) -> FloatArray:
    angles = tile()
    return angles[np.ix_(np.arange(height) % angles.shape[0], np.arange(width) % angles.shape[1])]


# Sixteenths of a turn, in half-turns; those that follow each other lie far apart.
_BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 8.0


def _blue_noise() -> FloatArray:
    """A table of the ranks 0 to 4095 by void and cluster (Ulichney 1993); tests/reference/dither.py makes it again.

    The texels below any threshold are spread evenly, also across the tile's borders.
    """
    return np.asarray((read_table("blue-noise") + 0.5) / (TILE * TILE / 2.0), np.float64)


def _gradient_noise(height: int, width: int, seed: int) -> FloatArray:
    """At the texels' centres."""
    y, x = np.indices((height, width)) + 0.5
    slope = 0.06711056 * x + 0.00583715 * y
    noise = 52.9829189 * (slope - np.floor(slope))
    return np.asarray(2.0 * (noise - np.floor(noise)))


def _recurrence(height: int, width: int, seed: int) -> FloatArray:
    """Fractions of a turn x a + y b modulo 1: in integers modulo 2**64, cut to a multiple of 2**-53 of a turn."""
    y, x = np.indices((height, width), np.uint64)
    return np.asarray(((x * R2[0] + y * R2[1]) >> np.uint64(11)) * 2.0**-52)


_BLUE_NOISE = f"4096 angles in a tile of {TILE} x {TILE} by void and cluster"
_SHIPPED = "the hash that other renderers ship"

ROTATIONS = {
    entry.name: entry
    for entry in (
        Rotation("none", "the same samples at every texel", "LF section 6", lambda *size: np.zeros(size[:2]), 1),
        Rotation("hash", "a random angle of each texel, of a seed", "Salmon et al. 2011", _random, None),
        Rotation("tiles", "16 angles in tiles of 4 x 4", "Bayer 1973", partial(_repeated, lambda: _BAYER), 4),
        Rotation("ign", "interleaved gradient noise", "Jimenez 2014", _gradient_noise, None),
        Rotation("blue-noise", _BLUE_NOISE, "Ulichney 1993", partial(_repeated, _blue_noise), TILE),
        Rotation("r2", "the recurrence R2", "Roberts 2018", _recurrence, None),
        Rotation("sao-hash", "a hash of the texel", "SAO equation 8", partial(_hashed, False), None),
        Rotation("common-hash", _SHIPPED, "SAO equation 8, varied", partial(_hashed, True), None),
    )
}


def check_rotation(name: str, seed: int) -> None:
    """Refuse, by an InputError, a name that no rotation has, and a seed out of range."""
    check_choice("rotation", name, ROTATIONS)
    check_seed("rotation_seed", seed)


def texel_angles(name: str, height: int, width: int, seed: int = 0) -> FloatArray:
    """Return the angle by which the samples of each texel are turned: (height, width) float64, half-turns in [0, 2).

    The name is a key of ``ROTATIONS``, the size is in texels, at least 1 each way, the guard band included, and the
    seed, 0 to 2**64 - 1, is that of 'hash'; the others do not read it. InputError if one is none of these.

    >>> lfssao.samples.texel_angles("tiles", 4, 4).shape
    (4, 4)
    """
    check_rotation(name, seed)
    size = check_whole("height", height, 1, MOST_TEXELS), check_whole("width", width, 1, MOST_TEXELS)
    return ROTATIONS[name].angles(*size, seed)


@lru_cache(maxsize=2, typed=True)  # modules of one display have one size; no answer of seed 1 for True
def texel_turns(name: str, height: int, width: int, seed: int, dtype: np.dtype[Any]) -> NDArray[np.floating[Any]]:
    """Return cosine and sine of ``texel_angles``, (2, height, width), each rounded once to the dtype; not to write to.

    A sample (x, y, z) of a texel becomes (x cos - y sin, x sin + y cos, z): its azimuth grows by the angle, as if the
    angle were added to phi in line 3 of LF's Algorithm 3. Arguments and errors are those of ``texel_angles``; the dtype
    is that of the depth texture, float32 or float64.

    >>> turns = texel_turns("tiles", 480, 640, 0, np.dtype(np.float32))  # for ``algorithm2(..., turns)``
    >>> turns.shape, turns[:, 0, 0].tolist()
    ((2, 480, 640), [1.0, 0.0])
    """
    angles = texel_angles(name, height, width, seed)
    turns = np.empty((2, *angles.shape), _arithmetic(dtype))
    spiral.turns_of(angles, turns)
    return turns


def _arithmetic(dtype: Any) -> np.dtype[Any]:
    """float32 or float64; InputError for all else."""
    if dtype is None or dtype not in (np.dtype(np.float32), np.dtype(np.float64)):  # to NumPy None is float64
        raise InputError(f"dtype is {shown(dtype)}, it must be float32 or float64")
    kind: np.dtype[Any] = np.dtype(dtype)
    return kind


def check_noise(noise: Any) -> None:
    """Refuse, by an InputError, all but angles (``check_angles``) and vectors (h, w, 2 or 3) of float32 or float64."""
    if not isinstance(noise, np.ndarray) or noise.ndim != 3:
        check_angles(noise)
        return
    check_unmasked("rotation", noise)
    if noise.dtype not in (np.float32, np.float64) or noise.shape[2] not in (2, 3) or 0 in noise.shape:
        found = f"{noise.dtype} {noise.shape}"
        raise InputError(f"rotation: vectors are {found}, expected float32 or float64 of shape (h, w, 2) or (h, w, 3)")
    if not (np.abs(noise) <= _LONGEST).all():
        raise InputError(f"rotation: a vector has a number that is not from {-_LONGEST:g} to {_LONGEST:g}")


def check_angles(radians: Any) -> None:
    """Refuse, by an InputError, all but an array (H, W) of float32 or float64, from -2**32 to 2**32."""
    check_unmasked("rotation", radians)
    if not isinstance(radians, np.ndarray) or radians.dtype not in (np.float32, np.float64) or radians.ndim != 2:
        kind = f"{radians.dtype} {radians.shape}" if isinstance(radians, np.ndarray) else type(radians).__name__
        raise InputError(f"rotation: angles are {kind}, expected radians (H, W) of float32 or float64")
    if not (np.abs(radians) <= LARGEST_ANGLE).all():
        raise InputError("rotation: an angle is not a number of radians from -2**32 to 2**32")


def angle_turns(radians: NDArray[np.floating[Any]], dtype: np.dtype[Any]) -> NDArray[np.floating[Any]]:
    """Return cosine and sine of angles of one's own, a shader's hash for example: ``Buffers.turns``.

    Angles are radians, (H, W) float32 or float64, guard band included, from -2**32 to 2**32 (InputError if not); the
    dtype is that of the depth texture, float32 or float64. The result, (2, H, W), is rounded once from float64, where
    it is off by 1e-15 at most.

    >>> angle_turns(np.array([[0.0, 0.5]]), np.dtype(np.float64)).round(3).tolist()
    [[[1.0, 0.878]], [[0.0, 0.479]]]
    """
    check_angles(radians)
    angles = radians.astype(np.float64, order="C")
    turns = np.empty((2, *radians.shape), _arithmetic(dtype))
    whole = np.floor(angles / (2.0 * PI) + 0.5)  # turns, which are taken off in three parts, the first two exactly
    for part in spiral.TURN:
        angles -= whole * part
    spiral.turns_of(angles / PI, turns)
    return turns


def noise_turns(
    noise: NDArray[np.floating[Any]], height: int, width: int, dtype: np.dtype[Any]
) -> NDArray[np.floating[Any]]:
    """Return the turns of a texture's samples by angles or noise vectors of one's own: ``Buffers.turns``.

    noise: radians, (h, w), as of ``angle_turns``, or vectors as a shader reads them, (h, w, 2 or 3) in float32 or
    float64: along the view's rightward, upward direction and towards the viewer. It is of the texture's size, guard
    band included, or a square tile of at most 256 texels a side, which is repeated from the upper left texel on
    (InputError if neither). The result is (2, height, width), cosine and sine, or x and y as they are, and (3, height,
    width) where a vector has a z other than 0. Each is rounded once to the dtype, that of the depth texture.

    >>> noise_turns(np.array([[[0.6, 0.8, -1.0]]]), 2, 2, np.dtype(np.float32))[2].tolist()
    [[-1.0, -1.0], [-1.0, -1.0]]
    """
    check_noise(noise)
    with errors_of("rotation"):
        check_tile(noise.shape[:2], [(height, width)])
    rows, columns = (np.arange(size) % own for size, own in zip((height, width), noise.shape, strict=False))
    whole = noise[np.ix_(rows, columns)]
    if noise.ndim == 2:
        return angle_turns(whole, dtype)
    turns = np.moveaxis(whole, 2, 0).astype(_arithmetic(dtype), order="C")
    return turns if turns[2:].any() else turns[:2]


def check_tile(size: Sequence[int], sizes: Collection[tuple[int, int]]) -> None:
    """Refuse, by an InputError, angles or vectors whose size, height and width, is neither a texture's nor a tile's."""
    h, w = size
    wanted = " or ".join(f"{width}x{height}" for height, width in sorted(sizes)[:3])
    for height, width in sizes:
        if (h, w) != (height, width) and not h == w <= MOST_TILE:
            tile = f"a tile is a square of up to {MOST_TILE}x{MOST_TILE}"
            raise InputError(f"it has {w}x{h} texels, textures with guard have {wanted}, {tile}")
