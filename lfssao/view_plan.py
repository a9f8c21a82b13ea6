"""What a view does not need, decided from scene, view and settings before anything runs; every bit stays.

The rules, and why the textures are the same without what they leave out:

- Rays: only the rows in which the image of the scene's box lies are cast (``lfssao.window.seen_window``): no other ray
  can hit. A view that does not see the box has the textures of nothing, and no pass runs.
- Background: a share of texels without a surface is +0 whatever their samples are. Rows are sampled in runs that
  begin with a texel that sees one (``lfssao.kernels.runs``), with a plan and without.
- Image: without colour it is white on the surface, which needs no texture to be multiplied.
- Equal radii: an estimator is a function of its arguments, so a radius that comes again is not computed again.
- Radius 0: the offsets 0 s are all (+-0, +-0, +-0). Algorithms 1 and 2 add them to coordinates, of which only the
  sign of a zero can change, and compare: all n samples have one outcome, and n / n = 1 / 1, 0 / n = 0 / 1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfssao.view import View
from lfssao.window import Window, cast_box, seen_window

if TYPE_CHECKING:
    from lfssao.rendering import Settings


@dataclass(frozen=True)
class ViewPlan:
    """What runs for one view.

    Attributes
    ----------
    window : Window
        Texels whose rays are cast, whole rows; empty for a view that cannot see the scene.
    whole : Window
        All of the view's texels.
    same_as : tuple of int
        For each radius the first one that gives the same texture: its own place, or an earlier one.
    one_sample : tuple of bool
        For each radius, whether one sample stands for all.
    """

    window: Window
    whole: Window
    same_as: tuple[int, ...]
    one_sample: tuple[bool, ...]

    @classmethod
    def of(cls, view: View, bounds: NDArray[np.float64], settings: "Settings") -> "ViewPlan":
        """The plan of a view.

        Parameters
        ----------
        view : View
            Which.
        bounds : (2, 3) float64
            Lower and upper corner of a box around the scene, world units (``Mesh.bounds``).
        settings : Settings
            What the AO passes are run with.
        """
        radii, window = settings.radii, seen_window(view, cast_box(view.cast_from_world, bounds))
        return cls(
            window=window.rows(view),
            whole=Window.whole(view),
            same_as=tuple(radii.index(radius) for radius in radii),
            one_sample=tuple(radius == 0 and settings.estimator == "lf" for radius in radii),
        )

    @classmethod
    def everything(cls, view: View, settings: "Settings") -> "ViewPlan":
        """The plan that leaves out nothing."""
        whole, count = Window.whole(view), len(settings.radii)
        return cls(whole, whole, tuple(range(count)), (False,) * count)

    @property
    def sampled(self) -> list[int]:
        """Numbers of the radii that are sampled with all samples."""
        each = enumerate(zip(self.same_as, self.one_sample, strict=True))
        return [number for number, (first, one) in each if first == number and not one]


def subpixel_radii(
    views: Iterable[View], boxes: Sequence[NDArray[np.float64]], radii: Iterable[float]
) -> tuple[float, ...]:
    """Radii above 0 whose ball covers less than half a texel to each side, at every corner of the boxes, in every view.

    Their samples read the depth of their own texel: such AO says nothing about the scene.

    Parameters
    ----------
    views : iterable of View
        What is rendered.
    boxes : sequence of (2, 3) float64
        Boxes around the scene, world units.
    radii : iterable of float
        Radii of the sampling ball, world units.
    """
    found = tuple(radius for radius in radii if radius > 0)
    for view, box in product(views, boxes):
        corners = np.array(list(product(*box.T)))
        found = tuple(radius for radius in found if _extent(view, corners, radius) < 0.5)
        if not found:
            break
    return found


def _extent(view: View, corners: NDArray[np.float64], radius: float) -> float:
    """Largest distance along u or v, texels, by which a ball's image reaches from its centre; NaN where unknown."""
    to_image = view.world_to_image
    steps = to_image(corners[:, None] + radius * np.eye(3)) - to_image(corners)[:, None]
    return float(np.sqrt((steps[..., :2] ** 2).sum(axis=1)).max())
