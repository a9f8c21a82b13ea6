"""Quilts: pinhole views of a screen from eyes in a row before it, as displays behind a sheet of lenses take them.

Physical space is that of ``lfssao.optics.display``: the screen lies in z = 0, the eyes at z = -distance.
"""

from dataclasses import dataclass, replace
from math import atan, degrees, sqrt
from typing import ClassVar

import numpy as np

from lfssao.core.affine import Matrix, transform_points
from lfssao.core.arguments import MOST_TEXELS, as_number, as_numbers, check_whole
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError, check_choice, errors_of, shown
from lfssao.optics.camera import Camera
from lfssao.optics.view import View, check_size, finite_numbers, inverse_of

SPACINGS = ("ends", "middles")
MOST_VIEWS = 1000  # of a row or a column
# No display comes near these, and no number overflows.
_ANGLES = (0.01, 179.9)  # degrees
_LEAST = 1e-9  # metres
_FARTHEST = 1e9  # metres
_LIMITS = {"aspect": (1e-3, 1e3), "screen_height": (1e-6, 1e6), "field_of_view": _ANGLES, "view_cone": _ANGLES}


@dataclass(frozen=True)
class Quilt:
    """Sheared pinhole views, numbered from the leftmost eye; InputError, with the key of its file, if there is none.

    Attributes
    ----------
    name : str
        Its name in messages, files and the manifest.
    columns, rows : int
        Views side by side, and one above the other, in a picture of all: view 0 is below on the left.
    width, height : int
        Size of a view's texture, texels, which need not be square.
    aspect : float
        Width of the screen divided by its height.
    screen_height : float
        Height of the screen, metres.
    field_of_view : float
        Vertical angle under which the middle eye sees the screen, degrees.
    view_cone : float
        Angle at the screen's middle between the outermost directions, degrees.
    roi : ((x, y, z), (x, y, z))
        Lower and upper corner of the box of physical space that a scene is fitted into, metres.
    spacing : str
        'ends': the first and the last eye are at the ends of the cone; 'middles': each eye is in the middle of one of
        as many equal angles of it.

    Examples
    --------
    >>> quilt = lfssao.find_views("looking-glass-portrait")
    >>> quilt.count, round(quilt.distance, 3), quilt.file_name("statue")
    (48, 0.654, 'statue_qs8x6a0.75.png')
    """

    KIND: ClassVar[str] = "quilt"
    WORDS: ClassVar[tuple[str, str]] = ("view", "views")
    TITLE: ClassVar[str] = "a quilt of cameras' views"
    UNIT: ClassVar[str] = "metres"

    name: str
    columns: int
    rows: int
    width: int
    height: int
    aspect: float
    screen_height: float
    field_of_view: float
    view_cone: float
    roi: tuple[tuple[float, float, float], tuple[float, float, float]]
    spacing: str = "ends"

    def __post_init__(self) -> None:
        with errors_of(f"display {self.name}"):
            for key in ("columns", "rows"):
                check_whole(key, getattr(self, key), 1, MOST_VIEWS)
            check_size(self.width, self.height)
            check_whole("texels of all views", self.count * self.width * self.height, 1, MOST_TEXELS)
            for key, (least, most) in _LIMITS.items():
                if not least <= as_number(getattr(self, key)) <= most:
                    raise InputError(f"{key}: it is {shown(getattr(self, key))}, it must be from {least:g} to {most:g}")
            check_choice("spacing", self.spacing, SPACINGS)
            box = as_numbers("roi", self.roi)
            if box.shape != (2, 3) or not np.abs(box).max() <= _FARTHEST or not (box[1] - box[0] >= _LEAST).all():
                raise InputError("roi: min must be less than max in x, y and z, metres")
            if not box[0, 2] > -self.distance:
                raise InputError(f"roi.min: z = {box[0, 2]} reaches the eyes at z = {-self.distance:g}")

    @property
    def count(self) -> int:
        """How many views there are."""
        return self.columns * self.rows

    @property
    def summary(self) -> str:
        """Its parts in words."""
        return f"quilt of {self.columns} x {self.rows} views"

    @property
    def sizes(self) -> set[tuple[int, int]]:
        """Width and height of its views, texels."""
        return {(self.width, self.height)}

    @property
    def screen_width(self) -> float:
        """Width of the screen, metres."""
        return self.aspect * self.screen_height

    @property
    def distance(self) -> float:
        """Distance of the eyes from the screen's plane, metres."""
        sine, cosine = sincospi(self.field_of_view / 360)
        return float(0.5 * self.screen_height * (cosine / sine))

    def eye_x(self, index: int) -> float:
        """Place of an eye along their row, metres from the middle."""
        steps = self.count - (self.spacing == "ends")
        sine, cosine = sincospi(self.view_cone * (2 * index + 1 - self.count) / (2 * max(steps, 1)) / 180)
        return float(self.distance * (sine / cosine))

    def file_name(self, stem: str) -> str:
        """Name of a picture of all views, by which programs know how it is laid out."""
        return f"{stem}_qs{self.columns}x{self.rows}a{self.aspect:g}.png"

    def with_resolution(self, width: int, height: int) -> "Quilt":
        """Return the same quilt with textures of another size, texels; InputError if it is none."""
        return replace(self, width=width, height=height)

    def view(self, index: int, physical_from_world: Matrix, guard: int = 0) -> View:
        """Return the view of one eye, a number from 0 on the left: a camera whose window is the screen.

        ``physical_from_world``, (3, 4) float64, is a map of one scale, as ``fit_roi`` makes it; the guard band is that
        of ``Display.view``. The planes enclose the ROI. InputError if there is no such view, or an argument is none.
        """
        index = check_whole("view", index, 0, self.count - 1)
        inverse = inverse_of("physical_from_world", finite_numbers("physical_from_world", physical_from_world, 3, 4))
        distance = self.distance
        low, high = (corner[2] for corner in self.roi)
        places = np.array([[0, 0, -distance], [0, 0, 0], [0, self.screen_height, 0]], np.float64)
        eye, middle, above = transform_points(inverse, places).tolist()
        x, y, z = np.subtract(middle, eye).tolist()
        scale = sqrt((x * x + y * y) + z * z) / distance
        up = tuple(a - m for a, m in zip(above, middle, strict=True))
        planes = 0.9 * (distance + low) * scale, 1.1 * (distance + high) * scale
        camera = Camera("perspective", tuple(eye), tuple(middle), up, self.screen_height * scale, *planes)
        view = camera.view(self.width, self.height, guard, shift=scale * self.eye_x(index), aspect=self.aspect)
        return replace(view, name=f"view_{index:03d}")


@dataclass(frozen=True)
class StereoPair(Quilt):
    """The views of a left and a right eye as a quilt of two; its screen is the window that both eyes have."""

    TITLE: ClassVar[str] = "a stereo pair"
    UNIT: ClassVar[str] = "scene units"

    @classmethod
    def of_views(cls, left: View, right: View, separation: float) -> "StereoPair":
        """Return the pair that ``Camera.stereo`` made of eyes ``separation`` apart; its ROI begins at the screen.

        ZeroDivisionError or InputError if the views are no such pair.
        """
        width = left.width - 2 * left.guard
        height = left.height - 2 * left.guard
        f_u, f_v = left.lens[:2].tolist()
        distance = f_u * separation / float(right.lens[2] - left.lens[2])
        x = 0.5 * width * distance / f_u
        y = 0.5 * height * distance / f_v
        return cls(
            name="stereo pair",
            columns=2,
            rows=1,
            width=width,
            height=height,
            aspect=x / y,
            screen_height=2 * y,
            field_of_view=2 * degrees(atan(y / distance)),
            view_cone=2 * degrees(atan(0.5 * separation / distance)),
            roi=((-x, -y, 0.0), (x, y, distance)),
        )
