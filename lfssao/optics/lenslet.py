"""Lenslet displays: a panel behind a grid of small lenses; each lens shows its part of the panel (LF figure 6).

Physical space is that of ``lfssao.optics.display``, but the lenses lie in z = 0 and the panel behind them, at z = gap.
A texel's light goes along the line from the texel's middle through the middle of its lens, in both directions alike:
each lens is a pinhole camera whose window is its elemental image, off the axis where the pitches of lenses and images
differ. A world point has an image behind each lens that sees it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import sqrt
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix
from lfssao.core.arguments import MOST_TEXELS, as_number, as_numbers, check_whole
from lfssao.errors import InputError, check_choice, errors_of, shown
from lfssao.optics.camera import pinhole_view
from lfssao.optics.view import View, check_size, finite_numbers, inverse_of

MIDDLES = ("lens", "corner")
MOST_LENSES = 10_000
# No display comes near these, and no number overflows.
_LEAST = 1e-9  # metres
_FARTHEST = 1e6  # metres
_LENGTHS = "panel_width", "panel_height", "lens_pitch", "image_pitch", "gap", "focal_length", "observer_distance"


class Window(NamedTuple):
    """Texels of a row or column of elemental images along one axis of the panel: the first, and the one after them."""

    first: int
    end: int
    steps: float  # pitches from the panel's middle to the image's, and from the middle of all lenses to the lens


@dataclass(frozen=True)
class LensletDisplay:
    """A panel behind lenses, numbered by rows from the upper left; InputError, by its file's key, if it is none.

    A texel belongs to the lens in whose elemental image its middle lies; on a border of two, to the right or the lower
    one. Images at the panel's edges that it does not hold whole have the texels that it holds.

    Attributes
    ----------
    name : str
        Its name in messages, files and the manifest.
    width, height : int
        Size of the panel's texture, texels.
    panel_width, panel_height : float
        Size of the panel, metres.
    lens_pitch, image_pitch : float
        From the middle of a lens to that of the next, and of an elemental image to that of the next, metres.
    gap : float
        From the lenses to the panel, metres.
    focal_length : float
        Of each lens, metres; the viewer alone reads it.
    observer_distance : float
        From the observers' plane to the lenses, metres.
    roi : ((x, y, z), (x, y, z))
        Lower and upper corner of the box of physical space that a scene is fitted into, metres; behind the lenses.
    middle : str
        What is in the middle of the panel: a 'lens', or the 'corner' of four.

    Examples
    --------
    >>> display = lfssao.find_views("near-eye")
    >>> display.count, display.size, display.place(112)
    (225, (15, 15), (slice(1001, 1159, None), slice(1001, 1159, None)))
    """

    KIND: ClassVar[str] = "lenslet"
    WORDS: ClassVar[tuple[str, str]] = ("lens", "lenses")
    TITLE: ClassVar[str] = "a lenslet display"

    name: str
    width: int
    height: int
    panel_width: float
    panel_height: float
    lens_pitch: float
    image_pitch: float
    gap: float
    focal_length: float
    observer_distance: float
    roi: tuple[tuple[float, float, float], tuple[float, float, float]]
    middle: str = "lens"

    def __post_init__(self) -> None:
        with errors_of(f"display {self.name}"):
            check_size(self.width, self.height)
            check_whole("texels of the panel", self.width * self.height, 1, MOST_TEXELS)
            for key in _LENGTHS:
                if not _LEAST <= as_number(getattr(self, key)) <= _FARTHEST:
                    between = f"it must be from {_LEAST:g} to {_FARTHEST:g} metres"
                    raise InputError(f"{key}: it is {shown(getattr(self, key))}, {between}")
            check_choice("middle", self.middle, MIDDLES)
            texel = max(self.panel_width / self.width, self.panel_height / self.height)
            if not self.image_pitch >= texel:
                raise InputError(f"image_pitch: it is {self.image_pitch:g}, less than a texel, {texel:g} metres")
            check_whole("lenses", self.count, 1, MOST_LENSES)
            box = as_numbers("roi", self.roi)
            if box.shape != (2, 3) or not np.abs(box).max() <= _FARTHEST or not (box[1] - box[0] >= _LEAST).all():
                raise InputError("roi: min must be less than max in x, y and z, metres")
            if not box[0, 2] >= _LEAST:
                raise InputError(f"roi.min: z = {box[0, 2]} is not behind the lenses, which lie in z = 0")

    @cached_property
    def _columns(self) -> list[Window]:
        return _windows(self.width, self.panel_width, self.image_pitch, self.middle)

    @cached_property
    def _rows(self) -> list[Window]:
        return _windows(self.height, self.panel_height, self.image_pitch, self.middle)

    @property
    def size(self) -> tuple[int, int]:
        """How many lenses are side by side, and one above the other."""
        return len(self._columns), len(self._rows)

    @property
    def count(self) -> int:
        """How many lenses there are."""
        return len(self._columns) * len(self._rows)

    @property
    def summary(self) -> str:
        """Its parts in words."""
        return "panel behind {} x {} lenses".format(*self.size)

    @property
    def sizes(self) -> set[tuple[int, int]]:
        """Width and height of elemental images, texels."""
        return {(c.end - c.first, r.end - r.first) for c in self._columns for r in self._rows}

    @property
    def screen_width(self) -> float:
        """Width of the lenses that the panel's images fill, metres: at z = 0, as pictures from an eye show."""
        return self.panel_width * (self.lens_pitch / self.image_pitch)

    @property
    def screen_height(self) -> float:
        """Height of the lenses that the panel's images fill, metres."""
        return self.panel_height * (self.lens_pitch / self.image_pitch)

    @property
    def lenses(self) -> list[tuple[float, float, float]]:
        """The middles of all lenses, metres."""
        return [(self.lens_pitch * c.steps, -self.lens_pitch * r.steps, 0.0) for r in self._rows for c in self._columns]

    @property
    def eye_box(self) -> float:
        """How far an eye may be from the middle, along x or y, that sees each lens show its own image alone, metres.

        Below 0 if there is no such eye.
        """
        bend = abs(1 + self.gap / self.observer_distance - self.gap / self.focal_length)
        drift = abs(self.lens_pitch * (1 + self.gap / self.observer_distance) - self.image_pitch)
        farthest = max(abs(window.steps) for window in (*self._columns, *self._rows))
        half_width = 0.5 * (self.image_pitch - self.lens_pitch * bend) - drift * farthest
        return half_width * self.observer_distance / self.gap

    def seen_place(self, points: NDArray[np.float64], eye: float) -> NDArray[np.float64]:
        """Return places on the panel at which rays from an eye through points of the lenses end, along x or y, metres.

        Each passes the lens that is nearest, and its slope changes by the distance from the lens's middle divided by
        the focal length.
        """
        start = _start(self.middle)
        middles = self.lens_pitch * (np.floor(points / self.lens_pitch + start) + (0.5 - start))
        slopes = (points - eye) / self.observer_distance - (points - middles) / self.focal_length
        return np.asarray(points + self.gap * slopes)

    def place(self, index: int) -> tuple[slice, slice]:
        """Return rows and columns of the panel's texture that hold a lens's elemental image."""
        row, column = divmod(index, len(self._columns))
        return slice(*self._rows[row][:2]), slice(*self._columns[column][:2])

    def with_resolution(self, width: int, height: int) -> "LensletDisplay":
        """Return the same display with a panel of another size, texels; InputError if it is none."""
        return replace(self, width=width, height=height)

    def view(self, index: int, physical_from_world: Matrix, guard: int = 0) -> View:
        """Return the view of one lens, a number from 0: a camera in its middle whose window is its elemental image.

        ``physical_from_world``, (3, 4) float64, is a map of one scale, as ``fit_roi`` makes it; the guard band is that
        of ``Display.view``. The planes enclose the ROI. InputError if there is no such lens, or an argument is none.
        """
        index = check_whole("lens", index, 0, self.count - 1)
        matrix = finite_numbers("physical_from_world", physical_from_world, 3, 4)
        inverse_of("physical_from_world", matrix)
        rows, columns = self.place(index)
        x, y, _ = self.lenses[index]
        a, b, c = matrix[0, :3].tolist()
        scale = sqrt((a * a + b * b) + c * c)
        low, high = (corner[2] for corner in self.roi)
        matrix[:2, 3] -= x, y
        across = self.width / self.panel_width  # texels a metre
        down = self.height / self.panel_height  # texels a metre
        c_u = (self.width / 2 + across * x) - columns.start
        c_v = (self.height / 2 - down * y) - rows.start
        planes = 0.9 * low / scale, 1.1 * high / scale
        lens = np.array([self.gap * across, self.gap * down, c_u + guard, c_v + guard, *planes, 0.0, 0.0])
        size = columns.stop - columns.start, rows.stop - rows.start
        width, height, guard = check_size(*size, guard)
        view = pinhole_view(lens, matrix / scale, width + 2 * guard, height + 2 * guard, guard)
        return replace(view, name=f"lens_{index:03d}")


def _start(middle: str) -> float:
    """Return pitches from the border of the lens or image in the middle, or right of it, to the middle."""
    return 0.5 if middle == "lens" else 0.0


def _windows(texels: int, length: float, pitch: float, middle: str) -> list[Window]:
    """Return the texels of each row or column of elemental images on an axis of that length, metres."""
    places = (np.arange(texels) + (0.5 - texels / 2)) * (length / texels)
    start = _start(middle)
    numbers = np.floor(places / pitch + start)
    ends = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), texels]
    steps = numbers + (0.5 - start)
    return [Window(first, end, float(steps[first])) for first, end in pairwise(ends)]
