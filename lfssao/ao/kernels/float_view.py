"""A view of floats, as formulas read it."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.kernels.levels import level_texel, mip_level
from lfssao.ao.kernels.look_up import holds_place
from lfssao.ao.kernels.moments import filtered_moments
from lfssao.ao.kernels.texel_rays import bare_rays, point_at
from lfssao.core.corners import blended, blended_vector, by_corners
from lfssao.core.functions import arc_cosine, cosine_and_sine
from lfssao.core.intrinsics import memory_of
from lfssao.core.jit import formula
from lfssao.core.numbers import as_float, number, plain, select, unless_none, where_none
from lfssao.core.places import affine_rows, linear_rows
from lfssao.core.vectors import Vector
from lfssao.optics.kernels.projection import MATRIX, image_of, texel_number
from lfssao.samples.kernels.spiral import summed_angle, unit_of


@formula
def float_vector(texture, texel):
    """The vector of a texel, of a texture (3 H W,)."""
    t = np.uint64(3) * np.uint64(texel)
    return Vector(as_float(texture[t]), as_float(texture[t + np.uint64(1)]), as_float(texture[t + np.uint64(2)]))


@formula
def row_of_texel(texel, width):
    """Texel // width, by a product of floats, as processors have no vectors of whole quotients.

    (texel + 1/2) / width lies at least 1/2 / width from a whole number. The product, of up to 2^31 texels, is off by
    less than 2^-20 / width. With a quotient SAO's taps take 1.1 times as long [bench_estimators].
    """
    return np.uint32(np.int32((np.float64(np.int32(texel)) + 0.5) * (1.0 / np.float64(np.int32(width)))))


@formula
def float_at(seen, texture):
    """The number of a texel, or between four, of a texture (H W,)."""
    return by_corners(seen, _float_of, _float_between, (texture,))


@formula
def _float_of(texel, texture):
    return as_float(texture[texel])


@formula
def _float_between(four, texture):
    a, b = as_float(texture[four.texel]), as_float(texture[four.right])
    return blended(four, a, b, as_float(texture[four.below]), as_float(texture[four.across]))


@formula
def vector_at(seen, texture):
    """The vector of a texel, or between four, of a texture (3 H W,)."""
    return by_corners(seen, _vector_of, _vector_between, (texture,))


@formula
def _vector_of(texel, texture):
    return float_vector(texture, texel)


@formula
def _vector_between(four, texture):
    a, b = float_vector(texture, four.texel), float_vector(texture, four.right)
    return blended_vector(four, a, b, float_vector(texture, four.below), float_vector(texture, four.across))


@formula
def _third(third, view, texel):
    """The third number of a noise vector."""
    return as_float(third[texel])


@formula
def _raised(third, view, texel):
    """A noise vector of three numbers."""
    x, y = view.turn(texel)
    return (x * view.rightward() + y * view.upward()) + as_float(third[texel]) * float_vector(view.axes, 2)


@formula
def all_show(seen, view):
    """Whether a texel shows a surface or holds a place, or all four do."""
    return by_corners(seen, _shows, _all_show, (view,)) | holds_place(view.look)


@formula
def _shows(texel, view):
    return view.depth[texel] < np.inf


@formula
def _all_show(four, view):
    first = (view.depth[four.texel] < np.inf) & (view.depth[four.right] < np.inf)
    return first & (view.depth[four.below] < np.inf) & (view.depth[four.across] < np.inf)


@formula
def is_other(seen, texel):
    """Whether a look-up reads anything but a texel alone."""
    return by_corners(seen, _differs, _reads_others, (texel,))


@formula
def _differs(seen, texel):
    return seen != texel


@formula
def _reads_others(four, texel):
    return (four.texel != texel) | (four.x > 0) | (four.y > 0)


@formula
def landed(view, x, y, seen):
    """Return what formulas are given of a look-up, ``seen``, or the image point where textures are filtered."""
    return where_none(view.moments_of, seen, (as_float(x), as_float(y)))


@formula
def texel_of_look(view, x, y, sought, width):
    """The texel of the image point (x, y) in the texture, or that of the view's look."""
    return where_none(view.look, texel_number(x, y, width), np.uint32(max(sought, 0)))


@formula
def adds(view, inside, sought):
    """Whether a sample adds a term, by whether it is inside the texture and by the texel of the view's look."""
    return where_none(view.look, inside, sought >= 0)


@formula
def shown(view: Any, seen: Any) -> Any:
    """Whether a surface is seen where a sample has ``landed``; filtered textures and levels say by themselves."""
    filtered = where_none(view.moments_of, False, True) | where_none(view.levels, False, True)
    return filtered | view.shows(where_none(view.moments_of, seen, 0))


class FloatView(NamedTuple):
    """A view's textures row by row, all of one dtype, with the words of ``lfssao.ao.formulas.Seen``.

    depth: (H W,), the depth texture, and surfaces, cast z, or image z for formulas that ask for it, +infinity where
    there is no surface. positions, normals, directions: (3 H W,). turns: (2, H W), or (3, H W). kind: that of the
    mapping. rows: (16,), four affine rows of world space, u, v, divisor (of MATRIX alone), and z. lens: z_m, z_o, u_0,
    v_0 for CROSSED_SLITS, the module's 32 numbers for DISPLAY. axes: (9,), right, up and towards the viewer. width:
    texels of a row. rays: ``texel_rays.TexelRays``, for formulas that make points of depth.
    """

    depth: np.ndarray
    surfaces: Any  # None where no formula reads them
    positions: np.ndarray
    normals: np.ndarray
    directions: Any  # likewise
    turns: np.ndarray
    kind: int
    rows: np.ndarray
    lens: np.ndarray
    axes: np.ndarray
    width: int
    moments_of: Any = None  # a pyramid, where textures are filtered (``ao.moments``)
    divides: bool = False  # whether z is a camera's image z, by the divisor
    rays: Any = None
    levels: Any = None  # ``Levels`` of cast z, where samples read them in place of the texture
    look: Any = None  # ``Look``, where samples beyond the border or before background read a texel
    third: Any = None  # z of noise vectors, (H W,), where they have one

    def position(self, texel):
        return vector_at(texel, self.positions)

    def normal(self, texel):
        return float_vector(self.normals, texel)

    def direction(self, texel):
        return float_vector(self.directions, texel)

    def turn(self, texel):
        return as_float(self.turns[0][texel]), as_float(self.turns[1][texel])

    def noise(self, texel):
        x, y = self.turn(texel)
        return unless_none(self.third, x * self.rightward() + y * self.upward(), _raised, (self, texel))

    def jitter(self, texel):
        x, _ = self.turn(texel)
        return unless_none(self.third, number(0, x), _third, (self, texel))

    def turn_by_angle(self, texel):
        return self.turn(texel)

    def sine_of_angle(self, x):
        return as_float(x)

    def arc_cosine(self, x):
        return arc_cosine(x)

    def cosine_and_sine(self, angle):
        return cosine_and_sine(angle)

    def hashed_turn(self, at, angle):
        sine, cosine = unit_of(summed_angle(plain(at[0]), plain(at[1]), angle))
        return number(cosine, at[0]), number(sine, at[0])

    def fork(self, condition):
        return condition

    def surface(self, texel):
        return float_at(texel, self.surfaces)

    def image_z(self, texel):
        return self.surface(texel)

    def coarse_z(self, seen, h, log_q):
        level = mip_level(plain(h), np.int32(log_q), np.int32(self.levels.first.shape[0] - 1))
        row = np.int32(row_of_texel(seen, self.width))
        column = np.int32(seen) - np.int32(row * np.int32(self.width))
        z = self.levels.z[level_texel(self.levels.first, level, column, row, np.int32(self.width))]
        return as_float(z), z < np.inf

    def point_at(self, u, v, z):
        return point_at(self.rays, u, v, z)

    def apart(self, there, here):
        return there - here

    def sample_offset(self, x):
        return as_float(x)

    def shows(self, texel):
        return all_show(texel, self)

    def other(self, seen, texel):
        return is_other(seen, texel)

    def image(self, place):
        return image_of(self.kind, self.lens, place.u, place.v, place.q, place.z)

    def moments(self, seen, level):
        share, first, second = filtered_moments(self.moments_of, plain(level), plain(seen[0]), plain(seen[1]))
        return as_float(share), as_float(first), as_float(second)

    def row(self, texel):
        return row_of_texel(texel, self.width)

    def column(self, texel):
        return np.uint32(texel) - row_of_texel(texel, self.width) * np.uint32(self.width)

    def rightward(self):
        return float_vector(self.axes, 0)

    def upward(self):
        return float_vector(self.axes, 1)

    def at(self, point):
        return affine_rows(self.rows, point)

    def along(self, direction):
        return linear_rows(self.rows, direction)

    def depth_at(self, place):
        divided = select(place.q > 0, place.z / place.q, np.inf)
        return select((self.kind == MATRIX) & self.divides, divided, place.z)

    def depth_along(self, direction):
        return linear_rows(self.rows, direction).z


@formula
def bare_view(view):
    """The view with its textures and numbers as bare memory."""
    return FloatView(
        memory_of(view.depth), memory_of(view.surfaces), memory_of(view.positions), memory_of(view.normals),
        memory_of(view.directions), (memory_of(view.turns[0]), memory_of(view.turns[1])), view.kind,
        memory_of(view.rows), memory_of(view.lens), memory_of(view.axes), view.width, view.moments_of, view.divides,
        bare_rays(view.rays), view.levels, view.look, memory_of(view.third),
    )  # fmt: skip


@formula
def with_kind(view, kind):
    """A view whose mapping is of a kind that compilers know."""
    return FloatView(
        view.depth, view.surfaces, view.positions, view.normals, view.directions, view.turns, kind, view.rows,
        view.lens, view.axes, view.width, view.moments_of, view.divides, view.rays, view.levels, view.look,
        view.third,
    )  # fmt: skip
