from .engine import Sampler
from .methods import METHODS
from .registry import find_method, make_samples, sample_set, square_points
from .repulsion import repulsion_table
from .rotation import ROTATIONS, angle_turns, noise_turns, texel_angles, texel_turns
from .sets import SampleSet
from .spiral import best_turns, spiral_discrepancy

__all__ = [
    "METHODS", "ROTATIONS", "SampleSet", "Sampler", "angle_turns", "best_turns", "find_method", "make_samples",
    "noise_turns", "repulsion_table", "sample_set", "spiral_discrepancy", "square_points", "texel_angles",
    "texel_turns",
]  # fmt: skip
