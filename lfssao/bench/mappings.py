"""The mapping of CROSSED_SLITS, exact and step by step as display and kernels compute it."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench.exact import Point, flat_image, to_physical
from lfssao.bench.running_error import DOUBLE, EXACT, PROBE, Arithmetic, Tracked, all_of
from lfssao.display import Display
from lfssao.kernels import mapping
from lfssao.matrix import Matrix
from lfssao.view import WorldToImage


@dataclass(frozen=True, eq=False)
class Slits:
    """A flat display with the linear diffuser and one module (``lfssao.bench.measure.Mapping``).

    Attributes
    ----------
    display : Display
        The display.
    physical_from_world : (3, 4) float64
        The affine map.
    """

    display: Display
    physical_from_world: Matrix

    @property
    def to_image(self) -> WorldToImage:
        """As the kernels take it."""
        return self.display.view(0, self.physical_from_world).world_to_image

    @property
    def back(self) -> None:
        """A module's mapping has no inverse."""
        return

    def exact(self, point: Point, offset: Point) -> Point | None:
        """Image of point + offset, in rational numbers."""
        x, y, z = (a + b for a, b in zip(point, offset, strict=True))
        return flat_image(self.display, 0, to_physical(self.physical_from_world, (x, y, z)))

    def steps(self, arithmetic: Arithmetic, probe: bool = False) -> "SlitsAnalysis":
        """What rounding can do."""
        return SlitsAnalysis(self.display, self.physical_from_world, arithmetic, probe)

    def landed(self, positions: NDArray[np.floating[Any]], offset: NDArray[np.floating[Any]]) -> NDArray[Any]:
        """U and v by the kernels' own lines, on arrays."""
        m = self.to_image.as_type(positions.dtype)
        rows = [
            mapping.affine_row.py_func(m, row, *np.moveaxis(positions, -1, 0))
            + mapping.linear_row.py_func(m, row, *offset)
            for row in range(3)
        ]
        with np.errstate(all="ignore"):  # outside the domain
            u, v, *_ = mapping.project_crossed_slits.py_func(*rows, *m[12:16])
        return np.stack([u, v], axis=-1)


class SlitsAnalysis:
    """Bounds for one module of a flat display, and its condition numbers.

    Parameters
    ----------
    display : Display
        Flat, with the linear diffuser.
    physical_from_world : (3, 4) float64
        The affine map.
    arithmetic : Arithmetic
        What the kernels compute in; what the mapping is made of is float64.
    probe : bool
        Nothing is rounded, but every input has a relative error of 2^-200.
    """

    def __init__(
        self, display: Display, physical_from_world: Matrix, arithmetic: Arithmetic, probe: bool = False
    ) -> None:
        self._probe = PROBE if probe else 0.0
        self._work = EXACT if probe else arithmetic
        make = EXACT if probe else DOUBLE
        module = display.modules[0]
        m_x, m_z, y_o, z_o, wide, high, width, height = (
            self._input(n)
            for n in (
                module.x, module.z, display.observer_height, display.observer_z, display.screen_width,
                display.screen_height, module.width, module.height,
            )
        )  # fmt: skip
        rows = [[self._input(float(entry)) for entry in row] for row in physical_from_world]
        u_scale = make.divide(width, wide)
        v_scale = make.divide(Tracked(-height.value, height.error), high)
        for row, centre, scale, slit in ((rows[0], m_x, u_scale, m_z), (rows[1], y_o, v_scale, z_o)):
            row[3] = make.subtract(row[3], centre)
            factor = make.multiply(scale, slit)
            row[:] = [make.multiply(entry, factor) for entry in row]
        half = Tracked(Fraction(1, 2))
        u_0 = make.add(make.multiply(width, half), make.multiply(u_scale, m_x))
        v_0 = make.add(make.multiply(height, half), make.multiply(v_scale, y_o))
        self._rows = [[self._work.rounded(entry) for entry in row] for row in rows]
        self._slits = self._work.rounded(m_z), self._work.rounded(z_o)
        self._middle = self._work.rounded(u_0), self._work.rounded(v_0)

    def _input(self, number: float) -> Tracked:
        return Tracked(Fraction(number), abs(number) * self._probe)

    def image(self, point: Point, offset: Point) -> tuple[Tracked, Tracked, Tracked, bool | None]:
        """u, v and z of point + offset as the kernels compute them; world coordinates, rounded on their way in.

        And whether z lies between the slits; None where rounding may decide.
        """
        work = self._work
        place = [work.rounded(Tracked(n, abs(float(n)) * self._probe)) for n in point]
        way = [work.rounded(Tracked(n, abs(float(n)) * self._probe)) for n in offset]
        a, b, c = (work.add(work.affine(row, place), work.linear(row, way)) for row in self._rows)
        u = work.add(self._middle[0], work.divide(a, work.subtract(self._slits[0], c)))
        v = work.add(self._middle[1], work.divide(b, work.subtract(self._slits[1], c)))
        return u, v, c, all_of(c.surely(self._slits[0]), self._slits[1].surely(c))
