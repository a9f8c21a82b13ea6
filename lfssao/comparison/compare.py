"""A comparison: modules one after the other, each stage judged on what the renderer itself made before it."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lfssao.comparison.intervals import Oracle, Parameters, not_written
from lfssao.comparison.kit_case import CaseOracle, case_layers
from lfssao.comparison.layers import Layer, Matcher, MismatchError, check_comparable
from lfssao.comparison.picture import Panels
from lfssao.comparison.report import Report
from lfssao.comparison.source import Mine, Reference
from lfssao.comparison.surface import Surface
from lfssao.comparison.verdict import Judged, Result, Verdict, judge
from lfssao.errors import InputError
from lfssao.oracle.bounds import Bounds
from lfssao.oracle.depth import DepthBounds
from lfssao.oracle.error_model import find_model
from lfssao.oracle.judge import StageVerdict

# Of the reference's mesh, before it is first asked for.
_UNREAD = object()

# What a manifest that is none leads to.
_MALFORMED = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)


def compare(
    mine: str | Path,
    reference: str | Path,
    *,
    rules: Mapping[str, str] | None = None,
    layers: Sequence[str] | None = None,
    exact: bool = False,
    model: str = "shader",
    mesh: str | None = None,
) -> Report:
    """Compare another renderer's textures with a reference.

    Parameters
    ----------
    mine, reference : str or Path
        Two folders or two files; EXR, TIFF, PNG or NPY. Acceptance intervals are known where the reference is what
        ``lfssao render`` wrote, beside its manifest.
    rules : mapping, optional
        Layers or channels of the reference, each with the other renderer's name of it, where conventions do not tell.
    layers : sequence of str, optional
        Compare these layers of the reference only.
    exact : bool
        Whether all but equal bits fails.
    model : str
        What the renderer's arithmetic may do (``lfssao.oracle.error_model.MODELS``).
    mesh : str, optional
        File of the mesh that the reference was rendered of, by which depth and colour are judged; the embedded scenes
        need none.

    Returns
    -------
    Report
        With ``exit_code`` 0 where everything conforms.

    Raises
    ------
    InputError
        If there is nothing to compare, or the manifest or an argument is wrong. What is wrong with single files and
        layers is in the report.
    """
    comparison = Comparison(Path(mine), Path(reference), rules or {}, layers, exact, model, mesh)
    for module in comparison.modules:
        comparison.add(module)
    return comparison.report()


class Comparison:
    """A comparison that is given its modules one by one; it keeps figures, and pictures of one module.

    Parameters
    ----------
    mine, reference : Path
        Two folders or two files.
    rules, layers, exact, model, mesh
        As of ``compare``.

    Raises
    ------
    InputError
        As ``compare``.
    """

    def __init__(
        self,
        mine: Path,
        reference: Path,
        rules: Mapping[str, str],
        layers: Sequence[str] | None,
        exact: bool,
        model: str,
        mesh: str | None = None,
    ) -> None:
        self._model = find_model(model)
        self._reference = Reference.open(reference)
        self._mine = Mine.open(mine, self._reference)
        self._rules, self._wanted, self._exact = dict(rules), layers, exact
        self._mesh = mesh
        self._surface: object = _UNREAD
        if mesh is not None:
            if self._reference.manifest is None:
                raise InputError(f"--mesh: {reference} is not what 'lfssao render' writes, its views are not known")
            self._known_surface(self._reference.manifest)
        self._results: list[Result] = []
        self._notes = [f"{name} is of no module of the reference" for name in self._mine.extra]
        self._panels: Panels | None = None
        self._named: set[str] = set()
        self._known_occlusion = True

    @property
    def modules(self) -> list[str]:
        """Names of the reference's modules, in its order."""
        return list(self._reference.files)

    def add(self, module: str) -> None:
        """Compare one module.

        Raises
        ------
        InputError
            If the manifest does not hold what the oracle needs.
        """
        parameters = self._parameters(module)
        optional: set[str] = set()
        try:
            case = self._reference.case(module)
            if case is None:
                reference = self._reference.layers(module)
            else:
                reference, optional = case_layers(case)
            parts = self._mine.parts(module)
        except InputError as error:
            self._results.append(Result(module, "", Verdict.UNREADABLE, str(error)))
            return
        self._named |= {name for layer in reference for name in (layer.name, *_channel_names(layer))}
        if not parts:
            detail = f"{self._mine.path} has no file of it, such as {module}.exr or {module}_LAYER.npy"
            self._results.append(Result(module, "", Verdict.MISSING, detail))
            return
        matcher = Matcher(parts, reference, self._rules)
        found, refused = _found_layers(module, matcher, reference, optional)
        right = {layer.name: layer for layer in reference}
        oracle: Oracle | CaseOracle | None = None
        if parameters is not None:
            self._known_occlusion = parameters.samples is not None or parameters.estimate is not None
            oracle = Oracle(parameters, found, right, self._model, partial(self._from_mesh, module, _shape(right)))
        elif case is not None:
            oracle = CaseOracle(case, found)
        self._compare(module, oracle, found, refused, reference)
        if self._wanted is None:
            self._notes += [f"{module}: channel {name} is not in the reference" for name in matcher.unused()]

    def _parameters(self, module: str) -> Parameters | None:
        source = self._reference
        if source.manifest is None:
            return None
        return Parameters.of(source.path, source.manifest, source.entries[module])

    def _from_mesh(self, module: str, shape: tuple[int, ...]) -> tuple[DepthBounds, Bounds | None] | None:
        """Bounds of a module's depth and colour, of that shape, from the reference's mesh where it is known."""
        source = self._reference
        assert source.manifest is not None  # there is an oracle
        entry = source.entries[module]
        surface = self._known_surface(source.manifest)
        if surface is None or shape != (entry["view"]["height"], entry["view"]["width"]):
            return None
        try:
            return surface.bounds(entry, self._model)
        except InputError:
            raise
        except _MALFORMED as error:
            raise self._not_a_manifest(error) from error

    def _known_surface(self, manifest: dict[str, Any]) -> Surface | None:
        if self._surface is _UNREAD:
            try:
                self._surface = Surface.of(manifest, self._mesh)
            except InputError:
                raise
            except _MALFORMED as error:
                raise self._not_a_manifest(error) from error
        return self._surface if isinstance(self._surface, Surface) else None

    def _not_a_manifest(self, error: Exception) -> InputError:
        return not_written(self._reference.path, error)

    def _compare(
        self,
        module: str,
        oracle: Oracle | CaseOracle | None,
        found: dict[str, Layer],
        refused: dict[str, Result],
        reference: Sequence[Layer],
    ) -> None:
        """Judge the layers of a module that are wanted."""
        panels = Panels(module)
        for right in reference:
            if self._wanted is not None and right.name not in self._wanted:
                continue
            if right.name in refused:
                self._results.append(refused[right.name])
                continue
            if right.name not in found:
                continue
            judged = self._judge(module, oracle, found[right.name], right)
            self._results.append(judged.result)
            self._note_strays(judged.result)
            panels.offer(found[right.name], right, judged)
        if self._panels is None or panels.rank > self._panels.rank:
            self._panels = panels

    def _note_strays(self, result: Result) -> None:
        """Warn of texels that only the mesh could tell right from wrong."""
        if result.verdict is Verdict.INSIDE and result.outside:
            some = f"{result.outside} texel{'s' * (result.outside != 1)}"
            what = f"{result.module}, {result.layer}: {some} cannot be judged without the mesh (--mesh FILE)"
            limit = "no more than may look past an edge, by a statistical limit that proves nothing"
            self._notes.append(f"{what}: {limit}")

    def _judge(self, module: str, oracle: Oracle | CaseOracle | None, mine: Layer, reference: Layer) -> Judged:
        name = reference.name

        def ask() -> StageVerdict | None:
            return None if oracle is None else oracle.verdict(name)

        def reason(texel: tuple[int, int]) -> str:
            return "" if oracle is None else oracle.reason(name, texel)

        try:
            return judge(module, mine, reference, ask, reason)
        except InputError as error:
            raise InputError(f"{self._reference.path}: its manifest is not of its textures ({error})") from error

    def report(self) -> Report:
        """What was found of the modules that were added.

        Raises
        ------
        InputError
            If a rule or a wanted layer names nothing that the reference has.
        """
        if self._named:
            for name in (*(self._wanted or ()), *self._rules):
                if name not in self._named:
                    raise InputError(f"the reference has no layer or channel '{name}'")
        return Report(
            mine=str(self._mine.path),
            reference=str(self._reference.path),
            model=self._reference.kit_model if self._reference.manifest is None else self._model.name,
            exact=self._exact,
            estimator=self._other_estimator(),
            modules=len(self._reference.files),
            results=tuple(self._results),
            notes=tuple(self._notes),
            panels=self._panels,
        )

    def _other_estimator(self) -> str | None:
        """The reference's estimator where no intervals of its occlusion are known."""
        if self._reference.manifest is None:
            return None
        chosen = self._reference.manifest.get("settings")
        if self._known_occlusion or not isinstance(chosen, dict):
            return None
        return f"{chosen.get('estimator')}{' with neighbours' if chosen.get('neighbours') else ''}"


def _found_layers(
    module: str, matcher: Matcher, reference: Sequence[Layer], optional: set[str]
) -> tuple[dict[str, Layer], dict[str, Result]]:
    """The other renderer's layers by name, and what is said of those that cannot be compared.

    All are found before one is judged, as later stages are judged by earlier ones.
    """
    found: dict[str, Layer] = {}
    refused: dict[str, Result] = {}
    missing: list[Layer] = []
    for right in reference:
        try:
            layer = matcher.find(right)
            if layer is not None:
                check_comparable(layer, right)
                found[right.name] = layer
            elif right.name not in optional:
                missing.append(right)
        except MismatchError as error:
            refused[right.name] = Result(module, right.name, Verdict.MISMATCH, str(error))
    for right in missing:  # behind all that were found: what is left over may be it
        refused[right.name] = Result(module, right.name, Verdict.MISSING, matcher.why_missing(right))
    return found, refused


def _shape(layers: dict[str, Layer]) -> tuple[int, ...]:
    """Of the depth texture; () where there is none."""
    return layers["depth"].planes[0].shape if "depth" in layers else ()


def _channel_names(layer: Layer) -> list[str]:
    return [name for channel in layer.channels for name in (channel, f"{layer.name}.{channel}")]
