"""The virtual viewer: a display seen by an eye on the observer line, composed from its modules' textures.

The ideal picture, with infinitely many modules, is that of a pinhole at the eye (``eye_view``): through screen point S
it sees along the straight line eye - S. Seen from above that line meets the modules' row between two modules, at m*;
module m's ray through S passes it, at depth z, at a distance |m - m*| |z| / m_z (flat screen, modules at m_z). With
modules a pitch p apart, ``nearest`` displaces a point at depth z by up to |z| p / (2 m_z), |z| p / (m_z sqrt(12)) in
the root mean square. ``linear`` joins the modules on both sides: where the colour f is smooth the errors cancel up to
f'' (z p / m_z)^2 / 8; details that are not large against p |z| / m_z appear twice. Nothing is displaced on the screen
itself, z = 0, or vertically.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, multiply, to_4x4
from lfssao.core.arguments import MOST_TEXELS, as_number, as_numbers, as_whole, check_whole
from lfssao.core.memory import check_available
from lfssao.errors import InputError, check_choice, shown
from lfssao.files import pictures
from lfssao.optics.display import Display
from lfssao.optics.display_file import ViewSet, find_display
from lfssao.optics.kernels import display as display_kernels
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.view import View, WorldToImage, finite_numbers, inverse_of
from lfssao.rendering import doubts
from lfssao.rendering.kernels import light_field as kernels
from lfssao.rendering.views import chosen_modules
from lfssao.summary import Arrayed, Summary, size_of

BLENDS = ("nearest", "linear", "gaussian")  # in the order of the kernel's numbers


class LightField:
    """A display and the textures, ``channels`` channels each, that its modules show.

    Modules are the numbers of those that will be given textures; the others stay dark. ``shots`` are the photographs
    that will be taken, (eye_x, width, blend) each, if they are known: the columns that they see are then all that is
    kept of a texture, together about two textures for an eye and any number of modules. InputError if the display has
    one module alone, which has no angular step, or none of a number; if memory is too small; as ``photograph``.

    >>> display = lfssao.find_display("sample-a").with_resolution(50, 30)
    >>> field = lfssao.LightField(display, modules=[9, 10, 11])
    >>> for k, textures in zip([9, 10, 11], lfssao.render("corner", display, modules=[9, 10, 11])):
    ...     field.put(k, textures.shaded)
    >>> field.photograph(eye_x=0.0, width=50).image.shape
    (30, 50, 3)
    """

    def __init__(
        self,
        display: Display | str | Path,
        modules: Any,
        channels: int = 3,
        shots: Iterable[tuple[float, int, str]] | None = None,
    ) -> None:
        display = find_display(display)
        check_modules(display)
        self.display = display
        self._sizes = np.array([(m.width, m.height) for m in display.modules], np.int64)
        self._numbers = np.stack([display.module_numbers(k) for k in range(len(display.modules))])
        channels = check_whole("channels", channels, 1)
        chosen = sorted(chosen_modules(display, modules))
        self._starts = np.full(len(display.modules), -1, np.int64)
        self._columns = np.stack([np.zeros_like(self._sizes[:, 0]), self._sizes[:, 0]], axis=1)
        self._shots = None if shots is None else list(shots)
        if self._shots is not None:
            self._starts[chosen] = 0
            self._columns = self._seen(self._shots)
            self._starts[chosen] = -1
        held = (self._columns[:, 1] - self._columns[:, 0]) * self._sizes[:, 1]
        ends = np.cumsum(held[chosen])
        self._room = dict(zip(chosen, (ends - held[chosen]).tolist(), strict=True))
        check_available(f"display {display.name}: the textures", 4.0 * channels * int(ends[-1]))
        self._texels = np.empty((int(ends[-1]), channels), np.float32)

    def _seen(self, shots: Sequence[tuple[float, int, str]]) -> NDArray[np.int64]:
        """The columns of each module's texture that photographs see, (M, 2), from the first to before the second."""
        first = np.full(len(self._sizes), kernels.MOST_COLUMNS)
        end = np.zeros(len(self._sizes), np.int64)
        for shot in shots:
            _, _, seen = self._compose(*shot, np.empty((0, 0), np.float32))
            first = np.minimum(first, seen[:, :, 0].min(axis=0))
            end = np.maximum(end, seen[:, :, 1].max(axis=0))
        return np.stack([np.minimum(first, end), end], axis=1)

    def put(self, index: int, *textures: NDArray[np.float32]) -> None:
        """Give a module its texture, (H, W, C) float32, or several with C channels together; they are copied.

        InputError if the module is not one of those announced, the shape is another, or a value is not finite.
        """
        if as_whole(index) not in self._room:
            raise InputError(f"module {shown(index)} is not one of {sorted(self._room)}")
        named = f"the texture of module {index}"
        textures = tuple(as_numbers(named, texture) for texture in textures)
        width, height = self._sizes[index].tolist()
        expected = (height, width, self._texels.shape[1])
        shapes = [texture.shape for texture in textures]
        fits = all(len(shape) == 3 and shape[:2] == expected[:2] for shape in shapes)
        if not fits or sum(shape[2] for shape in shapes) != expected[2]:
            raise InputError(f"{named} has shape {' and '.join(map(str, shapes))}, expected {expected}")
        if not all(np.isfinite(texture).all() for texture in textures):
            raise InputError(f"{named} has a value that is not finite")
        start = self._room[index]
        columns = slice(*self._columns[index].tolist())
        flat = [texture[:, columns].reshape(-1, texture.shape[2]) for texture in textures]
        np.concatenate(flat, axis=1, out=self._texels[start : start + len(flat[0])])
        self._starts[index] = start

    @property
    def missing(self) -> list[int]:
        """The modules that were announced and have no texture yet."""
        return [index for index in self._room if self._starts[index] < 0]

    def photograph(self, eye_x: float, width: int = 1024, blend: str = "linear") -> "Photograph":
        """Return a photograph of the screen from an eye on the observer line (LF figure 14).

        At a screen point a module's weight depends on the angle between the line to the eye and the module's ray, seen
        from above and taken by its sine. A ray reaches an eye up to half an angular step of the modules from it.
        InputError if the blend is unknown, the width is not positive, or there is no observer at eye_x; if shots were
        announced, for another one, or before all modules have their textures.

        Parameters
        ----------
        eye_x : float
            Place of the eye along the observer line, metres.
        width : int
            Width of the picture, pixels.
        blend : str
            'nearest': the one module whose ray passes next to the eye. 'linear': the neighbours on its left and right,
            each by the fraction of the step that the other's angle takes. 'gaussian': all within 6 steps, by
            exp(-q^2 / 2), q the angle in units of 1.5 steps, as in the code of LF's first author. A texture is read
            bilinearly.
        """
        if self._shots is not None and (self.missing or (eye_x, width, blend) not in self._shots):
            reason = f"modules {self.missing} have no textures" if self.missing else f"announced are {self._shots}"
            shot = ", ".join(map(shown, (eye_x, width, blend)))
            raise InputError(f"the photograph ({shot}) cannot be taken: {reason}")
        image, dark, _ = self._compose(eye_x, width, blend, self._texels)
        if dark.sum() == dark.size * image.shape[1]:
            doubts.warn([f"display {self.display.name}: no module's light goes to an eye at x = {eye_x:g}"])
        return Photograph(image, int(dark.sum()))

    def _compose(
        self, eye_x: float, width: int, blend: str, texels: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.int64]]:
        """Return the picture, and what the kernel tells of each of its rows: dark pixels, and columns that are seen."""
        check_choice("blend", blend, BLENDS)
        display = self.display
        eye = eye_point(display, eye_x)
        screen = (display.screen_width, display.screen_height)
        columns, rows = picture_size(display, width)
        image = np.empty((rows, columns, texels.shape[1]), np.float32)
        dark = np.empty(rows, np.int64)
        seen = np.empty((rows, len(self._sizes), 2), np.int64)
        modules = kernels.Modules(self._numbers, self._sizes, self._starts, self._columns, texels)
        kernels.compose(modules, eye, screen, BLENDS.index(blend), image, dark, seen)
        return image, dark, seen


@dataclass(frozen=True, eq=False, repr=False)
class Photograph(Arrayed, Summary):
    """A picture of the screen from an eye; NumPy takes it for its image.

    Attributes
    ----------
    image : (H, W, C) float32
        Linear, as the textures; the rectangle screen_width x screen_height of z = 0, 0 where no module reaches.
    dark : int
        How many pixels no module reaches (or, on a curved screen, see none of it).

    Examples
    --------
    >>> field = lfssao.LightField(lfssao.find_display("sample-a").with_resolution(50, 30), modules=[10])
    >>> field.put(10, np.ones((30, 50, 3), np.float32))
    >>> field.photograph(eye_x=0.0, width=50).dark
    1380
    """

    image: NDArray[np.float32]
    dark: int

    def _array(self) -> NDArray[np.float32]:
        return self.image

    def _facts(self) -> dict[str, object]:
        return {"pixels": size_of(self.image), "dark": self.dark}

    def _repr_png_(self) -> bytes:
        return pictures.row_png([pictures.light_codes(self.image)], self.image.shape[1])


def check_modules(display: Display) -> None:
    """Refuse (InputError) a display of one module: an eye is between the rays of two."""
    if len(display.modules) < 2:
        raise InputError(f"display {display.name}: it has one module, an eye needs two (sample-a has 21, for one)")


def picture_size(display: Display | ViewSet, width: int) -> tuple[int, int]:
    """Width and height, pixels, of a picture of the screen with square pixels; InputError for no positive width."""
    width = check_whole("width", width, 1, MOST_TEXELS)
    return width, max(1, round(width * display.screen_height / display.screen_width))


def _depth_on_arc(curvature: float, x: float) -> float:
    """Depth at x of a vertical cylinder through the origin, on its side at z = 0; NaN beyond its radius."""
    inside = 1.0 - (curvature * x) * (curvature * x)
    return curvature * (x * x) / (1.0 + sqrt(inside)) if inside > 0.0 else float("nan")


def eye_point(display: Display | str | Path, eye_x: float) -> tuple[float, float, float]:
    """Place of an eye on the observer line or arc, metres, physical space.

    InputError if eye_x is not finite, the arc does not reach it, or lies behind the screen there.

    >>> lfssao.eye_point("sample-a", 0.4)
    (0.4, 0.0, -2.0)
    """
    display = find_display(display)
    if not isfinite(as_number(eye_x)):
        raise InputError(f"eye x is {shown(eye_x)}, it must be a finite number")
    z = display.observer_z + _depth_on_arc(display.observer_curvature, eye_x)
    edge = _depth_on_arc(display.screen_curvature, 0.5 * display.screen_width)
    if not z < min(0.0, edge):
        where = f"in front of the screen at x = {eye_x:g}"
        raise InputError(f"display {display.name}: its observers' arc has no eye {where}")
    return float(eye_x), display.observer_height, z


def eye_view(display: Display | str | Path, physical_from_world: Matrix, eye_x: float, width: int = 1024) -> View:
    """Return the ideal picture of a display: a pinhole at the eye whose window is the screen.

    Its cast space is physical space with the eye as origin; a ``RayCaster`` for it is made with
    ``view.cast_from_world``. With z from the eye and d its distance from z = 0: u = W / 2 + (W / w) (e_x + d x / z)
    and v = H / 2 - (H / h) (e_y + d y / z).

    ``physical_from_world`` is the affine map world -> physical, (3, 4) float64; ``eye_x`` and ``width`` are those of
    ``LightField.photograph``, whose pixels look along the same lines, and are refused alike (InputError).

    >>> lfssao.eye_view("sample-a", np.eye(3, 4), eye_x=0.4, width=100).height
    60
    """
    display = find_display(display)
    e_x, e_y, e_z = eye_point(display, eye_x)
    columns, rows = picture_size(display, width)
    distance = -e_z
    u_scale = columns / display.screen_width
    v_scale = rows / display.screen_height
    near = 0.01 * distance
    far = distance + max(m.z for m in display.modules)
    f_u = u_scale * distance
    f_v = v_scale * distance
    c_u = columns / 2 + u_scale * e_x
    c_v = rows / 2 - v_scale * e_y
    a = far / (far - near)
    screen_from_eye = np.array([[f_u, 0, c_u, 0], [0, -f_v, c_v, 0], [0, 0, a, -a * near], [0, 0, 1, 0]])
    eye_from_world = finite_numbers("physical_from_world", physical_from_world, 3, 4)
    eye_from_world[:, 3] -= (e_x, e_y, e_z)
    matrix = multiply(screen_from_eye, to_4x4(eye_from_world))
    return View(
        name="eye",
        width=columns,
        height=rows,
        lens=np.array([f_u, f_v, c_u, c_v, near, far, 0.0, 0.0]),
        cast_from_world=eye_from_world,
        world_from_cast=inverse_of("physical_from_world", eye_from_world),
        world_to_image=WorldToImage(mapping.MATRIX, matrix.ravel()),
        screen_to_world=None,
        depth_kind="screen space z: 0 at the near plane, 1 at the far plane, perspective",
    )


def eye_range(display: Display | str | Path, modules: Any = None) -> tuple[float, float]:
    """Leftmost and rightmost eye, x in metres, that the modules (default: all) reach from the whole screen's width.

    If both ends of the screen reach no common eye, those that its middle reaches; InputError if that reaches none.

    >>> [round(x, 3) for x in lfssao.eye_range("sample-a")]
    [-0.932, 0.932]
    """
    display = find_display(display)
    shining = chosen_modules(display, modules)
    ends = [_reached(display, shining, place * display.screen_width) for place in (-0.499, 0.0, 0.499)]
    for group in (ends, ends[1:2]):
        low = max(a for a, _ in group)
        high = min(b for _, b in group)
        if low <= high:
            return low, high
    raise InputError(f"display {display.name}: no eye is reached from the middle of the screen")


def _reached(display: Display, modules: Any, s_x: float) -> tuple[float, float]:
    """Leftmost and rightmost observer, x, that rays through the screen point (s_x, 0) meet; (inf, -inf): none."""
    point = np.array([s_x, 0.0, _depth_on_arc(display.screen_curvature, s_x)])
    found = []
    for k in modules:
        (u, v, _), status = display.physical_to_image(k, point)
        origin, direction, (near, far) = display.texel_ray(k, u, v)
        if status == display_kernels.VALID and near < far:
            found.append(float(origin[0] + direction[0] * near))
    return min(found, default=float("inf")), max(found, default=float("-inf"))
