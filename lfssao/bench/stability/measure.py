"""Errors of the kernels on one stiff case in float32 or float64, against exact arithmetic and error bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import ssao
from lfssao.ao.kernels import ssao as kernels
from lfssao.bench.stability.exact import OUTSIDE, Image, image, landed
from lfssao.bench.stability.tracked import DOUBLE, PROBED, Arithmetic, Tracked, holds, in_doubt
from lfssao.core.affine import to_4x4
from lfssao.core.places import affine_rows, linear_rows
from lfssao.core.vectors import Vector
from lfssao.optics.camera import screen_matrices
from lfssao.optics.display import slits_numbers
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX
from lfssao.optics.view import View, WorldToImage

Texture = NDArray[np.floating[Any]]

PATHS = ("float32", "float64")

# A path counts as degraded beyond 2^-8 texel, the resolution of the texture samplers of GPUs.
FINE = 2.0**-8


@dataclass(frozen=True, eq=False)
class Stiff:
    """Points, one sample each, and the texture they are looked up in."""

    view: View  # of one module or camera
    # (H, W, 3) float64: world points, one a texel of the module; for a camera its texels' u, v and depth
    positions: NDArray[np.float64]
    offset: NDArray[np.float64]  # (3,) float64: the sample's offset from each, world units
    depth: NDArray[np.float32]  # (H, W) float32: surface that the samples are compared with, image z; +infinity: none
    # (H, W) float32 or None: the same in a format of fewer bits, which the kernels get instead
    stored: NDArray[np.float32] | None = None
    step: float = 0.0  # largest distance between the two
    texels: Sequence[tuple[int, int]] | None = None  # rows and columns of the texels to measure; None: all
    turn: tuple[float, ...] = ()  # cosine and sine by which samples are turned about world z; none: they are not


@dataclass(frozen=True)
class Measured:
    """Errors of one path on a case, of image coordinates in texels or of occlusion."""

    condition: float | None  # condition number of the mapping, the largest over the points
    ulp: float | None  # the largest error in ulp of the coordinate or of one texel, whichever is more
    error: float  # the largest
    bound: float  # of it by error analysis, infinity if there is none; of an occlusion's RMS error as stated
    exceeded: int  # points whose error is larger than their bound, or whose decision is wrong and not undecided
    flipped: int  # decisions (occluded or not) that differ from exact ones
    undecided: int  # decisions that rounding can change
    decisions: int
    rms: float | None = None  # RMS error of an occlusion


def measure(case: Stiff, path: str) -> Measured:
    """Measure errors and decisions of a case in 'float32' or 'float64'."""
    dtype = np.dtype(path)
    bounded = Exact(case, Arithmetic.of(dtype))
    probed = Exact(case, PROBED)
    places, occluded = computed(case, dtype)
    texels = list(np.ndindex(case.depth.shape)) if case.texels is None else case.texels
    found = [(0.0, 0.0, 0.0, 0.0)]  # condition, ulp, error and bound of each coordinate
    exceeded = flipped = undecided = 0
    for texel in texels:
        if np.isinf(case.depth[texel]):  # no surface, no samples
            exceeded += bool(occluded[texel])
            continue
        exact, z = bounded.image(texel)
        right, doubtful = _decision(case, exact, z)
        wrong = right != bool(occluded[texel])
        flipped = flipped + wrong
        undecided = undecided + doubtful
        over = wrong and not doubtful
        if in_doubt(exact[2]):
            found.append((0.0, 0.0, 0.0, inf))
        elif exact[2]:
            for ours, a, off in zip(places[texel], exact[:2], probed.image(texel)[0][:2], strict=True):
                error, ulp = error_of(ours, a.value, dtype)
                over = over or not error <= a.error
                # Relative to the coordinate or to a texel, whichever is more: 0 is no harder than another coordinate.
                condition = off.error / (PROBED.probe * max(abs(float(a.value)), 1.0))
                found.append((condition, ulp, error, a.error))
        exceeded += over
    conditions, ulps, errors, bounds = zip(*found, strict=True)
    return Measured(max(conditions), max(ulps), max(errors), max(bounds), exceeded, flipped, undecided, len(texels))


class Exact:
    """The mapping of a case in an arithmetic, from the numbers of its view on, by the formulas' own text.

    The numbers of the mapping are made of the view's in float64, and rounded. A camera's AO is Algorithm 1, which makes
    its points of u, v and depth.
    """

    def __init__(self, case: Stiff, work: Arithmetic) -> None:
        make = DOUBLE if work.unit else work
        view = case.view
        kind = case.view.world_to_image.kind
        back = np.zeros(0)  # screen -> world, of a camera alone
        ends = np.zeros(4)  # the divisor's row, of a camera alone
        if kind == CROSSED_SLITS:
            numbers = slits_numbers(_given(view.cast_from_world, make), _given(view.lens, make).tolist())
        elif kind == MATRIX:
            forth, from_screen = screen_matrices([*_given(view.lens[:6], make), *view.lens[6:]])
            numbers = (np.array(forth) @ to_4x4(view.cast_from_world)).ravel()
            back = (to_4x4(view.world_from_cast) @ np.array(from_screen)).ravel()
            ends = numbers[12:]
        else:
            numbers = _given(view.world_to_image.numbers, make)

        def rounded(numbers: Any) -> list[Tracked]:
            return [work.rounded(x if isinstance(x, Tracked) else make.number(x)) for x in numbers]

        rows = rounded([*numbers[:8], *ends, *numbers[8:12]])
        self._case = case
        self._work = work
        self._kind = kind
        self._lens = rounded(numbers[12:])
        self._back = rounded(back)
        self._at: Any = partial(affine_rows, rows)
        self._along: Any = partial(linear_rows, rows)
        self._unprojected: Any = partial(affine_rows, self._back)

    def image(self, texel: tuple[int, ...]) -> tuple[Image, Tracked]:
        """Return the image point of a texel's sample, and its image z."""
        point, offset = (Vector(*map(self._work.given, x)) for x in (self._case.positions[texel], self._case.offset))
        if self._back:  # Algorithm 1, lines 1 to 3
            homogeneous = self._unprojected(point)
            point = Vector(homogeneous.u / homogeneous.z, homogeneous.v / homogeneous.z, homogeneous.q / homogeneous.z)
        moved = self._along(offset)
        if self._case.turn:
            cosine, sine = map(self._work.given, self._case.turn)
            moved = cosine * self._along(Vector(offset.x, offset.y, 0))
            moved = moved + sine * self._along(Vector(-offset.y, offset.x, 0))
            moved = moved + self._along(Vector(0, 0, offset.z))
        place = self._at(point) + moved
        z = place.z / place.q if self._kind == MATRIX else place.z
        return image(self._kind, self._lens, place, z), z


def _given(numbers: NDArray[np.float64], work: Arithmetic) -> NDArray[Any]:
    """Return inputs of an arithmetic, an array of the same shape."""
    return np.array([work.given(x) for x in numbers.flat], object).reshape(numbers.shape)


def error_of(ours: Any, exact: Fraction, dtype: np.dtype[Any], least: float = 1.0) -> tuple[float, float]:
    """Error of a number, absolute and in ulp of the exact one, or of ``least`` if that is more."""
    error = abs(float(Fraction(float(ours)) - exact)) if np.isfinite(ours) else inf
    return error, error / float(np.spacing(dtype.type(max(abs(float(exact)), least))))


def computed(case: Stiff, dtype: np.dtype[Any]) -> tuple[Texture, NDArray[np.bool_]]:
    """Image coordinates (H, W, 2) and decisions (H, W) of the kernels; AO of one sample is 0 or 1."""
    view = case.view
    turn = case.turn
    surface = case.depth if case.stored is None else case.stored
    positions = case.positions.astype(dtype)
    depth = surface.astype(dtype)
    if view.screen_to_world is not None:  # Algorithm 1
        positions = ssao.unprojected(depth, view.screen_to_world)
    turns = np.full((*depth.shape, 2), turn, dtype).transpose(2, 0, 1) if turn else None
    decided = ssao.algorithm2(depth, positions, view.world_to_image, case.offset[None, :], 1.0, turns).texture
    return _kernel_image(view.world_to_image, positions, case.offset.astype(dtype), turn), decided > 0


def _kernel_image(to_image: WorldToImage, positions: Texture, offset: Texture, turn: Sequence[float]) -> Texture:
    """U and v of points + offset, (H, W, 2), by the kernels' own lines, on arrays; any numbers outside the domain."""
    projection = to_image.as_type(positions.dtype)
    kind, m = projection
    if kind == mapping.DISPLAY:
        points = np.ascontiguousarray((positions + offset).reshape(-1, 3))
        image = np.empty_like(points)
        mapping.land(projection, points, image)
        return image[:, :2].reshape(*positions.shape[:-1], 2)
    affine = mapping.affine_row
    way = kernels.offset_row
    places: Any = np.moveaxis(positions, -1, 0)
    with np.errstate(all="ignore"):  # outside the domain
        turns = np.array(turn, m.dtype)[:, None] if turn else None
        ways = kernels.transform_offsets.py_func(offset[None, :], projection, turns)
        rows = (affine(m, row, *places) + way(ways, 0, row, turns, turns, 0) for row in range(4))
        if kind == MATRIX:
            u, v, *_ = mapping.project_matrix(*rows)
        else:
            a, b, c, _ = rows
            u, v, *_ = mapping.project_crossed_slits(mapping.slits_of(m), a, b, c)
    return np.stack([u, v], axis=-1)


def _decision(case: Stiff, seen: Image, z: Tracked) -> tuple[bool, bool]:
    """Whether a sample is occluded, and whether errors of its image and of depths can change that."""

    def hides(texel: int | None) -> Any:
        depth = inf if texel is OUTSIDE else float(case.depth.flat[texel])
        return Tracked(Fraction(depth), case.step, z.arithmetic) < z if depth < inf else np.False_

    here, others = landed(seen, case.depth.shape)
    found = hides(here)
    doubtful = in_doubt(found) or others is None
    return holds(found), doubtful or any(in_doubt(each) or each != found for each in map(hides, others or ()))
