"""Sample sets on the square, the sphere, the ball and the disk: functions of (n, seed), with equal bits everywhere.

The names below are imported when they are first used: a render with LF's samples loads nothing else.
"""

from typing import TYPE_CHECKING

from lfssao.core.late_names import late_names

if TYPE_CHECKING:
    from lfssao.samples.engine import Sampler
    from lfssao.samples.registry import METHODS, find_method, make_samples, sample_set, square_points
    from lfssao.samples.repulsion import repulsion_table
    from lfssao.samples.rotation import ROTATIONS, angle_turns, texel_angles, texel_turns
    from lfssao.samples.sets import SampleSet
    from lfssao.samples.spiral import best_turns, spiral_discrepancy

__getattr__, __dir__ = late_names(
    __name__,
    {
        "samples.engine": ("Sampler",),
        "samples.rotation": ("ROTATIONS", "angle_turns", "texel_angles", "texel_turns"),
        "samples.registry": ("METHODS", "find_method", "make_samples", "sample_set", "square_points"),
        "samples.repulsion": ("repulsion_table",),
        "samples.sets": ("SampleSet",),
        "samples.spiral": ("best_turns", "spiral_discrepancy"),
    },
)

__all__ = [
    "METHODS", "ROTATIONS", "SampleSet", "Sampler", "angle_turns", "best_turns", "find_method", "make_samples",
    "repulsion_table", "sample_set", "spiral_discrepancy", "square_points", "texel_angles", "texel_turns",
]  # fmt: skip
