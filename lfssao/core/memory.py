"""The memory that this machine has."""

import os
import re
from contextlib import suppress
from pathlib import Path


def available_memory() -> int | None:
    """Bytes that programs can still take without swapping, else all there are; None where the system does not say."""
    with suppress(OSError):
        found = re.search(r"MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(encoding="ascii"))
        if found:
            return 1024 * int(found[1])
    with suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None
