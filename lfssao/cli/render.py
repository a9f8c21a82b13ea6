"""``lfssao render``: textures of every module of a display, or of a camera."""

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lfssao.cli import estimators, values
from lfssao.cli.terminal import printable, say
from lfssao.cli.values import LARGEST_RADIUS, MOST_BLUR, MOST_GUARD, MOST_SAMPLES, MOST_THREADS
from lfssao.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lfssao.core.affine import Matrix
    from lfssao.optics.display import Display
    from lfssao.optics.view import View
    from lfssao.rendering.settings import Settings
    from lfssao.rendering.work import Work
    from lfssao.scene.mesh import Mesh

CAMERA_RESOLUTION = (1024, 768)


def add_to(commands: Any) -> None:
    """Add the command to the parser."""
    render = commands.add_parser(
        "render",
        allow_abbrev=False,
        help="textures of every module of a display, or of a camera",
        description="Ray cast a scene from every optical module of a light field display, compute ambient occlusion "
        "for several radii (by LF Algorithm 2, or by --estimator), merge, blur and multiply it in, and write one EXR "
        "file a module, manifest.json and contact.png.",
    )
    render.set_defaults(run=_render)
    add_options(render, output=True)


def add_options(command: argparse.ArgumentParser, *, output: bool) -> None:
    """Add the options that say what is rendered, from what, how and where to; the folder is required for output."""
    add = command.add_argument
    add(
        "scene",
        nargs="?",
        default="gallery",
        metavar="SCENE",
        help="a mesh file (OBJ, PLY, STL, OFF, GLB, ...) or an embedded scene: gallery, statue, ammonite, armadillo "
        "(default: gallery)",
    )
    add("-o", "--output", required=output, metavar="DIR", help="folder to write to; made if not there, files replaced")
    add(
        "--texture",
        metavar="IMAGE",
        help="an image for a mesh file with texture coordinates, in place of those that the file names",
    )
    add(
        "--display",
        metavar="NAME",
        help="a preset, such as sample-a ('lfssao display' lists them), or a .toml file (default: virtual)",
    )
    add("--modules", type=values.module_range, metavar="A:B", help="modules A to B - 1 only (default: all)")
    add(
        "--camera",
        nargs="?",
        const="perspective",
        metavar="PROJECTION",
        help="an ordinary view by Algorithm 1 instead of a display: perspective (default) or orthographic; "
        "SCENE goes before it",
    )
    add(
        "--resolution",
        type=values.resolution,
        metavar="WxH",
        help="texels of each texture (default: the display's own; 1024x768 with --camera)",
    )
    add(
        "--radii",
        type=values.radii,
        metavar="R,R,...",
        help="radii of the sampling ball in scene units, or with %% in shares of the scene's diagonal "
        "(default: 1%%,2%%,3.5%%,6%%,10%%)",
    )
    add(
        "--estimator",
        default="lf",
        metavar="NAME",
        help="how occlusion is estimated; 'lfssao estimators' lists the names (default: lf)",
    )
    add(
        "--parameter",
        type=values.parameter,
        action="append",
        metavar="NAME=VALUE",
        help="a parameter of the estimator in place of its default; may be given several times",
    )
    add(
        "--neighbours",
        type=values.neighbours,
        default=0,
        metavar="K",
        help="count a sample as occluded only if none of the K nearest modules sees it in the open (default: 0)",
    )
    add(
        "--samples",
        type=values.samples,
        metavar="N",
        help=f"samples of each texel and radius, up to {MOST_SAMPLES} (default: the estimator's paper's, LF's 8)",
    )
    add(
        "--sampling",
        metavar="NAME",
        help="latin, jittered, poisson, sobol, ...: any method of the ball that 'lfssao samples make' lists "
        "(default: the estimator's own, LF's is latin)",
    )
    add(
        "--blur",
        type=values.blur,
        default=1.0,
        metavar="SIGMA",
        help=f"sigma of the blur, texels, up to {MOST_BLUR:g}; 0: none (default: 1)",
    )
    add(
        "--filter",
        default="bilinear",
        metavar="NAME",
        help="how the mesh's colour textures are read: bilinear or nearest (default: bilinear)",
    )
    add(
        "--normals",
        nargs="?",
        const="geometric",
        metavar="KIND",
        help="write world normals too: geometric (default) or smooth, from the mesh's vertices where it has them",
    )
    add(
        "--layers",
        type=values.layers,
        metavar="NAME,...",
        help="keep and write only these of depth, positions, color, normals, ao, merged, blurred, shaded, and compute "
        "only what they need (default: all, normals with --normals)",
    )
    add(
        "--guard",
        type=values.guard,
        default=0,
        metavar="N",
        help=f"guard band: texels around each texture that AO looks into, up to {MOST_GUARD} (default: 0)",
    )
    add(
        "--caster",
        default="exact",
        metavar="NAME",
        help="what picks each ray's first triangle: exact, with equal bits everywhere, or embree, Embree's own float32 "
        "answers, to show where they differ (default: exact)",
    )
    add("--seed", type=values.seed, metavar="N", help="seed of the samples, 0 to 2**64 - 1 (default: 0)")
    add("--threads", type=values.threads, metavar="N", help="threads, at most one for each core (default)")
    add(
        "--frames",
        type=values.frames,
        metavar="N|FILE",
        help="render an animation, each frame into a folder of its own: N frames of one turn about the vertical, or "
        "those of a .json or .npy file of 4x4 matrices that place the scene",
    )
    add(
        "--resume",
        action="store_true",
        help="keep the textures that an interrupted job left, if their digests are right, and do the rest",
    )
    add(
        "--scheduler",
        type=values.scheduler,
        metavar="ADDRESS",
        help="compute on dask.distributed: local (a process for each thread), or tcp://HOST:PORT, whose workers must "
        "see the same folder",
    )


def prepare(options: argparse.Namespace) -> "tuple[Work, dict[str, Any]]":
    """Check everything that can be checked, then load the scene; return the job and what its manifest says of it."""
    display = _display(options)
    sampling, settings_of = _settings_maker(options)
    _check_size(options, display)
    if options.output is not None:
        from lfssao.core.files import check_folder

        check_folder(Path(options.output))
    mesh = load(options.scene, options.texture)
    _say_what_was_left_out(mesh)
    from lfssao.rendering import manifest
    from lfssao.rendering.animation import frame_bounds, swept_bounds
    from lfssao.rendering.work import Work

    settings = settings_of(mesh)
    transforms = _transforms(options.frames, mesh)
    # One box for all frames, so that the scene's scale on the display stays what it is.
    boxes = [mesh.bounds] if transforms is None else frame_bounds(mesh, transforms)
    bounds = swept_bounds(boxes)
    views = tuple(_views(options, mesh, display, bounds))
    asked = tuple(_neighbours(options, mesh, display, bounds))
    scene, folder = manifest.describe_scene(mesh), Path(options.output or ".")
    work = Work(mesh, views, settings, folder, scene, transforms, asked, tuple(boxes))
    return work, {
        "scene": scene,
        "display": None if options.camera is not None else manifest.describe_display(display),
        "camera": options.camera,
        "sampling": sampling,
        "settings": manifest.describe_settings(settings),
    }


def _render(options: argparse.Namespace) -> None:
    """``lfssao render``: check everything that can be checked, then load, then make the folder, cast and write."""
    threads = min(options.threads or MOST_THREADS, _core_count())
    if not options.output:
        raise InputError("--output is empty, it must name a folder")
    if options.threads is not None and (options.scheduler or "local") != "local":
        raise InputError("--threads does not go with a scheduler's address: its workers have their own")
    start = time.perf_counter()
    work, described = prepare(options)
    seconds = {"load": time.perf_counter() - start}
    _warn_of_small_radii(work)
    from lfssao.cli.run_items import run_items
    from lfssao.rendering import manifest

    head = {"machine": manifest.describe_machine(threads, options.command), **described}
    run_items(work, head, seconds, threads, options.resume, options.scheduler)
    written = f"{len(work.views)} EXR file{'s' * (len(work.views) > 1)}, manifest.json"
    written += ", contact.png" * work.has_sheet
    if work.transforms is not None:
        written = f"{len(work.transforms)} frame{'s' * (len(work.transforms) > 1)}, each {written}"
    print(printable(f"{work.folder}: {written}"), flush=True)


def _warn_of_small_radii(work: "Work") -> None:
    from lfssao.rendering.plan import subpixel_radii

    asked = work.settings.radii if "ao" in work.settings.computed else ()
    radii = [f"{radius:g}" for radius in subpixel_radii(work.views, work.boxes, asked)]
    if len(radii) == 1:
        say(f"radius {radii[0]} is less than half a texel everywhere: its AO says nothing")
    elif radii:
        say(f"radii {', '.join(radii)} are less than half a texel everywhere: their AO says nothing")


def _core_count() -> int:
    """Cores that this process may use, and that numba has threads for."""
    import numba  # late: takes a third of a second to import

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    return int(min(cores, numba.config.NUMBA_NUM_THREADS))


def _display(options: argparse.Namespace) -> "Display":
    """The display asked for; that there is a camera instead of one is checked too."""
    from lfssao.optics.camera import PROJECTIONS  # late: numba is imported behind this line
    from lfssao.optics.display_file import find_display

    if options.camera is not None:
        if options.camera not in PROJECTIONS:
            raise InputError(
                f"--camera: there is no projection '{options.camera}': choose one of {', '.join(PROJECTIONS)}"
            )
        for name in ("display", "modules", "neighbours"):
            if getattr(options, name) not in (None, 0):
                raise InputError(f"--{name} does not go with --camera, which renders one ordinary view")
    try:
        display = find_display("virtual" if options.display is None else options.display)
    except InputError as error:
        raise InputError(f"--display: {error}") from None
    if options.neighbours >= len(display.modules):
        raise InputError(
            f"--neighbours {options.neighbours}: a module of {display.name} has {len(display.modules) - 1} others"
        )
    if options.modules is not None and options.modules.stop > len(display.modules):
        raise InputError(
            f"--modules {options.modules.start}:{options.modules.stop}: {display.name} has modules "
            f"0:{len(display.modules)}"
        )
    return display


def _check_size(options: argparse.Namespace, display: "Display") -> None:
    from lfssao.ao.estimators.registry import find_estimator
    from lfssao.rendering.job import check_memory
    from lfssao.rendering.settings import DEFAULT_RADII

    radius_count = len(options.radii or DEFAULT_RADII)
    texel_bytes = find_estimator(options.estimator).texel_bytes
    sizes = [(module.width, module.height) for module in display.modules]
    if options.camera is not None:
        sizes = [CAMERA_RESOLUTION]
    if options.resolution is not None:
        sizes = [options.resolution]
    for width, height in dict.fromkeys(sizes):
        check_memory(width + 2 * options.guard, height + 2 * options.guard, radius_count, texel_bytes)


def _settings_maker(options: argparse.Namespace) -> "tuple[dict[str, Any], Callable[[Mesh], Settings]]":
    """Make the samples now; return what the manifest says of them, and what makes the settings for a scene."""
    from lfssao.ao.estimators.registry import find_estimator
    from lfssao.rendering.settings import Settings, default_radii, diagonal

    try:
        estimator = find_estimator(options.estimator)
    except InputError as error:
        raise InputError(f"--estimator: {error}") from None
    parameters = estimators.read_parameters(estimator, options.parameter)
    sampling, samples, weights = estimators.read_samples(estimator, options.sampling, options.samples, options.seed)

    def of(radii: tuple[float, ...]) -> Settings:
        look = options.blur, options.filter, options.normals
        asked = options.neighbours, options.caster, options.layers
        return Settings(radii, samples, *look, estimator.name, parameters, weights, *asked)

    of((0.0,))  # refused before the scene is loaded

    def settings(mesh: "Mesh") -> "Settings":
        radii = default_radii(mesh)
        if options.radii is not None:
            radii = tuple(r / 100 * diagonal(mesh) if share else r for r, share in options.radii)
        if max(radii) > LARGEST_RADIUS:
            raise InputError(f"--radii: {max(radii):g} scene units is more than {LARGEST_RADIUS:g}")
        return of(radii)

    return sampling, settings


def load(scene: str, texture: str | None = None) -> "Mesh":
    """The mesh of a file, or the embedded scene of a name."""
    from lfssao.scene.builtin import BUILTIN, builtin_scene

    # The embedded scenes' names have no ending, which a mesh file needs: a folder of that name does not matter.
    if scene in BUILTIN:
        if texture is not None:
            raise InputError(f"--texture: the embedded scene {scene} takes none")
        return builtin_scene(scene)
    if not Path(scene).suffix and not Path(scene).exists():
        raise InputError(f"{scene}: there is no such file, and no embedded scene of that name ({', '.join(BUILTIN)})")
    from lfssao.scene.load import load_scene  # late: trimesh takes 0.4 s to import, and embedded scenes need none

    return load_scene(scene, texture)


def _say_what_was_left_out(mesh: "Mesh") -> None:
    if mesh.degenerate:
        faces = "1 face without an area is" if mesh.degenerate == 1 else f"{mesh.degenerate} faces without an area are"
        say(f"{mesh.name}: {faces} left out")
    for note in mesh.notes:
        say(f"{mesh.name}: {note}")


def _views(
    options: argparse.Namespace, mesh: "Mesh", display: "Display", bounds: "NDArray[np.float64]"
) -> "list[View]":
    from lfssao.optics.camera import Camera
    from lfssao.optics.view import check_positions
    from lfssao.rendering.views import module_views

    if options.camera is not None:
        camera = Camera.looking_at(bounds, options.camera)
        width, height = options.resolution or CAMERA_RESOLUTION
        check_positions(bounds, height / camera.extent)
        return [camera.view(width, height, options.guard)]
    if options.resolution is not None:
        display = display.with_resolution(*options.resolution)
    return module_views(mesh, display, options.modules, options.guard, bounds)


def _neighbours(
    options: argparse.Namespace, mesh: "Mesh", display: "Display", bounds: "NDArray[np.float64]"
) -> "list[tuple[View, ...]]":
    from lfssao.rendering.views import neighbour_views

    if options.neighbours == 0:
        return []
    if options.resolution is not None:
        display = display.with_resolution(*options.resolution)
    return neighbour_views(mesh, display, options.neighbours, options.modules, options.guard, bounds)


def _transforms(frames: int | Path | None, mesh: "Mesh") -> "tuple[Matrix, ...] | None":
    """Where the scene is in each frame; None for a still."""
    if frames is None:
        return None
    from lfssao.rendering.animation import read_transforms, turntable

    if isinstance(frames, int):
        return tuple(turntable(mesh.bounds, frames))
    try:
        return tuple(read_transforms(frames))
    except InputError as error:
        raise InputError(f"--frames: {error}") from None
