"""``lfssao bench plan``: what leaving out what a scene does not need saves, by scene and rule."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from lfssao.bench import savings
from lfssao.cli import values
from lfssao.cli.terminal import BROKEN
from lfssao.core.files import write_text
from lfssao.optics.display_file import find_display
from lfssao.rendering.manifest import describe_machine


def add_to(plan: argparse.ArgumentParser) -> None:
    """Add the bench's options."""
    plan.description = (
        "Render the embedded scenes, and a wall that fills the texture, as 'lfssao render' does and with what it "
        "leaves out, in turn in one thread: how many times as long that takes. Exit code 1 if bits differ."
    )
    plan.set_defaults(run=_plan)
    plan.add_argument("--quick", action="store_true", help="one embedded scene and the wall, few turns")
    plan.add_argument("--display", metavar="NAME", default="virtual", help="a preset or a .toml file (virtual)")
    plan.add_argument("--repeats", metavar="N", type=values.threads, help="turns (25; with --quick 6)")
    plan.add_argument("--json", metavar="FILE", type=Path, help="write the figures as JSON, too")


def _plan(options: argparse.Namespace) -> int:
    display, made = find_display(options.display), []
    repeats = options.repeats or (6 if options.quick else 25)
    print(savings.HEAD, flush=True)
    for saving in savings.savings(savings.cases(display, options.quick), display, repeats):
        print(savings.as_text(saving), flush=True)
        made.append(saving)
    if options.json is not None:
        result = {"machine": describe_machine(1, options.command), "scenes": [asdict(saving) for saving in made]}
        write_text(options.json, json.dumps(result, indent=1, allow_nan=False) + "\n")
    return 0 if all(saving.same for saving in made) else BROKEN
