"""SAO's sampling pass: taps of a turned spiral in the z hierarchy (SAO section 2.3, equations 5 to 10 and 1; appendix).

Lengths are in radii, u = v / r, so that nothing depends on the scene's unit. Readings. Equation 10 is the hierarchy's
texel ((x', y') + h_i u_i) >> m_i, its '/ 2^m' the shift, h_i is h'_i and a coordinate is cut down to a whole number;
the position is rebuilt at the unshifted texel. A tap outside the texture contributes nothing and is counted, one that
sees no surface contributes nothing, and neither does one on the texel itself: v is 0 there, and on a module, whose C is
read from the positions texture, rounding is not. On a module the ball's image is an ellipse: h is h_u across and h_v
down, and the larger one chooses the level.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.sao.kernels.reconstruct import spacing
from lfssao.ao.kernels.texel_rays import on_ray
from lfssao.core.jit import formula
from lfssao.core.numbers import is_finite, larger, number, rounded, select, smaller
from lfssao.core.places import image_place
from lfssao.core.vectors import dot

# A screen radius is held below 2**20 texels: every tap that leaves a texture does so too then, and integers hold it.
FAR = 2.0**20


@formula
def _direction(angles: Any, view: Any, points: Any, turn: Any, at: Any, s: Any) -> Any:
    """The unit vector of tap s: turned with its texel, or that of its angle and the common hash, summed in float32."""
    if angles is None:
        cosine, sine = turn
        x, y = view.sine_of_angle(points[s, 0]), view.sine_of_angle(points[s, 1])
        return x * cosine - y * sine, x * sine + y * cosine
    return view.hashed_turn(at, angles[s])


@formula
def _whole(landing: Any, offset: Any) -> Any:
    """An offset in texels, cut towards 0 (landing 0) or to the nearest whole number (1)."""
    return select(landing == 1, np.floor(offset + 0.5), np.trunc(offset))


@formula
def _landed(landing: Any, offset: Any) -> Any:
    """An offset in texels as it is (-1), or to the middle of a texel."""
    return select(landing < 0, offset, _whole(landing, offset) + 0.5)


@formula
def _upward(landing: Any, offset: Any) -> Any:
    """The way down of an offset up, to the middle of a texel, as of rows that are counted from below."""
    return 0.5 - select(landing < 0, np.floor(offset), _whole(landing, offset))


def visibility_of(scale: Any, total: Any) -> Any:
    """A before averaging, of sums of terms: max(0, 1 - scale sum), 0 of no number."""
    return larger(0, 1 - scale * total)


class Sao(NamedTuple):
    """Numbers of a tap and its term, arrays and scalars of the arithmetic's dtype.

    points: (s, 3), taps at angle 0, by ``lfssao.samples.kernels.spiral.unit_taps``. angles: None, or of taps, (s,),
    float64, radians, that the common hash is added to in float32. landing: that of ``_landed``. up: whether sines are
    upward. height, width: of the texture. reach_u, reach_v: the radius in units of cast space, across and down (r in
    world units for rays in a table). inverse: 1 / r. cubed: whether the falloff is the appendix's. bias, depth_bias:
    u.n less bias + depth_bias (z - origin), in radii. log_q: log2 of q'.
    """

    points: Any
    angles: Any
    landing: int
    up: bool
    height: int
    width: int
    reach_u: Any
    reach_v: Any
    inverse: Any
    cubed: bool
    bias: Any
    depth_bias: Any
    origin: Any
    epsilon: Any
    log_q: int

    def start(self, view: Any, texel: Any) -> Any:
        """C, its normal, what is taken off u.n, the turn, the texel's place, and its radius in texels (equation 5)."""
        c, n, z = view.position(texel), view.normal(texel), view.surface(texel)
        less = self.bias + rounded(self.depth_bias, 3, z) * (z - self.origin)
        across, down = spacing(view, texel, (self.height, self.width), z)
        far = number(FAR, z)  # of 0 / 0, too
        reach = smaller(far, rounded(self.reach_u, 3, z) / across), smaller(far, rounded(self.reach_v, 3, z) / down)
        return c, n, less, view.turn_by_angle(texel), (number(view.column(texel), z), number(view.row(texel), z)), reach

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has taps."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """Equation 6, turned, and equation 8's sum: (x', y') + (h_u cos, h_v sin)."""
        _, _, _, turn, (column, row), (across, down) = here
        u, v = _direction(self.angles, view, self.points, turn, (column, row), s)
        alpha = rounded(self.points[s, 2], 0, column, 1)
        offset = (down * alpha) * v
        below = select(self.up, _upward(self.landing, offset), _landed(self.landing, offset))
        return image_place(column + _landed(self.landing, (across * alpha) * u), row + below)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """(1 - u.u)^3 max(u.n - less, 0) / (u.u + epsilon), Q on the texel's ray at the hierarchy's z; 0 if no number.

        Equation 1 has no cubed factor.
        """
        c, n, less, _, _, (across, down) = here
        alpha = rounded(self.points[s, 2], 0, less, 1)
        deep, there = view.coarse_z(seen, larger(down * alpha, across * alpha), self.log_q)
        u = rounded(self.inverse, 0, less, 2) * view.apart(on_ray(view, seen, deep), c)
        square, above = dot(u, u), larger(dot(u, n) - less, 0)
        below = square + self.epsilon
        term = above / below
        left = larger(1 - square, 0)
        term = select(self.cubed, ((left * left) * left) * term, term)
        return select((above > 0) & (term > 0) & is_finite(below) & there & (seen != texel), term, 0)

    def background(self) -> Any:
        """No tap is on background: the hierarchy says what it sees."""
        return 0

    def end(self, total: Any) -> Any:
        """The sum itself: A = max(0, 1 - scale sum) is averaged and blurred before it is occlusion."""
        return total
