"""A drawing of a display from above and from the side: where screen, modules, observers and rays are."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lfssao.errors import InputError
from lfssao.files.whole import write_whole
from lfssao.optics.display import Display

_FORMATS = (".png", ".svg", ".pdf")


def draw_display(display: Display) -> Figure:
    """Return a figure of a display from above, (x, z), and from the side, (y, z), in metres, the viewers below.

    It shows the modules, the screen, the observers' line or arc, the region of interest, and rays of the first, middle
    and last module: those of the middle row of texels from above, those of the middle column from the side. From above
    they meet in the module's lens, from the side in the observers' line (LF figure 8).
    """
    figure = Figure(layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    draw_plans(panels, display)
    figure.suptitle(f"{display.name}: {display.diffuser} diffuser")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small")
    above, side = (axes.dataLim.width for axes in panels)
    side = max(side, 0.25 * above)  # its title needs the room
    panels[0].get_gridspec().set_width_ratios((above, side))
    # As high as the drawing from above needs at its width, and room for titles and legend.
    height = 8.5 * above / (above + side) * min(panels[0].dataLim.height / above, 1.2)
    figure.set_size_inches(10, height + 1.6)
    return figure


def draw_plans(panels: Sequence[Any], display: Display) -> None:
    """Draw a display from above into the first of two panels, which share z, and from the side into the second."""
    met = np.concatenate(
        [_rays(display, index, 0)[:, 0, 0] for index in (0, len(display.modules) - 1)]
    )  # the observers, by these rays
    reach = float(np.abs(met).max(initial=0.5 * display.screen_width))
    for axis, (axes, name) in enumerate(zip(panels, ("x", "y"), strict=True)):
        _draw(axes, display, axis, reach)
        axes.set(xlabel=f"{name}, metres", title=("from above", "from the side")[axis])
        axes.set_aspect("equal", adjustable="datalim")
    panels[0].set_ylabel("z, metres (away from the viewers)")


def _draw(axes: Any, display: Display, axis: int, reach: float) -> None:
    """A panel: abscissa x (axis 0) or y (axis 1), ordinate z; the observers' line is drawn up to abs(x) = reach."""
    count = len(display.modules)
    for index, color in {0: "tab:blue", count - 1: "tab:purple", count // 2: "tab:cyan"}.items():
        for number, ray in enumerate(_rays(display, index, axis)):
            label = f"rays of module {index}" if number == 0 else None
            axes.plot(ray[:, 0], ray[:, 1], color=color, linewidth=0.9, label=label)
    half = 0.5 * (display.screen_width, display.screen_height)[axis]
    screen = _arc(display.screen_curvature, 0.0, half) if axis == 0 else ([-half, half], [0.0, 0.0])
    axes.plot(*screen, color="black", linewidth=3, label="screen")
    if axis == 0:
        line = _arc(display.observer_curvature, display.observer_z, reach)
        axes.plot(*line, color="tab:green", linewidth=2, label="observers")
    else:
        axes.plot(display.observer_height, display.observer_z, "o", color="tab:green")
    places = [((m.x, m.y)[axis], m.z) for m in display.modules]
    label = "1 module" if count == 1 else f"{count} modules"
    axes.plot(*zip(*places, strict=True), "s", color="tab:red", markersize=4, label=label)
    (low, z0), (high, z1) = ((corner[axis], corner[2]) for corner in display.roi)
    axes.fill([low, high, high, low], [z0, z0, z1, z1], color="tab:orange", alpha=0.25, label="region of interest")


def _arc(curvature: float, z: float, half: float) -> tuple[Any, Any]:
    """Return points, x and z, of the circle of that curvature through (0, z), for abs(x) <= half, as far as it goes."""
    if curvature != 0.0:
        half = min(half, 0.999 / abs(curvature))
    x = np.linspace(-half, half, 201)
    root = np.sqrt(1.0 - curvature * x * (curvature * x))
    return x, z + curvature * x * x / (1.0 + root)


def _rays(display: Display, index: int, axis: int) -> Any:
    """Ends of the rays through the first, middle and last texel of a module's middle row or column: (3, 2, 2)."""
    module = display.modules[index]
    size = np.array([module.width, module.height], np.float64)
    texels = np.repeat(0.5 * size[None], 3, axis=0)
    texels[[0, 2], axis] = 0.5, size[axis] - 0.5
    origin, direction, span = display.texel_ray(index, *texels.T)
    ends = [np.stack([origin[:, axis] + z * direction[:, axis], z], axis=1) for z in (span[:, 0], span[:, 1])]
    return np.stack(ends, axis=1)[span[:, 0] < span[:, 1]]


def save_drawing(display: Display, path: Path) -> None:
    """Draw a display into a .png, .svg or .pdf; InputError for another ending or if it cannot be written."""
    if path.suffix not in _FORMATS:
        raise InputError(f"--plot {path}: its name must end in one of {', '.join(_FORMATS)}")
    figure = draw_display(display)
    write_whole(path, lambda part: figure.savefig(part, dpi=150, bbox_inches="tight"))
