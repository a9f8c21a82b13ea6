"""Ends a small job by SIGKILL at drawn moments, resumes it, and compares all textures with an undisturbed run's.

    python tests/tools/kills.py --count 50 --writing 35 --seed 1

Every run is a process of its own, `python -m lfssao render`, that nothing slows down. `--writing` of the kills wait
until a drawn number of temporary files has come and then a drawn part of the time that one lives; the others come at
a drawn part of the time that the job takes. A kill counts as one while writing if a temporary file is there afterwards.
"""

import argparse
import hashlib
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from lfssao.files.exr import read_exr

MODULES = 6
JOB = f"ammonite --display sample-a --modules 3:{3 + MODULES} --resolution 320x240 --radii 0.05,0.1 --threads 2 -o"
COMMAND = [sys.executable, "-m", "lfssao", "render", *JOB.split()]
WRITES = MODULES + 2  # with contact.png and manifest.json
TEXTURES = [f"module_{3 + k:03d}.exr" for k in range(MODULES)]


def start(folder: Path, *more: str) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    return subprocess.Popen([*COMMAND, str(folder), *more], env=environment, stdout=subprocess.DEVNULL)


def run(folder: Path, *more: str) -> None:
    if start(folder, *more).wait():
        sys.exit(f"{folder}: the job failed")


def parts_in(folder: Path) -> set[str]:
    """Names of files that are being written."""
    return {file.name for file in folder.glob(".*.part*")}


def digests_of(folder: Path) -> dict[str, str]:
    """The SHA-256 of the pixels of each texture of each file that is there, whether or not a manifest is."""
    made = {}
    for file in (folder / name for name in TEXTURES if (folder / name).exists()):
        for name, part in read_exr(file).items():
            data = repr(part.channels).encode() + part.pixels.tobytes()
            made[f"{file.name} {name}"] = hashlib.sha256(data).hexdigest()
    return made


def watched(folder: Path) -> tuple[float, float]:
    """Seconds that an undisturbed job takes, and that a temporary file of it lives on average."""
    process = start(folder)
    begin = time.perf_counter()
    seen = []
    while process.poll() is None:
        seen.append(len(parts_in(folder)))
        time.sleep(0.0005)
    seconds = time.perf_counter() - begin
    return seconds, seconds * sum(seen) / len(seen) / WRITES


def killed(folder: Path, draw: random.Random, writing: bool, seconds: float, life: float) -> int | None:
    """End a job; how many temporary files it leaves, None if it was over before."""
    process = start(folder)
    files = draw.randrange(1, WRITES + 1)
    there = set()
    if writing:
        while len(there) < files and process.poll() is None:
            there |= parts_in(folder)
        time.sleep(draw.random() * 0.5 * life)
    else:
        time.sleep(draw.random() * seconds)
    over = process.poll() is not None
    process.kill()
    process.wait()
    return None if over else len(parts_in(folder))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--writing", type=int, default=35)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    done = 0
    while_writing = 0
    left = []
    wrong = 0
    with tempfile.TemporaryDirectory() as root:
        run(Path(root, "compiled"))
        right = Path(root, "undisturbed")
        seconds, life = watched(right)
        expected = digests_of(right)
        print(f"undisturbed: {seconds:.1f} s, {len(expected)} textures, a temporary file lives {1e3 * life:.1f} ms")
        while done < options.count:
            folder = Path(tempfile.mkdtemp(dir=root))
            parts = killed(folder, draw, done < options.writing, seconds, life)
            if parts is None:
                continue
            before = digests_of(folder)  # raises if a file is not whole
            run(folder, "--resume")
            after = digests_of(folder)
            hidden = [name for name in os.listdir(folder) if name.startswith(".")]
            bad = after != expected or not before.items() <= expected.items() or bool(hidden)
            done = done + 1
            while_writing = while_writing + (parts > 0)
            wrong = wrong + bad
            left.append(len(before) * MODULES // len(expected))
            outcome = "WRONG" if bad else "resumed"
            print(f"{done}: {parts} temporary files, {left[-1]} of {MODULES} files whole: {outcome}", flush=True)
    whole = ", ".join(f"{left.count(n)} times {n}" for n in sorted(set(left)))
    print(f"{done} kills, {while_writing} while a file was being written; files whole before --resume: {whole}")
    print(f"seed {options.seed}: {len(expected)} textures a run, {wrong} runs with other digests")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
