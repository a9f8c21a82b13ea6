"""Point sampling of the ball around each visible point (LF sections 4 and 5, after Mittring 2007).

What each makes of surfaces with known answers, as the number of samples grows and the texels shrink, seen from
straight above by an orthographic camera (an occluder's shadow along the view counts as solid, which is the papers'
meaning). V(A) is the share of the shell's volume in A; cap(r) = (1 - d/r)^2 (2 + d/r) / 4 for d < r, else 0, is the
share of a ball of radius r beyond a plane at distance d.

==============================================  ===========================  =====================================
surface                                         ``lf``, ``point``            ``hemisphere``; ``point`` with remap
==============================================  ===========================  =====================================
plane                                           1/2                          0
concave right-angle crease, d from its wall     1/2 + C/2                    C
convex right-angle crease, d from its edge      1/2 - C/2                    0
step up of at least R (a half-space), at d      1/2 + C/2                    C
anything                                        V(behind the depth texture)  share of the half shell behind it
==============================================  ===========================  =====================================

On top of a sphere of radius s a ball of radius r <= s lies by 1/2 - 3 r / (16 s) in the sphere, a half ball not at all;
beside a sphere on a plane, where its shadow is a solid with a flat side, the last row has no shorter form.
C = (R^3 cap(R) - r_min^3 cap(r_min)) / (R^3 - r_min^3) is the shell's share beyond a plane at d. (The full ball lies
half below its own surface; the wall of a crease cuts off a cap, half of it above that surface.)
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Estimator, FloatArray
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples

SURFACES = ("depth", "positions")


def lf(buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None) -> passes.Occlusion:
    """LF's occlusion: Algorithm 1 where the mapping has an inverse, Algorithm 2 where it has none.

    Parameters
    ----------
    buffers : Buffers
        The view's textures.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    weights : None
        LF's samples all weigh 1 / n; weights are not read.
    """
    view = buffers.view
    if view.screen_to_world is not None:
        matrix = view.world_to_image.numbers.reshape(4, 4)
        return passes.algorithm1(buffers.depth, view.screen_to_world, matrix, points, radius)
    return passes.algorithm2(buffers.depth, buffers.positions, view.world_to_image, points, radius)


def lf_radii(
    buffers: Buffers, radii: Sequence[float], points: FloatArray, weights: FloatArray | None
) -> list[passes.Occlusion]:
    """``lf`` of each of several radii, by Algorithm 2 all at once."""
    if buffers.view.screen_to_world is not None:
        return [lf(buffers, radius, points, weights) for radius in radii]
    return passes.algorithm2_of_radii(buffers.depth, buffers.positions, buffers.view.world_to_image, points, radii)


def point(
    buffers: Buffers,
    radius: float,
    points: FloatArray,
    weights: FloatArray | None,
    remap: bool,
    range_check: bool,
    surface: str,
) -> passes.Occlusion:
    """The full ball with options: LF Algorithm 2 on every view, cameras included.

    Parameters
    ----------
    buffers : Buffers
        The view's textures.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    weights : None
        Samples all weigh 1 / n; weights are not read.
    remap : bool
        2 max(0, ao - 1/2) in place of ao, so that a flat surface, half of whose ball lies behind it, is 0.
    range_check : bool
        Whether a surface point farther than R from the texel's own, in world space, does not occlude. (The classical
        check compares depths, which in a module are no distances.)
    surface : str
        LF Algorithm 2's line 7: 'depth' reads the depth texture; 'positions' reads the positions texture and maps that
        point to the image, LF's alternative. They differ where rounding of a position moves its depth past a sample's
        (``line7_differences`` counts them); the depth texture's is the oracle's: it is rounded once, not twice.
    """
    return _share(buffers, radius, points, None, remap, range_check, surface)


def hemisphere(
    buffers: Buffers,
    radius: float,
    points: FloatArray,
    weights: FloatArray | None,
    range_check: bool,
    surface: str,
) -> passes.Occlusion:
    """The half ball above the surface: samples below it are taken on the other side of the point (VO section 4.4).

    VO says 'reflecting the points that are underneath'; an offset o is replaced by -o here, which keeps its bits, and
    not mirrored in the surface: both send a ball's uniform points to the half ball's. A texel whose normal is 0 keeps
    its ball.

    Parameters
    ----------
    buffers : Buffers
        The view's textures; normals are read.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    weights : None
        Samples all weigh 1 / n; weights are not read.
    range_check, surface
        As for ``point``.
    """
    return _share(buffers, radius, points, buffers.normals, False, range_check, surface)


def line7_differences(buffers: Buffers, radius: float, points: FloatArray) -> int:
    """How many decisions 'occluded or not', of all texels and samples, the two forms of LF's line 7 take differently.

    Parameters
    ----------
    buffers : Buffers
        The view's textures.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    """
    count = 0
    for sample in np.asarray(points, np.float64):
        one, other = (_share(buffers, radius, sample[None], None, False, False, form).texture for form in SURFACES)
        count += int(np.count_nonzero(one != other))
    return count


def _share(
    buffers: Buffers,
    radius: float,
    points: FloatArray,
    normals: NDArray[np.floating] | None,
    remap: bool,
    range_check: bool,
    surface: str,
) -> passes.Occlusion:
    from lfssao.ao.estimators.kernels.point import share_behind  # late: 'lf', the default, does not need it

    depth, dtype = buffers.depth, buffers.depth.dtype.type
    with np.errstate(over="ignore"):  # the square of a very large radius is infinite: all is in reach
        offsets = np.ascontiguousarray(radius * np.asarray(points, np.float64), dtype)
        reach = dtype(float(radius) * float(radius)) if range_check else dtype(np.inf)
    occlusion, outside = np.empty_like(depth, order="C"), np.empty(depth.shape[0], np.int64)
    mapping = buffers.view.world_to_image
    share_behind(
        np.ascontiguousarray(depth), np.ascontiguousarray(buffers.positions),
        np.empty((0, 0, 3), dtype) if normals is None else np.ascontiguousarray(normals), offsets,
        mapping.kind, mapping.as_type(dtype), normals is not None, reach, surface == "positions", remap,
        occlusion, outside,
    )  # fmt: skip
    return passes.Occlusion(occlusion, int(outside.sum()))


def _shell(n: int) -> tuple[FloatArray, None]:
    """LF's shell, 0.8 R to R, by the Latin square."""
    return make_samples("latin", n), None


ENTRIES = (
    Estimator(
        name="lf",
        title="share of samples in the ball behind the surface",
        source="LF Algorithms 1 and 2",
        run=lf,
        run_radii=lf_radii,
        samples=_shell,
        sampling="latin",
    ),
    Estimator(
        name="point",
        title="share of samples in the ball behind the surface, positions from a texture on every view",
        source="LF Algorithm 2, Mittring 2007",
        run=point,
        samples=_shell,
        sampling="latin",
        parameters={"remap": False, "range_check": False, "surface": "depth"},
        choices={"surface": SURFACES},
    ),
    Estimator(
        name="hemisphere",
        title="share of samples in the half ball above the surface behind it",
        source="VO section 4.4",
        run=hemisphere,
        samples=_shell,
        sampling="latin",
        normals=True,
        parameters={"range_check": False, "surface": "depth"},
        choices={"surface": SURFACES},
    ),
)
