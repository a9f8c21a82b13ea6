"""Light field displays: modules behind a screen, viewers on a line or an arc in front of it (LF section 3).

Physical space: metres, X right along the observer line, Y up, Z away from the viewers, the screen through z = 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix
from lfssao.core.arguments import as_number, as_numbers, check_whole
from lfssao.errors import InputError, check_choice, check_type, errors_of, shown
from lfssao.optics import lens as optics
from lfssao.optics.kernels import display as kernels
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.view import (
    DIFFUSERS,
    MOST_GUARD,
    View,
    WorldToImage,
    box_of,
    check_size,
    finite_numbers,
    inverse_of,
    points_of,
)
from lfssao.summary import Summary

# Numbers of a display, with the keys of its file that they come from; numbers of a module.
_KEYS = {
    "screen_width": "screen.width",
    "screen_height": "screen.height",
    "screen_curvature": "screen.radius",
    "observer_height": "observer.height",
    "observer_z": "observer.distance",
    "observer_curvature": "observer.radius",
}
_PLACE_AND_OPTICS = ("x", "y", "z", "yaw", "pitch", "roll", "k1", "k2")

PHYSICAL_Z = "physical z: metres from the screen plane, away from the viewers"


@dataclass(frozen=True)
class Module:
    """One optical module.

    Attributes
    ----------
    x, y, z : float
        Place of its lens, metres; z > 0.
    width, height : int
        Size of its texture, texels.
    yaw, pitch, roll : float
        Its rotation, degrees; only with a field of view.
    field_of_view : float or None
        Horizontal angle of view, degrees. None: its texture covers the screen exactly, unless there is a homography.
    homography : 9 floats or None
        From the plane z = 0 (metres, as seen from the lens) to texels, rows of three, as a calibration gives it.
    k1, k2 : float
        Radial distortion about the texture's middle, radii in units of half its width.

    Examples
    --------
    >>> lfssao.Module(x=0.1, y=0.0, z=0.7, width=1000, height=600).field_of_view is None
    True
    """

    x: float
    y: float
    z: float
    width: int
    height: int
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    field_of_view: float | None = None
    homography: optics.Homography | None = None
    k1: float = 0.0
    k2: float = 0.0


@dataclass(frozen=True, repr=False)
class Display(Summary):
    """A light field display.

    InputError if the display cannot exist; the message names the key of its file.

    Attributes
    ----------
    name : str
        Its name in messages, files and the manifest.
    screen_width, screen_height : float
        Size of the screen, metres; along the chord where it is curved.
    observer_height, observer_z : float
        Height of the observers and z of their line, or of their arc at x = 0, metres; observer_z < 0.
    modules : tuple of Module
        From left to right as the viewers see them.
    roi : ((x, y, z), (x, y, z))
        Lower and upper corner of the box of physical space that a scene is fitted into, metres.
    diffuser : str
        'linear' or 'conical' (flat screens and observer lines only).
    screen_curvature, observer_curvature : float
        1 / radius, 1 / metres; 0: flat screen, straight observer line. A screen of positive curvature is convex,
        bulging towards the viewers; an arc of curvature -1 / observer_z lies around the screen's middle.

    Examples
    --------
    >>> lfssao.find_display("sample-a").screen_width
    1.0
    """

    name: str
    screen_width: float
    screen_height: float
    observer_height: float
    observer_z: float
    modules: tuple[Module, ...]
    roi: tuple[tuple[float, float, float], tuple[float, float, float]]
    diffuser: str = "linear"
    screen_curvature: float = 0.0
    observer_curvature: float = 0.0

    def _facts(self) -> dict[str, object]:
        return {"name": self.name, "modules": len(self.modules), "screen": f"{self.screen_width:.3g} m wide"}

    def __post_init__(self) -> None:
        self._check_screen()
        with errors_of(f"display {self.name}"):
            check_type("modules", self.modules, Sequence)
        if not self.modules:
            raise InputError(f"display {self.name}: modules: there are none")
        for index in range(len(self.modules)):
            self._check_module(index)
        self._check_roi()

    def _demand(self, holds: bool, key: str, reason: str) -> None:
        """Refuse a display without a property that displays have."""
        if not holds:
            raise InputError(f"display {self.name}: {key}: {reason}")

    def _check_numbers(self, keys: Mapping[str, object]) -> None:
        """Refuse values, by the keys of the display's file, that are no numbers."""
        for key, value in keys.items():
            self._demand(not isnan(as_number(value)), key, f"it is {shown(value)}, it must be a number")

    def _check_screen(self) -> None:
        self._check_numbers({key: getattr(self, name) for name, key in _KEYS.items()})
        demand = self._demand
        half = 0.5 * self.screen_width
        for key, size in (("screen.width", self.screen_width), ("screen.height", self.screen_height)):
            demand(0 < size < inf, key, f"it is {size}, it must be positive")
        demand(-inf < self.observer_z < 0, "observer.distance", "the observers must be in front of the screen")
        demand(isfinite(self.observer_height), "observer.height", f"it is {self.observer_height}")
        with errors_of(f"display {self.name}: diffuser"):
            check_choice("diffuser", self.diffuser, DIFFUSERS)
        fits = self.screen_curvature == self.observer_curvature == 0 or self.diffuser != "conical"
        demand(fits, "diffuser", "'conical' needs a flat screen and an observer line")
        demand(abs(self.screen_curvature) * half < 1, "screen.radius", "it must be more than half the screen's width")
        # Both shapes fall off from the middle, the more curved one faster: if any part meets, it is the screen's edge.
        edge = optics.bulge(self.screen_curvature, half)
        line = self.observer_z + optics.bulge(self.observer_curvature, half)
        reason = f"the screen's edges, at z = {edge:g}, are not behind the observers, there at z = {line:g}"
        demand(line < edge, "observer.distance", reason)

    def _check_module(self, index: int) -> None:
        module = self.modules[index]
        key = f"modules[{index}]"
        demand = self._demand
        with errors_of(f"display {self.name}"):
            check_type(key, module, Module)
        self._check_numbers({f"{key}.{name}": getattr(module, name) for name in _PLACE_AND_OPTICS})
        demand(0 < module.z < inf, f"{key}.z", f"it is {module.z}, but modules are behind the screen, at z > 0")
        for name, value in (("x", module.x), ("y", module.y)):
            demand(isfinite(value), f"{key}.{name}", f"it is {value}, it must be finite")
        screen = optics.bulge(self.screen_curvature, min(abs(module.x), 0.5 * self.screen_width))
        reason = f"it is {module.z}, but the curved screen is there at z = {screen:g}"
        demand(module.z > screen, f"{key}.z", reason)
        with errors_of(f"display {self.name}: {key}.resolution"):
            check_size(module.width, module.height)
        field = module.field_of_view
        turned = (module.yaw, module.pitch, module.roll) != (0, 0, 0)
        reason = f"it is {field}, it must be between 0 and 180"
        demand(field is None or 0 < as_number(field) < 180, f"{key}.field_of_view", reason)
        demand(field is not None or not turned, f"{key}.yaw", "a turned module needs a field_of_view")
        both = field is not None and module.homography is not None
        demand(not both, f"{key}.homography", "it stands for field_of_view, give one of them")
        with errors_of(f"display {self.name}: {key}.homography"):
            if module.homography is not None:
                finite_numbers("homography", module.homography, 9)
            numbers = self.module_numbers(index)
        demand(bool(np.isfinite(numbers).all()), key, "a number of its optics is not finite")
        named = kernels.display_module(numbers)
        fold = named.fold
        aspect = module.height / module.width
        reached = fold * (1 + fold * (module.k1 + fold * module.k2)) ** 2 if fold < kernels.NEVER else inf
        demand(reached > 1 + aspect * aspect, f"{key}.k1", "the distortion folds inside the texture")
        if not self._is_plain(module):
            *_, near, far = kernels.display_ray(named, module.width / 2, module.height / 2)
            demand(near < far, key, "the ray of its middle does not reach screen and observers")

    def _check_roi(self) -> None:
        demand = self._demand
        with errors_of(f"display {self.name}: roi"):
            box = as_numbers("it", self.roi)
        ordered = box.shape == (2, 3) and bool(np.isfinite(box).all() and (box[0] < box[1]).all())
        demand(ordered, "roi", "min must be less than max in x, y and z")
        reached = f"z = {box[0, 2]} reaches the observers at z = {self.observer_z}"
        demand(box[0, 2] > self.observer_z, "roi.min", reached)
        for index, module in enumerate(self.modules):
            reached = f"z = {box[1, 2]} reaches the lens of module {index}, z = {module.z}"
            demand(box[1, 2] < module.z, "roi.max", reached)
            if not self._is_plain(module):
                self._check_roi_points(index, box)

    def _check_roi_points(self, index: int, box: NDArray[np.float64]) -> None:
        """Refuse a ROI with a corner, or a point of a lattice, beyond a surface at which the mapping ends.

        The observers' arc bends in x and z and the conical diffuser's surface in y and z, so corners alone do not do.
        """
        axes = [np.linspace(low, high, count) for low, high, count in zip(*box, (5, 65, 17), strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        _, statuses = self.physical_to_image(index, points)
        for status, end in ((kernels.BEHIND_MODULE, "module"), (kernels.BEHIND_OBSERVER, "observers")):
            for point in points[statuses == status][:1]:
                place = ", ".join(f"{c:g}" for c in point)
                self._demand(False, "roi", f"its point ({place}) is behind the {end} for module {index}")

    def with_resolution(self, width: int, height: int) -> "Display":
        """Return the same display with textures of another size, texels; calibrated optics are scaled with it.

        InputError if a size is no whole number of at least 1.
        """
        width, height, _ = check_size(width, height)
        modules = []
        for m in self.modules:
            homography = m.homography
            if homography is not None:
                scales = (width / m.width,) * 3 + (height / m.height,) * 3 + (1.0,) * 3
                homography = tuple(h * s for h, s in zip(homography, scales, strict=True))
            modules.append(replace(m, width=width, height=height, homography=homography))
        return replace(self, modules=tuple(modules))

    def _is_plain(self, module: Module) -> bool:
        """Whether the flat forms of the linear diffuser with aligned texels hold: the fast kernels' case."""
        flat = self.screen_curvature == 0 and self.observer_curvature == 0 and self.diffuser == "linear"
        return flat and module.field_of_view is None and module.homography is None and module.k1 == module.k2 == 0

    def _module(self, index: object) -> tuple[int, Module]:
        """Return a number as a whole one, and the module of it; InputError if there is none."""
        number = check_whole("module", index, 0, len(self.modules) - 1)
        return number, self.modules[number]

    def module_numbers(self, index: int, guard: int = 0) -> NDArray[np.float64]:
        """The numbers of one module, (32,) float64, in the order of ``lfssao.optics.kernels.display.DisplayModule``.

        Its texture has ``guard`` more texels on each side. InputError if there is no such module, the guard band is
        none, or the homography is singular.
        """
        _, m = self._module(index)
        guard = check_whole("guard", guard, 0, MOST_GUARD)
        size = m.width, m.height
        if m.homography is not None:
            sign = -1.0 if m.homography[8] < 0 else 1.0
            homography = tuple(sign * h for h in m.homography)
        elif m.field_of_view is not None:
            rotation = m.yaw, m.pitch, m.roll
            homography = optics.projector_homography((m.x, m.y, m.z), rotation, m.field_of_view, size)
        else:
            homography = optics.aligned_homography((self.screen_width, self.screen_height), size)
        homography = optics.with_guard(homography, guard)
        distortion = m.width / 2 + guard, m.height / 2 + guard, m.width / 2, m.k1, m.k2
        shape = self.screen_curvature, self.observer_curvature, float(self.diffuser == "conical")
        place = m.x, m.y, m.z, self.observer_height, self.observer_z, *shape
        fold = min(optics.fold_radius(m.k1, m.k2), kernels.NEVER)
        return np.array([*place, *homography, *distortion, fold, *optics.invert(homography)])

    def physical_to_image(
        self, index: int, points: NDArray[np.floating[Any]]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Image coordinates of physical points, (..., 3), metres, in the texture of the module of a number.

        They are u and v, texels, and z, metres, (..., 3) float64, NaN where the status is neither 0 nor 5. Statuses,
        (...) int64: 0 valid; 1 behind the module; 2 behind the observers; 3 misses the curved screen; 4 folded by the
        optics; 5 valid, but outside the texture. InputError if there is no such module or the points are none.
        """
        points = points_of("points", points)
        flat = np.ascontiguousarray(points.reshape(-1, 3))
        image = np.empty_like(flat)
        statuses = np.empty(len(flat), np.int64)
        _, module = self._module(index)
        kernels.map_points(self.module_numbers(index), flat, module.width, module.height, image, statuses)
        return image.reshape(points.shape), statuses.reshape(points.shape[:-1])

    def texel_ray(
        self, index: int, u: NDArray[np.floating[Any]] | float, v: NDArray[np.floating[Any]] | float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the lines of physical points that land on image points of the module of a number.

        u and v, arrays of one shape or floats, are in texels; texel (i, j) has its centre at (i + 0.5, j + 0.5).
        Returned are origin and direction, (..., 3) float64, of the points origin + z direction, metres, the direction's
        z being 1 and the origin's 0, and (..., 2) float64, z of the observers and of the lens, between which the line
        is defined; (1, 0) where there is none. InputError if there is no such module, or u and v do not fit.
        """
        us, vs = (as_numbers(*named).astype(np.float64) for named in (("u", u), ("v", v)))
        try:
            us, vs = np.broadcast_arrays(us, vs)
        except ValueError:
            raise InputError(f"u and v have shapes {us.shape} and {vs.shape}, they must be one") from None
        lines = np.empty((us.size, 6))
        kernels.trace_texels(self.module_numbers(index), us.ravel(), vs.ravel(), lines)
        origin = np.zeros((us.size, 3))
        direction = np.ones((us.size, 3))
        shape = us.shape
        origin[:, :2], direction[:, :2] = lines[:, :2], lines[:, 2:4]
        return origin.reshape(*shape, 3), direction.reshape(*shape, 3), lines[:, 4:].reshape(*shape, 2)

    def view(self, index: int, physical_from_world: Matrix, guard: int = 0) -> View:
        """Return the view of one module, a number from 0: rays and mapping of its texture.

        ``physical_from_world``, (3, 4) float64, is affine (``fit_roi`` makes one). The guard band (SAO section 2.3)
        is texels added on each side, which AO looks into and outputs crop. InputError if there is no such module, the
        map is none, or the guard band is no whole number of texels, 0 to 4096.
        """
        physical_from_world = finite_numbers("physical_from_world", physical_from_world, 3, 4)
        inverse = inverse_of("physical_from_world", physical_from_world)
        index, m = self._module(index)
        guard = check_whole("guard", guard, 0, MOST_GUARD)
        if self._is_plain(m):
            u_scale = m.width / self.screen_width
            v_scale = -m.height / self.screen_height
            u_0 = m.width / 2 + guard
            v_0 = m.height / 2 + guard
            lens = np.array([m.x, m.z, self.observer_height, self.observer_z, u_scale, u_0, v_scale, v_0])
            world_to_image = crossed_slits(physical_from_world, lens)
        else:
            lens = self.module_numbers(index, guard)
            world_to_image = WorldToImage(mapping.DISPLAY, np.concatenate([np.ravel(physical_from_world), lens]))
        return View(
            name=f"module_{index:03d}",
            width=m.width + 2 * guard,
            height=m.height + 2 * guard,
            lens=lens,
            cast_from_world=physical_from_world,
            world_from_cast=inverse,
            world_to_image=world_to_image,
            screen_to_world=None,
            depth_kind=PHYSICAL_Z,
            guard=guard,
        )


def crossed_slits(physical_from_world: Matrix, lens: NDArray[np.float64]) -> WorldToImage:
    """Return the mapping world -> image of a flat display with the linear diffuser and aligned texels.

    s_x = m_x + (x - m_x) m_z / (m_z - z) and u = u_scale s_x + u_0 together are
    u = (u_0 + u_scale m_x) + [u_scale m_z (x - m_x)] / (m_z - z), and the bracket is affine in world space; v likewise
    with y_o and z_o.

    ``physical_from_world``, (3, 4) float64, is affine; ``lens`` holds ``lfssao.optics.kernels.rays.FlatModule``.
    """
    return WorldToImage(
        mapping.CROSSED_SLITS, slits_numbers(np.asarray(physical_from_world, np.float64), lens.tolist())
    )


def slits_numbers(physical_from_world: NDArray[Any], lens: Sequence[Any]) -> NDArray[Any]:
    """Return the numbers of ``crossed_slits``, (16,), of arrays and lists of any numbers."""
    m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
    rows = physical_from_world.copy()
    rows[0, 3] -= m_x
    rows[1, 3] -= y_o
    rows[0] *= u_scale * m_z
    rows[1] *= v_scale * z_o
    return np.concatenate([rows.ravel(), [m_z, z_o, u_0 + u_scale * m_x, v_0 + v_scale * y_o]])


def fit_roi(world_box: NDArray[np.float64], physical_box: Any) -> Matrix:
    """World -> physical: the world box's centre to the physical box's, at the largest scale that fits it inside.

    The scale is the same along all axes. World is right-handed with Y up and viewers towards +Z, physical has Z away
    from the viewers: z changes its sign, so the map turns handedness (its determinant is negative). Boxes are (2, 3)
    float64, lower and upper corner, and the map is (3, 4) float64. InputError if a box is none.

    >>> lfssao.fit_roi(np.array([[0, 0, 0], [1, 1, 1]]), ((-1, -1, -1), (1, 1, 1))).tolist()
    [[2.0, 0.0, 0.0, -1.0], [0.0, 2.0, 0.0, -1.0], [0.0, 0.0, -2.0, 1.0]]
    """
    world_box = box_of("world_box", world_box)
    roi_box = box_of("physical_box", physical_box)
    size = world_box[1] - world_box[0]
    roi_size = roi_box[1] - roi_box[0]
    scale = min((float(r / s) for r, s in zip(roi_size, size, strict=True) if s > 0), default=1.0)
    signed = np.array([scale, scale, -scale])
    centre = 0.5 * world_box[0] + 0.5 * world_box[1]
    target = 0.5 * roi_box[0] + 0.5 * roi_box[1]
    return np.column_stack([np.diag(signed), target - signed * centre])
