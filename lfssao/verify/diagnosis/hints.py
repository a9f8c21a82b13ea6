"""Options of the command line that a diagnosis advises: with them the reference is rendered as the renderer does."""

import numpy as np

from lfssao.ao.estimators.estimator import Value
from lfssao.samples import ROTATIONS
from lfssao.verify.diagnosis.sampling import TURNED


def parameter_option(name: str, value: Value) -> str:
    """Return the option that gives a parameter of the estimator a value; a float has four digits."""
    text = str(value).lower() if isinstance(value, bool) else f"{value:.4g}" if isinstance(value, float) else value
    return f"--parameter {name}={text}"


def scaled_parameter_option(name: str, value: float, limits: tuple[float, float], factor: float) -> str:
    """Return the option that gives a parameter its value times a factor, within its limits."""
    return parameter_option(name, float(np.clip(value * factor, *limits)))


def rotation_option(words: str) -> str:
    """Return the option of the rotation that the words of a change name; '' if they name none."""
    return next((f"--rotate {name}" for name in ROTATIONS if words == TURNED.format(name)), "")
