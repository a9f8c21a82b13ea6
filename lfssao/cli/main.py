"""The command line: reads options, calls the library, and says in one sentence what was wrong."""

import argparse
import gc
import os
import re
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.resources import files
from types import FrameType
from typing import Any, NoReturn

from lfssao import __version__
from lfssao.cli.terminal import BAD_INPUT, INTERRUPTED, NOT_COMPARED, compiling_shown, say
from lfssao.errors import InputError, InputWarning, LfssaoError, nearest, no_such

SHELLS = ("bash", "zsh", "tcsh", "fish")  # that shtab writes scripts for
# A command is a file of this folder.
COMMANDS = {
    "render": "textures of every module of a display, or of a camera",
    "plan": "what a render leaves out because its scene does not need it, why, and what that saves",
    "ao": "ambient occlusion of your own renderer's depth and positions",
    "display": "print a display as a TOML file, or draw it from above",
    "estimators": "list the estimators of occlusion and their parameters",
    "view": "what an eye on the observer line sees of a rendered display",
    "kit": "write reference cases for a renderer in another language",
    "compare": "another renderer's textures against a reference",
    "agree": "how far views differ in the occlusion of the surface that they share",
    "check": "whether this machine makes the bits that lfssao makes elsewhere",
    "samples": "make, check and draw sample sets",
    "bench": "measure errors, stability and time",
}

# Names of options in other programs.
SYNONYMS = {
    "tolerance": "--fail", "threshold": "--fail", "atol": "--fail", "epsilon": "--fail", "out": "--output",
    "outdir": "--output", "output-dir": "--output", "folder": "--output", "size": "--resolution",
    "width": "--resolution", "height": "--resolution", "spp": "--samples", "sampler": "--sampling",
    "method": "--sampling", "radius": "--radii", "sigma": "--blur", "noise": "--rotate", "rotation": "--rotate",
    "jobs": "--threads", "workers": "--threads", "continue": "--resume", "report": "--html", "xml": "--junit",
    "channels": "--layers", "preset": "--display", "shader": "--like", "plot": "--picture",
}  # fmt: skip


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one sentence, without the usage lines.

    ``file`` is the file of this folder whose ``add_to`` adds the options. It is imported when the command is chosen, so
    that the help of all commands imports none. The file ``text`` of ``help/``, by default that of the same name, ends
    its help.
    """

    def __init__(self, file: str = "", text: str = "", **more: Any) -> None:
        super().__init__(allow_abbrev=False, **more)
        self._file = file
        self._text = files("lfssao.cli") / "help" / f"{text or file or 'none'}.txt"
        self._commands: Any = None

    def add_subparsers(self, **more: Any) -> Any:
        """As of ``argparse.ArgumentParser``; without a command the help is printed, and the exit code is 2."""
        self.set_defaults(run=self._without_command)
        self._commands = super().add_subparsers(**more)
        return self._commands

    def _without_command(self, _: argparse.Namespace) -> int:
        self.print_help(sys.stderr)
        return BAD_INPUT

    def load(self) -> None:
        """Add the command's options, once."""
        if self._file:
            import_module(f"lfssao.cli.{self._file}").add_to(self)
            self._file = ""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As of ``argparse.ArgumentParser``, the command's options added before; what is unknown is refused."""
        self.load()
        self._check_names(list(args))
        options, rest = super().parse_known_args(args, namespace)
        if rest:  # refused here, where the command is known
            self.error(f"unrecognized arguments: {' '.join(rest)}: nothing is left that takes them")
        return options, rest

    def _check_names(self, words: list[str]) -> None:
        """Refuse an unknown command or option, before argparse complains that others are missing."""
        if self._commands is not None:
            options = "-h", "--help", "--version", "--print-completion"
            if words and words[0].partition("=")[0] not in (*options, *self._commands.choices):
                self._refuse_command(words[0])
            return
        lines = re.findall(r"^  (-.*?)(?:  |$)", super().format_help(), re.MULTILINE)
        known = {option for line in lines for option in re.findall(r"--[a-z-]+", line)}
        option_of = {option.removeprefix("--"): option for option in known}
        option_of |= {name: option for name, option in SYNONYMS.items() if option in known and name not in option_of}
        for word in words[: words.index("--")] if "--" in words else words:
            option = word.partition("=")[0]
            name = option.lstrip("-")
            short = re.fullmatch("-[a-z-]{2,}", option) and not option.startswith("--")  # -output is no -o utput
            if (option.startswith("--") and option not in known) or (short and name in option_of):
                near = nearest(name, option_of)
                hint = "" if near is None else f" (did you mean '{option_of[near]}'?)"
                self.error(f"unrecognized arguments: {option}{hint}")

    def _refuse_command(self, word: str) -> NoReturn:
        kind = self._commands.metavar.lower()
        if word.startswith("-"):
            self.error(f"{word}: a {kind} comes first")
        from lfssao.scene.builtin import BUILTIN  # late: the help of all commands imports no NumPy

        if kind == "command" and (word in BUILTIN or os.path.exists(word)):
            self.error(f"there is no command '{word}' (did you mean 'render {word}'?)")
        self.error(str(no_such(kind, word, self._commands.choices)))

    def format_help(self) -> str:
        """As of ``argparse.ArgumentParser``, and the text."""
        return super().format_help() + (self._text.read_text(encoding="utf-8") if self._text.is_file() else "")

    def error(self, message: str) -> NoReturn:
        """Refuse the command line."""
        sentence = message.removeprefix("argument ").replace("ignored explicit argument", "it takes no value, and not")
        raise InputError(f"{sentence} (see {self.prog} --help)")


class _PrintCompletion(argparse.Action):
    """The option that prints the script of a shell and ends the program."""

    def __call__(self, parser: argparse.ArgumentParser, _options: Any, shell: Any, _option: str | None = None) -> None:
        """As for ``argparse.Action``."""
        from lfssao.cli.completion import completion_script  # late: no other command needs it

        print(completion_script(parser, shell))
        parser.exit()


def command_line() -> Parser:
    """Return the parser of all commands."""
    parser = Parser(prog="lfssao", text="all", description="Screen-space ambient occlusion for light field displays.")
    parser.add_argument("--version", action="version", version=f"lfssao {__version__}")
    parser.add_argument(
        "--print-completion",
        action=_PrintCompletion,
        choices=SHELLS,
        help="print a script by which a shell completes commands and options (needs shtab)",
    )
    commands = parser.add_subparsers(metavar="COMMAND")
    for name, line in COMMANDS.items():
        commands.add_parser(name, help=line, file=name)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, given by what follows ``lfssao`` on the command line (``sys.argv`` by default).

    Return 0; 1 where ``samples check`` or a bench finds something broken; 2 for wrong input; 130 for an interrupt; the
    codes of ``compare`` are its own.
    """
    gc.set_threshold(100_000, 50, 50)  # a first run compiles; collecting garbage less often saves a tenth of it
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["help"]:
        words = [*words[1:], "--help"]
    bad_input = NOT_COMPARED if words[:1] == ["compare"] else BAD_INPUT
    try:
        options = command_line().parse_args(_with_negative_values(words))
        options.command = ["lfssao", *words]
        with _interruptible(), _printing_once(), compiling_shown():
            code: int | None = options.run(options)
    except LfssaoError as error:
        say(str(error))
        return bad_input
    except MemoryError:
        say("there is not enough memory")
        return bad_input
    except KeyboardInterrupt:
        more = "; the same command with --resume goes on" if words[:1] == ["render"] else ""
        say(f"interrupted; every file that was written is whole{more}")
        return INTERRUPTED
    except BrokenPipeError:  # the reader of the output has gone; Python would complain once more when it exits
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:  # too long a name, or a folder that is closed
            say(f"{os.fsdecode(error.filename)}: {error.strerror}")
        elif bad_input != NOT_COMPARED:
            raise
        else:  # a fault of this program must not end with 1, by which compare says that textures are right
            traceback.print_exc()
        return bad_input
    return code or 0


@contextmanager
def _printing_once() -> Iterator[None]:
    """In the block, print each InputWarning as one sentence, and no sentence twice."""
    printed: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *more: Any, **rest: Any) -> None:
        if not issubclass(category, InputWarning):
            others(message, category, *more, **rest)
        elif str(message) not in printed:
            printed.add(str(message))
            say(str(message))

    with warnings.catch_warnings():
        warnings.simplefilter("always", InputWarning)
        others = warnings.showwarning
        warnings.showwarning = show
        yield


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C and SIGTERM as KeyboardInterrupt, but never inside llvmlite, whose callbacks from C would lose it.

    Lost there, a render would go on to its end, or numba would stumble over code that it believes compiled.
    """
    here = threading.current_thread() is threading.main_thread()
    defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    ours = {number: default for number, default in defaults.items() if here and signal.getsignal(number) == default}
    for number in ours:
        signal.signal(number, _on_interrupt)
    try:
        yield
    finally:
        for number, default in ours.items():
            signal.signal(number, default)


def _on_interrupt(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            thread = threading.get_ident()  # the main one: the signal, sent once more, also ends what it waits for
            again = threading.Timer(0.02, signal.pthread_kill, (thread, number))
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _with_negative_values(words: list[str]) -> list[str]:
    """``--radii -1,2`` as ``--radii=-1,2``: argparse would take the value for an option and say that it is missing."""
    out: list[str] = []
    for word in words:
        if out and re.fullmatch(r"--[a-z-]+", out[-1]) and re.match(r"-([0-9.]|inf|nan)", word):
            out[-1] += f"={word}"
        else:
            out.append(word)
    return out
