"""The folder of an earlier ``lfssao render``, read back and checked."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.files import read_json
from lfssao.errors import InputError
from lfssao.optics.display import Display, Module
from lfssao.rendering.exr import read_exr
from lfssao.rendering.manifest import FORMAT, MANIFEST, digest


def load_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a folder; InputError if there is none, or it is no JSON file or of another format."""
    path = folder / MANIFEST
    if not path.exists():
        frames = sorted(folder.glob(f"frame_*/{MANIFEST}"))
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


def read_manifest(folder: Path, layer: str) -> tuple[Display, dict[int, dict[str, Any]]]:
    """The display that a folder's textures were rendered for, and the manifest's entry of each of its modules.

    Raises InputError if the manifest is not one of a display, or a module does not have the layer.
    """
    path, manifest = folder / MANIFEST, load_manifest(folder)
    try:
        if manifest["display"] is None:
            raise InputError(f"{path}: it describes a camera's view (--camera), but an eye looks at a display")
        entries = {int(e["name"].removeprefix("module_")): e for e in manifest["views"]}
        display = display_of(manifest["display"], entries)
        _check_layer(path, entries, layer)
        return display, entries
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"{path}: it is not what 'lfssao render' writes ({type(error).__name__}: {error})") from error


def display_of(values: dict[str, Any], entries: dict[int, dict[str, Any]]) -> Display:
    """The display of a manifest, all its numbers, in the resolution of its views.

    ``values`` is the manifest's entry of the display, ``entries`` those of its views by their modules' numbers. Raises
    KeyError, TypeError, ValueError or InputError if one lacks something, or has it in another form.
    """
    lists = {**values, "roi": tuple(tuple(corner) for corner in values["roi"])}
    modules = [{**m, "homography": m["homography"] and tuple(m["homography"])} for m in values["modules"]]
    display = Display(**{**lists, "modules": tuple(Module(**m) for m in modules)})
    if not entries or not set(entries) <= set(range(len(modules))):
        raise ValueError(f"views are not modules of {display.name}: {sorted(entries)}")
    guards = {k: 2 * e["view"].get("guard", 0) for k, e in entries.items()}
    sizes = {k: (e["view"]["width"] - guards[k], e["view"]["height"] - guards[k]) for k, e in entries.items()}
    if any(sizes[k] != (display.modules[k].width, display.modules[k].height) for k in sizes):
        if len(set(sizes.values())) > 1:
            raise ValueError("the sizes of its views are not those of the display's modules")
        display = display.with_resolution(*next(iter(sizes.values())))
    return display


def _check_layer(path: Path, entries: dict[int, dict[str, Any]], layer: str) -> None:
    for entry in entries.values():
        named = {name: t["channels"] for name, t in entry["textures"].items()}
        shown = [name for name, c in named.items() if c[0].endswith("AO") or c[0][-1] == "R"]
        if layer not in shown:
            raise InputError(f"--layer: {path.parent} has no '{layer}' to show: choose one of {', '.join(shown)}")


def read_layer(path: Path, layer: str, described: dict[str, Any]) -> NDArray[np.float32]:
    """A layer of an EXR file without its guard band, (H, W, C) float32; ``described`` is its entry in the manifest.

    Raises InputError if the file cannot be read, lacks the part, or its pixels do not have the digest.
    """
    part = read_exr(path).get(layer)
    names = described["channels"]
    if part is None or not set(names) <= set(part.channels):
        raise InputError(f"{path}: it has no part {layer} with channels {', '.join(names)}")
    pixels = np.ascontiguousarray(part.pixels[..., [part.channels.index(name) for name in names]])
    if digest(pixels) != described["sha256"]:
        raise InputError(f"{path}: its part {layer} is not what manifest.json describes: render the folder again")
    height, width, _ = pixels.shape
    return pixels[part.guard : height - part.guard, part.guard : width - part.guard]
