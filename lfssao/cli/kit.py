"""``lfssao kit``: conformance cases for other renderers, with their specification."""

import argparse
from pathlib import Path
from typing import Any


def add_to(commands: Any) -> None:
    """Add the command to the parser."""
    kit = commands.add_parser(
        "kit",
        allow_abbrev=False,
        help="write conformance cases for other renderers, with a specification",
        description="Write small conformance cases, one for each feature: inputs, expected outputs, bounds, and "
        "SPECIFICATION.md, from which each stage can be written in another language with equal bits.",
    )
    kit.set_defaults(run=_kit)
    kit.add_argument("folder", metavar="DIR", type=Path, help="the folder to be; an earlier kit there is replaced")


def _kit(options: argparse.Namespace) -> None:
    from tqdm import tqdm  # late: --help needs none of it

    from lfssao.cli.terminal import bar_size
    from lfssao.verify.kit.cases import case_names, make_case
    from lfssao.verify.kit.folder import check_target, write_kit
    from lfssao.verify.kit.specification import specification

    check_target(options.folder)
    names = case_names()
    progress = tqdm(names, unit="case", disable=None, leave=False, **bar_size())
    cases = [make_case(name) for name in progress]
    write_kit(options.folder, cases, specification())
    print(f"{options.folder}: {len(cases)} cases")
    open_ = [case.name for case in cases if not case.specified]
    if open_:
        print(f"SPECIFICATION.md does not describe yet: {', '.join(open_)}")
