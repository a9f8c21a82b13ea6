"""``lfssao plan``: what a render leaves out because its scene does not need it, why, and what that saves."""

import argparse
import json

from lfssao.cli.job_options import add_options, job_of
from lfssao.cli.terminal import printable, working
from lfssao.core.threads import MOST_THREADS
from lfssao.optics.view import seen_rows
from lfssao.rendering import plan
from lfssao.rendering.job import Item
from lfssao.rendering.run import Renderer


def add_to(command: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    command.description = """Print what 'lfssao render' with the same options leaves out because its scene does not need
        it, and why. The view in the middle is rendered to measure what that saves. Nothing is written."""
    command.set_defaults(run=_plan)
    add_options(command, output=False)
    command.add_argument("--why", action="store_true", help="print all rules, whether anything is left out or not")
    command.add_argument("--json", action="store_true", help="print JSON")


def _plan(options: argparse.Namespace) -> None:
    if options.why:
        for what, why in plan.RULES.items():
            print(f"{what}: {why}")
        return
    threads = options.threads or MOST_THREADS
    with working("load"):
        job = job_of(options, threads)
    # The middle one of the views that see the scene in the first frame; of all if none does.
    views = range(len(job.views))
    visible = [k for k in views if seen_rows(job.views[k], job.boxes[0])] or list(views)
    item = Item(0, visible[len(visible) // 2])
    renderer = Renderer(job, threads)
    view = job.views[item.view]
    with working("render and measure one view"):
        renderer.textures(item)  # compiles or loads the kernels
        textures = renderer.textures(item)
        ao, all_ao = plan.ao_seconds(textures, job.settings, renderer.adjacent(item))
    passes = sum(textures.seconds.get(name, 0.0) for name in ("ray_cast", "ao", "bent", "merge", "blur", "shade"))
    left = plan.planned(job.views, job.boxes, job.settings, job.mesh.paint is not None)
    of_view = plan.background(job.settings, view.width * view.height, textures.surface_texels)
    if options.json:
        report = {"scene": job.head["scene"], "left_out": plan.described(left), "view": view.name}
        report |= {"left_out_of_view": plan.described(of_view), "seconds": passes, "ao_seconds": ao}
        print(json.dumps({**report, "ao_seconds_with_all": all_ao}, indent=1, allow_nan=False))
        return
    for where, entries in (("", left), (f" texels of {view.name}", of_view)):
        for what, (count, of) in entries.items():
            print(printable(f"{what}: {count:,} of {of:,}{where}; {plan.RULES[what]}"))
    print(printable(f"{view.name}: AO takes {ao:.4f} s, with all that {all_ao:.4f} s; all passes take {passes:.4f} s"))
