"""What the peers of Algorithm 2 are measured on, and how a row of theirs looks."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao import passes
from lfssao.bench.times import in_turn
from lfssao.display_file import find_display
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal, module_views
from lfssao.samples.registry import make_samples
from lfssao.scene.builtin import builtin_scene

FloatTexture = NDArray[np.float32]

_RADIUS = 0.02  # share of the scene's diagonal


@dataclass(frozen=True, eq=False)
class Case:
    """The default scene in the default display, 8 samples.

    Attributes
    ----------
    depth, positions : (H, W), (H, W, 3) float32
        Textures.
    image_offsets : (n, 3) float32
        The samples after the linear part of the mapping's first three rows.
    numbers : (16,) float32
        The mapping of kind crossed slits.
    ours : callable
        Algorithm 2, from textures to texture.
    """

    depth: FloatTexture
    positions: FloatTexture
    image_offsets: FloatTexture
    numbers: FloatTexture
    ours: Callable[[], FloatTexture]

    @classmethod
    def of(cls, threads: int, width: int = 1024, height: int = 768) -> "Case":
        """Ray cast it."""
        mesh = builtin_scene()
        view = module_views(mesh, find_display("virtual").with_resolution(width, height))[0]
        gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view)
        samples, radius = make_samples(), _RADIUS * diagonal(mesh)
        m = view.world_to_image.as_type(np.float32)[:16]
        x, y, z = (radius * samples).astype(np.float32).T
        rows = [(m[k] * x + m[k + 1] * y) + m[k + 2] * z for k in (0, 4, 8)]

        def ours() -> FloatTexture:
            made: FloatTexture = passes.algorithm2(
                gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius
            ).texture
            return made

        return cls(gbuffer.depth, gbuffer.positions, np.ascontiguousarray(np.stack(rows, axis=1)), m.copy(), ours)


def compared(runs: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, Any]:
    """Times of ours, by the name 'lfssao', and the others in turn, and how many times as long each other takes."""
    times = in_turn(runs, repeats)
    ours = times["lfssao"].median
    return {name: {**asdict(row), "times_lfssao": row.median / ours} for name, row in times.items()}


def equal_share(texture: FloatTexture, other: FloatTexture) -> float:
    """Share of the texels with equal bits."""
    return float(np.mean(texture.view(np.int32) == other.view(np.int32)))
