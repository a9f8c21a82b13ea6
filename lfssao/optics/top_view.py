"""A drawing of a display from above: where screen, modules, observers and rays are."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lfssao.core.files import write_whole
from lfssao.errors import InputError
from lfssao.optics.display import Display

_FORMATS = (".png", ".svg", ".pdf")


def draw_top_view(display: Display) -> Figure:
    """A figure of a display from above: x to the right, z upwards, metres, the viewers below; with outermost rays."""
    figure = Figure(layout="constrained")
    axes = figure.add_subplot(aspect="equal", xlabel="x, metres", ylabel="z, metres (away from the viewers)")
    count = len(display.modules)
    for index, color in {0: "tab:blue", count - 1: "tab:purple", count // 2: "tab:cyan"}.items():
        for number, ray in enumerate(_outer_rays(display, index)):
            label = f"rays of module {index}" if number == 0 else None
            axes.plot(ray[:, 0], ray[:, 1], color=color, linewidth=0.9, label=label)
    half = 0.5 * display.screen_width
    axes.plot(*_arc(display.screen_curvature, 0.0, half), color="black", linewidth=3, label="screen")
    met = np.concatenate([_outer_rays(display, index)[:, 0, 0] for index in (0, -1)])  # the observers, by these rays
    reach = float(np.abs(met).max(initial=half))
    axes.plot(
        *_arc(display.observer_curvature, display.observer_z, reach), color="tab:green", linewidth=2, label="observers"
    )
    places = [(m.x, m.z) for m in display.modules]
    label = "1 module" if count == 1 else f"{count} modules"
    axes.plot(*zip(*places, strict=True), "s", color="tab:red", markersize=4, label=label)
    (x0, _, z0), (x1, _, z1) = display.roi
    axes.fill([x0, x1, x1, x0], [z0, z0, z1, z1], color="tab:orange", alpha=0.25, label="region of interest")
    axes.set_title(f"{display.name}, seen from above: {display.diffuser} diffuser")
    figure.legend(loc="outside lower center", ncols=4, fontsize="small")
    # As high as the drawing needs at that width, and room for title and legend.
    figure.set_size_inches(8, 7 * min(axes.dataLim.height / axes.dataLim.width, 1.5) + 1.8)
    return figure


def _arc(curvature: float, z: float, half: float) -> tuple[Any, Any]:
    """Points, x and z, of the circle of that curvature through (0, z), for abs(x) <= half, as far as it goes."""
    if curvature != 0.0:
        half = min(half, 0.999 / abs(curvature))
    x = np.linspace(-half, half, 201)
    root = np.sqrt(1.0 - curvature * x * (curvature * x))
    return x, z + curvature * x * x / (1.0 + root)


def _outer_rays(display: Display, index: int) -> Any:
    """Ends (x, z) of the rays through the left, middle and right texel of a module's middle row: (3, 2, 2)."""
    module = display.modules[index]
    u = np.array([0.5, 0.5 * module.width, module.width - 0.5])
    origin, direction, span = display.texel_ray(index, u, 0.5 * module.height)
    ends = [np.stack([origin[:, 0] + z * direction[:, 0], z], axis=1) for z in (span[:, 0], span[:, 1])]
    return np.stack(ends, axis=1)[span[:, 0] < span[:, 1]]


def save_top_view(display: Display, path: Path) -> None:
    """Draw a display from above into a .png, .svg or .pdf; InputError for another ending or if it cannot be written."""
    if path.suffix not in _FORMATS:
        raise InputError(f"--plot {path}: its name must end in one of {', '.join(_FORMATS)}")
    figure = draw_top_view(display)
    write_whole(path, lambda part: figure.savefig(part, dpi=150, bbox_inches="tight"))
