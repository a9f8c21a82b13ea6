"""Errors that lfssao raises on purpose, each one sentence."""

import difflib
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from types import UnionType


class LfssaoError(Exception):
    """Base of every error that lfssao raises on purpose; the command line prints it as one sentence.

    >>> issubclass(lfssao.InputError, lfssao.LfssaoError)
    True
    """


class InputError(LfssaoError, ValueError):
    """Something that was handed in is wrong; the message names the file, option or argument and the reason.

    >>> lfssao.blur(np.zeros((2, 2), np.float32), sigma=-1.0)
    Traceback (most recent call last):
        ...
    lfssao.errors.InputError: blur is -1.0, it must be a sigma between 0 and 1024 texels
    """


class InputWarning(UserWarning):
    """Something that was handed in is allowed and is probably not meant; the command line prints it as one sentence.

    >>> issubclass(lfssao.InputWarning, UserWarning)
    True
    """


class MissingPackageError(LfssaoError, ImportError):
    """A package that this operation needs is not installed; the message names it and the operation.

    >>> issubclass(lfssao.MissingPackageError, ImportError)
    True
    """


def shown(value: object) -> str:
    """A value as Python writes it, in one line of at most 60 letters."""
    return f"{' '.join(repr(value).split()):.60}"


def nearest(name: object, choices: Iterable[str]) -> str | None:
    """The choice that is most like a name, at most a few letters off; None if none is."""
    alike = {each.lower().replace("_", "-"): each for each in choices}
    near = difflib.get_close_matches(str(name).lower().replace("_", "-"), alike, 1, 0.7)
    return alike[near[0]] if near else None


def meant(name: object, choices: Iterable[str]) -> str:
    """The question whether the choice that is most like a name was meant; empty if none is like it."""
    near = nearest(name, choices)
    return "" if near is None else f" (did you mean '{near}'?)"


def no_such(kind: str, name: object, choices: Iterable[str]) -> InputError:
    """That there is no thing of a name: one sentence with the name that may have been meant, and all there are."""
    known = list(choices)
    return InputError(f"there is no {kind} '{name!s:.40}'{meant(name, known)}: choose one of {', '.join(known)}")


def check_choice(kind: str, name: object, choices: Collection[str]) -> None:
    """Refuse a name that is not among the choices (``no_such``)."""
    if not isinstance(name, str) or name not in choices:
        raise no_such(kind, name, choices)


def check_type(argument: str, value: object, kind: type | UnionType) -> None:
    """Refuse a value of another class, as where arguments are in the wrong order."""
    if not isinstance(value, kind):
        kinds: tuple[type, ...] = kind.__args__ if isinstance(kind, UnionType) else (kind,)
        names = [each.__name__ for each in kinds]
        raise InputError(f"{argument} is of type {type(value).__name__}, expected a {' or '.join(names)}")


@contextmanager
def errors_of(place: str) -> Iterator[None]:
    """Put a place, such as an option or a file, before the message of an InputError that the block raises."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
