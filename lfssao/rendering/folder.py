"""The folder of an earlier ``lfssao render``, read back and checked."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError, errors_of
from lfssao.files.exr import read_exr, use_one_thread_a_file
from lfssao.files.whole import read_json
from lfssao.optics.display import Display
from lfssao.optics.display_file import Views, set_of
from lfssao.optics.lenslet import LensletDisplay
from lfssao.optics.quilt import Quilt, StereoPair
from lfssao.optics.view import without_guard
from lfssao.rendering.manifest import FORMAT, MANIFEST, digest, display_of, view_of
from lfssao.rendering.views import chosen_modules

if TYPE_CHECKING:
    from lfssao.rendering.lenslet_viewer import LensletView
    from lfssao.rendering.viewer import LightField


def load_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder; InputError if there is none, or it is no JSON file or of another format."""
    path = folder / MANIFEST
    if not os.path.exists(path):  # Path's raise where a name is too long
        frames = sorted(folder.glob(f"frame_*/{MANIFEST}")) if os.path.isdir(folder) else []
        if frames:
            raise InputError(f"{folder}: it holds frames: choose one, such as {frames[0].parent}")
        raise InputError(f"{path}: there is no such file; 'lfssao render' writes it")
    manifest: dict[str, Any] = read_json(path)
    found = manifest.get("format") if isinstance(manifest, dict) else None
    if found != FORMAT or isinstance(found, bool):
        newer = isinstance(found, int) and found > FORMAT
        what = "a newer version of lfssao wrote it" if newer else f"its format is {found!r:.40}"
        raise InputError(f"{path}: {what}, this version reads format {FORMAT}")
    return manifest


@contextmanager
def reading_manifest(folder: Path) -> Iterator[None]:
    """In the block, turn any error of a wrong manifest into an InputError that names its folder."""
    try:
        yield
    except InputError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        what = f"it has no {error}" if isinstance(error, KeyError) else f"{type(error).__name__}: {error}"
        raise InputError(f"{folder}: its manifest is not what 'lfssao render' writes ({what:.80})") from error


def entries_of(folder: Path, manifest: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the manifest's entry of each view by its name; InputError if one names no file, channel or digest."""
    with reading_manifest(folder):
        entries = {str(entry["name"]): entry for entry in manifest["views"]}
        for entry in entries.values():
            if not Path(entry["file"]).name or "\0" in entry["file"]:
                raise ValueError("a file has no name")
            for described in entry["textures"].values():
                channels = described["channels"]
                names = [*described["channels"], described["sha256"]]
                if not isinstance(channels, list) or not channels or not all(isinstance(n, str) and n for n in names):
                    raise ValueError("a texture has no channels or no digest")
        if not entries or len(entries) != len(manifest["views"]):
            raise ValueError("views without names of their own")
    return entries


def read_views(
    folder: Path, layer: str, modules: Any = None
) -> tuple[Display | Quilt | LensletDisplay, dict[int, dict[str, Any]]]:
    """The display of a folder's textures, and the manifest's entry of each module, which has the layer (InputError).

    Views of a quilt and lenses of a lenslet display are its modules; a stereo pair is a quilt of two views.
    ``modules`` are the numbers of those that are wanted; InputError if the folder has none of them.
    """
    manifest = load_manifest(folder)
    named = entries_of(folder, manifest)
    display: Display | Quilt | LensletDisplay
    with reading_manifest(folder), errors_of(f"{folder}: its manifest"):
        views = set_of(manifest)
        if manifest.get("stereo") is not None:
            eyes = "left", "right"
            entries = {number: named[name] for number, name in enumerate(eyes)}
            left, right = (view_of(name, named[name]["view"]) for name in eyes)
            display = StereoPair.of_views(left, right, float(manifest["stereo"]))
        elif manifest["display"] is None and views is None:
            raise InputError("it describes a camera's view (--camera), but an eye looks at a display or a stereo pair")
        else:
            prefix = "module_" if views is None else f"{views.WORDS[0]}_"
            entries = {int(name.removeprefix(prefix)): entry for name, entry in named.items()}
            display = display_of(manifest["display"], entries) if views is None else _of_views(views, entries)
    entries = {k: entries[k] for k in sorted({*chosen_modules(display, modules)} & {*entries})}
    if not entries:
        raise InputError(f"{folder}: it has none of these modules")
    for entry in entries.values():
        channels = {name: t["channels"] for name, t in entry["textures"].items()}
        shown = [name for name, c in channels.items() if c[0].endswith("AO") or c[0][-1] == "R"]
        if layer not in shown:
            raise InputError(f"{folder}: it has no '{layer}' to show: choose one of {', '.join(shown)}")
    return display, entries


def _of_views(views: Views, entries: dict[int, dict[str, Any]]) -> Views:
    """Return the set of views of a manifest, if its ``entries``, by number, are such; ValueError if they are not."""
    sizes = {tuple(e["view"][k] - 2 * e["view"].get("guard", 0) for k in ("width", "height")) for e in entries.values()}
    if not set(entries) <= set(range(views.count)) or not sizes <= views.sizes:
        raise ValueError(f"{views.WORDS[1]} are not those of {views.name}: {sorted(entries)}")
    return views


def fill(
    field: "LightField | LensletView",
    folder: Path,
    layers: Sequence[str],
    entries: Mapping[int, dict[str, Any]],
    bar: Callable[..., Any] = iter,
) -> None:
    """Give a light field some layers of the textures that it misses; AO as visibility: black where no module reaches.

    ``entries`` are the manifest's of modules or lenses by number. ``bar`` passes on one step a module. InputError if a
    file is not what its entry describes.
    """

    def put(index: int) -> None:
        entry = entries[index]
        path = folder / Path(entry["file"]).name
        described = entry["textures"]
        pixels = [read_layer(path, layer, described[layer]) for layer in layers]
        with errors_of(str(folder / entry["file"])):
            field.put(index, *(1 - each if each.shape[2] == 1 else each for each in pixels))

    use_one_thread_a_file()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(bar(pool.map(put, field.missing)))


def read_layer(path: Path, layer: str, described: dict[str, Any]) -> NDArray[np.float32]:
    """A layer of an EXR file without guard band, (H, W, C) float32; InputError if it is not the described one."""
    return read_layers(path, {layer: described})[layer]


def read_layers(path: Path, described: Mapping[str, dict[str, Any]]) -> dict[str, NDArray[np.float32]]:
    """Return layers of an EXR file as of ``read_layer``, by their names."""
    parts = read_exr(path, list(described))
    found = {}
    for layer, entry in described.items():
        part = parts.get(layer)
        names = entry["channels"]
        if part is None or not set(names) <= set(part.channels):
            raise InputError(f"{path}: it has no part {layer} with channels {', '.join(names)}")
        pixels = np.ascontiguousarray(part.pixels[..., [part.channels.index(name) for name in names]])
        if digest(pixels) != entry["sha256"]:
            raise InputError(f"{path}: its part {layer} is not what manifest.json describes: render the folder again")
        found[layer] = without_guard(pixels, part.guard)
    return found
