"""Freed memory stays with the process, where the next textures go."""

import ctypes
from contextlib import suppress

# glibc's parameters of mallopt: what is larger than the one comes from the system and goes back at once; what is free
# at the end of the heap goes back from the other on.
_MAP_FROM, _TRIM_FROM = -3, -1
_LARGEST_ON_HEAP, _KEPT = 1 << 25, 1 << 30  # bytes; the first is the most that glibc takes


def keep_freed_memory() -> None:
    """Let the C library keep freed memory for later arrays, as far as it can be told to (glibc can).

    The system clears every page that it gives. Textures are of a few megabytes, which by default come from the system
    and go back to it each time: an eighth of the processor time of a display.
    """
    with suppress(OSError, AttributeError, TypeError):  # no such library, function, or way to ask for it
        set_option = ctypes.CDLL(None).mallopt
        set_option(_TRIM_FROM, _KEPT)
        set_option(_MAP_FROM, _LARGEST_ON_HEAP)
