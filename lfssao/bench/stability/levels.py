"""``multiresolution`` at a texel on numbers with their exact value: its levels, coarse to fine, by the kernels' text.

The kernels go through a level's texels row by row. Here one texel asks for the coarse texels that it is upsampled from,
and those for theirs.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.kernels import multiresolution
from lfssao.ao.estimators.multiresolution import MultiresolutionOptions, level_pyramid
from lfssao.ao.textures import Buffers
from lfssao.bench.stability.tracked import Arithmetic, Tracked
from lfssao.core.numbers import larger, select, smaller
from lfssao.core.vectors import Vector

formulas: Any = multiresolution  # compiled code takes any numbers


@dataclass(frozen=True, eq=False)
class Levels:
    """Textures of a view in one of their dtypes, and the numbers that ``multiresolution`` takes."""

    buffers: Buffers  # with normals
    radius: float  # world units
    options: MultiresolutionOptions
    work: Arithmetic

    @cached_property
    def _numbers(self) -> Sequence[NDArray[np.int32]]:
        """Numbers of the texels of the textures that stand for a level's, the finest level first; -1 is none."""
        return level_pyramid(self.buffers.depth, self.options.levels)

    @cached_property
    def _radii(self) -> tuple[Tracked, Tracked]:
        """R and its square, rounded as the kernels take them."""
        dtype = self.buffers.depth.dtype.type
        with np.errstate(over="ignore"):  # the square of a very large radius is infinite
            return self.work.given(dtype(self.radius)), self.work.given(dtype(self.radius * self.radius))

    @cached_property
    def _passed_on(self) -> dict[tuple[int, int, int], tuple[Tracked, Tracked]]:
        """Maximum and sum that texels of levels pass on, as far as they are known."""
        return {}

    def occlusion(self, texel: int) -> Tracked:
        """Occlusion of a texel that shows a surface."""
        most, total = self._carried(0, *divmod(texel, self.buffers.depth.shape[1]))
        combined = most if self.options.combine == "maximum" else total / self.options.levels
        if self.options.combine == "both":
            combined = 1 - (1 - most) * (1 - combined)
        found: Tracked = select(combined > 0, smaller(combined, self.work.given(1)), self.work.given(0))
        return found

    def _carried(self, level: int, row: int, column: int) -> tuple[Tracked, Tracked]:
        """Return the maximum and the sum of a level's occlusion and of the coarser levels' behind it."""
        at = level, row, column
        if at not in self._passed_on:
            own = self._own(*at)
            most = own
            total = own
            if level + 1 < self.options.levels:
                peak, mean = self._upsampled(*at)
                most = larger(most, peak)
                total = total + mean
            self._passed_on[at] = most, total
        return self._passed_on[at]

    def _own(self, level: int, row: int, column: int) -> Tracked:
        """Return the occlusion of a texel of a level by the square of texels around it."""
        reach = self.options.kernel
        here = self._place(level, row, column)
        n = self._normal(level, row, column)
        total = self.work.given(0)
        for j, i in product(range(-reach, reach + 1), repeat=2):
            if (j or i) and self._shows(level, row + j, column + i):
                v = self._place(level, row + j, column + i) - here
                total = total + formulas.obscured(v, n, *self._radii)
        found: Tracked = total / ((2 * reach + 1) ** 2 - 1)
        return found

    def _upsampled(self, level: int, row: int, column: int) -> tuple[Tracked, Tracked]:
        """Return the weighted means of what the coarse texels around a texel pass on, its maximum and its sum."""
        here = self._place(level, row, column)
        n = self._normal(level, row, column)
        weights = peak = mean = self.work.given(0)
        for near, coarse in self._coarse(level, row, column):
            v = self._place(*coarse) - here
            w = near * formulas.upsampling_weight(v, n, self._normal(*coarse), self._radii[0])
            most, total = self._carried(*coarse)
            weights = weights + w
            peak = peak + w * most
            mean = mean + w * total
        known = weights > 0
        none = self.work.given(0)
        return select(known, peak / weights, none), select(known, mean / weights, none)

    def _coarse(self, level: int, row: int, column: int) -> Iterator[tuple[int, tuple[int, int, int]]]:
        """Yield the coarse texels around a texel, its own first, and their weights by distance, 9, 3, 3 and 1."""
        for down, across in product(range(2), repeat=2):
            at = level + 1, row // 2 + down * (2 * (row % 2) - 1), column // 2 + across * (2 * (column % 2) - 1)
            if self._shows(*at):
                yield (3 - 2 * down) * (3 - 2 * across), at

    def _shows(self, level: int, row: int, column: int) -> bool:
        """Whether there is a texel, and it shows a surface."""
        height, width = self._numbers[level].shape
        return 0 <= row < height and 0 <= column < width and bool(self._numbers[level][row, column] >= 0)

    def _place(self, level: int, row: int, column: int) -> Vector:
        return self._vector(self.buffers.positions, level, row, column)

    def _normal(self, level: int, row: int, column: int) -> Vector:
        return self._vector(self.buffers.normals, level, row, column)

    def _vector(self, texture: Any, level: int, row: int, column: int) -> Vector:
        """Return what a texture has of the texel that stands for a level's."""
        return Vector(*map(self.work.given, texture.reshape(-1, 3)[self._numbers[level][row, column]]))
