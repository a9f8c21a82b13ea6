"""The options that say what is rendered, from what, how and where to, and the job that they describe."""

import argparse
from collections.abc import Callable, Collection
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.published import published_names
from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.post import OCCLUDED, Light
from lfssao.cli import estimators, values
from lfssao.cli.terminal import say
from lfssao.cli.values import MOST_BLUR, MOST_SAMPLES
from lfssao.core.affine import Matrix
from lfssao.errors import InputError, check_choice, errors_of, no_such
from lfssao.files.image_file import Size
from lfssao.files.whole import check_folder
from lfssao.optics.display import Display
from lfssao.optics.display_file import ViewSet, find_views
from lfssao.optics.view import MOST_GUARD, View, check_positions
from lfssao.rendering import doubts, manifest
from lfssao.rendering.job import Job
from lfssao.rendering.run import check_memory
from lfssao.rendering.settings import LAYERS, Settings, default_radii, diagonal
from lfssao.rendering.views import Box, module_views, neighbour_views
from lfssao.samples import ROTATIONS
from lfssao.scene.builtin import TEST_VIEW, find_scene
from lfssao.scene.mesh import Mesh

CAMERA_RESOLUTION = (1024, 768)
_PLACED = ("eye", "target", "up", "fov")  # of a camera

_HELP = {
    "scene": "a mesh file (OBJ, PLY, STL, OFF, GLB, ...) or an embedded scene: gallery, turntable (without its "
    "wall), statue, ammonite, armadillo, corner (default: gallery; turntable with --frames N)",
    "--output": "folder to write to; made if not there, files replaced (default: out)",
    "--texture": "an image for a mesh file with texture coordinates, in place of those that the file names",
    "--display": "a preset, such as c80, or looking-glass-portrait, a quilt of views, or near-eye, a panel behind "
    "lenses ('lfssao display' lists them), or a .toml file (default: sample-a)",
    "--modules": "modules, a quilt's views or a panel's lenses A to B - 1 only, or A alone (default: all)",
    "--quilt": "write a picture of all views of a quilt, view 0 below on the left, of these layers: shaded (default), "
    "color, merged, ao_1, ...; such as merged_qs8x6a0.75.png, occlusion in codes from 0, open, to 255",
    "--camera": "an ordinary view by Algorithm 1 instead of a display: perspective (default) or orthographic; "
    "SCENE goes before it",
    "--eye": "place of the camera, world units (default: before the scene's +Z side); --eye=-1,0,2 if it begins with -",
    "--target": "the point that the camera looks at (default: the middle of the scene)",
    "--up": "a direction that appears upright (default: 0,1,0)",
    "--fov": "vertical field of view of a perspective camera, degrees (default: the scene with a small margin)",
    "--stereo": "two views of a perspective camera, left and right, of eyes this far apart, world units: off-axis "
    "frusta that meet at the target's distance, in the plane of the screen",
    "--resolution": "texels of each texture, or of a lenslet display's panel (default: the display's own; 1024x768 "
    "with --camera)",
    "--guard": f"guard band: texels around each texture that AO looks into, up to {MOST_GUARD} (default: 0)",
    "--radii": "radii of the sampling ball in scene units, or with %% in per cent of the scene's diagonal "
    "(default: 1%%,2%%,3.5%%,6%%,10%%)",
    "--estimator": "how occlusion is estimated; 'lfssao estimators' lists the names (default: lf); a file that ends "
    "in .py is an estimator of one's own, which is run ('lfssao estimators --template' writes a start)",
    "--like": "estimator, parameters, turns and samples of a published shader, in place of their defaults: "
    f"{', '.join(published_names())}, or a .toml file like 'lfssao estimators {published_names()[0]}' prints",
    "--parameter": "a parameter of the estimator in place of its default; may be given several times",
    "--units": "of parameters that are lengths, their defaults too: radii, or world for scene units (default: radii)",
    "--neighbours": "count a sample as occluded only if none of the K nearest modules, or lenses, sees it in the open, "
    "and one that sees it does not: estimator lf-neighbours (default: 0)",
    "--samples": f"samples of each texel and radius, up to {MOST_SAMPLES} (default: the estimator's paper's, LF's 8); "
    "or a file of them, as 'lfssao samples make' writes it, a shader's array, or a manifest's own",
    "--sampling": "latin, jittered, poisson, sobol, ...: any method of the ball that 'lfssao samples make' lists, from "
    "r_min 0.8 to 1, LF's shell (default: the estimator's own, LF's is latin)",
    "--seed": "seed of the samples, 0 to 2**64 - 1 (default: 0)",
    "--blur": f"sigma of the blur, texels, up to {MOST_BLUR:g}; 0: none (default: 1)",
    "--rotate": f"turn each texel's samples: {', '.join(ROTATIONS)}; hash by the seed; or by the radians "
    "or noise vectors of a file, of all texels or a square tile (default: the estimator's own, hash of LF's)",
    "--rotate-rows": "where a file of --rotate, or each of its tiles, begins (default: above)",
    "--light": "a light without shadows, for the layer shaded: a vector of the world towards it; --light=-1,2,3 if it "
    "begins with - (default: none, colour times 1 - AO)",
    "--ambient": "share of the light that is ambient and comes from everywhere, 0 to 1 (default: 0.5)",
    "--occlude": "where AO is with --light: on the ambient term, or on all (default: ambient)",
    "--filter": "how the mesh's colour textures are read: bilinear or nearest (default: bilinear)",
    "--normals": "write world normals too: geometric (default) or smooth, from the mesh's vertices where it has them",
    "--layers": f"keep and write only these of {', '.join(LAYERS)}, and compute only what they need "
    "(default: all but bent, the bent normals of gtao and visibility-bitmask; normals with --normals)",
    "--caster": "what picks each ray's first triangle: exact, with equal bits everywhere, or embree, Embree's own "
    "float32 answers, to show where they differ (default: exact)",
    "--threads": "threads, at most one for each core (default)",
    "--frames": "render each frame into a folder of its own, and animation.png: N frames of one turn about the "
    "vertical, or those of a .json or .npy file of 4x4 matrices that place the scene",
    "--png": "write each shaded texture as an 8-bit sRGB picture too, for projectors that take no EXR",
    "--resume": "keep the textures that an interrupted job left, if their digests are right, and do the rest",
    "--scheduler": "compute on dask.distributed: local (a process for each thread), or tcp://HOST:PORT, or the "
    "FILE in which a scheduler wrote that; its workers must see the same folder",
}

_AO_OPTIONS: dict[str, dict[str, Any]] = {
    "--estimator": {"metavar": "NAME"},
    "--like": {"metavar": "NAME"},
    "--parameter": {"type": values.parameter, "action": "append", "metavar": "NAME=VALUE"},
    "--samples": {"type": values.samples_or_file, "metavar": "N|FILE"},
    "--sampling": {"metavar": "NAME"},
    "--units": {"default": "radii", "metavar": "NAME"},
    "--seed": {"type": values.seed, "metavar": "N"},
    "--blur": {"type": values.blur, "default": 1.0, "metavar": "SIGMA"},
    "--rotate": {"metavar": "NAME|FILE"},
    "--rotate-rows": {"choices": ("above", "below")},
    "--light": {"type": values.vector, "metavar": "X,Y,Z"},
    "--ambient": {"type": values.share, "metavar": "A"},
    "--occlude": {"choices": OCCLUDED},
}


def add_options(command: argparse.ArgumentParser, *, output: bool) -> None:
    """Add the options of a job to a command; ``output``: whether its folder is 'out' by default, or none."""
    add = _helped(command.add_argument)
    add("scene", nargs="?", metavar="SCENE")
    add = _helped(command.add_argument_group("scene").add_argument)
    add("--texture", metavar="IMAGE")
    add("--frames", type=values.frames, metavar="N|FILE")
    add("--filter", default="bilinear", metavar="NAME")
    add = _helped(command.add_argument_group("views").add_argument)
    add("--display", metavar="NAME")
    add("--modules", type=values.module_range, metavar="A[:B]")
    add("--quilt", type=lambda text: tuple(text.split(",")), metavar="LAYER,...")
    add("--camera", nargs="?", const="perspective", metavar="PROJECTION")
    for name in ("--eye", "--target", "--up"):
        add(name, type=values.vector, metavar="X,Y,Z")
    add("--fov", type=values.positive, metavar="DEGREES")
    add("--stereo", type=values.positive, metavar="DISTANCE")
    add("--resolution", type=values.resolution, metavar="WxH")
    add("--guard", type=values.guard, default=0, metavar="N")
    occlusion = command.add_argument_group("occlusion, blur and light").add_argument
    add = _helped(occlusion)
    add("--radii", type=values.radii, metavar="R,R,...")
    add_ao_options(occlusion)
    add("--neighbours", type=values.neighbours, default=0, metavar="K")
    add = _helped(command.add_argument_group("output").add_argument)
    add("-o", "--output", default="out" if output else None, metavar="DIR")
    add("--normals", nargs="?", const="geometric", metavar="KIND")
    add("--layers", type=lambda text: tuple(text.split(",")), metavar="NAME,...")
    add("--png", action="store_true")
    add("--resume", action="store_true")
    add = _helped(command.add_argument_group("computing").add_argument)
    add("--caster", default="exact", metavar="NAME")
    add("--threads", type=values.threads, metavar="N")
    add("--scheduler", type=values.scheduler, metavar="ADDRESS")


def _helped(add_argument: Callable[..., Any]) -> Callable[..., None]:
    """``add_argument`` of a command, or of a group of its options, with the help of each option."""

    def add(*names: str, **more: Any) -> None:
        add_argument(*names, help=_HELP[names[-1]], **more)

    return add


def add_ao_options(add_argument: Callable[..., Any]) -> None:
    """Add the options of AO, blur and light, not of radii, by ``add_argument`` of a group of a command's options."""
    for name, more in _AO_OPTIONS.items():
        add_argument(name, help=_HELP[name], **more)


def job_of(options: argparse.Namespace, threads: int) -> Job:
    """The job that the options describe: checked as far as that can be, then the scene is loaded (InputError)."""
    display = _display(options)
    if options.scene is None:
        options.scene = "turntable" if isinstance(options.frames, int) else "gallery"
    names = "normals", "neighbours", "caster", "layers"
    more = {"color_filter": options.filter, **{name: getattr(options, name) for name in names}}
    sampling, settings = ao_settings(options, (0.0,), _sizes(options, display), **more)  # the radii depend on the scene
    if options.output is not None:
        check_folder(Path(options.output))
    mesh = find_scene(options.scene, options.texture)
    if mesh.degenerate:
        faces = "1 face without an area is" if mesh.degenerate == 1 else f"{mesh.degenerate} faces without an area are"
        say(f"{mesh.name}: {faces} left out")
    for note in mesh.notes:
        say(f"{mesh.name}: {note}")
    given = [r / 100 * diagonal(mesh) if per_cent else r for r, per_cent in options.radii or ()]
    settings = replace(settings, radii=tuple(given) or default_radii(mesh))
    transforms, boxes, whole_box = _frames(options, mesh)
    views, neighbours = _views(options, mesh, display, whole_box)
    for width, height in {(view.width, view.height) for view in views}:
        texel_bytes = find_estimator(settings.estimator).texel_bytes
        bent = "bent" in settings.kept
        check_memory(width, height, len(settings.radii), texel_bytes, bent)
    doubts.warn(doubts.of_display(display))
    doubts.warn(doubts.of_radii(mesh, views, settings, boxes))
    head = {
        "machine": manifest.describe_machine(threads, options.command),
        "scene": manifest.describe_scene(mesh),
        "display": None if options.camera is not None or isinstance(display, ViewSet) else asdict(display),
        **({display.KIND: asdict(display)} if isinstance(display, ViewSet) else {}),
        "camera": options.camera,
        **({} if options.stereo is None else {"stereo": options.stereo}),
        "sampling": sampling,
        "settings": manifest.describe_settings(settings),
    }
    frames = tuple(boxes), transforms
    folder = Path(options.output or ".")
    quilts = _quilts(options, display, settings, mesh, len(views))
    whole = isinstance(display, ViewSet) and display.KIND == "lenslet" and len(views) == display.count
    forms = {"png": options.png, "quilts": quilts, "panel": whole}
    return Job(mesh, tuple(views), settings, folder, head, tuple(neighbours), *frames, **forms)


def _frames(options: argparse.Namespace, mesh: Mesh) -> tuple[tuple[Matrix, ...] | None, list[Box], Box]:
    """World -> world of each frame, None for a still; the scene's box in each; and the box around all of these.

    There is one box for all frames, so that the scene's scale on the display stays what it is.
    """
    if options.frames is None:
        return None, [mesh.bounds], mesh.bounds
    from lfssao.rendering import animation  # late: most jobs are of a still

    if isinstance(options.frames, int):
        transforms = animation.turntable(mesh.bounds, options.frames)
    else:
        with errors_of("--frames"):
            transforms = animation.read_transforms(options.frames)
    boxes = animation.frame_bounds(mesh, transforms)
    return tuple(transforms), boxes, animation.swept_bounds(boxes)


def _display(options: argparse.Namespace) -> Display | ViewSet:
    """The display that is asked for, a set of views as they are rendered; the options of a camera are checked too."""
    if options.camera is not None:
        from lfssao.optics.camera import PROJECTIONS  # late: most jobs are of a display

        if options.camera not in PROJECTIONS:
            more = "" if options.scene is not None else "; SCENE goes before --camera"
            raise InputError(f"--camera: {no_such('projection', options.camera, PROJECTIONS)}{more}")
        for name in ("display", "modules", "neighbours"):
            if getattr(options, name) not in (None, 0):
                raise InputError(f"--{name} does not go with --camera, which renders one ordinary view")
    elif any(getattr(options, name) is not None for name in _PLACED):
        raise InputError("--eye, --target, --up and --fov place a camera: they need --camera")
    elif options.stereo is not None:
        raise InputError("--stereo is of the two eyes of a camera: it needs --camera")
    with errors_of("--display"):
        found = find_views("sample-a" if options.display is None else options.display)
    if isinstance(found, ViewSet) and options.resolution is not None:
        return found.with_resolution(*options.resolution)
    return found


def _sizes(options: argparse.Namespace, display: Display | ViewSet) -> set[Size]:
    """Return sizes of the textures that are rendered, guard bands included."""
    if isinstance(display, ViewSet):
        sizes = display.sizes
    elif options.camera is not None or options.resolution is not None:
        sizes = {options.resolution or CAMERA_RESOLUTION}
    else:
        sizes = {(module.width, module.height) for module in display.modules}
    return {(width + 2 * options.guard, height + 2 * options.guard) for width, height in sizes}


def _quilts(
    options: argparse.Namespace, display: Display | ViewSet, settings: Settings, mesh: Mesh, count: int
) -> dict[str, str]:
    """Return names of the pictures of all views of a quilt by layers; none by default where one is missing."""
    asked = options.quilt
    kept = settings.kept
    if not isinstance(display, ViewSet) or display.KIND != "quilt" or count < display.count:
        if asked is not None:
            raise InputError("--quilt is for all views of a quilt: it needs --display of one, and no --modules")
        return {}
    from lfssao.optics.quilt import Quilt  # late: most displays have modules

    assert isinstance(display, Quilt)
    shown = ["merged", "blurred", "shaded", *(["color"] if mesh.paint is not None else [])]
    layers = [name for name in shown if name in kept]
    layers += [f"ao_{k + 1}" for k in range(len(settings.radii)) if "ao" in kept]
    for name in asked or ():
        with errors_of("--quilt"):
            check_choice("layer", name, layers)
    return {name: display.file_name(name) for name in asked or layers if asked or name == "shaded"}


def ao_settings(
    options: argparse.Namespace, radii: tuple[float, ...], sizes: Collection[Size], **more: Any
) -> tuple[dict[str, Any], Settings]:
    """Return the manifest's entry of the samples, and the settings of ``add_ao_options``'s options, and of ``more``.

    ``sizes`` are those of the textures with their guard bands.
    """
    others = estimators.take_published(options)
    with errors_of("--estimator"):
        estimator = estimators.chosen(options.estimator)
    parameters = estimators.read_parameters(estimator, options.parameter, others)
    turning = (options.rotate or estimator.rotation) == "hash"  # takes the seed, where samples do not
    own = estimator.sampling is None or isinstance(options.samples, Path)
    seed = None if turning and options.sampling is None and own else options.seed
    sampling, samples, weights = estimators.read_samples(estimator, options.sampling, options.samples, seed)
    return sampling, Settings(
        radii=radii,
        samples=samples,
        blur=options.blur,
        estimator=estimator.name,
        parameters=parameters,
        units=options.units,
        weights=weights,
        rotation=estimators.read_rotation(options, sizes),
        rotation_seed=options.seed or 0,
        light=_light(options),
        **more,
    )


def _light(options: argparse.Namespace) -> Light | None:
    given = {name: getattr(options, name) for name in ("ambient", "occlude") if getattr(options, name) is not None}
    if options.light is None and given:
        raise InputError("--ambient and --occlude are of a light: they need --light")
    with errors_of("--light"):
        return None if options.light is None else Light(options.light, **given)


def _views(
    options: argparse.Namespace, mesh: Mesh, display: Display | ViewSet, bounds: NDArray[np.float64]
) -> tuple[list[View], list[tuple[View, ...]]]:
    """The views that are rendered, and for each module those of the modules that it asks."""
    if options.camera is not None:
        from lfssao.optics.camera import Camera  # late: most jobs are of a display

        place = {name: getattr(options, name) for name in _PLACED}
        width, height = options.resolution or CAMERA_RESOLUTION
        if options.scene == "corner" and set(place.values()) == {None}:
            camera = Camera(options.camera, *TEST_VIEW)
        else:
            camera = Camera.placed(bounds, options.camera, **place, size=(width, height))
        check_positions(bounds, height / camera.extent)
        if options.stereo is not None:
            with errors_of("--stereo"):
                return list(camera.stereo(width, height, options.stereo, options.guard)), [(), ()]
        return [camera.view(width, height, options.guard)], [()]
    if options.resolution is not None and isinstance(display, Display):
        display = display.with_resolution(*options.resolution)
    more = options.modules, options.guard, bounds
    return module_views(mesh, display, *more), neighbour_views(mesh, display, options.neighbours, *more)
