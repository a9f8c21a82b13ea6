"""Diagnoses of a comparison's modules, one after the other: what explains one texture is tried first on the next."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property, lru_cache, partial
from typing import Any

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
from lfssao.verify.compare.background import PLACED
from lfssao.verify.compare.layers import layers_of
from lfssao.verify.compare.source import Reference
from lfssao.verify.compare.surface import Surface
from lfssao.verify.diagnosis.change import Candidate
from lfssao.verify.diagnosis.diagnose import Diagnosis, WrongTexture
from lfssao.verify.diagnosis.views import Sight, sight_of
from lfssao.verify.judge import stage_inputs
from lfssao.verify.verdict import Judgement

Views = dict[str, tuple[Reference, str]]

_MOST_MODULES = 6  # whose textures are tried: each takes a file to read


class Diagnoser:
    """Diagnoses of the wrong textures of a reference's modules.

    ``more`` are views of other folders, by the names that they are told by, each with its folder and its name there.
    """

    def __init__(
        self, reference: Reference, model: ErrorModel, surface: Surface | None, more: Views | None = None
    ) -> None:
        self._surface = surface
        self._reference, self._model = reference, MODELS["nearest"] if model.exact else model
        own = sorted(reference.files)
        self._views: Views = {**{name: (reference, name) for name in own}, **(more or {})}
        self._names = sorted(self._views) if more else own
        self._opposite = dict(zip(self._names, reversed(self._names), strict=True))  # modules in reverse order
        self._layers = lru_cache(maxsize=2 * _MOST_MODULES)(self._read)
        self._found: dict[str, list[Candidate]] = defaultdict(list)  # that explain a stage, the first first
        self._shared: Counter[Candidate] = Counter()  # numbers of the view, by the textures that they explain
        self._given_up: set[str] = set()  # stages in which nothing fitted
        self._open: dict[str, WrongTexture] = {}  # textures of this module without an explanation, by their names

    def diagnose(
        self,
        module: str,
        name: str,
        mine: Arrays,
        case: Case,
        judged: Judgement,
        stored: TextureFormat | None,
        channel: str,
        background: float | None,
    ) -> Diagnosis | None:
        """The diagnosis of a view's texture that is wrong; None if there is none.

        A number of the view that explained any stage is tried first. A stage that could not be explained is searched
        once. ``channel`` is the renderer's own name of the texture, ``background`` the wrong value that it had where
        there is no surface, None if that was right.
        """
        stage = name.rpartition("_")[0] if name.startswith("ao_") else name
        wrong = WrongTexture(
            name,
            mine[name],
            stage_inputs(mine, case),
            case,
            judged,
            self._model,
            stored,
            display=self._place(module),
            others={words: self._sights[other] for words, other in self._others(module).items()},
            textures=lambda layer: dict(self._textures(module, layer, case)),
            places=self._places(module, case),
            caster=partial(self._caster, module),
            sampling=(self._reference.manifest or {}).get("sampling") or {},
            channel=channel,
            background=None if background is None else _background_candidate(name, background),
        )
        known = [*(each for each, _ in self._shared.most_common()), *self._found[stage]]
        found = wrong.diagnose(list(dict.fromkeys(known)), search=stage not in self._given_up)
        if found is None:
            return None
        if not found.fits:
            self._given_up.add(stage)
            self._open[name] = wrong
        for each in found.candidates if found.fits else ():
            same = Candidate(each.kind, each.values, "", 0.0, 0.0, 0.0, each.shared)  # of any texture
            if each.shared:
                self._shared[same] += 1
            elif each.kind != "background" and same not in self._found[stage]:
                self._found[stage].append(same)
        return found

    def later(self) -> dict[str, Diagnosis]:
        """Diagnoses of a module's textures by numbers of the view that only its later stages told."""
        known = [each for each, _ in self._shared.most_common()]
        made = {name: wrong.diagnose(known, search=False) for name, wrong in self._open.items()} if known else {}
        self._open = {}
        return {name: found for name, found in made.items() if found is not None and found.fits}

    def _caster(self, module: str) -> RayCaster | None:
        return None if self._surface is None else self._surface.caster(self._reference.entries[module])

    @cached_property
    def _display(self) -> Display | Quilt | None:
        """The display or the quilt of the reference's manifest, if it has one."""
        manifest, entries = self._reference.manifest or {}, self._reference.entries
        if manifest.get("display") is None:
            with suppress(InputError, ValueError), reading_manifest(self._reference.path):
                views = set_of(manifest)
                return views if isinstance(views, Quilt) else None
            return None
        with suppress(InputError, ValueError), reading_manifest(self._reference.path):
            return display_of(manifest["display"], {_number(name): entry for name, entry in entries.items()})
        return None

    def _place(self, module: str) -> tuple[Display | Quilt, int] | None:
        return None if self._display is None else (self._display, _number(module))

    @cached_property
    def _sights(self) -> dict[str, Sight]:
        """How each module sees the scene."""
        made = {}
        for words, (reference, name) in self._views.items():
            view = described_view(reference.described(name).parameters)
            place = self._place(name) if reference is self._reference else None
            made[words] = sight_of(view, *(place or (None, None)))
        return made

    def _others(self, module: str) -> dict[str, str]:
        """Other modules, each by its name and whether it is this one's in reverse order."""
        return {self._words(module, other): other for other in self._names if other != module}

    def _words(self, module: str, other: str) -> str:
        reverse = self._opposite[module] == other and len(self._names) > 2  # of two eyes it is the other one
        return f"{other} ({other.partition('_')[0]}s in reverse order)" if reverse else other

    def _textures(self, module: str, layer: str, case: Case) -> Iterator[tuple[str, NDArray[Any]]]:
        """A layer of the module in this one's place in reverse order, and of the nearest, of its own one's size."""
        others = [name for name in self._names if name != module]
        place = self._names.index
        others.sort(key=lambda other: (other != self._opposite[module], abs(place(other) - place(module))))
        for other in others[:_MOST_MODULES]:
            texture = self._layers(other).get(layer)
            if texture is not None and layer in case.outputs and texture.shape == case.outputs[layer].shape:
                yield self._words(module, other), texture

    def _read(self, words: str) -> Mapping[str, NDArray[Any]]:
        """All layers of a view; none of a file that cannot be read, which is no candidate."""
        reference, name = self._views[words]
        with suppress(InputError):
            return {layer.name: layer.texture for layer in layers_of(read_image_file(reference.files[name]))}
        return {}

    def _places(self, module: str, case: Case) -> dict[str, tuple[int, int]]:
        """Columns and rows at which a view lies in one texture of all, by how they are laid out."""
        view, k = case.parameters["view"], self._names.index(module)
        width, height = view["width"], view["height"]
        made = {"side by side": (k * width, 0), "one above the other": (0, k * height)}
        quilt = (self._reference.manifest or {}).get("quilt")
        if quilt is not None:
            with suppress(ValueError, TypeError, KeyError):
                columns, rows = int(quilt["columns"]), int(quilt["rows"])
                number = int(module.rpartition("_")[2])
                made["of a quilt"] = (number % columns * width, (rows - 1 - number // columns) * height)
        return {layout: place for layout, place in made.items() if place != (0, 0)}


def _number(module: str) -> int:
    return int(module.rpartition("_")[2])


def _background_candidate(name: str, value: float) -> Candidate:
    """The candidate that names a background."""
    usual, hint = ("infinity", f"--background {value:g}") if name in PLACED else ("0", "")
    words = f"background is {value:g} in place of {usual}"
    return Candidate("background", (value,), words, 1.0, 1.0, 1.0, hint=hint)
