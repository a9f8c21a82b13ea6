"""Nothing is lost: whatever ends a job, its files are whole or absent, and --resume ends as an undisturbed run."""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import read_parts, write_parts
from jobs import NEEDS_EMBREE, digests_of, manifest_of, render, sentence

import lfssao
from lfssao.errors import InputError
from lfssao.files.exr import Part, write_exr
from lfssao.files.whole import _namespace, remove_leftovers

COUNT = 6
COMMAND = ["ammonite", "--display", "sample-a", "--modules", f"3:{3 + COUNT}", "--resolution", "64x48",
           "--radii", "0.05,0.1", "--blur", "1.5"]  # fmt: skip
FILES = [f"module_{3 + k:03d}.exr" for k in range(COUNT)]


def run(folder, *more, code=0):
    return render(folder, *COMMAND, *more, code=code)


def without_seconds(folder):
    return [{name: value for name, value in view.items() if name != "seconds"} for view in manifest_of(folder)["views"]]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return run(tmp_path_factory.mktemp("undisturbed") / "out")


def pixels_digest(path):
    """SHA-256 over all parts' pixels of a file, by OpenImageIO alone; it must be readable to its end."""
    parts = read_parts(path)
    assert len(parts) == 8
    return hashlib.sha256(b"".join(pixels.tobytes() for _, pixels in parts)).hexdigest()


def check_whole_or_absent(folder, undisturbed):
    """How many textures are there, each as it should be; a manifest only when all are."""
    names = [name for name in os.listdir(folder) if not name.startswith(".")] if folder.exists() else []
    assert set(names) <= {*FILES, "contact.png", "manifest.json"}
    there = [name for name in names if name in FILES]
    for name in there:
        assert pixels_digest(folder / name) == pixels_digest(undisturbed / name)
    if "manifest.json" in names:
        assert len(there) == COUNT
        assert digests_of(folder) == digests_of(undisturbed)
    return len(there)


def check_resumes(folder, undisturbed):
    run(folder, "--resume")
    assert sorted(os.listdir(folder)) == sorted([*FILES, "contact.png", "manifest.json"])
    assert without_seconds(folder) == without_seconds(undisturbed)
    for name in FILES:
        assert pixels_digest(folder / name) == pixels_digest(undisturbed / name)
    assert (folder / "contact.png").read_bytes() == (undisturbed / "contact.png").read_bytes()


# Job arrays


@pytest.mark.slow
def test_tasks_of_single_modules_and_a_resume_make_the_files_of_one_job(tmp_path):
    """Three tasks of an array run at once in one folder; a fourth module is left to the resume."""
    whole = tmp_path / "whole"
    shared = tmp_path / "shared"
    words = [*COMMAND[:3], "--modules", "4:8", *COMMAND[5:]]
    render(whole, *words)
    alone = [sys.executable, "-m", "lfssao", "render", *COMMAND[:3], *COMMAND[5:], "-o", str(shared)]
    tasks = [subprocess.Popen([*alone, "--modules", str(4 + task)], stdout=subprocess.DEVNULL) for task in range(3)]
    assert [task.wait() for task in tasks] == [0] * 3
    made = {f"module_{4 + task:03d}.exr" for task in range(3)}
    assert made <= set(os.listdir(shared))
    before = {name: (shared / name).stat().st_ino for name in made}
    render(shared, *words, "--resume")
    assert {name: (shared / name).stat().st_ino for name in made} == before
    assert sorted(os.listdir(shared)) == sorted(os.listdir(whole))
    for path in whole.iterdir():
        if path.name != "manifest.json":
            assert (shared / path.name).read_bytes() == path.read_bytes(), path.name
    assert without_seconds(shared) == without_seconds(whole)


# SIGKILL


@pytest.fixture(scope="module")
def server():
    """A process that runs commands in children of its own."""
    command = [sys.executable, str(Path(__file__).parents[1] / "helpers" / "fork_server.py")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        assert process.stdout.readline() == "ready\n"
        yield process
        process.stdin.close()


def start(server, folder, wanted):
    """Begin the job in a child and wait for so many files; the child's number."""
    server.stdin.write(json.dumps(["render", *COMMAND, "-o", str(folder)]) + "\n")
    server.stdin.flush()
    child = int(server.stdout.readline())
    # A job that is over before that has all its files or failed, which check_whole_or_absent tells.
    while sum(name in FILES for name in (os.listdir(folder) if folder.exists() else ())) < wanted:
        time.sleep(0.0005)
    return child


@pytest.mark.slow
def test_killed_at_random_moments(server, undisturbed, tmp_path):
    """Moments are spread over the job by how many files are there, not by the clock, which differs between machines."""
    random_ = random.Random(8)
    stopped_between = 0
    for kill in range(24):
        folder = tmp_path / f"{kill}"
        wanted = random_.randrange(COUNT + 1)
        rest = 0.02 * random_.random()
        child = start(server, folder, wanted)
        time.sleep(rest)
        os.kill(child, signal.SIGKILL)
        assert server.stdout.readline() == "over\n"
        stopped_between += 0 < check_whole_or_absent(folder, undisturbed) < COUNT
        check_resumes(folder, undisturbed)
        shutil.rmtree(folder)
    assert stopped_between > 5  # else the moments would not be where files are written


def test_leftovers_of_the_dead_go_and_those_of_the_living_and_of_other_machines_stay(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    here = _namespace()
    end = f"{0:016x}.part"
    gone = [f".a.{here}.{dead.pid}.{end}.exr", f".a.b.{here}.{dead.pid}.{end}", f".old.abc.1.{end}.exr"]
    stay = [f".a.{here}.{os.getpid()}.{end}.exr", f".a.0ther.{dead.pid}.{end}.exr", f".a.abc.{dead.pid}.{end}.exr"]
    for name in [*gone, *stay, ".mine.part", "a.exr"]:
        (tmp_path / name).write_text("x")
    os.utime(tmp_path / gone[2], (0, 0))
    os.utime(tmp_path / ".mine.part", (0, 0))
    remove_leftovers(tmp_path)
    assert sorted(os.listdir(tmp_path)) == sorted([*stay, ".mine.part", "a.exr"])


# Full disks, unwritable folders


@contextmanager
def small_disk(folder, size):
    """A file system in memory of so many bytes, which only root can make: as root a failure is a failure."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(folder)]
    done = subprocess.run(mount, capture_output=True, check=False)
    if done.returncode != 0 and os.geteuid() != 0:
        pytest.skip("only root can mount a small disk")
    assert done.returncode == 0, done.stderr
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def test_every_amount_of_room_gives_a_whole_file_or_an_error(tmp_path):
    """The last bytes, written when the file is closed, must not be lost either."""
    random_ = np.random.default_rng(3)
    failed = 0
    with small_disk(tmp_path / "disk", 96 * 1024) as disk:
        for rows in range(40, 70):
            parts = [Part(name, ("Z",), random_.random((rows, 250, 1), np.float32)) for name in ("a", "b")]
            said = ""
            try:
                write_exr(disk / "a.exr", parts)
            except InputError as error:
                said = str(error)
            if said:
                failed += 1
                assert "the disk is full" in said
                assert os.listdir(disk) == []
                continue
            source = oiio.ImageInput.open(str(disk / "a.exr"))
            for number, part in enumerate(parts):
                assert source.read_image(number, 0, 0, 1, oiio.FLOAT).tobytes() == part.pixels.tobytes()
            source.close()
            os.unlink(disk / "a.exr")
    assert 0 < failed < 30


# Ctrl-C


@pytest.mark.parametrize("after", [1, 3])
def test_interrupted(server, undisturbed, tmp_path, after):
    folder = tmp_path / "out"
    os.kill(start(server, folder, after), signal.SIGINT)
    assert server.stdout.readline() == "over\n"
    assert check_whole_or_absent(folder, undisturbed) >= after
    assert not [name for name in os.listdir(folder) if name.startswith(".")]
    check_resumes(folder, undisturbed)


# Files that --resume keeps, makes anew and refuses


def stamps(folder):
    return {name: (folder / name).stat().st_mtime_ns for name in FILES}


def test_a_finished_job_is_left_as_it_is(undisturbed, tmp_path):
    folder = shutil.copytree(undisturbed, tmp_path / "out")
    before = stamps(folder)
    check_resumes(folder, undisturbed)
    assert stamps(folder) == before
    assert all(set(view["seconds"]) == {"verify"} for view in manifest_of(folder)["views"])


def flip(path):
    """Change one bit of a file's pixels but not their length: reading may or may not notice."""
    data = bytearray(path.read_bytes())
    data[len(data) * 3 // 4] ^= 16
    path.write_bytes(data)


def flip_in_header(path):
    """Change a bit that no reader of textures looks at."""
    data = bytearray(path.read_bytes())
    data[data.index(b"screenWindowWidth") + 30] ^= 1
    path.write_bytes(data)


def replaced(path, make):
    """Something that is no regular file, in the place of a file."""
    path.unlink()
    make(path)


def other_pixels(path):
    """A whole EXR file of ours whose pixels are not those that its metadata speak of."""
    parts = read_parts(path)
    parts[6][1][5, 7, 0] += 0.25
    write_parts(path, parts)


def other_header(path, change):
    """A whole file with right pixels, the metadata of its first part changed."""
    parts = read_parts(path)
    change(parts[0][0])
    write_parts(path, parts)


def another_type(path):
    """Metadata of a type that nobody knows, which are read as bytes."""
    known = b"lfssao:surface_texels\0int\0"
    path.write_bytes(path.read_bytes().replace(known, known.replace(b"int", b"tni")))


DAMAGES = {
    "bit": flip,
    "header's bit": flip_in_header,
    "pipe": lambda path: replaced(path, os.mkfifo),
    "device": lambda path: replaced(path, lambda link: link.symlink_to("/dev/zero")),
    "no link": lambda path: replaced(path, lambda link: link.symlink_to("nowhere")),
    "pixels": other_pixels,
    "attribute": lambda path: other_header(path, lambda spec: spec.erase_attribute("lfssao:surface_texels")),
    "header": lambda path: other_header(path, lambda spec: spec.attribute("lfssao:surface_texels", 1)),
    "type": another_type,
    "cut": lambda path: os.truncate(path, path.stat().st_size // 2),
    "empty": lambda path: path.write_bytes(b""),
    "absent": lambda path: path.unlink(),
    "foreign": lambda path: write_exr(path, [Part("a", ("Z",), np.zeros((2, 2, 1), np.float32))]),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_made_anew_and_the_rest_kept(undisturbed, tmp_path, damage):
    folder = shutil.copytree(undisturbed, tmp_path / "out")
    before = stamps(folder)
    DAMAGES[damage](folder / FILES[2])
    check_resumes(folder, undisturbed)
    after = stamps(folder)
    assert [name for name in FILES if after[name] != before[name]] == [FILES[2]]


PICTURES = {
    "absent": lambda path: path.unlink(),
    "bit": flip,
    "cut": lambda path: os.truncate(path, path.stat().st_size // 2),
    "empty": lambda path: path.write_bytes(b""),
    "another's": lambda path: shutil.copy(path.with_name("module_005.png"), path),
    "pipe": lambda path: replaced(path, os.mkfifo),
    "device": lambda path: replaced(path, lambda link: link.symlink_to("/dev/zero")),
    "with its texture": lambda path: (path.unlink(), path.with_suffix(".exr").unlink()),
}


def test_a_damaged_picture_is_written_anew_from_its_texture(undisturbed, tmp_path):
    """Also where the job had none before; pictures that are whole stay."""
    folder = shutil.copytree(undisturbed, tmp_path / "out")
    before = stamps(folder)
    pictures = [name.replace(".exr", ".png") for name in FILES]
    run(folder, "--resume", "--png")
    assert stamps(folder) == before
    assert sorted(os.listdir(folder)) == sorted([*FILES, *pictures, "contact.png", "manifest.json"])
    right = {name: (folder / name).read_bytes() for name in pictures}
    listed = without_seconds(folder)
    assert len(set(right.values())) == COUNT
    for what, damage in PICTURES.items():
        times = {name: (folder / name).stat().st_mtime_ns for name in pictures}
        damage(folder / pictures[1])
        run(folder, "--resume", "--png")
        assert {name: (folder / name).read_bytes() for name in pictures} == right, what
        again = {name: (folder / name).stat().st_mtime_ns for name in pictures}
        assert [name for name in pictures if again[name] != times[name]] == [pictures[1]], what
        assert without_seconds(folder) == listed


@pytest.mark.parametrize(("words", "name"), [
    (["statue", *COMMAND[1:]], "scene"),
    *(([*COMMAND, *more.split()], name) for more, name in (
        ("--radii 0.05,0.11", "radii"), ("--samples 9", "samples"), ("--seed 1", "samples"), ("--blur 1", "blur_sigma"),
        ("--guard 2", "guard"), ("--resolution 64x50", "resolution"), ("--filter nearest", "color_filter"),
        ("--normals", "normals"),
    )),
    pytest.param([*COMMAND, "--caster", "embree"], "caster", marks=NEEDS_EMBREE),
    (COMMAND, "version"),
])  # fmt: skip
def test_resume_refuses_another_job(undisturbed, tmp_path, capsys, monkeypatch, words, name):
    folder = shutil.copytree(undisturbed, tmp_path / "out")
    os.unlink(folder / FILES[0])
    before = {file: (folder / file).read_bytes() for file in os.listdir(folder)}
    if name == "version":
        monkeypatch.setattr(lfssao, "__version__", "9.9.9")
    render(folder, *words, "--resume", code=2)
    error = sentence(capsys)
    assert f"{FILES[1]}: it was rendered with other parameters (" in error
    assert name in error.split("(")[1].split(")")[0].split(", ")
    assert {file: (folder / file).read_bytes() for file in os.listdir(folder)} == before


def test_resume_notices_another_colour(tmp_path, capsys):
    for color, more, code in (("1 0 0", [], 0), ("0 1 0", ["--resume"], 2)):
        lines = "".join(f"v {x} {y} 0 {color}\n" for x, y in ((0, 0), (1, 0), (0, 1)))
        (tmp_path / "a.obj").write_text(lines + "f 1 2 3\n")
        render(tmp_path / "out", str(tmp_path / "a.obj"), "--resolution", "16x12", *more, code=code)
    assert "other parameters (scene)" in capsys.readouterr().err
