"""Diagnoses of a comparison's modules in turn: an explanation of one texture is tried first on the next."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.files.image_file import read_image_file
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.display_file import set_of
from lfssao.optics.quilt import Quilt
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.manifest import display_of
from lfssao.verify.bounds.error_model import MODELS, ErrorModel
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import Arrays, Case, described_view
from lfssao.verify.compare.background import INFINITE_BACKGROUND
from lfssao.verify.compare.layers import layers_of
from lfssao.verify.compare.source import Reference
from lfssao.verify.compare.surface import Surface
from lfssao.verify.diagnosis.change import Candidate
from lfssao.verify.diagnosis.diagnose import Diagnosis, WrongTexture
from lfssao.verify.diagnosis.hints import background_text
from lfssao.verify.diagnosis.views import Sight, sight_of
from lfssao.verify.judge import stage_inputs
from lfssao.verify.verdict import Judgement

Views = dict[str, tuple[Reference, str]]

_MOST_MODULES = 6  # whose textures are tried: each takes a file to read


class Diagnoser:
    """Diagnoses of the wrong textures of a reference's modules.

    ``other_views`` are views of other folders by the labels in reports, each with its folder and its name there.
    """

    def __init__(
        self, reference: Reference, model: ErrorModel, surface: Surface | None, other_views: Views | None = None
    ) -> None:
        self._surface = surface
        self._reference = reference
        self._model = MODELS["nearest"] if model.exact else model
        own = sorted(reference.files)
        self._views: Views = {**{name: (reference, name) for name in own}, **(other_views or {})}
        self._names = sorted(self._views) if other_views else own
        self._reversed = dict(zip(self._names, reversed(self._names), strict=True))  # modules in reverse order
        self._layers = lru_cache(maxsize=2 * _MOST_MODULES)(self._read)
        self._explanations: dict[str, list[Candidate]] = defaultdict(list)  # by stage, in the order of discovery
        self._view_changes: Counter[Candidate] = Counter()  # numbers of the view, by the textures that they explain
        self._unexplained_stages: set[str] = set()  # stages in which nothing fitted
        self._unexplained: dict[str, WrongTexture] = {}  # textures of this module, by name

    def diagnose(
        self,
        module: str,
        name: str,
        mine: Arrays,
        case: Case,
        judgement: Judgement,
        stored: TextureFormat | None,
        channel: str,
        backgrounds: Mapping[float, int],
    ) -> Diagnosis | None:
        """The diagnosis of a view's wrong texture; None if there is none.

        Changes of the view that explained any stage are tried first. A stage without an explanation is searched only
        once. ``channel`` is the renderer's own name of the texture, ``backgrounds`` its wrong values where there is no
        surface, with numbers of texels.
        """
        stage = name.rpartition("_")[0] if name.startswith("ao_") else name
        wrong = WrongTexture(
            name,
            mine[name],
            stage_inputs(mine, case),
            case,
            judgement,
            self._model,
            stored,
            display=self._display_view(module),
            others={words: self._sights[other] for words, other in self._other_labels(module).items()},
            textures=lambda layer: dict(self._other_textures(module, layer, case)),
            places=self._layout_offsets(module, case),
            caster=partial(self._caster, module),
            sampling=(self._reference.manifest or {}).get("sampling") or {},
            channel=channel,
            background=_background_candidate(name, backgrounds) if backgrounds else None,
        )
        explanations = [*(candidate for candidate, _ in self._view_changes.most_common()), *self._explanations[stage]]
        diagnosis = wrong.diagnose(list(dict.fromkeys(explanations)), search=stage not in self._unexplained_stages)
        if diagnosis is None:
            return None
        if not diagnosis.fits:
            self._unexplained_stages.add(stage)
            self._unexplained[name] = wrong
        for candidate in diagnosis.candidates if diagnosis.fits else ():
            change = Candidate(candidate.kind, candidate.values, "", 0.0, 0.0, 0.0, candidate.shared)  # of any texture
            if candidate.shared:
                self._view_changes[change] += 1
            elif candidate.kind != "background" and change not in self._explanations[stage]:
                self._explanations[stage].append(change)
        return diagnosis

    def late_diagnoses(self) -> dict[str, Diagnosis]:
        """Diagnoses of a module's textures by changes of the view that only later stages revealed."""
        changes = [change for change, _ in self._view_changes.most_common()]
        unexplained = self._unexplained if changes else {}
        diagnoses = {name: wrong.diagnose(changes, search=False) for name, wrong in unexplained.items()}
        self._unexplained = {}
        return {name: diagnosis for name, diagnosis in diagnoses.items() if diagnosis is not None and diagnosis.fits}

    def _caster(self, module: str) -> RayCaster | None:
        return None if self._surface is None else self._surface.caster(self._reference.entries[module])

    @cached_property
    def _display(self) -> Display | Quilt | None:
        """The display or the quilt of the reference's manifest; None if it has neither."""
        manifest = self._reference.manifest or {}
        entries = self._reference.entries
        if manifest.get("display") is None:
            with suppress(InputError, ValueError), reading_manifest(self._reference.path):
                views = set_of(manifest)
                return views if isinstance(views, Quilt) else None
            return None
        with suppress(InputError, ValueError), reading_manifest(self._reference.path):
            return display_of(manifest["display"], {_view_number(name): entry for name, entry in entries.items()})
        return None

    def _display_view(self, module: str) -> tuple[Display | Quilt, int] | None:
        return None if self._display is None else (self._display, _view_number(module))

    @cached_property
    def _sights(self) -> dict[str, Sight]:
        """The sight of each module."""
        sights = {}
        for label, (reference, name) in self._views.items():
            view = described_view(reference.described(name).parameters)
            display_view = self._display_view(name) if reference is self._reference else None
            sights[label] = sight_of(view, *(display_view or (None, None)))
        return sights

    def _other_labels(self, module: str) -> dict[str, str]:
        """Names of other modules by their labels, which mark the module at this one's place in reverse order."""
        return {self._label(module, other): other for other in self._names if other != module}

    def _label(self, module: str, other: str) -> str:
        is_reversed = self._reversed[module] == other and len(self._names) > 2  # of two eyes it is the other one
        return f"{other} ({other.partition('_')[0]}s in reverse order)" if is_reversed else other

    def _other_textures(self, module: str, layer: str, case: Case) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield a layer of other modules: the one at this one's place in reverse order, then the nearest ones.

        Textures of another size are left out.
        """
        others = [name for name in self._names if name != module]
        position = self._names.index
        others.sort(key=lambda other: (other != self._reversed[module], abs(position(other) - position(module))))
        for other in others[:_MOST_MODULES]:
            texture = self._layers(other).get(layer)
            if texture is not None and layer in case.outputs and texture.shape == case.outputs[layer].shape:
                yield self._label(module, other), texture

    def _read(self, label: str) -> Mapping[str, NDArray[Any]]:
        """All layers of a view; none if its file cannot be read."""
        reference, name = self._views[label]
        with suppress(InputError):
            return {layer.name: layer.texture for layer in layers_of(read_image_file(reference.files[name]))}
        return {}

    def _layout_offsets(self, module: str, case: Case) -> dict[str, tuple[int, int]]:
        """The view's column and row in one texture of all views, by the layout of the texture."""
        view = case.parameters["view"]
        index = self._names.index(module)
        width = view["width"]
        height = view["height"]
        offsets = {"side by side": (index * width, 0), "one above the other": (0, index * height)}
        quilt = (self._reference.manifest or {}).get("quilt")
        if quilt is not None:
            with suppress(ValueError, TypeError, KeyError):
                columns = int(quilt["columns"])
                rows = int(quilt["rows"])
                number = int(module.rpartition("_")[2])
                offsets["of a quilt"] = (number % columns * width, (rows - 1 - number // columns) * height)
        return {layout: offset for layout, offset in offsets.items() if offset != (0, 0)}


def _view_number(module: str) -> int:
    return int(module.rpartition("_")[2])


def _background_candidate(name: str, backgrounds: Mapping[float, int]) -> Candidate:
    """The candidate of a wrong background; the command line accepts one value that is a number."""
    is_infinite = name in INFINITE_BACKGROUND
    right = "infinity" if is_infinite else "0"
    values = tuple(value for value in backgrounds if not np.isnan(value))
    texts = ["NaN" if np.isnan(value) else background_text(value) for value in backgrounds]
    hint = f"--background {texts[0]}" if is_infinite and len(values) == len(texts) == 1 else ""
    kinds = f"background is {' and '.join(texts)} in place of {right}"
    words = kinds
    if len(texts) > 1:
        numbers = [f"{text} on {number}" for text, number in zip(texts, backgrounds.values(), strict=True)]
        words = f"background is {numbers[0]} texels and {' and '.join(numbers[1:])} in place of {right}"
    return Candidate("background", values, words, 1.0, 1.0, 1.0, hint=hint, in_all=kinds)
