"""A view's linear z and the rays of its texels, for estimators that rebuild positions from depth."""

from functools import lru_cache
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.sao.kernels.reconstruct import linear_depth
from lfssao.ao.kernels.texel_rays import TexelRays
from lfssao.ao.textures import Buffers, Texture
from lfssao.optics.kernels import display as display_kernels
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX
from lfssao.optics.kernels.rays import FlatModule, Pinhole
from lfssao.optics.view import View


@lru_cache(maxsize=2)
def texel_rays(view: View, dtype: np.dtype[Any]) -> TexelRays:
    """Return the rays of a view's texels; the last two views are kept, as every radius and pass asks again."""
    numbers, table, origin = np.zeros(10), None, 0.0
    if view.rays.kind == MATRIX:
        f_u, f_v, c_u, c_v, _, _, orthographic, _ = Pinhole(*view.lens.tolist())
        if orthographic:
            numbers[:] = c_u, 0, 1 / f_u, 0, 0, c_v, 0, -1 / f_v, 0, 0
        else:
            numbers[:] = c_u, 0, 0, 0, 1 / f_u, c_v, 0, 0, 0, -1 / f_v
    elif view.rays.kind == CROSSED_SLITS:
        m_x, m_z, y_o, origin, u_scale, u_0, v_scale, v_0 = FlatModule(*view.lens.tolist())
        numbers[:5] = u_0, 0, 1 / u_scale, m_x / m_z, -1 / (u_scale * m_z)
        numbers[5:] = v_0, 0, 1 / v_scale, y_o / origin, -1 / (v_scale * origin)
    else:
        table, origin = _table(view), float(view.lens[4])
    linear = view.world_from_cast[:, :3]
    units = [sqrt((x * x + y * y) + z * z) for x, y, z in linear.T.tolist()]
    return TexelRays(
        numbers=numbers.astype(dtype),
        table=None if table is None else table.astype(dtype),
        world=np.ravel(view.world_from_cast).astype(dtype),
        units=np.array(units),
        origin=origin,
    )


def _table(view: View) -> NDArray[np.float64]:
    """Rays of a general display's texels, NaN where a texel has none."""
    v, u = np.mgrid[: view.height, : view.width] + 0.5
    traced = np.empty((view.width * view.height, 6))
    display_kernels.trace_texels(view.lens, u.ravel(), v.ravel(), traced)
    traced[~(traced[:, 4] < traced[:, 5])] = np.nan
    return np.ascontiguousarray(traced[:, [0, 2, 1, 3]].T)


def plane_constants(near: float, far: float) -> tuple[float, float, float]:
    """Return SAO's constants c of equation 2 for z > 0: (n, -1, 1) for f = infinity, else (n f, n - f, f)."""
    return (near, -1.0, 1.0) if far == inf else (near * far, near - far, far)


def linear_z(buffers: Buffers) -> Texture:
    """Return the view's z of cast space, (H, W): its depth texture, but equation 2 of SAO of a camera's screen z."""
    view, depth = buffers.view, np.ascontiguousarray(buffers.depth)
    if view.rays.kind != MATRIX or view.linear:
        return depth
    camera = Pinhole(*view.lens.tolist())
    near, far, perspective = camera.near, camera.far, not camera.orthographic
    c = plane_constants(near, far) if perspective else (near, far - near, 0.0)
    z = np.empty_like(depth)
    linear_depth(depth, perspective, *(depth.dtype.type(number) for number in c), z)
    return z
