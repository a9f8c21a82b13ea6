"""``lfssao ao``: AO, merge, blur and shading of the textures of somebody's own renderer."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.cli import values
from lfssao.cli.job_options import add_ao_options, ao_settings
from lfssao.cli.terminal import printable, working
from lfssao.core.files import check_folder, output_folder
from lfssao.errors import InputError
from lfssao.gbuffer.caster import GBuffer
from lfssao.rendering.conversion import Single, buffers_of, upright
from lfssao.rendering.exr import write_exr
from lfssao.rendering.image_file import read_image_file
from lfssao.rendering.manifest import FORMAT, describe_machine, describe_settings
from lfssao.rendering.output import entry_of, exr_parts, write_manifest
from lfssao.rendering.passes import finish_view
from lfssao.rendering.settings import LAYERS
from lfssao.rendering.view_file import read_description
from lfssao.verify.compare.layers import layers_of

# Layer of each option's file, and its number of channels.
_TEXTURES = {"depth": ("depth", 1), "positions": ("positions", 3), "normals": ("normals", 3), "image": ("color", 3)}
_FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}
_BUFFERS = "how they were seen and what they hold: a .toml file (see below), or a folder that 'lfssao render' wrote"


def add_to(ao: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    ao.description = """Compute the ambient occlusion of another renderer's textures by any estimator, merge, blur and
        shade, and write what 'lfssao render' writes, under the name of the depth's file: a reference for 'lfssao
        compare'. Textures are EXR, TIFF or NPY files, float32 or half. A data window that begins at (-N, -N) has a
        guard band of N texels, which AO looks into and the output has not."""
    ao.set_defaults(run=_ao)
    add = ao.add_argument
    add("--depth", **_FILE, required=True, help="the layer depth (Z), or the only one of one channel")
    positions = "the layer positions (P.X P.Y P.Z), or the only one of three channels (default: rebuilt from depth)"
    add("--positions", **_FILE, help=positions)
    add("--normals", **_FILE, help="the layer normals (N.X N.Y N.Z), or the only one of three channels, or of two")
    add("--image", **_FILE, help="linear colour, the layer color or the only one of three channels, to be shaded too")
    add("--buffers", **_FILE, required=True, help=_BUFFERS)
    add("--view", metavar="NAME", help="the view of such a folder (default: that of the name of the depth's file)")
    several: dict[str, Any] = {"type": lambda text: tuple(map(values.radius, text.split(","))), "metavar": "R,R,..."}
    add("--radii", **several, required=True, help="radii of the sampling ball, world units")
    add_ao_options(ao)
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write to; made if not there")


def _ao(options: argparse.Namespace) -> None:
    given: dict[str, Path] = {name: getattr(options, name) for name in _TEXTURES if getattr(options, name) is not None}
    left_out = {"color", "shaded"} if "image" not in given else set()
    layers = tuple(name for name in LAYERS if name not in left_out)
    kind = "geometric" if "normals" in given else None
    sampling, settings = ao_settings(options, options.radii, normals=kind, layers=layers)
    target = options.output / f"{options.depth.stem}.exr"
    if target.resolve() in [path.resolve() for path in given.values()]:
        raise InputError(f"--output: {target} is an input, give another folder")
    check_folder(options.output)
    depth, guard = _read("depth", options.depth)
    size = depth.shape[1], depth.shape[0], guard
    said = read_description(options.buffers, options.view or options.depth.stem, size)
    textures = {"depth": depth}
    for name, path in list(given.items())[1:]:
        textures[name], _ = _read(name, path, 2 if name == "normals" and "octahedral" in said.normals_kind else None)
        if textures[name].shape[:2] != depth.shape:
            shape, wanted = (f"{t.shape[1]}x{t.shape[0]}" for t in (textures[name], depth))
            raise InputError(f"--{name}: {path} has {shape} texels, depth has {wanted}")
    buffers = buffers_of(textures, said)
    color = upright(textures, said).get("image")
    surface = np.where(np.isfinite(buffers.depth), 0, -1).astype(np.int32)
    gbuffer = GBuffer(buffers.depth, buffers.positions, color, surface, buffers.normals)
    with working("ao"):
        made = finish_view(gbuffer, buffers.view, settings)
    with output_folder(options.output):
        parts = exr_parts(made)
        write_exr(target, parts)
        head = {
            "format": FORMAT,
            "machine": describe_machine(1, options.command),
            "scene": {"name": options.depth.name, "colored": color is not None},
            "display": None,
            "sampling": sampling,
            "settings": describe_settings(settings),
        }
        entry = {**entry_of(buffers.view, target, parts, made.seconds), "name": target.stem, "rows": said.rows}
        write_manifest(options.output, {**head, "views": [entry]}, settings)
    print(printable(str(target)), flush=True)


def _read(option: str, path: Path, channels: int | None = None) -> tuple[Single, int]:
    """A layer of a file, (H, W) or (H, W, count), and the width of its guard band; alpha is left out."""
    name, count = _TEXTURES[option][0], channels or _TEXTURES[option][1]
    found = layers_of(read_image_file(path))
    layers = {layer: len(layer.channels) - (layer.channels[3:] in (("A",), (f"{layer.name}.A",))) for layer in found}
    fitting = [layer for layer in layers if layer.name == name] or [each for each, n in layers.items() if n == count]
    if len(fitting) != 1 or layers[fitting[0]] != count:
        held = "; ".join(f"{layer.name} of {', '.join(layer.channels)}" for layer in layers)
        wanted = f"expected a layer {name} or just one of {count} channels"
        raise InputError(f"--{option}: {path}: {wanted}, it holds {held}")
    planes, (x, y) = fitting[0].planes[:count], fitting[0].origin or (0, 0)
    if {str(plane.dtype) for plane in planes} - {"float16", "float32"}:
        raise InputError(f"--{option}: {path}: it is of {planes[0].dtype}, expected float32 or half")
    if x != y or x > 0 or -2 * x >= min(planes[0].shape):
        reason = f"its data window begins at ({x}, {y}), expected (0, 0), or (-N, -N) for a guard band"
        raise InputError(f"--{option}: {path}: {reason}")
    texture = np.stack(planes, axis=-1).astype(np.float32)
    return texture[..., 0] if count == 1 else texture, -x
