"""A disk that is full at any one write of a job: one sentence, nothing half-written, and --resume completes it."""

import builtins
import errno
import io
import itertools
import os
import stat
import tempfile

import OpenEXR
from exr_parts import read_parts
from jobs import digests_of, render, sentence

from lfssao.cli.main import main

COMMAND = ["corner", "--camera", "--resolution", "8x6", "--radii", "0.1", "--samples", "2"]
FILES = ["camera.exr", "contact.png", "manifest.json"]


class Disk:
    """Counts all that takes room in a folder and below, and fails as a full disk does when a number is reached."""

    def __init__(self, monkeypatch, folder):
        self.folder, self.count, self.full_at, self.there = folder, 0, 0, []
        self.real_open, real_file = io.open, OpenEXR.File
        folder.mkdir()
        for module in (io, builtins):
            monkeypatch.setattr(module, "open", self.open)
        monkeypatch.setattr(tempfile, "TemporaryFile", self.before(tempfile.TemporaryFile, lambda: True))
        monkeypatch.setattr(os, "fsync", self.before(os.fsync, lambda number: stat.S_ISREG(os.fstat(number).st_mode)))
        monkeypatch.setattr(os, "replace", self.before(os.replace, self.is_here))
        new = lambda path, _: self.is_here(path) and not os.path.exists(path)  # noqa: E731
        monkeypatch.setattr(os, "mkdir", self.before(os.mkdir, new))

        class File(real_file):
            def write(_, path):  # noqa: N805
                try:
                    self.step()  # to begin it
                    real_file.write(_, path)
                    for _part in _.parts:
                        self.step()
                except OSError as error:
                    raise RuntimeError(error.strerror) from error

        monkeypatch.setattr(OpenEXR, "File", File)

    def step(self):
        self.count += 1
        if self.count == self.full_at:
            self.there = files_in(self.folder / f"{self.count}")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def is_here(self, path, *_):
        return str(path).startswith(str(self.folder))

    def before(self, call, counts):
        def stepping(*given, **more):
            if counts(*given):
                self.step()
            return call(*given, **more)

        return stepping

    def open(self, path, mode="r", *more, **others):
        if mode[0] == "r" or "opener" in others or not self.is_here(path):
            return self.real_open(path, mode, *more, **others)
        self.step()
        raw = Raw(path, mode.replace("b", ""))
        raw.disk = self
        buffered = (io.BufferedRandom if "+" in mode else io.BufferedWriter)(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, "utf-8")


class Raw(io.FileIO):
    def write(self, data):
        self.disk.step()
        return super().write(data)


def files_in(folder):
    """Names of the files that are whole."""
    return sorted(name for name in os.listdir(folder) if name in FILES) if folder.exists() else []


def test_a_disk_that_is_full_at_each_write(tmp_path, monkeypatch, capsys):
    right, disk = render(tmp_path / "right", *COMMAND), Disk(monkeypatch, tmp_path / "out")
    pixels = [pixels.tobytes() for _, pixels in read_parts(right / FILES[0])]
    capsys.readouterr()
    for disk.full_at in itertools.count(1):
        folder, disk.count = disk.folder / f"{disk.full_at}", 0
        code = main(["render", *COMMAND, "-o", str(folder)])
        if disk.count < disk.full_at:
            break
        assert code == 2
        assert "No space left on device" in sentence(capsys)
        assert files_in(folder) == disk.there
        assert not folder.exists() or sorted(os.listdir(folder)) == disk.there != []  # no folder without a file
        render(folder, *COMMAND, "--resume")
        capsys.readouterr()
        assert sorted(os.listdir(folder)) == FILES
        assert digests_of(folder) == digests_of(right)
        assert [pixels.tobytes() for _, pixels in read_parts(folder / FILES[0])] == pixels
    assert code == 0
    assert disk.count > 20
