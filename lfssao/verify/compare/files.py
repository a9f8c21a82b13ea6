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
    layer: str  # the layer in the file's name; '' if the names of its parts are layers
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
    """A file of a module: its layer, if its name or the user states one, and flags of files of several modules."""

    path: Path
    layer: str = ""
    by_user: bool = False
    shared: bool = False
    mosaic: Mosaic | None = None

    def parts(self, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
        """The parts of a module; a part without a name, or the only part of a user's file, gets the layer's name."""
        if self.mosaic is not None:
            return self.mosaic.parts(number_of(module))
        if self.shared:
            return _shared_parts(self.path, module, names, sizes)
        parts = read_image_file(self.path, sizes=sizes)
        named_by_user = self.by_user and len(parts) == 1
        return [replace(part, name=(self.layer if named_by_user else "") or part.name or self.layer) for part in parts]


def match_files(
    paths: Sequence[Path], patterns: Files, names: Sequence[str]
) -> tuple[dict[str, list[File]], set[Path]]:
    """The files of each module that match PATTERN=LAYER or PATTERN, and all files that match any pattern.

    {module} and {number} stand for a module's name, or the number at its end, with or without leading zeros.
    InputError if no file matches a pattern, or two files match it for one module.
    """
    files: dict[str, list[File]] = {name: [] for name in names}
    matched = set()
    texts = [patterns] if isinstance(patterns, str) else patterns
    pairs = texts.items() if isinstance(texts, Mapping) else [[*text.rsplit("=", 1), ""][:2] for text in texts]
    for pattern, layer in pairs:
        expression = re.sub(r"\\\{(module|number)\\\}", "(.+)", re.escape(pattern))
        found: dict[str, Path] = {}
        for file in paths:
            match = re.fullmatch(expression, file.name)
            words = match.groups() if match else ()
            matching = [name for name in names if words and all(_is_name_or_number(word, name) for word in words)]
            matched |= {file} if match else set()
            for name in matching:
                if name in found:
                    raise InputError(f"--files: {found[name].name} and {file.name} are both '{pattern}' of {name}")
                found[name] = file
                files[name].append(File(file, layer, by_user=True))
        if not found:
            raise InputError(
                f"--files: no file is '{pattern}' of a module, such as {names[0]}, with {{module}} or {{number}}"
            )
    return files, matched


def _is_name_or_number(word: str, name: str) -> bool:
    """Whether a word is a module's name or its number."""
    number = re.search("[0-9]+$", name)
    return word == name or (number is not None and word.lstrip("0") == number[0].lstrip("0"))


def module_of(word: str, names: Sequence[str]) -> str | None:
    """The longest module name at the start of a word, as a whole word; None if there is none."""
    matching = [name for name in names if word == name or (word.startswith(name) and not word[len(name)].isalnum())]
    return max(matching, key=len, default=None)


def holds_modules(path: Path, names: Sequence[str]) -> bool:
    """Whether parts or channels of an EXR file begin with modules' names; False if it cannot be read."""
    words: list[str] = []

    def record(part: str, channels: Sequence[str]) -> bool:
        words.extend((part, *channels))
        return False

    if path.suffix.lower() == ".exr":
        with suppress(InputError):
            read_image_file(path, keep=record)
    return any(module_of(word, names) for word in words)


def is_mosaic(path: Path) -> bool:
    """Whether a file's name is that of a picture of all views of a quilt, or of all lenses of a panel."""
    return layout_of(path.stem) is not None or panel_layer(path.stem) is not None


def number_of(module: str) -> int:
    """The number in the name of a module, view or lens."""
    return int(module.rpartition("_")[2])


def mosaics_of(paths: Iterable[Path], folder: Path, manifest: Mapping[str, Any] | None) -> list[File]:
    """The pictures of all views, by their names, if the reference's folder has a quilt or a panel.

    InputError if the numbers in a name, or the size of a picture, do not match the quilt's views or the panel.
    """
    mosaics = [path for path in paths if is_mosaic(path)]
    if manifest is None or not mosaics:
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
        return [_quilt_file(path, *layout, views) for path in mosaics if (layout := layout_of(path.stem)) is not None]
    return [_panel_file(path, layer, views) for path in mosaics if (layer := panel_layer(path.stem)) is not None]


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


def _check_texels(path: Path, expected: Size, words: str) -> None:
    size = read_image_file(path, sizes=[])[0].planes[0].shape[::-1]
    if size != expected:
        raise InputError("{}: it has {}x{} texels, but {} {}x{}".format(path, *size, words, *expected))


def _shared_parts(path: Path, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
    """The parts and channels of a module in a file of several modules, without the module's name."""

    def is_of_module(word: str) -> bool:
        return module_of(word, names) == module

    def without_module(word: str) -> str:
        return word[len(module) + 1 :] if is_of_module(word) else word

    def is_kept(part: str, channels: Sequence[str]) -> bool:
        return is_of_module(part) or any(map(is_of_module, channels))

    parts = []
    for part in read_image_file(path, keep=is_kept, sizes=sizes):
        indices = [k for k, channel in enumerate(part.channels) if is_of_module(part.name) or is_of_module(channel)]
        channels = tuple(without_module(part.channels[k]) or "Y" for k in indices)
        planes = tuple(part.planes[k] for k in indices)
        parts.append(replace(part, name=without_module(part.name), channels=channels, planes=planes))
    return parts
