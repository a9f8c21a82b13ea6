"""Writing files so that each is whole or absent."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lfssao.errors import InputError


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Let ``write`` make a file under a temporary name beside ``path``, sync it, then rename it to ``path``.

    Parameters
    ----------
    path : Path
        The file to be; one of that name is replaced.
    write : callable
        Writes a whole file to the path it is given, which has the same ending.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    part = path.with_name(f"{_part_prefix(path.stem)}{path.suffix}")
    try:
        write(part)
        with part.open("rb+") as stream:
            os.fsync(stream.fileno())
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path}: it cannot be written ({_reason(error)})") from error
    finally:
        with suppress(OSError):  # the folder may be what is wrong
            part.unlink(missing_ok=True)


def _part_prefix(stem: str) -> str:
    """Start of the name of a file that is being written by this process."""
    return f".{stem}.{os.getpid()}.part"


def check_folder(path: Path) -> None:
    """Refuse, without touching anything, a folder that cannot be made or written into.

    Raises
    ------
    InputError
        If that can be seen beforehand.
    """
    there = path
    while not there.exists() and there != there.parent:
        if there.is_symlink():
            raise InputError(f"{path}: the output folder cannot be made: {there} is a link to nothing")
        there = there.parent
    if not there.is_dir():
        raise InputError(f"{path}: the output folder cannot be made: {there} is a file")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the output folder cannot be written (no permission to write into {there})")


@contextmanager
def output_folder(path: Path) -> Iterator[None]:
    """Make a folder with its parents, try that files can be written into it, and tidy up behind what fails inside.

    If the block raises, half-written files of this process go, and so do the folders made here if they are empty.

    Raises
    ------
    InputError
        If it cannot be made or written into.
    """
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        _make_folder(path)
        yield
    except BaseException:
        with suppress(OSError):
            for part in path.glob(f"{_part_prefix('*')}*"):
                part.unlink()
            for folder in missing:  # the deepest first; one that holds something stays
                folder.rmdir()
        raise


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(f"{path}: the output folder cannot be written ({_reason(error)})") from error


def _reason(error: OSError) -> str:
    return error.strerror or str(error) or "no reason was given"
