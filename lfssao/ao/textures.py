"""Input of all estimators: the textures of one view and the view's mapping."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.passes import check_fit, check_texture
from lfssao.errors import InputError
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.kernels.directions import write_directions
from lfssao.optics.view import View

Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class Buffers:
    """The textures of one view, guard band included, and the view itself.

    Attributes
    ----------
    view : View
        A module of a display (``view.screen_to_world`` is None) or a camera.
    depth : (H, W) float32 or float64
        Image z (``View.depth_kind``), +infinity where there is no surface.
    positions : (H, W, 3), same dtype
        World coordinates, +infinity where there is no surface.
    normals : (H, W, 3), same dtype, or None
        Unit normals in world space, towards the viewer, 0 where there is no surface; None where none were made.

    Raises
    ------
    InputError
        If sizes or dtypes do not fit each other or the view.
    """

    view: View
    depth: Texture
    positions: Texture
    normals: Texture | None = None

    def __post_init__(self) -> None:
        check_texture("depth", self.depth, 2)
        if self.depth.shape != (self.view.height, self.view.width):
            raise InputError(f"depth has shape {self.depth.shape}, the view's is {(self.view.height, self.view.width)}")
        for name, texture in (("positions", self.positions), ("normals", self.normals)):
            if texture is not None:
                check_texture(name, texture, 3)
                check_fit(name, texture, self.depth, 3)

    @classmethod
    def of(cls, gbuffer: GBuffer, view: View) -> "Buffers":
        """The textures that the ray caster made for a view.

        Raises
        ------
        InputError
            If positions are not among them.
        """
        if gbuffer.positions is None:
            raise InputError("there are no positions, which estimators read")
        return cls(view, gbuffer.depth, gbuffer.positions, gbuffer.normals)

    @cached_property
    def directions(self) -> Texture:
        """Unit directions in which the texels look, (H, W, 3) in depth's dtype, world space, away from the viewer."""
        out = np.empty(self.positions.shape, self.depth.dtype)
        write_directions(self.view.rays, np.ravel(self.view.world_from_cast), out)
        return out
