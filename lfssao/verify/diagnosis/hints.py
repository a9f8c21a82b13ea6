"""Options of the command line that a diagnosis advises: with them the reference is rendered as the renderer does."""

from math import floor, log, log10

import numpy as np

from lfssao.ao.estimators.estimator import Value
from lfssao.samples import ROTATIONS
from lfssao.verify.diagnosis.sampling import TURNED


def scaled_text(value: float, factor: float, limits: tuple[float, float] = (-np.inf, np.inf)) -> str:
    """Return a value times a factor, within limits, with at least three digits of its difference from the value."""
    change = abs(log(factor))
    digits = max(4, 3 - floor(log10(change))) if change else 4
    return f"{float(np.clip(value * factor, *limits)):.{digits}g}"


def parameter_option(name: str, value: Value) -> str:
    """Return the option that gives a parameter of the estimator a value; a float has four digits."""
    text = str(value).lower() if isinstance(value, bool) else f"{value:.4g}" if isinstance(value, float) else value
    return f"--parameter {name}={text}"


def scaled_parameter_option(name: str, value: float, limits: tuple[float, float], factor: float) -> str:
    """Return the option that gives a parameter its value times a factor, within its limits."""
    return f"--parameter {name}={scaled_text(value, factor, limits)}"


def background_text(value: float) -> str:
    """Return the shortest text that float32 reads as a value of float32."""
    texts = (f"{value:.{digits}g}" for digits in (6, 7, 8, 9))
    return next((text for text in texts if np.float32(text) == np.float32(value)), f"{value:g}")


def rotation_option(words: str) -> str:
    """Return the option of the rotation that the words of a change name; '' if they name none."""
    return next((f"--rotate {name}" for name in ROTATIONS if words == TURNED.format(name)), "")
