"""How another renderer's layers are stored, by the types of its files or as the user says."""

from collections.abc import Mapping
from dataclasses import replace

from lfssao.errors import InputError
from lfssao.verify.bounds.stored import FORMATS, Stored
from lfssao.verify.compare.layers import Layer, MismatchError, is_occlusion

_COLORS = "color", "shaded"
_OF_TYPE = {"float16": "half", "uint8": "unorm8", "uint16": "unorm16"}
_VISIBILITY = "1-"  # before a name of the reference in a rule


class Storage:
    """Formats by layer (``--stored``), and layers that are visibility (``--map X=1-merged``), checked (InputError)."""

    def __init__(self, formats: Mapping[str, str], rules: Mapping[str, str]) -> None:
        for name, word in formats.items():
            if word not in FORMATS or name == "positions" or (word == "srgb8" and name not in _COLORS):
                raise InputError(f"--stored: {name} cannot be '{word}'; formats are {', '.join(FORMATS)} (of colours)")
        self.formats, self.rules = formats, {name.removeprefix(_VISIBILITY): mine for name, mine in rules.items()}
        self._turned = set(self.rules) - set(rules)
        if len(self.rules) < len(rules):
            raise InputError("--map: a layer is given twice, by itself and as 1 - it")

    def read(self, mine: Layer, right: Layer) -> tuple[Layer, Stored | None]:
        """A layer as float32, and how it was stored; MismatchError for types that are not what the user says."""
        name, (kind, *others) = right.name, {plane.dtype.name for plane in mine.planes}
        visibility = not self._turned.isdisjoint(
            {name, *right.channels, *(f"{name}.{channel}" for channel in right.channels)}
        )
        occlusion, said = is_occlusion(name), self.formats.get(name)
        if visibility and not occlusion:
            raise InputError(f"--map: {name} has no visibility, occlusion alone has (ao_1, ..., merged, blurred)")
        word = _OF_TYPE.get(kind, "float") if occlusion or name in (*_COLORS, "depth") else "float"
        word = said or ("srgb8" if word == "unorm8" and name in _COLORS else word)
        if others or kind not in ("float32", FORMATS[word][0].__name__) or right.planes[0].dtype.name != "float32":
            if said or visibility:
                raise MismatchError(f"it is of {kind}, the reference's of {right.planes[0].dtype}: not {said or '1-'}")
            return mine, None
        if word == "float" and not visibility:
            return mine, None
        stored = Stored(word, visibility, name == "depth")
        return replace(mine, planes=tuple(stored.read(plane) for plane in mine.planes)), stored
