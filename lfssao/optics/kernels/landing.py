"""Where many world points land in one texture."""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import world_to_image


@kernel
def land(projection, points, image):
    """Image coordinates of (n, 3) world points into image (n, 3), same dtype; NaN outside the mapping's domain."""
    for k in range(points.shape[0]):
        u, v, z, valid = world_to_image(projection, points[k, 0], points[k, 1], points[k, 2])
        image[k, 0] = u if valid else np.nan
        image[k, 1] = v if valid else np.nan
        image[k, 2] = z if valid else np.nan
