"""Light field displays: modules behind a flat screen, viewers on a line in front of it (LF section 3).

Physical space: metres, X right along the observer line, Y up, Z away from the viewers, the screen at z = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.kernels import mapping, rays
from lfssao.matrix import Matrix, invert_affine
from lfssao.view import View, WorldToImage


@dataclass(frozen=True)
class Module:
    """One optical module: the place of its lens in metres and the size of its texture in texels."""

    x: float
    y: float
    z: float
    width: int
    height: int


@dataclass(frozen=True)
class FlatDisplay:
    """A flat screen with the linear diffuser, an observer line, and modules whose texels are aligned to the screen.

    Attributes
    ----------
    name : str
        What messages, files and the manifest call it.
    screen_width, screen_height : float
        Size of the screen, metres; every module's texture covers all of it.
    observer_height, observer_z : float
        The observer line {y = observer_height, z = observer_z}, metres; observer_z < 0.
    modules : tuple of Module
        From left to right as the viewers see them.
    roi_depth : float
        Half the depth, metres, of the box around the screen's centre that a scene is fitted into.
    sources : str
        Which values are published, and where; the others are assumed.

    Raises
    ------
    InputError
        If the observers are not in front of the screen or a module is not behind it, or a size is not positive.
    """

    name: str
    screen_width: float
    screen_height: float
    observer_height: float
    observer_z: float
    modules: tuple[Module, ...]
    roi_depth: float
    sources: str

    def __post_init__(self) -> None:
        if not (self.screen_width > 0 and self.screen_height > 0):
            raise InputError(f"display {self.name}: the screen's size must be positive")
        if not self.observer_z < 0:
            raise InputError(f"display {self.name}: observer_z is {self.observer_z}, it must be negative")
        if not self.modules:
            raise InputError(f"display {self.name}: there are no modules")
        for number, module in enumerate(self.modules):
            if not module.z > 0:
                raise InputError(f"display {self.name}: module {number} has z = {module.z}, it must be positive")
            if module.width < 1 or module.height < 1:
                raise InputError(f"display {self.name}: module {number} has no texels")

    def with_resolution(self, width: int, height: int) -> "FlatDisplay":
        """The same display with textures of another size, texels."""
        modules = tuple(Module(m.x, m.y, m.z, width, height) for m in self.modules)
        return FlatDisplay(
            self.name, self.screen_width, self.screen_height, self.observer_height, self.observer_z,
            modules, self.roi_depth, self.sources,
        )  # fmt: skip

    @property
    def roi(self) -> NDArray[np.float64]:
        """The box of physical space that a scene is fitted into, (2, 3) metres: nine tenths of the screen's size."""
        half = np.array([0.45 * self.screen_width, 0.45 * self.screen_height, self.roi_depth])
        return np.stack([-half, half])

    def view(self, index: int, physical_from_world: Matrix) -> View:
        """The view of one module.

        Parameters
        ----------
        index : int
            Number of the module, from 0.
        physical_from_world : (3, 4) float64
            Affine map world -> physical (``fit_roi`` makes one).

        Returns
        -------
        View
            Rays and mapping of the module's texture, by the flat forms of the linear diffuser.
        """
        m = self.modules[index]
        u_scale, v_scale = m.width / self.screen_width, -m.height / self.screen_height
        u_0, v_0 = m.width / 2, m.height / 2
        lens = np.array([m.x, m.z, self.observer_height, self.observer_z, u_scale, u_0, v_scale, v_0])
        return View(
            name=f"module_{index:03d}",
            width=m.width,
            height=m.height,
            ray_kind=rays.FLAT_LINEAR,
            lens=lens,
            cast_from_world=physical_from_world,
            world_from_cast=invert_affine(physical_from_world),
            world_to_image=crossed_slits(physical_from_world, lens),
            screen_to_world=None,
            depth_kind="physical z: metres from the screen plane, away from the viewers",
        )


def crossed_slits(physical_from_world: Matrix, lens: NDArray[np.float64]) -> WorldToImage:
    """The mapping world -> image of a flat display with the linear diffuser.

    s_x = m_x + (x - m_x) m_z / (m_z - z) and u = u_scale s_x + u_0 together are
    u = (u_0 + u_scale m_x) + [u_scale m_z (x - m_x)] / (m_z - z), and the bracket is affine in world space; v likewise
    with y_o and z_o.

    Parameters
    ----------
    physical_from_world : (3, 4) float64
        Affine map world -> physical.
    lens : (8,) float64
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 (``lfssao.kernels.rays``, FLAT_LINEAR).
    """
    m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens.tolist()
    rows = np.array(physical_from_world, np.float64)
    rows[0, 3] -= m_x
    rows[1, 3] -= y_o
    rows[0] *= u_scale * m_z
    rows[1] *= v_scale * z_o
    numbers = np.concatenate([rows.ravel(), [m_z, z_o, u_0 + u_scale * m_x, v_0 + v_scale * y_o]])
    return WorldToImage(mapping.CROSSED_SLITS, numbers)


def fit_roi(world_box: NDArray[np.float64], physical_box: NDArray[np.float64]) -> Matrix:
    """World -> physical: the world box's centre to the physical box's, at the largest scale that fits it inside.

    The scale is the same along all axes. World is right-handed with Y up and viewers towards +Z, physical has Z away
    from the viewers: z changes its sign, so the map turns handedness (its determinant is negative).

    Parameters
    ----------
    world_box, physical_box : (2, 3) float64
        Lower and upper corner.

    Returns
    -------
    (3, 4) float64
    """
    size = world_box[1] - world_box[0]
    room = physical_box[1] - physical_box[0]
    scale = min((float(r / s) for r, s in zip(room, size, strict=True) if s > 0), default=1.0)
    signed = np.array([scale, scale, -scale])
    centre = 0.5 * world_box[0] + 0.5 * world_box[1]
    target = 0.5 * physical_box[0] + 0.5 * physical_box[1]
    out = np.zeros((3, 4))
    for axis in range(3):
        out[axis, axis] = signed[axis]
        out[axis, 3] = target[axis] - signed[axis] * centre[axis]
    return out


def _line(positions: Sequence[float], y: float, z: float, width: int, height: int) -> tuple[Module, ...]:
    return tuple(Module(x, y, z, width, height) for x in positions)


DISPLAYS: dict[str, FlatDisplay] = {
    display.name: display
    for display in (
        FlatDisplay(
            name="virtual",
            screen_width=1.0,
            screen_height=0.75,
            observer_height=0.0,
            observer_z=-2.0,
            modules=_line([0.0], 0.0, 0.7, 1024, 768),
            roi_depth=0.3,
            sources="one module of 1024x768: LF section 7; all lengths assumed",
        ),
        FlatDisplay(
            name="sample-a",
            screen_width=1.0,
            screen_height=0.6,
            observer_height=0.0,
            observer_z=-2.0,
            modules=_line([(k - 10) / 10 for k in range(21)], 0.0, 0.7, 1000, 600),
            roi_depth=0.25,
            sources="modules, resolution, screen, distances: Doronin, LightFieldDisplayModel; heights, ROI assumed",
        ),
    )
}


def find_display(name: str) -> FlatDisplay:
    """A preset by its name.

    Raises
    ------
    InputError
        If there is none of that name; the message lists those there are.
    """
    if name not in DISPLAYS:
        raise InputError(f"there is no display '{name}': choose one of {', '.join(DISPLAYS)}")
    return DISPLAYS[name]
