"""A small rendered folder and changed copies of it, for the tests of the comparison."""

import os
import shutil
from dataclasses import replace

import numpy as np

from lfssao.cli.main import main
from lfssao.rendering.exr import read_exr, write_exr

COMMAND = ["render", "statue", "--display", "sample-a", "--modules", "3:6", "--resolution", "48x32",
           "--radii", "0.05,4%", "--samples", "6"]  # fmt: skip
MODULES = ["module_003", "module_004", "module_005"]
LAYERS = ["depth", "positions", "color", "ao_1", "ao_2", "merged", "blurred", "shaded"]


def rendered(folder, *words):
    assert main([*COMMAND, *words, "-o", str(folder)]) == 0
    return folder


def copied(source, target):
    """The EXR files alone, as another renderer writes them."""
    target.mkdir()
    for file in sorted(source.glob("*.exr")):
        shutil.copy(file, target)
    return target


def changed(source, target, module, change):
    """A copy in which one module's parts, a dict by name, went through ``change``, which may return others."""
    copied(source, target)
    parts = read_exr(source / f"{module}.exr")
    parts = change(parts) or parts
    write_exr(target / f"{module}.exr", list(parts.values()))
    return target


def with_pixels(part, change):
    """A part whose pixels, a copy, were changed in place."""
    pixels = part.pixels.copy()
    change(pixels)
    return replace(part, pixels=pixels)


def poke(layer, place, value):
    """A change for ``changed``: one texel (row, column) of a layer."""

    def change(parts):
        def set_texel(pixels):
            pixels[place] = value

        parts[layer] = with_pixels(parts[layer], set_texel)

    return change


def nudge(layer, rows=slice(None)):
    """A change for ``changed``: the next float32 above, wherever a layer is positive."""

    def change(parts):
        def up(pixels):
            some = pixels[rows]
            some[...] = np.where(some > 0, np.nextafter(some, np.float32(np.inf)), some)

        parts[layer] = with_pixels(parts[layer], up)

    return change


def compare(*words):
    return main(["compare", *map(os.fspath, words)])
