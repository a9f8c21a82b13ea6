"""Right-angled axes around a direction, and directions of length 1."""

from math import sqrt

from lfssao.core.jit import kernel


@kernel(inline=True)
def disk_axes(x, y, z):
    """Two unit vectors at right angles to the unit vector (x, y, z) and to each other (Duff et al. 2017)."""
    one = type(x)(1)
    sign = one if z >= 0 else -one
    a = -one / (sign + z)
    b = x * y * a
    return one + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


@kernel(inline=True)
def unit(x, y, z):
    """A vector over its length, after a division by its largest component; (0, 0, 0) stays."""
    zero = type(x)(0)
    size = max(abs(x), abs(y), abs(z))
    there = size > zero
    x, y, z = x / size, y / size, z / size
    length = type(x)(sqrt((x * x + y * y) + z * z))
    return x / length if there else zero, y / length if there else zero, z / length if there else zero
