"""``lfssao view``: what an eye sees of a display, from the textures that ``lfssao render`` wrote."""

import argparse
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from lfssao.cli.terminal import printable, progress, say, working
from lfssao.cli.values import check_target, finite, module_range, positive, whole
from lfssao.errors import InputError, check_choice
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_whole
from lfssao.optics.display import Display
from lfssao.optics.lenslet import LensletDisplay
from lfssao.optics.quilt import Quilt
from lfssao.rendering.contact import write_animation
from lfssao.rendering.folder import fill, read_views
from lfssao.rendering.lenslet_viewer import LensletView
from lfssao.rendering.output import SHEET, VIEW
from lfssao.rendering.page.page import eye_page
from lfssao.rendering.viewer import BLENDS, LightField, Photograph, eye_point, eye_range

MOST_WIDTH = 16_384
WIDTH = 1024
PAGE_WIDTH = 900
MOST_FRAMES = 1000
FRAMES = 24


def add_to(view: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    view.description = """Compose what an eye on the observer line, or in the plane before a lenslet display, sees of a
        display from the textures that 'lfssao render' wrote, as a photograph of the display would show it (LF
        figure 14)."""
    view.set_defaults(run=_view)
    add = view.add_argument
    add("folder", metavar="DIR", help="a folder that 'lfssao render' wrote, of a display of at least two modules")
    add = view.add_argument_group("eye").add_argument
    place = "place of the eye along the observer line, metres; the command says how far eyes may go (default: 0)"
    add("--eye-x", type=finite, metavar="X", help=place)
    above = "height of the eye above the middle of a lenslet display, metres (default: 0)"
    add("--eye-y", type=finite, metavar="Y", help=above)
    distance = "metres from the observers to the screen (default: the display's, for which textures are drawn)"
    add("--distance", type=positive, metavar="D", help=distance)
    orbit = f"""an animation of N frames (even) along the observer line, from the leftmost to the rightmost eye that the
        modules reach from the whole screen, or to which each lens shows its own image, and back (default: {FRAMES})"""
    add("--orbit", type=_even, nargs="?", const=FRAMES, metavar="N", help=orbit)
    add = view.add_argument_group("picture").add_argument
    named = "picture to write, .png, with --orbit animated (default: DIR/eye.png or orbit.png)"
    add("-o", "--output", metavar="FILE", help=named)
    page = """write a page without network instead, on which the eye moves by mouse and keys and AO is switched; it
        blends shaded textures linearly, within one 8-bit code of the picture, and shows flat screens, quilts, stereo
        pairs and, in the picture's bits, lenslet displays"""
    add("--html", metavar="FILE", help=page)
    add("--modules", type=module_range, metavar="A[:B]", help="modules or lenses A to B - 1, or A alone (default: all)")
    add("--layer", default="shaded", metavar="NAME", help="shaded, color, or ao_1, merged, ... (default: shaded)")
    add("--blend", default="linear", metavar="NAME", help="of modules: nearest, linear or gaussian (default: linear)")
    across = f"pixels across (default: {WIDTH}; {PAGE_WIDTH} with --html)"
    add("--width", type=whole(1, MOST_WIDTH), metavar="N", help=across)


def _even(text: str) -> int:
    count = whole(2, MOST_FRAMES)(text)
    if count % 2:
        raise argparse.ArgumentTypeError(f"{count} is odd: as many frames come back as go")
    return count


def _view(options: argparse.Namespace) -> None:
    if options.html is not None:
        _write_page(options)
        return
    folder = Path(options.folder)
    animated = options.orbit is not None
    if not os.path.isdir(folder):  # Path's raises where a name is too long
        raise InputError(f"{folder}: there is no such folder; 'lfssao render -o {folder}' makes one")
    if animated and options.eye_x is not None:
        raise InputError("--eye-x does not go with --orbit, which moves the eye")
    target = folder / ("orbit.png" if animated else "eye.png") if options.output is None else Path(options.output)
    check_target("--output", target, (".png",))
    if target.resolve() in [(folder / name).resolve() for name in (VIEW, SHEET)]:
        raise InputError(f"--output: {target} is a picture of 'lfssao render', take another name")
    check_choice("--blend", options.blend, BLENDS)
    display, entries = read_views(folder, options.layer, options.modules)
    options.width = options.width or WIDTH
    if isinstance(display, Quilt):
        raise InputError(f"{folder}: its manifest: it describes {display.TITLE}, which an eye sees by --html alone")
    if isinstance(display, LensletDisplay):
        scene = _lenses(display, entries, options)
    else:
        scene = _modules(display, entries, options)
    pictures = _pictures(scene)
    with working("write"):
        if animated:
            write_animation(target, [*pictures, *pictures[-2:0:-1]])
        else:
            write_whole(target, pictures[0].save)
    print(printable(f"{target}: {scene.reach}"), flush=True)


class _Scene(NamedTuple):
    """A display that eyes look at."""

    eyes: list[float]  # places along x, metres
    photograph: Callable[[float], Photograph]
    reach: str  # in words, which eyes its light goes to


def _modules(display: Display, entries: dict[int, dict[str, Any]], options: argparse.Namespace) -> _Scene:
    """Return a display of modules, seen by eyes on the observer line."""
    if options.eye_y is not None:
        raise InputError(f"--eye-y is for lenslet displays: the observers of {display.name} stand on a line")
    if options.distance is not None:
        display = replace(display, observer_z=-options.distance)
    eyes = [options.eye_x or 0.0] if options.orbit is None else _there(*eye_range(display, list(entries)), options)
    for eye in eyes:
        eye_point(display, eye)
    # Many eyes see all columns.
    shots = [(eyes[0], options.width, options.blend)] if options.orbit is None else None
    field = LightField(display, list(entries), _channels(entries, options), shots)
    _fill(field, entries, options)
    try:
        left, right = eye_range(display, list(entries))
        reach = f"the modules' light goes to eyes from x = {left:.2f} to {right:.2f} m"
    except InputError as error:
        reach = str(error)
    return _Scene(eyes, partial(field.photograph, width=options.width, blend=options.blend), reach)


def _lenses(display: LensletDisplay, entries: dict[int, dict[str, Any]], options: argparse.Namespace) -> _Scene:
    """Return a lenslet display, seen by eyes in the observers' plane."""
    if options.blend != "linear":
        raise InputError(f"--blend is for displays of modules: an eye sees the lenses of {display.name} as they are")
    if options.distance is not None:
        display = replace(display, observer_distance=options.distance)
    box = display.eye_box
    eye_y = options.eye_y or 0.0
    if options.orbit is not None and not box > 0:
        raise InputError(f"--orbit: there is no eye that sees each lens of {display.name} show its own image alone")
    eyes = [options.eye_x or 0.0] if options.orbit is None else _there(-box, box, options)
    view = LensletView(display, list(entries), _channels(entries, options))
    _fill(view, entries, options)
    reach = "there is no eye that sees each lens show its own image alone"
    if box > 0:
        reach = f"each lens shows its own image alone to eyes within x, y = -{box:.2g} to {box:.2g} m"
    return _Scene(eyes, lambda eye_x: view.photograph(eye_x, eye_y, options.width), reach)


def _there(left: float, right: float, options: argparse.Namespace) -> list[float]:
    """Return the eyes of an animation on the way there; the way back repeats these in reverse."""
    return [left + (right - left) * (2 * n / options.orbit) for n in range(options.orbit // 2 + 1)]


def _channels(entries: dict[int, dict[str, Any]], options: argparse.Namespace) -> int:
    return len(next(iter(entries.values()))["textures"][options.layer]["channels"])


def _fill(field: LightField | LensletView, entries: dict[int, dict[str, Any]], options: argparse.Namespace) -> None:
    bar = partial(progress, total=len(entries), desc="read", unit="module")
    fill(field, Path(options.folder), [options.layer], entries, bar)


def _write_page(options: argparse.Namespace) -> None:
    others = options.orbit, options.output, options.distance, options.layer, options.blend
    if others != (None, None, None, "shaded", "linear"):
        raise InputError("--html does not go with --orbit, --output, --distance, --layer or --blend")
    target = check_target("--html", Path(options.html), (".html",))

    def bar(steps: Any, total: int) -> Any:
        return progress(steps, total=total, desc="read", unit="module")

    width = options.width or PAGE_WIDTH
    eye_page(options.folder, options.modules, options.eye_x, width, bar, options.eye_y).save(target)
    print(printable(f"open {target}: drag the picture to move the eye"), flush=True)


def _pictures(scene: _Scene) -> list[Image.Image]:
    """The pictures as Pillow has them, 8-bit sRGB; visibility is shown as it is, 0 black and 1 white, not as light."""
    pictures = []
    dark = 0
    with progress(scene.eyes, desc="view", unit="frame", disable=None if len(scene.eyes) > 1 else True) as bar:
        for eye in bar:
            shot = scene.photograph(eye)
            is_light = shot.image.shape[2] == 3
            codes = to_codes(shot.image) if is_light else (np.clip(shot.image, 0, 1) * 255 + 0.5).astype(np.uint8)
            pictures.append(Image.fromarray(codes if is_light else np.repeat(codes, 3, axis=2)))
            dark = max(dark, shot.dark)
    if 0 < dark < pictures[0].width * pictures[0].height:  # of one that is all black the library warns
        per_cent = 100 * dark / (pictures[0].width * pictures[0].height)
        say(f"{per_cent:.3g} % of the screen is black: no light reaches the eye from there")
    return pictures
