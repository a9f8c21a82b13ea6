"""Settings of the AO passes: radii, samples, estimator, layers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import inf, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import post
from lfssao.ao.estimators.estimator import UNITS, Estimator, Value
from lfssao.ao.estimators.registry import (
    check_bent,
    check_samples,
    check_turning,
    find_estimator,
    full_parameters,
)
from lfssao.ao.ssao import check_radius
from lfssao.core.arguments import as_whole, check_seed, check_whole
from lfssao.errors import InputError, check_choice, check_type, errors_of, shown
from lfssao.gbuffer.caster import CASTERS, COLOR_FILTERS, NORMALS
from lfssao.gbuffer.trees import require_embree
from lfssao.samples import make_samples
from lfssao.samples.rotation import check_noise, check_rotation
from lfssao.scene.builtin import find_scene
from lfssao.scene.mesh import Mesh
from lfssao.summary import Table, listed

# LF merges five radii and does not print them: fractions of the scene's diagonal, each 1.6 to 2 times the last.
DEFAULT_RADII = (0.01, 0.02, 0.035, 0.06, 0.1)

# All textures of a view, in the order in which they are made, and those that are made where they are asked for alone.
LAYERS = ("depth", "positions", "color", "normals", "ao", "bent", "merged", "blurred", "shaded")
ASKED = ("bent",)
_READS = {
    "ao": ("positions",),
    "bent": ("positions",),
    "merged": ("ao",),
    "blurred": ("merged",),
    "shaded": ("color", "blurred"),
}


def diagonal(mesh: Mesh) -> float:
    """Diagonal of a mesh's bounding box, world units."""
    x, y, z = (mesh.bounds[1] - mesh.bounds[0]).tolist()
    return sqrt((x * x + y * y) + z * z)


def default_radii(mesh: Mesh | str | Path) -> tuple[float, ...]:
    """Five radii for a mesh (``find_scene``), world units: DEFAULT_RADII times the diagonal of its bounding box.

    >>> [round(radius, 4) for radius in lfssao.default_radii("statue")]
    [0.025, 0.0499, 0.0874, 0.1498, 0.2496]
    """
    mesh = find_scene(mesh)
    return tuple(fraction * diagonal(mesh) for fraction in DEFAULT_RADII)


@dataclass(frozen=True, eq=False, repr=False)
class Settings(Table):
    """Settings of the AO passes.

    InputError if there is no radius or no layer, a value is out of its range, a name is unknown, or the estimator does
    not take these samples, parameters or neighbours. MissingPackageError if Embree is asked for and embreex is not
    installed.

    Attributes
    ----------
    radii : tuple of float
        Radii of the sampling ball, world units, at least one.
    samples : (n, 3) or (n, 2) float64, or None
        Offsets in the unit ball, or disk, the same for every texel and radius. None becomes the estimator's own set,
        and stays None for an estimator that takes none.
    blur : float
        Sigma of the Gaussian blur, texels.
    color_filter : str
        How the mesh's textures are read, 'bilinear' or 'nearest'.
    normals : str or None
        Kind of the normals texture, 'geometric' or 'smooth'. None: no such texture, or geometric normals where the
        estimator, the light or ``layers`` needs one.
    estimator : str
        Name of the estimator of occlusion (``lfssao estimators`` lists them).
    parameters : mapping
        The estimator's parameters by name; made complete with their defaults.
    units : str
        'radii', or 'world' for parameters that are lengths, their defaults too, in world units.
    weights : (n,) float64 or None
        Weights of the samples; as ``samples``.
    neighbours : int
        How many of a module's nearest modules are asked whether a sample lies in the open. More than 0 make estimator
        'lf' 'lf-neighbours', which needs at least one; no other estimator takes any.
    caster : str
        'exact', or 'embree' for Embree's own first hits (``RayCaster.gbuffer``).
    rotation : str, (h, w) or (h, w, 2 or 3) float32 or float64, or None
        How samples turn from texel to texel, a name of ``lfssao.samples.ROTATIONS``, or angles or noise vectors of
        one's own (``lfssao.samples.noise_turns``); 'none': all texels share them. For estimators that know it. None
        becomes the estimator's own, 'hash' of lf, point and hemisphere.
    rotation_seed : int
        Seed of the rotation 'hash', 0 to 2**64 - 1.
    layers : tuple of str, or None
        Which of ``LAYERS`` are kept, 'ao' and 'bent' for those of all radii; what none of them reads is not computed.
        None: all but bent, normals if ``normals`` names a kind.
    light : Light or None
        What the layer shaded is lit by; None: AO alone.

    Examples
    --------
    >>> lfssao.Settings(radii=(0.01, 0.02), samples=lfssao.make_samples("jittered", 16), blur=2.0).estimator
    'lf'
    """

    radii: tuple[float, ...] = ()
    samples: NDArray[np.float64] | None = None
    blur: float = 1.0
    color_filter: str = "bilinear"
    normals: str | None = None
    estimator: str = "lf"
    parameters: Mapping[str, Value] = field(default_factory=dict)
    units: str = "radii"
    weights: NDArray[np.float64] | None = None
    neighbours: int = 0
    caster: str = "exact"
    rotation: str | NDArray[np.floating[Any]] | None = None
    rotation_seed: int = 0
    layers: tuple[str, ...] | None = None
    light: post.Light | None = None

    def _facts(self) -> dict[str, object]:
        samples = "none" if self.samples is None else len(self.samples)
        rotation = self.rotation if isinstance(self.rotation, str) else "of one's own"
        given = {"estimator": self.estimator, "radii": listed(self.radii), "samples": samples, "rotation": rotation}
        options = " ".join(f"{name}={value}" for name, value in self.parameters.items()) or "none"
        return {**given, "parameters": options, "blur": f"{self.blur:g}", "layers": " ".join(self.kept)}

    def __post_init__(self) -> None:
        if not isinstance(self.radii, list | tuple | np.ndarray) or np.ndim(self.radii) != 1:
            raise InputError(f"radii is {shown(self.radii)}, expected a list of numbers")
        if len(self.radii) == 0:
            raise InputError("radii: at least one is needed; default_radii(mesh) gives five")
        for radius in self.radii:
            check_radius(radius)
        post.gaussian_kernel(self.blur)
        self._check_names()
        check_type("light", self.light, post.Light | None)
        if self.caster == "embree":
            require_embree()
        object.__setattr__(self, "neighbours", check_whole("neighbours", self.neighbours, 0))
        if self.neighbours and self.estimator == "lf":
            object.__setattr__(self, "estimator", "lf-neighbours")
        estimator = find_estimator(self.estimator)
        if "bent" in (self.layers or ()):
            with errors_of("layers"):
                check_bent(estimator)
        if estimator.neighbours != (self.neighbours > 0):
            refused = f"neighbours are for estimator lf, not for {self.estimator}"
            missing = f"estimator {self.estimator} asks other modules: neighbours must be at least 1"
            raise InputError(refused if self.neighbours else missing)
        check_type("parameters", self.parameters, Mapping)
        object.__setattr__(self, "parameters", full_parameters(estimator, self.parameters))
        if as_whole(self.samples) is not None:
            wanted = f"expected offsets, such as make_samples('latin', {self.samples})"
            raise InputError(f"samples is {self.samples}, {wanted}; lfssao.render takes a number")
        check_samples(estimator, self.samples, self.weights)
        object.__setattr__(self, "rotation_seed", check_seed("rotation_seed", self.rotation_seed))
        if self.samples is None:
            points, weights = estimator.default_samples()
            object.__setattr__(self, "samples", points)
            object.__setattr__(self, "weights", weights)
        if self.rotation is None:
            object.__setattr__(self, "rotation", estimator.rotation)
        self._check_rotation(estimator)
        if self.normals is None and (self._reads_normals or self.light or "normals" in (self.layers or ())):
            object.__setattr__(self, "normals", "geometric")

    def _check_rotation(self, estimator: Estimator) -> None:
        if isinstance(self.rotation, str):
            check_rotation(self.rotation, self.rotation_seed)
        else:
            check_noise(self.rotation)
        if isinstance(self.rotation, np.ndarray):
            check_turning(estimator, bool(self.rotation.ndim == 3 and self.rotation[..., 2:].any()))
        elif self.rotation != "none":
            check_turning(estimator)
        common = isinstance(self.rotation, str) and self.rotation == "common-hash"
        if self.parameters.get("angle_sum") == "float32" and not common:
            raise InputError("angle_sum is float32, which is of the rotation 'common-hash' alone")

    def _check_names(self) -> None:
        named = ("color_filter", COLOR_FILTERS), ("normals", NORMALS), ("caster", CASTERS), ("units", UNITS)
        for name, choices in named:
            if getattr(self, name) is not None:
                with errors_of(name):
                    check_choice("choice", getattr(self, name), choices)
        if self.layers is None:
            return
        check_type("layers", self.layers, tuple | list)
        if not self.layers:
            raise InputError("layers: at least one is needed")
        for name in self.layers:
            with errors_of("layers"):
                check_choice("layer", name, LAYERS)

    @property
    def _reads_normals(self) -> bool:
        return find_estimator(self.estimator).reads_normals(self.parameters)

    @property
    def kept(self) -> tuple[str, ...]:
        """The layers that are kept, in the order of ``LAYERS``."""
        wanted = set(LAYERS) - set(ASKED) if self.layers is None else self.layers
        return tuple(name for name in LAYERS if name in wanted and (name != "normals" or self.normals is not None))

    @property
    def computed(self) -> tuple[str, ...]:
        """The layers that are kept, or read by one that is."""
        needed = {"depth", *self.kept}
        for name in reversed(LAYERS):
            if name in needed:
                needed.update(_READS.get(name, ()))
        if (not needed.isdisjoint(("ao", "bent")) and self._reads_normals) or ("shaded" in needed and self.light):
            needed.add("normals")
        return tuple(name for name in LAYERS if name in needed)


def drawn_samples(
    estimator: Estimator, method: str | None, count: object, seed: int | None
) -> tuple[dict[str, Any], NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """The samples of a method, number and seed, each None for the estimator's: manifest's entry, points and weights.

    The entry has the method, 'own' for a set that is the estimator's. InputError if there is no such method, or the
    estimator takes no samples, none in the ball, or none of a seed.
    """
    own = f"estimator {estimator.name}"
    if estimator.dimensions == 0 and (method, count, seed) != (None, None, None):
        raise InputError(f"samples, sampling, seed: {own} takes no samples")
    n = estimator.count if count is None else check_whole("samples", count, 1)
    if method is None and (seed is None or estimator.sampling is None):
        if seed is not None:
            raise InputError(f"seed: {own} has samples of its own: give a sampling too")
        with errors_of("samples"):
            points, weights = estimator.default_samples(n)
        name = "own" if estimator.sampling is None else estimator.sampling
        return {"method": name, "count": 0 if points is None else len(points), "seed": 0}, points, weights
    if estimator.dimensions != 3:
        raise InputError(f"sampling: {own} does not take samples in the ball")
    method = (estimator.sampling or "latin") if method is None else method
    seed = seed or 0
    with errors_of("sampling"):
        points = make_samples(method, n, seed)
    return {"method": method, "count": n, "seed": seed}, points, None


def settings_of(
    mesh: Mesh,
    radii: Any = None,
    samples: Any = None,
    sampling: str | None = None,
    seed: int | None = None,
    **others: Any,
) -> Settings:
    """Return settings by the words of ``lfssao render``, by default of its values: the same bits.

    Radii are numbers in scene units or per cent of the mesh's diagonal, such as '1%'. Samples are their number, or
    offsets; sampling is a method of the ball, and seed that of samples and turns. Others are those of ``Settings``.
    """
    for name in others:
        check_choice("setting", name, [*(each.name for each in fields(Settings)), "sampling", "seed"])
    if radii is not None and not isinstance(radii, list | tuple | np.ndarray):
        raise InputError(f"radii is {shown(radii)}, expected a list of numbers, or of per cent such as '1%'")
    lengths = default_radii(mesh) if radii is None else tuple(_radius_of(each, mesh) for each in radii)
    seed = None if seed is None else check_seed("seed", seed)
    estimator = find_estimator(others.get("estimator", "lf"))
    given = samples is not None and as_whole(samples) is None  # a set of one's own
    rotation = others.get("rotation")
    turning = isinstance(rotation or estimator.rotation, str) and (rotation or estimator.rotation) == "hash"
    of_samples = None if turning and sampling is None and (given or estimator.sampling is None) else seed
    if given and (sampling, of_samples) != (None, None):
        raise InputError("samples is a set, and a sampling or a seed would make another")
    points = samples
    weights = others.pop("weights", None)
    if not given:
        _, points, own = drawn_samples(estimator, sampling, samples, of_samples)
        weights = own if weights is None else weights
    others = {"rotation_seed": seed or 0, **others}
    return Settings(radii=lengths, samples=points, weights=weights, **others)


def _radius_of(radius: Any, mesh: Mesh) -> float:
    """A radius in scene units, of a number or a text in per cent of the mesh's diagonal; InputError if it is none."""
    if not isinstance(radius, str):
        check_radius(radius)
        return float(radius)
    try:
        number = float(radius.removesuffix("%")) if radius.endswith("%") else nan
    except ValueError:
        number = nan
    if not 0 <= number < inf:
        raise InputError(f"radius is {shown(radius)}, expected a number or per cent such as '1%'")
    return number / 100 * diagonal(mesh)
