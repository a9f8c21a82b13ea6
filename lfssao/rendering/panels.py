"""The one texture of a lenslet display's panel, in which each lens's elemental image has its place."""

import os
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.core.memory import check_available
from lfssao.files.exr import Part, read_exr, use_one_thread_a_file, write_exr
from lfssao.optics.lenslet import LensletDisplay
from lfssao.rendering.folder import read_layers
from lfssao.rendering.manifest import PANEL

_OF_A_LENS = {"sha256", "file_sha256", "made_from", "module", "outside", "surface_texels"}  # attributes of its file


def panel_layer(stem: str) -> str | None:
    """The layer in a panel's file by the file's name, such as ``panel_merged``; '' for several, None for no panel."""
    found = re.fullmatch("panel(?:[^A-Za-z0-9](.*))?", stem, re.DOTALL)
    return None if found is None else (found[1] or "")


def write_panel(folder: Path, display: LensletDisplay, entries: Sequence[Mapping[str, Any]]) -> None:
    """Write the panel's EXR file, a part a layer, from the files of all lenses without guard bands.

    ``entries`` are the manifest's, in the order of the lenses. InputError if a file is not what its entry describes, or
    the panel cannot be written.
    """
    files = [folder / Path(entry["file"]).name for entry in entries]
    layers = entries[0]["textures"]
    channels = sum(len(described["channels"]) for described in layers.values())
    check_available(f"{folder / PANEL}: all layers", 8 * display.width * display.height * channels)
    panel = {}
    for name, part in read_exr(files[0]).items():
        pixels = np.empty((display.height, display.width, len(part.channels)), np.float32)
        attributes = {key: value for key, value in part.attributes.items() if key not in _OF_A_LENS}
        panel[name] = Part(name, tuple(layers[name]["channels"]), pixels, attributes)

    def put(index: int) -> None:
        for name, pixels in read_layers(files[index], entries[index]["textures"]).items():
            panel[name].pixels[display.place(index)] = pixels

    use_one_thread_a_file()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(put, range(len(files))))
    write_exr(folder / PANEL, list(panel.values()))
