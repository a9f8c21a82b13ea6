"""Errors that lfssao raises on purpose, each one sentence."""

import difflib
from collections.abc import Iterable


class LfssaoError(Exception):
    """Base of every error that lfssao raises on purpose; the command line prints it as one sentence."""


class InputError(LfssaoError, ValueError):
    """Something that was handed in is wrong; the message names the file, option or argument and the reason."""


class MissingPackageError(LfssaoError, ImportError):
    """A package that this operation needs is not installed; the message names it and the operation."""


def no_such(kind: str, name: str, choices: Iterable[str]) -> InputError:
    """That there is no thing of a name: one sentence with the nearest name there is and all the others."""
    known = list(choices)
    near = difflib.get_close_matches(name, known, 1, 0.5)
    hint = f"the nearest is '{near[0]}' of" if near else "choose one of"
    return InputError(f"there is no {kind} '{name}': {hint} {', '.join(known)}")
