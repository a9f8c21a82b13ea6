"""Options of look-ups: what samples see beyond the texture's border, and where no surface is.

Textures of other renderers may hold a cleared value where there is no surface, and samplers may hold image points
inside the texture. Both are data of the look-up here, and no part of an estimator's formulas.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Options, Value, option
from lfssao.ao.kernels.look_up import CLAMP, MIRROR, NOTHING, VALUE, WRAP, Look
from lfssao.ao.textures import Buffers, Texture
from lfssao.errors import InputError
from lfssao.optics.kernels.rays import write_lines
from lfssao.optics.view import View

BORDERS = {"open": VALUE, "clamp": CLAMP, "repeat": WRAP, "mirror": MIRROR}
BACKGROUND, CLEARED = "background", "cleared"
BACKGROUNDS = "open", "occludes", CLEARED  # of estimators in which background may hide samples
LOOK_UPS = frozenset({"border", "filter", "cleared"})  # options of the look-up, and of no estimator's own text
_FARTHEST, _EYE = 1e12, 1e-30
_BEYOND = (
    "what a sample beyond the border sees: nothing, so that it adds nothing; a texel inside, by GPU samplers' clamp to "
    "edge, repeat or mirrored repeat"
)


@dataclass(frozen=True)
class Bordered(Options):
    """Options of estimators whose samples are looked up in texels."""

    border: str = option("open", _BEYOND, choices=tuple(BORDERS))


@dataclass(frozen=True)
class LookUps(Bordered):
    """Options of estimators that compare each sample with the surface of a texel."""

    border: str = option("open", f"{_BEYOND}; or background", choices=(*BORDERS, BACKGROUND))
    background: str = option(
        "open", "whether background hides nothing, or textures are cleared to a place there", choices=("open", CLEARED)
    )
    filter: str = option(
        "nearest",
        "whether a sample reads the texel that it lies in, or between the four centres around it, as a linear sampler",
        choices=("nearest", "linear"),
    )
    cleared: float = option(
        0.0,
        "this place: its distance along a camera's axis, 0 its eye; of a display metres behind the screen",
        limits=(-_FARTHEST, _FARTHEST),
    )


def text_options(estimator: Estimator) -> dict[str, Value]:
    """Return the default options of an estimator's own text, without those of its look-ups."""
    made = {option: value for option, value in estimator.parameters.items() if option not in LOOK_UPS}
    background = made.pop("background", None)
    is_text = BACKGROUNDS[1] in estimator.said("choices").get("background", ())
    return {**made, "background": background} if background is not None and is_text else made


def cleared_z(options: Options) -> float | None:
    """Cast z of the places that texels without a surface hold; None where they hold none."""
    return options.cleared if isinstance(options, LookUps) and options.background == CLEARED else None


def look_of(options: Options, texels: int) -> Look | None:
    """Return how image points are looked up; None for texels alone, of the texture and with surfaces.

    texels: the number of the texel that stands for background, the first behind those of the texture.
    """
    border, cleared = options.border if isinstance(options, Bordered) else "open", cleared_z(options) is not None
    linear = True if isinstance(options, LookUps) and options.filter == "linear" else None
    if border == "open" and not cleared and not linear:
        return None
    outside = texels if border == BACKGROUND else NOTHING
    return Look(BORDERS.get(border, VALUE), outside, cleared=cleared, linear=linear)


def cleared_places(view: View, u: Texture, v: Texture, z: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return depth, (K,), and world points, (K, 3), at cast z on the rays through image points.

    The depth of a camera's eye is that of a place just before it, and not minus infinity.
    """
    lines = np.empty((len(u), 8))
    write_lines(view.rays, np.ravel(view.world_from_cast), u, v, lines)
    seen = z if view.screen_to_world is None else max(z, _EYE)
    return view.depth_at(np.full(len(u), seen)), lines[:, :3] + z * (lines[:, 3:6] - lines[:, :3])


def with_cleared(buffers: Buffers, z: float | None) -> Buffers:
    """Return textures whose texels without a surface hold a place at cast z on their rays, or the same for None."""
    if z is None:
        return buffers
    rows, columns = np.nonzero(~(buffers.depth < np.inf))
    depth, positions = buffers.depth.copy(), buffers.positions.copy()
    depth[rows, columns], positions[rows, columns] = cleared_places(buffers.view, columns + 0.5, rows + 0.5, z)
    return replace(buffers, depth=depth, positions=positions)


def one_more(texture: Texture, value: object) -> Texture:
    """Return a texture row by row with a texel of a value behind its own."""
    return np.append(texture.ravel(), np.asarray(value, texture.dtype))


def check_perspective(name: str, view: View) -> None:
    """Refuse (InputError) a view in which texels do not shrink with distance as a perspective camera's do."""
    if view.screen_to_world is None or view.lens[6]:
        raise InputError(f"estimator {name} measures texels of a perspective camera, and this view is none")
