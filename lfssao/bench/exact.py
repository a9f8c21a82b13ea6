"""The mapping of a flat display with the linear diffuser in rational numbers, from its geometry (LF section 3).

Written from the similar triangles, not from the kernels: a line through the module's lens, seen from above, and one
through the observers, seen from the side.
"""

from fractions import Fraction

from lfssao.display import Display
from lfssao.matrix import Matrix

Point = tuple[Fraction, Fraction, Fraction]


def rational(numbers: object) -> Point:
    """Three floats as what they are."""
    x, y, z = (Fraction(float(n)) for n in numbers)  # type: ignore[attr-defined]
    return x, y, z


def to_physical(physical_from_world: Matrix, point: Point) -> Point:
    """The affine map world -> physical of a point."""
    rows = [[Fraction(float(entry)) for entry in row] for row in physical_from_world]
    x, y, z = (sum((a * b for a, b in zip(row, point, strict=False)), row[3]) for row in rows)
    return x, y, z


def flat_image(display: Display, index: int, physical: Point) -> Point | None:
    """u, v (texels) and z (metres) of a physical point; None at or beyond the lens or the observers."""
    module = display.modules[index]
    m_x, m_z, y_o, z_o = (
        Fraction(n) for n in (module.x, module.z, display.observer_height, display.observer_z)
    )  # fmt: skip
    x, y, z = physical
    if not z_o < z < m_z:
        return None
    s_x = m_x + (x - m_x) * m_z / (m_z - z)
    s_y = y_o + (y - y_o) * z_o / (z_o - z)
    half = Fraction(1, 2)
    u = module.width * (half + s_x / Fraction(display.screen_width))
    v = module.height * (half - s_y / Fraction(display.screen_height))
    return u, v, z
