"""``lfssao plan``: what a render leaves out because its scene does not need it, why, and what that saves."""

import argparse
import json
from typing import TYPE_CHECKING, Any

from lfssao.cli.render import add_options, prepare
from lfssao.cli.terminal import printable
from lfssao.cli.values import MOST_THREADS

if TYPE_CHECKING:
    from lfssao.rendering.work import Item, Work


def add_to(commands: Any) -> None:
    """Add the command to the parser."""
    plan = commands.add_parser(
        "plan",
        allow_abbrev=False,
        help="what a render leaves out because its scene does not need it, why, and what that saves",
        description="Print what 'lfssao render' with the same options leaves out because its scene does not need it, "
        "and why. The view in the middle is rendered to measure what that saves. Nothing is written.",
    )
    plan.set_defaults(run=_plan)
    add_options(plan, output=False)
    plan.add_argument("--why", action="store_true", help="print all rules, whether anything is left out or not")
    plan.add_argument("--json", action="store_true", help="print JSON")


def _plan(options: argparse.Namespace) -> None:
    from lfssao.rendering import plan  # late: numba is imported behind this line

    if options.why:
        for what, why in plan.RULES.items():
            print(f"{what}: {why}")
        return
    work, described = prepare(options)
    from lfssao.ao.estimators.neighbours import DepthCache
    from lfssao.rendering.work import Renderer

    item = _middle(work)
    view, renderer = work.views[item.view], Renderer(work, options.threads or MOST_THREADS)
    renderer.textures(item)  # compiles or loads the kernels
    textures = renderer.textures(item)
    others = work.neighbours[item.view] if work.neighbours else ()
    neighbours = DepthCache(renderer.prepare(item), len(others)).neighbours(others)
    ao, all_ao = plan.ao_seconds(view, textures.gbuffer, work.settings, neighbours)
    passes = sum(textures.seconds.get(name, 0.0) for name in ("ray_cast", "ao", "merge", "blur", "shade"))
    left = plan.planned(work.views, work.boxes, work.settings, work.mesh.paint is not None)
    of_view = plan.background(work.settings, view.width * view.height, textures.surface_texels)
    if options.json:
        made = {"scene": described["scene"], "left_out": plan.described(left), "view": view.name}
        made |= {"left_out_of_view": plan.described(of_view), "seconds": passes, "ao_seconds": ao}
        print(json.dumps({**made, "ao_seconds_with_all": all_ao}, indent=1, allow_nan=False))
        return
    for where, entries in (("", left), (f" texels of {view.name}", of_view)):
        for each in entries:
            print(printable(f"{each.what}: {each.count:,} of {each.of:,}{where}; {plan.RULES[each.what]}"))
    print(printable(f"{view.name}: AO takes {ao:.4f} s, with all that {all_ao:.4f} s; all passes take {passes:.4f} s"))


def _middle(work: "Work") -> "Item":
    """Of the views that see the scene in the first frame the one in the middle; any if none does."""
    from lfssao.optics.window import seen_rows
    from lfssao.rendering.work import Item

    views = range(len(work.views))
    seen = [k for k in views if seen_rows(work.views[k], work.boxes[0])] or list(views)
    return Item(0, seen[len(seen) // 2])
