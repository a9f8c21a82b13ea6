"""Sample sets on the square, the sphere, the ball and the disk: functions of (n, seed), with equal bits everywhere.

The names below are imported when they are first used: a render with LF's samples loads nothing else.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lfssao.samples.registry import METHODS, find_method, make_samples, sample_set, square_points
    from lfssao.samples.repulsion import repulsion_table
    from lfssao.samples.rotation import DECORRELATIONS, texel_angles
    from lfssao.samples.sets import SampleSet
    from lfssao.samples.spiral import best_turns, spiral_discrepancy

_HOME = {
    "rotation": ("DECORRELATIONS", "texel_angles"),
    "registry": ("METHODS", "find_method", "make_samples", "sample_set", "square_points"),
    "repulsion": ("repulsion_table",),
    "sets": ("SampleSet",),
    "spiral": ("best_turns", "spiral_discrepancy"),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "DECORRELATIONS",
    "METHODS",
    "SampleSet",
    "best_turns",
    "find_method",
    "make_samples",
    "repulsion_table",
    "sample_set",
    "spiral_discrepancy",
    "square_points",
    "texel_angles",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'lfssao.samples' has no attribute '{name}'")
    return getattr(import_module(f"lfssao.samples.{_MODULE_OF[name]}"), name)
