"""VTK's SSAO pass by pyvista, off screen, on the same scene and camera as our hemisphere estimator."""

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from math import atan, degrees, dist
from typing import TYPE_CHECKING, Any

import numpy as np

from lfssao.bench.sampling_error import rmse
from lfssao.bench.times import Times, turns
from lfssao.camera import Camera
from lfssao.errors import MissingPackageError
from lfssao.estimators.buffers import Buffers, Texture
from lfssao.estimators.registry import estimate
from lfssao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal
from lfssao.samples.registry import sample_set
from lfssao.scene.builtin import builtin_scene
from lfssao.scene.mesh import Mesh

if TYPE_CHECKING:
    from pyvista import Plotter

_SIZE = (512, 384)
_SAMPLES = 32
_RADIUS = 0.02  # share of the scene's diagonal
_EVERY = 4  # texel, of each row and column, is compared with ray-cast occlusion


def measure(repeats: int, threads: int) -> dict[str, Any]:
    """VTK draws the scene with and without the pass; the pass' time is the difference, turn by turn."""
    mesh = builtin_scene()
    camera, radius = Camera.looking_at(mesh.bounds), _RADIUS * diagonal(mesh)
    without, with_pass = _plotter(mesh, camera), _plotter(mesh, camera)
    with_pass.enable_ssao(radius=radius, bias=0.0, kernel_size=_SAMPLES, blur=False)
    view = camera.view(*_SIZE)
    buffers = Buffers.of(RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric"), view)
    points = sample_set("ball", "latin", _SAMPLES, 0).points

    def ours() -> Texture:
        return estimate("hemisphere", buffers, radius, points).texture

    def drawn(plotter: "Plotter") -> None:
        plotter.render_window.Render()
        plotter.render_window.WaitForCompletion()

    runs: dict[str, Callable[[], object]]
    runs = {"lfssao": ours, "without": partial(drawn, without), "with": partial(drawn, with_pass)}
    measured = turns(runs, repeats)
    first, warm = {n: each[0] for n, each in measured.items()}, {n: each[1] for n, each in measured.items()}
    truth, there = _truth(mesh, buffers, radius)
    times = {
        "lfssao": Times.of(warm["lfssao"], first["lfssao"]),
        "vtk": Times.of(warm["with"] - warm["without"], first["with"] - first["without"]),
        "vtk, whole picture": Times.of(warm["with"], first["with"]),
    }
    ours_ms = times["lfssao"].median
    rows = {name: {**asdict(row), "times_lfssao": row.median / ours_ms} for name, row in times.items()}
    for name, texture in (("lfssao", ours()), ("vtk", _occlusion(with_pass))):
        rows[name]["model"] = rmse(texture[there].astype(np.float64), truth[there])
    return {"rows": rows, "samples": _SAMPLES, "of": "the hemisphere estimator, no blur"}


def _plotter(mesh: Mesh, camera: Camera) -> "Plotter":
    """A window off screen that shows the mesh white and unlit, drawn once."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingPackageError("pyvista is not installed: install lfssao[bench]") from error
    plotter = pyvista.Plotter(off_screen=True, window_size=list(_SIZE), lighting="none")
    plotter.render_window.SetMultiSamples(0)  # the pass switches it off, so that both pictures have one sample a texel
    plotter.set_background("white")
    plotter.add_mesh(pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces), color="white", lighting=False)
    seen = plotter.camera
    seen.position, seen.focal_point, seen.up = camera.eye, camera.target, camera.up
    seen.view_angle = degrees(2 * atan(camera.extent / 2 / dist(camera.eye, camera.target)))
    seen.clipping_range = (camera.near, camera.far)
    plotter.show(auto_close=False)
    return plotter


def _occlusion(plotter: "Plotter") -> Texture:
    """The picture of a white scene, as occlusion."""
    picture = np.asarray(plotter.screenshot(None, return_img=True))
    occlusion: Texture = 1 - picture[..., 0] / np.float32(255)
    return occlusion


def _truth(mesh: Mesh, buffers: Buffers, radius: float) -> tuple[Texture, Any]:
    """Ray-cast occlusion of some texels, and which."""
    chosen = np.zeros(buffers.depth.shape, bool)
    chosen[::_EVERY, ::_EVERY] = True
    depth = np.where(chosen, buffers.depth, np.float32(np.inf))
    truth = ray_cast_occlusion(Occluders(mesh), replace(buffers, depth=depth), radius, tolerance=0.01)
    return truth.texture, np.isfinite(depth)
