"""How fast the image of a point moves as the point does, of any display: ranges of the mapping's derivatives.

Where a point appears is told by the point s = (s_x, s_y) of the plane z = 0 that its ray from the lens goes through,
which a homography takes to texels. Here ranges of s and of the depth z are given, as all that follows is written in
them with each number once or twice, so that ranges stay narrow. With far = m_z - z and sigma = (s_x - m_x) / m_z =
(x - m_x) / far, the direction of a ray from above,

    d sigma = (dx + sigma dz) / far

Screen and observers lie tau(sigma) and V(sigma) before the lens. The crossing t of a ray and a circle,
k (X^2 + Z^2) = 2 Z at X = m_x + sigma t, Z = m_z - t, has by differentiation of both sides dt / d sigma =
-k X t / root, root being that of the discriminant. The height on the screen, S = m_y + (s_y - m_y) tau / m_z, is that
of the line from y at z to y_o at the observers, S = y_o + (y - y_o) (V - tau) / (V - far), so that

    dS = (V - tau) / (V - far) dy - (S - y_o) / (V - far) dz
         + (S - y_o) ((V' - tau') / (V - tau) - V' / (V - far)) d sigma
    ds_x = m_z d sigma,   ds_y = m_z / tau dS - (s_y - m_y) tau' / tau d sigma

Of the conical diffuser s is the point of the screen, and with kappa = (z / z_o) (h_e / h_m)

    ds_y = (-z_o dy - (s_y - y_o) dz) / (z - z_o)
    dkappa = h_e / (h_m z_o) dz + kappa ((s_y - y_o) / h_e^2 - (s_y - m_y) / h_m^2) ds_y
    ds_x = (dx - (s_x - m_x) dkappa) / (1 + kappa)
"""

import numpy as np

from lfssao.display_window import crossing
from lfssao.ranges import Numbers, Range

# Of one image coordinate by x, y and z.
Slopes = tuple[Range, Range, Range]


def ray_points(lens: Numbers, s_x: Range, s_y: Range, z: Range) -> tuple[Range, Range]:
    """The x and y of the points at z that appear in places of the plane z = 0.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``).
    s_x, s_y, z : Range
        Where the points appear on the plane as seen from the lens, and their depth, metres.
    """
    m_x, m_y, m_z, y_o, z_o, screen, observers, conical = lens[:8].tolist()
    across, toward = s_x.plus(-m_x), z.times(-1.0 / z_o).plus(1.0)
    if conical:
        below, above = s_y.plus(-m_y), s_y.plus(-y_o)
        ratio = above.squared().plus(z_o * z_o).root().over(below.squared().plus(m_z * m_z).root())
        return across.times(z.times(1.0 / z_o).times(ratio).plus(1.0)).plus(m_x), above.times(toward).plus(y_o)
    far, sigma = z.times(-1.0).plus(m_z), across.times(1.0 / m_z)
    (tau, _), (before, _) = crossing(screen, m_x, m_z, sigma), crossing(observers, m_x, m_z - z_o, sigma)
    height = s_y.plus(-m_y).times(tau).times(1.0 / m_z).plus(m_y - y_o)
    return sigma.times(far).plus(m_x), height.times(before.minus(far).over(before.minus(tau))).plus(y_o)


def ray_ways(lens: Numbers, s_x: Range, s_y: Range) -> tuple[Numbers, Numbers]:
    """How far along x and y a ray goes per metre along z, of the rays through the middles of rectangles of z = 0."""
    m_x, m_y, m_z, y_o, z_o, screen, observers, conical = lens[:8].tolist()
    across, below = 0.5 * (s_x.low + s_x.high) - m_x, 0.5 * (s_y.low + s_y.high) - m_y
    if conical:
        above = below + (m_y - y_o)
        return across / z_o * np.sqrt((above**2 + z_o**2) / (below**2 + m_z**2)), above / -z_o
    sigma = across / m_z
    (tau, _), (before, _) = (
        crossing(curvature, m_x, z, Range(sigma, sigma)) for curvature, z in ((screen, m_z), (observers, m_z - z_o))
    )
    return -sigma, (below * tau.low / m_z + (m_y - y_o)) / (before.low - tau.low)


def screen_slopes(
    lens: Numbers, s_x: Range, s_y: Range, z: Range, way: tuple[Range, Range] | None = None
) -> tuple[Slopes, Slopes]:
    """Derivatives of s_x and of s_y by x, y and z, NaN where a point of the range may have no image.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``).
    s_x, s_y, z : Range
        Which points: where they appear on the plane z = 0 as seen from the lens, and their depth, metres.
    way : pair of Range, optional
        How far along x and y it goes with each metre along z, in place of straight on: along rays little changes.
    """
    way = way or (Range.constant(0.0, z), Range.constant(0.0, z))
    if lens[7]:
        return _conical(lens, s_x, s_y, z, way)
    m_x, m_y, m_z, y_o, z_o, screen, observers = lens[:7].tolist()
    far, sigma = z.times(-1.0).plus(m_z), s_x.plus(-m_x).times(1.0 / m_z)
    tau, tau_slope = _crossing(screen, m_x, m_z, sigma)
    before, before_slope = _crossing(observers, m_x, m_z - z_o, sigma)
    ahead, rest = before.minus(tau), before.minus(far)
    on_plane = s_y.plus(-m_y)
    height = on_plane.times(tau).times(1.0 / m_z).plus(m_y - y_o)
    by_sigma = height.times(before_slope.minus(tau_slope).over(ahead).minus(before_slope.over(rest)))
    scale = Range.constant(m_z, tau).over(tau)
    by_sigma = scale.times(by_sigma).minus(on_plane.times(tau_slope.over(tau)))
    sigma_x, sigma_z = Range.constant(1.0, far).over(far), sigma.plus(way[0]).over(far)
    zero = Range.constant(0.0, far)
    return (
        (sigma_x.times(m_z), zero, sigma_z.times(m_z)),
        (
            by_sigma.times(sigma_x),
            scale.times(ahead.over(rest)),
            by_sigma.times(sigma_z).plus(scale.times(ahead.times(way[1]).minus(height).over(rest))),
        ),
    )


def _crossing(curvature: float, x: float, z: float, sigma: Range) -> tuple[Range, Range]:
    """How far before (x, z) lines along (sigma, -1) leave a circle, and the derivative of that by sigma."""
    before, root = crossing(curvature, x, z, sigma)
    return before, sigma.times(before).plus(x).times(before).times(-curvature).over(root)


def _conical(lens: Numbers, s_x: Range, s_y: Range, z: Range, way: tuple[Range, Range]) -> tuple[Slopes, Slopes]:
    m_x, m_y, m_z, y_o, z_o = lens[:5].tolist()
    below, above, across = s_y.plus(-m_y), s_y.plus(-y_o), s_x.plus(-m_x)
    square_m, square_e = below.squared().plus(m_z * m_z), above.squared().plus(z_o * z_o)
    ratio = square_e.root().over(square_m.root())
    kappa = z.times(1.0 / z_o).times(ratio)
    over_room = Range.constant(1.0, kappa).over(kappa.plus(1.0))
    rest = z.plus(-z_o)
    by_height = kappa.times(above.over(square_e).minus(below.over(square_m)))
    height_y, height_z = Range.constant(-z_o, rest).over(rest), way[1].times(-z_o).minus(above).over(rest)
    kappa_z = ratio.times(1.0 / z_o).plus(by_height.times(height_z))
    aside = across.times(-1.0).times(over_room)
    zero = Range.constant(0.0, rest)
    return (
        (over_room, aside.times(by_height).times(height_y), way[0].times(over_room).plus(aside.times(kappa_z))),
        (zero, height_y, height_z),
    )


def texel_slopes(
    lens: Numbers, s_x: Range, s_y: Range, u: Range, v: Range, rows: tuple[Slopes, Slopes]
) -> list[Slopes]:
    """Derivatives of the undistorted texel coordinates, given those of s.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers.
    s_x, s_y, u, v : Range
        Points of the plane, and their texel coordinates.
    rows : pair of Slopes
        The derivatives of s_x and s_y.
    """
    a, b, _, d, e, _, g, h, i = lens[8:17].tolist()
    divisor = s_x.times(g).plus(s_y.times(h)).plus(i)
    made = []
    for place, by_x, by_y in ((u, a, b), (v, d, e)):
        p, q = place.times(-g).plus(by_x).over(divisor), place.times(-h).plus(by_y).over(divisor)
        made.append(_chain(p, q, rows))
    return made


def distorted_slopes(lens: Numbers, u: Range, v: Range, rows: list[Slopes]) -> list[Slopes]:
    """Derivatives of the texel coordinates, given those of the undistorted ones.

    With a = (u - c_u) / f, b = (v - c_v) / f, r^2 = a^2 + b^2 and L = 1 + k1 r^2 + k2 r^4 the distortion's own are
    L + 2 a^2 (k1 + 2 k2 r^2) and so on, 2 a b (k1 + 2 k2 r^2) aside.
    """
    c_u, c_v, f, k1, k2 = lens[17:22].tolist()
    if k1 == 0.0 and k2 == 0.0:
        return rows
    a, b = u.plus(-c_u).times(1.0 / f), v.plus(-c_v).times(1.0 / f)
    square = a.squared().plus(b.squared())
    length = square.times(square.times(k2).plus(k1)).plus(1.0)
    bend = square.times(2.0 * k2).plus(k1).times(2.0)
    aside = a.times(b).times(bend)
    pair = rows[0], rows[1]
    return [
        _chain(length.plus(a.squared().times(bend)), aside, pair),
        _chain(aside, length.plus(b.squared().times(bend)), pair),
    ]


def _chain(p: Range, q: Range, rows: tuple[Slopes, Slopes]) -> Slopes:
    """The first row times p and the second times q."""
    x, y, z = (p.times(first).plus(q.times(second)) for first, second in zip(*rows, strict=True))
    return x, y, z
