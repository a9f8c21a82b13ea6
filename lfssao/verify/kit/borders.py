"""Mappings whose domains have borders at numbers that arithmetic meets exactly, and points next to and on them."""

from dataclasses import replace

import numpy as np

from lfssao.optics.display import Display, Module
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import KINDS
from lfssao.verify.kit.views import Problem, described, make_display

Points = list[tuple[float, float, float]]

_LENS = Module(0.0, 0.0, 1.0, 32, 24)


# Points on and next to the borders of one display only; all displays have borders at z of the lens and of the
# observers, who are on a line at z = -2 unless the options say otherwise. World space is physical space.
_DISPLAYS: dict[str, tuple[Display, Points]] = {
    "crossed_slits": (make_display(_LENS), []),
    "conical": (make_display(_LENS, diffuser="conical", observer_height=2.0), [(0.25, -0.75, 0.75), (0.25, -0.5, 0.5)]),
    # Tangents of the circle of radius 4 from a lens 5 from its middle: by 3, 4 and 5.
    "grazed": (
        make_display(replace(_LENS, z=9.0), screen_curvature=0.25),
        [(4.0, 0.0, 6.0), (4.25, 0.0, 6.0), (3.75, 0.0, 6.0), (4.0, 0.5, 5.75), (-4.0, 0.5, 6.0)],
    ),
    # The same of the observers' arc, of points before it as well as on it.
    "observers_missed": (
        make_display(replace(_LENS, z=7.0), observer_curvature=0.25),
        [(4.0, 0.0, 4.0), (1.0625, 0.0, 6.25), (1.0, 0.0, 6.25), (0.875, 0.5, 6.25)],
    ),
    # Lines that reach the observers before the screen.
    "observers_first": (
        make_display(_LENS, screen_curvature=-0.25, observer_z=-0.5),
        [(1.0, 0.0, 0.25), (0.984375, 0.0, 0.25), (0.5, 0.5, 0.25)],
    ),
    # Its distortion folds at r = 2.
    "folded": (
        make_display(replace(_LENS, homography=(16.0, 0.0, 16.0, 0.0, -16.0, 12.0, 0.0, 0.0, 1.0), k1=-1 / 12)),
        [(2.0, 0.0, 0.0), (1.9375, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 2.0625, 0.0)],
    ),
    # w = 0 at s_x = 1.
    "horizon": (
        make_display(replace(_LENS, homography=(16.0, 0.0, 16.0, 0.0, -16.0, 12.0, -1.0, 0.0, 1.0))),
        [(1.0, 0.0, 0.0), (0.875, 0.5, 0.0), (1.125, 0.5, 0.0)],
    ),
}

# A camera that looks along z from the origin.
_CAMERA = [12.0, 0.0, 16.0, 0.0, 0.0, -12.0, 12.0, 0.0, 0.0, 0.0, 1.25, -1.25, 0.0, 0.0, 1.0, 0.0]

BORDERS = (*_DISPLAYS, "camera")


def border_problem(name: str) -> Problem:
    """Parameters and inputs of the stage ``mapping`` for one of ``BORDERS``."""
    if name == "camera":
        mapping = {"kind": KINDS[MATRIX], "numbers": _CAMERA}
        points = [(0.5, 0.25, z) for z in (0.0, 1.0, 2.0, -1.0, -0.25)]
    else:
        display, own = _DISPLAYS[name]
        mapping = described(display.view(0, np.eye(3, 4)).world_to_image)
        points = [(0.5, 0.25, z) for z in (1.0, 0.75, 1.25, -2.0, -1.75, -2.25, 0.0, 2.0)] + own
    return {"mapping": mapping}, {"points": np.array(points, np.float32)}
