"""Samples other than the reference's: tables and turns of other kinds and seeds, each with its name."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.samples import ROTATIONS, make_samples, sample_set, texel_turns
from lfssao.samples.methods import METHODS
from lfssao.samples.rotation import MOST_TILE
from lfssao.verify.bounds.bounds import FloatArray

_MOST_PLACED = 2**25  # texels of all views
SEEDS = 64  # number of seeds to try, of samples and of turns

TURNED = "samples turned by '{}'"  # the words of a change to another rotation, with braces for its name
Turns = Iterator[tuple[str, Callable[[], NDArray[np.floating[Any]]]]]


def other_noise(numbers: int, three: bool) -> Iterator[tuple[str, Callable[[Any], Any]]]:
    """Yield mistakes with noise vectors of 2 or 3 numbers, by name; functions of the vectors, (2 or 3, H, W).

    ``three`` tells whether an estimator reads vectors' z.
    """
    packed = "noise vectors are packed, (v + 1) / 2 in place of v"
    yield packed, lambda noise: (noise + 1) / 2
    if numbers == 3:
        yield "noise vectors' z is left out", lambda noise: noise[:2]
    elif three:
        yield f"{packed}, z too", lambda noise: (np.concatenate([noise, 0 * noise[:1]]) + 1) / 2
    yield "noise of rows from below", lambda noise: noise[:, ::-1]


def stretched_tiles(turns: NDArray[Any]) -> Iterator[tuple[str, Callable[[Any], Any]]]:
    """Yield mistakes with a repeated tile of turns, (2 or 3, H, W), by name; none if turns do not repeat."""
    height, width = turns.shape[1:]
    across = _period(turns[:, 0])
    down = _period(turns[:, :, 0])
    columns = _quotients(width, across)
    rows = _quotients(height, down)
    wrong = "tile of noise looked up at {} divided by its side, in place of the remainder"
    if across > 1:
        yield wrong.format("columns"), lambda noise: noise[:, :, columns]
    if down > 1:
        yield wrong.format("rows"), lambda noise: noise[:, rows]
        yield wrong.format("rows from below"), lambda noise: noise[:, ::-1][:, rows][:, ::-1]
    if across > 1 and down > 1:
        yield wrong.format("columns and rows"), lambda noise: noise[:, rows[:, None], columns]
        words = wrong.format("columns and rows from below")
        yield words, lambda noise: noise[:, ::-1][:, rows[:, None], columns][:, ::-1]
        i = np.arange(width) * across // width
        j = np.arange(height) * down // height
        yield "tile of noise once over the texture, not repeated", lambda noise: noise[:, j[:, None], i]


def _period(line: NDArray[Any]) -> int:
    """The period of the numbers of a line, (2 or 3, N), at most ``MOST_TILE``; 1 if they do not repeat."""
    sizes = range(1, min(MOST_TILE, line.shape[1] // 2) + 1)
    return next((size for size in sizes if np.array_equal(line[:, size:], line[:, :-size])), 1)


def _quotients(count: int, side: int) -> NDArray[np.int64]:
    """Indices below ``count`` divided by a tile's side, modulo the side."""
    return np.arange(count) // side % side


def other_turns(
    rotation: str, seed: int, height: int, width: int, places: Mapping[str, tuple[int, int]] | None = None
) -> Turns:
    """Yield turns (2, H, W) of other kinds and seeds, and of other texels, by name; functions compute them.

    ``places`` are the view's column and row in one texture of all views, by the layout of that texture.
    """

    @cache
    def turns_of(name: str, rows: int, columns: int, number: int) -> NDArray[np.floating[Any]]:
        return texel_turns(name, rows, columns, number, np.dtype(np.float32))

    for name in ROTATIONS:
        if name not in ("none", rotation):
            yield TURNED.format(name), partial(turns_of, name, height, width, seed)
    if rotation == "none":
        return
    yield "turns of (row, column)", lambda: turns_of(rotation, width, height, seed).transpose(0, 2, 1)
    for words, down, across in (
        ("the next column", 0, 1),
        ("the column before", 0, -1),
        ("the next row", 1, 0),
        ("the row before", -1, 0),
        ("the next column and row", 1, 1),
    ):

        def shifted_turns(down: int = down, across: int = across) -> NDArray[np.floating[Any]]:
            larger = turns_of(rotation, height + 1, width + 1, seed)
            rows = np.clip(np.arange(height) + down, 0, height)
            columns = np.clip(np.arange(width) + across, 0, width)
            return larger[:, rows[:, None], columns]

        yield f"turns of {words}", shifted_turns
    for layout, (across, down) in (places or {}).items():
        if 0 < (height + down) * (width + across) <= _MOST_PLACED:
            words = f"turns by the place in a texture of all views {layout}, not in the view's own"

            def placed_turns(down: int = down, across: int = across) -> NDArray[np.floating[Any]]:
                return turns_of(rotation, height + down, width + across, seed)[:, down:, across:]

            yield words, placed_turns
    yield "turns of rows from below", lambda: turns_of(rotation, height, width, seed)[:, ::-1]
    yield "turns of columns from the right", lambda: turns_of(rotation, height, width, seed)[:, :, ::-1]


def turn_seeds(rotation: str, seed: int) -> Iterator[tuple[str, int]]:
    """Yield other seeds of turns, each with its name; only 'hash' has seeds."""
    for number in range(SEEDS) if rotation == "hash" else ():
        if number != seed:
            yield f"turns of seed {number} in place of {seed}", number


def other_tables(samples: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Yield other tables of the same number of samples in the ball or disk, each with its text."""
    n, d = samples.shape
    tables = {
        f"samples of '{name}'": make_samples(name, n)
        for name, method in METHODS["ball"].items()
        if d == 3 and (method.most is None or n <= method.most)
    }
    for k, axis in enumerate("xyz"[:d]):
        tables[f"samples mirrored in {axis}"] = samples * np.where(np.arange(d) == k, -1.0, 1.0)
        tables[f"samples without {axis}"] = samples * np.where(np.arange(d) == k, 0.0, 1.0)
    tables["samples mirrored in all axes"] = -samples
    for words, order in (("x and y", [1, 0, 2]), ("y and z", [0, 2, 1]), ("x and z", [2, 1, 0]))[: 3 if d == 3 else 1]:
        tables[f"samples with {words} exchanged"] = samples[:, order[:d]]
    length = np.linalg.norm(samples, axis=1, keepdims=True)
    tables["samples on the sphere of radius R"] = samples / np.where(length > 0, length, 1.0)
    for kind, table in tables.items():
        if not np.array_equal(table, samples):
            yield kind, table


@cache
def _table(domain: str, method: str, n: int, seed: int, **options: float) -> FloatArray:
    return sample_set(domain, method, n, seed, **options).points


def table_seeds(samples: FloatArray, sampling: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Tables with other seeds, by their texts.

    ``sampling`` has the method and the seed of the samples; if they do not give the samples, there are no tables.
    """
    n, d = samples.shape
    method = sampling.get("method")
    own_seed = sampling.get("seed")
    whole = {"r_min": 0.0, "r_max": 1.0}
    ring = {"r_min": 0.8, "r_max": 1.0}
    for domain, options in (("ball", ring), ("ball", whole)) if d == 3 else (("disk", {}),):
        with suppress(InputError):  # a table of a file has no method
            tables = [_table(domain, str(method), n, seed, **options) for seed in (own_seed, *range(SEEDS))]
            if np.array_equal(tables[0], samples):
                seeds = {f"samples of seed {k} in place of {own_seed}": table for k, table in enumerate(tables[1:])}
                return {words: table for words, table in seeds.items() if not np.array_equal(table, samples)}
    return {}
