"""Words on a terminal, and exit codes."""

import os
import sys
from contextlib import AbstractContextManager, nullcontext
from typing import Any

BROKEN = 1  # a check, promise or bound does not hold
BAD_INPUT = 2
NOT_COMPARED = 4  # by compare: there 1 says that textures are right, 2 that they differ
INTERRUPTED = 130


def say(sentence: str) -> None:
    """Print one sentence for the user on standard error, above a bar if there is one."""
    from tqdm import tqdm

    tqdm.write(f"lfssao: {printable(sentence)}", file=sys.stderr)


def printable(text: str) -> str:
    """Text on one line, for any terminal: file names may hold anything."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def progress(*items: Any, **more: Any) -> Any:
    """Return a progress bar on a terminal, nothing in a pipe; ``with`` ends its line before a message."""
    if not sys.stderr.isatty():
        from tqdm import tqdm  # late: the help of all commands needs none

        return tqdm(*items, **{**more, "disable": True})
    from lfssao.cli.bar import Bar  # late: only terminals show bars

    return Bar(*items, **{**_size(), **more})


def working(what: str) -> Any:
    """Return a line with the time on a terminal while a block runs that has no steps to count; nothing in a pipe."""
    return progress(desc=what, bar_format="{desc} {elapsed}", leave=False, delay=0.5)


def compiling_shown() -> AbstractContextManager[None]:
    """On a terminal, say which kernel is being compiled while a command runs that has any."""
    if not sys.stderr.isatty() or "numba" not in sys.modules:
        return nullcontext()
    from lfssao.cli.bar import compiling

    return compiling()


def _size() -> dict[str, int]:
    """Return a size for a terminal that does not know its own, on which tqdm would show nothing; else tqdm's choice."""
    try:
        size = os.get_terminal_size(sys.stderr.fileno())
    except (OSError, ValueError):
        return {}
    return {} if size.columns and size.lines else {"ncols": size.columns or 80, "nrows": size.lines or 24}
