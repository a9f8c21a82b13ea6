"""``lfssao check``: whether this machine makes the bits that lfssao makes elsewhere."""

import argparse
import json
from pathlib import Path

from lfssao.cli import values
from lfssao.cli.terminal import BROKEN, progress
from lfssao.files.whole import write_text
from lfssao.rendering.manifest import describe_machine
from lfssao.verify.check import expected_digests, found_digests


def add_to(check: argparse.ArgumentParser) -> None:
    """Describe the command and its option."""
    check.description = """Render small textures of each preset display, both cameras and each estimator, and compare
        their SHA-256 with those that lfssao keeps: one line says whether this machine makes the same bits. The exit
        code is 1 where it does not. With nothing compiled it takes minutes."""
    check.add_argument(
        "--json",
        metavar="FILE",
        help="write the machine, its packages and all digests; -: to standard output, in place of the text",
    )
    check.set_defaults(run=_check)


def _check(options: argparse.Namespace) -> int:
    if options.json not in (None, "-"):
        values.check_target("--json", Path(options.json), (".json",))
    expected = expected_digests()
    machine = describe_machine(1)
    with progress(found_digests(), total=len(expected), desc="checking") as cases:
        found = dict(cases)
    other = [name for name in {**expected, **found} if found.get(name) != expected.get(name)]
    if options.json is not None:
        text = json.dumps({"machine": machine, "digests": found, "other": other}, indent=1)
        if options.json == "-":
            print(text)
            return BROKEN if other else 0
        write_text(Path(options.json), text)
    packages = ", ".join(f"{name} {machine['packages'][name]}" for name in ("numba", "llvmlite", "numpy"))
    where = f"lfssao {machine['lfssao']}, {packages}, {machine['processor']}, {machine['platform']}"
    print(f"{len(expected) - len(other)} of {len(expected)} digests are equal: {where}")
    if other:
        print(f"other bits: {', '.join(other)}")
    return BROKEN if other else 0
