"""Estimators of one's own: a Python file that is run, and tried on a few texels, its mistakes told by their lines."""

import hashlib
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from lfssao.ao.bent import bent_normals
from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.look_ups import with_cleared
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, register
from lfssao.ao.formulas import Folded, Seen, Summed, words_of
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError, LfssaoError
from lfssao.files.whole import read_text
from lfssao.optics.camera import Camera

_WORDS = frozenset(name for protocol in (Seen, Summed, Folded) for name in vars(protocol))
_NOT_COMPILED = "it cannot be compiled: a formula takes numbers, and words of `lfssao.core.numbers`"
# Sentences of numba about a line that it cannot compile, and their meaning.
_REASONS = (
    (r"Unknown attribute '(\w+)' of type", "nothing here has '{}': `lfssao.ao.formulas.Seen` lists the words of views"),
    (r"(?:name|global name) '(\w+)' is not defined", "'{}' is not defined"),
    (r"Untyped global name '(\w+)'", "'{}' is no formula: see `lfssao.core.numbers`"),
)


def read_estimator(path: str | Path) -> Estimator:
    """Run a Python file, and return the first estimator of its ``ENTRIES``, which is known by its name from then on.

    Parameters
    ----------
    path : str or Path
        A file as ``lfssao estimators --template`` writes one. It is run with all rights of the caller.

    Returns
    -------
    Estimator
        With ``text``, the SHA-256 of the file. ``lfssao.estimate`` takes it, or its name, as do settings.

    Raises
    ------
    InputError
        With the file and the line, if the file cannot be read or run, has no ``ENTRIES``, takes the name of an
        estimator of this package, or its formulas lack a part or cannot be compiled.

    Examples
    --------
    >>> from importlib.resources import files
    >>> lfssao.read_estimator(files("lfssao.ao.estimators.templates") / "sum.py").name
    'mine'
    """
    path, text = Path(path), read_text(Path(path))
    digest = hashlib.sha256(text.encode()).hexdigest()
    module = ModuleType(f"own_estimator_{digest[:16]}")
    sys.modules[module.__name__] = module  # dataclasses look their module up
    with mistakes_in(path):
        exec(compile(text, str(path), "exec"), module.__dict__)
    entries: Any = module.__dict__.get("ENTRIES")
    if not isinstance(entries, tuple) or not entries or not isinstance(entries[0], Estimator):
        raise InputError(f"{path}: it has no ENTRIES, a tuple with an Estimator, as of 'lfssao estimators --template'")
    made: Estimator = replace(entries[0], text=digest)
    if made.name in ESTIMATORS and not ESTIMATORS[made.name].text:
        raise InputError(f"{path}: an estimator of lfssao has the name '{made.name}', take another one")
    made = _checked(path, made)
    register(made)
    return made


def _checked(path: Path, estimator: Estimator) -> Estimator:
    """An estimator, after an estimate of a few texels; InputError if formulas lack a part, or do not compile."""
    buffers = few_texels()
    if estimator.formulas is not None:
        with mistakes_in(path):
            samples = estimator.default_samples()
            numbers = estimator.formulas(buffers, 1.0, *samples, estimator.options())
        protocol: Any = Folded if hasattr(numbers, "steps") else Summed
        for name in [*protocol.__annotations__, *(word for word in vars(protocol) if not word.startswith("_"))]:
            if not hasattr(numbers, name):
                raise InputError(f"{path}: class {type(numbers).__name__} has no '{name}', which formulas need")
        for field in _WORDS.intersection(numbers._fields):
            taken = f"class {type(numbers).__name__} has a field '{field}', which is a word of formulas"
            raise InputError(f"{path}: {taken}: take another name")
        estimator = replace(estimator, vectors="noise" in words_of(numbers))
    with mistakes_in(path):
        estimate(estimator, buffers, 1.0)
        if estimator.bent:
            bent_normals(estimator, buffers, 1.0)
    return estimator


def few_texels() -> Buffers:
    """Return the textures of a camera that sees a wall in front of another one, 6 x 4 texels."""
    view = Camera.looking_at(np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])).view(6, 4)
    nothing = np.full((4, 6), np.inf, np.float32)
    far, near = (
        with_cleared(Buffers(view, nothing, np.full((4, 6, 3), np.inf, np.float32)), z)
        for z in (float(view.lens[4] + part * (view.lens[5] - view.lens[4])) for part in (0.6, 0.5))
    )
    left = np.arange(6) < 3
    depth, positions = np.where(left, near.depth, far.depth), np.where(left[:, None], near.positions, far.positions)
    return Buffers(view, depth, positions, np.broadcast_to(-view.world_from_cast[:, 2], (4, 6, 3)).astype(np.float32))


@contextmanager
def mistakes_in(path: Path) -> Iterator[None]:
    """Make any exception in the block an InputError with the file's line that is behind it."""
    try:
        yield
    except LfssaoError as error:
        raise InputError(f"{path}: {error}") from None
    except SyntaxError as error:
        raise InputError(f"{path}, line {error.lineno}: {error.msg}") from None
    except Exception as error:
        frames = [each for each in traceback.extract_tb(error.__traceback__) if each.filename == str(path)]
        if frames:
            said = f"{type(error).__name__}: {' '.join(str(error).split()):.160}"
            raise InputError(f"{path}, line {frames[-1].lineno}: {said}") from None
        lines = re.findall(rf'File "[^"]*{re.escape(path.name)}", line (\d+)', str(error))  # of numba
        reasons = (words.format(*found.groups()) for text, words in _REASONS if (found := re.search(text, str(error))))
        raise InputError(f"{path}{f', line {lines[0]}' if lines else ''}: {next(reasons, _NOT_COMPILED)}") from None
