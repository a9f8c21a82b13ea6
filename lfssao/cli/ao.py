"""``lfssao ao``: AO, merge, blur and shading of another renderer's textures."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.cli import values
from lfssao.cli.job_options import add_ao_options, ao_settings
from lfssao.cli.terminal import printable, working
from lfssao.errors import InputError, check_choice, errors_of
from lfssao.files.exr import write_exr
from lfssao.files.image_file import ImagePart, Margins, Size, guard_of, read_image_file
from lfssao.files.srgb import decode
from lfssao.files.whole import check_folder, output_folder
from lfssao.gbuffer.caster import GBuffer
from lfssao.rendering.conversion import buffers_of
from lfssao.rendering.decoding import Single, upright
from lfssao.rendering.manifest import FORMAT, describe_machine, describe_settings
from lfssao.rendering.output import entry_of, write_manifest
from lfssao.rendering.passes import finish_view
from lfssao.rendering.settings import ASKED, LAYERS
from lfssao.rendering.textures import exr_parts
from lfssao.rendering.view_file import read_description
from lfssao.verify.compare.layers import Layer, Matcher, layers_of

# Layer of each option's file, and its channels.
_TEXTURES = {
    "depth": ("depth", ("Z",)),
    "positions": ("positions", ("P.X", "P.Y", "P.Z")),
    "normals": ("normals", ("N.X", "N.Y", "N.Z")),
    "image": ("color", ("color.R", "color.G", "color.B")),
}
_MAP = """a layer or channel of the files is the layer or channel of an option, as in ViewLayer.Normal=normals; may be
    given several times"""
_LAYERS = f"write only these of {', '.join(LAYERS)} (default: all that there are, but bent)"
_FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}
_WHOLE = ("uint8", "uint16")
_FEW = 6  # channels of a layer that a sentence names
_BUFFERS = """how they were seen and what they hold: a .toml file (see below), a folder that 'lfssao render' wrote, or a
    .json file of a set of cameras in MPEG's axes"""
_CODED = {"depth": "depth_bits", "image": "color_bits"}  # textures that may be whole numbers, and the key of their bits


def add_to(ao: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    ao.description = """Compute the ambient occlusion of another renderer's textures by any estimator, merge, blur and
        shade, and write what 'lfssao render' writes, under the name of the depth's file: a reference for 'lfssao
        compare'. Textures are EXR, TIFF or NPY files, float32 or half; depth and colour may be codes, in PNG too. A
        data window larger than the display window by N on each side has a guard band of N texels, which AO looks into
        and the output has not."""
    ao.set_defaults(run=_ao)
    add = ao.add_argument_group("textures, and how they were seen").add_argument
    add("--depth", **_FILE, required=True, help="the layer depth (Z), or the only one of one channel")
    positions = "the layer positions (P.X P.Y P.Z), or the only one of three channels (default: rebuilt from depth)"
    add("--positions", **_FILE, help=positions)
    add("--normals", **_FILE, help="the layer normals (N.X N.Y N.Z), or the only one of three channels, or of two")
    add("--image", **_FILE, help="linear colour, the layer color or the only one of three channels, to be shaded too")
    add("--map", action="append", default=[], metavar="MINE=LAYER", help=_MAP)
    add("--buffers", **_FILE, required=True, help=_BUFFERS)
    of_view = "the view of such a folder, or the camera of such a set (default: that of the name of the depth's file)"
    add("--view", metavar="NAME", help=of_view)
    several: dict[str, Any] = {"type": lambda text: tuple(map(values.radius, text.split(","))), "metavar": "R,R,..."}
    add = ao.add_argument_group("occlusion, blur and light").add_argument
    add("--radii", **several, required=True, help="radii of the sampling ball, world units")
    add_ao_options(add)
    add = ao.add_argument_group("output").add_argument
    add("--layers", type=lambda text: tuple(text.split(",")), metavar="NAME,...", help=_LAYERS)
    folder = "folder to write to; made if not there (default: out)"
    add("-o", "--output", type=Path, default=Path("out"), metavar="DIR", help=folder)


def _ao(options: argparse.Namespace) -> None:
    given: dict[str, Path] = {name: getattr(options, name) for name in _TEXTURES if getattr(options, name) is not None}
    layers = _layers(options.layers, given)
    kind = "geometric" if "normals" in given else None
    rules = {layer: mine for mine, layer in values.pairs("--map", options.map, "MINE=LAYER", 1)}
    for name in rules:
        with errors_of("--map"):
            check_choice("layer", name, [n for key in given for n in Layer(*_TEXTURES[key], (), None).names])
    if options.light is not None and not {"image", "normals"} <= set(given):
        raise InputError("--light: it lights --image FILE by --normals FILE, give both")
    target = options.output / f"{options.depth.stem}.exr"
    if target.resolve() in [path.resolve() for path in given.values()]:
        raise InputError(f"--output: {target} is an input, give another folder")
    check_folder(options.output)
    depth, margins = _read("depth", options.depth, rules)
    size = depth.shape[::-1]
    guard = guard_of(margins)
    sampling, settings = ao_settings(options, options.radii, {size}, normals=kind, layers=layers)
    description = read_description(options.buffers, options.view or options.depth.stem, (*size, guard))
    textures = {"depth": _numbers("depth", options.depth, depth, description.depth_bits)}
    for name, path in list(given.items())[1:]:
        texture, others = _read(name, path, rules, size, name == "normals" and "octahedral" in description.normals_kind)
        textures[name] = _numbers(name, path, texture, description.color_bits)
        if texture.dtype.kind == "u":
            textures[name] = decode(textures[name])
        if margins is not None and others is not None and others != margins:
            raise InputError(f"--{name}: {path}: its guard band is of {others[0]} texels, that of depth of {guard}")
    buffers = buffers_of(textures, description)
    color = upright(textures, description).get("image")
    surface = np.where(np.isfinite(buffers.depth), 0, -1).astype(np.int32)
    gbuffer = GBuffer(buffers.depth, buffers.positions, color, surface, buffers.normals)
    with working("ao"):
        computed = finish_view(gbuffer, buffers.view, settings)
    with output_folder(options.output):
        parts = exr_parts(computed)
        write_exr(target, parts)
        head = {
            "format": FORMAT,
            "machine": describe_machine(1, options.command),
            "scene": {"name": options.depth.name, "colored": color is not None},
            "display": None,
            "sampling": sampling,
            "settings": describe_settings(settings),
        }
        entry = {
            **entry_of(buffers.view, target, parts, computed.seconds),
            "name": target.stem,
            "rows": description.rows,
        }
        write_manifest(options.output, {**head, "views": [entry]}, settings)
    print(printable(str(target)), flush=True)


def _layers(asked: tuple[str, ...] | None, given: Mapping[str, Path]) -> tuple[str, ...]:
    """Return the layers to write; InputError if one is asked for whose texture is not given."""
    needs = {"color": "image", "shaded": "image", "normals": "normals"}
    missing = {layer: name for layer, name in needs.items() if name not in given}
    for name in asked or ():
        if name in missing:
            raise InputError(f"--layers: {name} needs a texture that is not given: --{missing[name]} FILE")
    return asked or tuple(name for name in LAYERS if name not in (*ASKED, *missing))


def _read(
    option: str, path: Path, rules: Mapping[str, str], size: Size | None = None, octahedral: bool = False
) -> tuple[NDArray[Any], Margins | None]:
    """Return a layer of a file, (H, W) or (H, W, count), and its margins; alpha is left out.

    ``rules`` are names of layers and channels here, each with the file's own. InputError if it is not there, of another
    type, or not of the ``size``.
    """
    name, channels = _TEXTURES[option]
    channels = channels[: 2 if octahedral else None]
    with errors_of(f"--{option}"):
        formats = ("openexr", "tiff", *(["png"] if option in _CODED else []))
        parts = read_image_file(path, formats, sizes=None if size is None else [size])
        with errors_of(str(path)):
            layer = _layer(parts, Layer(name, channels, (), None), rules)
            planes = layer.planes
            if size is not None and planes[0].shape[::-1] != size:
                given, wanted = ("{}x{}".format(*each) for each in (planes[0].shape[::-1], size))
                raise InputError(f"it has {given} texels, depth has {wanted}")
            if {str(plane.dtype) for plane in planes} - {"float16", "float32", *(_WHOLE if option in _CODED else ())}:
                raise InputError(f"it is of {planes[0].dtype}, expected float32 or half")
            guard_of(layer.margins)
    texture = np.stack(planes, axis=-1)
    return texture[..., 0] if len(channels) == 1 else texture, layer.margins


def _numbers(option: str, path: Path, texture: NDArray[Any], bits: int | None) -> Single:
    """Return a texture as float32; InputError for codes whose bits are not given, or that have more."""
    if texture.dtype.kind == "f":
        return texture.astype(np.float32)
    if bits is None:
        wanted = f"expected float32 or half, or {_CODED[option]} in the file of --buffers"
        raise InputError(f"--{option}: {path}: it is of {texture.dtype}, {wanted}")
    if (most := int(texture.max())) >= 2**bits:
        raise InputError(f"--{option}: {path}: it has a code {most}, which {bits} bits do not hold")
    return texture.astype(np.float32) / np.float32(2**bits - 1)


def _layer(parts: Sequence[ImagePart], wanted: Layer, rules: Mapping[str, str]) -> Layer:
    """Return the layer that a rule names, else that of the name, else the only one of as many channels (InputError)."""
    count = len(wanted.channels)
    opaque = [_without_alpha(layer) for layer in layers_of(parts)]
    if not rules.keys().isdisjoint(wanted.names):
        named = [ImagePart(each.name, each.channels, each.planes, each.margins) for each in opaque]
        matcher = Matcher(named, [wanted], rules)
        found = matcher.find(wanted)
        if found is None:
            raise InputError(matcher.why_missing(wanted))
        return found
    fitting = [layer for layer in opaque if layer.name == wanted.name] or [
        layer for layer in opaque if len(layer.channels) == count
    ]
    if len(fitting) != 1 or len(fitting[0].channels) != count:
        held = "; ".join(f"{layer.name} of {', '.join(layer.channels[:_FEW])}" for layer in opaque)
        rule = f"; name one by --map, such as --map {fitting[0].name}={wanted.name}" if len(fitting) > 1 else ""
        one = f"expected a layer {wanted.name} or just one of {count} channel{'s' * (count > 1)}"
        raise InputError(f"{one}, it holds {held}{rule}")
    return fitting[0]


def _without_alpha(layer: Layer) -> Layer:
    """Return the layer without the fourth channel if that is A."""
    count = 3 if [c.rpartition(".")[2] for c in layer.channels[3:]] == ["A"] else None
    return replace(layer, channels=layer.channels[:count], planes=layer.planes[:count])
