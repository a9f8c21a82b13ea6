"""The virtual viewer of lenslet displays: what an eye sees through the lenses, composed from the panel's texture.

An eye looks through each point of a lens, which is thin: a ray's slope changes by the point's distance from the lens's
middle divided by the focal length, and the ray ends in one texel of the panel. So through an ideal lens, whose panel is
at its focus, it would see one texel all over; at other gaps the lens magnifies a part of its elemental image. Rays that
end in the image of another lens show that one, as on the display. Equations of x and y are the same and do not mix.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.arguments import as_number, as_numbers, as_whole
from lfssao.core.memory import check_available
from lfssao.errors import InputError, shown
from lfssao.optics.lenslet import LensletDisplay
from lfssao.rendering.viewer import Photograph, picture_size
from lfssao.rendering.views import chosen_modules


class LensletView:
    """A lenslet display and the textures, ``channels`` channels each, that its lenses show.

    Lenses are the numbers of those that will be given textures (default: all); the others stay dark. ``panel``, (H, W,
    channels) float32, is the panel's texture as far as it is known, else 0. InputError if there is no lens of a number,
    or memory is too small.

    >>> display = lfssao.find_views("near-eye").with_resolution(216, 216)
    >>> view = LensletView(display, [112])
    >>> view.put(112, np.ones((16, 16, 3), np.float32))
    >>> view.photograph(0.0, 0.0, width=90).image[45, 45].tolist()
    [1.0, 1.0, 1.0]
    """

    def __init__(self, display: LensletDisplay, lenses: Any = None, channels: int = 3) -> None:
        self.display = display
        self._missing = set(chosen_modules(display, lenses))
        check_available(f"display {display.name}: the panel", 5.0 * display.width * display.height * channels)
        self.panel = np.zeros((display.height, display.width, channels), np.float32)
        self._lit = np.zeros((display.height, display.width), np.bool_)

    def put(self, index: int, *textures: NDArray[np.float32]) -> None:
        """Give a lens its texture, (H, W, C) float32, or several with C channels together; they are copied.

        InputError if the lens is not one of those that have none yet, the shape is another, or a value is not finite.
        """
        if as_whole(index) not in self._missing:
            raise InputError(f"lens {shown(index)} is not one of {self.missing}")
        named = f"the texture of lens {index}"
        place = self.display.place(index)
        pixels = np.concatenate([as_numbers(named, texture) for texture in textures], axis=-1)
        if pixels.shape != self.panel[place].shape:
            raise InputError(f"{named} has shape {pixels.shape}, expected {self.panel[place].shape}")
        if not np.isfinite(pixels).all():
            raise InputError(f"{named} has a value that is not finite")
        self.panel[place], self._lit[place] = pixels, True
        self._missing.remove(index)

    @property
    def missing(self) -> list[int]:
        """The lenses that have no texture yet."""
        return sorted(self._missing)

    def photograph(self, eye_x: float, eye_y: float, width: int = 1024) -> Photograph:
        """The picture for an eye at that place of the observers' plane, metres: the lenses, ``screen_width`` across.

        Its pixels are square, ``width`` of them across; each is dark where its ray misses the panel, or ends in the
        image of a lens that has no texture. A texel is read as it is. InputError if the eye's place is not finite, or
        the width is not positive.
        """
        for name, value in (("eye x", eye_x), ("eye y", eye_y)):
            if not np.isfinite(as_number(value)):
                raise InputError(f"{name} is {shown(value)}, it must be a finite number")
        display = self.display
        columns, rows = picture_size(self.display, width)
        x = display.screen_width * ((np.arange(columns) + 0.5) / columns - 0.5)
        y = display.screen_height * (0.5 - (np.arange(rows) + 0.5) / rows)
        u = display.width * (0.5 + display.seen_place(x, eye_x) / display.panel_width)
        v = display.height * (0.5 - display.seen_place(y, eye_y) / display.panel_height)
        inside = ((v >= 0) & (v < display.height))[:, None] & ((u >= 0) & (u < display.width))
        column = np.clip(u, 0, display.width - 1).astype(np.int64)
        row = np.clip(v, 0, display.height - 1).astype(np.int64)[:, None]
        lit = inside & self._lit[row, column]
        return Photograph(np.where(lit[..., None], self.panel[row, column], np.float32(0)), int(np.sum(~lit)))
