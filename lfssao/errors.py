"""Errors that lfssao raises on purpose, each one sentence."""

import difflib
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager


class LfssaoError(Exception):
    """Base of every error that lfssao raises on purpose; the command line prints it as one sentence."""


class InputError(LfssaoError, ValueError):
    """Something that was handed in is wrong; the message names the file, option or argument and the reason."""


class InputWarning(UserWarning):
    """Something that was handed in is allowed and is probably not meant; the command line prints it as one sentence."""


class MissingPackageError(LfssaoError, ImportError):
    """A package that this operation needs is not installed; the message names it and the operation."""


def no_such(kind: str, name: object, choices: Iterable[str]) -> InputError:
    """That there is no thing of a name: one sentence with the nearest name there is and all the others."""
    known = list(choices)
    near = difflib.get_close_matches(str(name), known, 1, 0.5)
    hint = f"the nearest is '{near[0]}' of" if near else "choose one of"
    return InputError(f"there is no {kind} '{name!s:.40}': {hint} {', '.join(known)}")


def check_choice(kind: str, name: object, choices: Collection[str]) -> None:
    """Refuse a name that is not among the choices (``no_such``)."""
    if name not in choices:
        raise no_such(kind, name, choices)


def check_type(argument: str, value: object, kind: type) -> None:
    """Refuse a value of another class, as where arguments are in the wrong order."""
    if not isinstance(value, kind):
        raise InputError(f"{argument} is of type {type(value).__name__}, expected a {kind.__name__}")


@contextmanager
def errors_of(place: str) -> Iterator[None]:
    """Put a place, such as an option or a file, before the message of an InputError that the block raises."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
