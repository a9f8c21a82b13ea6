"""The estimators' benchmark: the papers' settings on a scene with background and on one without."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from lfssao import Buffers, Camera, RayCaster, builtin_scene, estimate, find_display, module_views
from lfssao.ao.estimators.sao import hierarchy
from lfssao.ao.estimators.sao.texel_rays import linear_z, texel_rays
from lfssao.ao.post import blur, merge
from lfssao.optics.view import View
from lfssao.rendering.settings import diagonal
from lfssao.samples import repulsion_table

WIDTH = 1024
HEIGHT = 768
SMALL = 256, 192  # what a pass reads and writes fits a core's own cache of 2 MB
RADIUS, SAO_RADIUS = 0.02, 0.05  # shares of the scene's size


@dataclass(frozen=True)
class Views:
    """One scene in a module of a display and before an ordinary camera; its size, world units."""

    module: Buffers
    camera: Buffers
    size: float


@dataclass(frozen=True)
class Setting:
    """One row of the table.

    Attributes
    ----------
    name : str
        Estimator and number of samples.
    run : callable
        The call that is timed, of ``Views``.
    again : tuple of str
        Stages that are listed for this setting although another setting has listed one of that name.
    whole : bool
        Whether it is an estimator's whole call, and not only there for its stages.
    """

    name: str
    run: Callable[[Views], Any]
    again: tuple[str, ...] = ()
    whole: bool = True


def gallery() -> Views:
    """The default scene in the default display, and before a camera."""
    mesh = builtin_scene()
    seen = []
    for view in (module_views(mesh, find_display("virtual"))[0], Camera.looking_at(mesh.bounds).view(WIDTH, HEIGHT)):
        gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric")
        seen.append(Buffers.of(gbuffer, view))
    return Views(*seen, diagonal(mesh))


def relief(width: int = WIDTH, height: int = HEIGHT) -> Views:
    """A wavy sheet that fills the textures, so that no texel can be skipped."""
    display = find_display("virtual")
    display = replace(display, modules=(replace(display.modules[0], width=width, height=height),))
    module = display.view(0, np.diag([1.0, 1.0, -1.0, 0.0])[:3])
    camera = Camera.looking_at(builtin_scene().bounds).view(width, height)
    return Views(_module_sheet(module), _camera_sheet(camera), 1.0)


def _module_sheet(view: View) -> Buffers:
    width = view.width
    height = view.height
    j, i = np.mgrid[0:height, 0:width]
    x = (i + 0.5 - width / 2) / width
    y = (height / 2 - j - 0.5) / width
    z = 0.05 * np.sin(40 * x) * np.sin(30 * y)
    # The point of each texel's ray at depth -z: the flat forms with m = (0, 0, 0.7), observers at -2.
    positions = np.stack([x * (0.7 + z) / 0.7, y * (2.0 - z) / 2.0, z], axis=-1).astype(np.float32)
    slopes = np.stack([-2 * np.cos(40 * x) * np.sin(30 * y), -1.5 * np.sin(40 * x) * np.cos(30 * y), 1 + 0 * x], -1)
    normals = (slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)).astype(np.float32)
    return Buffers(view, (-z).astype(np.float32), positions, normals)


def _camera_sheet(view: View) -> Buffers:
    near, far = view.lens[4:6]
    v, u = np.mgrid[: view.height, : view.width] / 100.0
    z = 0.5 * (near + far) * (1 + 0.02 * np.sin(3 * u) * np.sin(4 * v))
    depth = (far / (far - near) * (1 - near / z)).astype(np.float32)
    positions = np.zeros((view.height, view.width, 3), np.float32)  # estimators of depth alone do not read them
    return Buffers(view, depth, positions, positions)


@cache
def _turned(buffers: Buffers) -> Buffers:
    """Textures with the turns that SAO and Alchemy have, made once: no estimator makes them."""
    return buffers.turned("sao-hash")


def _module(name: str, views: Views, **parameters: Any) -> Any:
    return estimate(name, views.module, RADIUS * views.size, **parameters)


def _samples(name: str, domain: str, n: int, views: Views, **parameters: Any) -> Any:
    table = repulsion_table(domain, n)
    return estimate(name, views.module, RADIUS * views.size, table.points, table.weights, **parameters)


def _alchemy(views: Views) -> Any:
    return estimate("alchemy", _turned(views.module), RADIUS * views.size)


def _oriented(views: Views) -> Any:
    return estimate("oriented-hemisphere", _turned(views.module), RADIUS * views.size)


def _lf_camera(views: Views) -> Any:
    return estimate("lf", views.camera, RADIUS * views.size)


def _sao(views: Views, name: str = "sao") -> Any:
    """A form of SAO before the camera."""
    return estimate(name, _turned(views.camera), SAO_RADIUS * views.size)


def _sao_module(views: Views) -> Any:
    """SAO on a display's module: positions and depth are read, not rebuilt."""
    return estimate("sao", _turned(views.module), SAO_RADIUS * views.size)


def _filter(mip: str, views: Views) -> Any:
    z = linear_z(views.camera)
    return hierarchy.z_hierarchy(z, mip, 5, texel_rays(views.camera.view, z.dtype).origin)


def _directions(views: Views) -> Any:
    """The viewing directions of a module and of a camera, which textures that are read again keep."""
    return [Buffers(b.view, b.depth, b.positions).directions for b in (views.module, views.camera)]


def _merged(views: Views) -> Any:
    """LF's last passes: the largest of five radii and the blur."""
    layers = np.stack([_module("lf", views).texture] * 5)
    return blur(merge(layers), 1.0)


SETTINGS = (
    Setting("lf, 8", partial(_module, "lf")),
    Setting("lf, 8, camera", _lf_camera),
    Setting("point, 8", partial(_module, "point"), ("points with options",)),
    Setting("hemisphere, 8", partial(_module, "hemisphere"), ("points with options",)),
    Setting("alchemy, 12", _alchemy),
    Setting("oriented-hemisphere, 64", _oriented),
    Setting("vo-lines, 5", partial(_samples, "vo-lines", "disk", 5)),
    Setting("vo-lines, 9", partial(_samples, "vo-lines", "disk", 9), ("VO lines",)),
    Setting("vo-lines-normal, 5", partial(_samples, "vo-lines-normal", "disk", 5), ("VO lines",)),
    Setting("vo-lines, 5, two radii", partial(_samples, "vo-lines", "disk", 5, second=0.25)),
    Setting("vo-points, 12", partial(_samples, "vo-points", "ball", 12)),
    Setting("vo-points, 33", partial(_samples, "vo-points", "ball", 33), ("VO points",)),
    Setting("vo-points-normal, 12", partial(_samples, "vo-points-normal", "ball", 12), ("VO points",)),
    Setting("vo-area, 1", partial(_module, "vo-area"), ("VO area",)),
    Setting("hbao, 8 x 8", partial(_module, "hbao")),
    Setting("gtao, 4 x 2 x 8", partial(_module, "gtao")),
    Setting("visibility-bitmask, 4 x 2 x 8", partial(_module, "visibility-bitmask")),
    Setting("multiresolution", partial(_module, "multiresolution")),
    Setting("viewing directions", _directions, (), False),
    Setting("sao, 9", _sao),
    Setting("sao-equation-1, 9", partial(_sao, name="sao-equation-1"), ("SAO taps",)),
    Setting("sao, 9, module", _sao_module, ("face normals", "SAO taps")),
    *(
        Setting(f"filter {mip}", partial(_filter, mip), ("z hierarchy",), False)
        for mip in hierarchy.FILTERS
        if mip != "none"
    ),
    Setting("merge and blur", _merged, (), False),
)
