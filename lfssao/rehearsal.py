"""A job in little, run once before its clock starts, so that all it calls is loaded, or on a first run compiled.

By itself that happens within the first views, one thing after the other: while the passes' kernels are loaded nothing
can be hashed, and while the hash's is, nothing written. Compiled code depends on the kinds of rays and textures and on
the settings, never on what is seen: a triangle in a texture of a few hundred texels does.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lfssao.camera import Camera
from lfssao.contact import contact_sheet, save_sheet, strip
from lfssao.display import Display, Module, fit_roi
from lfssao.exr_file import write_to
from lfssao.kernels import rays
from lfssao.neighbours import DepthCache
from lfssao.raycast import RayCaster
from lfssao.rendering import Textures, render_view
from lfssao.scene.mesh import Mesh
from lfssao.view import View
from lfssao.view_file import seal
from lfssao.view_plan import ViewPlan
from lfssao.window import Window
from lfssao.work import Item, Renderer, Work

STEPS = 3  # passes, digests, files

_WIDTH, _HEIGHT = 24, 18  # texels; more lines than a chunk of a file has
_PROJECTIONS = {rays.PERSPECTIVE: "perspective", rays.ORTHOGRAPHIC: "orthographic"}
_LAYERS = 40  # triangles, too many for each texel to be tried by their bounds


def rehearse(renderer: Renderer, items: Sequence[Item], together: int) -> Iterator[None]:
    """Run what a job will run, once, on textures of a few hundred texels; nothing is written anywhere.

    What only the job itself can find out is left to it: whether many samples are decided for whole tiles, and whatever
    differs from view to view. Of a job whose views see nothing all is.

    Parameters
    ----------
    renderer : Renderer
        The job's, which is asked how it casts its rays.
    items : sequence of Item
        What the job will render, at least one.
    together : int
        How many views are hashed together.

    Yields
    ------
    None
        ``STEPS`` times, after each step that is done; never where nothing is seen.
    """
    work = renderer.work
    caster = renderer.prepare(items[0])
    renderer.use_threads()
    pairs = [_little(work, caster, item) for item in _of_each_kind(work, items)]
    made = [(small, _textures(small, plan, caster.threads)) for small, plan in pairs]
    if not made:
        return
    yield
    small, textures = made[0]
    view, *_ = seal(small, [(Item(0, 0), textures, 0.0)] * together)
    yield
    write_to(io.BytesIO(), view.parts)
    seen = textures.gbuffer
    row = strip(seen.color, seen.triangle >= 0, textures.blurred, textures.shaded, _WIDTH)
    save_sheet(contact_sheet([(small.views[0].name, row)]), io.BytesIO())
    yield


def _of_each_kind(work: Work, items: Sequence[Item]) -> list[Item]:
    """An item of the first frame for each kind of rays, one that sees the scene, if there is any."""
    found: dict[int, Item] = {}
    for item in items:
        view = work.views[item.view]
        if item.frame == items[0].frame and view.ray_kind not in found and _plan(work, item).window.texels:
            found[view.ray_kind] = item
    return list(found.values())


def _plan(work: Work, item: Item) -> ViewPlan:
    view = work.views[item.view]
    if not work.plan:
        return ViewPlan.everything(view, work.settings)
    return ViewPlan.of(view, work.boxes[item.frame], work.settings)


def _little(work: Work, caster: RayCaster, item: Item) -> tuple[Work, ViewPlan]:
    """A small scene from a view of an item's kind, with the job's settings, and a plan that leaves out the same."""
    plan, view = _plan(work, item), work.views[item.view]
    mesh = _scene(work.mesh, 1 if caster.tries_few(view, plan.window) else _LAYERS)
    small = _view(view.ray_kind, mesh)
    # None is so small that its samples would be decided otherwise than in the job.
    radii = [0.1 * (radius > 0) * (1 + plan.same_as[k]) for k, radius in enumerate(work.settings.radii)]
    whole = Window.whole(small)
    # Where tiles may decide samples, nobody knows yet which kernel takes what is left.
    behind = (0,) * len(radii) if plan.in_tiles else plan.behind
    plan = replace(plan, window=whole, whole=whole, behind=behind, in_tiles=False)
    return Work(mesh, (small,), replace(work.settings, radii=tuple(radii)), Path(), {}, plan=work.plan), plan


def _scene(mesh: Mesh, layers: int) -> Mesh:
    """One triangle that turns its front to the viewers, so many times, with the paint and normals of a mesh's first."""
    corners = np.array([(-1.0, -1.0, -1.0), (1.0, -1.0, 0.0), (-1.0, 1.0, 1.0)])
    paint = mesh.paint
    if paint is not None:
        paint = replace(
            paint,
            face_material=np.repeat(paint.face_material[:1], layers),
            textures=tuple(None if texture is None else texture[:1, :1] for texture in paint.textures),
            uv=None if paint.uv is None else paint.uv[:3],
            vertex_colors=None if paint.vertex_colors is None else paint.vertex_colors[:3],
        )
    return Mesh(corners, np.array([(0, 1, 2)] * layers), paint, None if mesh.normals is None else mesh.normals[:3])


def _view(ray_kind: int, mesh: Mesh) -> View:
    """A small texture from a module or a camera whose rays are of a kind."""
    if ray_kind in _PROJECTIONS:
        return Camera.looking_at(mesh.bounds, _PROJECTIONS[ray_kind]).view(_WIDTH, _HEIGHT)
    display = Display(
        "rehearsal", 2.0, 2.0, 0.0, -8.0, (Module(0.0, 0.0, 4.0, _WIDTH, _HEIGHT),),
        ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)), screen_curvature=0.01 if ray_kind == rays.DISPLAY else 0.0,
    )  # fmt: skip
    return display.view(0, fit_roi(mesh.bounds, display.roi))


def _textures(work: Work, plan: ViewPlan, threads: int) -> Textures:
    """All passes of the little job's view, and the depth of modules beside it."""
    (view,), settings = work.views, work.settings
    caster = RayCaster(work.mesh, view.cast_from_world, threads)
    beside = DepthCache(caster, 1, work.plan).neighbours((view,) * settings.neighbours)
    return render_view(caster, view, settings, beside, plan)
