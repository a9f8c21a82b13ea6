"""Writing files so that each is whole or absent."""

import os
import tempfile
from collections.abc import Callable
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
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        write(part)
        with part.open("rb+") as stream:
            os.fsync(stream.fileno())
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path}: it cannot be written ({error.strerror or error})") from error
    finally:
        part.unlink(missing_ok=True)


def make_folder(path: Path) -> None:
    """Make a folder, and try that files can be written into it.

    Raises
    ------
    InputError
        If it cannot be made or written into.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(f"{path}: the output folder cannot be written ({error.strerror or error})") from error
