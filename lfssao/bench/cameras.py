"""Algorithm 1 of a camera: from a texel's depth into the world and back, in rational numbers and step by step."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench.exact import Point
from lfssao.bench.running_error import DOUBLE, EXACT, PROBE, Arithmetic, Tracked
from lfssao.camera import Camera
from lfssao.kernels import mapping
from lfssao.matrix import Matrix
from lfssao.view import View, WorldToImage

ZERO, ONE = Tracked(Fraction(0)), Tracked(Fraction(1))


@dataclass(frozen=True)
class Eye:
    """A camera at the world's origin that looks along -Z (``lfssao.bench.measure.Mapping``).

    Attributes
    ----------
    projection : str
        'perspective' or 'orthographic'.
    distance, extent : float
        It sees ``extent`` of height at ``distance``.
    near, far : float
        Depths 0 and 1.
    width, height : int
        Texels.
    """

    projection: str
    distance: float
    extent: float
    near: float
    far: float
    width: int
    height: int

    @cached_property
    def view(self) -> View:
        """The camera's view."""
        target = (0.0, 0.0, -self.distance)
        camera = Camera(self.projection, (0.0, 0.0, 0.0), target, (0.0, 1.0, 0.0), self.extent, self.near, self.far)
        return camera.view(self.width, self.height)

    @property
    def to_image(self) -> WorldToImage:
        """As the kernels take it."""
        return self.view.world_to_image

    @property
    def back(self) -> Matrix | None:
        """The inverse."""
        return self._back

    @property
    def _back(self) -> Matrix:
        assert self.view.screen_to_world is not None  # a camera's
        return self.view.screen_to_world

    def exact(self, point: Point, offset: Point) -> Point | None:
        """Image of the world point of a texel's (u, v, depth), plus an offset; by similar triangles."""
        near, far, size = Fraction(self.near), Fraction(self.far), Fraction(self.extent) / self.height
        u_0, v_0 = Fraction(self.width, 2), Fraction(self.height, 2)
        u, v, depth = point
        if self.projection == "perspective":
            away = near * far / (far - depth * (far - near))
            size /= Fraction(self.distance)  # of a texel, at a distance of 1
            x, y = (u - u_0) * size * away + offset[0], (v_0 - v) * size * away + offset[1]
            away -= offset[2]
            if not away > 0:
                return None
            depth = (far - near * far / away) / (far - near)
            return u_0 + x / (size * away), v_0 - y / (size * away), depth
        depth -= offset[2] / (far - near)
        return u + offset[0] / size, v - offset[1] / size, depth

    def steps(self, arithmetic: Arithmetic, probe: bool = False) -> "_Steps":
        """What rounding can do."""
        return _Steps(self, EXACT if probe else arithmetic, PROBE if probe else 0.0)

    def landed(self, positions: NDArray[np.floating[Any]], offset: NDArray[np.floating[Any]]) -> NDArray[Any]:
        """U and v by the kernels' own lines, on arrays."""
        m, back = self.to_image.as_type(positions.dtype), np.ravel(self._back).astype(positions.dtype)
        with np.errstate(all="ignore"):  # outside the domain
            x, y, z, w = (mapping.affine_row.py_func(back, row, *np.moveaxis(positions, -1, 0)) for row in range(4))
            place = x / w, y / w, z / w
            rows = [
                mapping.affine_row.py_func(m, row, *place) + mapping.linear_row.py_func(m, row, *offset)
                for row in range(4)
            ]
            u, v, *_ = mapping.project_matrix.py_func(*rows)
        return np.stack([u, v], axis=-1)


class _Steps:
    """The steps of camera and kernels, with bounds of their errors; matrices are made in float64."""

    def __init__(self, eye: Eye, work: Arithmetic, probe: float) -> None:
        self._work, self._probe = work, probe
        make = EXACT if probe else DOUBLE
        distance, extent, near, far, width, height = (
            self._input(Fraction(n))
            for n in (eye.distance, eye.extent, eye.near, eye.far, eye.width, eye.height)
        )  # fmt: skip
        half = Tracked(Fraction(1, 2))
        u_0, v_0, focal = make.multiply(width, half), make.multiply(height, half), make.divide(height, extent)
        span = make.subtract(far, near)
        if eye.projection == "perspective":
            focal = make.multiply(focal, distance)
            a, b = make.divide(far, span), make.divide(make.multiply(far, near), span)
            forth = [[focal, ZERO, _minus(u_0), ZERO], [ZERO, _minus(focal), _minus(v_0), ZERO],
                     [ZERO, ZERO, _minus(a), _minus(b)], [ZERO, ZERO, _minus(ONE), ZERO]]  # fmt: skip
            last = [[ZERO, ZERO, ZERO, _minus(ONE)],
                    [ZERO, ZERO, _minus(make.divide(ONE, b)), make.divide(a, b)]]  # fmt: skip
        else:
            forth = [[focal, ZERO, ZERO, u_0], [ZERO, _minus(focal), ZERO, v_0],
                     [ZERO, ZERO, _minus(make.divide(ONE, span)), _minus(make.divide(near, span))],
                     [ZERO, ZERO, ZERO, ONE]]  # fmt: skip
            last = [[ZERO, ZERO, _minus(span), _minus(near)], [ZERO, ZERO, ZERO, ONE]]
        texel = make.divide(ONE, focal)
        first = [[texel, ZERO, ZERO, _minus(make.divide(u_0, focal))],
                 [ZERO, _minus(texel), ZERO, make.divide(v_0, focal)]]  # fmt: skip
        self.forth = [[work.rounded(entry) for entry in row] for row in forth]
        self.back = [[work.rounded(entry) for entry in row] for row in (*first, *last)]

    def _input(self, number: Fraction) -> Tracked:
        return Tracked(number, abs(float(number)) * self._probe)

    def image(self, point: Point, offset: Point) -> tuple[Tracked, Tracked, Tracked, bool | None]:
        """u, v and depth of a texel's world point plus an offset; whether it lies before the eye."""
        work = self._work
        screen = [work.rounded(self._input(n)) for n in point]
        way = [work.rounded(self._input(n)) for n in offset]
        x, y, z, w = (work.affine(row, screen) for row in self.back)
        place = [work.divide(n, w) for n in (x, y, z)]
        a, b, c, q = (work.add(work.affine(row, place), work.linear(row, way)) for row in self.forth)
        return work.divide(a, q), work.divide(b, q), work.divide(c, q), ZERO.surely(q)


def _minus(a: Tracked) -> Tracked:
    return Tracked(-a.value, a.error)
