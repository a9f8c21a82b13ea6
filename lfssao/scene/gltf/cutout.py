"""Triangles of a transparent material: whole, cut out, or both, which is refused."""

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.materials import Look
from lfssao.scene.part import Part


def cut_out(file: File, part: Part, look: Look, alpha: NDArray[np.float32] | None) -> None:
    """Leave out the triangles whose alpha is below the material's cutoff everywhere.

    Alpha is factor x vertex (``alpha``, (V,)) x texture. InputError if it is below in a part of a triangle, as that
    part is no surface.
    """
    if look.least is None or not len(part.faces):
        return
    least = np.float32(look.least)
    factor = np.float32(look.alpha)
    at_corners = np.ones((1, 3), np.float32) if alpha is None else alpha[part.faces]
    low = factor * at_corners.min(axis=1)
    high = factor * at_corners.max(axis=1)
    if look.opacity is None:
        some = low < least
        every = high < least
        translucent = bool((low < 1).any())
    else:
        boxes = _boxes(part, look)
        some = _count(look.opacity * low.min() < least, boxes) > 0
        every = _count(look.opacity * high.max() >= least, boxes) == 0
        translucent = True
    some, every = (np.broadcast_to(each, len(part.faces)) for each in (some, every))
    if (some & ~every).any():
        raise InputError(
            f"{file.name}: {look.place} is transparent at a part of its triangles (alphaMode "
            f"{'BLEND' if look.blended else 'MASK'}), and what is cut out is no surface: it is not read"
        )
    if every.any():
        part.faces = part.faces[~every]
    if look.blended and translucent and len(part.faces):
        file.assets.note("some of its materials are translucent (alphaMode BLEND): they are opaque here")


def _boxes(part: Part, look: Look) -> tuple[NDArray[np.int64], ...]:
    """First and last row and column, (F,) each, of the texels that each triangle is read at."""
    assert part.uv is not None
    assert look.opacity is not None
    found = []
    for axis, size, wrap in ((1, look.opacity.shape[0], look.sampler[1]), (0, look.opacity.shape[1], look.sampler[0])):
        t = part.uv[:, axis][part.faces]
        low = t.min(axis=1)
        high = t.max(axis=1)
        if axis == 1:
            low, high = 1.0 - high, 1.0 - low
        if wrap == "repeat":
            tile = np.floor(low)
            low = low - tile
            high = high - tile
        low, high = np.clip((low, high), -2.0, 3.0)  # beyond, all is read anyway, and numbers of texels stay small
        first, last = (np.floor(each * size - 0.5).astype(np.int64) for each in (low, high))
        last += 1
        if wrap == "clamp":
            first, last = (np.clip(each, 0, size - 1) for each in (first, last))
        else:
            outside = (first < 0) | (last >= size)
            first = np.where(outside, 0, first)
            last = np.where(outside, size - 1, last)
        found += [first, last]
    return tuple(found)


def _count(texels: NDArray[np.bool_], boxes: tuple[NDArray[np.int64], ...]) -> NDArray[np.int64]:
    """Return how many texels of each box are set."""
    top, bottom, left, right = boxes
    sums = np.zeros((texels.shape[0] + 1, texels.shape[1] + 1), np.int64)
    sums[1:, 1:] = texels.cumsum(axis=0).cumsum(axis=1)
    return np.asarray(sums[bottom + 1, right + 1] - sums[top, right + 1] - sums[bottom + 1, left] + sums[top, left])
