"""The order of the passes, and nothing else: from a mesh and a view to all textures of that view (LF section 7)."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Value
from lfssao.ao.estimators.neighbours import DepthCache, Neighbour, nearest_modules
from lfssao.ao.estimators.registry import check_samples, estimate_radii, find_estimator, full_parameters
from lfssao.ao.textures import Buffers
from lfssao.core.pictures import image_png
from lfssao.errors import InputError
from lfssao.gbuffer.caster import CASTERS, COLOR_FILTERS, NORMALS, GBuffer, RayCaster
from lfssao.gbuffer.embree import require_embree
from lfssao.optics.display import Display, fit_roi
from lfssao.optics.view import View, check_positions
from lfssao.optics.window import seen_rows
from lfssao.rendering import contact
from lfssao.scene.mesh import Mesh

# LF merges five radii and does not print them: shares of the scene's diagonal, each 1.6 to 2 times the last.
DEFAULT_RADII = (0.01, 0.02, 0.035, 0.06, 0.1)

# All textures of a view, in the order in which they are made.
LAYERS = ("depth", "positions", "color", "normals", "ao", "merged", "blurred", "shaded")
_READS = {"ao": ("positions",), "merged": ("ao",), "blurred": ("merged",), "shaded": ("color", "blurred")}

FloatTexture = NDArray[np.float32]
Result = TypeVar("Result")
Kind = TypeVar("Kind", np.float32, np.int32)


@dataclass(frozen=True, eq=False)
class Settings:
    """What the AO passes are run with.

    Attributes
    ----------
    radii : tuple of float
        Radii of the sampling ball, world units, at least one.
    samples : (n, 3) or (n, 2) float64, or None
        Offsets in the unit ball, or disk, the same for every texel and radius. Where none are given it is made the
        estimator's own set, and stays None for an estimator that takes none.
    blur : float
        Sigma of the Gaussian blur, texels.
    color_filter : str
        How the mesh's textures are read, 'bilinear' or 'nearest'.
    normals : str or None
        Normals texture to make beside the others, 'geometric' or 'smooth'. None: none, or geometric normals where the
        estimator reads normals.
    estimator : str
        Name of the estimator of occlusion (``lfssao estimators`` lists them).
    parameters : mapping
        The estimator's parameters by name; made complete with their defaults.
    weights : (n,) float64 or None
        Weights of the samples; as ``samples``.
    neighbours : int
        How many of a module's nearest modules are asked whether a sample lies in the open; of estimator 'lf' only.
    caster : str
        'exact', or 'embree' for Embree's own first hits (``RayCaster.gbuffer``).
    layers : tuple of str, or None
        Which of ``LAYERS`` are kept, 'ao' for those of all radii; what none of them reads is not computed. None: all,
        normals if ``normals`` names a kind.

    Raises
    ------
    InputError
        If there is no radius, or one is negative or not finite, or the blur is; if there is no such estimator, or
        it does not take these samples or parameters; if there is no such layer, or none at all.
    MissingPackageError
        If Embree is asked for and embreex is not installed.
    """

    radii: tuple[float, ...]
    samples: NDArray[np.float64] | None = None
    blur: float = 1.0
    color_filter: str = "bilinear"
    normals: str | None = None
    estimator: str = "lf"
    parameters: Mapping[str, Value] = field(default_factory=dict)
    weights: NDArray[np.float64] | None = None
    neighbours: int = 0
    caster: str = "exact"
    layers: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        if not self.radii:
            raise InputError("radii: at least one is needed")
        for radius in self.radii:
            passes.check_radius(radius)
        passes.gaussian_kernel(self.blur)
        if self.color_filter not in COLOR_FILTERS:
            raise InputError(f"color_filter is '{self.color_filter}': choose one of {', '.join(COLOR_FILTERS)}")
        if self.normals is not None and self.normals not in NORMALS:
            raise InputError(f"normals is '{self.normals}': choose one of {', '.join(NORMALS)}")
        if self.caster not in CASTERS:
            raise InputError(f"caster is '{self.caster}': choose one of {', '.join(CASTERS)}")
        if self.caster == "embree":
            require_embree()
        estimator = find_estimator(self.estimator)
        object.__setattr__(self, "parameters", full_parameters(estimator, self.parameters))
        if self.samples is None:
            points, weights = estimator.default_samples()
            object.__setattr__(self, "samples", points)
            object.__setattr__(self, "weights", weights)
        else:
            check_samples(estimator, self.samples, self.weights)
        if self.neighbours < 0:
            raise InputError(f"neighbours is {self.neighbours}, it must be at least 0")
        if self.neighbours and self.estimator != "lf":
            raise InputError(f"neighbours are for estimator lf, not for {self.estimator}")
        if self.layers is not None:
            _check_layers(self.layers)
        if self.normals is None and (estimator.normals or "normals" in (self.layers or ())):
            object.__setattr__(self, "normals", "geometric")

    @property
    def kept(self) -> tuple[str, ...]:
        """The layers that are kept, in the order of ``LAYERS``."""
        wanted = LAYERS if self.layers is None else self.layers
        return tuple(name for name in LAYERS if name in wanted and (name != "normals" or self.normals is not None))

    @property
    def computed(self) -> tuple[str, ...]:
        """The layers that are kept, or read by one that is."""
        needed = {"depth", *self.kept}
        for name in reversed(LAYERS):
            if name in needed:
                needed.update(_READS.get(name, ()))
        if "ao" in needed and find_estimator(self.estimator).normals:
            needed.add("normals")
        return tuple(name for name in LAYERS if name in needed)


def _check_layers(layers: tuple[str, ...]) -> None:
    for name in layers:
        if name not in LAYERS:
            raise InputError(f"layers: there is no '{name}': choose some of {', '.join(LAYERS)}")
    if not layers:
        raise InputError("layers: at least one is needed")


def diagonal(mesh: Mesh) -> float:
    """Diagonal of a mesh's bounding box, world units."""
    x, y, z = (mesh.bounds[1] - mesh.bounds[0]).tolist()
    return sqrt((x * x + y * y) + z * z)


def default_radii(mesh: Mesh) -> tuple[float, ...]:
    """Five radii for a mesh, world units: DEFAULT_RADII times the diagonal of its bounding box."""
    return tuple(share * diagonal(mesh) for share in DEFAULT_RADII)


@dataclass(frozen=True, eq=False)
class Textures:
    """All textures of one view.

    Attributes
    ----------
    view : View
        What they show.
    gbuffer : GBuffer
        Depth, positions and colour, the view's guard band included; what follows has it cropped. Positions, colour and
        normals are None where they are not kept; depth is always there.
    ao : tuple of (H, W) float32
        Occlusion, one texture a radius; empty where it is not kept, as all below are None.
    merged, blurred : (H, W) float32 or None
        Maximum over the radii; the same after the blur.
    shaded : (H, W, 3) float32 or None
        The colour texture (white on the surface where the mesh has no colour) with AO.
    outside : tuple of int
        Samples of each radius that fell outside the texture or the mapping's domain; empty where AO was not computed.
    surface_texels : int
        Texels of the depth texture that see a surface.
    layers : tuple of str
        Which layers are kept (``Settings.kept``).
    seconds : dict
        Wall time of each pass; the first call of a kernel after an install includes compiling it.
    """

    view: View
    gbuffer: GBuffer
    ao: tuple[FloatTexture, ...]
    merged: FloatTexture | None
    blurred: FloatTexture | None
    shaded: FloatTexture | None
    outside: tuple[int, ...]
    surface_texels: int
    layers: tuple[str, ...]
    seconds: dict[str, float]

    @cached_property
    def image(self) -> FloatTexture:
        """What AO is multiplied into, (H, W, 3): the colour texture, or white on the surface; made when asked for.

        Raises
        ------
        InputError
            If the layer color was not kept.
        """
        if "color" not in self.layers:
            raise InputError(f"there is no image: color is not among the layers {', '.join(self.layers)}")
        if self.gbuffer.color is not None:
            return _cropped(self.view, self.gbuffer.color)
        return np.repeat(self._surface[..., None].astype(np.float32), 3, axis=2)

    @property
    def _surface(self) -> NDArray[np.bool_]:
        """Which texels see a surface, (H, W)."""
        return _cropped(self.view, self.gbuffer.triangle) >= 0

    def _repr_png_(self) -> bytes | None:
        if self.blurred is None or self.shaded is None or "color" not in self.layers:
            return None
        color = None if self.gbuffer.color is None else self.image
        return image_png(contact.strip(color, self._surface, self.blurred, self.shaded, 320))


def render_view(caster: RayCaster, view: View, settings: Settings, neighbours: Sequence[Neighbour] = ()) -> Textures:
    """Run all passes for one view, as far as the scene needs them (``lfssao.rendering.plan``).

    Parameters
    ----------
    caster : RayCaster
        The mesh, in the view's cast space.
    view : View
        A module of a display or a camera.
    settings : Settings
        Estimator, radii, samples and blur.
    neighbours : sequence of (WorldToImage, (H, W) float32)
        Mapping and depth texture of each other module that is asked.

    Returns
    -------
    Textures
    """
    seconds: dict[str, float] = {}

    def timed(name: str, work: Callable[[], Result]) -> Result:
        start = time.perf_counter()
        result = work()
        seconds[name] = time.perf_counter() - start
        return result

    computed, kept = settings.computed, settings.kept
    color = settings.color_filter if "color" in computed else None
    normals = settings.normals if "normals" in computed else None
    look = color, normals, seen_rows(view, caster.bounds), settings.caster, "positions" in computed
    gbuffer = timed("ray_cast", lambda: caster.gbuffer(view, *look))
    texels = int(np.count_nonzero(gbuffer.triangle >= 0))
    ao: list[passes.Occlusion] = []
    made: dict[str, FloatTexture] = {}
    if texels:
        if "ao" in computed:
            ao = timed("ao", lambda: occlusions(Buffers.of(gbuffer, view), settings, neighbours))
        if "merged" in computed:
            made["merged"] = timed("merge", lambda: passes.merge([each.texture for each in ao]))
        if "blurred" in computed:
            made["blurred"] = timed("blur", lambda: passes.blur(made["merged"], settings.blur))
        if "shaded" in computed:
            made["shaded"] = timed("shade", lambda: _shade(gbuffer, made["blurred"]))
    elif "ao" in computed:
        nothing = np.zeros_like(gbuffer.depth)
        ao = [passes.Occlusion(nothing, 0)] * len(settings.radii)
        made = {"merged": nothing, "blurred": nothing, "shaded": np.zeros((*nothing.shape, 3), np.float32)}
    return Textures(
        view=view,
        gbuffer=replace(
            gbuffer,
            positions=gbuffer.positions if "positions" in kept else None,
            color=gbuffer.color if "color" in kept else None,
            normals=gbuffer.normals if "normals" in kept else None,
        ),
        ao=tuple(_cropped(view, each.texture) for each in ao if "ao" in kept),
        merged=_cropped(view, made["merged"]) if "merged" in kept else None,
        blurred=_cropped(view, made["blurred"]) if "blurred" in kept else None,
        shaded=_cropped(view, made["shaded"]) if "shaded" in kept else None,
        outside=tuple(each.outside for each in ao),
        surface_texels=texels,
        layers=kept,
        seconds=seconds,
    )


def _cropped(view: View, texture: NDArray[Kind]) -> NDArray[Kind]:
    """A texture without the view's guard band (SAO section 2.3)."""
    g = view.guard
    return np.ascontiguousarray(texture[g : view.height - g, g : view.width - g]) if g else texture


def occlusions(
    buffers: Buffers, settings: Settings, neighbours: Sequence[Neighbour] = ()
) -> list[passes.Occlusion]:  # fmt: skip
    """Occlusion of each radius: equal radii are computed once, and one sample stands for all of radius 0."""
    radii = list(dict.fromkeys(settings.radii))
    found: dict[float, passes.Occlusion] = {}
    if settings.estimator == "lf" and settings.samples is not None and 0.0 in radii:
        radii.remove(0.0)
        alone = replace(settings, samples=settings.samples[:1])
        (one,) = _sampled(buffers, [0.0], alone, neighbours)
        found[0.0] = passes.Occlusion(one.texture, one.outside * len(settings.samples))
    if radii:
        found |= zip(radii, _sampled(buffers, radii, settings, neighbours), strict=True)
    return [found[radius] for radius in settings.radii]


def _sampled(
    buffers: Buffers, radii: Sequence[float], settings: Settings, neighbours: Sequence[Neighbour]
) -> list[passes.Occlusion]:
    """Occlusion of some radii by all samples."""
    if neighbours and settings.samples is not None:
        around = buffers.depth, buffers.positions, buffers.view.world_to_image, neighbours, settings.samples
        return [passes.algorithm2_with_neighbours(*around, radius) for radius in radii]
    return estimate_radii(settings.estimator, buffers, radii, settings.samples, settings.weights, **settings.parameters)


def _shade(gbuffer: GBuffer, blurred: FloatTexture) -> FloatTexture:
    """The shaded image; without colour none is made to be shaded."""
    if gbuffer.color is None:
        return passes.shade_white(gbuffer.depth, blurred)
    return passes.shade(gbuffer.color, blurred)


def module_views(
    mesh: Mesh,
    display: Display,
    modules: range | None = None,
    guard: int = 0,
    bounds: NDArray[np.float64] | None = None,
) -> list[View]:
    """The views of a display's modules, a box of world space fitted into the display's ROI.

    Parameters
    ----------
    mesh : Mesh
        The scene.
    display : Display
        Where it is shown.
    modules : range, optional
        Which modules; all by default.
    guard : int
        Guard band, texels (``Display.view``).
    bounds : (2, 3) float64, optional
        Lower and upper corner of the box, world units; the mesh's own box by default.

    Raises
    ------
    InputError
        If the range holds a module that the display does not have, or none; if the box is too far from the world's
        origin for float32 positions (``lfssao.optics.view.check_positions``).
    """
    count = len(display.modules)
    wanted = range(count) if modules is None else modules
    if len(wanted) == 0 or wanted[0] < 0 or wanted[-1] >= count:
        raise InputError(
            f"modules {wanted.start}:{wanted.stop} are not a part of 0:{count}, the modules of {display.name}"
        )
    box = mesh.bounds if bounds is None else bounds
    physical_from_world = fit_roi(box, display.roi)
    texels = max(display.modules[index].width for index in wanted) / display.screen_width
    check_positions(box, texels * float(physical_from_world[0, 0]))
    return [display.view(index, physical_from_world, guard) for index in wanted]


def neighbour_views(
    mesh: Mesh,
    display: Display,
    count: int,
    modules: range | None = None,
    guard: int = 0,
    bounds: NDArray[np.float64] | None = None,
) -> list[tuple[View, ...]]:
    """The views of the nearest modules, so many, of each of the modules; arguments as of ``module_views``.

    Raises
    ------
    InputError
        If the display does not have so many other modules.
    """
    wanted = range(len(display.modules)) if modules is None else modules
    if count == 0:
        return [()] * len(wanted)
    views = module_views(mesh, display, None, guard, bounds)
    return [tuple(views[k] for k in nearest_modules(display, index, count)) for index in wanted]


def render(
    mesh: Mesh,
    display: Display,
    settings: Settings | None = None,
    modules: range | None = None,
    threads: int = 1,
) -> Iterator[Textures]:
    """Render the modules of a display one after the other.

    Parameters
    ----------
    mesh : Mesh
        The scene.
    display : Display
        Where it is shown.
    settings : Settings, optional
        Radii, samples and blur; ``default_radii`` and the defaults of ``Settings`` otherwise.
    modules : range, optional
        Which modules; all by default.
    threads : int
        Threads of the ray caster (numba's are set by ``numba.set_num_threads``).

    Yields
    ------
    Textures
        In the order of the modules.

    Raises
    ------
    InputError
        If a module does not exist or the mesh leaves float32 in physical space.
    """
    settings = settings or Settings(default_radii(mesh))
    views = module_views(mesh, display, modules)
    asked = neighbour_views(mesh, display, settings.neighbours, modules)
    caster = RayCaster(mesh, views[0].cast_from_world, threads)
    cache = DepthCache(caster, 2 * settings.neighbours + 1)
    for view, others in zip(views, asked, strict=True):
        yield render_view(caster, view, settings, cache.neighbours(others, settings.caster))
