"""Plants single-line mutants, runs the mirrored tests, prints those that no test notices.

    python benchmarks/mutate.py 'lfssao/optics/**/*.py' --count 20 --seed 1

A mutant is a comparison, a number, a sign or an index that is changed, in a copy of the checkout. Its tests are those
of the file's name, else of its folder and the folders above, without slow ones. If they notice nothing, those of its
room run, and of kernels the kit's cases, which the independent implementation solves. They pass without a mutant, else
the program stops; a test that hangs has noticed, and is told apart. Kernels are compiled anew for each mutant, with few
optimisations: a mutant of a kernel takes minutes.
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
from pathlib import Path

ROOT = Path(__file__).parents[1]
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
    """The tests of a file: tests/.../test_NAME*.py of its own folder or one above, else the nearest folder of tests."""
    folder = Path("tests", *(part for part in path.parent.parts[1:] if part != "kernels"))
    while not list((ROOT / folder).glob("**/test_*.py")):
        folder = folder.parent
    named = sorted((ROOT / folder).glob(f"**/test_{path.stem}*.py"))
    return tuple(each.relative_to(ROOT) for each in named) or (folder,)


def more_tests_of(path: Path) -> tuple[Path, ...]:
    """The tests of the room of a file, lfssao/ROOM/..., and of kernels the kit's cases."""
    room = Path("tests", path.parts[1])
    return (room, KIT) if path.parent.name == "kernels" and path.parts[1] != "verify" else (room,)


def outcome_of(copy: Path, tests: tuple[Path, ...], seconds: float) -> str:
    """`passes`, `fails` or `hangs`: what the tests do in a copy of the checkout."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n0", "-m", "not slow", "-p", "no:cacheprovider"]
    environment = {**os.environ, "PYTHONPATH": str(copy), "NUMBA_OPT": "1", "NUMBA_CACHE_DIR": str(copy / "cache")}
    try:
        done = subprocess.run(
            [*command, *map(str, tests)], cwd=copy, env=environment, timeout=seconds, capture_output=True, check=False
        )
    except subprocess.TimeoutExpired:
        return "hangs"
    return "fails" if done.returncode else "passes"


def planted(copy: Path, mutant: Mutant, tests: tuple[Path, ...], seconds: float) -> str:
    """The outcome of a mutant's tests; the copy of the checkout is restored."""
    path, line, column, old, new = mutant
    source = (copy / path).read_text()
    lines = source.split("\n")
    text = lines[line - 1]
    lines[line - 1] = text[:column] + new + text[column + len(old) :]
    (copy / path).write_text("\n".join(lines))
    try:
        return outcome_of(copy, tests, seconds)
    finally:
        (copy / path).write_text(source)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="files or patterns, relative to the checkout")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=1800, help="after which a test hangs")
    options = parser.parse_args()
    files = sorted({path.relative_to(ROOT) for pattern in options.files for path in ROOT.glob(pattern)})
    every = [mutant for path in files for mutant in mutants_of(path)]
    drawn = random.Random(options.seed).sample(every, min(options.count, len(every)))
    found, proven = 0, set()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, copy)
        for k, mutant in enumerate(drawn, 1):
            path, line, _, old, new = mutant
            tests = tests_of(path)
            if tests not in proven and outcome_of(copy, tests, options.seconds) != "passes":
                sys.exit(f"tests of {path} do not pass without a mutant")
            proven.add(tests)
            outcome, by = planted(copy, mutant, tests, options.seconds), ""
            if outcome == "passes":
                outcome, by = planted(copy, mutant, more_tests_of(path), options.seconds), " by the room's tests"
            found += outcome != "passes"
            word = {"passes": "SURVIVES", "fails": f"found{by}", "hangs": "hung"}[outcome]
            text = (ROOT / path).read_text().split("\n")[line - 1].strip()
            print(f"{k}/{len(drawn)} {word} {path}:{line} {old} -> {new}: {text}", flush=True)
    print(f"{found} of {len(drawn)} mutants found, of {len(every)} in {len(files)} files")


if __name__ == "__main__":
    main()
