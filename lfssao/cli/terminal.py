"""What commands say on a terminal."""

import os
import sys


def say(sentence: str) -> None:
    """One sentence for the user, on standard error."""
    print(f"lfssao: {printable(sentence)}", file=sys.stderr)


def printable(text: str) -> str:
    """Text on one line, for any terminal: file names may hold anything."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def bar_size() -> dict[str, int]:
    """A size for a terminal that does not know its own, on which tqdm would show nothing; else tqdm's choice."""
    try:
        size = os.get_terminal_size(sys.stderr.fileno())
    except (OSError, ValueError):
        return {}
    return {} if size.columns and size.lines else {"ncols": size.columns or 80, "nrows": size.lines or 24}
