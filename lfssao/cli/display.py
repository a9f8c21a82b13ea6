"""``lfssao display``: a display's TOML file, checked, or a drawing of it from above."""

import argparse
from pathlib import Path

from lfssao.errors import InputError
from lfssao.optics.display_file import KINDS, ViewSet, display_names, display_text, find_display, find_views
from lfssao.rendering import doubts


def add_to(display: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    display.description = """Print the TOML file of a preset display, with the source of every value, or of a file after
        checking it; change it and hand it to 'lfssao render --display FILE.toml'. Without NAME: say what each preset
        is."""
    display.set_defaults(run=_display)
    display.add_argument("name", nargs="?", metavar="NAME", help="a preset, or a file whose name ends in .toml")
    drawing = """draw modules, screen, observers, region of interest and rays, from above and from the side, into FILE
        (.png, .svg or .pdf; default: NAME.png)"""
    display.add_argument("--plot", nargs="?", const="", metavar="FILE", help=drawing)


def _display(options: argparse.Namespace) -> None:
    if options.name is None:
        if options.plot is not None:
            raise InputError("--plot needs the NAME of a display")
        for name in [name for kind in KINDS for name in display_names(kind)]:
            shown = find_views(name)
            about = display_text(name).split("\n", 1)[0].removeprefix("# ")
            size = f"{shown.screen_width:.3g} x {shown.screen_height:.3g} m"
            if isinstance(shown, ViewSet):
                print(f"{name}: {about} {size}, {shown.summary}")
                continue
            many = f"{len(shown.modules)} module{'s' * (len(shown.modules) > 1)}"
            print(f"{name}: {about} {size}, {many}, {shown.diffuser} diffuser")
        return
    display = find_views(options.name)
    doubts.warn(doubts.of_display(display))
    if options.plot is None:
        is_file = Path(options.name).suffix == ".toml"
        print(Path(options.name).read_text(encoding="utf-8") if is_file else display_text(options.name), end="")
        return
    from lfssao.viz.display import save_drawing  # late: matplotlib takes a second to import

    target = Path(options.plot or f"{Path(options.name).stem}.png")
    save_drawing(find_display(options.name), target)
    print(target)
