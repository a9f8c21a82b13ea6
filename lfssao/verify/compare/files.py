"""Files of a folder by modules: by patterns of names that the user gives, and files and pictures of several modules."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from lfssao.errors import InputError, errors_of
from lfssao.files.image_file import ImagePart, Size, read_image_file
from lfssao.optics.display_file import set_of
from lfssao.optics.lenslet import LensletDisplay
from lfssao.optics.quilt import Quilt
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.panels import panel_layer
from lfssao.rendering.quilts import layout_of, place_of

Files = str | Sequence[str] | Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Mosaic:
    """A picture of all views of a quilt, side by side, or the texture of a panel behind lenses."""

    path: Path
    layer: str  # that its name says; '' if its parts' names do
    place: Callable[[int], tuple[slice, slice]]  # rows and columns of a view or lens

    @cached_property
    def _parts(self) -> list[ImagePart]:
        return [replace(part, name=self.layer or part.name) for part in read_image_file(self.path)]

    def parts(self, index: int) -> list[ImagePart]:
        """The parts of one view or lens."""
        place = self.place(index)
        return [replace(part, planes=tuple(plane[place] for plane in part.planes)) for part in self._parts]


@dataclass(frozen=True)
class File:
    """A file of a module: the layer that it holds, where its name or the user says so, or whether it holds others."""

    path: Path
    layer: str = ""
    by_user: bool = False
    shared: bool = False
    mosaic: Mosaic | None = None

    def parts(self, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
        """The parts of one of the modules; one without name, or the only one of a user's file, has the layer's."""
        if self.mosaic is not None:
            return self.mosaic.parts(number_of(module))
        if self.shared:
            return _shared_parts(self.path, module, names, sizes)
        parts = read_image_file(self.path, sizes=sizes)
        said = self.by_user and len(parts) == 1
        return [replace(part, name=(self.layer if said else "") or part.name or self.layer) for part in parts]


def files_like(there: Sequence[Path], patterns: Files, names: Sequence[str]) -> tuple[dict[str, list[File]], set[Path]]:
    """The files of each module that are like patterns, PATTERN=LAYER or PATTERN, and all that are like one.

    {module} and {number} stand for a module's name, or the number that it ends in, with or without zeros before it.
    InputError if no file is like a pattern, or two are of one module.
    """
    files: dict[str, list[File]] = {name: [] for name in names}
    claimed = set()
    words = [patterns] if isinstance(patterns, str) else patterns
    pairs = words.items() if isinstance(words, Mapping) else [[*word.rsplit("=", 1), ""][:2] for word in words]
    for pattern, layer in pairs:
        expression = re.sub(r"\\\{(module|number)\\\}", "(.+)", re.escape(pattern))
        found: dict[str, Path] = {}
        for file in there:
            match = re.fullmatch(expression, file.name)
            fitting = [n for n in names if match and match.groups() and all(_fits(w, n) for w in match.groups())]
            claimed |= {file} if match else set()
            for name in fitting:
                if name in found:
                    raise InputError(f"--files: {found[name].name} and {file.name} are both '{pattern}' of {name}")
                found[name] = file
                files[name].append(File(file, layer, by_user=True))
        if not found:
            raise InputError(
                f"--files: no file is '{pattern}' of a module, such as {names[0]}, with {{module}} or {{number}}"
            )
    return files, claimed


def _fits(word: str, name: str) -> bool:
    """Whether a word is a module's name or its number."""
    number = re.search("[0-9]+$", name)
    return word == name or (number is not None and word.lstrip("0") == number[0].lstrip("0"))


def module_of(word: str, names: Sequence[str]) -> str | None:
    """The longest of the modules' names that a word begins with, as a whole word."""
    fitting = [n for n in names if word == n or (word.startswith(n) and not word[len(n)].isalnum())]
    return max(fitting, key=len, default=None)


def holds_modules(path: Path, names: Sequence[str]) -> bool:
    """Whether parts or channels of an EXR file begin with modules' names; not if it cannot be read."""
    words: list[str] = []

    def note(part: str, channels: Sequence[str]) -> bool:
        words.extend((part, *channels))
        return False

    if path.suffix.lower() == ".exr":
        with suppress(InputError):
            read_image_file(path, keep=note)
    return any(module_of(word, names) for word in words)


def is_mosaic(path: Path) -> bool:
    """Whether a file shows all views of a quilt, or lenses of a panel, by its name."""
    return layout_of(path.stem) is not None or panel_layer(path.stem) is not None


def number_of(module: str) -> int:
    """The number of a module, view or lens, by its name."""
    return int(module.rpartition("_")[2])


def mosaics_of(there: Iterable[Path], folder: Path, manifest: Mapping[str, Any] | None) -> list[File]:
    """The pictures of all views, known by their names, where the reference's folder has a quilt or a panel.

    InputError if the numbers of a name, or the texels of a picture, are not those of the quilt's views or the panel.
    """
    named = [path for path in there if is_mosaic(path)]
    if manifest is None or not named:
        return []
    with reading_manifest(folder), errors_of(f"{folder}: its manifest"):
        views = set_of(manifest)
        if views is None:
            return []
        numbers = {entry["name"]: number_of(entry["name"]) for entry in manifest["views"]}
        for name, number in numbers.items():
            if not 0 <= number < views.count or name != f"{views.WORDS[0]}_{number:03d}":
                raise ValueError(f"{views.WORDS[1]} are not those of the {views.KIND}: {name}")
    if isinstance(views, Quilt):
        return [_quilt_file(path, *layout, views) for path in named if (layout := layout_of(path.stem)) is not None]
    return [_panel_file(path, layer, views) for path in named if (layer := panel_layer(path.stem)) is not None]


def _quilt_file(path: Path, layer: str, columns: int, rows: int, quilt: Quilt) -> File:
    if columns * rows != quilt.count:
        raise InputError(f"{path}: its name says {columns} x {rows} views, the reference's quilt has {quilt.count}")
    views = f"{columns} x {rows} views of {quilt.width}x{quilt.height}"
    _check_texels(path, (columns * quilt.width, rows * quilt.height), f"{views}, as the reference's are, have")
    place = partial(place_of, columns=columns, rows=rows, size=(quilt.width, quilt.height))
    return File(path, layer, mosaic=Mosaic(path, layer, place))


def _panel_file(path: Path, layer: str, display: LensletDisplay) -> File:
    _check_texels(path, (display.width, display.height), "the reference's panel has")
    return File(path, layer, mosaic=Mosaic(path, layer, display.place))


def _check_texels(path: Path, wanted: Size, words: str) -> None:
    size = read_image_file(path, sizes=[])[0].planes[0].shape[::-1]
    if size != wanted:
        raise InputError("{}: it has {}x{} texels, but {} {}x{}".format(path, *size, words, *wanted))


def _shared_parts(path: Path, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
    """The parts and channels of a module in a file of several, without its name."""

    def own(word: str) -> bool:
        return module_of(word, names) == module

    def rest(word: str) -> str:
        return word[len(module) + 1 :] if own(word) else word

    made = []
    for part in read_image_file(path, keep=lambda *words: own(words[0]) or any(map(own, words[1])), sizes=sizes):
        kept = [k for k, channel in enumerate(part.channels) if own(part.name) or own(channel)]
        channels, planes = tuple(rest(part.channels[k]) or "Y" for k in kept), tuple(part.planes[k] for k in kept)
        made.append(replace(part, name=rest(part.name), channels=channels, planes=planes))
    return made
