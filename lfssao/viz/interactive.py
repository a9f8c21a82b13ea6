"""Sliders for the arguments of a function that draws a picture, and for the main settings of AO on a display."""

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from html import escape, unescape
from inspect import signature
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lfssao.ao import post
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError, MissingPackageError
from lfssao.files.pictures import figure_png
from lfssao.gbuffer.caster import GBuffer, RayCaster
from lfssao.optics.display import Display
from lfssao.optics.display_file import find_display
from lfssao.rendering.passes import finish_view
from lfssao.rendering.settings import Settings, diagonal
from lfssao.rendering.textures import Textures
from lfssao.rendering.views import module_views
from lfssao.samples import METHODS, ROTATIONS, SampleSet, make_samples
from lfssao.scene.builtin import find_scene
from lfssao.scene.mesh import Mesh
from lfssao.viz.display import draw_display
from lfssao.viz.samples import draw_samples
from lfssao.viz.timing import least_seconds
from lfssao.viz.truth import Texture, deviation

EXACT = 1024  # samples of the reference of ``explore``


def sliders(draw: Callable[..., Any], units: Mapping[str, str] | None = None, **values: Sequence[Any]) -> Any:
    """Return a slider for each argument of draw, a menu where its values are words, above the picture of its result.

    ``draw`` returns a figure, or what a notebook shows as a picture, alone or in a pair with a sentence, which stands
    above it; its defaults are shown first, and are among the values. ``units`` has the units that sliders show after
    their values, by arguments. An InputError is shown as its sentence. A page without a kernel, as a repository's,
    shows the first picture. MissingPackageError if ipywidgets is not installed.
    """
    try:
        import ipywidgets as widgets  # late: optional, the extra 'notebooks' installs it
    except ImportError as error:
        raise MissingPackageError("sliders need ipywidgets: pip install 'lfssao[notebooks]'") from error
    controls = {}
    first = signature(draw).parameters
    for name, choices in values.items():
        unit = f" {(units or {}).get(name, '')}".rstrip()
        given = {"options": [(f"{_text(each)}{unit}", each) for each in choices], "value": first[name].default}
        is_menu = isinstance(choices[0], str)
        kind = widgets.Dropdown if is_menu else partial(widgets.SelectionSlider, continuous_update=False)
        controls[name] = kind(**given, description=name)
    picture = widgets.Image(format="png")
    sentence = widgets.HTML()  # a Label does not break its line

    def redraw(_: Any = None) -> None:
        try:
            drawn = draw(**{name: control.value for name, control in controls.items()})
            shown, words = drawn if isinstance(drawn, tuple) else (drawn, "")
            png = _png(shown)
            sentence.value = escape(words, quote=False)
            picture.value = png
        except InputError as error:
            sentence.value = escape(str(error), quote=False)

    class Sliders(widgets.VBox):  # type: ignore[misc]
        def _repr_mimebundle_(self, **options: Any) -> dict[str, Any]:
            shown_values = ", ".join(f"{name} = {_text(control.value)}" for name, control in controls.items())
            text = "\n".join(filter(None, [f"sliders: {shown_values}", unescape(sentence.value)]))
            bundle: dict[str, Any] = super()._repr_mimebundle_(**options)
            return bundle | {"text/plain": text, "image/png": b64encode(picture.value).decode()}

    for control in controls.values():
        control.observe(redraw, names="value")
    redraw()
    half = (len(controls) + 1) // 2
    columns = [widgets.VBox(part) for part in (list(controls.values())[:half], list(controls.values())[half:])]
    return Sliders([widgets.HBox(columns), sentence, picture])


def _png(drawn: Any) -> bytes:
    """Return the picture that a notebook shows of an object, a PNG file."""
    if isinstance(drawn, Display):
        return figure_png(draw_display(drawn))
    if isinstance(drawn, SampleSet):
        return figure_png(draw_samples([drawn]))
    if isinstance(drawn, Figure):
        return figure_png(drawn)
    picture: bytes = drawn._repr_png_()
    return picture


def _text(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"


def explore(mesh: Mesh | str, display: Display | str) -> Any:
    """Return sliders for the settings of one module's textures: without AO, visibility, and with AO.

    A sentence has the RMSE of blurred occlusion over the surface, against 1024 samples of Sobol's sequence, not turned
    and blurred alike, and the milliseconds of the kernel, the least of two runs after one that compiles. Mesh and
    display are objects, names or files. Textures of some 100,000 texels keep up with a slider. The radius is in per
    cent of the diagonal of the mesh's box.
    """
    mesh = find_scene(mesh)
    views = module_views(mesh, find_display(display))
    caster = RayCaster(mesh, views[0].cast_from_world)
    middle = len(views) // 2

    @lru_cache(4)
    def gbuffer_of(module: int) -> GBuffer:
        return caster.gbuffer(views[module])

    @lru_cache(32)
    def exact_of(module: int, radius: float) -> Texture:
        buffers = Buffers.of(gbuffer_of(module), views[module])
        return estimate("lf", buffers, radius, make_samples("sobol", EXACT)).texture

    def draw(module: int = middle, radius: float = 5.0, samples: int = 8, sampler: str = "latin",
             rotation: str = "hash", seed: int = 0, blur: float = 1.0) -> tuple[Textures, str]:  # fmt: skip
        length = radius / 100 * diagonal(mesh)
        settings = Settings((length,), make_samples(sampler, samples, seed), blur, rotation=rotation)
        textures = finish_view(gbuffer_of(module), views[module], settings)
        assert textures.blurred is not None
        if textures.surface_texels == 0:
            return textures, f"Module {module} sees no surface."
        buffers = Buffers.of(gbuffer_of(module), views[module])
        buffers = buffers if rotation == "none" else buffers.turned(rotation)
        milliseconds = 1000 * least_seconds(lambda: estimate("lf", buffers, length, settings.samples))
        exact = post.blur(exact_of(module, length), blur)
        rmse = deviation(textures.blurred, exact, textures.gbuffer.triangle >= 0).rmse
        reference = f"{EXACT} samples of Sobol's sequence, not turned, with the same radius and blur"
        return textures, f"RMSE {rmse:.3f} against {reference}; the kernel took {milliseconds:.2f} ms."

    radii = (0.5, 0.7, 1, 1.4, 2, 2.8, 3.5, 5, 7, 10, 14, 20)
    units = {"radius": "% of the diagonal", "blur": "texels"}
    return sliders(draw, units, module=range(len(views)), radius=radii, samples=range(1, 65),
                   sampler=list(METHODS["ball"]), rotation=list(ROTATIONS), seed=range(21),
                   blur=np.arange(0, 4.5, 0.5).tolist())  # fmt: skip
