"""The command line: reads options, calls the library, and says in one sentence what was wrong."""

import _thread
import argparse
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

from lfssao import __version__
from lfssao.errors import InputError, LfssaoError

if TYPE_CHECKING:
    from lfssao.display import FlatDisplay
    from lfssao.raycast import RayCaster
    from lfssao.render import Settings
    from lfssao.scene.mesh import Mesh
    from lfssao.view import View

BAD_INPUT = 2
INTERRUPTED = 130

CAMERA_RESOLUTION = (1024, 768)

# Beyond these a command would run for hours or fill the memory, and nobody means it.
MOST_SAMPLES = 65_536
MOST_BLUR = 1024.0  # texels
MOST_THREADS = 1024
LARGEST_RADIUS = 1e30  # as of coordinates (Mesh): sums of both are float32


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence, without the usage lines."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message.removeprefix('argument ')} (see {self.prog} --help)")


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
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        options = _parser().parse_args(_with_negative_values(words))
        options.command = ["lfssao", *words]
        with _interruptible():
            options.run(options)
    except LfssaoError as error:
        _say(str(error))
        return BAD_INPUT
    except MemoryError:
        _say("there is not enough memory")
        return BAD_INPUT
    except KeyboardInterrupt:
        _say("interrupted; every file that was written is whole")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the output has gone; Python would complain once more when it exits
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return 0


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C as KeyboardInterrupt, but never inside llvmlite, whose callbacks from C would lose it.

    Lost there, a render would go on to its end, or numba would stumble over code that it believes compiled.
    """
    ours = (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if ours:
        signal.signal(signal.SIGINT, _on_interrupt)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _on_interrupt(_signal: int, frame: FrameType | None) -> None:
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            again = threading.Timer(0.02, _thread.interrupt_main)
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _say(sentence: str) -> None:
    print(f"lfssao: {_printable(sentence)}", file=sys.stderr)


def _printable(text: str) -> str:
    """Text on one line, for any terminal: file names may hold anything."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _with_negative_values(words: list[str]) -> list[str]:
    """``--radii -1,2`` as ``--radii=-1,2``: argparse would take the value for an option and say that it is missing."""
    out: list[str] = []
    for word in words:
        if out and re.fullmatch(r"--[a-z]+", out[-1]) and re.match(r"-([0-9.]|inf|nan)", word):
            out[-1] += f"={word}"
        else:
            out.append(word)
    return out


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="lfssao", description="Screen-space ambient occlusion for light field displays.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"lfssao {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_render(commands)
    return parser


def _add_render(commands: Any) -> None:
    render = commands.add_parser(
        "render",
        allow_abbrev=False,
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
    add("-o", "--output", required=True, metavar="DIR", help="folder to write to; made if not there, files replaced")
    add(
        "--texture",
        metavar="IMAGE",
        help="an image for a mesh file with texture coordinates, in place of those that the file names",
    )
    add("--display", metavar="NAME", help="virtual or sample-a (default: virtual)")
    add("--modules", type=_module_range, metavar="A:B", help="modules A to B - 1 only (default: all)")
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
        type=_resolution,
        metavar="WxH",
        help="texels of each texture (default: the display's own; 1024x768 with --camera)",
    )
    add(
        "--radii",
        type=_radii,
        metavar="R,R,...",
        help="radii of the sampling ball in scene units, or with %% in shares of the scene's diagonal "
        "(default: 1%%,2%%,3.5%%,6%%,10%%)",
    )
    add(
        "--samples",
        type=_samples,
        default=8,
        metavar="N",
        help=f"samples of each texel and radius, up to {MOST_SAMPLES} (default: 8)",
    )
    add("--sampling", default="latin", metavar="NAME", help="random, jittered or latin (default: latin)")
    add(
        "--blur",
        type=_blur,
        default=1.0,
        metavar="SIGMA",
        help=f"sigma of the blur, texels, up to {MOST_BLUR:g}; 0: none (default: 1)",
    )
    add("--seed", type=_seed, default=0, metavar="N", help="seed of the samples, 0 to 2**64 - 1 (default: 0)")
    add("--threads", type=_threads, metavar="N", help="threads, at most one for each core (default)")


def _whole(text: str, least: int, most: int, most_text: str = "") -> int:
    """A whole number in a range; digits only, as int() would also take 1_0 and digits of other scripts."""
    if not re.fullmatch(r"[+-]?[0-9]+", text, re.ASCII):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a whole number")
    # Python refuses to convert thousands of digits; forty are out of every range.
    digits = text.lstrip("+-").lstrip("0") or "0"
    number = int(digits[:40]) * (-1 if text.startswith("-") else 1)
    if not least <= number <= most:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not from {least} to {most_text or most}")
    return number


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:37]}..."


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a number") from None


def _samples(text: str) -> int:
    return _whole(text, 1, MOST_SAMPLES)


def _seed(text: str) -> int:
    return _whole(text, 0, 2**64 - 1, "2**64 - 1")


def _threads(text: str) -> int:
    return _whole(text, 1, MOST_THREADS)


def _blur(text: str) -> float:
    sigma = _number(text)
    if not 0 <= sigma <= MOST_BLUR:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not a sigma from 0 to {MOST_BLUR:g} texels")
    return sigma


def _module_range(text: str) -> range:
    found = re.fullmatch(r"([0-9]{1,9}):([0-9]{1,9})", text, re.ASCII)
    if not found:
        raise argparse.ArgumentTypeError(
            f"'{_short(text)}' is not a range A:B of two whole numbers, such as 0:3 for modules 0, 1 and 2"
        )
    start, stop = int(found[1]), int(found[2])
    if start >= stop:
        raise argparse.ArgumentTypeError(f"'{text}' holds no module: A:B needs A < B")
    return range(start, stop)


def _resolution(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([0-9]{1,18})x([0-9]{1,18})", text, re.ASCII)
    if not found or int(found[1]) == 0 or int(found[2]) == 0:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not WIDTHxHEIGHT in texels, such as 1024x768")
    return int(found[1]), int(found[2])


def _radii(text: str) -> tuple[tuple[float, bool], ...]:
    """Each radius with whether it is a share, in per cent, of the scene's diagonal."""
    radii = []
    for word in text.split(","):
        number = _number(word.removesuffix("%"))
        if not 0 <= number <= LARGEST_RADIUS:
            raise argparse.ArgumentTypeError(f"{_short(word)} is not a radius from 0 to {LARGEST_RADIUS:g}")
        radii.append((number, word.endswith("%")))
    return tuple(radii)


def _render(options: argparse.Namespace) -> None:
    """``lfssao render``: check everything that can be checked, then load, then make the folder, cast and write."""
    start = time.perf_counter()
    threads = min(options.threads or MOST_THREADS, _core_count())
    if not options.output:
        raise InputError("--output is empty, it must name a folder")
    folder = Path(options.output)
    display = _display(options)
    settings_of = _settings_maker(options)
    _check_size(options, display)
    from lfssao.files import check_folder

    check_folder(folder)
    mesh = _load(options.scene, options.texture)
    loaded = time.perf_counter() - start
    _say_what_was_left_out(mesh)
    _run_job(options, mesh, display, settings_of(mesh), folder, threads, loaded)


def _core_count() -> int:
    """Cores that this process may use, and that numba has threads for."""
    import numba  # late: takes a third of a second to import

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    return int(min(cores, numba.config.NUMBA_NUM_THREADS))


def _display(options: argparse.Namespace) -> "FlatDisplay":
    """The display asked for; that there is a camera instead of one is checked too."""
    from lfssao.camera import PROJECTIONS  # late: numba is imported behind this line
    from lfssao.display import find_display

    if options.camera is not None:
        if options.camera not in PROJECTIONS:
            raise InputError(
                f"--camera: there is no projection '{options.camera}': choose one of {', '.join(PROJECTIONS)}"
            )
        for name in ("display", "modules"):
            if getattr(options, name) is not None:
                raise InputError(f"--{name} does not go with --camera, which renders one ordinary view")
    try:
        display = find_display("virtual" if options.display is None else options.display)
    except InputError as error:
        raise InputError(f"--display: {error}") from None
    if options.modules is not None and options.modules.stop > len(display.modules):
        raise InputError(
            f"--modules {options.modules.start}:{options.modules.stop}: {display.name} has modules "
            f"0:{len(display.modules)}"
        )
    return display


def _check_size(options: argparse.Namespace, display: "FlatDisplay") -> None:
    from lfssao.job import check_memory
    from lfssao.render import DEFAULT_RADII

    sizes = [(module.width, module.height) for module in display.modules]
    if options.camera is not None:
        sizes = [CAMERA_RESOLUTION]
    if options.resolution is not None:
        sizes = [options.resolution]
    for width, height in dict.fromkeys(sizes):
        check_memory(width, height, len(options.radii or DEFAULT_RADII))


def _settings_maker(options: argparse.Namespace) -> Callable[["Mesh"], "Settings"]:
    """Make the samples now; return what makes the settings once the scene's size is known."""
    from lfssao.render import Settings, default_radii, diagonal
    from lfssao.samples import make_samples

    try:
        samples = make_samples(options.sampling, options.samples, options.seed)
    except InputError as error:
        raise InputError(f"--sampling: {error}") from None

    def settings(mesh: "Mesh") -> "Settings":
        radii = default_radii(mesh)
        if options.radii is not None:
            radii = tuple(r / 100 * diagonal(mesh) if share else r for r, share in options.radii)
        if max(radii) > LARGEST_RADIUS:
            raise InputError(f"--radii: {max(radii):g} scene units is more than {LARGEST_RADIUS:g}")
        return Settings(radii, samples, options.blur)

    return settings


def _load(scene: str, texture: str | None) -> "Mesh":
    from lfssao.scene.builtin import BUILTIN, builtin_scene
    from lfssao.scene.load import load_scene

    # The embedded scenes' names have no ending, which a mesh file needs: a folder of that name does not matter.
    if scene in BUILTIN:
        if texture is not None:
            raise InputError(f"--texture: the embedded scene {scene} takes none")
        return builtin_scene(scene)
    if not Path(scene).suffix and not Path(scene).exists():
        raise InputError(f"{scene}: there is no such file, and no embedded scene of that name ({', '.join(BUILTIN)})")
    return load_scene(scene, texture)


def _say_what_was_left_out(mesh: "Mesh") -> None:
    if mesh.degenerate:
        faces = "1 face without an area is" if mesh.degenerate == 1 else f"{mesh.degenerate} faces without an area are"
        _say(f"{mesh.name}: {faces} left out")
    for note in mesh.notes:
        _say(f"{mesh.name}: {note}")


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
    import numba

    from lfssao import manifest
    from lfssao.files import output_folder
    from lfssao.raycast import RayCaster

    numba.set_num_threads(threads)
    views = _views(options, mesh, display)
    head = {
        "machine": manifest.describe_machine(threads, options.command),
        "scene": manifest.describe_scene(mesh),
        "display": None if options.camera is not None else manifest.describe_display(display),
        "camera": options.camera,
        "sampling": {"method": options.sampling, "count": options.samples, "seed": options.seed},
        "settings": manifest.describe_settings(settings),
    }
    start = time.perf_counter()
    caster = RayCaster(mesh, views[0].cast_from_world, threads)
    seconds = {"load": loaded, "build_bvh": time.perf_counter() - start}
    with output_folder(folder):
        _write_views(caster, views, settings, folder, head, seconds)
    print(
        _printable(f"{folder}: {len(views)} EXR file{'s' * (len(views) > 1)}, manifest.json, contact.png"), flush=True
    )


def _write_views(
    caster: "RayCaster",
    views: "list[View]",
    settings: "Settings",
    folder: Path,
    head: dict[str, Any],
    seconds: dict[str, float],
) -> None:
    from tqdm import tqdm

    from lfssao.job import Job
    from lfssao.render import render_view

    job = Job(folder, settings, len(views), head)
    start = time.perf_counter()
    # disable=None: a bar on a terminal, nothing in a pipe. `with` ends its line before a message of what went wrong.
    with tqdm(views, unit="module", disable=None, ncols=_bar_width()) as bar:
        for view in bar:
            job.add(render_view(caster, view, settings))
    job.finish({**seconds, "render": time.perf_counter() - start})


def _bar_width() -> int | None:
    """80 columns on a terminal that does not know how many it has, as tqdm would show nothing; else tqdm's choice."""
    try:
        columns = os.get_terminal_size(sys.stderr.fileno()).columns
    except (OSError, ValueError):
        return None
    return None if columns else 80
