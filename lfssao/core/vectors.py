"""Right-angled axes around a direction."""

from lfssao.core.jit import kernel


@kernel(inline=True)
def disk_axes(x, y, z):
    """Two unit vectors at right angles to the unit vector (x, y, z) and to each other (Duff et al. 2017)."""
    one = type(x)(1)
    sign = one if z >= 0 else -one
    a = -one / (sign + z)
    b = x * y * a
    return one + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y
