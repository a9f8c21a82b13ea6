"""Diagnoses of a comparison's modules, one after the other: one that fits is tried first on the next texture."""

from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.rendering.image_file import read_image_file
from lfssao.verify.bounds.error_model import MODELS, ErrorModel
from lfssao.verify.bounds.stored import Stored
from lfssao.verify.case import VIEW, Arrays, Case, described_mapping
from lfssao.verify.compare.layers import layers_of
from lfssao.verify.compare.source import Reference
from lfssao.verify.diagnosis.diagnose import Diagnosis, Wrong
from lfssao.verify.judge import inputs_of
from lfssao.verify.verdict import Judgement, Verdict

_MOST_MODULES = 6  # whose depth is tried: each takes a file to read
_WRONG = (Verdict.OUTSIDE, Verdict.DIFFERENT)


class Diagnoser:
    """Diagnoses of the wrong textures of a reference's modules."""

    def __init__(self, reference: Reference, model: ErrorModel) -> None:
        self._reference, self._model = reference, MODELS["nearest"] if model.exact else model
        self._names = list(reference.files)
        self._opposite = dict(zip(self._names, reversed(self._names), strict=True))  # modules in reverse order
        self._found: dict[str, list[Diagnosis]] = defaultdict(list)  # by stage
        self._given_up: set[str] = set()  # stages in which nothing fitted

    def diagnose(
        self, module: str, name: str, mine: Arrays, case: Case, judged: Judgement, stored: Stored | None
    ) -> Diagnosis | None:
        """The diagnosis of a texture that is wrong, else None; a stage that could not be explained is tried once."""
        stage = name.rpartition("_")[0] if name.startswith("ao_") else name
        if case.stage != VIEW or judged.verdict not in _WRONG or stage in self._given_up:
            return None
        others = {self._words(module, other): other for other in self._reference.files if other != module}
        cases = {words: self._reference.described(other) for words, other in others.items()}
        mappings = {words: described_mapping(case.parameters) for words, case in cases.items()}
        known = stored, mappings, lambda: dict(self._depths(module))
        wrong = Wrong(name, mine[name], inputs_of(mine, case), case, judged, self._model, *known)
        found = wrong.diagnose(self._found[stage])
        if found is not None and found.fits:
            self._found[stage].append(found)
        elif found is not None:
            self._given_up.add(stage)
        return found

    def _words(self, module: str, other: str) -> str:
        """Another module's name, and whether it is this one's in reverse order."""
        return f"{other} (modules in reverse order)" if self._opposite[module] == other else other

    def _depths(self, module: str) -> Iterator[tuple[str, NDArray[Any]]]:
        """Depth of the module in this one's place in reverse order, and of the nearest."""
        others = [name for name in self._names if name != module]
        place = self._names.index
        others.sort(key=lambda other: (other != self._opposite[module], abs(place(other) - place(module))))
        for other in others[:_MOST_MODULES]:
            with suppress(InputError):  # a file that cannot be read is no candidate
                for layer in layers_of(read_image_file(self._reference.files[other])):
                    if layer.name == "depth":
                        yield f"the depth of {self._words(module, other)}", layer.texture
