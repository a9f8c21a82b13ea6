"""The views of a display's modules, quilt or lenses, the scene fitted into the display's region of interest."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.arguments import as_whole
from lfssao.errors import InputError, shown
from lfssao.optics.display import Display, fit_roi
from lfssao.optics.display_file import ViewSet, find_display, find_views
from lfssao.optics.view import View, box_of, check_positions
from lfssao.scene.builtin import find_scene
from lfssao.scene.mesh import Mesh

if TYPE_CHECKING:
    from lfssao.optics.lenslet import LensletDisplay

Box = NDArray[np.float64]  # (2, 3): lower and upper corner


def chosen_modules(display: Display | ViewSet, modules: Iterable[int] | None) -> Sequence[int]:
    """Numbers of modules, views or lenses, all for None; InputError if they are none, or not all of the display."""
    count = display.count if isinstance(display, ViewSet) else len(display.modules)
    if modules is None:
        return range(count)
    if not isinstance(modules, Iterable) or (isinstance(modules, np.ndarray) and modules.ndim != 1):
        raise InputError(f"modules is {shown(modules)}, it must be a range or a list of numbers")
    given: Sequence[Any] = modules if isinstance(modules, range) else list(modules)
    ends = [given[0], given[-1]] if isinstance(given, range) and given else given
    numbers = [number for number in map(as_whole, ends) if number is not None and 0 <= number < count]
    if not given or len(numbers) < len(ends):
        named = f"{modules.start}:{modules.stop}" if isinstance(modules, range) else shown(given)
        kind = display.WORDS[1] if isinstance(display, ViewSet) else "modules"
        raise InputError(f"modules {named} are not a part of 0:{count}, the {kind} of {display.name}")
    return given if isinstance(given, range) else numbers


def module_views(
    mesh: Mesh | str | Path,
    display: Display | ViewSet | str | Path,
    modules: Sequence[int] | None = None,
    guard: int = 0,
    bounds: Box | None = None,
) -> list[View]:
    """The views of a display's modules, quilt or lenses, all by default, a box of world space fitted into its ROI.

    Mesh and display may be names or files (``find_scene``, ``find_views``), modules a range or a list of numbers.
    ``guard`` is the width of the guard band, texels (``Display.view``), and ``bounds``, (2, 3) float64, the box's lower
    and upper corner, world units, the mesh's own by default. InputError if the range holds no module, or one that the
    display does not have; if the box is too far from the world's origin for float32 positions
    (``lfssao.optics.view.check_positions``).

    >>> [view.name for view in lfssao.module_views("statue", "sample-a", modules=[9, 10])]
    ['module_009', 'module_010']
    """
    mesh = find_scene(mesh)
    display = find_views(display)
    wanted = chosen_modules(display, modules)
    box = mesh.bounds if bounds is None else box_of("bounds", bounds)
    physical_from_world = fit_roi(box, display.roi)
    views = [display.view(index, physical_from_world, guard) for index in wanted]
    texels = max(view.width - 2 * view.guard for view in views) / display.screen_width
    check_positions(box, texels * float(physical_from_world[0, 0]))
    return views


def neighbour_views(
    mesh: Mesh,
    display: Display | ViewSet,
    count: int,
    modules: Sequence[int] | None = None,
    guard: int = 0,
    bounds: Box | None = None,
) -> list[tuple[View, ...]]:
    """Views of the ``count`` nearest modules, or lenses, of each, as of ``module_views``; InputError if fewer are."""
    wanted = chosen_modules(display, modules)
    if count == 0:
        return [()] * len(wanted)
    from lfssao.optics.lenslet import LensletDisplay  # late: few jobs ask neighbours

    display = display if isinstance(display, LensletDisplay) else find_display(display)
    views = module_views(mesh, display, None, guard, bounds)
    return [tuple(views[k] for k in nearest_modules(display, index, count)) for index in wanted]


def nearest_modules(display: "Display | LensletDisplay", index: int, count: int) -> list[int]:
    """Modules whose lenses are nearest to one's, without itself; of equals the lower first. InputError if too few.

    The lenses of a lenslet display are its modules.
    """
    if isinstance(display, Display):
        lenses = [(m.x, m.y, m.z) for m in display.modules]
        one = "module"
        several = "modules"
    else:
        lenses = display.lenses
        one, several = display.WORDS
    others = len(lenses) - 1
    if not 0 <= count <= others:
        raise InputError(f"neighbours is {count}: {display.name} has {others} {several} besides {one} {index}")
    x, y, z = lenses[index]
    away = [(a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2 for a, b, c in lenses]
    return sorted(set(range(len(away))) - {index}, key=lambda k: (away[k], k))[:count]
