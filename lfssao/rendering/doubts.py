"""Sentences on what is allowed and is probably not meant; each becomes an ``InputWarning``.

The command line prints these warnings as it prints errors, each once.
"""

import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from lfssao.errors import InputWarning
from lfssao.optics.display import Display
from lfssao.optics.display_file import ViewSet
from lfssao.optics.view import View
from lfssao.rendering.settings import Settings, diagonal
from lfssao.rendering.views import Box
from lfssao.scene.mesh import Mesh

_WIDEST = 50.0  # metres; no screen that scatters light fields is a tenth as wide
_WIDEST_LENS = 0.05  # metres; lenses of no panel are half as far apart
_FARTHEST = 50.0  # widths of a small screen; nobody sees its light field from a tenth as far
_OURS = r"((module|view|lens)_\d{3,}|camera|left|right)\.(exr|png)"


def warn(sentences: Iterable[str], level: int = 3) -> None:
    """Issue an ``InputWarning`` for each sentence, on behalf of the caller's caller."""
    for sentence in sentences:
        warnings.warn(sentence, InputWarning, stacklevel=level)


def of_display(display: Display | ViewSet) -> Iterator[str]:
    """Numbers that look like millimetres."""
    is_wide = max(display.screen_width, display.screen_height) > _WIDEST
    if is_wide:
        size = f"{display.screen_width:g} x {display.screen_height:g}"
        yield f"display {display.name}: its screen is {size} metres large: did you mean millimetres?"
    lens_pitch = getattr(display, "lens_pitch", 0.0)
    if not is_wide and lens_pitch > _WIDEST_LENS:
        yield f"display {display.name}: its lenses are {lens_pitch:g} metres apart: did you mean millimetres?"
    if is_wide or isinstance(display, ViewSet):
        return
    limit = min(_WIDEST, _FARTHEST * max(display.screen_width, display.screen_height))
    large = [f"{name} is {length:g}" for name, length in _lengths(display) if abs(length) > limit]
    if large:
        yield f"display {display.name}: its {', its '.join(large)} metres: did you mean millimetres?"


def _lengths(display: Display) -> Iterator[tuple[str, float]]:
    """Lengths of a display but its screen's size, by their keys in its file, metres; of the modules the largest."""
    for key, curvature in (("screen", display.screen_curvature), ("observer", display.observer_curvature)):
        if curvature:
            yield f"{key}.radius", 1 / abs(curvature)
    yield "observer.height", display.observer_height
    yield "observer.distance", -display.observer_z
    for axis in "xyz":
        yield f"modules' {axis}", max((getattr(module, axis) for module in display.modules), key=abs)
    for corner, place in zip(("min", "max"), display.roi, strict=True):
        yield f"roi.{corner}", max(place, key=abs)


def of_radii(mesh: Mesh, views: Sequence[View], settings: Settings, boxes: Sequence[Box]) -> Iterator[str]:
    """Radii that reach across the scene, or not to the next texel; ``boxes`` are the scene's in each frame, (2, 3)."""
    radii = settings.radii if {"ao", "bent"} & set(settings.computed) else ()
    size = diagonal(mesh)
    large = [f"{radius:g}" for radius in radii if radius > 0.5 * size]
    if large:
        named = _named("radius", "radii", large)
        wanted = ", ".join(f"{name} %" for name in large)
        yield f"{named} more than half of the scene's diagonal, {size:g}: did you mean {wanted}?"
    small = [f"{radius:g}" for radius in subpixel_radii(views, boxes, radii)]
    if small:
        says = "its AO says" if len(small) == 1 else "their AO says"
        yield f"{_named('radius', 'radii', small)} less than half a texel everywhere: {says} nothing"


def of_views(names: Sequence[str]) -> Iterator[str]:
    """Yield views, by their names, whose textures are empty."""
    if names:
        yield f"{_few(names)} {'sees' if len(names) == 1 else 'see'} nothing of the scene"


def of_folder(folder: Path, own: Iterable[Path]) -> Iterator[str]:
    """Yield textures and pictures in an output folder, or in its folders of frames, that are not a job's ``own``."""
    others = {*folder.glob("*.*"), *folder.glob("frame_*/*.*")} - {*own}
    stale = sorted(str(path.relative_to(folder)) for path in others if re.fullmatch(_OURS, path.name))
    if stale:
        yield f"{folder}: {_few(stale)} {'is' if len(stale) == 1 else 'are'} left there of another job"


def _named(one: str, many: str, names: Sequence[str]) -> str:
    return f"{one} {names[0]} is" if len(names) == 1 else f"{many} {', '.join(names)} are"


def _few(names: Sequence[str]) -> str:
    """Return the first names, and how many there are beyond them."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more


def subpixel_radii(views: Sequence[View], boxes: Sequence[Box], radii: Iterable[float]) -> tuple[float, ...]:
    """Radii above 0 whose ball covers less than half a texel to each side, at each corner of the boxes, in each view.

    Their samples read the depth of their own texel: such AO says nothing about the scene. Boxes are (2, 3) float64 and
    radii in world units.
    """
    places = list(product(views, boxes))
    return tuple(r for r in radii if r > 0 and all(_extent(view, box, r) < 0.5 for view, box in places))


def _extent(view: View, box: Box, radius: float) -> float:
    """Largest distance along u or v, texels, that balls at a box's corners reach to a side; NaN where unknown."""
    to_image = view.world_to_image
    corners = np.array(list(product(*box.T)))
    steps = to_image(corners[:, None] + radius * np.eye(3)) - to_image(corners)[:, None]
    return float(np.sqrt((steps[..., :2] ** 2).sum(axis=1)).max())
