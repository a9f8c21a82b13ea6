"""Ordinary views, for Algorithm 1 (LF section 4): a pinhole or an orthographic camera as two 4x4 matrices."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, determinant, invert_affine, multiply, to_4x4
from lfssao.core.arguments import as_number
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError, check_choice, errors_of, shown
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.view import View, WorldToImage, box_of, check_size, finite_numbers

PROJECTIONS = ("perspective", "orthographic")

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """A camera in world space (right-handed).

    InputError if the projection is unknown, a number is not finite, the extent is not positive, the planes are not in
    order, or eye, target and up leave the direction open.

    Attributes
    ----------
    projection : str
        'perspective' or 'orthographic'.
    eye, target : tuple of 3 floats
        Its place and the point that it looks at, world units.
    up : tuple of 3 floats
        A direction that appears upright.
    extent : float
        Visible height at the target's distance, world units.
    near, far : float
        Distances of the nearest and farthest visible surfaces, world units; 0 < near < far.

    Examples
    --------
    >>> camera = lfssao.Camera("perspective", eye=(0, 0, 4), target=(0, 0, 0), up=(0, 1, 0), extent=2, near=1, far=9)
    >>> camera.view(64, 48).world_to_image([0, 0, 0]).tolist()
    [32.0, 24.0, 0.84375]
    """

    projection: str
    eye: Vector
    target: Vector
    up: Vector
    extent: float
    near: float
    far: float

    def __post_init__(self) -> None:
        check_choice("camera", self.projection, PROJECTIONS)
        with errors_of("camera"):
            for name in ("eye", "target", "up"):
                finite_numbers(name, getattr(self, name), 3)
            for name in ("extent", "near", "far"):
                finite_numbers(name, getattr(self, name))
        if not self.extent > 0:
            raise InputError(f"camera: extent is {self.extent}, it must be positive")
        if not 0 < self.near < self.far:
            raise InputError(f"camera: near and far are {self.near} and {self.far}, they must be 0 < near < far")
        forward = np.subtract(self.target, self.eye)
        if _length(np.cross(forward, self.up)) == 0:
            raise InputError("camera: target lies at the eye, or above or below it along up")

    @classmethod
    def looking_at(
        cls, box: NDArray[np.float64], projection: str = "perspective", size: tuple[int, int] = (4, 3)
    ) -> "Camera":
        """Return a camera before the +Z side of a box, (2, 3) world corners, which shows it with a small margin.

        ``size`` is the texture's width and height, texels, or whole numbers of the same ratio.
        """
        box = box_of("box", box)
        columns, rows, _ = check_size(*size)
        x, y, z = (0.5 * box[0] + 0.5 * box[1]).tolist()
        width, height, depth = (box[1] - box[0]).tolist()
        extent = 1.1 * max(height, rows / columns * width, 1e-3 * depth)
        distance = 2.5 * extent + 0.5 * depth
        before = distance - 0.5 * depth
        behind = distance + 0.5 * depth
        if projection == "perspective":  # the box's near face looks larger than its middle
            extent = extent * (distance / before)
        eye = (x, y, z + distance)
        target = (x, y, z)
        return cls(projection, eye, target, (0.0, 1.0, 0.0), extent, near=0.9 * before, far=1.1 * behind)

    @classmethod
    def placed(
        cls,
        box: NDArray[np.float64],
        projection: str = "perspective",
        eye: Vector | None = None,
        target: Vector | None = None,
        up: Vector | None = None,
        fov: float | None = None,
        size: tuple[int, int] = (4, 3),
    ) -> "Camera":
        """Return a camera that looks at a scene's box, (2, 3) world corners, from where one wants.

        The planes near and far enclose what is in front. Eye, target and up are those of ``Camera``, by default eye and
        target of ``looking_at`` and (0, 1, 0). ``fov`` is the vertical field of view, degrees, above 0 and below 180,
        of a perspective camera; by default that of ``looking_at``, and the extent of that for an orthographic camera.
        ``size`` is that of ``looking_at``.
        InputError as of ``Camera``, if the field of view is out of range or not of a perspective, or if the whole box
        lies behind the eye.
        """
        usual = cls.looking_at(box, projection, size)
        place = {"eye": eye, "target": target, "up": up}
        given: dict[str, Any] = {name: point for name, point in place.items() if point is not None}
        if fov is None and not given:
            return usual
        camera = replace(usual, **given)
        forward = np.subtract(camera.target, camera.eye)
        distance = _length(forward)
        extent = usual.extent
        if fov is not None:
            if projection != "perspective" or not 0 < as_number(fov) < 180:
                raise InputError(f"camera: fov is {shown(fov)}, it must be 0 to 180 degrees of a perspective camera")
            sine, cosine = sincospi(fov / 360)
            extent = 2 * distance * (sine / cosine)
        elif projection == "perspective":
            extent *= distance / _length(np.subtract(usual.target, usual.eye))
        away = [np.subtract(corner, camera.eye) for corner in product(*np.transpose(box).tolist())]
        depths = [((a[0] * forward[0] + a[1] * forward[1]) + a[2] * forward[2]) / distance for a in away]
        far = 1.1 * max(depths)
        if not far > 0:
            raise InputError(f"camera: the scene lies behind the eye at {camera.eye}, which looks at {camera.target}")
        return replace(camera, extent=extent, near=max(0.9 * min(depths), 1e-3 * far), far=far)

    def view(self, width: int, height: int, guard: int = 0, *, shift: float = 0.0, aspect: float | None = None) -> View:
        """Return the view of this camera in a texture of width x height texels, and ``guard`` more on each side.

        ``shift`` moves the eye to the right, world units, and leaves the window at the target's distance where it is:
        the frustum of a perspective camera leans. ``aspect`` is the window's width divided by its height; by default
        texels are square. InputError if a size is no whole number, or out of range
        (``lfssao.optics.view.check_size``), the shift is not finite, or the aspect is not positive.
        """
        width, height, guard = check_size(width, height, guard)
        shift = float(finite_numbers("shift", shift))
        if aspect is not None and not 0 < as_number(aspect) < inf:
            raise InputError(f"camera: aspect is {shown(aspect)}, it must be positive")
        eye_from_world = self._eye_from_world()
        eye_from_world[0, 3] -= shift
        perspective = self.projection == "perspective"
        distance = _length(np.subtract(self.target, self.eye)) if perspective else 1.0
        f_v = height / self.extent * distance
        f_u = f_v if aspect is None else width / (self.extent * aspect) * distance
        c_u = width / 2 + guard + f_u * (shift / distance)
        c_v = height / 2 + guard
        lens = np.array([f_u, f_v, c_u, c_v, self.near, self.far, float(not perspective), 0.0])
        return pinhole_view(lens, eye_from_world, width + 2 * guard, height + 2 * guard, guard)

    def stereo(self, width: int, height: int, separation: float, guard: int = 0) -> tuple[View, View]:
        """Return views of a left and a right eye, side by side at the camera's place, ``separation`` world units apart.

        Their axes are parallel, and their windows one: what lies at the target's distance is at one place in both.
        InputError as of ``view``, if the separation is not positive, or the camera is orthographic.

        >>> camera = lfssao.Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), extent=2, near=1, far=9)
        >>> [round(float(view.world_to_image([0, 0, 1])[0]), 6) for view in camera.stereo(60, 40, separation=0.3)]
        [31.0, 29.0]
        """
        if self.projection != "perspective" or not 0 < as_number(separation) < inf:
            wanted = "a positive distance, of a perspective camera"
            raise InputError(f"camera: separation is {shown(separation)}, it must be {wanted}")
        eyes = {"left": -0.5 * separation, "right": 0.5 * separation}
        left, right = (replace(self.view(width, height, guard, shift=x), name=name) for name, x in eyes.items())
        return left, right

    def _eye_from_world(self) -> Matrix:
        """World -> eye space: x right, y up, z forward."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / _length(forward)
        right = np.cross(forward, self.up)
        right = right / _length(right)
        linear = np.array([right, np.cross(right, forward), forward])
        return np.hstack([linear, -multiply(linear, np.reshape(self.eye, (3, 1)))])


def view_of_matrix(matrix: Matrix, width: int, height: int, guard: int = 0, axis: Matrix | None = None) -> View:
    """The view of a camera from its mapping: (a, b, c, q) = matrix (x, y, z, 1), u = a / q, v = b / q, depth = c / q.

    The matrix, (4, 4) float64, takes the world to texels of the whole texture, u right and v down; depth is 0 at the
    near and 1 at the far plane; q > 0 before the viewer. Lenses may be off the axis and texels not square; the world
    may have either handedness. Width and height, texels, include the guard band. ``axis``, (4,) float64, is the
    distance along an orthographic camera's axis as an affine function of the point, world units; from the near plane by
    default. A far plane at infinity stands at 2**60 times the near plane's distance. InputError if the matrix is
    singular, skewed, or of other planes.
    """
    rows = np.asarray(matrix, np.float64)
    perspective = bool(rows[3, :3].any())
    a, b, c, q = rows / (_length(rows[3]) if perspective else rows[3, 3] or 1.0)
    with np.errstate(all="ignore"):  # refused below
        if perspective:
            forward = q
            c_u = _dot(a, q)
            c_v = _dot(b, q)
            slope = _dot(c, q)
            offset = slope * q[3] - c[3]
            near = offset / slope
            far = offset / (slope - 1) if slope > 1 else _ENDLESS * offset
            off_axis = c - slope * q
        else:
            slope = np.float64(_length(c))
            c_u = width / 2
            c_v = height / 2
            forward = c / slope if axis is None else axis
            near = forward[3] - c[3] / slope
            far = near + 1 / slope
            off_axis = c / slope - forward
        x = a - c_u * q
        y = c_v * q - b
        f_u = _length(x)
        f_v = _length(y)
        eye_from_world = np.array([x / f_u, y / f_v, forward])
        skews = *(_dot(*eye_from_world[list(pair)]) for pair in ((0, 1), (0, 2), (1, 2))), *off_axis[:3]
    if not np.isfinite(eye_from_world).all() or not abs(determinant(eye_from_world)) > _SKEW:
        raise InputError("the matrix of the view is singular")
    if not max(map(abs, skews)) < _SKEW:
        raise InputError("the view is skewed: right, down and depth must be at right angles")
    if not (near > 0 or not perspective) or not near < far < np.inf or slope < perspective * (1 - 1e-6):
        raise InputError(f"the planes of the view are {near:g} and {far:g}, they must be 0 < near < far")
    lens = np.array([f_u, f_v, c_u, c_v, near, far, float(not perspective), 0.0])
    return pinhole_view(lens, eye_from_world, width, height, guard)


def linear_view(view: View, linear: bool = True) -> View:
    """Return a camera's view with a depth texture of distances along its axis (``linear``), or of screen space z.

    Float32 has distances to the same relative precision wherever the planes are, and the image z that goes with them:
    -1 / distance, or the distance of an orthographic camera.

    >>> seen = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9).view(64, 48)
    >>> linear_view(seen).world_to_image([0, 0, 0]).tolist()
    [32.0, 24.0, -0.25]
    """
    lens = view.lens.copy()
    lens[7] = float(linear)
    return with_lens(view, lens, view.cast_from_world)


_SKEW = 1e-4  # cosine of an angle; matrices of float32 are off by 1e-7
_ENDLESS = 2.0**60  # so far away that depth has the bits of an infinite far plane's


def pinhole_view(lens: NDArray[np.float64], eye_from_world: Matrix, width: int, height: int, guard: int) -> View:
    """The view of a camera's numbers, (8,): ``lfssao.optics.kernels.rays.Pinhole``; sizes include the guard band."""
    world_from_eye = invert_affine(eye_from_world)
    screen_from_eye, eye_from_screen = screen_matrices(lens.tolist())
    kind = PROJECTIONS[int(lens[6])]
    screen_z = "screen space z: 0 at the near plane, 1 at the far plane"
    return View(
        name="camera",
        width=width,
        height=height,
        lens=lens,
        cast_from_world=eye_from_world,
        world_from_cast=world_from_eye,
        world_to_image=WorldToImage(mapping.MATRIX, multiply(screen_from_eye, to_4x4(eye_from_world)).ravel()),
        screen_to_world=multiply(to_4x4(world_from_eye), eye_from_screen),
        depth_kind=f"{'linear z: distance along the axis, world units' if lens[7] else screen_z}, {kind}",
        guard=guard,
    )


def with_lens(view: View, lens: NDArray[np.float64], eye_from_world: Matrix) -> View:
    """Return a camera's view with other numbers of its lens, (8,), or another map to its eye space, (3, 4), float64."""
    return replace(pinhole_view(lens, eye_from_world, view.width, view.height, view.guard), name=view.name)


def screen_matrices(lens: Sequence[Any]) -> tuple[list[list[Any]], list[list[Any]]]:
    """Eye -> screen and back, 4 x 4, of the numbers of a lens of any kind: u = c_u + f_u x / w, v = c_v - f_v y / w.

    In perspective w = z, depth = far / (far - near) (1 - near / z); else w = 1 and depth = (z - near) / (far - near).
    Depth of linear views is -1 / z, or z.
    """
    f_u, f_v, c_u, c_v, near, far, orthographic, linear = lens
    span = far - near
    if orthographic:
        near, span = (0.0, 1.0) if linear else (near, span)
        forth = [[f_u, 0, 0, c_u], [0, -f_v, 0, c_v], [0, 0, 1 / span, -near / span], [0, 0, 0, 1]]
        back = [[1 / f_u, 0, 0, -c_u / f_u], [0, -1 / f_v, 0, c_v / f_v], [0, 0, span, near], [0, 0, 0, 1]]
    else:
        a, b = (0.0, 1.0) if linear else (far / span, far * near / span)
        forth = [[f_u, 0, c_u, 0], [0, -f_v, c_v, 0], [0, 0, a, -b], [0, 0, 1, 0]]
        back = [[1 / f_u, 0, 0, -c_u / f_u], [0, -1 / f_v, 0, c_v / f_v], [0, 0, 0, 1], [0, 0, -1 / b, a / b]]
    return forth, back


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float((a[0] * b[0] + a[1] * b[1]) + a[2] * b[2])


def _length(a: NDArray[np.float64]) -> float:
    return sqrt(_dot(a, a))
