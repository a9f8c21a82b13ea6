"""The command line: reads options, calls the library, and says in one sentence what was wrong."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from lfssao import __version__
from lfssao.errors import InputError, LfssaoError

if TYPE_CHECKING:
    from lfssao.display import FlatDisplay
    from lfssao.render import Settings
    from lfssao.scene.mesh import Mesh
    from lfssao.view import View

BAD_INPUT = 2
INTERRUPTED = 130

CAMERA_RESOLUTION = (1024, 768)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence, without the usage lines."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows ``lfssao`` on the command line; ``sys.argv`` by default.

    Returns
    -------
    int
        0; 2 where the input was wrong; 130 where the user interrupted.
    """
    try:
        options = _parser().parse_args(arguments)
        options.run(options)
    except LfssaoError as error:
        print(f"lfssao: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("lfssao: interrupted; every file that was written is whole", file=sys.stderr)
        return INTERRUPTED
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="lfssao", description="Screen-space ambient occlusion for light field displays.")
    parser.add_argument("--version", action="version", version=f"lfssao {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_render(commands)
    return parser


def _add_render(commands: Any) -> None:
    render = commands.add_parser(
        "render",
        help="textures of every module of a display, or of a camera",
        description="Ray cast a scene from every optical module of a light field display, compute ambient occlusion "
        "for several radii (LF Algorithm 2), merge, blur and multiply it in, and write one EXR file a module, "
        "manifest.json and contact.png.",
    )
    render.set_defaults(run=_render)
    add = render.add_argument
    add(
        "scene",
        nargs="?",
        default="gallery",
        metavar="SCENE",
        help="a mesh file (OBJ, PLY, STL, OFF, GLB, ...) or an embedded scene: gallery, statue, ammonite, armadillo "
        "(default: gallery)",
    )
    add("-o", "--output", required=True, metavar="DIR", help="folder to write to; made if it is not there")
    add(
        "--texture",
        metavar="IMAGE",
        help="an image for a mesh with texture coordinates whose file names none",
    )
    add("--display", default="virtual", metavar="NAME", help="virtual or sample-a (default: virtual)")
    add("--modules", type=_module_range, metavar="A:B", help="modules A to B - 1 only (default: all)")
    add(
        "--camera",
        nargs="?",
        const="perspective",
        metavar="PROJECTION",
        help="an ordinary view by Algorithm 1 instead of a display: perspective (default) or orthographic",
    )
    add(
        "--resolution",
        type=_resolution,
        metavar="WxH",
        help="texels of each texture (default: the display's own)",
    )
    add(
        "--radii",
        type=_radii,
        metavar="R,R,...",
        help="radii of the sampling ball in scene units, or with %% in shares of the scene's diagonal "
        "(default: 1%%,2%%,3.5%%,6%%,10%%)",
    )
    add("--samples", type=int, default=8, metavar="N", help="samples of each texel and radius (default: 8)")
    add("--sampling", default="latin", metavar="NAME", help="random, jittered or latin (default: latin)")
    add(
        "--blur",
        type=float,
        default=1.0,
        metavar="SIGMA",
        help="sigma of the blur, texels; 0: none (default: 1)",
    )
    add("--seed", type=int, default=0, metavar="N", help="seed of the samples (default: 0)")
    add("--threads", type=int, metavar="N", help="threads (default: one for each core)")


def _module_range(text: str) -> range:
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        numbers = int(start), int(stop)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a range A:B of two whole numbers") from None
    if not 0 <= numbers[0] < numbers[1]:
        raise argparse.ArgumentTypeError(f"'{text}' holds no module: A:B needs 0 <= A < B")
    return range(*numbers)


def _resolution(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    if not (cross and width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT in texels, such as 1024x768")
    return int(width), int(height)


def _radii(text: str) -> tuple[tuple[float, bool], ...]:
    """Each radius with whether it is a share, in per cent, of the scene's diagonal."""
    radii = []
    for word in text.split(","):
        try:
            number = float(word.removesuffix("%"))
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{word}' is not a radius") from None
        if not 0 <= number < float("inf"):
            raise argparse.ArgumentTypeError(f"a radius is {word}, it must be a finite number of at least 0")
        radii.append((number, word.endswith("%")))
    return tuple(radii)


def _render(options: argparse.Namespace) -> None:
    """``lfssao render``: check everything that can be checked, then load, cast and write."""
    start = time.perf_counter()
    threads = _thread_count(options.threads)
    if options.samples < 1:
        raise InputError(f"--samples is {options.samples}, it must be at least 1")
    from lfssao.camera import PROJECTIONS  # late: numba is imported behind this line

    if options.camera is not None and options.camera not in PROJECTIONS:
        raise InputError(f"--camera: there is no projection '{options.camera}': choose one of {', '.join(PROJECTIONS)}")
    import numba

    from lfssao.display import find_display
    from lfssao.files import make_folder

    display = find_display(options.display)
    if options.modules is not None and options.modules.stop > len(display.modules):
        raise InputError(
            f"--modules {options.modules.start}:{options.modules.stop}: {display.name} has modules "
            f"0:{len(display.modules)}"
        )
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    settings_of = _settings_maker(options)
    folder = Path(options.output)
    make_folder(folder)
    mesh = _load(options.scene, options.texture)
    loaded = time.perf_counter() - start
    if mesh.degenerate:
        print(f"lfssao: {mesh.name}: {mesh.degenerate} faces without an area are left out", file=sys.stderr)
    _run_job(options, mesh, display, settings_of(mesh), folder, threads, loaded)


def _thread_count(asked: int | None) -> int:
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    if asked is None:
        return available
    if asked < 1:
        raise InputError(f"--threads is {asked}, it must be at least 1")
    return asked


def _settings_maker(options: argparse.Namespace) -> Any:
    """Check samples, radii and blur now; return what makes the settings once the scene's size is known."""
    from lfssao.passes import gaussian_kernel
    from lfssao.render import Settings, default_radii, diagonal
    from lfssao.samples import make_samples

    samples = make_samples(options.sampling, options.samples, options.seed)
    gaussian_kernel(options.blur)

    def settings(mesh: "Mesh") -> "Settings":
        radii = default_radii(mesh)
        if options.radii is not None:
            radii = tuple(r / 100 * diagonal(mesh) if share else r for r, share in options.radii)
        return Settings(radii, samples, options.blur)

    return settings


def _load(scene: str, texture: str | None) -> "Mesh":
    from lfssao.scene.builtin import BUILTIN, builtin_scene
    from lfssao.scene.load import load_scene

    if scene in BUILTIN and not Path(scene).exists():
        return builtin_scene(scene)
    return load_scene(scene, texture)


def _views(options: argparse.Namespace, mesh: "Mesh", display: "FlatDisplay") -> "list[View]":
    from lfssao.camera import Camera
    from lfssao.render import module_views

    if options.camera is not None:
        return [Camera.looking_at(mesh.bounds, options.camera).view(*(options.resolution or CAMERA_RESOLUTION))]
    if options.resolution is not None:
        display = display.with_resolution(*options.resolution)
    return module_views(mesh, display, options.modules)


def _run_job(
    options: argparse.Namespace,
    mesh: "Mesh",
    display: "FlatDisplay",
    settings: "Settings",
    folder: Path,
    threads: int,
    loaded: float,
) -> None:
    from tqdm import tqdm

    from lfssao import manifest
    from lfssao.job import Job
    from lfssao.raycast import RayCaster
    from lfssao.render import render_view

    views = _views(options, mesh, display)
    head = {
        "machine": manifest.describe_machine(threads),
        "scene": manifest.describe_scene(mesh),
        "display": None if options.camera is not None else manifest.describe_display(display),
        "camera": options.camera,
        "sampling": {"method": options.sampling, "count": options.samples, "seed": options.seed},
        "settings": manifest.describe_settings(settings),
    }
    job = Job(folder, settings, len(views), head)
    start = time.perf_counter()
    caster = RayCaster(mesh, views[0].cast_from_world, threads)
    built = time.perf_counter() - start
    # disable=None: a bar on a terminal, nothing in a pipe.
    for view in tqdm(views, unit="module", disable=None):
        job.add(render_view(caster, view, settings))
    rendered = time.perf_counter() - start
    job.finish({"load": loaded, "build_bvh": built, "render": rendered})
    print(f"{folder}: {len(views)} EXR file{'s' * (len(views) > 1)}, manifest.json, contact.png")
