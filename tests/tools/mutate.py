"""Plants single-line mutants, runs the mirrored tests, prints those that no test notices.

    python tests/tools/mutate.py 'lfssao/optics/**/*.py' --count 20 --seed 1

A mutant is a comparison, a number, a sign or an index that is changed, in a copy of the checkout. Its tests are those
of the file's name, else of its folders' names, without slow ones. If they notice nothing, those of its room run, and of
kernels the kit's cases, which the independent implementation solves. They pass without a mutant, else the program
stops; a test that hangs has noticed, and is told apart. Kernels that have the mutant inlined are compiled anew, with
few optimisations. ``--only 1:150`` and ``--only 151:300`` share the mutants among two cores.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
KIT = Path("tests/verify/test_kit_cases.py")
COPIED = "lfssao", "tests", "benchmarks", "notebooks", "pyproject.toml", "README.md", "LICENSE"
_COMPARISONS = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="}
_SIGNS = {ast.Add: "-", ast.Sub: "+"}
_TEXTS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.Add: "+"}
_TEXTS[ast.Sub] = "-"

Mutant = tuple[Path, int, int, str, str]  # file, line from 1, column from 0, text there, text instead


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Every mutant of a file, without those in docstrings, annotations and default values of options."""
    source = (ROOT / path).read_text()
    lines = source.split("\n")

    def between(left: ast.expr, right: ast.expr, kind: type, new: str) -> Iterator[Mutant]:
        if left.end_lineno == right.lineno and kind in _TEXTS:
            column = lines[right.lineno - 1].find(_TEXTS[kind], left.end_col_offset, right.col_offset)
            if column >= 0:
                yield path, right.lineno, column, _TEXTS[kind], new

    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARISONS:
            yield from between(node.left, node.comparators[0], type(node.ops[0]), _COMPARISONS[type(node.ops[0])])
        elif isinstance(node, ast.BinOp) and type(node.op) in _SIGNS:
            yield from between(node.left, node.right, type(node.op), _SIGNS[type(node.op)])
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.end_lineno == node.lineno:
            text = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
            yield path, node.lineno, node.col_offset, text, repr(node.value + 1)


def tests_of(path: Path) -> tuple[Path, ...]:
    """The tests of a file: test_NAME*.py, else of its folders, test_*FOLDER*.py, else the nearest folder of tests."""
    folder = Path("tests", *(part for part in path.parent.parts[1:] if part != "kernels"))
    while not list((ROOT / folder).glob("**/test_*.py")):
        folder = folder.parent
    inner = [part for part in path.parts[-2:1:-1] if part != "kernels"]
    for pattern in (f"test_{path.stem}*.py", *(f"test_*{part}*.py" for part in inner)):
        if named := sorted((ROOT / folder).glob(f"**/{pattern}")):
            return tuple(each.relative_to(ROOT) for each in named)
    return (folder,)


def more_tests_of(path: Path) -> tuple[Path, ...]:
    """The tests of the room of a file, lfssao/ROOM/..., and of kernels the kit's cases."""
    room = Path("tests", path.parts[1])
    return (room, KIT) if path.parent.name == "kernels" and path.parts[1] != "verify" else (room,)


def with_inlined(path: Path) -> set[Path]:
    """A file of kernels and those that import it, directly or through others: their compiled code is out of date."""
    imports = {}
    for each in [*(ROOT / "lfssao").rglob("kernels/*.py"), *(ROOT / "lfssao/core").glob("*.py")]:
        nodes = [node for node in ast.walk(ast.parse(each.read_text())) if isinstance(node, ast.ImportFrom)]
        names = {f"{node.module}.{name.name}" for node in nodes for name in node.names}
        imports[each.relative_to(ROOT)] = names | {str(node.module) for node in nodes}
    stale = {path}
    while more := {
        each
        for each in imports.keys() - stale
        if imports[each] & {".".join(old.with_suffix("").parts) for old in stale}
    }:
        stale |= more
    return stale


def run(copy: Path, *arguments: str, seconds: float | None = None) -> subprocess.CompletedProcess[str]:
    """Python with arguments in a copy of the checkout, its compiled code in a folder of the copy."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "NUMBA_OPT": "1", "NUMBA_CACHE_DIR": str(copy / "cache")}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=copy, env=environment, timeout=seconds, capture_output=True, text=True, check=False
    )


def outcome_of(copy: Path, tests: tuple[Path, ...], seconds: float) -> str:
    """`passes`, `fails` or `hangs`: what the tests do in a copy of the checkout."""
    options = ["-x", "-q", "-n0", "-m", "not slow", "-p", "no:cacheprovider"]
    try:
        done = run(copy, "-m", "pytest", *options, *map(str, tests), seconds=seconds)
    except subprocess.TimeoutExpired:
        return "hangs"
    return "passes" if done.returncode in (0, 5) else "fails"  # 5: all of them are slow


def compiled(copy: Path) -> Path:
    """The folder of the compiled code of a copy's kernels, named after a digest of their sources."""
    program = "from lfssao.core.jit import source_digest; print(source_digest()[:16])"
    return copy / "cache" / f"kernels-{run(copy, '-c', program).stdout.strip()}"


@contextmanager
def planted(copy: Path, mutant: Mutant) -> Iterator[None]:
    """In the block, the copy of the checkout has the mutant, and compiled code of the kernels that do not inline it."""
    path, line, column, old, new = mutant
    without = compiled(copy)
    source = (copy / path).read_text()
    before = (copy / path).stat()
    lines = source.split("\n")
    lines[line - 1] = lines[line - 1][:column] + new + lines[line - 1][column + len(old) :]
    (copy / path).write_text("\n".join(lines))
    home = compiled(copy)
    if home != without and without.exists():
        shutil.copytree(without, home)
        for stale in with_inlined(path):  # numba looks at the file that defines a kernel alone
            for index in home.rglob(f"{stale.stem}.*.nbi"):
                index.unlink()
    try:
        yield
    finally:
        (copy / path).write_text(source)
        os.utime(copy / path, ns=(before.st_atime_ns, before.st_mtime_ns))  # compiled code is of a file of that time
        if home != without:
            shutil.rmtree(home, ignore_errors=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="files or patterns, relative to the checkout")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", default="1:", help="first and last of the drawn mutants that are planted, as in 1:150"
    )
    parser.add_argument("--seconds", type=float, default=1800, help="after which a test hangs")
    options = parser.parse_args()
    files = sorted({path.relative_to(ROOT) for pattern in options.files for path in ROOT.glob(pattern)})
    every = [mutant for path in files for mutant in mutants_of(path)]
    drawn = random.Random(options.seed).sample(every, min(options.count, len(every)))
    first, last = (int(number or len(drawn)) for number in options.only.split(":"))
    found = 0
    proven = set()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, copy)
        for k, mutant in enumerate(drawn[first - 1 : last], first):
            path, line, _, old, new = mutant
            outcome = word = ""
            for tests, found_by in ((tests_of(path), "found"), (more_tests_of(path), "found by the room's tests")):
                if tests not in proven and outcome_of(copy, tests, options.seconds) != "passes":
                    sys.exit(f"{' '.join(map(str, tests))} do not pass without a mutant")
                proven.add(tests)
                with planted(copy, mutant):
                    outcome = outcome_of(copy, tests, options.seconds)
                word = {"passes": "SURVIVES", "fails": found_by, "hangs": "hung"}[outcome]
                if outcome != "passes":
                    break
            found += outcome != "passes"
            text = (copy / path).read_text().split("\n")[line - 1].strip()
            print(f"{k}/{len(drawn)} {word} {path}:{line} {old} -> {new}: {text}", flush=True)
    print(f"{found} of {last - first + 1} mutants found, of {len(every)} in {len(files)} files")


if __name__ == "__main__":
    main()
