"""Mutated EXR and JSON files: ``compare`` ends with a code and a sentence, in bounded time and memory."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from compare_folders import changed, nudge, poke
from exr_parts import read_parts, write_parts, write_tiled
from hostile_worker import SECONDS, mutated
from PIL import Image

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.rendering.image_file import read_image_file

pytestmark = pytest.mark.slow

# Kind of file, whether its mutants are of an uncompressed file (whose numbers mutate too), how many: 2,100 in all.
RUNS = [("mine", False, 600), ("mine", True, 500), ("reference", False, 300), ("manifest", False, 700)]
COMMAND = ["render", "statue", "--display", "sample-a", "--modules", "3:4", "--resolution", "16x12", "--radii", "4%",
           "--samples", "4"]  # fmt: skip


def uncompress(path):
    parts = read_parts(path)
    for spec, _ in parts:
        spec.attribute("compression", "none")
    write_parts(path, parts)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A reference and a renderer's textures that differ from it, so that the oracle is asked."""
    folder = tmp_path_factory.mktemp("hostile")
    assert main([*COMMAND, "-o", str(folder / "reference")]) == 0
    (folder / "reference" / "contact.png").unlink()
    # Its mesh is not at hand: casting its rays anew for thousands of mutants would take minutes.
    manifest = folder / "reference" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"name": "statue"', '"name": "statue.obj"'))

    def change(parts):
        for single in (nudge("shaded"), poke("ao_1", (6, 8), 0.6), poke("depth", (6, 8), 2.0)):
            single(parts)

    changed(folder / "reference", folder / "mine", "module_003", change)
    changed(folder / "reference", folder / "plain", "module_003", change)
    uncompress(folder / "plain" / "module_003.exr")
    return folder


@pytest.mark.parametrize(("kind", "plain", "count"), RUNS)
def test_mutants_end_with_a_code_and_a_sentence(folders, tmp_path, kind, plain, count):
    worker = Path(__file__).parents[1] / "helpers" / "hostile_worker.py"
    words = kind, 0, count, folders / "reference", folders / ("plain" if plain else "mine"), tmp_path
    command, env = [sys.executable, worker, *map(str, words)], {**os.environ, "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=600)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    # The worker dies of what is not caught: a signal, a traceback, a warning, too much memory or time.
    last = rows[-1]["number"] if rows else None
    assert done.returncode == 0, f"after mutant {last} of {kind}: {done.returncode} {done.stderr[-2000:]}"
    assert [row["number"] for row in rows] == list(range(count))
    assert max(row["seconds"] for row in rows) < SECONDS
    codes = {code: sum(row["code"] == code for row in rows) for code in range(5)}
    assert sum(codes.values()) == count
    # Neither all refused nor all read: the mutants are hostile, and reach what lies behind the reader.
    assert codes[4] > count / 10
    assert codes[2] > count / 20
    for row in rows:
        if row["code"] == 4:
            said = [line for line in row["text"].split("\n") if "module_003.exr: " in line or "reference" in line]
            assert said, row


@pytest.mark.parametrize("ending", ["npy", "tif", "png"])
def test_mutants_of_other_formats_are_read_or_refused(tmp_path, ending):
    """In this process, as none of them has ever crashed it; a header that claims much is not believed."""
    pixels = np.random.default_rng(1).integers(0, 256, (9, 7, 3), np.uint8)
    path = tmp_path / f"a.{ending}"
    if ending == "npy":
        np.save(path, pixels.astype(np.float32))
    else:
        Image.fromarray(pixels).save(path)
    data, refused, read = path.read_bytes(), [], 0
    for number in range(400):
        path.write_bytes(mutated(ending, number, data))
        try:
            parts = read_image_file(path)
        except InputError as error:
            refused.append(str(error))
        else:
            assert sum(plane.nbytes for part in parts for plane in part.planes) <= 256 * 2**20
            read += 1
    assert min(len(refused), read) > 20
    assert all(sentence.startswith(str(path)) and "\n" not in sentence for sentence in refused)


@pytest.mark.parametrize("ending", ["exr", "tif"])
def test_a_tile_that_is_larger_than_memory_is_refused(tmp_path, ending):
    """The reader allocates a whole tile, however small the image is."""
    path = tmp_path / f"a.{ending}"
    pixels = np.random.default_rng(1).random((15, 20, 1), np.float32)
    write_tiled(path, pixels, 16)
    (part,) = read_image_file(path)
    assert np.array_equal(part.planes[0], pixels[..., 0])
    data = path.read_bytes()
    if ending == "exr":
        before = b"tiles\0tiledesc\0" + struct.pack("<i", 9)
        small, large = (before + struct.pack("<II", size, size) for size in (16, 30_000))
    else:  # TIFF's tags 322 and 323, TileWidth and TileLength: short, one of them, padded to 4 bytes
        small, large = (
            b"".join(struct.pack("<HHIHH", tag, 3, 1, size, 0) for tag in (322, 323)) for size in (16, 30_000)
        )
    assert data.count(small) == 1
    path.write_bytes(data.replace(small, large))
    words = (
        r"a\.\w+: its header claims 20x15 texels in tiles of 30000x30000, 3\.6 GB in all; a file of \d+ bytes cannot"
    )
    with pytest.raises(InputError, match=words):
        read_image_file(path)
