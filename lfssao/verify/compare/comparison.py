"""A comparison: modules one after the other, each stage judged against the renderer's own earlier textures."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from lfssao.core.memory import check_available
from lfssao.core.threads import ahead
from lfssao.errors import InputError, no_such
from lfssao.verify.bounds.error_model import KIT_MODEL, find_model
from lfssao.verify.bounds.registry import has_bounds
from lfssao.verify.bounds.stored import LINEAR
from lfssao.verify.case import VIEW, Array, Arrays, Case
from lfssao.verify.compare.agreement import surface_parts
from lfssao.verify.compare.background import replace_backgrounds, with_wrong_background
from lfssao.verify.compare.facts import facts_of
from lfssao.verify.compare.files import Files
from lfssao.verify.compare.layers import (
    Layer,
    Matcher,
    MismatchError,
    Storage,
    group_of,
    is_selected,
    layers_without_intervals,
)
from lfssao.verify.compare.linear import check_camera, linear_case
from lfssao.verify.compare.neighbours import Neighbours
from lfssao.verify.compare.picture import WORST_RANK, Panels
from lfssao.verify.compare.power import Power, power_of
from lfssao.verify.compare.report import Report
from lfssao.verify.compare.result import Result, Tolerance, result_of
from lfssao.verify.compare.source import Mine, Reference, Sides
from lfssao.verify.compare.surface import Surface
from lfssao.verify.judge import judgements
from lfssao.verify.verdict import WRONG, Flags, Judgement, Verdict, equal_bits

if TYPE_CHECKING:
    from lfssao.verify.compare.diagnoser import Diagnoser, Views
    from lfssao.verify.compare.page.textures import Textures

_MEASURED_AT_ONCE = 2  # layers whose figures are made: NumPy and scikit-image use one core each


class Comparison:
    """A comparison, module by module; it keeps the figures of all modules and the pictures of one.

    Its arguments and errors are those of ``compare``; ``modules`` are the names of the modules to add. The diagnosis
    searches for causes in ``other_views``, views of other folders, too (``Diagnoser``).
    """

    def __init__(
        self,
        mine: Path,
        reference: Path,
        rules: Mapping[str, str],
        layers: Sequence[str] | None,
        exact: bool,
        model: str,
        cases: Sequence[str] | None,
        tolerance: Tolerance,
        mesh: str | None = None,
        diagnosis: bool = True,
        page: bool = False,
        stored: Mapping[str, str] | None = None,
        files: Files = (),
        background: float | None = None,
        other_views: "Views | None" = None,
    ) -> None:
        if exact and tolerance:
            raise InputError("--exact asks for equal bits: it goes without --fail and --fail-percent")
        self._model = find_model(model)
        self._storage = Storage(stored or {}, rules)
        self._background = background
        self._reference = Reference.open(reference)
        self._mine = Mine.open(mine, self._reference, files)
        self.modules = self._reference.chosen(cases)
        self._sides = Sides(self._reference, self._mine, self.modules)
        self._layers = layers
        self._exact = exact
        self._tolerance = tolerance
        manifest = self._reference.manifest
        self._surface = None if manifest is None else Surface(self._reference.path, manifest, mesh)
        if mesh is not None:
            if self._surface is None:
                raise InputError(f"--mesh: {reference} is not what 'lfssao render' writes, its views are not known")
            _ = self._surface.mesh  # refused before anything is compared
        self._neighbours = Neighbours(self._reference, self._mine, self._storage, self._surface, background)
        self._diagnosis = diagnosis
        self._other_views = other_views
        self._diagnoser: Diagnoser | None = None  # made for the first wrong texture
        self._results: list[Result] = []
        self._notes = [f"{name} is of no module of the reference" for name in self._mine.extra]
        self._panels: Panels | None = None
        self._textures = _page_textures(exact) if page else None
        self._layer_of_name: dict[str, str] = {}  # names of layers and channels of the reference, with the layer's
        self._unbounded_estimator: str | None = None
        self._without_intervals: set[str] = set()  # layers that differ, and whose intervals a missing layer would give

    def add(self, module: str) -> None:
        """Compare one module; InputError if the manifest does not hold what the oracle needs."""
        description = self._reference.described(module)
        try:
            reference, case, parts = self._sides.read(module, description)
            # Memory that the distances of a layer that differs take, with both sides, as measured
            sizes = [layer.planes[0].size * (120 + 45 * len(layer.planes)) for layer in reference]
            check_available(f"{self._mine.path}: distances of {module}", sum(sorted(sizes)[-_MEASURED_AT_ONCE:]))
        except InputError as error:
            self._results.append(Result(module, "", Verdict.UNREADABLE, str(error)))
            return
        self._layer_of_name |= {name: layer.name for layer in reference for name in layer.names}
        if not parts:
            detail = f"{self._mine.path} has no file of it, such as {module}.exr or {module}_LAYER.npy"
            self._results.append(Result(module, "", Verdict.MISSING, detail))
            return
        name = case.parameters["estimator"] if case.stage == VIEW else "lf"
        if name != "lf" and not has_bounds(name):
            self._unbounded_estimator = name
        matcher = Matcher(parts, reference, self._storage.rules)
        matched = self._match_layers(module, matcher, reference)
        selected = [layer for layer in reference if is_selected(layer.name, self._layers)]
        if self._storage.formats.get("depth") == LINEAR:
            check_camera(case)
        try:
            self._judge(module, selected, matched, case)
        except InputError as error:
            raise InputError(f"{self._reference.path}: its manifest is not of its textures ({error})") from error
        if _is_occlusion_wrong(module, self._results):
            from lfssao.verify.compare.reasons import turn_noise_note  # late: only what is wrong needs it

            notes = turn_noise_note(case), self._neighbours.note(module, case)
            self._notes += [note for note in notes if note and note not in self._notes]
        if self._layers is None:
            self._notes += [f"{module}: channel {name} is not in the reference" for name in matcher.unused()]

    def _match_layers(self, module: str, matcher: Matcher, reference: Sequence[Layer]) -> dict[str, Layer | Result]:
        """Layers by name, or results for layers that cannot be compared; steps of a kit's case are optional."""
        matched: dict[str, Layer | Result] = {}
        for expected in reference:
            try:
                layer = matcher.matched(expected, self._storage)
                if layer is not None:
                    matched[expected.name] = layer
            except MismatchError as error:
                matched[expected.name] = Result(module, expected.name, Verdict.MISMATCH, str(error))
        for expected in reference[-1:] if self._reference.kit else reference:
            if expected.name not in matched:  # said after all that were found: a channel left over may be it
                matched[expected.name] = Result(module, expected.name, Verdict.MISSING, matcher.why_missing(expected))
        return matched

    def _judge(self, module: str, selected: Sequence[Layer], matched: Mapping[str, Layer | Result], case: Case) -> None:
        """Judge the layers of a module that the other renderer has; ``matched`` lacks layers that it may leave out."""
        layers = {name: layer for name, layer in matched.items() if isinstance(layer, Layer)}
        mine = {name: layer.texture.reshape(case.outputs[name].shape) for name, layer in layers.items()}
        stored = {name: layer.stored for name, layer in layers.items() if layer.stored is not None}
        names = [layer.name for layer in selected if layer.name in layers]
        case = self._with_surface(module, mine, case, names)
        if any(not equal_bits(mine[name], case.outputs[name]).all() for name in names):
            case = self._neighbours.with_depths(case)
        if "depth" in stored and stored["depth"].linear:
            case, mine = linear_case(case, mine, self._model)
            layers["depth"] = replace(layers["depth"], planes=(mine["depth"],))
            made = case.outputs["depth"]
            selected = [replace(each, planes=(made,)) if each.name == "depth" else each for each in selected]
        backgrounds = replace_backgrounds(mine, layers, case, self._background)
        figures = partial(self._figures, module, mine, case, cache(partial(_surface_parts, case)))
        expected_layers = {expected.name: expected for expected in selected}
        judged_by_name: dict[str, tuple[Judgement, Future[Result]]] = {}

        def judged_layers(pool: ThreadPoolExecutor) -> Iterator[tuple[str, tuple[Judgement, Future[Result]]]]:
            for name, made in judgements(mine, case, self._model, names, stored):
                judged = with_wrong_background(made, backgrounds[name][1]) if name in backgrounds else made
                yield name, (judged, pool.submit(figures, layers[name], expected_layers[name], judged))

        with ThreadPoolExecutor(_MEASURED_AT_ONCE) as pool:
            panels = Panels(module)
            pending = ahead(judged_layers(pool))
            for expected in selected:
                failure = matched.get(expected.name)
                if isinstance(failure, Result):
                    self._results.append(failure)
                if expected.name not in layers:
                    continue
                while expected.name not in judged_by_name:
                    judged_by_name.update([next(pending)])
                values = backgrounds[expected.name][0] if expected.name in backgrounds else {}
                layer = layers[expected.name]
                judged, future = judged_by_name[expected.name]
                judged = replace(judged, verdict=future.result().verdict)
                self._add_result(future.result(), layer, expected, judged, mine, case, values)
                if self._panels is None or self._panels.rank < WORST_RANK:
                    panels.offer(layer, expected, judged)
        later = {} if self._diagnoser is None else self._diagnoser.late_diagnoses()
        for k, result in enumerate(self._results):
            if result.module == module and result.layer in later:
                self._results[k] = replace(result, diagnosis=later[result.layer])
        if self._panels is None or panels.rank > self._panels.rank:
            self._panels = panels

    def _with_surface(self, module: str, mine: Arrays, case: Case, names: Sequence[str]) -> Case:
        """The case with bounds of depth and colour from the mesh, if one of them differs."""
        mesh_layers = [name for name in names if name in ("depth", "color")]
        if self._surface is None or all(equal_bits(mine[name], case.outputs[name]).all() for name in mesh_layers):
            return case  # casting rays takes long
        shape = case.outputs["depth"].shape if "depth" in case.outputs else ()
        return replace(case, bounds=self._surface.bounds(self._reference.entries[module], shape, self._model))

    def _figures(
        self,
        module: str,
        mine: Arrays,
        case: Case,
        parts: Callable[[], Mapping[str, Flags]],
        layer: Layer,
        expected: Layer,
        judgement: Judgement,
    ) -> Result:
        """The result on a layer, without its diagnosis."""
        if judgement.verdict is Verdict.EQUAL_BITS:
            return result_of(module, layer, expected, judgement, self._tolerance)
        from lfssao.verify.compare.reasons import reason_of  # late: only texels that differ have reasons

        reason = reason_of(expected.name, mine, case, judgement.bounds, self._model)
        power = self._power(expected.name, mine, case, judgement, layer, expected)
        return result_of(module, layer, expected, judgement, self._tolerance, reason, parts, power)

    def _add_result(
        self,
        result: Result,
        layer: Layer,
        expected: Layer,
        judgement: Judgement,
        mine: Arrays,
        case: Case,
        backgrounds: Mapping[float, int],
    ) -> None:
        """Add the result on a layer with its diagnosis; the judgement's verdict is within tolerances."""
        module = result.module
        name = expected.name
        if self._diagnosis and case.stage == VIEW and judgement.verdict in WRONG:
            details = layer.stored, layer.channels[0], backgrounds
            diagnosis = self._make_diagnoser().diagnose(module, name, mine, case, judgement, *details)
            result = replace(result, diagnosis=diagnosis)
        self._results.append(result)
        if self._textures is not None:
            self._textures.add(result, layer, expected, judgement)
            self._textures.add_samples(result, mine, case, self._model)
        without_interval = judgement.verdict is Verdict.DIFFERENT and case.stage == VIEW
        if without_interval and name in layers_without_intervals(list(case.outputs)):
            self._without_intervals.add(name)
        if judgement.verdict is Verdict.INSIDE and result.outside and judgement.bounds is not None:
            texels = f"{result.outside} texel{'s' * (result.outside != 1)} outside the interval"
            limit = f"up to {judgement.bounds.outliers} may look past an edge (4 standard deviations)"
            self._notes.append(f"{module}, {name}: {texels}, which only the mesh can judge (--mesh FILE); {limit}")

    def _make_diagnoser(self) -> "Diagnoser":
        if self._diagnoser is None:
            from lfssao.verify.compare.diagnoser import Diagnoser  # late: what conforms needs no search

            self._diagnoser = Diagnoser(self._reference, self._model, self._surface, self._other_views)
        return self._diagnoser

    def _power(
        self, name: str, mine: Arrays, case: Case, judgement: Judgement, layer: Layer, expected: Layer
    ) -> Power | None:
        """The power of the verdict 'inside'; None for other verdicts, or if the bounds are no intervals."""
        if judgement.verdict is not Verdict.INSIDE or judgement.bounds is None:
            return None
        fails = partial(self._tolerance.fails, judgement.bounds, expected.planes)
        return power_of(name, mine, case, judgement.bounds, layer.stored, fails)

    def report(self) -> Report:
        """The report on the added modules; InputError if the reference lacks a layer or channel that is named."""
        if self._layer_of_name:
            groups = {group_of(layer) for layer in self._layer_of_name.values()} - self._storage.rules.keys()
            for name in (*(self._layers or ()), *self._storage.named, *self._storage.formats):
                if name not in self._layer_of_name and name not in groups:
                    known = dict.fromkeys(self._layer_of_name.values())
                    raise no_such("layer or channel of the reference", name, known)
        notes = self._notes
        if self._without_intervals:
            names = ", ".join(sorted(self._without_intervals))
            note = f"no interval is known of {names}: the reference was rendered without layers they are made of"
            notes = [note, *notes]
        model_name = KIT_MODEL if self._reference.kit else None
        if self._reference.manifest is not None:
            model_name = self._model.name
        return Report(
            mine=str(self._mine.path),
            reference=str(self._reference.path),
            model=model_name,
            exact=self._exact,
            estimator=self._unbounded_estimator,
            tolerance=self._tolerance,
            kit=self._reference.kit,
            modules=len(self.modules),
            results=tuple(self._results),
            notes=tuple(notes),
            panels=self._panels,
            textures=self._textures,
            facts=() if self._textures is None else facts_of(self._mine, self._reference, self.modules),
        )


def _page_textures(exact: bool) -> "Textures":
    from lfssao.verify.compare.page.textures import Textures  # late: only a page keeps any

    return Textures(exact)


def _surface_parts(case: Case) -> dict[str, Flags]:
    """Flags of a case's texels inside of surfaces and at silhouettes; empty if depth is not known."""
    depth: Array | None = case.outputs.get("depth")
    if depth is None or depth.ndim != 2:
        return {}
    return surface_parts(depth, len(depth) - 2 * int(case.parameters.get("guard", 0)))


def _is_occlusion_wrong(module: str, results: Sequence[Result]) -> bool:
    """Whether the occlusion of any radius of a module is wrong."""
    return any(r.module == module and r.layer.startswith("ao_") and r.verdict in WRONG for r in results)
