"""The command line: reads options, calls the library, and says in one sentence what was wrong."""

import _thread
import argparse
import gc
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from lfssao import __version__
from lfssao.cli import bench, compare, display, estimators, kit, plan, render, samples, view
from lfssao.cli.terminal import say
from lfssao.errors import InputError, LfssaoError

BAD_INPUT = 2
INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence, without the usage lines."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message.removeprefix('argument ')} (see {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows ``lfssao`` on the command line; ``sys.argv`` by default.

    Returns
    -------
    int
        0; 2 where the input was wrong; 130 where the user interrupted; of ``compare`` its own codes; 1 of
        ``samples check`` where a promise is broken, of ``bench stability`` where a bound is.
    """
    gc.set_threshold(100_000, 50, 50)  # the compiler makes millions of objects: to look through them less saves a tenth
    words = list(sys.argv[1:] if arguments is None else arguments)
    bad_input = compare.NOT_COMPARED if words[:1] == ["compare"] else BAD_INPUT
    try:
        options = _parser().parse_args(_with_negative_values(words))
        options.command = ["lfssao", *words]
        with _interruptible():
            code: int | None = options.run(options)
    except LfssaoError as error:
        say(str(error))
        return bad_input
    except MemoryError:
        say("there is not enough memory")
        return bad_input
    except KeyboardInterrupt:
        say("interrupted; every file that was written is whole")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the output has gone; Python would complain once more when it exits
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code or 0


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C as KeyboardInterrupt, but never inside llvmlite, whose callbacks from C would lose it.

    Lost there, a render would go on to its end, or numba would stumble over code that it believes compiled.
    """
    ours = (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if ours:
        signal.signal(signal.SIGINT, _on_interrupt)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _on_interrupt(_signal: int, frame: FrameType | None) -> None:
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            again = threading.Timer(0.02, _interrupt_again)
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _interrupt_again() -> None:
    """Send the main thread the signal once more; a true one, where there are such, also ends what it waits for."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        _thread.interrupt_main()


def _with_negative_values(words: list[str]) -> list[str]:
    """``--radii -1,2`` as ``--radii=-1,2``: argparse would take the value for an option and say that it is missing."""
    out: list[str] = []
    for word in words:
        if out and re.fullmatch(r"--[a-z-]+", out[-1]) and re.match(r"-([0-9.]|inf|nan)", word):
            out[-1] += f"={word}"
        else:
            out.append(word)
    return out


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="lfssao", description="Screen-space ambient occlusion for light field displays.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"lfssao {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in (render, plan, display, estimators, view, kit, compare, samples, bench):
        command.add_to(commands)
    return parser
