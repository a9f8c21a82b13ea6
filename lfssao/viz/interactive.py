"""Sliders for the main settings of AO on a display: radius, samples, module."""

from typing import TYPE_CHECKING, Any

from lfssao.errors import MissingPackageError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.rendering.passes import render_view
from lfssao.rendering.settings import Settings, diagonal
from lfssao.rendering.views import module_views
from lfssao.samples import METHODS, ROTATIONS, make_samples
from lfssao.scene.mesh import Mesh

if TYPE_CHECKING:
    from ipywidgets import VBox


def explore(mesh: Mesh, display: Display, radius: float = 0.05, samples: int = 8) -> "VBox":
    """Return sliders above a picture of one module, the last child: without AO, visibility, and with AO.

    Textures of some 100,000 texels keep up with a slider. At first R is ``radius``, 0.005 to 0.2 of the diagonal of the
    mesh's box, and the number of samples is 1 to 64. MissingPackageError if ipywidgets is not installed.
    """
    try:
        import ipywidgets as widgets  # late: optional, the extra 'notebooks' installs it
    except ImportError as error:
        raise MissingPackageError("sliders need ipywidgets: pip install 'lfssao[notebooks]'") from error
    views = module_views(mesh, display)
    caster = RayCaster(mesh, views[0].cast_from_world)
    options: dict[str, Any] = {"continuous_update": False}
    controls = {
        "radius": widgets.FloatLogSlider(radius, min=-2.3, max=-0.7, step=0.05, description="radius", **options),
        "count": widgets.IntSlider(samples, min=1, max=64, description="samples", **options),
        "method": widgets.Dropdown(options=list(METHODS["ball"]), value="latin", description="sampler"),
        "rotation": widgets.Dropdown(options=list(ROTATIONS), value="hash", description="rotation"),
        "seed": widgets.IntSlider(0, min=0, max=20, description="seed", **options),
        "module": widgets.IntSlider(len(views) // 2, min=0, max=len(views) - 1, description="module", **options),
        "blur": widgets.FloatSlider(1.0, min=0.0, max=4.0, step=0.5, description="blur", **options),
    }
    picture = widgets.Image(format="png")

    def redraw(_: Any = None) -> None:
        at = {name: control.value for name, control in controls.items()}
        table = make_samples(at["method"], at["count"], at["seed"])
        settings = Settings((at["radius"] * diagonal(mesh),), table, at["blur"], rotation=at["rotation"])
        picture.value = render_view(caster, views[at["module"]], settings)._repr_png_()

    for control in controls.values():
        control.observe(redraw, "value")
    redraw()
    half = (len(controls) + 1) // 2
    columns = [widgets.VBox(part) for part in (list(controls.values())[:half], list(controls.values())[half:])]
    return widgets.VBox([widgets.HBox(columns), picture])
