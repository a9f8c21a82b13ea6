"""Planted bugs: every one is rejected, and the verdict names the stage in which it was planted.

Here are those that no single change of the reference explains, and one or two a stage; ``test_diagnosis`` has more.
A renderer here is this program's passes with one thing wrong, on a wall and a block seen by the second of two modules,
14 x 14 texels; a bug that needs another scene to show brings its own. Its arithmetic is float32, so all that the bounds
allow it they would allow anybody.
"""

import functools
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from lfssao import Display, Mesh, Module, Paint, RayCaster, Settings, WorldToImage, fit_roi, make_samples, render_view
from lfssao.ao import post, ssao
from lfssao.files.srgb import to_codes
from lfssao.optics.kernels import projection as kinds
from lfssao.rendering.manifest import describe_settings, describe_view
from lfssao.verify.bounds.depth import color_bounds, depth_bounds, displaced
from lfssao.verify.case import Case
from lfssao.verify.compare.view_case import view_case
from lfssao.verify.judge import judge
from lfssao.verify.verdict import Verdict

SIZE = 14
ROI = ((-0.3, -0.3, -0.2), (0.3, 0.3, 0.2))
DISPLAY = Display(
    "small", 0.6, 0.6, 0.15, -2.0, (Module(0.1, 0, 0.8, SIZE, SIZE), Module(0.35, 0, 0.8, SIZE, SIZE)), ROI
)


def wall_and_block():
    """A slanted wall that fills the upper part of the view, and a block in front of it; a colour a vertex."""
    wall = [(-3, -1.2, -0.7), (3, -1.2, -1.4), (3, 4, -1.9), (-3, 4, -1.2)]
    block = [(x, y, z) for x in (-0.9, 0.8) for y in (-0.8, 0.7) for z in (-0.6, 0.4)]
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(0, 1, 2), (0, 2, 3)] + [tuple(4 + n for n in t) for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    colors = np.random.default_rng(3).uniform(0.2, 0.9, (12, 3)).astype(np.float32)
    return Mesh(np.array(wall + block, float), np.array(faces, np.int32), Paint.from_vertex_colors(colors, len(faces)))


FIT = fit_roi(np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]]), ROI)


def stages(made):
    """The textures of a view by name, in the order of the passes."""
    seen = made.gbuffer
    layers = {f"ao_{k + 1}": texture for k, texture in enumerate(made.ao)}
    first = {"depth": seen.depth, "positions": seen.positions, "color": seen.color}
    return {**first, **layers, "merged": made.merged, "blurred": made.blurred, "shaded": made.shaded}


def case_of(textures, settings, **from_mesh):
    described = view_case(Path(), {"settings": describe_settings(settings)}, {"view": describe_view(textures.view)})
    return replace(described, outputs=stages(textures), bounds=from_mesh)


def verdicts(mine, case, model="shader"):
    return {name: judged.verdict for name, judged in judge(mine, case, model).items()}


def failing(mine, case, model="shader"):
    """The stages that are not accepted, in the order of the passes."""
    return [name for name, verdict in verdicts(mine, case, model).items() if verdict.code]


@dataclass(frozen=True)
class Scene:
    """A renderer's inputs, and the case with the textures that are right."""

    caster: RayCaster
    view: object
    settings: Settings
    case: Case

    @property
    def right(self):
        return self.case.outputs

    @property
    def layers(self):
        return np.stack([self.right["ao_1"], self.right["ao_2"]])

    @property
    def surface(self):
        return self.right["depth"] < np.inf


def scene_of(mesh, view, settings):
    caster = RayCaster(mesh, view.cast_from_world)
    textures = render_view(caster, view, settings)
    from_mesh = {"depth": depth_bounds(caster, view), "color": color_bounds(caster, view)}
    return Scene(caster, view, settings, case_of(textures, settings, **from_mesh))


@functools.cache
def small_scene():
    table = make_samples("latin", 8, 1, 0.3, 1.0)
    return scene_of(
        wall_and_block(), DISPLAY.view(1, FIT), Settings(radii=(0.5, 0.9), samples=table, blur=0.8, rotation="none")
    )


def seen_by(scene, view, mesh=None):
    """All stages of a renderer that looks from another view, or at another mesh, but is right otherwise."""
    caster = scene.caster if mesh is None else RayCaster(mesh, view.cast_from_world)
    return stages(render_view(caster, view, scene.settings))


def remade(scene, mapping=None, **wrong):
    """Stages of a renderer with another mapping of AO and these textures, but whose later ones are right for them."""
    seen = {name: scene.right[name] for name in ("depth", "positions", "color")}
    made = seen | {name: np.ascontiguousarray(texture, np.float32) for name, texture in wrong.items()}
    given = made["depth"], made["positions"], mapping or scene.view.world_to_image, scene.settings.samples
    for number, radius in enumerate(scene.settings.radii, start=1):
        if f"ao_{number}" not in made:
            made[f"ao_{number}"] = ssao.algorithm2(*given, radius).texture
    made = {"merged": post.merge([made["ao_1"], made["ao_2"]]), **made}
    made = {"blurred": post.blur(made["merged"], scene.settings.blur), **made}
    return {"shaded": post.shade(made["color"], made["blurred"]), **made}


def with_ao(scene, layers):
    return remade(scene, ao_1=layers[0], ao_2=layers[1])


def nearest(depth, u, v):
    """The surface of the texel that an image point lies in; None outside the texture."""
    row = math.floor(v)
    column = math.floor(u)
    return depth[row, column] if 0 <= row < len(depth) and 0 <= column < depth.shape[1] else None


def own_ao(scene, look_up=nearest):
    """AO by a plain loop in float32 with one line replaced."""
    projection = scene.view.world_to_image.as_type(np.float32)
    depth = scene.right["depth"]
    layers = []
    for radius in scene.settings.radii:
        offsets = (radius * scene.settings.samples).astype(np.float32)
        out = np.zeros_like(depth)
        for j, i in np.argwhere(depth < np.inf):
            for o in offsets:
                u, v, z, valid = kinds.world_to_image(projection, *(scene.right["positions"][j, i] + o))
                surface = look_up(depth, u, v)
                out[j, i] += valid and surface is not None and surface < z
        layers.append(out / np.float32(len(offsets)))
    return with_ao(scene, layers)


def test_a_renderer_without_a_bug_is_accepted():
    """The reference, and a plain loop that adds before it multiplies."""
    scene = small_scene()
    assert failing(scene.right, scene.case, "strict") == []
    for mine in (scene.right, own_ao(scene), remade(scene)):
        found = verdicts(mine, scene.case)
        assert set(found.values()) <= {Verdict.EQUAL_BITS, Verdict.INSIDE}
        assert list(found) == list(scene.right)
    assert 0 < (~scene.surface).sum() < scene.surface.sum()
    assert all(len(np.unique(layer)) > 5 for layer in scene.layers)


def back_faces_only(scene):
    """Front faces of the block culled: its far sides are seen."""
    mesh = wall_and_block()
    keep = [k for k in range(len(mesh.faces)) if k not in (12, 13)]
    paint = replace(mesh.paint, face_material=mesh.paint.face_material[keep])
    return seen_by(scene, scene.view, replace(mesh, faces=mesh.faces[keep], paint=paint))


def pinhole_for_two_slits(scene):
    """Both coordinates divided by the distance from the module."""
    m = scene.view.world_to_image.numbers.copy()
    m_z = m[12]
    z_o = m[13]
    m[4:8] *= -m_z / z_o  # so that points on the screen still land where they should, mirrored denominators aside
    m[13] = -m_z
    return remade(scene, mapping=WorldToImage(kinds.CROSSED_SLITS, m))


def bilinear(depth, u, v):
    """As a texture with a linear filter is read."""
    if nearest(depth, u, v) is None:
        return None
    with np.errstate(invalid="ignore"):
        return map_coordinates(depth, ([v - 0.5], [u - 0.5]), order=1, mode="nearest")[0]


# The textures of each wrong renderer, by the stage that must be named.
BUGS = {
    "depth": {
        "hundredth_texel_shift": lambda s: seen_by(s, displaced(s.view, 0.01, 0.0)),
        "observer_too_high": lambda s: seen_by(s, replace(DISPLAY, observer_height=0.2).view(1, FIT)),
        "background_at_zero": lambda s: remade(s, depth=np.where(s.surface, s.right["depth"], 0)),
        "back_faces_only": back_faces_only,
    },
    "positions": {
        "positions_of_the_next_texel": lambda s: remade(s, positions=np.roll(s.right["positions"], -1, axis=1)),
        "positions_zero_without_surface": lambda s: remade(
            s, positions=np.where(s.surface[..., None], s.right["positions"], 0)
        ),
    },
    "color": {
        # SRGB codes taken for linear light.
        "color_not_decoded": lambda s: remade(s, color=to_codes(s.right["color"]) / 255),
    },
    "ao_1": {
        "pinhole_for_two_slits": pinhole_for_two_slits,
        "look_up_bilinear": lambda s: own_ao(s, bilinear),
        "background_occluded": lambda s: with_ao(s, np.where(s.surface, s.layers, 1)),
        "radii_exchanged": lambda s: with_ao(s, s.layers[::-1]),
    },
    "ao_2": {
        "second_radius_is_the_first": lambda s: with_ao(s, s.layers[[0, 0]]),
    },
    "merged": {
        "sum_for_maximum": lambda s: remade(s, merged=s.layers.sum(axis=0)),
    },
    "blurred": {
        "blur_of_the_first_radius": lambda s: remade(s, blurred=post.blur(s.layers[0], s.settings.blur)),
    },
    "shaded": {
        "occlusion_applied_twice": lambda s: remade(s, shaded=post.shade(s.right["shaded"], s.right["blurred"])),
    },
}
PLANTED = [(stage, name) for stage, bugs in BUGS.items() for name in bugs]


@pytest.mark.parametrize(("stage", "name"), PLANTED)
def test_every_bug_is_named_by_the_stage_that_it_was_planted_in(stage, name):
    scene = small_scene()
    found = failing(BUGS[stage][name](scene), scene.case)
    assert found[0] == stage
    if stage == "ao_1":  # whatever is made of wrong AO is right
        assert set(found) <= {"ao_1", "ao_2"}
    if stage not in ("depth", "positions", "ao_1"):  # one error is named once; these are textures others must fit
        assert found == [stage]


def test_missing_stages_and_other_sizes_are_failures_and_later_stages_are_judged_on_the_reference():
    scene = small_scene()
    right = scene.right
    found = verdicts({name: texture for name, texture in right.items() if name != "merged"}, scene.case)
    assert found["merged"] is Verdict.MISSING
    assert found["blurred"] is found["shaded"] is Verdict.EQUAL_BITS
    found = verdicts(right | {"depth": right["depth"][:-1]}, scene.case)
    assert found["depth"] is Verdict.MISMATCH
    assert found["ao_1"] is Verdict.EQUAL_BITS
    holed = right["depth"].copy()
    holed[0, 0] = np.nan
    assert failing(right | {"depth": holed}, scene.case)[0] == "depth"
    assert failing({}, scene.case) == list(right)


@pytest.mark.parametrize("guard", [0, 3])
def test_a_guard_band_and_no_mesh_are_no_bugs(guard):
    scene = small_scene()
    view = DISPLAY.view(1, FIT, guard)
    textures = render_view(scene.caster, view, scene.settings)
    case = case_of(textures, scene.settings)
    for model in ("shader", "sampler", "nearest", "strict"):
        assert set(verdicts(stages(textures), case, model).values()) == {Verdict.EQUAL_BITS}
    up = np.where(textures.blurred > 0, np.nextafter(textures.blurred, np.float32(2)), textures.blurred)
    raised = stages(textures) | {"blurred": up}
    assert failing(raised, case, "strict")[0] == "blurred"
    for name in ("depth", "positions", "color"):
        right = stages(textures)[name]
        moved = np.where((right > 0) & (right < np.inf), np.nextafter(right, np.float32(9)), right)
        assert failing(stages(textures) | {name: moved}, case, "strict")[0] == name
    assert verdicts(raised, case)["blurred"] is Verdict.INSIDE
