"""Whether normals are those of the surface that a depth texture shows: angles, and camera planes that fit better."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lfssao.optics.camera import with_lens
from lfssao.optics.kernels.rays import write_lines
from lfssao.rendering.decoding import DISTANCES, Single, directions_of, distances, lengths, units
from lfssao.rendering.view_file import Description

_LINES = 128  # texels from one measured slope to the next are the texture's size over this
_COARSE = 32  # the same for halves, which do not resolve slopes between nearer texels
_SAMPLES = 5_000
_FEWEST = 50  # texels below which no angle is measured
_FLAT = 0.98  # length of the mean of the four triangles' normals at a texel where the surface bends little
_SHARE = 0.25  # share of the texels that are measured, those where the surface bends least
_OCTAVES = 12  # of the far plane's distance, or the planes', that are searched to each side
_FINE = 6  # steps an octave of the second search
_MOST_RATIO = 20.0  # octaves between planes beyond which nothing changes


class Angle(NamedTuple):
    """Angle between normals and surface."""

    degrees: float  # in the median
    texels: int  # at which it was measured
    smooth: bool  # whether the surface bends little at most of these; leaves and grass do at none


def angle_to_normals(from_above: Mapping[str, Single], description: Description) -> Angle:
    """Return the angle between normals and surface where the surface bends least.

    The surface is that of four triangles with the texels on each side. The angle is 0 where too few texels have one.
    from_above: the textures, row 0 above.
    """
    depth = from_above["depth"]
    normals = from_above["normals"]
    view = description.view
    height, width = depth.shape
    away = max(1, min(height, width) // (_COARSE if _is_half(depth) else _LINES))
    step = max(1, int((depth.size / _SAMPLES) ** 0.5))
    rows, columns = (part.ravel() for part in np.mgrid[away : height - away : step, away : width - away : step])
    places = [(rows + away * down, columns + away * right) for down, right in _CROSS]
    z = [distances(depth[j, i][None], description, j[None], i[None])[0] for j, i in places]
    known = np.isfinite(np.stack(z)).all(axis=0)
    points = []
    for (j, i), along in zip(places, z, strict=True):
        lines = np.empty((np.count_nonzero(known), 8))
        write_lines(view.rays, np.ravel(view.world_from_cast), i[known] + 0.5, j[known] + 0.5, lines)
        points.append(lines[:, :3] + along[known][:, None] * (lines[:, 3:6] - lines[:, :3]))
    centre, right, left, below, above = points
    with np.errstate(all="ignore"):
        sides = [
            units(np.cross(x, y)) for x in (right - centre, centre - left) for y in (below - centre, centre - above)
        ]
        mean = ((sides[0] + sides[1]) + (sides[2] + sides[3])) / 4
        n = directions_of(normals[rows[known], columns[known]], description)
        products = mean * n
        cosines = np.abs((products[:, 0] + products[:, 1]) + products[:, 2]) / (lengths(mean) * lengths(n))
    bent = lengths(mean)[np.isfinite(cosines)]
    cosines = cosines[np.isfinite(cosines)]
    if cosines.size < _FEWEST:
        return Angle(0.0, 0, False)
    least = float(np.quantile(bent, 1 - _SHARE))
    cosines = cosines[bent >= min(_FLAT, least)]
    return Angle(float(np.degrees(np.arccos(min(float(np.median(cosines)), 1.0)))), cosines.size, least >= _FLAT)


def _is_half(depth: Single) -> bool:
    """Whether half floats hold all numbers of a texture."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array_equal(depth, depth.astype(np.float16), equal_nan=True)


_CROSS = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))  # rows down and columns right of a texel


def planes_that_fit(from_above: Mapping[str, Single], description: Description) -> list[tuple[float, int, str]]:
    """Return angle, degrees, number of texels, and words for each far plane that scales a camera's screen space z."""
    view = description.view
    if (
        view.screen_to_world is None
        or view.linear
        or description.depth_kind in DISTANCES
        or _is_half(from_above["depth"])
    ):
        return []  # halves of screen space z look like those of nearer planes
    near, far, orthographic = view.lens[4:7].tolist()
    middle = 0.0 if orthographic else min(0.0, _MOST_RATIO - float(np.log2(far / near)))
    found: list[tuple[float, int, str, float]] = []
    for steps in (1, _FINE):
        for k in range(-_OCTAVES, _OCTAVES + 1) if steps == 1 else range(1 - _FINE, _FINE):
            exponent = middle + k / steps
            other = near + (far - near) * 2.0**exponent if orthographic else far * 2.0**exponent
            if not orthographic and other < 1.01 * near:
                continue
            lens = view.lens.copy()
            lens[5] = other
            angle, count, _ = angle_to_normals(
                from_above, replace(description, view=with_lens(view, lens, view.cast_from_world))
            )
            words = f"a far plane about {other / near:.2g} times as far as the near plane, which is {far / near:.3g}"
            if count:
                found.append((angle, count, f"planes {other - near:.2g} apart" if orthographic else words, exponent))
        if not found:
            return []
        middle = min(found)[3]
    return [each[:3] for each in found]
