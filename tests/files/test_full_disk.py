"""System calls that fail, one or all from one on: no broken file under its name, one sentence, --resume completes."""

import errno
import json
import os
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from failing_calls import run_failing
from jobs import digests_of, python
from PIL import Image

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.files.exr import Part, use_one_thread_a_file, write_exr
from lfssao.files.npy import write_npy
from lfssao.files.whole import write_text, write_whole

COMMAND = ["corner", "--camera", "--resolution", "8x6", "--radii", "0.1", "--samples", "2"]
FILES = ["camera.exr", "contact.png", "manifest.json"]
STEP, WIDE = 17, 6  # between the calls of a job, and of a writer, from which on a disk is full

NOISE = np.random.default_rng(5).random((40, 30, 2), np.float32)
PARTS = [
    Part("a", ("X", "Y"), NOISE, {"text": "t" * 5000}),  # more than a stream's block
    Part("b", ("Z",), NOISE[..., :1], compression="rle"),
]
WRITERS = {
    "a.exr": lambda path: write_exr(path, PARTS, sealed=True),
    "one.exr": lambda path: write_exr(path, PARTS[:1]),
    "a.png": lambda path: write_whole(path, Image.fromarray(np.uint8(NOISE[..., 0] * 255)).save),
    "a.npy": lambda path: write_whole(path, partial(write_npy, array=NOISE)),
    "a.json": lambda path: write_text(path, json.dumps(NOISE[0].tolist())),
}


def write(path):
    try:
        WRITERS[path.name](path)
    except InputError as error:
        return 2 if "it cannot be written (" in str(error) else 3
    return 0


def fail_calls_of_writers(folder):
    """A row for each call of each writer: which fail, the bytes under the final name, right ones, the exit code."""
    rows = []
    for name in WRITERS:
        path = folder / name
        assert write(path) == 0
        right = path.read_bytes()
        path.unlink()
        _, calls = run_failing(lambda: write(path), folder, lambda _: 0)  # noqa: B023
        for first, kind in enumerate(calls):
            full = [(errno.ENOSPC, len(calls))] if first % WIDE == 0 else []
            for error, last in [(errno.EIO, first), *full]:
                path.unlink(missing_ok=True)
                code, _ = run_failing(lambda: write(path), folder, lambda n: error if first <= n <= last else 0)  # noqa: B023
                found = path.read_bytes() if path.exists() else None
                state = "absent" if found is None else "whole" if found == right else "broken"
                rows.append((f"{name}: {kind} {first}..{last}", state, code))
                for part in folder.glob(".*.part*"):
                    part.unlink()
    return rows


def same(path, right):
    """Whether a file of a job is that of an undisturbed run; manifests hold times."""
    if path.suffix == ".json":
        return digests_of(path.parent) == digests_of(right.parent)
    return path.read_bytes() == right.read_bytes()


def fail_calls_of_a_job(folder):
    """A row for each call from which on a disk is full: files, broken ones, exit code, sentence, the same resumed."""
    right = folder / "right"
    main(["render", *COMMAND, "-o", str(right)])
    rows = []
    log = folder / "log"

    def job(out, *more):
        os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), 2)
        return main(["render", *COMMAND, "-o", str(out), *more])

    _, calls = run_failing(lambda: job(folder / "full" / "out"), folder / "full", lambda _: 0)
    for first in range(0, len(calls), STEP):
        shutil.rmtree(folder / "full")
        out = folder / "full" / "out"
        code, _ = run_failing(lambda: job(out), folder / "full", lambda n: errno.ENOSPC if n >= first else 0)  # noqa: B023
        there = sorted(os.listdir(out)) if out.exists() else []
        broken = [name for name in there if name not in FILES or not same(out / name, right / name)]
        rows.append((first, calls[first], len(there), broken, code, log.read_text()))
        code, _ = run_failing(lambda: job(out, "--resume"), folder / "full", lambda _: 0)  # noqa: B023
        rows[-1] += (code, sorted(os.listdir(out)), all(same(out / name, right / name) for name in FILES))
    return rows


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Rows of a process that has no threads; a child would lack them."""
    folder = tmp_path_factory.mktemp("disk")
    return json.loads(python(__file__, str(folder)).stdout.splitlines()[-1])


def test_no_call_that_fails_leaves_a_broken_file_or_goes_unnoticed(rows):
    assert len(rows["writers"]) > 100
    for label, state, code in rows["writers"]:
        assert state != "broken", label
        harmless = state == "whole" and not any(name in label for name in (" write ", " fsync ", " rename "))
        assert code == 2 or (code == 0 and harmless), label


def test_a_disk_that_is_full_from_a_call_on(rows):
    assert len(rows["job"]) > 5
    for first, call, _, broken, code, error, *after in rows["job"]:
        assert (broken, code, error.count("\n")) == ([], 2, 1), (first, call, error)
        assert "No space left on device" in error or "camera.exr: it cannot be written (" in error
        assert after == [0, FILES, True], (first, call)
    assert {count for _, _, count, *_ in rows["job"]} == {0, 1, 2}


if __name__ == "__main__":
    use_one_thread_a_file()
    folder = Path(sys.argv[1])
    (folder / "writers").mkdir()
    (folder / "full").mkdir()
    print(json.dumps({"writers": fail_calls_of_writers(folder / "writers"), "job": fail_calls_of_a_job(folder)}))
