"""Files of a folder by modules: by patterns of names that the user gives, and files that hold several modules."""

import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from lfssao.errors import InputError
from lfssao.rendering.image_file import ImagePart, Size, read_image_file

Files = str | Sequence[str] | Mapping[str, str]


@dataclass(frozen=True)
class File:
    """A file of a module: the layer that it holds, where its name or the user says so, or whether it holds others."""

    path: Path
    layer: str = ""
    by_user: bool = False
    shared: bool = False

    def parts(self, module: str, names: Sequence[str], sizes: Collection[Size]) -> list[ImagePart]:
        """The parts of one of the modules; one without name, or the only one of a user's file, has the layer's."""
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
