"""A module as the oracle takes it: the manifest's parameters, and textures of both sides by stage."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.comparison.layers import Layer
from lfssao.comparison.metrics import equal_bits
from lfssao.errors import InputError
from lfssao.estimators.registry import check_samples, find_estimator, full_parameters
from lfssao.oracle.bounds import Bounds
from lfssao.oracle.depth import DepthBounds
from lfssao.oracle.error_model import ErrorModel
from lfssao.oracle.explain import explain
from lfssao.oracle.judge import Case, Stages, StageVerdict, judge
from lfssao.oracle.points import BOUNDED, NORMALS, Estimate
from lfssao.view import KINDS, WorldToImage

_MOST_BLUR = 1024.0  # texels; 'lfssao render' takes no more
_REASONS = {
    "depth": "right are, as far as can be told without the mesh, the depths of the surface there and of one beside it",
    "positions": "right is the point of the texel's ray at the depth of the depth texture",
    "color": "right are the colours of the texel and those around it",
    "blurred": "right is the blur of the renderer's own merged texture",
    "shaded": "right is the image times 1 - blurred, both the renderer's own",
}

Texture = NDArray[np.float32]
Layers = Mapping[str, Layer]


@dataclass(frozen=True, eq=False)
class Parameters:
    """What a manifest says of how one module's stages follow from each other.

    Attributes
    ----------
    mapping : WorldToImage
        World to image, guard band included.
    back : (4, 4) or None
        Its inverse, of a camera.
    samples : (n, 3) or None
        Offsets in the unit ball; None where another estimator than LF's was used, or LF's with neighbours.
    radii : tuple of float
        World units.
    sigma : float
        Of the blur, texels.
    guard : int
        Guard band, texels.
    estimate : Estimate or None
        The other estimator, if intervals of its occlusion are known.
    """

    mapping: WorldToImage
    back: NDArray[np.float64] | None
    samples: NDArray[np.float64] | None
    radii: tuple[float, ...]
    sigma: float
    guard: int
    estimate: Estimate | None

    @classmethod
    def of(cls, path: Path, manifest: dict[str, Any], entry: dict[str, Any]) -> "Parameters":
        """Read them from a manifest (at a path, for messages) and its entry of the module.

        Raises
        ------
        InputError
            If it does not hold them.
        """
        try:
            return _read(manifest["settings"], entry["view"])
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise not_written(path, error) from error


def not_written(folder: Path, error: Exception) -> InputError:
    """What is said of a folder whose manifest led to an error."""
    what = f"its manifest has no {error}" if isinstance(error, KeyError) else f"{type(error).__name__}: {error}"
    return InputError(f"{folder}: it is not what 'lfssao render' writes ({what:.80})")


def _read(settings: dict[str, Any], view: dict[str, Any]) -> Parameters:
    kind, numbers = KINDS.index(view["world_to_image_kind"]), _numbers(view["world_to_image"])
    back = None if view["screen_to_world"] is None else _numbers(view["screen_to_world"])
    if settings["merge"] != "maximum":
        raise ValueError("merge is not the maximum")
    sigma, guard, size = float(settings["blur_sigma"]), int(view["guard"]), min(view["width"], view["height"])
    if numbers.shape != ((44,) if KINDS[kind] == "display" else (16,)):
        raise ValueError("world_to_image has the wrong length")
    if (back is not None) != (KINDS[kind] == "matrix") or (back is not None and back.shape != (4, 4)):
        raise ValueError("screen_to_world does not fit world_to_image")
    if not 0 <= sigma <= _MOST_BLUR or not 0 <= 2 * guard < size:
        raise ValueError("blur or guard band is out of range")
    return Parameters(
        mapping=WorldToImage(kind, numbers),
        back=back,
        samples=_numbers(settings["samples"]) if settings["estimator"] == "lf" and not settings["neighbours"] else None,
        radii=tuple(float(radius) for radius in settings["radii"]),
        sigma=sigma,
        guard=guard,
        estimate=_estimate(settings, view),
    )


def _estimate(settings: dict[str, Any], view: dict[str, Any]) -> Estimate | None:
    """The estimator that is not LF's, if intervals of its occlusion are known."""
    name, points, weights = settings["estimator"], settings["samples"], settings["weights"]
    if name not in BOUNDED:
        return None
    options = full_parameters(find_estimator(name), settings["parameters"])
    table, shares = _numbers(points), None if weights is None else _numbers(weights)
    check_samples(find_estimator(name), table, shares)
    estimate = Estimate(name, table, shares, options, _numbers(view["cast_from_world"]).reshape(3, 4))
    return estimate if estimate.is_bounded else None


def _numbers(values: Any) -> NDArray[np.float64]:
    array = np.array(values, np.float64)
    if not np.isfinite(array).all():
        raise ValueError("a number is not finite")
    return array


@dataclass(frozen=True, eq=False)
class Oracle:
    """What is right of one module, given the textures that a renderer made on the way; judged when it is first asked.

    Attributes
    ----------
    parameters : Parameters
        The manifest's.
    mine, reference : mapping of Layer
        Textures by stage, the renderer's and the right ones.
    model : ErrorModel
        What float32 arithmetic may do.
    from_mesh : callable
        Bounds of depth and colour from the mesh, None where there is none; called where one of them differs.
    """

    parameters: Parameters
    mine: Layers
    reference: Layers
    model: ErrorModel
    from_mesh: Callable[[], tuple[DepthBounds, Bounds | None] | None]

    def verdict(self, name: str) -> StageVerdict | None:
        """What the oracle says of a stage; None where it knows nothing of it.

        Raises
        ------
        InputError
            If the manifest's parameters do not fit the textures.
        """
        unknown = self.parameters.samples is None and self._estimate is None and name.startswith("ao_")
        return None if unknown else self._found.get(name)

    @property
    def _estimate(self) -> Estimate | None:
        """The other estimator whose intervals are known of these textures, and under this model."""
        found = self.parameters.estimate
        if found is None or self.model.exact or (found.name in NORMALS and "normals" not in self.reference):
            return None
        return found

    @cached_property
    def _made(self) -> tuple[DepthBounds, Bounds | None] | None:
        return self.from_mesh()

    @cached_property
    def _found(self) -> dict[str, StageVerdict]:
        # What has the reference's bits is right, and judging it takes most of the time.
        differing = {name for name, layer in self.mine.items() if not _same(layer, self.reference[name])}
        made = self._made if {"depth", "color"} & differing else None
        known = judge(self._stages(self.mine), self._case(made), self.model, differing).stages
        return {stage.name: stage for stage in known if stage.wrong is not None}

    def _case(self, from_mesh: tuple[DepthBounds, Bounds | None] | None) -> Case:
        p = self.parameters
        reference = self._stages(self.reference)
        depth, color = from_mesh or (None, None)
        given = p.mapping, p.back, p.samples, p.radii, p.sigma, reference, p.guard
        return Case(*given, depth, color, self._estimate)

    def _stages(self, layers: Layers) -> Stages:
        """One side's textures; LF's image is the colour, or white where there is a surface."""
        p = self.parameters
        depth, color = _texture(layers, "depth"), _texture(layers, "color")
        if color is None and depth is not None and "color" not in self.reference:
            color = np.repeat(np.isfinite(depth).astype(np.float32)[..., None], 3, axis=2)
        if color is not None and p.guard:
            color = np.ascontiguousarray(color[p.guard : -p.guard, p.guard : -p.guard])
        return Stages(
            depth=depth,
            positions=_texture(layers, "positions"),
            color=color,
            ao=tuple(_texture(layers, f"ao_{k + 1}") for k in range(len(p.radii))),
            merged=_texture(layers, "merged"),
            blurred=_texture(layers, "blurred"),
            shaded=_texture(layers, "shaded"),
            normals=_texture(layers, "normals"),
        )

    def reason(self, name: str, texel: tuple[int, int]) -> str:
        """Why a texel (column, row) of a stage is what it is, in one sentence; '' where the oracle knows none."""
        p, (i, j) = self.parameters, texel
        numbers = {f"ao_{k + 1}": k for k in range(len(p.radii))}
        if name == "merged":
            layers = [self.mine.get(layer, self.reference.get(layer)) for layer in numbers]
            values = ", ".join(f"{layer.planes[0][j, i]:.7g}" for layer in layers if layer is not None)
            return f"the radii have {values}" if values else ""
        if name == "depth" and self._made is not None:
            nothing = self._made[0].lower[j, i] == np.inf
            seen = "nothing" if nothing else "these depths"
            return f"nine rays into the mesh, within {self.model.centre:.2g} texel of the texel's centre, see {seen}"
        if name in numbers and self._estimate is not None:
            return _openness(self._found[name].bounds, self._estimate, texel)
        if name not in numbers or p.samples is None:
            return _REASONS.get(name, "")
        depth, positions = (_first_whole(side, self.mine, self.reference) for side in ("depth", "positions"))
        if depth is None:
            return ""
        place = i + p.guard, j + p.guard
        samples = explain(place, depth, positions, p.mapping, p.samples, p.radii[numbers[name]], self.model, p.back)
        return str(samples[0]) if samples else "no surface is seen there"


def _openness(allowed: Bounds | DepthBounds | None, estimate: Estimate, texel: tuple[int, int]) -> str:
    """How many of a texel's points rounding may decide."""
    if not isinstance(allowed, Bounds) or allowed.open is None or estimate.points is None:
        return ""
    return f"{allowed.open[texel[1], texel[0]]} of {len(estimate.points)} points are open"


def _same(a: Layer, b: Layer) -> bool:
    return all(equal_bits(x, y).all() for x, y in zip(a.planes, b.planes, strict=True))


def _texture(layers: Layers, name: str) -> Texture | None:
    """A layer's texture, (H, W) or (H, W, 3)."""
    if name not in layers:
        return None
    planes = layers[name].planes
    return np.ascontiguousarray(planes[0] if len(planes) == 1 else np.stack(planes, axis=-1))


def _first_whole(name: str, *sides: Layers) -> Texture | None:
    """The first side's texture that holds no NaN."""
    for side in sides:
        texture = _texture(side, name)
        if texture is not None and not np.isnan(texture).any():
            return texture
    return None
