"""How an estimator is written: the formulas of one texel and one sample, for its bits and for intervals.

An estimator is a NamedTuple of its numbers, points (n, d) among them, whose methods are its formulas: of samples that
are looked up each by itself (``Summed``), or of steps along directions, each of which begins where the one before ended
(``Folded``). They read a view by the words of ``Seen``, and compute with those of ``lfssao.core.numbers`` and
``lfssao.core.vectors``.
Numbers of the tuple are plain: arithmetic of two of them belongs before the tuple is made, where it is rounded once.
"""

from collections.abc import Callable, Container
from functools import partial
from typing import Any, Protocol

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, turns_of
from lfssao.ao.estimators.look_ups import cleared_places, cleared_z, look_of, one_more, with_cleared
from lfssao.ao.kernels.float_view import FloatView
from lfssao.ao.kernels.folds import fold_steps
from lfssao.ao.kernels.levels import Levels
from lfssao.ao.kernels.look_up import NOTHING
from lfssao.ao.kernels.sums import sum_samples
from lfssao.ao.kernels.texel_rays import TexelRays
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.distinct import distinct
from lfssao.core.numbers import method
from lfssao.errors import InputError
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import View

_MOST_LEVEL = 15  # of levels of depth
ZENITH = 1.0 + 2.0**-16  # no sine is larger, rounded or not


class Seen(Protocol):
    """The words by which formulas read a view; a texel is its number, row * width + column.

    A look-up, ``seen``, is a texel, or the four ``Corners`` around an image point where textures are filtered linearly.
    """

    def position(self, texel: Any) -> Any:
        """World coordinates of the texel's surface, a vector."""

    def normal(self, texel: Any) -> Any:
        """The unit normal of the texel's surface."""

    def direction(self, texel: Any) -> Any:
        """The unit direction in which the texel looks, away from the viewer."""

    def turn(self, texel: Any) -> Any:
        """Cosine and sine by which the texel's samples turn."""

    def noise(self, texel: Any) -> Any:
        """The texel's noise vector in world space, as it is given; of turns cosine rightward and sine upward."""

    def jitter(self, texel: Any) -> Any:
        """The third number of the texel's noise vector, by which steps may begin later; 0 where vectors have two."""

    def turn_by_angle(self, texel: Any) -> Any:
        """Cosine and sine as of ``turn``; a renderer may add the angle to a sample's own instead."""

    def sine_of_angle(self, x: Any) -> Any:
        """A sine or cosine of a sample, a plain number that a renderer makes itself of an angle."""

    def arc_cosine(self, x: Any) -> Any:
        """The angle of a cosine that is held between -1 and 1; a renderer's function is as good as its sines."""

    def cosine_and_sine(self, angle: Any) -> Any:
        """Cosine and sine of an angle, radians, that formulas make, as a renderer's functions give them."""

    def hashed_turn(self, at: Any, angle: Any) -> Any:
        """Cosine and sine of an angle, radians, and the hash of a texel, columns and rows ``at``, summed in float32."""

    def fork(self, condition: Any) -> Any:
        """Whether a condition holds, a bool; of balls in doubt a start or a place is made for both answers."""

    def surface(self, texel: Any) -> Any:
        """Cast z of the texel's surface."""

    def image_z(self, texel: Any) -> Any:
        """Image z of the texel's surface. To formulas that name this word all other z are image z, too."""

    def coarse_z(self, seen: Any, h: Any, log_q: Any) -> Any:
        """Cast z in the level of a sample h texels away (``ao.kernels.levels``), and whether there is a surface."""

    def point_at(self, u: Any, v: Any, z: Any) -> Any:
        """World coordinates of the point at cast z that is seen at an image point, texels, as a renderer rebuilds it.

        Positions that formulas naming this word read are rebuilt so, too. Displays whose rays are in a table have none.
        """

    def apart(self, there: Any, here: Any) -> Any:
        """The vector between two points that are made of depth; a camera's renderer may have other axes."""

    def sample_offset(self, x: Any) -> Any:
        """A coordinate R s of a sample's offset, or R R, a plain number that a renderer makes itself of R and s."""

    def shows(self, texel: Any) -> Any:
        """Whether the texel shows a surface."""

    def other(self, seen: Any, texel: Any) -> Any:
        """Whether a look-up, ``seen``, reads anything but the texel alone."""

    def image(self, place: Any) -> Any:
        """The image point u, v of a place, texels, and whether it has one."""

    def moments(self, seen: Any, level: Any) -> Any:
        """The share of texels that show a surface, and its means of cast z and its square, around an image point.

        seen: the point. level: log2 of the width, texels, over which the means are taken. Textures are filtered so
        where the view has a pyramid (``ao.moments``).
        """

    def row(self, texel: Any) -> Any:
        """The texel's row, a whole number."""

    def column(self, texel: Any) -> Any:
        """The texel's column, a whole number."""

    def rightward(self) -> Any:
        """The view's rightward direction in world space."""

    def upward(self) -> Any:
        """The view's upward direction in world space."""

    def at(self, point: Any) -> Any:
        """The image of a point, to which those of directions are added."""

    def along(self, direction: Any) -> Any:
        """The image of a direction, to be multiplied by numbers."""

    def depth_at(self, place: Any) -> Any:
        """Cast z of a place; of image z infinity where a camera sees no such place."""

    def depth_along(self, direction: Any) -> Any:
        """By how much a direction changes cast z."""

    def ball(self, value: Any, error: Any) -> Any:
        """The ball of a value and an error; views of balls have it alone."""


class Summed(Protocol):
    """The formulas of an estimator that sums a term of each sample."""

    points: Any

    def start(self, view: Any, texel: Any) -> Any:
        """Numbers, vectors and images that are made once a texel, a tuple."""

    def counts(self, view: Any, here: Any) -> Any:
        """Whether the texel has samples. Else its occlusion is 0, and no sample is outside."""

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of sample s of a texel; here: the texel's ``start``."""

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The term of sample s at cast z, or image z, whose image lies in a texel that shows a surface, ``seen``."""

    def background(self) -> Any:
        """The term of a sample whose image lies in a texel that shows no surface, a plain number."""

    def end(self, total: Any) -> Any:
        """Occlusion of a sum, with which it grows."""


class Folded(Protocol):
    """The formulas of an estimator that takes steps from a texel along directions, and keeps a state on the way.

    The image of a step lies a part of the way from the texel's centre to the image of the direction's end. A step adds
    at least 0; one that lands where no surface is seen adds nothing and keeps the state, a number or the sectors of
    ``lfssao.core.sectors``. The state begins anew at each direction, or at each pair (sides: 2), in which the second
    direction goes on with it.
    """

    points: Any
    steps: int
    sides: int

    def start(self, view: Any, texel: Any) -> Any:
        """Numbers, vectors and images that are made once a texel, a tuple."""

    def counts(self, view: Any, here: Any) -> Any:
        """Whether a texel has samples; else its occlusion is 0. here: the texel's ``start``."""

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of the end of direction s."""

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The state before the first step of direction s."""

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """The part of the way, from 0 to 1, at which step k of a texel lies; k: from 1 to ``steps``."""

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """The number that step k of a texel adds, and the state after it, by the surface of a texel, ``seen``.

        A texel without a surface lies at infinity there, or is left out.
        """

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The number that the state adds after the last step of direction s, or of a pair whose second one s is.

        It is not negative, but for rounding.
        """

    def end(self, total: Any) -> Any:
        """Occlusion of a sum, with which it grows or falls."""


_words = {name: word for protocol in (Seen, Summed, Folded) for name, word in vars(protocol).items()}
for _name, _word in _words.items():  # each once: what two protocols have would be compiled for both
    if callable(_word) and not _name.startswith("_"):
        method(_word)


def cast_depth(buffers: Buffers) -> Texture:
    """Cast z of a view's surfaces, (H, W): the depth texture, or made from a camera's positions.

    A camera's depth texture is not linear in z.
    """
    if buffers.view.world_to_image.kind != MATRIX:
        return np.ascontiguousarray(buffers.depth)
    a, b, c, d = buffers.view.cast_from_world[2].astype(buffers.depth.dtype)
    x, y, z = np.moveaxis(buffers.positions, 2, 0)
    with np.errstate(all="ignore"):
        made: Texture = np.where(buffers.depth < np.inf, ((a * x + b * y) + c * z) + d, buffers.depth)
    return made


def words_of(formulas: Any) -> set[str]:
    """Return the words that the formulas of a tuple name, and the functions that they call."""
    methods = [function for function in vars(type(formulas)).values() if hasattr(function, "__code__")]
    called = [function.__globals__.get(name) for function in methods for name in function.__code__.co_names]
    functions = [*methods, *(function for function in called if hasattr(function, "__code__"))]
    return {name for function in functions for name in function.__code__.co_names}


def float_view(buffers: Buffers, words: Container[str], options: Options) -> FloatView:
    """Return a view's textures and mapping as formulas read them, in the textures' dtype, with the options' look-ups.

    Textures that no word reads are None: formulas that read them do not compile. Normals are the positions where there
    are none. The rows are those of u, v, the divisor and z, cast z or, for the word ``image_z``, image z; a display's
    mapping has no divisor's row: 0. A texel behind those of the texture stands for background, where samples beyond the
    border see it; cleared, it holds a place in the middle of the view. Formulas that name ``coarse_z`` read levels of
    cast z by rotated sub-samples (SAO table 1), as many as the options' ``max_level`` says.
    """
    depth = buffers.depth
    cleared = cleared_z(options)
    buffers = with_cleared(buffers, cleared)
    view = buffers.view
    dtype = buffers.depth.dtype
    mapping = buffers.view.world_to_image
    divisor = mapping.numbers[12:16] if mapping.kind == MATRIX else np.zeros(4)
    of_image = "image_z" in words
    z = mapping.numbers[8:12] if of_image else view.cast_from_world[2]
    surfaces = None
    levels = None
    if of_image:
        surfaces = np.ascontiguousarray(view.image_z(buffers.depth), dtype).ravel()
    elif "surface" in words or "coarse_z" in words:
        surfaces = cast_depth(buffers).ravel()
        if cleared is not None:
            surfaces[~(depth.ravel() < np.inf)] = cleared  # and not as rounded on its way through a position
        levels = levels_of_z(surfaces.reshape(depth.shape), options) if "coarse_z" in words else None
    positions = np.ascontiguousarray(buffers.positions)
    turns = turns_of(buffers)
    rays = _rays_of(view, dtype) if "point_at" in words else None
    made = FloatView(
        depth=np.ascontiguousarray(depth).ravel(),
        surfaces=surfaces,
        positions=positions.ravel(),
        normals=(positions if buffers.normals is None else np.ascontiguousarray(buffers.normals)).ravel(),
        directions=buffers.directions.ravel() if "direction" in words else None,
        turns=turns,
        kind=mapping.kind,
        rows=np.concatenate([mapping.numbers[:8], divisor, z]).astype(dtype),
        lens=np.ascontiguousarray(mapping.numbers[12:], dtype),
        axes=np.ascontiguousarray(view.world_from_cast[:, :3].T * [[1], [1], [-1]], dtype).ravel(),
        width=buffers.depth.shape[1],
        divides=of_image and mapping.kind == MATRIX,
        look=look_of(options, depth.size),
        third=turns[2] if len(turns) == 3 else None,
        rays=rays,
        levels=levels,
    )
    if made.look is None or made.look.outside == NOTHING:
        return made
    (behind,), (place,) = cleared_places(view, np.array([view.width / 2]), np.array([view.height / 2]), cleared or 0.0)
    z = view.image_z(np.asarray(behind)) if of_image else cleared
    return made._replace(
        depth=one_more(made.depth, np.inf),
        surfaces=None if surfaces is None else one_more(surfaces, np.inf if cleared is None else z),
        positions=one_more(made.positions, np.full(3, np.inf) if cleared is None else place),
        normals=one_more(made.normals, np.zeros(3)),
    )


def levels_of_z(z: Texture, options: Options) -> Levels:
    """Return levels of cast z, (H, W), until one texel or the options' ``max_level``."""
    from lfssao.ao.estimators.sao.hierarchy import levels_of, z_hierarchy  # late: few estimators read levels

    return levels_of(z_hierarchy(np.ascontiguousarray(z), "rotated", getattr(options, "max_level", _MOST_LEVEL)))


def _rays_of(view: View, dtype: Any) -> TexelRays:
    """Return the rays by which formulas rebuild points; InputError if they are in a table."""
    from lfssao.ao.estimators.sao.texel_rays import texel_rays  # late: few estimators rebuild points

    rays = texel_rays(view, dtype)
    if rays.table is not None:
        raise InputError(
            "the estimator rebuilds points between texels' centres, and this display's rays have no formula: take a "
            "camera or a flat display with the linear diffuser"
        )
    return rays


def sum_formulas(
    formulas: Callable[..., Any],
    buffers: Buffers,
    radius: float,
    points: FloatArray,
    weights: FloatArray | None,
    options: Options,
) -> Occlusion:
    """Return occlusion of a view by the formulas of an estimator, ``Estimator.run`` of it."""
    numbers = distinct(formulas(buffers, radius, points, weights, options))
    return run_kernel(sum_samples, buffers.depth, float_view(buffers, words_of(numbers), options), numbers)


def summed(name: str, formulas: Callable[..., Any], **facts: Any) -> Estimator:
    """Return an estimator of one's own that is written as ``Summed``; facts: fields of ``Estimator``."""
    return _own(name, formulas, sum_formulas, facts)


def folded(name: str, formulas: Callable[..., Any], **facts: Any) -> Estimator:
    """Return an estimator of one's own that is written as ``Folded``; facts: fields of ``Estimator``."""
    return _own(name, formulas, fold_formulas, {"dimensions": 0, **facts})


def _own(name: str, formulas: Callable[..., Any], run: Callable[..., Occlusion], facts: dict[str, Any]) -> Estimator:
    said = {"title": "an estimator of one's own", "source": "its file", "formula": "as its file says", **facts}
    return Estimator(name=name, run=partial(run, formulas), formulas=formulas, **said)


def fold_formulas(
    formulas: Callable[..., Any],
    buffers: Buffers,
    radius: float,
    points: FloatArray | None,
    weights: FloatArray | None,
    options: Options,
) -> Occlusion:
    """Return occlusion of a view by the formulas of an estimator that takes steps, ``Estimator.run`` of it."""
    numbers = distinct(formulas(buffers, radius, points, weights, options))
    return run_kernel(fold_steps, buffers.depth, float_view(buffers, words_of(numbers), options), numbers)
