"""Files are whole or absent, and folders that cannot be written are refused before anything is touched."""

import os
from pathlib import Path

import numpy as np
import pytest
from jobs import sentence

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.files.whole import _namespace, check_folder, output_folder, read_text, write_whole


def test_write_whole_keeps_the_old_file_when_interrupted(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def interrupted(part):
        part.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_whole(path, interrupted)
    assert os.listdir(tmp_path) == ["a.txt"]
    assert path.read_text() == "old"


def test_write_whole_replaces_and_does_not_overwrite(tmp_path):
    # A reader that has the old file open, or a link to it, keeps it whole.
    path = tmp_path / "a.txt"
    path.write_text("old")
    os.link(path, tmp_path / "link.txt")
    write_whole(path, lambda part: part.write_text("new"))
    assert (path.read_text(), (tmp_path / "link.txt").read_text()) == ("new", "old")


def test_temporary_names_cannot_be_guessed_and_links_in_their_place_are_not_followed(tmp_path, monkeypatch):
    names = []
    for _ in range(2):
        write_whole(tmp_path / "a.txt", lambda part: names.append(part.name) or part.write_text("x"))
    assert len(set(names)) == 2
    monkeypatch.setattr("secrets.token_hex", lambda _: "f" * 16)
    victim = tmp_path / "victim"
    planted = tmp_path / f".a.{_namespace()}.{os.getpid()}.{'f' * 16}.part.txt"
    victim.write_text("mine")
    planted.symlink_to(victim)
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path / "a.txt", lambda part: part.write_text("theirs"))
    assert victim.read_text() == "mine"


def test_write_whole_keeps_the_mode_and_takes_names_as_long_as_can_be(tmp_path):
    path = tmp_path / f"{'n' * 251}.txt"
    write_whole(path, lambda part: part.write_text("old"))
    path.chmod(0o640)
    write_whole(path, lambda part: part.write_text("new"))
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640
    other = tmp_path / "other"
    other.write_text("")
    write_whole(tmp_path / "b.txt", lambda part: part.write_text("new"))
    assert (tmp_path / "b.txt").stat().st_mode == other.stat().st_mode


def test_a_device_or_pipe_is_written_into_and_stays(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, lambda part: part.write_text("through"))
    assert os.read(reader, 100) == b"through"
    os.close(reader)
    assert pipe.is_fifo()
    with pytest.raises(InputError, match="/dev/full: it cannot be written"):
        write_whole(Path("/dev/full"), lambda part: part.write_text("x"))
    assert Path("/dev/full").is_char_device()


@pytest.mark.parametrize("command", [
    "view FOLDER -o x.png", "samples check FOLDER/a.csv", "samples check FOLDER/a.npy", "render FOLDER/a.obj -o out",
    "render corner --display FOLDER/a.toml -o out", "render corner --camera --frames FOLDER/a.json -o out",
    "render corner --camera --rotate FOLDER/a.png -o out", "compare FOLDER/folder FOLDER/a.png",
    "ao --depth FOLDER/a.npy --buffers FOLDER --radii 1 -o out",
    "ao --depth FOLDER/b.npy --buffers FOLDER/a.toml --radii 1 -o out",
    "ao --depth FOLDER/b.npy --buffers FOLDER --radii 1 --like FOLDER/a.toml -o out",
])  # fmt: skip
def test_no_command_waits_for_a_pipe(tmp_path, capsys, command):
    for name in ("manifest.json", "a.csv", "a.npy", "a.obj", "a.toml", "a.json", "a.png"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "folder").mkdir()
    np.save(tmp_path / "b.npy", np.zeros((2, 2), np.float32))
    assert main(command.replace("FOLDER", str(tmp_path)).split()) in (2, 4)
    assert "it is not a regular file" in sentence(capsys)


def test_write_whole_into_a_folder_that_went(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path / "a" / "b.txt", lambda part: part.write_text("x"))
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path / "file" / "b.txt", lambda part: part.write_text("x"))


def test_output_folder_removes_only_what_it_made(tmp_path):
    (tmp_path / "old").mkdir()

    def fail_in(path, *made):
        with output_folder(path):
            for name in made:
                (path / name).write_text("x")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "old" / "new" / "newer")
    assert os.listdir(tmp_path) == ["old"]
    assert os.listdir(tmp_path / "old") == []
    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "old")
    assert os.listdir(tmp_path) == ["old"]
    # A signal between making the temporary file and the clause that removes it leaves it to the folder.
    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "new", "whole.exr", f".half.{_namespace()}.{os.getpid()}.0.part.exr", ".half.0.1.0.part.exr")
    assert sorted(os.listdir(tmp_path / "new")) == [".half.0.1.0.part.exr", "whole.exr"]


def test_check_folder_touches_nothing(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for bad in ("file", "file/a", "file/a/b", "link", "link/a"):
        with pytest.raises(InputError, match="the output folder cannot be made"):
            check_folder(tmp_path / bad)
    check_folder(tmp_path / "a" / "b")
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="no permission"):
        check_folder(tmp_path / "a" / "b")
    assert sorted(os.listdir(tmp_path)) == ["file", "link"]


def test_text_is_read_of_regular_files_alone(tmp_path):
    """A pipe would wait for whoever writes into it."""
    os.mkfifo(tmp_path / "pipe")
    for path, reason in (
        (tmp_path / "pipe", "it is not a regular file"),
        (tmp_path, "it is a folder, not a file"),
        (Path("/dev/zero"), "it is not a regular file"),
        (tmp_path / ("a" * 300), "it cannot be read"),
    ):
        with pytest.raises(InputError, match=f"^{path}: {reason}"):
            read_text(path)
