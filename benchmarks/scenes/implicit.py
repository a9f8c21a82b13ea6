"""Solid shapes as distance functions, put together smoothly and turned into triangles.

A field is negative inside, positive outside and near the surface about the distance from it, in scene units.
Everything is + - * / sqrt, abs, minimum, maximum, floor, one element at a time: equal bits on every machine.
The polynomial smooth minimum and the primitives' formulas are Inigo Quilez's, "Distance functions" and
"Smooth minimum", https://iquilezles.org/articles/distfunctions/ and .../smin/.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Triple = tuple[float, float, float]
Distance = Callable[[Array, Array, Array], Array]
Axes = tuple[Array, Array, Array]

_FAR = 1.0e3


@dataclass(frozen=True)
class Part:
    """One piece of a field: a distance function, the box that holds its surface, and how it joins the rest.

    Attributes
    ----------
    distance : callable
        From coordinates x, y, z (arrays that broadcast) to signed distances, of the coordinates' dtype.
    low, high : (x, y, z)
        Corners of a box around the surface, scene units.
    blend : float
        Width of the zone over which it joins smoothly, scene units; 0 joins sharply.
    cuts : bool
        Whether it is taken away from what was there rather than added.
    """

    distance: Distance
    low: Triple
    high: Triple
    blend: float = 0.0
    cuts: bool = False

    def joined(self, blend: float) -> "Part":
        """Return this part, added with a smooth zone of width ``blend``."""
        return replace(self, blend=blend, cuts=False)

    def cutting(self, blend: float) -> "Part":
        """Return this part, taken away with a smooth zone of width ``blend``."""
        return replace(self, blend=blend, cuts=True)

    def mirrored(self) -> "Part":
        """Return this part reflected in the plane x = 0."""
        low = (-self.high[0], *self.low[1:])
        high = (-self.low[0], *self.high[1:])
        return replace(self, distance=lambda x, y, z: self.distance(-x, y, z), low=low, high=high)

    def with_relief(self, relief: Distance, reach: float) -> "Part":
        """Return this part with its surface raised by ``relief(x, y, z)``, at most ``reach`` scene units."""
        low, high = _box((self.low, self.high), reach)
        return replace(self, distance=lambda x, y, z: self.distance(x, y, z) - relief(x, y, z), low=low, high=high)


def both_sides(parts: Iterable[Part]) -> list[Part]:
    """Each part followed by its reflection in the plane x = 0."""
    return [side for part in parts for side in (part, part.mirrored())]


def frame(forward: Triple, up: Triple) -> tuple[Triple, Triple, Triple]:
    """Right-handed unit axes right, up, forward: forward as given, up as near to the given one as can be."""
    f = _unit(forward)
    r = _unit((up[1] * f[2] - up[2] * f[1], up[2] * f[0] - up[0] * f[2], up[0] * f[1] - up[1] * f[0]))
    return r, (f[1] * r[2] - f[2] * r[1], f[2] * r[0] - f[0] * r[2], f[0] * r[1] - f[1] * r[0]), f


def sphere(centre: Triple, radius: float) -> Part:
    """Ball of ``radius`` about ``centre``, scene units."""
    cx, cy, cz = centre

    def distance(x: Array, y: Array, z: Array) -> Array:
        return _length(x - cx, y - cy, z - cz) - radius

    return Part(distance, *_box((centre,), radius))


def ellipsoid(centre: Triple, radii: Triple, axes: tuple[Triple, Triple, Triple] | None = None) -> Part:
    """Ellipsoid about ``centre`` with ``radii`` along x, y, z or the unit vectors ``axes`` of `frame`."""
    cx, cy, cz = centre
    a, b, c = radii

    def distance(x: Array, y: Array, z: Array) -> Array:
        u, v, w = _in_frame(axes, x - cx, y - cy, z - cz)
        u = u / a
        v = v / b
        w = w / c
        scaled = _length(u, v, w)
        slope = _length(u / a, v / b, w / c)
        return scaled * (scaled - 1.0) / np.maximum(slope, 1e-6)

    return Part(distance, *_box((centre,), max(radii) if axes else radii))


def capsule(start: Triple, end: Triple, start_radius: float, end_radius: float) -> Part:
    """Rod with round ends from ``start`` to ``end`` whose radius goes linearly between the two given."""
    ax, ay, az = start
    dx, dy, dz = (e - s for s, e in zip(start, end, strict=True))
    scale = 1.0 / (dx * dx + dy * dy + dz * dz)

    def distance(x: Array, y: Array, z: Array) -> Array:
        x = x - ax
        y = y - ay
        z = z - az
        along = x * (dx * scale) + y * (dy * scale) + z * (dz * scale)
        along = np.minimum(np.maximum(along, 0.0), 1.0)
        radius = start_radius + along * (end_radius - start_radius)
        return _length(x - along * dx, y - along * dy, z - along * dz) - radius

    return Part(distance, *_box((start, end), max(start_radius, end_radius)))


def torus(centre: Triple, normal: Triple, ring: float, tube: float) -> Part:
    """Ring of radius ``ring`` about the axis ``normal`` through ``centre``, as thick as radius ``tube``."""
    cx, cy, cz = centre
    nx, ny, nz = _unit(normal)

    def distance(x: Array, y: Array, z: Array) -> Array:
        x = x - cx
        y = y - cy
        z = z - cz
        height = x * nx + y * ny + z * nz
        # Rounding can make the square of the distance from the axis a little negative.
        flat = np.sqrt(np.maximum(x * x + y * y + z * z - height * height, 0.0)) - ring
        return np.sqrt(flat * flat + height * height) - tube

    return Part(distance, *_box((centre,), ring + tube))


def box(centre: Triple, half: Triple, rounding: float = 0.0) -> Part:
    """Box about ``centre`` with half sides ``half`` along x, y, z; its edges are rounded with a radius."""
    cx, cy, cz = centre
    hx, hy, hz = (h - rounding for h in half)

    def distance(x: Array, y: Array, z: Array) -> Array:
        x = np.abs(x - cx) - hx
        y = np.abs(y - cy) - hy
        z = np.abs(z - cz) - hz
        outside = _length(np.maximum(x, 0.0), np.maximum(y, 0.0), np.maximum(z, 0.0))
        return outside + np.minimum(np.maximum(np.maximum(x, y), z), 0.0) - rounding

    return Part(distance, *_box((centre,), half))


def intersection(first: Part, second: Part, blend: float) -> Part:
    """Only what lies in both parts, their edge rounded over a width ``blend``."""
    low = tuple(max(a, b) for a, b in zip(first.low, second.low, strict=True))
    high = tuple(min(a, b) for a, b in zip(first.high, second.high, strict=True))
    return Part(
        lambda x, y, z: -smooth_minimum(-first.distance(x, y, z), -second.distance(x, y, z), blend),
        (low[0], low[1], low[2]),
        (high[0], high[1], high[2]),
    )


def smooth_minimum(a: Array, b: Array, blend: float) -> Array:
    """Return the smaller of a and b, less up to ``blend`` / 4 where they differ by less than ``blend``."""
    if blend == 0.0:
        return np.minimum(a, b)
    near = np.maximum(blend - np.abs(a - b), 0.0)
    joined: Array = np.minimum(a, b) - near * near * (0.25 / blend)
    return joined


def wave(t: Array) -> Array:
    """Smooth wave of period 1 between -1 and 1 with its crests at whole t: a cosine made of two cubics."""
    u = np.abs(2.0 * (t - np.floor(t)) - 1.0)
    return u * u * (6.0 - 4.0 * u) - 1.0


def groove(t: Array, width: float) -> Array:
    """Return 1 at whole t, falling to 0 at ``width`` periods on either side: valleys between plates."""
    away = np.abs(t - np.floor(t + 0.5)) * (1.0 / width)
    inside = np.maximum(1.0 - away * away, 0.0)
    depth: Array = inside * inside
    return depth


def field_at(parts: Sequence[Part], x: Array, y: Array, z: Array) -> Array:
    """Field of all parts at the points x, y, z (arrays that broadcast); the same shape and dtype."""
    field = np.full(np.broadcast_shapes(x.shape, y.shape, z.shape), _FAR, x.dtype)
    for part in parts:
        field = _join(field, part, x, y, z)
    return field


def axis(low: float, high: float, cell: float) -> Array:
    """Grid coordinates from ``low`` to at least ``high`` in steps of ``cell``, (n,) float64, scene units."""
    return low + cell * np.arange(int((high - low) / cell) + 2)


def polygonise(parts: Sequence[Part], axes: Axes, relief: Distance | None = None) -> tuple[Array, Array]:
    """Triangles of the surface where the field of ``parts``, less ``relief``, is 0.

    Parameters
    ----------
    parts : sequence of Part
        Joined one after the other.
    axes : three (n,) float64 arrays
        Rising grid coordinates along x, y and z, scene units; steps may differ. The solid must lie within.
    relief : callable, optional
        By how much the surface is raised at x, y, z, scene units.

    Returns
    -------
    vertices : (V, 3) float64
        Scene units.
    faces : (F, 3) int32
        Counter-clockwise seen from outside; the surface is closed.

    Notes
    -----
    Marching cubes of Lewiner et al. 2003, which leaves no holes, as scikit-image has it.
    """
    from skimage.measure import marching_cubes  # late: the package must import fast

    field = _sampled(parts, axes)
    if relief is not None:
        field -= relief(*_open_grid(axes, (slice(None),) * 3))
    # A value of nearly 0 would put the vertices of many edges on one grid point: triangles without area.
    least = 0.05 * min(float((a[1:] - a[:-1]).min()) for a in axes)
    field = np.copysign(np.maximum(np.abs(field), np.float32(least)), field)
    places, faces, _, _ = marching_cubes(field, 0.0, allow_degenerate=True)
    # The extension may have been compiled to fused multiply-adds on another machine. Its last bits do not
    # survive the rounding to 1/1024 of a cell.
    places = np.floor(places.astype(np.float64) * 1024.0 + 0.5) / 1024.0
    vertices = np.stack([_on_axis(a, places[:, k]) for k, a in enumerate(axes)], axis=1)
    return vertices, faces.astype(np.int32)


def _sampled(parts: Sequence[Part], axes: Axes) -> NDArray[np.float32]:
    """Field at all grid points, float32; each part is evaluated where it can matter to the surface only."""
    margin = 2.0 * max(float((a[1:] - a[:-1]).max()) for a in axes)
    field = np.full([len(a) for a in axes], _FAR, np.float32)
    for part in parts:
        low, high = _box((part.low, part.high), part.blend + margin)
        window = tuple(
            slice(int(np.searchsorted(a, low[k])), int(np.searchsorted(a, high[k]))) for k, a in enumerate(axes)
        )
        field[window] = _join(field[window], part, *_open_grid(axes, window))
    return field


def _open_grid(axes: Axes, window: tuple[slice, ...]) -> Axes:
    x, y, z = (a[w].astype(np.float32) for a, w in zip(axes, window, strict=True))
    return x[:, None, None], y[None, :, None], z[None, None, :]


def _join(field: Array, part: Part, x: Array, y: Array, z: Array) -> Array:
    distance = part.distance(x, y, z)
    if part.cuts:
        return -smooth_minimum(-field, distance, part.blend)
    return smooth_minimum(field, distance, part.blend)


def _on_axis(coordinates: Array, places: Array) -> Array:
    """Coordinates at fractional places of an axis, linear between its points."""
    step = np.minimum(np.floor(places).astype(np.int64), len(coordinates) - 2)
    fraction = places - step
    between: Array = coordinates[step] * (1.0 - fraction) + coordinates[step + 1] * fraction
    return between


def _box(points: Sequence[Triple], margin: float | Triple) -> tuple[Triple, Triple]:
    mx, my, mz = margin if isinstance(margin, tuple) else (margin,) * 3
    xs, ys, zs = zip(*points, strict=True)
    return (min(xs) - mx, min(ys) - my, min(zs) - mz), (max(xs) + mx, max(ys) + my, max(zs) + mz)


def _unit(v: Triple) -> Triple:
    length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return v[0] / length, v[1] / length, v[2] / length


def _in_frame(axes: tuple[Triple, Triple, Triple] | None, x: Array, y: Array, z: Array) -> Axes:
    if axes is None:
        return x, y, z
    u, v, w = (x * a[0] + y * a[1] + z * a[2] for a in axes)
    return u, v, w


def _length(x: Array, y: Array, z: Array) -> Array:
    length: Array = np.sqrt(x * x + y * y + z * z)
    return length
