"""Sample sets on the square, the sphere, the ball and the disk: functions of (n, seed), with equal bits everywhere.

The names below are imported when they are first used: a render with LF's samples loads nothing else.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lfssao.samples.cylinder import make_samples, square_points
    from lfssao.samples.spiral import best_turns

_MODULE_OF = {
    "best_turns": "spiral",
    "make_samples": "cylinder",
    "square_points": "cylinder",
}

__all__ = ["best_turns", "make_samples", "square_points"]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'lfssao.samples' has no attribute '{name}'")
    return getattr(import_module(f"lfssao.samples.{_MODULE_OF[name]}"), name)
