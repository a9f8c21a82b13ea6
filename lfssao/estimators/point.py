"""Point sampling of the ball around each visible point (LF sections 4 and 5, after Mittring 2007)."""

from lfssao import passes
from lfssao.estimators.buffers import Buffers
from lfssao.estimators.estimator import Estimator, FloatArray
from lfssao.samples import make_samples


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
        LF's samples all weigh 1 / n.
    """
    view = buffers.view
    if view.screen_to_world is not None:
        matrix = view.world_to_image.numbers.reshape(4, 4)
        return passes.algorithm1(buffers.depth, view.screen_to_world, matrix, points, radius)
    return passes.algorithm2(buffers.depth, buffers.positions, view.world_to_image, points, radius)


def _shell(n: int) -> tuple[FloatArray, None]:
    """LF's shell, 0.8 R to R, by the Latin square."""
    return make_samples("latin", n), None


ENTRIES = (
    Estimator(
        name="lf",
        title="share of samples in the ball behind the surface",
        source="LF Algorithms 1 and 2",
        run=lf,
        samples=_shell,
        sampling="latin",
    ),
)
