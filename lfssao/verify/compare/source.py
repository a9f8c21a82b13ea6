"""The two sides of a comparison: the files of each module, and their description in the reference's manifest."""

import os
import re
from collections.abc import Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.errors import InputError
from lfssao.files.image_file import ENDINGS, ImagePart, Size, part_of, read_image_file
from lfssao.files.whole import check_file
from lfssao.rendering.folder import entries_of, load_manifest
from lfssao.rendering.manifest import MANIFEST, digest
from lfssao.rendering.panels import panel_layer
from lfssao.verify.case import IMAGES, Case
from lfssao.verify.compare.files import File, Files, holds_modules, is_mosaic, match_files, module_of, mosaics_of
from lfssao.verify.compare.layers import Layer, layers_of
from lfssao.verify.compare.view_case import view_case
from lfssao.verify.kit.folder import read_case, read_index


@dataclass(frozen=True)
class Reference:
    """A folder of 'lfssao render', a kit of 'lfssao kit' or one of its cases, any folder of images, or one image."""

    path: Path
    files: dict[str, Path]  # each module's file by the module's name; for a kit each case's folder
    manifest: dict[str, Any] | None  # by ``lfssao render``
    entries: dict[str, dict[str, Any]]  # the manifest's entry of each module, by the module's name
    kit: bool = False  # whether it is a kit or a case of one; the modules are then cases

    @classmethod
    def open(cls, path: Path) -> "Reference":
        """Find the files; InputError if there are none, or if a manifest is wrong."""
        if not os.path.exists(path):  # Path.exists raises where a name is too long
            raise InputError(f"{path}: there is no such file or folder")
        folder = path if path.is_dir() else path.parent
        if folder != path:
            check_file(path)
        if (path / "kit.json").is_file():
            cases = {entry["name"]: path / entry["folder"] for entry in read_index(path)}
            return cls(path, cases, None, {}, kit=True)
        if (path / "case.json").is_file():
            return cls(path, {path.resolve().name: path}, None, {}, kit=True)
        if not (folder / MANIFEST).is_file():
            files = {file.stem: file for file in _images(path)}
            if not files:
                raise InputError(f"{path}: there is no image ({', '.join(ENDINGS)}) in it")
            return cls(path, files, None, {})
        manifest = load_manifest(folder)
        entries = entries_of(folder, manifest)
        files = {name: folder / Path(entry["file"]).name for name, entry in entries.items()}
        if path == folder or (manifest.get("lenslet") is not None and panel_layer(path.stem) is not None):
            return cls(folder, files, manifest, entries)
        own = {name: entries[name] for name, file in files.items() if file.name == path.name}
        if not own:  # a file next to a manifest that does not list it
            return cls(path, {path.stem: path}, None, {})
        return cls(path, {name: path for name in own}, manifest, own)

    def chosen(self, cases: Sequence[str] | None) -> list[str]:
        """Names of all modules, or of the chosen cases of a kit; InputError if a name is no case's."""
        for name in cases or ():
            if not self.kit or name not in self.files:
                raise InputError(f"--cases: '{name[:40]}' is no case of a kit in {self.path}")
        return [name for name in self.files if cases is None or name in cases]

    def described(self, module: str) -> Case:
        """The case of a module in the manifest, without outputs, or a case of images; InputError if incomplete."""
        if self.manifest is None:
            return Case(module, IMAGES, "", {}, {}, {})
        return view_case(self.path, self.manifest, self.entries[module])

    def read(self, module: str, described: Case) -> tuple[list[Layer], Case]:
        """Layers of a module by stage, and its case with outputs; InputError if files do not match the manifest."""
        if self.kit:
            case = read_case(self.files[module])
            main, *steps = case.outputs
            parts = {name: part_of(case.outputs[name]) for name in (*steps, main)}
            return [Layer(name, part.channels, part.planes, None) for name, part in parts.items()], case
        layers = layers_of(read_image_file(self.files[module]))
        if module in self.entries:
            _check_digests(self.files[module], layers, self.entries[module]["textures"])
        return layers, replace(described, outputs={layer.name: layer.texture for layer in layers})


def _images(path: Path) -> list[Path]:
    """Image files of a folder, sorted, or the file itself."""
    if path.is_file():
        return [path]
    try:
        paths = sorted(path.iterdir())
    except OSError as error:
        raise InputError(f"{path}: the folder cannot be read ({error.strerror})") from error
    return [
        file for file in paths if file.suffix.lower() in ENDINGS and not file.name.startswith(".") and file.is_file()
    ]


def _check_digests(path: Path, layers: list[Layer], described: dict[str, Any]) -> None:
    layers_by_name = {layer.name: layer for layer in layers}
    for name, entry in described.items():
        layer = layers_by_name.get(name)
        if layer is None or sorted(layer.channels) != sorted(entry["channels"]):
            raise InputError(f"{path}: it lacks the part {name} that manifest.json describes")
        pixels = np.stack([layer.planes[layer.channels.index(channel)] for channel in entry["channels"]], axis=-1)
        if digest(pixels) != entry["sha256"]:
            raise InputError(f"{path}: its part {name} is not what manifest.json describes: render the folder again")


Side = tuple[list[Layer], Case, list[ImagePart]]


@dataclass(frozen=True)
class Mine:
    """The other renderer's folder or file, its files by modules of the reference."""

    path: Path
    files: dict[str, list[File]]
    extra: tuple[str, ...]  # files of modules that the reference lacks, by their names

    @classmethod
    def open(cls, path: Path, reference: Reference, patterns: Files = ()) -> "Mine":
        """Find the files of the reference's modules.

        Patterns come first. ``module_003.exr`` holds a module; ``module_003_merged.tif``, or with '.' or '-', holds one
        of its layers. An EXR file of another name may have parts or channels ``module_003.merged`` of all modules. The
        picture ``merged_qs8x6a0.75.png`` holds a layer of all views of a quilt that have no other file, as
        ``panel.exr`` and ``panel_merged.tif`` do for all lenses. InputError if the path does not exist, if no file
        matches a pattern, or if one path is a file and the other a folder.
        """
        if not os.path.exists(path):
            raise InputError(f"{path}: there is no such file or folder")
        names = list(reference.files)
        holds_several = not path.is_dir() and (holds_modules(path, names) or is_mosaic(path))
        if path.is_dir() != reference.path.is_dir() and not holds_several:
            kinds = ["a folder" if p.is_dir() else "a file" for p in (path, reference.path)]
            raise InputError(f"{path} is {kinds[0]} and {reference.path} is {kinds[1]}: compare like with like")
        if not reference.path.is_dir() and not patterns:
            return cls(path, {names[0]: [File(path)]}, ())
        paths = _images(path)
        files, matched = match_files(paths, patterns, names)
        others = []
        named = set()
        for file in paths:
            module = module_of(file.stem, names) if path.is_dir() else None
            if module is not None and file not in matched:
                files[module].append(File(file, file.stem[len(module) + 1 :]))
                named.add(module)
            elif not any(file == own.path for found in files.values() for own in found):
                others.append(file)
        if reference.kit and len(names) == 1 and not any(files.values()):  # the outputs of a case by their names
            return cls(path, {names[0]: [File(file, file.stem) for file in others]}, ())
        unnamed = [name for name in names if name not in named]
        patterns_of_names = set(map(_name_pattern, names))
        shared = [file for file in others if holds_modules(file, unnamed)]
        mosaics = mosaics_of(others, reference.path, reference.manifest) if unnamed else []
        for name in unnamed:
            files[name] += [*(File(file, shared=True) for file in shared), *mosaics]
        unmatched = [
            f
            for f in others
            if reference.manifest is None or f in matched or _name_pattern(f.stem) in patterns_of_names
        ]
        return cls(path, files, tuple(f.name for f in unmatched if f not in shared))

    def parts(self, module: str, sizes: Collection[Size], upwards: bool = False) -> list[ImagePart]:
        """All parts of a module's files; InputError if a file cannot be read.

        Parts of other sizes than ``sizes`` are not decoded. With ``upwards``, row 0 is the lowest.
        """
        parts = [part for file in self.files[module] for part in file.parts(module, list(self.files), sizes)]
        return [replace(part, planes=tuple(p[:: -1 if upwards else 1] for p in part.planes)) for part in parts]


class Sides:
    """Both sides of the modules in order; each module is read while the one before is compared."""

    def __init__(self, reference: Reference, mine: Mine, modules: Sequence[str]) -> None:
        self._reference = reference
        self._mine = mine
        self._modules = list(modules)
        self._reader = ThreadPoolExecutor(1)
        self._ahead: dict[str, Future[Side]] = {}

    def read(self, module: str, described: Case) -> Side:
        """The reference's layers of a module, its case, and the other renderer's parts; InputError of either side."""
        ahead = self._ahead.pop(module, None)
        side = self._side(module, described) if ahead is None else ahead.result()
        for later in self._modules[self._modules.index(module) + 1 :][:1]:
            self._ahead[later] = self._reader.submit(self._side, later)
        return side

    def _side(self, module: str, described: Case | None = None) -> Side:
        layers, case = self._reference.read(module, described or self._reference.described(module))
        below = self._reference.entries.get(module, {}).get("rows") == "below"
        sizes = {layer.planes[0].shape[1::-1] for layer in layers}
        return layers, case, self._mine.parts(module, sizes, below)


def _name_pattern(name: str) -> str:
    """A name without its number, the same for all modules of a job."""
    return re.sub(r"[0-9]+", "#", name)
