"""``lfssao kit``: conformance cases for other renderers, with their specification."""

import argparse
from pathlib import Path

from lfssao.cli.terminal import progress
from lfssao.verify.kit.cases import case_names, make_case
from lfssao.verify.kit.folder import check_target, write_kit
from lfssao.verify.kit.specification import specification


def add_to(kit: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    kit.description = (
        "Write small conformance cases, one for each feature: inputs, expected outputs, bounds, and SPECIFICATION.md, "
        "from which each stage can be written in another language with equal bits."
    )
    kit.set_defaults(run=_kit)
    kit.add_argument("folder", metavar="DIR", type=Path, help="the folder to be; an earlier kit there is replaced")


def _kit(options: argparse.Namespace) -> None:
    check_target(options.folder)
    cases = [make_case(name) for name in progress(case_names(), unit="case", leave=False)]
    write_kit(options.folder, cases, specification())
    print(f"{options.folder}: {len(cases)} cases")
    open_ = [case.name for case in cases if not case.specified]
    if open_:
        print(f"SPECIFICATION.md does not describe yet: {', '.join(open_)}")
