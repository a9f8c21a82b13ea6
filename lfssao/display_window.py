"""Which texels can see a box, of modules of any display: curved screens, conical diffusers, turned, distorted optics.

The steps of ``lfssao.kernels.display`` on ranges of numbers: each operation gives a range that holds its result for any
numbers of its operands' ranges. The box is cut into parts, as a range forgets what numbers have in common. With
sigma = (x - m_x) / (m_z - z), the direction from the lens seen from above, steps that cancel are left out:

    screen and observers lie tau(sigma) and V(sigma) before the lens in z  (circle_crossing along (sigma, -1))
    s_z = m_z - tau,  e_z = m_z - V,  s_y = y_o + (y - y_o) (s_z - e_z) / (z - e_z)
    projected onto the plane z = 0 from the lens:  m_x + m_z sigma  and  m_y + (s_y - m_y) m_z / tau

A ray's points land on its texel's centre but for rounding: that of the ray is added to the box, that of the image is
far below the texel that is added to the window.
"""

import numpy as np

from lfssao.ranges import Numbers, Range

# Parts of the box along x, y and z.
_PARTS = (8, 3, 8)

# Rounding of a ray in space, of the largest of its numbers; float64 has 2^-53.
_ROUNDING = 2.0**-38

# That of a sum of three products, of its terms' sizes.
_SUMS = 2.0**-50


def image_range(lens: Numbers, box: Numbers) -> tuple[float, float, float, float] | None:
    """Between which u, and which v, the points of a box appear; None where that is not known.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``).
    box : (2, 3) float64
        Lower and upper corner, physical space.

    Returns
    -------
    tuple of (float, float, float, float) or None
        Smallest and largest u, smallest and largest v.
    """
    if not _inverts(lens):
        return None
    size = float(max(np.abs(box).max(), np.abs(lens[:5]).max()))
    with np.errstate(all="ignore"):  # NaN is asked for in the end
        x, y, z = _parts(box + np.array([[-1.0], [1.0]]) * (_ROUNDING * size))
        u, v = distorted(lens, *projected(lens[8:17], *screen_points(lens, x, y, z)))
    ends = float(u.low.min()), float(u.high.max()), float(v.low.min()), float(v.high.max())
    return ends if np.isfinite(ends).all() else None


def _inverts(lens: Numbers) -> bool:
    """Whether the two homographies are inverses, to a sixteenth of a texel over a texture of thousands."""
    forth, back = lens[8:17].reshape(3, 3), lens[23:32].reshape(3, 3)
    product = (forth[:, :, None] * back[None]).sum(axis=1)
    texels = np.array([1e5, 1e5, 1.0])
    return bool((np.abs(product / product[2, 2] - np.eye(3)) * texels < [[0.05], [0.05], [1e-7]]).all())


def _parts(box: Numbers) -> tuple[Range, Range, Range]:
    """The parts of a box, x, y and z of each."""
    ends = [np.linspace(low, high, n + 1) for low, high, n in zip(*box, _PARTS, strict=True)]
    low = [n.ravel() for n in np.meshgrid(*(e[:-1] for e in ends), indexing="ij")]
    high = [n.ravel() for n in np.meshgrid(*(e[1:] for e in ends), indexing="ij")]
    x, y, z = (Range(a, b) for a, b in zip(low, high, strict=True))
    return x, y, z


def screen_points(lens: Numbers, x: Range, y: Range, z: Range) -> tuple[Range, Range]:
    """Where points appear on the plane z = 0, as seen from the lens.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``).
    x, y, z : Range
        Metres.
    """
    m_x, m_y, m_z, y_o, z_o, screen, observers, conical = lens[:8].tolist()
    far = Range(m_z - z.high, m_z - z.low)
    if conical:
        s_y = y.plus(-y_o).times(-z_o).over(z.plus(-z_o)).plus(y_o)
        h_m, h_e = (s_y.plus(-a).squared().plus(b * b).root() for a, b in ((m_y, m_z), (y_o, z_o)))
        room = z.times(1.0 / z_o).times(h_e.over(h_m)).plus(1.0)  # 1 + kappa
        return x.plus(-m_x).over(room).plus(m_x), s_y
    sigma = x.plus(-m_x).over(far)
    (tau, _), (before, _) = crossing(screen, m_x, m_z, sigma), crossing(observers, m_x, m_z - z_o, sigma)
    # s_z - e_z = V - tau, z - e_z = V - (m_z - z)
    share = before.minus(tau).over(before.minus(far))
    s_y = y.plus(-y_o).times(share).plus(y_o)
    return sigma.times(m_z).plus(m_x), s_y.plus(-m_y).times(m_z).over(tau).plus(m_y)


def crossing(curvature: float, x: float, z: float, sigma: Range) -> tuple[Range, Range]:
    """Where lines leave a circle, or a plane (``lfssao.kernels.display.circle_crossing``).

    Parameters
    ----------
    curvature : float
        The circle's, which has z = 0 at x = 0.
    x, z : float
        Where the lines begin.
    sigma : Range
        They go along (sigma, -1).

    Returns
    -------
    before, root : Range
        How far before their beginning, in z, they leave it, and the root of the discriminant.
    """
    if curvature == 0.0:
        return Range.constant(z, sigma), Range.constant(1.0, sigma)
    a = sigma.squared().plus(1.0).times(curvature)
    b = sigma.times(curvature * x).plus(1.0 - curvature * z)
    c = curvature * (x * x + z * z) - 2.0 * z
    root = b.squared().minus(a.times(c)).root()
    # b + root = -a c / (root - b), which forgets less where b is negative.
    divisor = b.plus(root).also(a.times(-c).over(root.minus(b)))
    if c > 0.0:  # the lens outside the circle, the divisor negative where there is a crossing
        return Range.constant(c, a).over(divisor.times(-1.0)), root
    return Range.constant(-c, a).over(divisor), root


def projected(matrix: Numbers, x: Range, y: Range) -> tuple[Range, Range]:
    """A homography's, (9,), image of rectangles: with a positive divisor it is largest and smallest in corners."""
    rows = matrix.reshape(3, 3).tolist()
    u, v, w = (np.stack([(g * p + h * q) + i for p in x for q in y]) for g, h, i in rows)
    w = np.where(w > 0.0, w, np.nan)
    terms = [(abs(g) * x.size + abs(h) * y.size) + abs(i) for g, h, i in rows]
    made = []
    for corners, size in ((u / w, terms[0]), (v / w, terms[1])):
        ends = Range(corners.min(axis=0), corners.max(axis=0))
        off = _SUMS * (size + ends.size * terms[2]) / w.min(axis=0)
        made.append(ends.plus(Range(-off, off)))
    return made[0], made[1]


def distorted(lens: Numbers, u: Range, v: Range) -> tuple[Range, Range]:
    """Radial distortion of texel coordinates."""
    c_u, c_v, f, k1, k2 = lens[17:22].tolist()
    if k1 == 0.0 and k2 == 0.0:
        return u, v
    a, b = u.plus(-c_u).times(1.0 / f), v.plus(-c_v).times(1.0 / f)
    r2 = a.squared().plus(b.squared())
    factor = r2.times(r2.times(k2).plus(k1)).plus(1.0)
    return a.times(factor).times(f).plus(c_u), b.times(factor).times(f).plus(c_v)
