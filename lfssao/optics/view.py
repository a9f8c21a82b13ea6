"""Views: the rays of a texture's texels, and the mapping of world points into the texture."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.core.affine import Matrix
from lfssao.errors import InputError
from lfssao.optics.kernels.projection import CROSSED_SLITS, Projection, land
from lfssao.optics.kernels.rays import Rays

# Names of the kinds of projection in files, by their numbers.
KINDS = ("crossed slits", "matrix", "display")


@dataclass(frozen=True, eq=False)
class WorldToImage:
    """The mapping world -> image as the AO kernels take it (DESIGN section 2).

    Attributes
    ----------
    kind : int
        ``lfssao.optics.kernels.projection.CROSSED_SLITS``, ``MATRIX`` or ``DISPLAY``.
    numbers : (16,) or (44,) float64
        The kind's numbers, in the order of ``lfssao.optics.kernels.projection``.
    """

    kind: int
    numbers: NDArray[np.float64]

    def as_type(self, dtype: DTypeLike) -> Projection:
        """The mapping as kernels take it, each number rounded once to the dtype of the arithmetic.

        Raises
        ------
        InputError
            If a finite one overflows there, or the world's scale falls below the normal numbers.
        """
        with np.errstate(over="ignore", under="ignore"):  # refused below
            rounded = np.ascontiguousarray(self.numbers, dtype)
        scale = np.abs(self.numbers[[0, 1, 2, 4, 5, 6, 8, 9, 10]]).max()
        if (np.isinf(rounded) & np.isfinite(self.numbers)).any() or 0 < scale < np.finfo(rounded.dtype).tiny:
            raise InputError(f"the mapping from world to image leaves the range of {rounded.dtype}: scale the world")
        return Projection(self.kind, rounded)

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Image coordinates of world points, float64: (..., 3) to (..., 3), NaN outside the mapping's domain."""
        points = np.asarray(points, np.float64)
        flat = np.ascontiguousarray(points.reshape(-1, 3))
        out = np.empty_like(flat)
        land(Projection(self.kind, self.numbers), flat, out)
        return out.reshape(points.shape)


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

    @property
    def rays(self) -> Rays:
        """The rays of its texels as kernels take them."""
        return Rays(self.world_to_image.kind, self.lens)

    def viewer_distance(self) -> NDArray[np.float64]:
        """Distance of a world point from the viewers along the axis of depth, as an affine function of the point.

        Returns
        -------
        (4,) float64
            a, b, c, d of a x + b y + c z + d, world units: a camera's z in eye space; for a module the physical z from
            the observers on (from the middle of their arc where they stand on one), in units of the world, which lie
            on the image of physical Z as long as the world's map there is a scale.
        """
        camera = self.screen_to_world is not None
        observers = 0.0 if camera else float(self.lens[3 if self.world_to_image.kind == CROSSED_SLITS else 4])
        x, y, z = (float(row) for row in self.world_from_cast[:, 2])
        row = np.array(self.cast_from_world[2], np.float64)
        row[3] -= observers
        return row * sqrt((x * x + y * y) + z * z)


def check_positions(box: NDArray[np.float64], texels_per_unit: float) -> None:
    """Refuse a scene whose box, (2, 3) world units, reaches so far that float32 positions are off by half a texel.

    Raises
    ------
    InputError
        If rounding a coordinate can move it by half a texel.
    """
    farthest = float(np.abs(box).max())
    if float(np.spacing(np.float32(farthest))) * texels_per_unit >= 1.0:
        size = float((box[1] - box[0]).max())
        raise InputError(
            f"the scene is {size:g} large and reaches {farthest:g} from the world's origin, where float32 positions "
            f"are off by half a texel and more: move it to the origin"
        )
