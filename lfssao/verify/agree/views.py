"""The views of folders that ``lfssao render`` wrote, each with its positions and a layer of its occlusion."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from lfssao.core.memory import check_available
from lfssao.errors import InputError, errors_of
from lfssao.optics.view import View, without_guard
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.manifest import view_of
from lfssao.verify.case import IMAGES, Case
from lfssao.verify.compare.files import Files
from lfssao.verify.compare.layers import Layer, Matcher, Storage, is_occlusion
from lfssao.verify.compare.result import Tolerance
from lfssao.verify.compare.source import Mine, Reference
from lfssao.verify.compare.view_case import view_case

if TYPE_CHECKING:
    from lfssao.verify.compare.comparison import Comparison
    from lfssao.verify.compare.diagnoser import Views

# Settings that do not change occlusion
_IRRELEVANT_SETTINGS = ("layers", "caster", "color_filter", "normals", "blur_sigma", "blur_weights")


@dataclass(frozen=True, eq=False)
class RenderedView:
    """One view of a folder."""

    folder: "Folder"
    name: str
    view: View
    layers: Sequence[Layer]  # all layers of the file
    arrays: dict[str, NDArray[Any]]  # positions, (H, W, 3), and the layer, (H, W), by name, without guard bands

    @property
    def entry(self) -> dict[str, Any]:
        """Its entry in the manifest."""
        return self.folder.reference.entries[self.name]

    @property
    def key(self) -> tuple[str, str]:
        """A key that sorts views: name, numbers and digests."""
        return self.name, json.dumps([self.entry["view"], self.entry["textures"]], sort_keys=True)


class Folder:
    """A folder that ``lfssao render`` wrote, or one of its files; InputError if it is another, or lacks the layer."""

    def __init__(self, path: Path, layer: str) -> None:
        self.path = path
        self.layer = layer
        self.reference = Reference.open(path)
        if self.reference.manifest is None:
            raise InputError(f"{path}: it is not what 'lfssao render' writes, its views are not known")
        self.manifest = self.reference.manifest
        if not is_occlusion(layer):
            raise InputError(f"--layer: '{layer:.40}' is none of occlusion, such as ao_1, merged or blurred")
        for entry in self.reference.entries.values():
            names = list(entry["textures"])
            if layer not in names:
                raise InputError(f"--layer: {path} has no '{layer:.40}': choose one of {', '.join(names)}")
            if "positions" not in names:
                raise InputError(f"{path}: it has no layer positions, by which views are matched")

    def names(self, chosen: range | None) -> list[str]:
        """Names of the views with a chosen number, all for None; names without a number are always included."""
        found = {name: re.search(r"[0-9]+$", name) for name in self.reference.files}
        return [name for name, number in found.items() if chosen is None or not number or int(number[0]) in chosen]

    @cached_property
    def scene(self) -> tuple[Any, ...]:
        """Digests of the mesh, and its place; equal for folders of one scene."""
        with reading_manifest(self.path):
            scene = self.manifest["scene"]
            frame = self.manifest.get("frame")
            place = None if frame is None else frame["world_from_scene"]
            return scene.get("vertices_sha256"), scene.get("faces_sha256"), place

    @cached_property
    def settings(self) -> dict[str, Any]:
        """The settings that occlusion depends on."""
        with reading_manifest(self.path):
            return {
                name: value for name, value in self.manifest["settings"].items() if name not in _IRRELEVANT_SETTINGS
            }

    def read(self, name: str) -> RenderedView:
        """Read one view; InputError if its file does not match the manifest."""
        layers, case = self.reference.read(name, Case(name, IMAGES, "", {}, {}, {}))
        with reading_manifest(self.path), errors_of(str(self.path)):
            view = view_of(name, self.reference.entries[name]["view"])
            size = (view.height - 2 * view.guard, view.width - 2 * view.guard)
            positions = without_guard(case.outputs["positions"], view.guard)
            ao = case.outputs[self.layer]
            if positions.shape != (*size, 3) or ao.shape != size:
                raise ValueError(f"textures of {name} are not of its view's size")
        return RenderedView(self, name, view, layers, {"positions": positions, self.layer: ao})


def open_folders(paths: Sequence[Path], layer: str) -> list[Folder]:
    """Open folders; InputError if their scenes or their settings of occlusion differ."""
    first, *others = folders = [Folder(path, layer) for path in paths]
    for other in others:
        if other.scene != first.scene:
            raise InputError(f"{first.path} and {other.path} are of two scenes")
        for name in first.settings.keys() | other.settings.keys():
            if first.settings.get(name) != other.settings.get(name):
                raise InputError(f"{first.path} and {other.path} are rendered with other {name}")
    return folders


def read_views(folders: Sequence[Folder], chosen: range | None) -> list[RenderedView]:
    """Read the views of all folders, in an order independent of the folders'; InputError for fewer than two."""
    names = [(folder, name) for folder in folders for name in folder.names(chosen)]
    files = [folder.reference.files[name].resolve() for folder, name in names]
    if len(set(files)) < len(files):
        raise InputError("a view is given twice")
    if len(names) < 2:
        raise InputError(f"there {'is one view' if names else 'are no views'}: two are needed to agree")
    texels = 0
    for folder, name in names:
        with reading_manifest(folder.path):
            view = folder.reference.entries[name]["view"]
            texels += int(view["width"]) * int(view["height"])
    check_available("textures of all views", texels * 64)
    return sorted((folder.read(name) for folder, name in names), key=lambda seen: seen.key)


def occlusion_case(rendered: RenderedView) -> tuple[Case, float | None]:
    """The case of a view's occlusion, and the layer's radius, world units; None if the layer has several radii.

    InputError if the manifest is incomplete, or the estimator is a user's file that was not read.
    """
    folder = rendered.folder
    case = view_case(folder.path, folder.manifest, rendered.entry)
    radii = {f"ao_{k}": radius for k, radius in enumerate(case.parameters["radii"], start=1)}
    return case, radii.get(folder.layer)


class Renderer:
    """Another renderer's folders or files, one for each of the reference's folders, or one for all.

    Rules and files are those of ``lfssao.compare``. InputError if a path does not exist, or if their number is wrong.
    """

    def __init__(
        self, paths: Sequence[Path], folders: Sequence[Folder], rules: Mapping[str, str], files: Files = ()
    ) -> None:
        if len(paths) not in (1, len(folders)):
            raise InputError(f"--mine: {len(paths)} are given, it must be one for all FOLDERs, or one for each of them")
        self._rules = rules
        self._files = files
        self._storage = Storage({}, rules)
        paths_of_folders = paths if len(paths) > 1 else list(paths) * len(folders)
        sides = [Mine.open(path, own.reference, files) for path, own in zip(paths_of_folders, folders, strict=True)]
        self._mine = dict(zip(folders, sides, strict=True))

    def comparison(self, folder: Folder, layers: Sequence[str], mesh: str | None, other_views: "Views") -> "Comparison":
        """A comparison of its textures with a folder's in some layers; ``other_views`` are those of other folders."""
        from lfssao.verify.compare.comparison import Comparison  # late: it imports what judges and diagnoses

        options = self._rules, layers, False, "shader", None, Tolerance()
        path = self._mine[folder].path
        return Comparison(path, folder.path, *options, mesh=mesh, files=self._files, other_views=other_views)

    def read(self, rendered: RenderedView) -> NDArray[Any]:
        """Read the renderer's texture of a view, (H, W); InputError if it is missing or of another size or type."""
        side = self._mine[rendered.folder]
        name = rendered.folder.layer
        expected = next(layer for layer in rendered.layers if layer.name == name)
        with errors_of(f"{side.path}: {name} of {rendered.name}"):
            sizes = {layer.planes[0].shape[1::-1] for layer in rendered.layers}
            parts = side.parts(rendered.name, sizes, rendered.entry.get("rows") == "below")
            matcher = Matcher(parts, rendered.layers, self._storage.rules)
            layer = matcher.matched(expected, self._storage)
            if layer is None:
                raise InputError(matcher.why_missing(expected) if parts else "there is no file of this view")
            return layer.texture
