"""What the program refuses, and how it says so."""


class LfssaoError(Exception):
    """Base of every error that lfssao raises on purpose; the command line prints it as one sentence."""


class InputError(LfssaoError, ValueError):
    """Something that was handed in is wrong; the message names the file, option or argument and the reason."""


class MissingPackageError(LfssaoError, ImportError):
    """A package that this operation needs is not installed; the message names it and the operation."""
