"""Whether normals are those of the surface that a depth texture shows: angles, and camera planes that fit better."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lfssao.optics.camera import with_lens
from lfssao.optics.kernels.rays import write_lines
from lfssao.rendering.decoding import DISTANCES, Single, directions_of, distances, lengths
from lfssao.rendering.view_file import Description

_LINES = 128  # on which the surface is looked at: halves have no digits for the slope between neighbours of many more
_SAMPLES = 20_000
_FEWEST = 50  # texels that say something


def angle_to_normals(there: Mapping[str, Single], said: Description) -> float:
    """Median angle, degrees, between normals and the triangles of texels to the right and below; 0 for too few.

    The textures ``there`` begin above. Median, as triangles across silhouettes are of no surface.
    """
    depth, normals, view = there["depth"], there["normals"], said.view
    height, width = depth.shape
    far = max(1, min(height, width) // _LINES)
    step = max(1, int((depth.size / _SAMPLES) ** 0.5))
    rows, columns = np.mgrid[0 : height - far : step, 0 : width - far : step]
    if rows.size < _FEWEST:
        return 0.0
    places = (rows, columns), (rows, columns + far), (rows + far, columns)
    z = [distances(depth[j, i], said, j, i) for j, i in places]
    known = np.isfinite(z[0]) & np.isfinite(z[1]) & np.isfinite(z[2])
    corners = []
    for (j, i), along in zip(places, z, strict=True):
        lines = np.empty((np.count_nonzero(known), 8))
        write_lines(view.rays, np.ravel(view.world_from_cast), i[known] + 0.5, j[known] + 0.5, lines)
        corners.append(lines[:, :3] + along[known][:, None] * (lines[:, 3:6] - lines[:, :3]))
    a, b, c = corners
    faces = np.cross(b - a, c - a)
    with np.errstate(all="ignore"):
        n = directions_of(normals[rows[known], columns[known]], said)
        products = faces * n
        cosines = np.abs((products[:, 0] + products[:, 1]) + products[:, 2]) / (lengths(faces) * lengths(n))
    cosines = cosines[np.isfinite(cosines)]
    if cosines.size < _FEWEST:
        return 0.0
    return float(np.degrees(np.arccos(min(float(np.median(cosines)), 1.0))))


def planes_that_fit(there: Mapping[str, Single], said: Description) -> list[tuple[float, str]]:
    """Angles, degrees, and words, by other planes of a camera whose depth depends on their ratio, or their distance."""
    if said.view.screen_to_world is None or said.view.linear or said.depth_kind in DISTANCES:
        return []
    near, far, orthographic = said.view.lens[4:7].tolist()
    found: list[tuple[float, str, float]] = []
    exponents = list(range(-12, 13))
    for fine in (False, True):
        middle = min(found)[2] if fine else 0.0
        for k in exponents:
            exponent = middle + k / 12 if fine else float(k)
            factor = 2.0**exponent
            other = near + (far - near) * factor if orthographic else far * factor
            if other <= near * (1 + 1e-6) or not np.isfinite(other):
                continue
            lens = said.view.lens.copy()
            lens[5] = other
            changed = replace(said, view=with_lens(said.view, lens, said.view.cast_from_world))
            words = (
                f"planes {other - near:.2g} apart"
                if orthographic
                else f"a far plane about {other / near:.2g} times as far as the near plane, which is {far / near:.3g}"
            )
            found.append((angle_to_normals(there, changed), words, exponent))
    return [(angle, words) for angle, words, _ in found]
