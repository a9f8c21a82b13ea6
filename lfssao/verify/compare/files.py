"""Files of a folder by modules: by patterns of names that the user gives, files of several modules, and quilts."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lfssao.errors import InputError
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.image_file import ImagePart, Size, read_image_file
from lfssao.rendering.quilts import layout_of, place_of

Files = str | Sequence[str] | Mapping[str, str]


@dataclass(frozen=True, eq=False)
class QuiltPicture:
    """A picture of all views of a quilt, side by side."""

    path: Path
    layer: str  # the word that its name begins with
    columns: int
    rows: int
    size: Size  # of a view

    @cached_property
    def _parts(self) -> list[ImagePart]:
        return read_image_file(self.path)

    def parts(self, index: int) -> list[ImagePart]:
        """The parts of one view."""
        place = place_of(index, self.columns, self.rows, self.size)
        return [replace(p, name=self.layer, planes=tuple(plane[place] for plane in p.planes)) for p in self._parts]


@dataclass(frozen=True)
class File:
    """A file of a module: the layer that it holds, where its name or the user says so, or whether it holds others."""

    path: Path
    layer: str = ""
    by_user: bool = False
    shared: bool = False
    quilt: QuiltPicture | None = None

    def parts(self, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
        """The parts of one of the modules; one without name, or the only one of a user's file, has the layer's."""
        if self.quilt is not None:
            return self.quilt.parts(int(module.removeprefix("view_")))
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


def quilts_of(there: Iterable[Path], folder: Path, manifest: Mapping[str, Any] | None) -> list[File]:
    """The pictures of all views, known by their names, where the reference's folder has a quilt.

    InputError if the numbers of a name, or the texels of a picture, are not those of the quilt's views.
    """
    found: list[File] = []
    if manifest is None or manifest.get("quilt") is None:
        return found
    for path in there:
        layout = layout_of(path.stem)
        if layout is None:
            continue
        layer, columns, rows = layout
        with reading_manifest(folder):
            quilt, view = manifest["quilt"], manifest["views"][0]["view"]
            count = int(quilt["columns"]) * int(quilt["rows"])
            numbers = [int(entry["name"].removeprefix("view_")) for entry in manifest["views"]]
            if not 0 <= min(numbers) <= max(numbers) < count:
                raise ValueError(f"views are not those of the quilt: {numbers}")
            width, height = (view[side] - 2 * view["guard"] for side in ("width", "height"))
        if columns * rows != count:
            raise InputError(f"{path}: its name says {columns} x {rows} views, the reference's quilt has {count}")
        size, wanted = read_image_file(path, sizes=[])[0].planes[0].shape[::-1], (columns * width, rows * height)
        if size != wanted:
            texels = ["{}x{}".format(*each) for each in (size, (width, height), wanted)]
            views = f"{columns} x {rows} views of {texels[1]}, as the reference's are, have {texels[2]}"
            raise InputError(f"{path}: it has {texels[0]} texels, but {views}")
        found.append(File(path, layer, quilt=QuiltPicture(path, layer, columns, rows, (width, height))))
    return found


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
