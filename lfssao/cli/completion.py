"""``lfssao --print-completion``: a script by which a shell completes commands, options and names of files."""

import argparse
from typing import Any

from lfssao.errors import MissingPackageError

# Names of values that are files or folders, and the name by which shtab completes each.
_KINDS = {"FILE": "FILE", "IMAGE": "FILE", "DIR": "DIRECTORY", "MINE": "FILE", "REFERENCE": "FILE"}


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script of a shell; MissingPackageError without shtab."""
    try:
        import shtab  # late: no other command needs it
    except ImportError as error:
        raise MissingPackageError("--print-completion needs shtab: pip install 'lfssao[completion]'") from error
    _add_commands(parser, {name: getattr(shtab, kind) for name, kind in _KINDS.items()})
    return str(shtab.complete(parser, shell=shell))


def _add_commands(parser: Any, kinds: dict[str, Any]) -> None:
    """Add the options of all commands, which are else added when a command is chosen, and say which are of files."""
    parser.load()
    for action in parser._actions:  # argparse has no other list of them; shtab reads the same
        words = {action.metavar} if isinstance(action.metavar, str) else set(action.metavar or ())
        for word in {part for each in words for part in each.split("|")} & kinds.keys():
            action.complete = kinds[word]
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _add_commands(command, kinds)
