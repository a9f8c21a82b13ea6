"""Where a depth texture sees a surface."""

import numpy as np

from lfssao.kernels.jit import kernel


@kernel
def seen_window(depth):
    """Window and number of the texels that see a surface, all int64: left, top, right, bottom, texels; 0 for none.

    depth: (H, W), +infinity where there is no surface. One pass without branches for each row, of which all three
    numbers come as vectors: to look through the columns from both ends would be as many comparisons one by one.
    """
    height, width = depth.shape
    left, top, right, bottom, texels = width, height, 0, 0, 0
    for j in range(height):
        row, first, end, count = depth[j], np.int32(width), np.int32(0), np.int32(0)
        for i in range(width):
            place = np.int32(i)
            here, behind, one = np.int32(width), np.int32(0), np.int32(0)
            if row[i] < np.inf:
                here, behind, one = place, np.int32(place + np.int32(1)), np.int32(1)
            first = here if here < first else first
            end = behind if behind > end else end
            count = np.int32(count + one)
        if count > 0:
            left, right = min(left, first), max(right, end)
            top, bottom, texels = min(top, j), j + 1, texels + count
    if texels == 0:
        return 0, 0, 0, 0, 0
    return left, top, right, bottom, texels
