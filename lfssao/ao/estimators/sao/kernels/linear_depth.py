"""Depth buffer to distance along the viewing axis (SAO section 2.2, equation 2)."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel(parallel=True)
def linear_depth(depth, perspective, c_0, c_1, c_2, z):
    """Distances of all texels from the eye's plane.

    SAO's z is negative, ours grows away from the viewer: z = -z_SAO, with near and far plane at n and f. Equation 2
    with c = (n, -1, 1) for f = infinity and (n f, n - f, f) otherwise gives it as printed. An orthographic camera's
    depth is linear already, c_0 + d c_1 with c = (n, f - n); the paper has none.
    depth, (H, W): 0 at the near plane and 1 at the far plane, +infinity where there is no surface. z, (H, W): out,
    +infinity there and where equation 2 puts the point at infinity or behind the eye.
    """
    height, width = depth.shape
    nothing = depth.dtype.type(np.inf)
    for j in prange(height):
        for i in range(width):
            d = depth[j, i]
            below = d * c_1 + c_2
            seen = (c_0 / below if below > 0 else nothing) if perspective else c_0 + d * c_1
            z[j, i] = seen if d < np.inf else nothing
