"""Whole files of every kind but meshes that `fuzz.py` mutates, and what reads each kind, meshes too.

They are small and the same bytes each time: those that a render writes hold no time.
"""

import argparse
import functools
import io
import json
import re
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from fuzz_seeds import Files
from PIL import Image

from lfssao.ao.estimators.published import find_published, published_names, published_text
from lfssao.cli.job_options import add_options, job_of
from lfssao.cli.main import main
from lfssao.cli.terminal import BAD_INPUT, NOT_COMPARED
from lfssao.errors import InputError
from lfssao.files.exr import read_exr, write_exr
from lfssao.files.image_file import read_image_file
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.camera import Camera
from lfssao.optics.display_file import ViewSet, display_text, find_views
from lfssao.optics.view import KINDS
from lfssao.rendering.animation import frame_bounds, read_transforms
from lfssao.rendering.job import Job
from lfssao.rendering.run import recover
from lfssao.rendering.views import module_views
from lfssao.scene.builtin import builtin_scene
from lfssao.scene.load import load_scene
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import write_kit

_RENDER = "render statue --display sample-a --modules 3:5 --resolution 16x12 --radii 4% --samples 4 --threads 1"
_CASES = "algorithm2_conical", "blur_usual", "frame", "samples_latin"


def run(*words: object) -> int:
    """The code of a command; InputError with what it says, where it refuses its input."""
    said = io.StringIO()
    with redirect_stderr(said), redirect_stdout(io.StringIO()):
        code = main([str(word) for word in words])
    if "not enough memory" in said.getvalue():
        raise MemoryError
    if code == (NOT_COMPARED if words[0] == "compare" else BAD_INPUT) and said.getvalue():
        raise InputError(said.getvalue().removesuffix("\n"))
    return code


def _files_of(folder: Path) -> Files:
    """The files of a folder and below it, without the times at which they were made."""
    made = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        data = re.sub(rb"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d", b"2000:01:01 00:00:00", path.read_bytes())
        made[str(path.relative_to(folder))] = data
    return made


@functools.cache
def _rendered() -> Files:
    """Two modules, and one of another renderer that differs from it in three layers."""
    with tempfile.TemporaryDirectory() as root:
        run(*_RENDER.split(), "-o", root)
        files = _files_of(Path(root))
        parts = read_exr(Path(root, "module_003.exr"))
        for name, by in (("depth", 2e-7), ("ao_1", 0.1), ("color", 0.1), ("shaded", 1e-7)):
            if name in parts:
                parts[name].pixels[...] *= np.float32(1 + by)
        write_exr(Path(root, "mine.exr"), list(parts.values()))
        other = _files_of(Path(root))["mine.exr"]
    del files["contact.png"]
    # Its mesh is not at hand: casting rays into it takes seconds.
    manifest = json.loads(files.pop("manifest.json"))
    manifest |= {"machine": {}, "seconds": {}, "scene": {**manifest["scene"], "name": "statue.obj"}}
    manifest["views"] = [{**view, "seconds": {}} for view in manifest["views"]]
    return {"manifest.json": json.dumps(manifest, indent=1).encode(), "mine/module_003.exr": other, **files}


def load_mesh(path: Path) -> None:
    """Load a mesh and cast rays at it: kernels index its arrays by numbers of the file."""
    mesh = load_scene(path)
    view = Camera.looking_at(mesh.bounds, "orthographic").view(8, 6)
    for color in ("bilinear", "nearest"):
        seen = RayCaster(mesh, view.cast_from_world, 1).gbuffer(view, color, "smooth")
        for texture in (seen.color, seen.normals):
            assert texture is None or np.isfinite(texture).all()


def displays() -> list[Files]:
    names = "sample-a", "convex", "c80", "virtual", "sample-b", "looking-glass-portrait", "near-eye"
    listed = "\n".join(
        ['name = "mine"', "[screen]", "width = 1.0", "height = 0.5", "[observer]", "distance = 2.0", "[roi]",
         "min = [-0.3, -0.2, -0.1]", "max = [0.3, 0.2, 0.1]", "[modules]", 'layout = "list"',
         *("[[modules.list]]\nx = 0.1\nz = 1.5\nresolution = [64, 48]\nfield_of_view = 40\nyaw = 3\nk1 = 0.01",) * 2]
    )  # fmt: skip
    return [*({"a.toml": display_text(name).encode()} for name in names), {"a.toml": listed.encode()}]


def load_display(path: Path) -> None:
    run("display", path)
    display = find_views(path)
    mesh = builtin_scene("corner")
    last = (display.count if isinstance(display, ViewSet) else len(display.modules)) - 1
    display.with_resolution(8, 6)
    for number in (0, last):
        module_views(mesh, display, range(number, number + 1))


def views() -> list[Files]:
    """Every kind of view of a depth texture."""
    depth = io.BytesIO()
    texture = np.full((12, 16), 0.5, np.float32)
    texture[:3] = np.inf
    np.save(depth, texture)
    row = "[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]"
    eye = f"view = [{row}, [0.0, 0.0, 0.0, 1.0]]"
    projection = "projection = [[1.0, 0, 0, 0], [0, 1.3, 0, 0], [0, 0, -1.02, -0.2], [0, 0, -1.0, 0]]"
    seen = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(16, 12)
    kinds = [
        f'kind = "camera"\n{eye}\n{projection}\nclip = "opengl"\ndepth_kind = "linear"\nrows = "below"',
        f'kind = "module"\ndisplay = "sample-a"\nmodule = 3\nphysical_from_world = [{row}]',
        'kind = "folder"\nfolder = "FOLDER"\nname = "module_003"',
        f'kind = "matrix"\nM = {seen.world_to_image.numbers.reshape(4, 4).tolist()}',
        f'kind = "crossed slits"\nM = [{row}]\nz_m = 2.0\nz_o = -3.0\nu_0 = 8.0\nv_0 = 6.0',
    ]
    assert len(KINDS) == 3
    beside = {"module_003.npy": depth.getvalue(), "manifest.json": _rendered()["manifest.json"]}
    camera = {"Name": "module_003", "NameDepth": "a.png", "Position": [1.0, 2.0, 3.0], "Rotation": [10.0, -20.0, 5.0]}
    camera |= {"Depth_range": [0.5, 9.0], "Resolution": [16, 12], "Projection": "Perspective", "Focal": [20.0, 20.0]}
    camera |= {"Principle_point": [8.0, 6.0], "BitDepthColor": 8, "BitDepthDepth": 10}
    codes = io.BytesIO()
    np.save(codes, (600 * texture.clip(0, 1)).astype(np.uint16))
    of_set = {"a.json": json.dumps({"cameras": [camera]}).encode(), "module_003.npy": codes.getvalue()}
    return [*({"a.toml": text.encode(), **beside} for text in kinds), of_set]


def load_view(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"FOLDER", str(path.parent).encode()))
    words = "--depth", path.parent / "module_003.npy", "--buffers", path, "--radii", "0.1", "--samples", "2"
    run("ao", *words, "-o", path.parent / "out")


def samples() -> list[Files]:
    """Tables of every format and ending."""
    made = []
    with tempfile.TemporaryDirectory() as root:
        for domain, method in (("ball", "latin"), ("square", "sobol"), ("disk", "spiral"), ("ball", "poisson")):
            for kind in ("csv", "json", "npy"):
                path = Path(root, f"a.{kind}")
                run("samples", "make", method, "-n", 16, "--domain", domain, "--format", kind, "-o", path)
                made.append({path.name: path.read_bytes()})
    points = np.arange(12.0).reshape(4, 3) / 12
    packed = io.BytesIO()
    np.savez(packed, points=points)
    bare = "\n".join(" ".join(map(str, row)) for row in points.tolist()).encode()
    weighted = b"x;y;z;weight\n" + bare.replace(b"\n", b";1\n").replace(b" ", b";") + b";1"
    more = {"a.txt": bare, "a.dat": bare, "a.csv": weighted, "a.npz": packed.getvalue(), "a.npy": packed.getvalue()}
    return [*made, *({name: data} for name, data in more.items()), {"a.json": json.dumps(points.tolist()).encode()}]


def load_samples(path: Path) -> None:
    run("samples", "check", path)


def frames() -> list[Files]:
    turns = np.tile(np.eye(4), (3, 1, 1))
    turns[1, 0, 3] = 0.1
    made = io.BytesIO()
    packed = io.BytesIO()
    whole = io.BytesIO()
    np.save(made, turns)
    np.savez(packed, turns=turns)
    np.save(whole, turns.astype(np.int16))
    text = json.dumps(turns.tolist()).encode()
    names = {"a.npy": made, "b.npy": packed, "c.npy": whole}
    return [{"a.json": text}, *({f"{name[0]}.npy": data.getvalue()} for name, data in names.items())]


def load_frames(path: Path) -> None:
    frame_bounds(builtin_scene("corner"), read_transforms(path))


def manifests() -> list[Files]:
    return [_rendered()]


def load_view_of_display(path: Path) -> None:
    run("view", path.parent, "--width", "16", "-o", path.parent / "eye.png")


def load_compare(path: Path) -> None:
    root = path.parent if path.name == "manifest.json" else path.parents[1]
    run("compare", root / "mine", root, "--no-diagnosis", "--json", root / "a.json")


def textures() -> list[Files]:
    """The other renderer's EXR file of a comparison."""
    files = dict(_rendered())
    return [{"mine/module_003.exr": files.pop("mine/module_003.exr"), **files}]


def resumed() -> list[Files]:
    return [{name: _rendered()[name]} for name in ("module_003.exr", "module_004.exr")]


@functools.cache
def _job() -> Job:
    """The job that made the seeds."""
    parser = argparse.ArgumentParser()
    add_options(parser, output=True)
    return job_of(parser.parse_args([*_RENDER.split()[1:], "-o", "."], argparse.Namespace(command=[])), 1)


def load_resumed(path: Path) -> None:
    if not recover(replace(_job(), folder=path.parent), 1):
        raise InputError(f"{path}: it is rendered anew")


def images() -> list[Files]:
    """Every format of textures: EXR in parts, plain, in tiles and of half floats, TIFF, PNG, NPY."""
    pixels = np.random.default_rng(1).random((9, 7, 3), np.float32)
    table = io.BytesIO()
    np.save(table, pixels)
    made = [{"module_003.exr": _rendered()["module_003.exr"]}, {"a.npy": table.getvalue()}]
    with tempfile.TemporaryDirectory() as root:
        for name, kind, tile, packing in (
            ("a.exr", "float", 0, "none"), ("a.exr", "half", 4, "zip"), ("a.exr", "half", 0, "piz"),
            ("a.exr", "float", 0, "b44"), ("a.exr", "half", 0, "dwaa"), ("a.exr", "uint", 0, "rle"),
            ("a.exr", "float", 0, "pxr24"), ("a.tif", "float", 0, "none"), ("a.tif", "uint16", 16, "zip"),
            ("a.tif", "uint8", 0, "lzw"), ("a.tif", "half", 0, "zip"),
        ):  # fmt: skip
            spec = oiio.ImageSpec(7, 9, 3, kind)
            path = Path(root, name)
            spec.tile_width = spec.tile_height = tile
            spec.attribute("compression", packing)
            target = oiio.ImageOutput.create(str(path))
            assert target.open(str(path), spec), target.geterror()
            assert target.write_image(pixels), target.geterror()
            assert target.close()
            made.append({name: _files_of(Path(root))[name]})
    for mode in ("L", "RGB", "RGBA", "I;16", "P"):
        picture = io.BytesIO()
        Image.fromarray((pixels * 255).astype(np.uint8)).convert("L" if mode == "I;16" else mode).save(picture, "PNG")
        made.append({"a.png": picture.getvalue()})
    return made


def load_image(path: Path) -> None:
    for part in read_image_file(path):
        for plane in part.planes:
            plane.sum()
    if path.suffix == ".exr":
        read_exr(path)
    run("compare", path, path)


def kits() -> list[Files]:
    """A kit with each of its files as the first, and another renderer's outputs, which differ."""
    with tempfile.TemporaryDirectory() as root:
        write_kit(Path(root, "kit"), map(make_case, _CASES))
        files = {name: data for name, data in _files_of(Path(root)).items() if not name.endswith((".md", ".exr"))}
    for name in [name for name in files if name.endswith(".npy")]:
        _, _, case, output = name.split("/")
        data = np.load(io.BytesIO(files[name]))
        mine = io.BytesIO()
        np.save(mine, data * data.dtype.type(1 + 1e-6) if data.dtype.kind == "f" else data)
        files[f"mine/{case}_{output}"] = mine.getvalue()
    firsts = ["kit/kit.json", *(name for name in files if name.endswith(("case.json", "conical/samples.npy")))]
    firsts += ["kit/cases/frame/merged_lower.npy", "mine/frame_merged.npy"]
    return [{first: files[first], **{name: data for name, data in files.items() if name != first}} for first in firsts]


def load_kit(path: Path) -> None:
    root = next(folder.parent for folder in path.parents if folder.name in ("kit", "mine"))
    run("compare", root / "mine", root / "kit", "--no-diagnosis")


def shaders() -> list[Files]:
    return [{"a.toml": published_text(name).encode()} for name in published_names()]


def load_shader(path: Path) -> None:
    find_published(str(path))


LOADS: dict[str, tuple[Callable[[], list[Files]], Callable[[Path], object]]] = {
    "display": (displays, load_display),
    "buffers": (views, load_view),
    "samples": (samples, load_samples),
    "frames": (frames, load_frames),
    "view": (manifests, load_view_of_display),
    "compare": (manifests, load_compare),
    "textures": (textures, load_compare),
    "resume": (resumed, load_resumed),
    "image": (images, load_image),
    "kit": (kits, load_kit),
    "shader": (shaders, load_shader),
}
