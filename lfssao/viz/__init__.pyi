from .agreement import draw_disagreement, over_modules, spread, surface_points
from .blurring import blur_error, draw_blur_error
from .display import draw_display
from .geometry import draw_geometry, geometry_of, with_geometry
from .interactive import explore, sliders
from .mapping import draw_matrix_fits, matrix_fits
from .radii import deciding_radius, draw_radii
from .samplers import draw_sampler_gallery, draw_sampling_error, sampling_error
from .samples import draw_samples
from .texel import draw_texel, occluded_fraction, trace_texel
from .timing import draw_error_by_time, error_by_time
from .truth import deviation, draw_against_truth, half_space
from .verdict import draw_inside

__all__ = [
    "blur_error", "deciding_radius", "deviation", "draw_against_truth", "draw_blur_error", "draw_disagreement",
    "draw_display", "draw_error_by_time", "draw_geometry", "draw_inside", "draw_matrix_fits", "draw_radii",
    "draw_sampler_gallery", "draw_samples", "draw_sampling_error", "draw_texel", "error_by_time", "explore",
    "geometry_of", "half_space", "matrix_fits", "occluded_fraction", "over_modules", "sampling_error", "sliders",
    "spread", "surface_points", "trace_texel", "with_geometry",
]  # fmt: skip
