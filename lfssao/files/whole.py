"""Writing files so that each is whole or absent, and reading text."""

import errno
import json
import os
import re
import secrets
import shutil
import stat
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from lfssao.errors import InputError

_BLOCK = 65_536  # bytes
_DAY = 86_400  # seconds
_CANNOT_SYNC = (errno.EINVAL, errno.ENOTSUP)  # by file systems that cannot sync a folder


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` make a file under a temporary name in ``path``'s folder, sync it, rename it to ``path``, sync that.

    The temporary name has the same ending and cannot be guessed; a file of the final name is replaced, its mode kept.
    A device or pipe is written into. InputError if it cannot be written.
    """
    own = f"{_namespace()}.{os.getpid()}.{secrets.token_hex(8)}"
    part = path.with_name(f".{path.stem[:32]}.{own}.part{path.suffix}")  # names end at 255 bytes
    try:
        if path.exists() and not path.is_file():
            write(path)
            return
        with part.open("xb"):  # fails where a link or a file has that name
            pass
        if path.exists():
            part.chmod(stat.S_IMODE(path.stat().st_mode))
        write(part)
        with part.open("rb+") as stream:
            os.fsync(stream.fileno())
        part.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        full = ""
        with suppress(OSError):  # libraries' messages do not name that cause
            full = " and the disk is full" if shutil.disk_usage(path.parent).free < _BLOCK else ""
        raise InputError(f"{path}: it cannot be written ({error.strerror or error}){full}") from error
    finally:
        with suppress(OSError):  # the folder may be what is wrong
            part.unlink(missing_ok=True)


def check_file(path: Path, hint: str = "") -> None:
    """Refuse (InputError) what is no regular file: a pipe would wait for whoever writes into it."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: it is a folder, not a file")
        if not path.exists():
            raise InputError(f"{path}: there is no such file{hint}")
        if not path.is_file():
            raise InputError(f"{path}: it is not a regular file")
    except OSError as error:  # a name too long, or a folder that must not be read
        raise InputError(f"{path}: it cannot be read ({error.strerror})") from error


def read_text(path: Path) -> str:
    """Return the text of a file; InputError if it is no regular file or cannot be read."""
    check_file(path)
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a name that no file can have
        raise InputError(f"{path}: it cannot be read ({getattr(error, 'strerror', None) or error})") from error


def read_json(path: Path) -> Any:
    """Return the value of a JSON file; InputError if it cannot be read, or is none."""
    text = read_text(path)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: it is not a JSON file ({error})") from error


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 file, as ``write_whole`` does; InputError if it cannot be written."""
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8"))


@cache
def _namespace() -> str:
    """Digits of this machine's start and of the processes that have numbers of their own here; '0' if unknown."""
    try:
        facts = Path("/proc/sys/kernel/random/boot_id").read_text(), Path("/proc/self/ns/pid").stat().st_ino
        return f"{zlib.crc32(repr(facts).encode()):08x}"
    except OSError:
        return "0"


def _sync_folder(folder: Path) -> None:
    """Let the names in a folder survive a power failure, where the system can sync it; OSError if that fails."""
    try:
        number = os.open(folder, os.O_RDONLY)
    except PermissionError:  # one that can be written and not be read, and any folder on Windows
        return
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in _CANNOT_SYNC:
            raise
    finally:
        os.close(number)


def remove_leftovers(folder: Path) -> None:
    """Remove half-written files of processes that were killed here, and those of others that are a day old."""
    for part in folder.glob(".*.part*"):
        found = re.fullmatch(r"\..*\.([0-9a-f]+)\.([0-9]+)\.[0-9a-f]{16}\.part(\..*)?", part.name)
        with suppress(OSError):
            if found and (
                (found[1] == _namespace() != "0" and not _is_running(int(found[2])))
                or time.time() - part.lstat().st_mtime > _DAY
            ):
                part.unlink()


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # another user's
        pass
    return True


def check_folder(path: Path) -> None:
    """Refuse (InputError) a folder that cannot be made or written into, as far as that shows without touching it."""
    existing = path
    while not existing.exists() and existing != existing.parent:
        if existing.is_symlink():
            raise InputError(f"{path}: the output folder cannot be made: {existing} is a link to nothing")
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{path}: the output folder cannot be made: {existing} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the output folder cannot be written (no permission to write into {existing})")


@contextmanager
def output_folder(path: Path) -> Iterator[None]:
    """Make a folder with its parents, try that files can be written there (InputError), tidy up if the block fails."""
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=path).close()
            for folder in missing:
                _sync_folder(folder.parent)
        except OSError as error:
            raise InputError(f"{path}: the output folder cannot be written ({error.strerror or error})") from error
        yield
    except BaseException:
        with suppress(OSError):
            for part in path.glob(f".*.{_namespace()}.{os.getpid()}.*.part*"):
                part.unlink()
            for folder in missing:  # that were made here, the deepest first; one that holds something stays
                folder.rmdir()
        raise
