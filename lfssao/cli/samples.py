"""``lfssao samples``: sample sets made, checked and drawn."""

import argparse
import sys
from pathlib import Path
from typing import Any

from lfssao.cli import values
from lfssao.cli.terminal import BROKEN, printable
from lfssao.cli.values import MOST_SAMPLES, PICTURES, check_target
from lfssao.core.files import write_whole
from lfssao.errors import InputError, check_choice, errors_of, no_such
from lfssao.samples import METHODS, sample_set
from lfssao.samples.formats import FORMATS, read_points
from lfssao.samples.sets import DIMENSIONS, SampleSet
from lfssao.testing import PROMISES, check_promise

_PROMISES = (
    "what to check, may be given several times: a name, or name-domain for points of the sphere or the disk (default: "
    "inside, distinct, uniform)"
)


def add_to(command: argparse.ArgumentParser) -> None:
    """Add the actions and their options."""
    command.description = "Sample sets on the square, the sphere, the ball and the disk."
    actions = command.add_subparsers(required=True, metavar="ACTION")

    make = actions.add_parser("make", help="write a sample set as a table")
    make.description = "Write a table that a program or a shader loads. Without METHOD: list the methods."
    make.set_defaults(run=_make)
    make.add_argument("method", nargs="?", metavar="METHOD", help="latin, sobol, repulsion, ...")
    _add_set(make)
    make.add_argument("--format", default="csv", metavar="NAME", help="csv, json, glsl or npy (default: csv)")
    make.add_argument("-o", "--output", metavar="FILE", help="file to write to (default: standard output)")

    check = actions.add_parser("check", help="check anybody's points against promises")
    check.description = (
        "Check points against promises such as uniform-ball or latin. Exit code 1 if one is broken. Without FILE: list "
        "the promises."
    )
    check.set_defaults(run=_check)
    check.add_argument("file", nargs="?", metavar="FILE", help=".csv, .json or .npy: a point a row")
    check.add_argument("--promise", action="append", metavar="NAME", help=_PROMISES)
    _add_shell(check)

    plot = actions.add_parser("plot", help="draw points, radii, periodogram and pair correlation")
    plot.description = (
        "Draw a method's sample set, or the points of a file: points, radial histogram, periodogram and pair "
        "correlation side by side."
    )
    plot.set_defaults(run=_plot)
    plot.add_argument("method", metavar="METHOD", help="a method, or a .csv, .json or .npy file")
    _add_set(plot)
    plot.add_argument("-o", "--output", metavar="FILE", help=".png, .svg or .pdf (default: METHOD.png)")


def _add_set(parser: argparse.ArgumentParser) -> None:
    """Add the options of a sample set."""
    add, points = parser.add_argument, f"points, up to {MOST_SAMPLES} (default: 8)"
    add("-n", type=values.samples, default=8, metavar="N", help=points)
    add("--seed", type=values.seed, default=0, metavar="N", help="0 to 2**64 - 1 (default: 0)")
    domains = "square, sphere, ball or disk (default: ball, or disk for a method that has no ball)"
    add("--domain", metavar="NAME", help=domains)
    _add_shell(parser)
    add("--turns", type=values.samples, metavar="N", help="tau of the spiral (default: the best)")
    add("--no-centre", action="store_true", help="repulsion in the disk without a point in the centre")


def _add_shell(parser: argparse.ArgumentParser) -> None:
    """Add the radii of the ball's shell."""
    for name, default in (("--r-min", 0.0), ("--r-max", 1.0)):
        shell = f"the ball's shell (default: {default:g})"
        parser.add_argument(name, type=values.radius, default=default, metavar="R", help=shell)


def _sample_set(options: argparse.Namespace) -> SampleSet:
    domain, method = options.domain, options.method
    if domain is None:
        domain = "disk" if method in METHODS["disk"] and method not in METHODS["ball"] else "ball"
    more: dict[str, Any] = {}
    if domain == "ball":
        more = {"r_min": options.r_min, "r_max": options.r_max}
    elif (options.r_min, options.r_max) != (0.0, 1.0):
        raise InputError(f"--r-min, --r-max: only the ball has a shell, not the {domain}")
    if options.turns is not None:
        more["turns"] = options.turns
    if options.no_centre:
        more["centre"] = False
    return sample_set(domain, method, options.n, options.seed, **more)


def _make(options: argparse.Namespace) -> None:
    """Write or print a table, or list the methods."""
    if options.method is None:
        for domain, methods in METHODS.items():
            print(f"{domain}:")
            for method in methods.values():
                print(f"  {method.name}: {method.title} ({method.source}); {', '.join(method.promises)}")
        return
    check_choice("format", options.format, FORMATS)
    content = FORMATS[options.format](_sample_set(options))
    if options.output is not None:
        write_whole(Path(options.output), lambda path: path.write_bytes(content))
        print(printable(options.output))
        return
    if options.format == "npy":
        raise InputError("--format npy is not text: give a file with -o")
    sys.stdout.write(content.decode())


def _promise(text: str, columns: int, domain: str | None) -> tuple[str, str]:
    """Name and domain of a promise such as 'latin' or 'uniform-ball'."""
    name, _, last = text.rpartition("-")
    if text not in PROMISES and name in PROMISES and last in DIMENSIONS:
        return name, last
    if text not in PROMISES:
        known = [*PROMISES, *(f"uniform-{where}" for where in DIMENSIONS)]
        raise no_such("promise", text, known)
    fitting = [where for where in PROMISES[text].domains if DIMENSIONS[where] == columns]
    if domain is not None or not fitting:
        return text, domain or PROMISES[text].domains[0]
    return text, "ball" if "ball" in fitting else fitting[0]


def _check(options: argparse.Namespace) -> int:
    """Check a file's points: 0 if all promises hold, 1 if one is broken."""
    if options.file is None:
        for name, promise in PROMISES.items():
            print(f"{name}: {promise.title} ({', '.join(promise.domains)})")
        return 0
    points, weights, domain = read_points(Path(options.file))
    kept = True
    for text in options.promise or ("inside", "distinct", "uniform"):
        with errors_of("--promise" if options.promise else options.file):
            name, where = _promise(text, points.shape[1], domain)
            findings = check_promise(name, points, where, weights, options.r_min, options.r_max)
        for finding in findings:
            verdict = "holds" if finding.holds else "BROKEN"
            print(f"{name} ({where}): {finding.what}: {finding.value:.6g}, at most {finding.limit:.6g}: {verdict}")
            kept = kept and finding.holds
    return 0 if kept else BROKEN


def _plot(options: argparse.Namespace) -> None:
    """Draw a sample set, or the points of a file."""
    source = Path(options.method)
    target = check_target("--output", Path(options.output or f"{source.stem}.png"), PICTURES)
    made = _read_set(source, options.domain) if source.suffix else _sample_set(options)
    from lfssao.samples.plot import save_samples  # late: matplotlib takes a second to import

    save_samples(made, target, options.r_min, options.r_max)
    print(printable(str(target)))


def _read_set(path: Path, domain: str | None) -> SampleSet:
    """The points of a file as a set without promises."""
    points, weights, named = read_points(path)
    domain = domain or named or ("ball" if points.shape[1] == 3 else "square")
    check_choice("domain", domain, DIMENSIONS)
    if DIMENSIONS[domain] != points.shape[1]:
        raise InputError(f"{path}: points of the {domain} have {DIMENSIONS[domain]} coordinates, not {points.shape[1]}")
    return SampleSet(points, weights, domain, path.name, 0, ())
