"""The order of the passes: from a mesh and a view to all textures of that view (LF section 7)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, SupportsIndex, TypeVar, overload

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.registry import estimate_radii
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers, Neighbour
from lfssao.core.arguments import as_whole
from lfssao.errors import InputError, check_type, shown
from lfssao.gbuffer.caster import DepthCache, GBuffer, RayCaster, textures_kept
from lfssao.optics.display import Display
from lfssao.optics.display_file import ViewSet, find_views
from lfssao.optics.view import View, seen_rows, without_guard
from lfssao.rendering import doubts
from lfssao.rendering.settings import Settings, settings_of
from lfssao.rendering.textures import FloatTexture, Textures
from lfssao.rendering.views import module_views, neighbour_views
from lfssao.samples.rotation import noise_turns
from lfssao.scene.builtin import find_scene
from lfssao.summary import Table

Made = TypeVar("Made")

# Estimators that count samples behind a surface, of texels with a surface alone: at radius 0 all have one outcome.
COUNTING = "lf", "lf-neighbours"

_LAYER_OF = {"ao": "ao", "bent": "bent", "merge": "merged", "blur": "blurred", "shade": "shaded"}


def render_view(caster: RayCaster, view: View, settings: Settings, neighbours: Sequence[Neighbour] = ()) -> Textures:
    """Run all passes for one view, as far as the scene and the layers need them (``lfssao.rendering.plan``).

    The caster has the mesh in the view's cast space. Neighbours are mapping, ``WorldToImage``, and depth texture, (H,
    W) float32, of each other module that is asked.

    >>> mesh, display = lfssao.find_scene("corner"), lfssao.find_display("virtual").with_resolution(64, 48)
    >>> (view,) = lfssao.module_views(mesh, display)
    >>> lfssao.render_view(lfssao.RayCaster(mesh, view.cast_from_world), view, lfssao.Settings((0.1,))).merged.shape
    (48, 64)
    """
    check_type("caster", caster, RayCaster)
    check_type("view", view, View)
    check_type("settings", settings, Settings)
    check_type("neighbours", neighbours, Sequence)
    computed = settings.computed
    seconds = dict[str, float]()
    filter_of_colors = settings.color_filter if "color" in computed else None
    normals = settings.normals if "normals" in computed else None
    rows = seen_rows(view, caster.bounds)
    wanted = filter_of_colors, normals, rows, settings.caster, "positions" in computed
    gbuffer = _timed(seconds, "ray_cast", lambda: caster.gbuffer(view, *wanted))
    return finish_view(gbuffer, view, settings, seconds, neighbours)


def finish_view(
    gbuffer: GBuffer,
    view: View,
    settings: Settings,
    seconds: dict[str, float] | None = None,
    neighbours: Sequence[Neighbour] = (),
) -> Textures:
    """Run the passes after the first for a view; ``seconds`` has the time of the first, others as ``render_view``."""
    computed = settings.computed
    kept = settings.kept
    seconds = {} if seconds is None else seconds
    surface_texels = int(np.count_nonzero(gbuffer.triangle >= 0))

    def run(name: str, work: Callable[[], Made], blank: Made) -> Made:
        """Run a pass; ``blank`` stands for its result where the view sees no surface, or no layer needs it."""
        return _timed(seconds, name, work) if surface_texels and _LAYER_OF[name] in computed else blank

    # Only views without a surface return these blanks, so others make them empty.
    size = (0, 0) if surface_texels else gbuffer.depth.shape
    zero = np.zeros(size, np.float32)
    black = np.zeros((*size, 3), np.float32)
    unoccluded = [Occlusion(zero, 0)] * len(settings.radii)
    ao = run("ao", lambda: occlusions(Buffers.of(gbuffer, view, neighbours), settings), unoccluded)
    bent = run("bent", lambda: bent_normals_of(Buffers.of(gbuffer, view, neighbours), settings), [black] * len(ao))
    merged = run("merge", lambda: post.merge([each.texture for each in ao]), zero)
    blurred = run("blur", lambda: post.blur(merged, settings.blur), zero)
    color = gbuffer.color  # a mesh without colour is white
    shade = partial(post.shade_white, gbuffer.depth) if color is None else partial(post.shade, color)
    shaded = run("shade", lambda: shade(blurred, gbuffer.normals, settings.light), black)
    left_out: dict[str, Any] = dict.fromkeys({"positions", "color", "normals"}.difference(kept))
    return Textures(
        view=view,
        gbuffer=replace(gbuffer, **left_out),
        ao=tuple(without_guard(each.texture, view.guard) for each in ao) if "ao" in kept else (),
        merged=without_guard(merged, view.guard) if "merged" in kept else None,
        blurred=without_guard(blurred, view.guard) if "blurred" in kept else None,
        shaded=without_guard(shaded, view.guard) if "shaded" in kept else None,
        outside=tuple(each.outside for each in ao) if "ao" in computed else (),
        surface_texels=surface_texels,
        settings=settings,
        seconds=seconds,
        bent=tuple(without_guard(each, view.guard) for each in bent) if "bent" in kept else (),
    )


def _timed(seconds: dict[str, float], name: str, work: Callable[[], Made]) -> Made:
    start = time.perf_counter()
    made = work()
    seconds[name] = time.perf_counter() - start
    return made


def occlusions(buffers: Buffers, settings: Settings) -> list[Occlusion]:
    """Occlusion of each radius: equal radii are computed once, and one sample stands for all of radius 0."""
    buffers = _turned(buffers, settings)
    radii = list(dict.fromkeys(settings.radii))
    found: dict[float, Occlusion] = {}
    if settings.estimator in COUNTING and settings.samples is not None and 0.0 in radii:
        radii.remove(0.0)
        (one,) = _estimate(buffers, [0.0], replace(settings, samples=settings.samples[:1]))
        found[0.0] = Occlusion(one.texture, one.outside * len(settings.samples))
    if radii:
        found |= zip(radii, _estimate(buffers, radii, settings), strict=True)
    return [found[radius] for radius in settings.radii]


def bent_normals_of(buffers: Buffers, settings: Settings) -> list[FloatTexture]:
    """Bent normals of each radius: equal radii are computed once."""
    from lfssao.ao.bent import bent_normals  # late: few ask for them

    buffers = _turned(buffers, settings)
    options = {**settings.parameters, "units": settings.units}
    found = {radius: bent_normals(settings.estimator, buffers, radius, **options) for radius in set(settings.radii)}
    return [found[radius] for radius in settings.radii]


def _turned(buffers: Buffers, settings: Settings) -> Buffers:
    """Return the same with the turns of the settings' rotation."""
    rotation = settings.rotation
    height, width = buffers.depth.shape
    if isinstance(rotation, np.ndarray):
        return replace(buffers, turns=noise_turns(rotation, height, width, buffers.depth.dtype))
    return buffers if rotation in (None, "none") else buffers.turned(rotation, settings.rotation_seed)


def _estimate(buffers: Buffers, radii: Sequence[float], settings: Settings) -> list[Occlusion]:
    points = settings.samples
    weights = settings.weights
    parameters = {**settings.parameters, "units": settings.units}
    return estimate_radii(settings.estimator, buffers, radii, points, weights, **parameters)


class Rendered(Table, Sequence[Textures]):
    """The textures of some modules of a display, each rendered when it is asked for, and not kept.

    >>> rendered = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))
    >>> len(rendered), rendered[0].view.name
    (1, 'module_000')
    """

    def __init__(
        self, caster: RayCaster, views: Sequence[View], neighbours: Sequence[tuple[View, ...]], settings: Settings
    ):
        self._caster = caster
        self._views = views
        self._neighbours = neighbours
        self._settings = settings
        self._cache = DepthCache(caster, textures_kept(neighbours))

    def __len__(self) -> int:
        return len(self._views)

    def _facts(self) -> dict[str, object]:
        first = self._views[0]
        last = self._views[-1]
        names = first.name if first is last else f"{len(self)}, {first.name} to {last.name}"
        return {"views": names, "texels": f"{first.width}x{first.height}", **self._settings._facts()}

    @overload
    def __getitem__(self, number: SupportsIndex) -> Textures: ...
    @overload
    def __getitem__(self, number: slice) -> list[Textures]: ...
    def __getitem__(self, number: Any) -> Textures | list[Textures]:
        """Return the textures of one of the modules, or a list of those of a slice."""
        if isinstance(number, slice):
            return [self[k] for k in range(len(self))[number]]
        if (whole := as_whole(number)) is None:
            raise InputError(f"the number of a view is {shown(number)}, it must be a whole number, or a slice")
        if not -len(self) <= whole < len(self):
            raise IndexError(f"there is no view {whole} among the {len(self)} that are rendered")
        neighbours = self._cache.neighbours(self._neighbours[number], self._settings.caster)
        self._caster = self._caster.of_view(self._views[number])
        textures = render_view(self._caster, self._views[number], self._settings, neighbours)
        doubts.warn(doubts.of_views([] if textures.surface_texels else [textures.view.name]))
        return textures


def render(
    mesh: Any,
    display: Display | ViewSet | str | Path = "sample-a",
    settings: Settings | None = None,
    modules: Sequence[int] | None = None,
    threads: int = 1,
    **words: Any,
) -> Rendered:
    """Return the textures of a display's modules, views or lenses, each rendered when it is asked for.

    Parameters
    ----------
    mesh : Mesh, str, Path, trimesh's mesh or scene, or pair of arrays
        A scene's name, a mesh file, or what ``find_scene`` takes.
    display : Display, Quilt, LensletDisplay, str or Path
        A preset, a file, or what ``find_views`` makes.
    settings : Settings, optional
        By default those of the words.
    modules : sequence of int, optional
        Numbers of modules or views; all by default.
    threads : int
        Threads of the ray caster; numba's are set by ``numba.set_num_threads``.
    words : keywords
        Those of ``lfssao render``, with its defaults and its bits: ``radii``, numbers or per cent such as '1%';
        ``samples``, their number or offsets; ``sampling``; ``seed``; and all of ``Settings``. Not with ``settings``.

    Raises
    ------
    InputError
        If a module does not exist, an argument is wrong, or the mesh leaves float32 in physical space.

    Warns
    -----
    InputWarning
        Where something is probably not meant (``lfssao.rendering.doubts``).

    Examples
    --------
    >>> textures = render("statue", radii=["1%"], samples=16, sampling="jittered", seed=7, modules=[10])
    >>> textures[0].save("module_010.exr")  # doctest: +SKIP
    """
    mesh = find_scene(mesh)
    display = find_views(display)
    if settings is not None and words:
        raise InputError(f"settings are given, and {', '.join(words)}: dataclasses.replace(settings, ...) changes some")
    settings = settings_of(mesh, **words) if settings is None else settings
    check_type("settings", settings, Settings)
    views = module_views(mesh, display, modules)
    doubts.warn(doubts.of_display(display))
    doubts.warn(doubts.of_radii(mesh, views, settings, [mesh.bounds]))
    neighbours = neighbour_views(mesh, display, settings.neighbours, modules)
    return Rendered(RayCaster(mesh, views[0].cast_from_world, threads), views, neighbours, settings)
