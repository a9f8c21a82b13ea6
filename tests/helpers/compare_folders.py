"""A small rendered folder and changed copies of it, for the tests of the comparison."""

import os
import shutil
from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
from exr_parts import write_parts
from jobs import edit, render

from lfssao.cli.main import main
from lfssao.files.exr import read_exr, write_exr
from lfssao.verify.verdict import Verdict

COMMAND = ["statue", "--display", "sample-a", "--modules", "3:6", "--resolution", "48x32",
           "--radii", "0.05,4%", "--samples", "6"]  # fmt: skip
MODULES = ["module_003", "module_004", "module_005"]
LAYERS = ["depth", "positions", "color", "ao_1", "ao_2", "merged", "blurred", "shaded"]


def rendered(folder, *words):
    return render(folder, *COMMAND, *words)


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


def remade(layer, make):
    """A change for ``changed``: other pixels of a layer, made from its own."""

    def change(parts):
        parts[layer] = replace(parts[layer], pixels=make(parts[layer].pixels))

    return change


def poke(layer, place, value):
    """A change for ``changed``: texels of a layer, one at (row, column) or several at (rows, columns)."""

    def make(pixels):
        pixels = pixels.copy()
        pixels[place] = value
        return pixels

    return remade(layer, make)


def with_a_wrong_code(source, target):
    """A copy in which merged AO of module_004 is in codes of 8 bits, one wrong by ten.

    Returns the copy, the texel, (column, row), the reference's value, which is none of a code, and its code.
    """
    changed(source, target, "module_004", lambda parts: {name: p for name, p in parts.items() if name != "merged"})
    merged = single(source, "module_004", "merged")[..., 0]
    codes = np.rint(merged * 255).astype(np.uint8)
    row, column = (k.item() for k in np.argwhere((codes > 20) & (codes < 200) & (codes / np.float32(255) != merged))[0])
    code = codes[row, column].item()
    codes[row, column] += 10
    np.save(target / "module_004_merged.npy", codes)
    return target, (column, row), merged[row, column].item(), code


def nudge(layer):
    """A change for ``changed``: the next float32 above, wherever a layer is positive."""
    return remade(layer, lambda pixels: np.where(pixels > 0, np.nextafter(pixels, np.float32(np.inf)), pixels))


def compare(*words):
    return main(["compare", *map(os.fspath, words)])


def verdicts(report):
    return {(r.module, r.layer): r.verdict for r in report.results}


def different(report):
    return {key: verdict for key, verdict in verdicts(report).items() if verdict is not Verdict.EQUAL_BITS}


def ordered(part):
    """A part with channels R G B and X Y Z in that order."""
    order = sorted(range(len(part.channels)), key=lambda k: "RGBXYZ".find(part.channels[k][-1]))
    pixels = np.ascontiguousarray(part.pixels[..., order])
    return replace(part, channels=tuple(part.channels[k] for k in order), pixels=pixels)


def single(reference, module, layer):
    """(H, W, C), channels R G B and X Y Z in that order."""
    return ordered(read_exr(reference / f"{module}.exr")[layer]).pixels


def write_image(path, pixels, dtype="float"):
    write_parts(path, [(oiio.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], dtype), pixels)])


def with_entry(reference, target, place, value):
    """A copy of a rendered folder whose manifest has another value at a place, a path of keys."""
    edit(shutil.copytree(reference, target), *place, value=value)
    return target


def without_scene(reference, target):
    """The same folder of a mesh file that is not at hand."""
    return with_entry(reference, target, ("scene", "name"), "mine.obj")
