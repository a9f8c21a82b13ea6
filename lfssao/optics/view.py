"""Views: the rays of a texture's texels, and the mapping of world points into the texture."""

from dataclasses import dataclass
from itertools import product
from math import sqrt
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from lfssao.core.affine import Matrix, determinant, invert_affine
from lfssao.core.arguments import MOST_TEXELS, as_numbers, check_unmasked, check_whole
from lfssao.errors import InputError, check_choice, check_type, shown
from lfssao.optics import lens as optics
from lfssao.optics.kernels.display import NEVER, DisplayModule
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY, MATRIX, Projection, Slits, land
from lfssao.optics.kernels.rays import Rays

# Names of the kinds of projection in files, by their numbers.
KINDS = ("crossed slits", "matrix", "display")
DIFFUSERS = ("linear", "conical")

MOST_GUARD = 4096  # texels; nobody means a wider one

# Image coordinates beyond this many texels belong to points near a singular plane, where rounding is not small.
_FAR = 1e6


@dataclass(frozen=True, eq=False)
class WorldToImage:
    """The mapping world -> image as the AO kernels take it (DESIGN section 2).

    ``matrix``, ``crossed_slits`` and ``display`` make one of your own numbers; an InputError names the argument that is
    wrong. A mapping is printed as the call that makes it.

    Attributes
    ----------
    kind : int
        ``lfssao.optics.kernels.projection.CROSSED_SLITS``, ``MATRIX`` or ``DISPLAY``.
    numbers : (16,) or (44,) float64
        The kind's numbers, in the order of ``lfssao.optics.kernels.projection``.

    Examples
    --------
    >>> (view,) = lfssao.module_views("corner", "virtual")
    >>> view.world_to_image([0, 0, 0]).shape
    (3,)
    """

    kind: int
    numbers: NDArray[np.float64]

    def __post_init__(self) -> None:
        kind = check_whole("kind", self.kind, 0, len(KINDS) - 1)
        count = 44 if kind == DISPLAY else 16
        if as_numbers("numbers", self.numbers).shape != (count,):
            raise InputError(f"numbers have shape {np.shape(self.numbers)}, expected ({count},)")

    @classmethod
    def matrix(cls, M: ArrayLike) -> "WorldToImage":
        """The mapping of an ordinary camera: (a, b, c, q) = M (x, y, z, 1), u = a / q, v = b / q, image z = c / q.

        Parameters
        ----------
        M : (4, 4)
            The matrix; u right and v down in texels, z growing away from the viewer, q > 0 before it.

        Examples
        --------
        >>> WorldToImage.matrix([[8, 0, 4, 0], [0, -8, 3, 0], [0, 0, 1.25, -1.25], [0, 0, 1, 0]])([0.5, 0.25, 2])
        array([6.   , 2.   , 0.625])
        """
        return cls(MATRIX, finite_numbers("M", M, 4, 4).ravel())

    @classmethod
    def crossed_slits(cls, M: ArrayLike, z_m: float, z_o: float, u_0: float, v_0: float) -> "WorldToImage":
        """The mapping of a module of a flat display: u = u_0 + X / (z_m - Z), v = v_0 + Y / (z_o - Z), image z = Z.

        (X, Y, Z) = M (x, y, z, 1). For a point (x, y, z) of physical space, lens (m_x, m_z), observers (y_o, z_o), a
        screen of w x h metres and W x H texels, X = m_z W / w (x - m_x), Y = z_o (-H / h) (y - y_o) and Z = z.

        Parameters
        ----------
        M : (3, 4)
            The affine map from the world to X, Y and Z.
        z_m, z_o : float
            z of lens and observers, metres: the mapping is defined for z_o < Z < z_m.
        u_0, v_0 : float
            u of the lens, W / 2 + (W / w) m_x, and v of the observers, H / 2 - (H / h) y_o, texels.

        Examples
        --------
        A screen of 1 m x 0.5 m and 1000 x 500 texels, the lens at (0.1, 0.8), observers at (0, -2), the world physical:

        >>> M = [[800, 0, 0, -80], [0, 2000, 0, 0], [0, 0, 1, 0]]
        >>> WorldToImage.crossed_slits(M, z_m=0.8, z_o=-2, u_0=600, v_0=250)
        WorldToImage.crossed_slits(
            M=[[800.0, 0.0, 0.0, -80.0], [0.0, 2000.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], z_m=0.8, z_o=-2.0, u_0=600.0,
            v_0=250.0)
        """
        slits = _scalars(z_m=z_m, z_o=z_o, u_0=u_0, v_0=v_0)
        if not slits[1] < slits[0]:
            raise InputError(f"z_o is {slits[1]:g} and z_m is {slits[0]:g}, they must be z_o < z_m")
        return cls(CROSSED_SLITS, np.array([*finite_numbers("M", M, 3, 4).ravel(), *slits]))

    @classmethod
    def display(
        cls,
        M: ArrayLike,
        *,
        m_x: float,
        m_y: float,
        m_z: float,
        y_o: float,
        z_o: float,
        homography: ArrayLike,
        diffuser: str = "linear",
        screen_curvature: float = 0.0,
        observer_curvature: float = 0.0,
        c_u: float = 0.0,
        c_v: float = 0.0,
        unit: float = 0.0,
        k1: float = 0.0,
        k2: float = 0.0,
    ) -> "WorldToImage":
        """Return the mapping of any module of any display (``lfssao.optics.kernels.display``).

        Parameters
        ----------
        M : (3, 4)
            The affine map from the world to physical space.
        m_x, m_y, m_z, y_o, z_o : float
            Place of the lens, height of the observers, and z of their line, or of their arc at x = 0, metres.
        homography : 9 floats
            From the plane z = 0, as seen from the lens, to texels, rows of three; its divisor is positive in a picture.
        diffuser : str
            'linear' or 'conical' (flat screens and observer lines only).
        screen_curvature, observer_curvature, c_u, c_v, unit, k1, k2 : float
            1 / radius, 1 / metres (``Display``); centre of the distortion and its unit of length, texels; coefficients.

        Examples
        --------
        >>> place = dict(m_x=0.1, m_y=0, m_z=0.8, y_o=0, z_o=-2)
        >>> M = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]
        >>> mapping = WorldToImage.display(M, **place, homography=[1000, 0, 500, 0, -1000, 250, 0, 0, 1])
        >>> mapping([0.1, 0.125, 0])
        array([600., 125.,   0.])
        """
        place = _scalars(m_x=m_x, m_y=m_y, m_z=m_z, y_o=y_o, z_o=z_o)
        bent = _scalars(screen_curvature=screen_curvature, observer_curvature=observer_curvature)
        distortion = _scalars(c_u=c_u, c_v=c_v, unit=unit, k1=k1, k2=k2)
        h = tuple(finite_numbers("homography", homography, 9).tolist())
        check_choice("diffuser", diffuser, DIFFUSERS)
        if diffuser == "conical" and any(bent):
            raise InputError("diffuser: 'conical' needs a flat screen and an observer line")
        if not place[4] < 0 < place[2]:
            raise InputError(f"z_o is {place[4]:g} and m_z is {place[2]:g}, they must be z_o < 0 < m_z, the screen's z")
        if any(distortion[3:]) and not distortion[2] > 0:
            raise InputError(f"unit is {distortion[2]:g}, it must be positive: the distortion's unit of length, texels")
        derived = min(optics.fold_radius(*distortion[3:]), NEVER), *optics.invert(h)
        module = *place, *bent, float(diffuser == "conical"), *h, *distortion, *derived
        return cls(DISPLAY, np.array([*finite_numbers("M", M, 3, 4).ravel(), *module]))

    def __repr__(self) -> str:
        split = 16 if self.kind == MATRIX else 12
        rows = self.numbers[:split].reshape(-1, 4).tolist()
        rest = self.numbers[split:].tolist()
        named = dict(zip(Slits._fields, rest, strict=True)) if self.kind == CROSSED_SLITS else {}
        if self.kind == DISPLAY:
            names = DisplayModule._fields
            h = rest[8:17]
            named = dict(zip(names[:7], rest, strict=False)) | {"diffuser": DIFFUSERS[int(rest[7])], "homography": h}
            named |= zip(names[9:14], rest[17:], strict=False)
        text = ", ".join(f"{name}={value!r}" for name, value in {"M": rows, **named}.items())
        lines = "\n    ".join(wrap(text, 112, break_long_words=False))
        return f"WorldToImage.{KINDS[self.kind].replace(' ', '_')}(\n    {lines})"

    def as_type(self, dtype: DTypeLike) -> Projection:
        """Return the mapping as kernels take it, each number rounded once to the dtype of the arithmetic.

        InputError if a finite one overflows there, or the world's scale falls below the normal numbers.
        """
        with np.errstate(over="ignore", under="ignore"):  # refused below
            rounded = np.ascontiguousarray(self.numbers, dtype)
        scale = np.abs(self.numbers[[0, 1, 2, 4, 5, 6, 8, 9, 10]]).max()
        if (np.isinf(rounded) & np.isfinite(self.numbers)).any() or 0 < scale < np.finfo(rounded.dtype).tiny:
            raise InputError(f"the mapping from world to image leaves the range of {rounded.dtype}: scale the world")
        return Projection(self.kind, rounded)

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Image coordinates of world points, float64: (..., 3) to (..., 3), NaN outside the mapping's domain."""
        points = points_of("points", points)
        flat = np.ascontiguousarray(points.reshape(-1, 3))
        out = np.empty_like(flat)
        land(Projection(self.kind, self.numbers), flat, out)
        return out.reshape(points.shape)


def _scalars(**named: float) -> list[float]:
    """Return arguments of those names as floats, each checked."""
    return [float(finite_numbers(name, value)) for name, value in named.items()]


def finite_numbers(name: str, value: ArrayLike, *shape: int) -> NDArray[np.float64]:
    """Return an argument as float64; InputError, with its name, if it has another shape or is not finite."""
    check_unmasked(name, value)
    try:
        array = np.array(value)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "iuf" or array.shape != shape or not np.isfinite(array).all():
        wanted = f"{' x '.join(map(str, shape))} finite numbers" if shape else "a finite number"
        raise InputError(f"{name} is {shown(value)}, it must be {wanted}")
    return array.astype(np.float64)


def inverse_of(name: str, affine: Matrix) -> Matrix:
    """Return the inverse of an affine map; InputError if it has none, or none of finite numbers."""
    with np.errstate(all="ignore"):
        inverse = invert_affine(affine) if determinant(affine) != 0 else np.full((3, 4), np.inf)
    if not np.isfinite(inverse).all():
        raise InputError(f"{name} has no inverse")
    return inverse


def points_of(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return points, (..., 3), of any numbers as float64; InputError, with the argument's name, if they are none."""
    points = as_numbers(name, value).astype(np.float64, copy=False)
    if points.shape[-1:] != (3,):
        raise InputError(f"{name} have shape {points.shape}, expected (..., 3)")
    return points


def box_of(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a box's lower and upper corner, (2, 3) float64; InputError, with the argument's name, if it is none."""
    box = finite_numbers(name, value, 2, 3)
    if (box[0] > box[1]).any():
        raise InputError(f"{name} is {shown(box.tolist())}, its first corner must be the lower one in x, y and z")
    return box


def check_size(width: object, height: object, guard: object = 0) -> tuple[int, int, int]:
    """Width and height of a texture and its guard band, whole numbers of texels; InputError if one is none."""
    guard = check_whole("guard", guard, 0, MOST_GUARD)
    return check_whole("width", width, 1, MOST_TEXELS), check_whole("height", height, 1, MOST_TEXELS), guard


@dataclass(frozen=True, eq=False)
class View:
    """One module of a display, or one camera.

    Attributes
    ----------
    name : str
        Its name in files and messages.
    width, height : int
        Size of its textures, texels.
    lens : (8,) or (32,) float64
        The numbers of its texels' rays in cast space (``lfssao.optics.kernels.rays``); their kind is the mapping's.
    cast_from_world, world_from_cast : (3, 4) float64
        Affine maps between world and cast space: physical space for a module, eye space for a camera.
    world_to_image : WorldToImage
        The mapping of the AO kernels.
    screen_to_world : (4, 4) float64 or None
        Its inverse, which cameras alone have: with it AO is Algorithm 1, without it Algorithm 2.
    depth_kind : str
        Meaning of the depth texture, for the files' metadata.
    guard : int
        Width of the guard band on each side, texels; width and height include it.

    Examples
    --------
    >>> (view,) = lfssao.module_views("corner", "virtual")
    >>> view.width, view.height, view.depth_kind
    (1024, 768, 'physical z: metres from the screen plane, away from the viewers')
    """

    name: str
    width: int
    height: int
    lens: NDArray[np.float64]
    cast_from_world: Matrix
    world_from_cast: Matrix
    world_to_image: WorldToImage
    screen_to_world: Matrix | None
    depth_kind: str
    guard: int = 0

    def __post_init__(self) -> None:
        check_size(self.width, self.height, self.guard)
        check_type("world_to_image", self.world_to_image, WorldToImage)
        shapes: dict[str, tuple[int, ...]] = {
            "lens": (32 if self.world_to_image.kind == DISPLAY else 8,),
            "cast_from_world": (3, 4),
            "world_from_cast": (3, 4),
        }
        if self.screen_to_world is not None:
            shapes["screen_to_world"] = (4, 4)
        for name, shape in shapes.items():  # kernels read them unchecked
            found = as_numbers(name, getattr(self, name)).shape
            if found != shape:
                raise InputError(f"{name} has shape {found}, expected {shape}")

    @property
    def rays(self) -> Rays:
        """The rays of its texels as kernels take them."""
        return Rays(self.world_to_image.kind, self.lens)

    @property
    def linear(self) -> bool:
        """Whether it is a camera's whose depth texture holds distances along the axis (``camera.linear_view``)."""
        return self.screen_to_world is not None and bool(self.lens[7])

    def image_z(self, depth: NDArray[Any]) -> NDArray[Any]:
        """Image z of a depth texture: its own numbers, or -1 / distance of a linear perspective; +infinity stays."""
        if not self.linear or self.lens[6]:
            return depth
        with np.errstate(divide="ignore", invalid="ignore"):  # a renderer's own depth may be anything
            return np.where(depth < np.inf, -1 / depth, depth)

    def cast_z(self, depth: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cast space z of finite depths: depth itself, but of a camera's screen space z the distance along its axis."""
        if self.screen_to_world is None or self.linear:
            return depth
        near, far, orthographic = self.lens[4:7].tolist()
        return np.asarray(near + depth * (far - near) if orthographic else near / (1 - depth * (1 - near / far)))

    def depth_at(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Depth of points at z of cast space, what ``cast_z`` undoes; float64."""
        if self.screen_to_world is None or self.linear:
            return z
        near, far, orthographic = self.lens[4:7].tolist()
        return np.asarray((z - near) / (far - near) if orthographic else far / (far - near) * (1 - near / z))

    def viewer_distance(self) -> NDArray[np.float64]:
        """Distance of a world point from the viewers along the axis of depth, as an affine function of the point.

        Returned are a, b, c, d, (4,) float64, of a x + b y + c z + d, world units: a camera's z in eye space; for a
        module the physical z from the observers on (from the middle of their arc where they stand on one), in units of
        the world, which lie on the image of physical Z as long as the world's map there is a scale.
        """
        camera = self.screen_to_world is not None
        observers = 0.0 if camera else float(self.lens[3 if self.world_to_image.kind == CROSSED_SLITS else 4])
        x, y, z = (float(row) for row in self.world_from_cast[:, 2])
        row = np.array(self.cast_from_world[2], np.float64)
        row[3] -= observers
        return row * sqrt((x * x + y * y) + z * z)


def without_guard(texture: NDArray[Any], guard: int) -> NDArray[Any]:
    """Return a texture, (H, W) or (H, W, C), without a guard band of that width (SAO section 2.3)."""
    return np.ascontiguousarray(texture[guard : len(texture) - guard, guard : texture.shape[1] - guard])


def check_positions(box: NDArray[np.float64], texels_per_unit: float) -> None:
    """Refuse (InputError) a box, (2, 3) world units, so far away that rounding to float32 moves it by half a texel."""
    farthest = float(np.abs(box).max())
    if float(np.spacing(np.float32(farthest))) * texels_per_unit >= 1.0:
        size = float((box[1] - box[0]).max())
        raise InputError(
            f"the scene is {size:g} large and reaches {farthest:g} from the world's origin, where float32 positions "
            f"are off by half a texel and more: move it to the origin"
        )


def seen_rows(view: View, bounds: NDArray[np.float64]) -> range:
    """Rows of texels that hold the image of a box, and one more on each side; empty where it misses the texture.

    On flat displays and in cameras u and v are quotients of affine functions of the point, whose divisors have one sign
    over the box, so they are largest and smallest in its corners. All rows where that does not hold, and on other
    displays. The box is (2, 3) float64, its lower and upper corner, world units.
    """
    image = view.world_to_image(np.array(list(product(*bounds.T))))[:, :2]
    if view.world_to_image.kind == DISPLAY or not np.abs(image).max() < _FAR:  # NaN where a corner has no image
        return range(view.height)
    left, top = np.floor(image.min(axis=0)).astype(int) - 1
    right, bottom = np.ceil(image.max(axis=0)).astype(int) + 1
    if right <= 0 or bottom <= 0 or left >= view.width or top >= view.height:
        return range(0)
    return range(max(int(top), 0), min(int(bottom), view.height))
