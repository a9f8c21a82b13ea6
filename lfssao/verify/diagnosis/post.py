"""Changes of the merge, the blur and the shading."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.post import MAX_SIGMA, Light, blur_weights
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.diagnosis.change import (
    FACTOR,
    FLIPS,
    INSIDE,
    Axis,
    Change,
    Function,
    Places,
    Problem,
    apply_border,
    cut,
    fixed,
    plain,
    scaled,
)
from lfssao.verify.diagnosis.hints import scaled_text

_SIGMAS = Axis(1e-5, 1.4, factor=True)
_STRENGTHS = replace(FACTOR, more=(*FACTOR.more, 1e-7, 1e-6))  # down to the least bias, which is the same where ao is 1
# Relative tolerance of a renderer's sums, in addition to a quarter of the interval: renderers are far nearer than their
# bounds.
_ROUNDING = 2.0**-22
_MOST_TAPS = 10_000  # of a texel's square
Taps = tuple[FloatArray, NDArray[np.int64]]  # weights and places
VISIBILITY = "1 - ao in place of ao"
ZEROS = "ao of 0 everywhere"
_TERMS = {"ambient": "the ambient term", "all": "all light"}

# Changes of the values of any texture of occlusion.
VALUES = (
    plain(VISIBILITY, lambda p: p.then(lambda x: 1 - x), hint="--map {layer}=1-{layer}"),
    plain(ZEROS, lambda p: p.then(np.zeros_like)),
    scaled("strength", lambda p, s: p.then(lambda x: np.clip(s * x, 0, 1)), _STRENGTHS, "ao x {}"),
    scaled("power", lambda p, s: p.then(lambda x: np.clip(x, 0, 1) ** s), words="ao to the power of {}"),
    scaled("bias", lambda p, b: p.then(lambda x: x + b), Axis(1e-7, 1.0), "ao {}"),
)


def texture_changes(problem: Problem) -> list[Change]:
    """Changes of any texture of occlusion, of every stage."""
    others = [plain(f"the occlusion of {view}", partial(_from_view, view=view)) for view in problem.other_views()]
    return [*VALUES, *FLIPS, *others, *cut(problem)]


def _from_view(problem: Problem, view: str) -> Problem:
    """The problem with another view's texture."""
    return problem.changed(replacement=problem.other_views()[view])


def _maximum(layers: FloatArray) -> FloatArray:
    """The merge of layers (L, K)."""
    return np.asarray(layers.max(axis=0))


def _visible(ao: FloatArray) -> FloatArray:
    """The visibility of an occlusion."""
    return 1 - ao


def _with_ambient(problem: "Shade", factor: float) -> "Shade":
    assert problem.light is not None
    return problem.changed(light=replace(problem.light, ambient=min(1.0, factor * problem.light.ambient)))


def _faced(cosine: FloatArray) -> FloatArray:
    """The share of a light that arrives at a surface, by n . l."""
    return np.maximum(cosine, 0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Merge(Problem):
    """The maximum of K texels of L layers."""

    layers: FloatArray  # (L, K)
    chosen: Any = ...  # index of the merged layers
    rule: Function = _maximum

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The merged value with a margin for rounding."""
        merged = self.rule(self.layers[self.chosen])
        return merged * (1 - _ROUNDING), merged * (1 + _ROUNDING)

    def changes(self) -> list[Change]:
        """All changes of the merge."""
        numbers = np.arange(len(self.layers))
        return [
            fixed("mean in place of maximum", rule=lambda a: a.mean(axis=0)),
            fixed("sum in place of maximum", rule=lambda a: a.sum(axis=0)),
            fixed("sum, at most 1, in place of maximum", rule=lambda a: np.minimum(a.sum(axis=0), 1)),
            fixed("minimum in place of maximum", rule=lambda a: a.min(axis=0)),
            fixed("1 - product of (1 - ao) in place of maximum", rule=lambda a: 1 - np.prod(1 - a, axis=0)),
            *(fixed(f"ao_{k + 1} missing", chosen=numbers != k) for k in numbers if len(numbers) > 1),
            *(fixed(f"ao_{k + 1} alone", chosen=[k]) for k in numbers),
            *texture_changes(self),
        ]


@dataclass(frozen=True, eq=False, kw_only=True)
class Blur(Problem):
    """The Gaussian blur at K texels of a texture; with a guard band, they are not at the border."""

    merged: NDArray[Any]  # (H, W)
    sigma: float
    horizontal: bool = True
    vertical: bool = True
    border: str = "clamp"
    reach: float = 3.0  # radius of the kernel, in sigma
    total: float | None = None  # the divisor of the weights, None for their sum
    rounded: tuple[Function, Function] = (np.asarray, np.asarray)  # applied to the weights, and to the first pass

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The sum over the square of taps with a margin for rounding."""
        weights, steps = self._weights()
        identity = np.ones(1), np.zeros(1, np.int64)
        across, down = ((weights, steps) if is_blurred else identity for is_blurred in (self.horizontal, self.vertical))
        is_wide = len(across[1]) * len(down[1]) > _MOST_TAPS
        blurred = self._blurred_lines(across, down) if is_wide else self._blurred_squares(across, down)
        margin = self.interval_width / 4 + _ROUNDING * np.abs(blurred)
        return blurred - margin, blurred + margin

    def _blurred_squares(self, across: Taps, down: Taps) -> FloatArray:
        """The blur, (K,), from the square of taps of each texel."""
        height, width = self.merged.shape
        w_i, i = self._line_taps(self.columns, across, width)
        w_j, j = self._line_taps(self.rows, down, height)
        taps = self.merged[j[:, :, None], i[:, None, :]]
        first_pass = self.rounded[1](np.einsum("kji,ki->kj", taps.astype(np.float64), w_i))
        return np.asarray(np.einsum("kj,kj->k", first_pass, w_j))

    def _blurred_lines(self, across: Taps, down: Taps) -> FloatArray:
        """The same from two passes over the texture: squares of wide blurs take gigabytes."""
        height, width = self.merged.shape
        columns, index = np.unique(self.columns, return_inverse=True)
        along_rows = _line_matrix(*self._line_taps(columns, across, width), width)
        first_pass = self.rounded[1](self.merged.astype(np.float64) @ along_rows.T)
        along_columns = _line_matrix(*self._line_taps(np.arange(height), down, height), height)
        return np.asarray((along_columns @ first_pass)[self.rows, index])

    def _line_taps(self, places: Places, taps: Taps, size: int) -> Taps:
        """Weights and texels, (K, T), of the taps of K places along a line of texels."""
        weights, steps = taps
        own = places[:, None] + steps
        spread = np.broadcast_to(weights, own.shape)
        if self.border in ("zero", "left out"):
            spread = spread * ((own >= 0) & (own < size))
        if self.border == "left out":
            spread = spread / spread.sum(axis=1, keepdims=True)
        return self.rounded[0](spread), apply_border(own, size, self.border)

    def _blur_option(self, factor: float) -> str:
        return f"--blur {scaled_text(self.sigma, factor)}"

    def _weights(self) -> Taps:
        """Weights and offsets of the taps along one axis."""
        radius = int(np.ceil(self.reach * self.sigma))
        steps = np.arange(-radius, radius + 1)
        weights = np.exp(-0.5 * (steps / self.sigma) ** 2)
        if self.reach == 3.0 and self.total is None and self.sigma <= MAX_SIGMA:
            weights = blur_weights(self.sigma).astype(np.float64)
        return weights / (self.total or weights.sum()), steps

    def changes(self) -> list[Change]:
        """All changes of the blur."""
        outside = "texels outside the texture"
        cut = "kernel cut at {:g} sigma in place of 3"
        return [
            replace(fixed("not blurred", horizontal=False, vertical=False), hint="--blur 0"),
            fixed("blurred horizontally alone", vertical=False),
            fixed("blurred vertically alone", horizontal=False),
            fixed(f"{outside} zero", border="zero"),
            fixed(f"{outside} left out, weights normalised anew", border="left out"),
            *(fixed(f"{outside} held by {border}", border=border) for border in INSIDE if border != "clamp"),
            *(fixed(cut.format(reach), reach=reach) for reach in (2.0, 4.0, 1.0, 1.5, 2.5, 5.0)),
            fixed("weights not normalised, Gaussian density", total=float(np.sqrt(2 * np.pi) * self.sigma)),
            fixed("weights not normalised, 1 in the middle", total=1.0),
            fixed("weights of half precision", rounded=(half, np.asarray)),
            fixed("blur of half precision", rounded=(half, half)),
            fixed("the first pass of the blur of half precision", rounded=(np.asarray, half)),
            scaled("sigma", lambda p, f: p.changed(sigma=p.sigma * f), _SIGMAS, hint=self._blur_option),
            *texture_changes(self),
        ]


@dataclass(frozen=True, eq=False, kw_only=True)
class Shade(Problem):
    """The shading of K texels: ``rule`` of the image and of what it is multiplied by, (K, 1)."""

    image: FloatArray  # (K, 3)
    occlusion: FloatArray  # (K,), blurred
    merged: FloatArray | None
    light: Light | None = None
    normals: FloatArray | None = None  # (K, 3), with a light
    visible: Function = _visible
    faced: Function = _faced
    rule: Callable[..., FloatArray] = np.multiply

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """The shaded value with a margin for rounding; ``value`` applies to the occlusion."""
        shaded = self.rule(self.image, self._factor()[:, None])
        margin = self.interval_width / 4 + _ROUNDING * np.abs(shaded)
        return shaded - margin, shaded + margin

    def _factor(self) -> FloatArray:
        """The factor of the image, (K,)."""
        visible = self.visible(self.value(self.occlusion))
        if self.light is None or self.normals is None:
            return visible
        ambient = self.light.ambient
        direct = (1 - ambient) * self.faced(np.einsum("kc,c->k", self.normals, self.light.unit))
        return (ambient + direct) * visible if self.light.occlude == "all" else ambient * visible + direct

    def _light_changes(self, light: Light) -> list[Change]:
        """Changes of a light."""
        ambient = light.ambient
        place = "all" if light.occlude == "ambient" else "ambient"
        words = f"ao on {_TERMS[place]} in place of {_TERMS[light.occlude]}"
        changes = [
            replace(fixed(words, light=replace(light, occlude=place)), hint=f"--occlude {place}"),
            fixed("no light, image x (1 - ao)", light=None),
            fixed("light direction with the other sign", faced=lambda cosine: _faced(-cosine)),
            fixed("n . l below 0 not held at 0", faced=np.asarray),
        ]
        if ambient < 1:
            full = 1 / (1 - ambient)
            changes.append(fixed("max(n . l, 0) not times 1 - ambient", faced=lambda cosine: full * _faced(cosine)))
        if ambient > 0:
            hint = lambda f: f"--ambient {scaled_text(ambient, f, (0, 1))}"  # noqa: E731
            changes.append(scaled("ambient", _with_ambient, hint=hint))
        return changes

    def changes(self) -> list[Change]:
        """All changes of the shading."""
        changes = [
            fixed("image x ao in place of image x (1 - ao)", visible=np.asarray),
            fixed("image without ao", visible=np.ones_like),
            fixed("1 - ao without the image", rule=lambda image, factor: np.repeat(factor, 3, axis=1)),
            fixed("shaded in sRGB", rule=lambda image, factor: decode(encode(image) * factor)),
            fixed("shaded in sRGB and left there", rule=lambda image, factor: encode(image) * factor),
            fixed("stored in sRGB", rule=lambda image, factor: encode(image * factor)),
            fixed("ao taken off twice", visible=lambda ao: (1 - ao) ** 2),
            fixed("red and blue exchanged", rule=lambda image, factor: (image * factor)[:, ::-1]),
            *([] if self.light is None else self._light_changes(self.light)),
        ]
        if self.merged is not None:
            changes.append(plain("merged in place of blurred", lambda p: p.changed(occlusion=p.merged)))
        return [*changes, *texture_changes(self)]


def _line_matrix(weights: FloatArray, places: Places, size: int) -> FloatArray:
    """Weights, (K, size), of all texels of a line; a texel that several taps read has their sum."""
    matrix = np.zeros((len(weights), size))
    np.add.at(matrix, (np.arange(len(weights))[:, None], places), weights)
    return matrix


def half(values: NDArray[Any]) -> FloatArray:
    """Values rounded to half precision."""
    with np.errstate(over="ignore"):  # beyond the largest number is infinity
        return values.astype(np.float16).astype(np.float64)


def encode(linear: FloatArray) -> FloatArray:
    """SRGB values, 0 to 1, of linear light."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def decode(coded: FloatArray) -> FloatArray:
    """Linear light of sRGB values, 0 to 1."""
    clipped = np.clip(coded, 0, 1)
    return np.where(clipped <= 0.04045, clipped / 12.92, ((clipped + 0.055) / 1.055) ** 2.4)
