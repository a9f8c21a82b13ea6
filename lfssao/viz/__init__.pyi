from .agreement import draw_disagreement, over_modules, spread, surface_points
from .display import draw_display
from .interactive import explore, sliders
from .mapping import draw_matrix_fits, matrix_fits
from .radii import deciding_radius, draw_radii
from .samplers import draw_sampler_gallery, draw_sampling_error, sampling_error
from .samples import draw_samples
from .texel import draw_texel, occluded_fraction, trace_texel
from .truth import deviation, draw_against_truth, half_space
from .verdict import draw_inside

__all__ = [
    "deciding_radius", "deviation", "draw_against_truth", "draw_disagreement", "draw_display", "draw_inside",
    "draw_matrix_fits", "draw_radii", "draw_sampler_gallery", "draw_samples", "draw_sampling_error", "draw_texel",
    "explore", "half_space", "matrix_fits", "occluded_fraction", "over_modules", "sampling_error", "sliders", "spread",
    "surface_points", "trace_texel",
]  # fmt: skip
