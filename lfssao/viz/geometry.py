"""A display's geometry, changed: distance of the observers, number of modules, diffuser, and the effect of each."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.core.arguments import as_number, check_whole
from lfssao.errors import InputError, check_type
from lfssao.optics.display import Display
from lfssao.optics.kernels.display import VALID
from lfssao.viz.display import draw_plans
from lfssao.viz.mapping import best_matrix, roi_lattice

_STEPS = 33  # points of an edge of the region of interest, which a mapping bends


@dataclass(frozen=True)
class Geometry:
    """Numbers of a display that its geometry decides."""

    seen: int  # number of modules that an eye at x = 0 on the observers' line sees through the screen
    step: float  # way along the observers' line from one module's light to the next, at one point of the screen, metres
    moved: float  # largest distance of the last module's image points from those of the display given, texels
    rmse: float  # root mean square distance of its image points from those by the matrix that fits best, texels


def with_geometry(display: Display, distance: float, modules: int, diffuser: str) -> Display:
    """Return the display with observers at another distance, another number of modules in its row, and a diffuser.

    The row keeps its ends, and its modules their distance from the screen, texture and optics. InputError if its
    modules differ in more than x, there is one only, or no such display can exist.

    >>> lfssao.viz.with_geometry(lfssao.find_display("sample-a"), 1.5, 41, "conical").observer_z
    -1.5
    """
    check_type("display", display, Display)
    first, *_, last = (display.modules[0], *display.modules)
    if first.x == last.x or any(replace(module, x=first.x) != first for module in display.modules):
        raise InputError(f"display {display.name}: modules: they must be at least two, in a row along x, and alike")
    count = check_whole("modules", modules, 2, 1000)
    row = tuple(replace(first, x=float(x)) for x in np.linspace(first.x, last.x, count))
    return replace(display, observer_z=-as_number(distance), modules=row, diffuser=diffuser)


def geometry_of(changed: Display, display: Display) -> Geometry:
    """Return the numbers of a display that ``with_geometry`` made of another one; both screens are flat.

    InputError if a screen or a line of observers is curved.
    """
    if any((each.screen_curvature, each.observer_curvature) != (0, 0) for each in (changed, display)):
        raise InputError(f"display {changed.name}: screen and observers' line must be straight")
    x = np.array([module.x for module in changed.modules])
    behind = changed.modules[0].z
    distance = -changed.observer_z
    crossing = x * distance / (distance + behind)  # of the screen, by the line from the eye to the lens
    points = roi_lattice(changed)
    image, shown = changed.physical_to_image(len(x) - 1, points)
    before, shown_before = display.physical_to_image(len(display.modules) - 1, points)
    both = (shown == VALID) & (shown_before == VALID)
    world_to_image = changed.view(len(x) - 1, np.eye(3, 4)).world_to_image
    return Geometry(
        seen=int(np.count_nonzero(np.abs(crossing) <= 0.5 * changed.screen_width)),
        step=float(np.diff(x).mean()) * distance / behind,
        moved=float(np.hypot(*(image - before)[both, :2].T).max(initial=0.0)),
        rmse=best_matrix(world_to_image, points[shown == VALID]).rmse,
    )


def draw_geometry(changed: Display, display: Display) -> tuple[Figure, str]:
    """Return a figure of a changed display and of its last module's texture, and a sentence of its ``Geometry``.

    The texture shows the edges of the region of interest, dashed as the display given maps them. ``sliders`` shows
    figure and sentence. InputError as ``geometry_of``.
    """
    found = geometry_of(changed, display)
    figure = Figure(figsize=(10, 6.6), layout="constrained")
    halves: Any = figure.subfigures(2, 1, height_ratios=(1.1, 1))
    top, bottom = halves
    panels = top.subplots(1, 2, sharey=True, width_ratios=(4, 1))
    draw_plans(panels, changed)
    top.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize="x-small")
    axes = bottom.subplots()
    for mapped, look in ((display, {"color": "gray", "linestyle": "--"}), (changed, {})):
        for z, edge in _edges(mapped):
            color = {-1: "tab:blue", 0: "tab:olive", 1: "tab:red"}[z]
            axes.plot(*edge.T, **({"color": color} | look), linewidth=1.2)
    module = changed.modules[-1]
    axes.plot([0, module.width, module.width, 0, 0], [0, 0, module.height, module.height, 0], color="black", lw=1)
    axes.set(aspect="equal", xlabel="u, texels", ylabel="v, texels")
    axes.set_title(f"texture of the last module: region of interest, near blue, far red; dashed {display.name}")
    axes.invert_yaxis()
    eyes = f"An eye in the middle sees {found.seen} of {len(changed.modules)} modules"
    steps = f"and passes from one to the next every {1000 * found.step:.0f} mm"
    image = f"The last module's image moves by up to {found.moved:.0f} texels from {display.name}"
    return figure, f"{eyes}, {steps}. {image}, and its best matrix misses by {found.rmse:.0f} texels."


def _edges(display: Display) -> list[tuple[int, NDArray[np.float64]]]:
    """Images of the 12 edges of the region of interest, (k, 2), with -1 for the near face, 1 the far, 0 between."""
    low, high = np.array(display.roi)
    way = np.linspace(0, 1, _STEPS)
    edges = []
    for axis, (a, b) in product(range(3), product((0.0, 1.0), repeat=2)):
        share = np.insert([[a, b]] * _STEPS, axis, way, axis=1)
        face = 0 if axis == 2 else int(2 * b - 1)
        image, _ = display.physical_to_image(len(display.modules) - 1, low + share * (high - low))
        edges.append((face, image[:, :2]))
    return edges
