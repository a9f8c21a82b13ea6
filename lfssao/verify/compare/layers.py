"""The layers of a module's files, and their matching channels in another renderer's files (DESIGN section 9).

The types of the other renderer's files, or the user, determine the formats of its layers.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.files.image_file import ImagePart, Margins
from lfssao.verify.bounds.stored import FORMATS, LINEAR, TextureFormat
from lfssao.verify.verdict import Plane, Planes

# The order of the passes: of two stages that differ, the earlier one is wrong.
_STAGES = ("depth", "positions", "normals", "color", "ao", "bent", "merged", "blurred", "shaded")
_STANDARD = {"Z": "depth", "P": "positions", "N": "normals"}


class MismatchError(InputError):
    """Two textures that cannot be compared: sizes, channels or types differ."""


@dataclass(frozen=True, eq=False)
class Layer:
    """One texture of one module: its channels and their values, (H, W) each."""

    name: str  # of the stage: depth, ao_1, merged, ... or of the part, 'image' if it has none
    channels: tuple[str, ...]
    planes: Planes
    margins: Margins | None  # of the data window beyond the display window, where the format has them
    stored: TextureFormat | None = None  # the format of the file's values, None for float32

    @property
    def names(self) -> tuple[str, ...]:
        """All names that a rule may use for the layer or one of its channels."""
        return (self.name, *self.channels, *(f"{self.name}.{channel}" for channel in self.channels))

    @property
    def texture(self) -> NDArray[Any]:
        """The values as one array, (H, W) or (H, W, C)."""
        return np.ascontiguousarray(self.planes[0] if len(self.planes) == 1 else np.stack(self.planes, axis=-1))


def layers_of(parts: Sequence[ImagePart]) -> list[Layer]:
    """Layers of parts in the order of the stages: named parts, and groups of channels ``layer.channel`` of others."""
    layers = []
    for part in parts:
        groups: dict[str, list[int]] = {}
        for k, channel in enumerate(part.channels):
            is_standard = channel in _STANDARD and not _is_vector_z(channel, part)
            prefix = channel.rpartition(".")[0] or (channel if is_standard else "")
            groups.setdefault(part.name or _STANDARD.get(prefix, prefix) or "image", []).append(k)
        for name, indices in groups.items():
            indices.sort(key=lambda k: _channel_order(part.channels[k]))
            channels = tuple(part.channels[k] for k in indices)
            planes = tuple(part.planes[k] for k in indices)
            layers.append(Layer(name, channels, planes, part.margins))
    return sorted(layers, key=lambda layer: stage_order(layer.name))


def _is_vector_z(channel: str, part: ImagePart) -> bool:
    """Whether a channel Z is not depth but the third of X, Y and Z."""
    return channel == "Z" and {"X", "Y"} <= {*part.channels}


def _channel_order(channel: str) -> int:
    """A key that sorts R G B A and X Y Z; -1 for all other names, which keep the file's order."""
    last = channel.rpartition(".")[2]
    return "RGBA".find(last) if last in "RGBA" else "XYZ".find(last)


def stage_order(name: str) -> tuple[int, int]:
    """A key that sorts layers' names by stage, ao_2 before ao_10; unknown ones come last."""
    found = re.fullmatch(r"(.*?)(?:_([0-9]{1,9}))?", name, re.DOTALL)
    stage, number = (found[1], int(found[2] or 0)) if found else (name, 0)
    return (_STAGES.index(stage) if stage in _STAGES else len(_STAGES)), number


def is_occlusion(name: str) -> bool:
    """Whether a layer of that name is one of occlusion."""
    return re.fullmatch("ao(_[0-9]+)?|merged|blurred", name) is not None


def group_of(name: str) -> str:
    """The common name of the layers of all radii: ao of ao_1, bent of bent_1; else the name itself."""
    return re.sub("^(ao|bent)_[0-9]+$", r"\1", name)


def is_selected(name: str, wanted: Sequence[str] | None) -> bool:
    """Whether a layer's name or its group's is among the wanted names; None selects all layers."""
    return wanted is None or name in wanted or group_of(name) in wanted


def layers_without_intervals(names: Sequence[str]) -> set[str]:
    """The layers of a rendered module without known intervals, because layers of earlier passes are missing."""
    bent = () if "normals" in names else ("bent_",)
    derived = ("ao_", "bent_", "merged", "blurred", "shaded")
    unbounded = [name for name in names if name.startswith(bent if {"depth", "positions"} <= set(names) else derived)]
    return {
        *unbounded,
        *([] if "depth" in names else ["positions"]),
        *([] if {"color", "normals"} <= {*names} else ["shaded"]),
    }


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel of the other renderer: its part, its name in the part, its full name as the title, and its values."""

    part: ImagePart
    name: str
    title: str
    plane: Plane

    def has_name(self, *wanted: str) -> bool:
        return self.name in wanted or self.title in wanted


# Largest number of channels in a sentence.
_MOST_TITLES = 6


class Matcher:
    """Matches a reference's layers with another renderer's channels of a module, by ``--map`` or by names."""

    def __init__(self, parts: Sequence[ImagePart], layers: Sequence[Layer], rules: Mapping[str, str]) -> None:
        self._parts = parts
        self._layers = layers
        self._rules = rules
        self._all = [
            _Channel(part, name, f"{part.name}.{name}" if part.name else name, plane)
            for part in parts
            for name, plane in zip(part.channels, part.planes, strict=True)
        ]
        self._used: set[_Channel] = set()

    def find(self, layer: Layer) -> Layer | None:
        """The other renderer's channels in the reference's order; None if it has none.

        MismatchError if a channel is missing, or two channels match one.
        """
        found = self._by_rule(layer)
        if found is None:
            found = [self._by_name(layer, channel) for channel in layer.channels]
            found = found if any(found) else self._by_place(layer)
        if not any(found):
            return None
        for channel, candidates in zip(layer.channels, found, strict=True):
            if len(candidates) != 1:
                fault = "there is no channel" if not candidates else "there are two channels"
                known = "" if candidates else f": it has {self._titles(self._all)}"
                raise MismatchError(f"{fault} for {_full_name(layer.name, channel)}{known}")
        chosen = [candidates[0] for candidates in found]
        self._used.update(chosen)
        margins = {c.part.margins for c in chosen}
        if len(margins) > 1:
            raise MismatchError("its channels have different data windows")
        return Layer(layer.name, tuple(c.title for c in chosen), tuple(c.plane for c in chosen), margins.pop())

    def matched(self, layer: Layer, storage: "Storage") -> Layer | None:
        """The layer of ``find`` as float32; MismatchError if its size, data window or type differs."""
        found = self.find(layer)
        if found is None:
            return None
        check_windows(found, layer)  # before decoding: planes of another size are not decoded
        decoded = storage.read(found, layer)
        check_types(decoded, layer)
        return decoded

    def unused(self) -> list[str]:
        """Channels of the other renderer that match no layer of the reference."""
        return [c.title for c in self._all if c not in self._used]

    def why_missing(self, layer: Layer) -> str:
        """Why a layer was not found, in a sentence that names possible channels; call it after all matches."""
        named = [self._rules[name] for name in layer.names if name in self._rules]
        if named:
            return f"there is no layer or channel '{named[0]}', which --map names: it has {self._titles(self._all)}"
        unused = [c for c in self._all if c not in self._used]
        if not unused:
            return f"there is no such layer, it has {self._titles(self._all)}"
        rule = f"{unused[0].title}={_full_name(layer.name, layer.channels[0])}"
        return f"there is no such layer; if it is one of {self._titles(unused)}, say so by --map, such as --map {rule}"

    def _titles(self, channels: Sequence[_Channel]) -> str:
        """Titles of the first channels."""
        return ", ".join(c.title for c in channels[:_MOST_TITLES]) + (", ..." if len(channels) > _MOST_TITLES else "")

    def _by_rule(self, layer: Layer) -> list[list[_Channel]] | None:
        """Candidates of each channel if ``--map`` names the layer or one of its channels, else None."""
        if layer.name in self._rules:
            name = self._rules[layer.name]
            group = [c for c in self._all if c.part.name == name or c.name.rpartition(".")[0] == name]
            group = group or [c for c in self._all if c.has_name(name)]
            if not group:
                return [[]]
            if len(group) != len(layer.channels):
                raise MismatchError(f"'{name}' has {len(group)} channels, {layer.name} has {len(layer.channels)}")
            return self._in_order(layer, group)
        rules = [
            self._rules.get(channel, self._rules.get(_full_name(layer.name, channel))) for channel in layer.channels
        ]
        if not any(rules):
            return None
        return [
            [c for c in self._all if c.has_name(rule)] if rule else self._by_name(layer, channel)
            for rule, channel in zip(rules, layer.channels, strict=True)
        ]

    def _by_name(self, layer: Layer, channel: str) -> list[_Channel]:
        """Channels of that name: in a part with the layer's name, else among channels that belong to no other layer."""
        others = [other for other in self._layers if other.name != layer.name]
        parts = {other.name for other in others}
        other_names = {name for other in others for name in other.channels} - set(layer.channels)
        channels = [c for c in self._all if {"X", "Y"} <= {*layer.channels} or not _is_vector_z(c.name, c.part)]
        named = [c for c in channels if c.part.name == layer.name]
        unclaimed = [c for c in channels if c.part.name not in parts and c.name not in other_names]
        for group in (named, unclaimed):
            exact = [c for c in group if c.name == channel]
            if found := exact or [c for c in group if c.has_name(channel, _full_name(layer.name, channel))]:
                return found
        return []

    def _by_place(self, layer: Layer) -> list[list[_Channel]]:
        """All channels, in order, of a part with the layer's name, or of the only part for the only layer.

        Their number must be the layer's.
        """
        group = [c for c in self._all if c.part.name == layer.name]
        if not group and len(self._layers) == len(self._parts) == 1:
            group = list(self._all)
        return self._in_order(layer, group) if len(group) == len(layer.channels) else [[]]

    def _in_order(self, layer: Layer, group: list[_Channel]) -> list[list[_Channel]]:
        """Channels by the last word of their names if these are the layer's, else by their order."""
        last = {c.name.rpartition(".")[2]: c for c in group}
        words = [channel.rpartition(".")[2] for channel in layer.channels]
        if set(words) == set(last):
            return [[last[word]] for word in words]
        return [[c] for c in group]


def _full_name(layer: str, channel: str) -> str:
    """A channel's name, with the layer's before it unless it has one."""
    return channel if "." in channel else f"{layer}.{channel}"


def check_windows(mine: Layer, reference: Layer) -> None:
    """Refuse textures of different sizes or data windows by a MismatchError that names the difference."""
    for a, b in zip(mine.planes, reference.planes, strict=True):
        if a.shape != b.shape:
            raise MismatchError(
                f"it has {a.shape[1]}x{a.shape[0]} texels, the reference's has {b.shape[1]}x{b.shape[0]}"
            )
    if mine.margins != reference.margins and mine.margins is not None and reference.margins is not None:
        sides = [", ".join(map(str, side)) for side in (mine.margins, reference.margins)]
        window = "the display window (left, above, right, below)"
        raise MismatchError(f"its data window is larger by {sides[0]} than {window}, the reference's by {sides[1]}")


def check_types(mine: Layer, reference: Layer) -> None:
    """Refuse textures of different types by a MismatchError that names them."""
    for a, b in zip(mine.planes, reference.planes, strict=True):
        if a.dtype != b.dtype:
            raise MismatchError(f"it is of {a.dtype}, the reference's is of {b.dtype}")


_COLORS = "color", "shaded"
_DIRECTIONS = "normals", "bent_"  # codes of these are packed in many ways, half floats in one
_OF_TYPE = {"float16": "half", "uint8": "unorm8", "uint16": "unorm16"}
_VISIBILITY = "1-"  # before a name of the reference in a rule


class Storage:
    """Formats of layers (``--stored``), and layers of visibility (``--map X=1-merged``); InputError if wrong."""

    def __init__(self, formats: Mapping[str, str], rules: Mapping[str, str]) -> None:
        for name, format_name in formats.items():
            unsuited = name == "positions" or (format_name == "srgb8" and name not in _COLORS)
            if unsuited or (format_name not in FORMATS and (name, format_name) != ("depth", LINEAR)):
                known = f"formats are {', '.join(FORMATS)} (of colours), {LINEAR} (of depth)"
                raise InputError(f"--stored: {name} cannot be '{format_name}'; {known}")
        self.formats = formats
        self.rules = {name.removeprefix(_VISIBILITY): mine for name, mine in rules.items()}
        self._inverted = set(self.rules) - set(rules)
        if len(self.rules) < len(rules):
            raise InputError("--map: a layer is given twice, by itself and as 1 - it")
        self.named = set(self.rules)
        self.rules = {name: mine for name, mine in self.rules.items() if mine}  # '' is found by its own name

    def read(self, mine: Layer, reference: Layer) -> Layer:
        """A layer as float32, with its format; MismatchError if its type is not the one that the user states."""
        name = reference.name
        (dtype, *other_types) = {plane.dtype.name for plane in mine.planes}
        visibility = not self._inverted.isdisjoint((*reference.names, group_of(name)))
        occlusion = is_occlusion(name)
        if visibility and not occlusion:
            raise InputError(f"--map: {name} has no visibility, occlusion alone has (ao_1, ..., merged, blurred)")
        format_name = "float"
        stated = self.formats.get(name, self.formats.get(group_of(name)))
        if occlusion or name in (*_COLORS, "depth"):
            format_name = "srgb8" if dtype == "uint8" and name in _COLORS else _OF_TYPE.get(dtype, format_name)
        elif dtype == "float16" and name.startswith(_DIRECTIONS):
            format_name = "half"
        linear = stated == LINEAR
        format_name = (stated if stated != LINEAR else format_name) or format_name
        if linear and dtype not in ("float32", "float16"):
            raise MismatchError(f"it is of {dtype}, distances are float32 or half")
        if (
            other_types
            or dtype not in ("float32", FORMATS[format_name][0].__name__)
            or reference.planes[0].dtype.name != "float32"
        ):
            if stated or visibility:
                raise MismatchError(
                    f"it is of {dtype}, the reference's of {reference.planes[0].dtype}: not {stated or '1-'}"
                )
            return mine
        if format_name == "float" and not visibility and not linear:
            return mine
        stored = TextureFormat(format_name, visibility, name == "depth", linear)
        return replace(mine, planes=tuple(stored.read(plane) for plane in mine.planes), stored=stored)
