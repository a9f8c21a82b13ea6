"""Horizon-based AO (Bavoil, Sainz and Dimitrov 2008), which VO's table 1 calls HSAO.

Occlusion is the share of the hemisphere's directions, not weighted by the cosine, between the tangent plane and the
horizon. Where the view is parallel and sees all of the surface within R it tends, for ever more directions and steps
and without bias, to

    (1 / 2 pi) integral_0^2pi integral W dM d theta

M the sine of the horizon so far on the way out, which starts at the tangent plane's. That is

- 0 on a plane, at a convex crease and on top of a sphere;
- 1/2 in a concave right-angle crease, with attenuation too, as the nearest step sees the whole wall rise;
- on the floor at a distance a before a step up of height H, in radii: (1 / pi) integral_0^b W(q) H / q d theta, with
  q^2 = a^2 / cos(theta)^2 + H^2 and cos(b) = a / sqrt(1 - H^2), as M rises at the wall at once and nowhere else;
  without attenuation, for an infinite R, arctan(H / a) / pi, the share of a lune;
- beside a sphere on a plane M rises along the outline of the sphere's upper half, and there is no shorter form.

At finite resolution the texels read lie beside the direction of the march, where a slanted tangent plane is higher or
lower: on slopes a plane hides a little of itself (up to about 0.1 beside an edge), unless a bias forbids it.

Elevations are compared and subtracted as sines, so no angle is ever computed.
"""

import numpy as np

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.kernels.horizon import horizon_occlusion
from lfssao.ao.estimators.vo.local_frame import Surroundings, disk_turns
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi

# Linear and quadratic part of 1 - W, W the attenuation.
_ATTENUATION = {"quadratic": (0.0, 1.0), "linear": (1.0, 0.0), "none": (0.0, 0.0)}


def hbao(
    buffers: Buffers,
    radius: float,
    points: None,
    weights: None,
    directions: int,
    steps: int,
    bias: float,
    attenuation: str,
    randomize: bool,
    seed: int,
) -> passes.Occlusion:
    """Horizon-based AO.

    Parameters
    ----------
    buffers : Buffers
        The view's textures, with normals, which give the tangent plane.
    radius : float
        R, world units.
    points, weights : None
        It takes no samples.
    directions, steps : int
        N_d directions and N_s steps along each; both are 8 in the paper's figure 1.
    bias : float
        Angle, degrees, by which a horizon must exceed the tangent plane, against the facets of coarse meshes.
    attenuation : str
        W of a horizon at the distance r R: 'quadratic' 1 - r^2, 'linear' 1 - r or 'none' 1, and 0 beyond R. The
        paper's one page leaves W open; its authors' shader has the first.
    randomize : bool
        Whether the directions are reflected about ones that differ between the texels of tiles of 4 x 4. The paper
        turns them; that its steps are jittered as well is left out.
    seed : int
        Of those.
    """
    near, dtype = Surroundings.of(buffers), buffers.depth.dtype
    around = np.array([sincospi((2 * k + 1) / directions)[::-1] for k in range(directions)])
    sine, cosine = sincospi(bias / 180.0)
    linear, quadratic = _ATTENUATION[attenuation]
    occlusion, outside = np.empty_like(near.depth), np.empty(near.depth.shape[0], np.int64)
    horizon_occlusion(
        near.depth, near.positions, near.directions, near.normals, near.kind, near.rows, near.lens, near.right,
        dtype.type(radius), disk_turns(randomize, seed, dtype), around.astype(dtype), steps, dtype.type(sine),
        dtype.type(cosine), dtype.type(linear), dtype.type(quadratic), occlusion, outside,
    )  # fmt: skip
    return passes.Occlusion(occlusion, int(outside.sum()))


ENTRIES = (
    Estimator(
        name="hbao",
        title="horizons above the tangent plane",
        source="Bavoil, Sainz and Dimitrov 2008, equations 1 and 2",
        run=hbao,
        dimensions=0,
        count=64,
        normals=True,
        texel_bytes=20,
        parameters={
            "directions": 8,
            "steps": 8,
            "bias": 0.0,
            "attenuation": "quadratic",
            "randomize": True,
            "seed": 0,
        },
        limits={"directions": (1, 1024), "steps": (1, 1024), "bias": (0.0, 90.0), "seed": (0, 2**32 - 1)},
        choices={"attenuation": tuple(_ATTENUATION)},
    ),
)
