"""``lfssao agree``: how far views differ in the occlusion that they give the same point of the surface."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lfssao.cli import values
from lfssao.cli.terminal import printable, progress, working
from lfssao.errors import InputError, errors_of
from lfssao.files.whole import write_text, write_whole
from lfssao.rendering.points import Texture, Values
from lfssao.verify.agree.measure import LIMIT, Disagreement, Shared, disagreement, share_points
from lfssao.verify.agree.split import SameSamples, Split, estimated, has_seed, other_samples, split
from lfssao.verify.agree.views import RenderedView, Renderer, open_folders, read_views

if TYPE_CHECKING:
    from lfssao.verify.agree.bugs import Found


def add_to(agree: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    agree.description = """Measure how far two or more views differ in the occlusion that they give the same point of
        the surface, what shimmers for a viewer who moves, and name the bug of another renderer's set of views."""
    agree.set_defaults(run=_agree)
    add = agree.add_argument
    add("folders", nargs="+", metavar="FOLDER", help="a folder that 'lfssao render' wrote, or a file of one")
    add("--layer", default="ao_1", metavar="NAME", help="ao_1, merged, blurred, ... (default: ao_1)")
    add("--modules", type=values.module_range, metavar="A:B", help="views of these numbers only (default: all)")
    near = """how far the surface that a view sees may be from a point that it counts as seen, scene units (default: the
        diagonal of all that is seen times 2 / the texels of a row)"""
    add("--same", type=values.positive, metavar="X", help=near)
    add = agree.add_argument_group("another renderer").add_argument
    mine = (
        "a folder or a file of another renderer for all FOLDERs, or one for each in their order; may be given so often"
    )
    add("--mine", action="append", metavar="FOLDER", help=mine)
    for name, form in (("--map", "MINE=LAYER"), ("--files", "PATTERN=LAYER")):
        add(name, action="append", default=[], metavar=form, help="names of --mine's, as of 'lfssao compare'")
    add = agree.add_argument_group("rays").add_argument
    add("--truth", action="store_true", help="ray-cast occlusion at the same points, beside the others")
    add(
        "--mesh",
        metavar="FILE",
        help="the mesh that was rendered, for --truth and for --mine's depth (embedded scenes are at hand)",
    )
    of_own = "the Python file of the estimator of one's own that FOLDERs were made with; it is run"
    add("--estimator", metavar="FILE", help=of_own)
    add = agree.add_argument_group("reports").add_argument
    picture = "draw the points of the first view, coloured by the deviation of their values (.png, .svg or .pdf)"
    add("--picture", metavar="FILE", help=picture)
    add("--json", metavar="FILE", help="write all figures as JSON; -: to standard output, in place of the text")


def _check(options: argparse.Namespace, rules: dict[str, str]) -> None:
    """Refuse options that do not go together, and files that cannot be (InputError)."""
    for name, endings in (("json", (".json",)), ("picture", values.PICTURES)):
        target = getattr(options, name)
        if target is not None and (name, target) != ("json", "-"):
            values.check_target(f"--{name}", Path(target), endings)
    if options.mine is None and (rules or options.files):
        raise InputError("--map and --files are of --mine, which is not given")
    if options.mesh is not None and not options.truth and options.mine is None:
        raise InputError("--mesh is of --truth and --mine, and neither is given")


def _agree(options: argparse.Namespace) -> None:
    rules = values.rules(options.map, "MINE=LAYER")
    _check(options, rules)
    if options.estimator is not None:
        from lfssao.ao.estimators.own import read_estimator  # as in cli/estimators.py

        with errors_of("--estimator"):
            read_estimator(options.estimator)
    read: dict[str, Values] = {}
    renderer: Renderer | None = None
    with working("read"):
        folders = open_folders([Path(path) for path in options.folders], options.layer)
        views = read_views(folders, options.modules)
        shared = share_points(views, options.same)
        if options.mine is not None:
            renderer = Renderer([Path(path) for path in options.mine], folders, rules, options.files)
            read["mine"] = shared.read([renderer.read(view) for view in views], "--mine")
        own = [view.arrays[options.layer] for view in views]
        read["reference"] = shared.read(own, "the reference")
    parts = _split(shared, own)
    bugs = None if renderer is None else _bugs(renderer, views, options.mesh)
    noise = None
    if options.truth:
        read["rays"], noise = _cast(shared, options.mesh)
    found = {name: disagreement(each) for name, each in read.items()}
    results: dict[str, Any] = {
        "layer": options.layer,
        "views": [view.name for view in views],
        "same": shared.tolerance,
        "points": shared.candidates,
        "shared": len(shared.points),
        "pairs": shared.pairs,
        "limit": LIMIT,
        "disagreement": {name: vars(each) for name, each in found.items()},
        "noise_of_rays": noise,
        "parts_of_reference": parts and vars(parts),
        "bugs": bugs and [vars(bug) for bug in bugs.bugs],
        "unexplained": bugs and bugs.unexplained,
    }
    if options.picture is not None:
        _draw(Path(options.picture), shared, read)
    if options.json is not None:
        text = json.dumps(results, indent=1, allow_nan=False)
        if options.json == "-":
            print(text)
            return
        write_text(Path(options.json), f"{text}\n")
    head = f"{len(views)} views, {shared.candidates:,} points of their surfaces: {len(shared.points):,} are seen by two"
    print(printable(f"{head} or more, within {shared.tolerance:.3g}, in {shared.pairs:,} pairs of values"))
    for line in _table(options.layer, found):
        print(printable(line))
    square = found["reference"].rms ** 2
    if parts is not None and square > 0:
        named = {"noise of samples": parts.noise, "missing surface": parts.missing, "the rest": parts.rest}
        shares = [f"{100 * part / square:.1f} % {name}" for name, part in named.items() if part is not None]
        print(f"the reference's squared differences are {', '.join(shares)}")
    for line in [] if bugs is None else bugs.lines():
        print(printable(line))
    if noise is not None:
        print(f"rays: noise of their own has an RMS of {noise:.4f}")


def _split(shared: Shared, own: Sequence[Texture]) -> Split | None:
    """Return the parts of the reference's disagreement; None where its samples have no other seed."""
    if not all(map(has_seed, shared.views)):
        return None
    with progress(shared.views, desc="other seed", unit="view") as bar:
        others = [estimated(view, other_samples(view), 1) for view in bar]
    alike = SameSamples(shared)
    if not alike.is_known:
        return split(shared, own, others)
    with working("parts"):
        same_samples = alike.values(own, None, 0), alike.values(others, other_samples(shared.views[0]), 1)
    return split(shared, own, others, same_samples)


def _bugs(renderer: Renderer, views: Sequence[RenderedView], mesh: str | None) -> "Found":
    """Return the bugs of another renderer's textures."""
    from lfssao.verify.agree.bugs import find_bugs  # late: it imports what judges and diagnoses

    with working("bugs"):
        return find_bugs(renderer, views, mesh)


def _cast(shared: Shared, mesh: str | None) -> tuple[Values, float]:
    """Return the values of ray-cast occlusion, and the root mean square of its own noise in differences."""
    from lfssao.verify.agree import truth  # late: few ask for rays

    rays = truth.Truth(shared.views[0], mesh)
    with progress(list(zip(shared.views, shared.places, strict=True)), desc="rays", unit="view") as bar:
        textures, errors = zip(*(rays.cast(view, places) for view, places in bar), strict=True)
    return shared.read(textures, "rays"), truth.noise(shared, errors)


def _draw(path: Path, shared: Shared, read: dict[str, Values]) -> None:
    """Draw the points of the first view that shares any."""
    from lfssao.viz.agreement import draw_disagreement  # late: it imports matplotlib

    first = shared.owners[0]
    chosen = shared.owners == first
    values = {name: each.T[chosen] for name, each in read.items()}
    figure = draw_disagreement(shared.views[first].view, shared.points[chosen], values)
    write_whole(path, lambda part: figure.savefig(part, dpi=110))


def _table(layer: str, found: dict[str, Disagreement]) -> list[str]:
    """Return the differences of pairs of values, in lines."""
    lines = [f"{layer:16s} RMS     above {LIMIT:g}"]
    return lines + [f"{name:16s} {each.rms:.4f} {100 * each.above:6.2f} %" for name, each in found.items()]
