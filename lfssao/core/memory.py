"""The memory that this machine has, and what does not fit into it."""

import ctypes
import os
import re
from contextlib import suppress
from pathlib import Path

from lfssao.errors import InputError

# Deflate expands at most 1032 times, and what is read may be held twice; a small file may expand to so much anyway.
_MOST_EXPANSION = 2048
_HARMLESS = 2**30
# Numbers of mallopt(3), and bytes: arrays up to the largest that glibc allows come from memory that is kept.
_KEPT = {-3: 2**25, -1: 2**31 - 1, -2: 2**26}  # M_MMAP_THRESHOLD, M_TRIM_THRESHOLD, M_TOP_PAD


def available_memory() -> int | None:
    """Bytes that programs can still take without swapping, else all there are; None where the system does not say."""
    with suppress(OSError):
        found = re.search(r"MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(encoding="ascii"))
        if found:
            return 1024 * int(found[1])
    with suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def check_available(what: str, needed: float) -> None:
    """Refuse (InputError) what needs more bytes of memory than there are; the plural ``what`` begins the message."""
    available = available_memory()
    if available is not None and needed > available:
        raise InputError(f"{what} need {needed / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available")


def check_expansion(what: str, needed: float, held: int) -> None:
    """Refuse as ``check_available``, and beyond a GB also what files of ``held`` bytes cannot honestly expand to."""
    if needed > max(_HARMLESS, _MOST_EXPANSION * held):
        raise InputError(f"{what} need {needed / 1e9:.1f} GB of memory, too much for files of {held} bytes")
    check_available(what, needed)


def keep_freed_memory() -> None:
    """Let the C library keep what this process frees for what it takes next, where it is glibc.

    Each large array would be new pages of the system's, which take 11 of the 130 seconds of processor time in which
    21 wrong modules are compared.
    """
    with suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        for number, size in _KEPT.items():
            library.mallopt(number, size)
