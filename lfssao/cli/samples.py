"""``lfssao samples``: sample sets made, checked and drawn."""

import argparse
import sys
from dataclasses import replace
from glob import glob
from pathlib import Path
from typing import Any

from lfssao.cli import values
from lfssao.cli.terminal import BROKEN, printable, say, working
from lfssao.cli.values import MOST_SAMPLES, PICTURES, check_target
from lfssao.errors import InputError, check_choice, errors_of
from lfssao.files.whole import write_whole
from lfssao.samples import METHODS, sample_set
from lfssao.samples.formats import FORMATS, read_sets, read_stream
from lfssao.samples.properties import ALARM, PROMISES, as_table, check_promise
from lfssao.samples.sets import DIMENSIONS, SampleSet

_PROMISES = """what to check, may be given several times: a name, or name-domain for points of the sphere or the disk
    (default: inside, distinct, uniform)"""
_alarm = values.number("a probability above 0 and below 1", lambda value: 0 < value < 1)
_FILES = ".csv, .txt, .json, .npy or shaders' files, also as a pattern such as 'mine_*.csv'"


def add_to(command: argparse.ArgumentParser) -> None:
    """Add the actions and their options."""
    command.description = "Sample sets on the square, the sphere, the ball and the disk."
    actions = command.add_subparsers(metavar="ACTION")

    make = actions.add_parser("make", text="samples_make", help="write a sample set as a table")
    make.description = "Write a table that a program or a shader loads. Without METHOD: list the methods."
    make.set_defaults(run=_make)
    make.add_argument("method", nargs="?", metavar="METHOD", help="latin, sobol, repulsion, ...")
    _add_set(make)
    make.add_argument(
        "--format",
        default="csv",
        metavar="NAME",
        help="csv, json, glsl, npy, or glsl-function: computed in the shader (default: csv)",
    )
    make.add_argument("-o", "--output", metavar="FILE", help="file to write to (default: standard output)")

    check = actions.add_parser("check", text="samples_check", help="check anybody's points against promises")
    check.description = """Check points against promises such as uniform-ball or latin. Exit code 1 if one is broken.
        Few points cannot tell: give the sets of many seeds, each a file, or an array (seeds, n, d) in one; they are
        pooled for uniform. Without FILE: list the promises."""
    check.set_defaults(run=_check)
    check.add_argument("files", nargs="*", metavar="FILE", help=f"{_FILES}: a point a row; -: standard input")
    check.add_argument("--promise", action="append", metavar="NAME", help=_PROMISES)
    alarm = "probability that independent uniform points break uniform (default: 1e-6)"
    check.add_argument("--alarm", type=_alarm, default=ALARM, metavar="P", help=alarm)
    _add_shell(check)

    plot = actions.add_parser("plot", text="samples_plot", help="draw points, histograms, periodogram, correlation")
    plot.description = """Draw a method's sample set, or the points of files: points, histograms of their coordinates,
        periodogram and its radial mean, pair correlation."""
    plot.set_defaults(run=_plot)
    plot.add_argument("method", metavar="METHOD", help=f"a method, or {_FILES}")
    _add_set(plot)
    plot.add_argument("-o", "--output", metavar="FILE", help=".png, .svg or .pdf (default: METHOD.png)")

    text = "coordinates at the ends of the domain (default: -1,1; 0,1 if no point of the square has a negative one)"
    for parser in (check, plot):
        parser.add_argument("--range", type=_range, metavar="LOW,HIGH", help=text)


def _add_set(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    points = f"points, up to {MOST_SAMPLES} (default: 8)"
    add("-n", type=values.samples, default=8, metavar="N", help=points)
    add("--seed", type=values.seed, default=0, metavar="N", help="0 to 2**64 - 1 (default: 0)")
    domains = "square, sphere, ball or disk (default: ball, or disk for a method that has no ball)"
    add("--domain", metavar="NAME", help=domains)
    _add_shell(parser)
    add("--turns", type=values.samples, metavar="N", help="tau of the spiral (default: the best)")
    add("--no-centre", action="store_true", help="repulsion in the disk without a point in the centre")


def _add_shell(parser: argparse.ArgumentParser) -> None:
    for name, default, more in (("--r-min", 0.0, "; 'lfssao render --sampling' takes 0.8"), ("--r-max", 1.0, "")):
        shell = f"the ball's shell (default: {default:g}{more})"
        parser.add_argument(name, type=values.radius, default=default, metavar="R", help=shell)


def _range(text: str) -> tuple[float, float]:
    if text.count(",") != 1:
        raise argparse.ArgumentTypeError(f"'{text:.40}' is not LOW,HIGH")
    low, high = map(values.finite, text.split(","))
    return low, high


def _sample_set(options: argparse.Namespace) -> SampleSet:
    domain = options.domain
    method = options.method
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
    if options.method is None:
        for domain, methods in METHODS.items():
            print(f"{domain}{', r_min 0, or 0.8 by --sampling of a render' if domain == 'ball' else ''}:")
            for method in methods.values():
                print(f"  {method.name}: {method.title} ({method.source}); {', '.join(method.promises)}")
        return
    check_choice("format", options.format, FORMATS)
    if options.method in ("sobol", "owen-burley") and options.n & (options.n - 1):
        say(f"warning: sets of 2^m points are balanced, {options.n} points of {options.method} are not")
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
    check_choice("promise", text, [*PROMISES, *(f"uniform-{where}" for where in DIMENSIONS)])
    fitting = [where for where in PROMISES[text].domains if DIMENSIONS[where] == columns]
    if domain is not None or not fitting:
        return text, domain or PROMISES[text].domains[0]
    return text, "ball" if "ball" in fitting else fitting[0]


def _check(options: argparse.Namespace) -> int:
    """Check the points of files: 0 if all promises hold, 1 if one is broken."""
    if not options.files:
        for name, promise in PROMISES.items():
            print(f"{name}: {promise.title} ({', '.join(promise.domains)})")
        return 0
    sets, named = _read_files(options.files)
    kept = True
    tells = True
    source = "--promise" if options.promise else options.files[0]
    for text in options.promise or ("inside", "distinct", "uniform"):
        with errors_of(source):
            name, domain = _promise(text, sets[0].points.shape[1], named)
        points = [samples.points for samples in _moved(options, sets, domain, named)]
        with errors_of(source):
            weights = [samples.weights for samples in sets]
            shell = (options.r_min, options.r_max)
            findings = check_promise(name, points, domain, weights, *shell, alarm=options.alarm)
        for finding in findings:
            file = "" if finding.worst is None else f" ({printable(sets[finding.worst].method)})"
            print(f"{name} ({domain}): {finding}{file}")
        if findings.hint and options.range is None:
            say("all points lie in [0, 1], and the domain reaches from -1 to 1: --range 0,1, if they fill that")
            options.range = (-1.0, 1.0)  # so that the hint is printed once
        kept = kept and findings.holds
        tells = tells and findings.tells
    if not tells:
        print("the sets of more seeds, or a larger --alarm, would tell more")
    return 0 if kept else BROKEN


def _read_files(patterns: list[str]) -> tuple[list[SampleSet], str | None]:
    """Return the sets of files, or of standard input, without promises, and the domain that the first file names."""
    paths = [Path(name) for p in patterns for name in ([p] if Path(p).exists() else sorted(glob(p)) or [p])]
    files = [read_stream(sys.stdin.buffer.read()) if str(path) == "-" else read_sets(path) for path in paths]
    points, _, named = files[0]
    domain = named or ("ball" if points.shape[2] == 3 else "square")
    out = []
    for path, (tables, weights, _) in zip(paths, files, strict=True):
        name = "standard input" if str(path) == "-" else str(path)
        for number, table in enumerate(tables):
            of = f", set {number}" if len(tables) > 1 else ""
            out.append(SampleSet(table, weights, domain, f"{name}{of}", 0, ()))
    return out, named


def _moved(options: argparse.Namespace, sets: list[SampleSet], domain: str, named: str | None) -> list[SampleSet]:
    """Sets as of a domain, moved from --range, or from a guess if no file named its domain."""
    guess = options.range is None and named is None and domain == "square"
    if guess and all(((samples.points >= 0) & (samples.points <= 1)).all() for samples in sets):
        say("all points lie in [0, 1]^2, which is taken for the whole square; --range -1,1 says that it is not")
        options.range = (0.0, 1.0)  # so that the guess is printed once
    out = []
    for samples in sets:
        with errors_of(samples.method):
            out.append(
                replace(samples, points=as_table(samples.points, domain, options.range or (-1.0, 1.0)), domain=domain)
            )
    return out


def _plot(options: argparse.Namespace) -> None:
    source = Path(options.method)
    target = check_target("--output", Path(options.output or f"{source.stem}.png"), PICTURES)
    if source.suffix:
        sets, named = _read_files([options.method])
        sets = _moved(options, sets, options.domain or sets[0].domain, named)
    else:
        sets = [_sample_set(options)]
    with working("draw"):
        from lfssao.viz.samples import draw_samples  # late: matplotlib takes a second to import

        figure = draw_samples(sets, options.r_min, options.r_max)
        write_whole(target, lambda path: figure.savefig(path, dpi=110))
    print(printable(str(target)))
