"""Each estimator's error against ray-cast occlusion, taken apart: ``python benchmarks/results.py --only parts``.

An estimator's occlusion changes in steps, each of which takes one cause of error away; a step's difference is a part.

1. its default samples -> the same estimator with many (*sampling*)
2. the first surface of each texel's ray -> all of them (*missing layers*, ``layers.py``)
3. a texture that ends where the view does -> one with a guard band wider than the radius (*edge*)
4. the estimator without these -> rays of its own weighting and falloff (*form*: volumes or heights for rays, a texel's
   size, biases and range checks, passes of its own)
5. those rays -> rays of equal length weighted by the cosine (*integrand*)

The parts' sum is the error, texel by texel, as each begins where the one before ends. A part's share is the mean of its
product with the whole error, over the mean square of this: shares sum to 1, and one is negative where the part makes up
for others. Another order of steps would give other shares.
"""

import json
import platform
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from layers import RULES, Layers, layers_of, on_all_layers
from matplotlib.figure import Figure
from numpy.typing import NDArray
from papers_common import RESULTS, Scale
from papers_page import table

from lfssao import Buffers, Mesh, Occluders, RayCaster, builtin_scene, estimate, find_display, ray_cast_occlusion
from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import of_one_view
from lfssao.ao.textures import Texture
from lfssao.bench.work_precision.figures import rms
from lfssao.bench.work_precision.settings import SCENES, Inputs, samples_for, takes_samples
from lfssao.gbuffer.trees import embree_installed
from lfssao.optics.view import View, without_guard
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import diagonal
from lfssao.rendering.views import module_views
from lfssao.samples import texel_turns
from lfssao.viz.truth import half_space

PARTS = ("sampling", "missing layers", "edge", "form", "integrand")
RADII = (0.02, 0.08)  # of the diagonal
GUARD = 64  # texels: the larger radius has at most 40
NUMBERS = RESULTS / "error-parts.json"
PICTURE = "error-parts"
COSINE = ("cosine", "constant")
_MANY = 1024  # samples, where an estimator takes any
_SLICES: dict[str, Value] = {"slices": 16, "steps": 32}
_MANY_OF: dict[str, dict[str, Value]] = {
    "sao": {"taps": 999, "turns": 0},
    "sao-equation-1": {"taps": 999, "turns": 0},
    "hbao": {"directions": 32, "steps": 32},
    "gtao": _SLICES,
    "visibility-bitmask": _SLICES,
}


class Sight:
    """A view of a mesh, its textures and layers with a guard band and without."""

    def __init__(self, mesh: Mesh, view: View, wide_view: View) -> None:
        caster = RayCaster(mesh, wide_view.cast_from_world, 2)
        self.occluders, self.guard = Occluders(mesh), wide_view.guard
        self.wide = Buffers.of(caster.gbuffer(wide_view, None, "geometric"), wide_view)
        self.wide_layers = layers_of(caster, wide_view)
        textures = (self.wide.depth, self.wide.positions, self.wide.normals)
        self.buffers = Buffers(view, *(self.cropped(texture) for texture in textures))
        self.layers: Layers = self.wide_layers.cropped(self.guard)
        self.surface: NDArray[np.bool_] = np.isfinite(self.buffers.depth)
        self.rays = cache(self._cast)

    def cropped(self, texture: Any) -> Any:
        """A texture without the guard band."""
        return without_guard(texture, self.guard)

    def turned(self, estimator: Estimator) -> tuple[Buffers, Buffers]:
        """The textures without the guard band and with it, whose samples turn as they do by default."""
        if not estimator.turns or estimator.rotation == "none":
            return self.buffers, self.wide
        turns = texel_turns(estimator.rotation, *self.surface.shape, 0, self.buffers.depth.dtype)
        around = np.pad(turns, ((0, 0), *[(self.guard, self.guard)] * 2), mode="wrap")
        return replace(self.buffers, turns=turns), replace(self.wide, turns=around)

    def _cast(self, radius: float, weighting: str, falloff: str) -> Texture:
        """Ray-cast occlusion, float64; by Embree where it is installed, in a tenth of the time."""
        how = "embree" if embree_installed() else "tree"
        shape: dict[str, Any] = {"weighting": weighting, "falloff": falloff, "intersector": how}
        return ray_cast_occlusion(self.occluders, self.buffers, radius, tolerance=0.01, rounds=(4, 32), **shape).texture


def scene_sight(name: str, width: int = 256, height: int = 192, guard: int = GUARD) -> Sight:
    """The view of an embedded scene that ``lfssao bench work-precision`` has."""
    mesh = builtin_scene(name)
    display = find_display("virtual").with_resolution(width, height)
    views = [module_views(mesh, display, guard=texels) for texels in (0, guard)]
    view, wide_view = (each[len(each) // 2] for each in views)
    return Sight(mesh, view, wide_view)


def many_of(estimator: Estimator) -> Inputs | None:
    """An estimator's inputs of many samples; None where its result does not depend on a number of samples."""
    if takes_samples(estimator):
        return samples_for(estimator, "sobol", _MANY, 0), {}
    return ((None, None), _MANY_OF[estimator.name]) if estimator.name in _MANY_OF else None


class Stages(NamedTuple):
    """An estimator's occlusion of the half space on the way to the cosine-weighted rays, (H, W) each.

    A stage that an estimator does not have is None.
    """

    default: Texture
    many: Texture | None
    layered: Texture | None
    wide: Texture
    own: Texture
    cosine: Texture


def stages_of(sight: Sight, estimator: Estimator, radius: float, few: Inputs = ((None, None), {})) -> Stages:
    """Return the stages of an estimator at a radius, world units; few: the inputs whose error is taken apart."""

    def on_first(buffers: Buffers, inputs: Inputs) -> Texture:
        (points, weights), parameters = inputs
        return estimate(estimator, buffers, radius, points, weights, **parameters).texture

    def on_all(buffers: Buffers, layers: Layers) -> Texture:
        return on_all_layers(estimator, buffers, radius, best, layers)

    (buffers, wide), many = sight.turned(estimator), many_of(estimator)
    best = many or few
    layered = estimator.name in RULES
    occlusions = (
        on_first(buffers, few),
        on_first(buffers, best) if many else None,
        on_all(buffers, sight.layers) if layered else None,
        sight.cropped(on_all(wide, sight.wide_layers) if layered else on_first(wide, best)),
    )
    if estimator.whole_ball:
        occlusions = tuple(None if each is None else half_space(each) for each in occlusions)
    return Stages(*occlusions, *(sight.rays(radius, *integrand) for integrand in (estimator.integrand, COSINE)))


def parts_of(stages: Stages, surface: NDArray[np.bool_]) -> list[Texture | None]:
    """Return the parts of the error on the surface texels, (t,) float64 each, in ``PARTS``' order; None for none."""
    before = stages.default[surface].astype(np.float64)
    parts: list[Texture | None] = []
    for stage in stages[1:]:
        after = before if stage is None else stage[surface].astype(np.float64)
        parts.append(None if stage is None else before - after)
        before = after
    return parts


def shares_of(parts: Sequence[Texture | None]) -> dict[str, float | None]:
    """Return each part's share of the mean square error, None for no part; they sum to 1."""
    error = np.sum([part for part in parts if part is not None], axis=0)
    square = max(float((error * error).mean()), 1e-300)
    shares = [None if part is None else float((part * error).mean()) / square for part in parts]
    return dict(zip(PARTS, shares, strict=True))


def measure(scale: Scale) -> dict[str, Any]:
    """All estimators' parts on all scenes, and when and where they were measured."""
    start = time.process_time()
    machine = describe_machine(1)
    estimators: dict[str, Any] = {name: {} for name in of_one_view()}
    for scene in SCENES:
        width, height = scale.size(256, 192)
        sight = scene_sight(scene, width, height, GUARD // 4 if scale.quick else GUARD)
        unit = diagonal(builtin_scene(scene))
        for name, estimator in of_one_view().items():
            for radius in RADII:
                parts = parts_of(stages_of(sight, estimator, radius * unit), sight.surface)
                error = np.sum([part for part in parts if part is not None], axis=0)
                found = {key: None if share is None else round(share, 4) for key, share in shares_of(parts).items()}
                entry = {"rmse": round(rms(error), 5), "shares": found}
                estimators[name].setdefault(scene, {})[f"{100 * radius:g} %"] = entry
    result = {
        "estimators": estimators, "quick": scale.quick, "seconds": round(time.process_time() - start, 1),
        "date": datetime.now(UTC).date().isoformat(), "processor": machine["processor"] or platform.machine(),
        "lfssao": machine["lfssao"],
    }  # fmt: skip
    scale.folder.mkdir(exist_ok=True)
    (scale.folder / NUMBERS.name).write_text(json.dumps(result, indent=1) + "\n")
    scale.save(PICTURE, chart(result))
    return result


def chart(result: dict[str, Any]) -> Figure:
    """Bars of all estimators by scene and radius: signed parts of the mean square error, which are its sum."""
    figure = Figure(figsize=(9.6, 8.4), layout="constrained")
    names = [*result["estimators"]]
    radii = [*result["estimators"][names[0]][SCENES[0]]]
    for row, radius in zip(figure.subplots(len(radii), len(SCENES), sharey=True), radii, strict=True):
        for axes, scene in zip(row, SCENES, strict=True):
            ends = np.zeros((2, len(names)))  # of the bars to the left and to the right of 0
            for part in PARTS:
                entries = [result["estimators"][name][scene][radius] for name in names]
                widths = np.array([1e3 * entry["rmse"] ** 2 * (entry["shares"][part] or 0) for entry in entries])
                starts = np.where(widths < 0, *ends)
                axes.barh(names, widths, left=starts, height=0.8, label=part)
                ends += np.stack([np.minimum(widths, 0), np.maximum(widths, 0)])
            axes.axvline(0, color="black", linewidth=0.6)
            axes.set_title(f"{scene}, R {radius}", fontsize="small")
            axes.set_xlabel("mean square error / 0.001", fontsize="small")
            axes.tick_params(labelsize="small")
    axes.invert_yaxis()  # of all: they share it
    figure.legend(*row[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(PARTS), fontsize="small")
    return figure


_TEXT = """
## The error taken apart

Each estimator's error against cosine-weighted rays, at its default samples without blur, is the sum of five parts,
texel by texel, taken in this order; another order gives other shares.

- *Sampling*: what {many} samples, or as many taps and steps, change.
- *Missing layers*: what changes then on all surfaces along each texel's ray, where a depth texture has the first alone.
- *Edge*: what a guard band of {guard} texels changes then, which is wider than R.
- *Form*: what is left between the estimator and rays of its own weighting and falloff: volumes or heights for rays,
  texels' size, biases, range checks, passes of its own.
- *Integrand*: the difference of these rays to cosine-weighted ones.

A part's share is the mean of its product with the error, over the mean square error. Shares sum to 100 %, and a
negative part makes up for others.

On all layers estimators of volumes find what is behind the beginnings of solids, less what is behind their ends;
overlapping solids are one, and a surface without a back hides all behind it. A point of oriented-hemisphere sees the
first solid that does not end before it, as its range check needs a surface. alchemy takes the largest term of a ray's
hits. hbao, gtao and visibility-bitmask step over all hits. SAO's levels and passes, multiresolution and vo-area read
one depth a texel, and nothing says what they would make of a second one: what they miss by it is within their form.
multiresolution and vo-area have no number of samples.

{bars}

Measured {date}, lfssao {lfssao}, {processor}, in {minutes:.1f} minutes of processor time
([numbers](results/{numbers})). Scenes, views and radii are those of the section before; triples are
{scenes}.
"""


def as_text(result: dict[str, Any]) -> str:
    """The section of the page, of what was measured."""
    first = next(iter(result["estimators"].values()))[SCENES[0]]
    out = _TEXT.format(
        many=f"{_MANY:,}", guard=GUARD, numbers=NUMBERS.name, scenes=", ".join(SCENES), minutes=result["seconds"] / 60,
        bars=f"![The parts of the mean square error](results/{PICTURE}.png)",
        **{key: result[key] for key in ("date", "lfssao", "processor")},
    )  # fmt: skip
    for radius in first:
        head = (f"R {radius}", "RMSE", *(f"{part}, %" for part in PARTS))
        rows = [(name, *_cells([by[s][radius] for s in SCENES])) for name, by in result["estimators"].items()]
        out += "\n".join(["", _largest(result, radius), "", *table(head, rows), ""])
    return out


def _largest(result: dict[str, Any], radius: str) -> str:
    """The largest part of each estimator's mean square error over all scenes, in a sentence."""
    causes: dict[str, list[str]] = {part: [] for part in PARTS}
    for name, by_scene in result["estimators"].items():
        entries = [entries[radius] for entries in by_scene.values()]
        parts = {p: sum(each["rmse"] ** 2 * (each["shares"][p] or 0) for each in entries) for p in PARTS}
        causes[max(parts, key=parts.__getitem__)].append(name)
    phrases = (f"*{part}* of {', '.join(names)}" for part, names in causes.items() if names)
    return f"The largest part over the scenes at R {radius} is {'; '.join(phrases)}."


def _cells(entries: Sequence[dict[str, Any]]) -> list[str]:
    """The cells of a row, of an estimator's entries on the scenes."""
    columns = [[entry["shares"][part] for entry in entries] for part in PARTS]
    shares = ("-" if None in each else " / ".join(f"{round(100 * share)}" for share in each) for each in columns)
    return [" / ".join(f"{entry['rmse']:.3f}" for entry in entries), *shares]


def parts_text() -> str:
    """The section of the page, if its numbers are there."""
    return as_text(json.loads(NUMBERS.read_text())) if NUMBERS.exists() else ""
