"""Hands mutated files to a loader, and prints whatever comes of it that is neither success nor an InputError.

    python tests/tools/fuzz.py mesh --count 2000 --seed 1 --keep findings

A loader is one entry of LOADERS: its seeds, each a dict of relative names and contents, and a function that gets the
path of a seed's first file. A mutant is a seed with one of its files changed. All mutants run in one process, which is
started again when it dies; it may take --megabytes of memory beyond what its imports took, and --seconds a mutant.
--keep is a folder for the files of findings; --only 17 runs mutant 17 alone. With NUMBA_BOUNDSCHECK=1 a kernel that
reads beyond an array is a finding.
"""

import argparse
import json
import multiprocessing
import os
import random
import re
import resource
import shutil
import struct
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import fuzz_files
import fuzz_seeds
from fuzz_seeds import Files

from lfssao.errors import LfssaoError

Outcome = tuple[str, str]  # 'read', 'refused' or the kind of a finding; its message or traceback
GOOD = ("read", "refused")


@dataclass(frozen=True)
class Loader:
    """Whole files, equal bytes each time they are made, and what reads the first of a seed."""

    seeds: Callable[[], list[Files]]
    load: Callable[[Path], object]


LOADERS = {"mesh": Loader(fuzz_seeds.meshes, fuzz_files.load_mesh)}
LOADERS |= {name: Loader(*each) for name, each in fuzz_files.LOADS.items()}

_WORDS = [
    *b"0 1 -1 2 255 65536 2147483648 -2147483649 1000000000000 1e400 -1e30 1e-320 0.5 nan inf null true".split(),
    *(b"[]", b"{}", b'""', b"", b"/dev/zero", b"..", b"\0", b"\xff\xfe", b"\xc3\x28", b"#"),
    *(b"[" * 5000, b"9" * 5000, b"a" * 300),
]
_VALUES = [
    *("null", "true", "false", "0", "-1", "1", "2", "7", "4096", "2147483648", "0.5", "1e308", "NaN", "Infinity"),
    *('""', '"x"', '"../../x"', '"\\u0000"', '"display"', '"matrix"', "[]", "{}", "[[]]", "[null]", "[[1, 2, 3]]"),
    *('{"a": 1}', "1" + "0" * 400, f'"{"e" * 300}"', "[" * 50 + "]" * 50),
]
_BYTES = [bytes(1), bytes(4), bytes(16), *(b"\xff" * n for n in (1, 2, 4, 8)), b"\x7f", b"\x80\0\0\0", b"\0\0\0\x80"]


def mutant(seeds: list[Files], number: int, seed: int) -> Files:
    """Seed number modulo their count, with one of its files, most often the first, changed in one to four places."""
    draw = random.Random(f"{seed}/{number}")
    files = dict(seeds[number % len(seeds)])
    name = draw.choice([*files, *[next(iter(files))] * len(files)])
    for _ in range(draw.choice((1, 1, 2, 4))):
        special = _SPECIAL.get(Path(name).suffix, _changed)
        files[name] = (special if draw.random() < 0.6 else _changed)(files[name], draw, seeds)
    return files


def _changed(data: bytes, draw: random.Random, seeds: list[Files]) -> bytes:
    """Content with one change of its bytes, words or lines."""
    start, stop = sorted(draw.randint(0, len(data)) for _ in range(2))
    words = list(re.finditer(rb"[-+.\w]+", data))
    lines = data.split(b"\n")
    match draw.randrange(10):
        case 0:
            new = data[:start] + bytes(byte ^ 1 << draw.randrange(8) for byte in data[start:][:1]) + data[start + 1 :]
        case 1:
            put = draw.choice(_BYTES)
            new = data[:start] + put + data[start + len(put) :]
        case 2:
            new = data[:start]
        case 3:
            new = data[:start] + data[stop:]
        case 4:
            new = data[:stop] + data[start:stop] * draw.choice((1, 2, 50)) + data[stop:]
        case 5:
            other = draw.choice([content for files in seeds for content in files.values()])
            new = data[:start] + other[draw.randint(0, len(other)) :]
        case 6 | 7 | 8 if words:
            word = draw.choice(words)
            put = draw.choice([*_WORDS, draw.choice(words).group()])
            new = data[: word.start()] + put + data[word.end() :]
        case _:
            a = draw.randrange(len(lines))
            b = draw.randrange(len(lines))
            lines[a], lines[b] = lines[b], lines[a]
            new = b"\n".join(lines[: draw.choice((None, -1))])
    return new


def _changed_values(data: bytes, draw: random.Random, seeds: list[Files]) -> bytes:
    """JSON with one value, at any depth, left out, doubled, or replaced by another or one of another type."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):  # changed before
        return _changed(data, draw, seeds)
    node = value
    places = []
    while isinstance(node, dict | list) and node:
        places.append((node, draw.choice(list(node) if isinstance(node, dict) else range(len(node)))))
        node = places[-1][0][places[-1][1]]
    if not places:
        return _changed(data, draw, seeds)
    parent, key = draw.choice(places)
    match draw.randrange(4):
        case 0:
            del parent[key]
        case 1 if isinstance(parent, list):
            parent.append(parent[key])
        case 2:
            other, name = draw.choice(places)
            parent[key] = json.loads(json.dumps(other[name]))
        case _:
            parent[key] = json.loads(draw.choice(_VALUES))
    return json.dumps(value).encode()


def _changed_header(data: bytes, draw: random.Random, seeds: list[Files]) -> bytes:
    """An EXR file with another number in an attribute of its headers, or anywhere in these."""
    places = [found.end() for found in re.finditer(rb"\0(box2i|int|compression|chlist|string|tiledesc)\0", data)]
    if not places:
        return _changed(data, draw, seeds)
    start = draw.choice(places) + draw.choice((0, 4, 8, 12, 16)) if draw.random() < 0.7 else draw.randrange(max(places))
    return data[:start] + struct.pack("<i", draw.choice(_WHOLE)) + data[start + 4 :]


_SPECIAL = {".json": _changed_values, ".exr": _changed_header}
_WHOLE = 0, 1, 2, -1, -2, 7, 255, 256, 65535, 65536, 100_000, 2**31 - 1, -(2**31), 2**30, 10**9, 31_623, 8192, -8192


def outcome_of(load: Callable[[Path], object], files: Files, folder: Path) -> Outcome:
    """The outcome of files for a loader; they are written to a folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    try:
        load(folder / next(iter(files)))
    except BaseException as error:
        causes = [error]
        while (cause := causes[-1].__cause__ or causes[-1].__context__) and cause not in causes:
            causes.append(cause)
        if any(isinstance(each, MemoryError) for each in causes):
            return "memory", traceback.format_exc()
        if not isinstance(error, LfssaoError):
            return "traceback", traceback.format_exc()
        return "refused" if "\n" not in str(error) else "not a sentence", str(error)
    return "read", ""


def _work(seed: int, megabytes: int, connection: Connection) -> None:
    """Run mutants of loaders by their names and numbers until there is none; what they print goes nowhere."""
    seeds: dict[str, list[Files]] = {}
    with tempfile.TemporaryDirectory() as root, suppress(EOFError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        while True:
            name, number = connection.recv()
            load = LOADERS[name].load
            if name not in seeds:
                resource.setrlimit(resource.RLIMIT_DATA, (resource.RLIM_INFINITY,) * 2)
                seeds[name] = LOADERS[name].seeds()
                for k, files in enumerate(seeds[name]):  # imports and compiles
                    outcome_of(load, files, Path(root, f"{name}{k}"))
                taken = int(re.search(r"VmData:\s*(\d+)", Path("/proc/self/status").read_text())[1]) << 10
                resource.setrlimit(resource.RLIMIT_DATA, (taken + (megabytes << 20), resource.RLIM_INFINITY))
                connection.send("ready")
            folder = Path(root, str(number))
            connection.send(outcome_of(load, mutant(seeds[name], number, seed), folder))
            shutil.rmtree(folder)


class Worker:
    """A process that runs mutants of any loader; it is started again when it dies or hangs."""

    def __init__(self, seed: int, megabytes: int = 2048, seconds: float = 30) -> None:
        self._given, self._seconds = (seed, megabytes), seconds
        self._context = multiprocessing.get_context("spawn")
        self._process: multiprocessing.Process | None = None

    def outcome(self, name: str, number: int) -> Outcome:
        """The outcome of one mutant."""
        if self._process is None:
            self._ours, theirs = self._context.Pipe()
            self._process = self._context.Process(target=_work, args=(*self._given, theirs), daemon=True)
            self._process.start()
            theirs.close()
            self._loaded: set[str] = set()
        self._ours.send((name, number))
        try:
            if name not in self._loaded:
                self._loaded.add(self._ours.recv() and name)
            if self._ours.poll(self._seconds):
                return self._ours.recv()
            outcome = "hang", f"no answer in {self._seconds:g} s"
        except EOFError:
            self._process.join()
            outcome = "died", f"exit code {self._process.exitcode}"
        self._process.kill()
        self._process = None
        return outcome


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("loader", choices=LOADERS)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="the number of the one mutant to run")
    parser.add_argument("--megabytes", type=int, default=2048)
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--keep", type=Path, help="folder for the files of findings")
    options = parser.parse_args()
    numbers = range(options.count) if options.only is None else range(options.only, options.only + 1)
    seeds = LOADERS[options.loader].seeds()
    found: Counter[Outcome] = Counter()
    counts: Counter[str] = Counter()
    worker = Worker(options.seed, options.megabytes, options.seconds)
    for number in numbers:
        kind, text = worker.outcome(options.loader, number)
        counts[kind] += 1
        if kind in GOOD and options.only is None:
            continue
        files = mutant(seeds, number, options.seed)
        # Tracebacks that end alike are printed once.
        end = text if kind in ("hang", "died") else "\n".join(text.strip().split("\n")[-4:-1])
        found[kind, end] += 1
        if found[kind, end] == 1 or kind == "hang":
            print(f"--- {kind}: mutant {number} of {next(iter(files))}\n{text}", flush=True)
        for name, content in files.items() if options.keep else ():
            path = options.keep / str(number) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    print(f"{options.loader}, seed {options.seed}: " + ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())))
    sys.exit(any(kind not in GOOD for kind in counts))


if __name__ == "__main__":
    main()
