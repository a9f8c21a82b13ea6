"""``lfssao ao``: AO, merge, blur and shading of the textures of somebody's own renderer."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.ssao import algorithm1, algorithm2
from lfssao.ao.textures import check_fit
from lfssao.cli import estimators, values
from lfssao.cli.terminal import printable, progress
from lfssao.core.affine import Matrix
from lfssao.core.files import check_folder, output_folder
from lfssao.errors import InputError
from lfssao.optics.view import WorldToImage
from lfssao.rendering.exr import Part, write_exr
from lfssao.rendering.image_file import read_image_file
from lfssao.rendering.view_file import read_mapping
from lfssao.rendering.output import occlusion_part
from lfssao.rendering.passes import FloatTexture, turns_for
from lfssao.rendering.settings import Settings
from lfssao.verify.compare.layers import layers_of

_FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}
_MAPPING = (
    "the mapping world -> image: a .toml file with kind = 'matrix', 'crossed slits' or 'display' and the arguments of "
    "lfssao.WorldToImage.matrix, .crossed_slits or .display, or a folder that 'lfssao render' wrote"
)
_METHODS = "any method of the ball that 'lfssao samples make' lists (default: latin)"


def add_to(ao: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    ao.description = (
        "Compute LF's ambient occlusion of another renderer's textures, merge, blur and shade, and write an EXR file "
        "with the parts of 'lfssao render' under the name of the depth's. Textures are EXR, TIFF or NPY files, float32 "
        "or half; where there is no surface, depth is +infinity. A data window that begins at (-N, -N) has a guard "
        "band of N texels, which AO looks into and the output has not."
    )
    ao.set_defaults(run=_ao)
    add = ao.add_argument
    add("--depth", **_FILE, required=True, help="image z: the layer depth (Z), or the only one of one channel")
    positions = "world coordinates: the layer positions (P.X P.Y P.Z), or the only one of three channels; without them "
    add("--positions", **_FILE, help=f"{positions}AO is Algorithm 1, which needs a matrix")
    add("--image", **_FILE, help="linear colour, the layer color or the only one of three channels, to be shaded too")
    add("--mapping", **_FILE, required=True, help=_MAPPING)
    add("--view", metavar="NAME", help="the view of such a folder (default: that of the name of the depth's file)")
    add("--radii", type=_radii, required=True, metavar="R,R,...", help="radii of the sampling ball, world units")
    add("--samples", type=values.samples, metavar="N", help="samples of each texel and radius (default: 8)")
    add("--sampling", metavar="NAME", help=_METHODS)
    add("--seed", type=values.seed, metavar="N", help="seed of the samples, 0 to 2**64 - 1 (default: 0)")
    estimators.add_rotation(add, "hash")
    add("--blur", type=values.blur, default=1.0, metavar="SIGMA", help="sigma, texels; 0: none (default: 1)")
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write to; made if not there")


def _radii(text: str) -> tuple[float, ...]:
    return tuple(map(values.radius, text.split(",")))


def _ao(options: argparse.Namespace) -> None:
    """Check the options, read, compute, write."""
    wanted = options.sampling, options.samples, options.seed
    _, samples, _ = estimators.read_samples(find_estimator("lf"), *wanted)
    rotation = estimators.read_rotation(options)
    settings = Settings(options.radii, samples, options.blur, rotation=rotation, rotation_seed=options.seed or 0)
    target = options.output / f"{options.depth.stem}.exr"
    if target.resolve() in [path.resolve() for path in (options.depth, options.positions, options.image) if path]:
        raise InputError(f"--output: {target} is an input, give another folder")
    check_folder(options.output)
    mapping, back = read_mapping(options.mapping, options.view or options.depth.stem)
    if options.positions is None and back is None:
        raise InputError(f"--positions: they are missing, and the mapping of {options.mapping} is not a matrix")
    depth, guard = _read("--depth", options.depth, "depth", 1)
    read = {"--depth": depth}
    for option, path, layer in (("--positions", options.positions, "positions"), ("--image", options.image, "color")):
        if path is not None:
            read[option], _ = _read(option, path, layer, 3)
            check_fit(option, read[option], depth, 3)
    for option, texture in read.items():
        if not np.isfinite(texture[depth != np.inf]).all():
            raise InputError(f"{option}: a number is not finite where there is a surface")
    inside = slice(guard, -guard or None)
    with output_folder(options.output):
        parts = _parts(read, mapping, back, settings)
        write_exr(target, [replace(part, pixels=part.pixels[inside, inside]) for part in parts])
    print(printable(str(target)), flush=True)


def _read(option: str, path: Path, name: str, count: int) -> tuple[FloatTexture, int]:
    """A layer of a file, (H, W) or (H, W, count), and the width of its guard band; alpha is left out."""
    found = layers_of(read_image_file(path))
    layers = {layer: len(layer.channels) - (layer.channels[3:] in (("A",), (f"{layer.name}.A",))) for layer in found}
    fitting = [layer for layer in layers if layer.name == name] or [each for each, n in layers.items() if n == count]
    if len(fitting) != 1 or layers[fitting[0]] != count:
        held = "; ".join(f"{layer.name} of {', '.join(layer.channels)}" for layer in layers)
        raise InputError(f"{option}: {path}: expected a layer {name} or just one of {count} channels, it holds {held}")
    planes, (x, y) = fitting[0].planes[:count], fitting[0].origin or (0, 0)
    if {str(plane.dtype) for plane in planes} - {"float16", "float32"}:
        raise InputError(f"{option}: {path}: it is of {planes[0].dtype}, expected float32 or half")
    if x != y or x > 0 or -2 * x >= min(planes[0].shape):
        reason = f"its data window begins at ({x}, {y}), expected (0, 0), or (-N, -N) for a guard band"
        raise InputError(f"{option}: {path}: {reason}")
    texture = np.stack(planes, axis=-1).astype(np.float32)
    return texture[..., 0] if count == 1 else texture, -x


def _parts(read: dict[str, FloatTexture], mapping: WorldToImage, back: Matrix | None, settings: Settings) -> list[Part]:
    """All passes, and their textures as parts of a file."""
    depth, parts, ao, samples = read["--depth"], [], [], settings.samples
    turns = turns_for(settings, depth)
    assert samples is not None
    with progress(settings.radii, unit="radius", postfix="the first run compiles kernels") as bar:
        for radius in bar:
            if "--positions" in read:
                made = algorithm2(depth, read["--positions"], mapping, samples, radius, turns)
            else:
                assert back is not None
                made = algorithm1(depth, back, mapping.numbers.reshape(4, 4), samples, radius, turns)
            bar.set_postfix_str("", refresh=False)
            ao.append(made.texture)
            more = {"radius": radius, "outside": str(made.outside)}
            parts.append(occlusion_part(f"ao_{len(ao)}", made.texture, more))
    merged = post.merge(ao)
    blurred = post.blur(merged, settings.blur)
    parts += [occlusion_part("merged", merged, {}), occlusion_part("blurred", blurred, {"sigma": settings.blur})]
    if "--image" in read:
        parts.insert(0, Part("shaded", ("R", "G", "B"), post.shade(read["--image"], blurred)))
    return parts
