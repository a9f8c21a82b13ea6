"""``lfssao kit``: conformance cases for other renderers, with their specification."""

import argparse
from pathlib import Path

from lfssao.cli.terminal import progress
from lfssao.verify.kit.folder import check_target, write_kit


def add_to(kit: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    kit.description = """Write small conformance cases, one for each feature: inputs, expected outputs, bounds, and
        SPECIFICATION.md and ESTIMATORS.md, from which each stage can be written in another language with equal bits."""
    kit.set_defaults(run=_kit)
    kit.add_argument("folder", metavar="DIR", type=Path, help="the folder to be; an earlier kit there is replaced")


def _kit(options: argparse.Namespace) -> None:
    from lfssao.verify.kit.cases import RECIPES, make_case  # late: displays of cases compile kernels, which is shown

    check_target(options.folder)
    with progress(RECIPES, unit="case", leave=False) as bar:
        write_kit(options.folder, map(make_case, bar))
    print(f"{options.folder}: {len(RECIPES)} cases")
