"""Bounds of the estimators that, as Algorithms 1 and 2, count decisions about points of a ball: one outcome a point.

``point``, ``hemisphere``, ``vo-points`` and ``vo-points-normal``. Each point is occluded, clear or open as in
``lfssao.kernels.outcomes``; what these estimators decide beside the depth has outcomes of its own:

- The half ball's turn, offset . normal < 0. Where rounding may change the sign both sides are taken: the point is
  occluded if both are, clear if both are, else open. (VO's reflection by the tangent plane is no decision: its lift
  min(above, 0) has no jump, so an error of ``above`` is one of the place.)
- The range check, distance^2 <= reach, or distance <= R; and VO's thickness, z - z_Q <= reach. A point is occluded for
  sure if it lies behind and in range for sure, and may be if it may be both.
- Line 7's other form, and VO on cameras: the surface's depth is made from a position and has an error itself.

Shares grow with each decision, the remap 2 max(0, share - 1/2) with the share, and both ways of VO to make one of two
radii with each of the two: bounds go through. VO's points have weights, whose sum takes the place of the count.

The other estimators are no counts: they sum distances, horizons and areas that jump where a look-up falls into another
texel, by as much as the surface there differs. No interval of them is known; they must have equal bits.

How a place may be off. Its coordinates P + o are summed in any order with the mapping's rows, which is as if each
coordinate were off by T r (abs(p) + abs(o)), T = 7 the roundings of a row (``lfssao.kernels.outcomes``). VO's o is made
of an offset by two reflections; no term of it, taken through them and a row in either order, is rounded more than
``_ROUNDINGS`` times, so a coordinate is off by that times the sizes of its terms.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.estimator import Value
from lfssao.kernels import outcomes
from lfssao.kernels.mapping import MATRIX
from lfssao.kernels.rounding import FLUSHED, SAFETY
from lfssao.matrix import Matrix
from lfssao.oracle.bounds import Bounds, FloatArray, Texture, down_to_single, merge_bounds, share_bounds, up_to_single
from lfssao.oracle.error_model import ErrorModel, find_model
from lfssao.sums import sum_in_order
from lfssao.view import WorldToImage

Bools = NDArray[np.bool_]
Numbers = NDArray[np.int64]

_ROW = 7  # roundings of a term of a mapping's row
_ROUNDINGS = 24  # of a term of a reflected offset, rows included; 16 if they are counted
_CHUNK = 256


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The textures and the mapping that points are decided by.

    Attributes
    ----------
    depth : (H, W) float32
        Image z, +infinity where there is no surface.
    positions : (H, W, 3) float32
        World coordinates.
    world_to_image : WorldToImage
        The mapping; renderers have its numbers rounded to float32.
    cast_from_world : (3, 4)
        World -> cast space; its last row is read by VO, rounded likewise.
    normals : (H, W, 3) float32 or None
        Unit normals, for estimators that read them.
    directions : (H, W, 3) float32 or None
        Unit viewing directions, for VO's thickness.
    """

    depth: Texture
    positions: Texture
    world_to_image: WorldToImage
    cast_from_world: Matrix
    normals: Texture | None = None
    directions: Texture | None = None


@dataclass(frozen=True, eq=False)
class Estimate:
    """How another estimator than LF's was run.

    Attributes
    ----------
    name : str
        Of the estimator.
    points, weights : (n, 3), (n,) float64, or None
        Its samples.
    options : mapping
        All of its parameters.
    cast_from_world : (3, 4)
        Of the view.
    """

    name: str
    points: FloatArray | None
    weights: FloatArray | None
    options: Mapping[str, Value]
    cast_from_world: Matrix

    @property
    def is_bounded(self) -> bool:
        """Whether intervals are known, of a view whose directions are not."""
        return self.name in BOUNDED and not float(self.options.get("thickness", 0.0)) > 0

    def bounds(
        self,
        depth: Texture,
        positions: Texture,
        normals: Texture | None,
        world_to_image: WorldToImage,
        radius: float,
        model: ErrorModel,
    ) -> Bounds | None:
        """Bounds of its occlusion of these textures, None where there is none; arguments as of ``point_bounds``."""
        if self.points is None or not self.is_bounded:
            return None
        given = Surfaces(depth, positions, world_to_image, self.cast_from_world, normals)
        return point_bounds(self.name, given, radius, self.points, self.weights, self.options, model)


def point_bounds(
    name: str,
    surfaces: Surfaces,
    radius: float,
    points: NDArray[np.floating[Any]],
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion.

    Parameters
    ----------
    name : str
        Of the estimator.
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    weights : (n,) or None
        Their weights, read by VO's.
    options : mapping
        All of the estimator's parameters.
    model : str or ErrorModel
        What float32 arithmetic may do; not an exact one, under which there is one right value.

    Returns
    -------
    Bounds or None
        None where no interval is known: of another estimator, or where a texture that it reads is not given.

    Raises
    ------
    InputError
        If there is no such model, or weights are wrong.
    """
    if name not in _BOUNDS or (name in NORMALS and surfaces.normals is None):
        return None
    if float(options.get("thickness", 0.0)) > 0 and surfaces.directions is None:
        return None
    table = np.asarray(points, np.float64)
    return _BOUNDS[name](surfaces, radius, table, weights, options, find_model(model))


@dataclass(frozen=True, eq=False)
class _Points:
    """One point of each texel that sees a surface, (n,): where it lands, and by how much that may be off."""

    u: FloatArray
    v: FloatArray
    z: FloatArray
    doubt: FloatArray
    may: Bools
    must: Bools


@dataclass(frozen=True, eq=False)
class _Field:
    """The texels that see a surface, and the surfaces that points are compared with."""

    given: Surfaces
    model: ErrorModel
    at: Numbers = field(init=False)
    places: FloatArray = field(init=False)
    numbers: FloatArray = field(init=False)
    axis: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        at = np.flatnonzero(self.given.depth.ravel() < np.inf)
        mapping = self.given.world_to_image
        object.__setattr__(self, "at", at)
        object.__setattr__(self, "places", self.given.positions.reshape(-1, 3)[at].astype(np.float64))
        object.__setattr__(self, "numbers", mapping.as_type(np.float32).astype(np.float64))
        object.__setattr__(self, "axis", self.given.cast_from_world[2].astype(np.float32).astype(np.float64))

    @property
    def is_camera(self) -> bool:
        """Whether the mapping is a matrix."""
        return self.given.world_to_image.kind == MATRIX

    def land(self, points: FloatArray, doubt: FloatArray) -> _Points:
        """Where points (n, 3), whose coordinates are off by ``doubt``, lie in the image."""
        n, r = len(points), self.model.operation
        shape = max(1, -(-n // _CHUNK)), _CHUNK
        given, off = np.zeros((shape[0] * _CHUNK, 3)), np.zeros((shape[0] * _CHUNK, 3))
        given[:n], off[:n] = points, doubt
        image, error, sure = np.empty((*shape, 3)), np.empty((*shape, 3)), np.empty(shape, np.bool_)
        errors = np.array([r, self.model.quotient, self.model.root])
        kind = self.given.world_to_image.kind
        outcomes.map_positions(
            given.reshape(*shape, 3), off.reshape(*shape, 3), kind, self.numbers, errors, image, error, sure
        )
        u, v, z = image.reshape(-1, 3)[:n].T
        error = error.reshape(-1, 3)[:n]
        may = ~(error[:, 0] == -np.inf)
        error = error * SAFETY + np.array([self.model.coordinate, self.model.coordinate, 0.0])
        return _Points(u, v, z, error, may, sure.ravel()[:n])

    def rows_of(self, sizes: FloatArray) -> FloatArray:
        """By how much coordinates may be off that stand for the rounding of rows, of their terms' sizes."""
        t = _ROW * self.model.operation
        return t * (1 + t) * sizes

    def axis_depth(self, points: FloatArray, doubt: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cast z of points (n, 3) and its error, by the last row of ``cast_from_world``."""
        a, b, c, d = self.axis
        z = (a * points[:, 0] + b * points[:, 1] + c * points[:, 2]) + d
        sizes = np.abs(points) + doubt
        off = self.rows_of(sizes) + doubt
        error = (abs(a) * off[:, 0] + abs(b) * off[:, 1] + abs(c) * off[:, 2]) + self.rows_of(np.array(abs(d)))
        return z, error * SAFETY + FLUSHED * (4 + abs(a) + abs(b) + abs(c))

    def decide(self, points: _Points, hides: Callable[[Numbers, Numbers], tuple[Bools, Bools]]) -> tuple[Bools, Bools]:
        """Whether points may be, and are for sure, occluded.

        Parameters
        ----------
        points : _Points
            One of each texel.
        hides : callable
            ``hides(which, texels)``: whether a texel's surface may hide, and hides for sure, the point of a number.
        """
        height, width = self.given.depth.shape
        with np.errstate(invalid="ignore"):  # at the mapping's singularity
            u_low, u_high = points.u - points.doubt[:, 0], points.u + points.doubt[:, 0]
            v_low, v_high = points.v - points.doubt[:, 1], points.v + points.doubt[:, 1]
        near = points.may & ~(u_high < 0) & ~(u_low >= width) & ~(v_high < 0) & ~(v_low >= height)
        known = near & np.isfinite(points.doubt[:, 2])
        for end in (u_low, u_high, v_low, v_high):
            known &= np.isfinite(end)
        first, last = (
            [np.where(known, np.clip(low, 0, size - 1), 0).astype(np.int64) for low, size in ends]
            for ends in (((u_low, width), (v_low, height)), ((u_high, width), (v_high, height)))
        )
        known &= (last[0] - first[0] <= 1) & (last[1] - first[1] <= 1)  # else next to the mapping's singularity
        may, must = near & ~known, known & points.must
        must &= (u_low >= 0) & (u_high < width) & (v_low >= 0) & (v_high < height)
        for down, right in product((0, 1), repeat=2):
            touched = np.flatnonzero(known & (first[0] + right <= last[0]) & (first[1] + down <= last[1]))
            hit, sure = hides(touched, (first[1][touched] + down) * width + first[0][touched] + right)
            may[touched] |= hit
            must[touched] &= sure
        return may, must

    def bounds(self, lower: Texture, upper: Texture, opened: NDArray[np.int32]) -> Bounds:
        """Bounds of textures from those of the texels that see a surface; 0 elsewhere."""
        shape = self.given.depth.shape
        low, high, some = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        low.flat[self.at], high.flat[self.at], some.flat[self.at] = lower, upper, opened
        return Bounds(low, high, some)


def _shares(
    half: bool,
    surfaces: Surfaces,
    radius: float,
    points: FloatArray,
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: ErrorModel,
) -> Bounds:
    """Bounds of ``point``, or with ``half`` of ``hemisphere``."""
    texels = _Field(surfaces, model)
    offsets = radius * points
    # R and s rounded to nearest, and their product.
    relative = ((1 + 2.0**-24) ** 2 * (1 + model.operation) - 1) * (1 + 2.0**-30)
    low, high = _surface_depths(texels, options["surface"] == "positions")
    in_range = _range_check(texels, radius) if options["range_check"] else None
    fewest, most = np.zeros(len(texels.at), np.int32), np.zeros(len(texels.at), np.int32)
    for offset in offsets:

        def outcome(which: Numbers, side: float | FloatArray, o: FloatArray = offset) -> tuple[Bools, Bools]:
            """Of the points numbered, the offset on one side or on the other."""
            turned = np.reshape(side, (-1, 1)) * o
            off = texels.rows_of(np.abs(texels.places[which]) + np.abs(o)) + relative * np.abs(o)
            landed = texels.land(texels.places[which] + turned, off)

            def hides(number: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
                z, e = landed.z[number], landed.doubt[number, 2]
                may, must = low[texel] < z + e, high[texel] < z - e
                if in_range is not None:
                    near, surely = in_range(which[number], texel)
                    may, must = may & near, must & surely
                return may, must

            return texels.decide(landed, hides)

        everywhere = np.arange(len(texels.at))
        if not half:
            may, must = outcome(everywhere, 1.0)
        else:
            below, surely = _below(texels, offset, relative)
            may, must = outcome(everywhere, np.where(surely, -1.0, 1.0))
            either = np.flatnonzero(below & ~surely)
            other = outcome(either, -1.0)
            may[either] |= other[0]
            must[either] &= other[1]
        fewest += must
        most += may
    ends = share_bounds(len(points), model)
    if options.get("remap"):
        ends = _remapped(ends[0], model, -1), _remapped(ends[1], model, 1)
    return texels.bounds(ends[0][fewest], ends[1][most], most - fewest)


def _surface_depths(texels: _Field, forward: bool) -> tuple[FloatArray, FloatArray]:
    """Least and largest depth that a texel's surface may be compared with, (H * W,)."""
    flat = texels.given.depth.ravel().astype(np.float64)
    low, high = flat.copy(), flat.copy()
    if forward:
        landed = texels.land(texels.places, np.zeros_like(texels.places))
        low[texels.at] = np.where(landed.may, landed.z - landed.doubt[:, 2], np.inf)
        high[texels.at] = np.where(landed.must, landed.z + landed.doubt[:, 2], np.inf)
    small = np.abs(flat) < 2.0**-126  # may be flushed to zero
    return np.where(small, np.minimum(low, 0), low), np.where(small, np.maximum(high, 0), high)


def _range_check(texels: _Field, radius: float) -> Callable[[Numbers, Numbers], tuple[Bools, Bools]]:
    """Whether a texel's surface may be, and is for sure, no farther than R from the place of a texel, by its number.

    The sum of squares is rounded 5 times, R^2 3 times; if distances are compared, both have the error of a root more.
    """
    relative = (10 * texels.model.operation + 2 * texels.model.root) * SAFETY
    places = texels.given.positions.reshape(-1, 3).astype(np.float64)
    reach = float(radius) * float(radius)

    def check(which: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
        x, y, z = (places[texel] - texels.places[which]).T
        square = (x * x + y * y) + z * z
        return square * (1 - relative) - FLUSHED <= reach, square * (1 + relative) + FLUSHED <= reach

    return check


def _below(texels: _Field, offset: FloatArray, relative: float) -> tuple[Bools, Bools]:
    """Whether an offset, relatively so far off, may and does for sure lie below each texel's surface."""
    normals = _flat(texels.given.normals)[texels.at].astype(np.float64)
    parts = normals * offset
    above = (parts[:, 0] + parts[:, 1]) + parts[:, 2]
    size = (np.abs(parts[:, 0]) + np.abs(parts[:, 1])) + np.abs(parts[:, 2])
    r = texels.model.operation
    error = size * ((3 * r * (1 + 3 * r) + relative) * (1 + relative) * SAFETY) + np.where(size > 0, FLUSHED, 0.0)
    return above < error, above < -error


def _flat(texture: Texture | None) -> Texture:
    """A texture of vectors as (H * W, 3)."""
    assert texture is not None  # point_bounds has looked
    return texture.reshape(-1, 3)


def _remapped(shares: Texture, model: ErrorModel, sign: int) -> Texture:
    """Ends of 2 max(0, share - 1/2), of which the difference is rounded."""
    above = shares.astype(np.float64) - 0.5
    moved = 2 * np.maximum(above + sign * model.operation * np.abs(above), 0)
    return down_to_single(moved) if sign > 0 else up_to_single(moved)


def _hidden_volume(
    tangent: bool,
    surfaces: Surfaces,
    radius: float,
    points: FloatArray,
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: ErrorModel,
) -> Bounds:
    """Bounds of ``vo-points``, or with ``tangent`` of ``vo-points-normal``, of one radius or two."""
    volume = _Volume(tangent, _Field(surfaces, model), points, weights, options)
    first, second = volume.at(radius), float(options["second"])
    if second == 0:
        return first
    other = volume.at(second * radius)
    if options["combine"] == "minimum":
        return merge_bounds([first, other])
    # a + b (1 - a), or 1 - (1 - a) (1 - b): of numbers up to 1, rounded four times. Of zeros it is zero.
    ends = []
    for one, two, sign in ((first.lower, other.lower, -1), (first.upper, other.upper, 1)):
        a = one.astype(np.float64)
        both = a + two.astype(np.float64) * (1 - a)
        ends.append(np.maximum(both + sign * 4 * model.operation * SAFETY * (both > 0), 0))
    assert first.open is not None
    assert other.open is not None
    return Bounds(up_to_single(ends[0]), down_to_single(ends[1]), first.open + other.open)


class _Volume:
    """The hidden share of the ball around each texel's place, by weighted points."""

    def __init__(
        self,
        tangent: bool,
        texels: _Field,
        points: FloatArray,
        weights: NDArray[np.floating[Any]] | None,
        options: Mapping[str, Value],
    ) -> None:
        from lfssao.estimators.surroundings import ball_mirrors  # late: the other estimators need none of it
        from lfssao.kernels.neighbourhood import TILE

        self._texels, self._points = texels, points.astype(np.float32).astype(np.float64)
        given = np.ones(len(points)) if weights is None else np.asarray(weights, np.float64)
        self._shares = (given / sum_in_order(given.tolist())).astype(np.float32).astype(np.float64)
        width = texels.given.depth.shape[1]
        mirrors = ball_mirrors(bool(options["randomize"]), int(options["seed"]), np.dtype(np.float32))
        row, column = np.divmod(texels.at, width)
        self._mirrors = mirrors[:, row % TILE, column % TILE].T.astype(np.float64)
        self._normals = np.zeros_like(texels.places)
        if tangent:
            self._normals = _flat(texels.given.normals)[texels.at].astype(np.float64)
        self._thickness = float(options["thickness"])
        depth = texels.given.depth.ravel().astype(np.float64)
        self._low, self._high = depth.copy(), depth.copy()
        if texels.is_camera:
            z, error = texels.axis_depth(texels.places, np.zeros_like(texels.places))
            self._low[texels.at], self._high[texels.at] = z - error, z + error

    def at(self, radius: float) -> Bounds:
        """Bounds at one radius; weights are added in any order, and what is above 1 is 1."""
        texels, r = self._texels, self._texels.model.operation
        fewest, most = np.zeros(len(texels.at)), np.zeros(len(texels.at))
        opened = np.zeros(len(texels.at), np.int32)
        for point, share in zip(self._points, self._shares, strict=True):
            may, must = self._hidden(point, radius)
            fewest += np.where(must, share, 0.0)
            most += np.where(may, share, 0.0)
            opened += (may & ~must).astype(np.int32)
        relative = (len(self._shares) + 4) * r * (1 + len(self._shares) * r)
        low = up_to_single(np.minimum(fewest * (1 - relative), 1))
        high = down_to_single(np.minimum(most * (1 + relative), 1))
        return texels.bounds(low, high, opened)

    def _hidden(self, point: FloatArray, radius: float) -> tuple[Bools, Bools]:
        """Whether one point of each texel's ball may be, and is for sure, hidden."""
        texels = self._texels
        offset, sizes = self._reflected(point)
        k = _ROUNDINGS * texels.model.operation
        off = k * (1 + k) * (np.abs(texels.places) + radius * sizes) + FLUSHED * (1 + radius)
        places = texels.places + radius * offset
        landed = texels.land(places, off)
        z, error = landed.z, landed.doubt[:, 2]
        if texels.is_camera:
            z, error = texels.axis_depth(places, off)
        reach, reach_error = self._reach()

        def hides(which: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
            nearest = z[which] - error[which] - self._high[texel]
            farthest = z[which] + error[which] - self._low[texel]
            may, must = farthest > 0, nearest > 2 * texels.model.smallest
            if reach is not None:
                slack = reach_error[which] + texels.model.operation * np.abs(farthest)
                may &= nearest <= reach[which] + slack
                must &= farthest <= reach[which] - slack
            return may, must

        return texels.decide(landed, hides)

    def _reflected(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The offset of each texel after both reflections, unit ball, and the sizes of its coordinates' terms."""
        m, n = self._mirrors, self._normals
        along = _dot(m, point)
        offset, sizes = (
            point - 2 * along[:, None] * m,
            np.abs(point) + 2 * _dot(np.abs(m), np.abs(point))[:, None] * abs(m),
        )
        above, size = _dot(offset, n), _dot(sizes, np.abs(n))
        k = _ROUNDINGS * self._texels.model.operation
        lifted = above < k * (1 + k) * size
        lift, size = np.where(lifted, np.minimum(above, 0), 0), np.where(lifted, size, 0)
        return offset - 2 * lift[:, None] * n, sizes + 2 * size[:, None] * np.abs(n)

    def _reach(self) -> tuple[FloatArray | None, FloatArray]:
        """How far behind its depth a surface hides, cast z, and by how much that is off; None: without end."""
        if not self._thickness > 0:
            return None, np.empty(0)
        w = _flat(self._texels.given.directions)[self._texels.at].astype(np.float64)
        axis = self._texels.axis[:3]
        steep, size = _dot(w, axis), _dot(np.abs(w), np.abs(axis))
        r = self._texels.model
        error = (self._thickness * size) * (8 * r.operation + r.quotient) * SAFETY + FLUSHED * (1 + self._thickness)
        return self._thickness * steep, error


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Dot products of vectors (n, 3) with one or as many."""
    product_ = a * b
    return (product_[:, 0] + product_[:, 1]) + product_[:, 2]


_BOUNDS: dict[str, Callable[..., Bounds]] = {
    "point": partial(_shares, False),
    "hemisphere": partial(_shares, True),
    "vo-points": partial(_hidden_volume, False),
    "vo-points-normal": partial(_hidden_volume, True),
}

# Those of them that read normals.
NORMALS = ("hemisphere", "vo-points-normal")

# The estimators of which intervals are known.
BOUNDED = tuple(_BOUNDS)
