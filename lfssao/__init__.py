"""Reference screen-space ambient occlusion for light field displays, with equal bits on every machine.

The names below are all there is to know for a start; each is described where it is defined. They are imported when
they are first used, so that ``import lfssao`` itself costs nothing.
"""

from typing import TYPE_CHECKING

from lfssao.core.late_names import late_names

if TYPE_CHECKING:
    from lfssao.ao import reference
    from lfssao.ao.estimators.registry import estimate
    from lfssao.ao.ground_truth import GroundTruth, Occluders, ray_cast_occlusion
    from lfssao.ao.post import blur, merge, shade
    from lfssao.ao.ssao import Occlusion, algorithm1, algorithm2
    from lfssao.ao.textures import Buffers
    from lfssao.errors import InputError, LfssaoError, MissingPackageError
    from lfssao.gbuffer.caster import GBuffer, RayCaster
    from lfssao.optics.camera import Camera
    from lfssao.optics.display import Display, Module, fit_roi
    from lfssao.optics.display_file import display_names, display_text, find_display, parse_display
    from lfssao.optics.view import View, WorldToImage
    from lfssao.rendering.exr import Part, read_exr, write_exr
    from lfssao.rendering.passes import Textures, render, render_view
    from lfssao.rendering.settings import Settings, default_radii
    from lfssao.rendering.viewer import LightField, Photograph, eye_point, eye_range, eye_view
    from lfssao.rendering.views import module_views
    from lfssao.samples import make_samples, square_points
    from lfssao.scene.builtin import builtin_scene, find_scene
    from lfssao.scene.load import load_scene
    from lfssao.scene.mesh import Mesh, Paint
    from lfssao.verify.compare.compare import compare
    from lfssao.verify.compare.report import Report

__version__ = "0.1.0"

__getattr__, __dir__ = late_names(
    __name__,
    {
        "ao": ("reference",),
        "optics.camera": ("Camera",),
        "verify.compare.compare": ("compare",),
        "verify.compare.report": ("Report",),
        "optics.display": ("Display", "Module", "fit_roi"),
        "optics.display_file": ("display_names", "display_text", "find_display", "parse_display"),
        "errors": ("InputError", "LfssaoError", "MissingPackageError"),
        "ao.textures": ("Buffers",),
        "ao.estimators.registry": ("estimate",),
        "rendering.exr": ("Part", "read_exr", "write_exr"),
        "ao.ground_truth": ("GroundTruth", "Occluders", "ray_cast_occlusion"),
        "ao.post": ("blur", "merge", "shade"),
        "ao.ssao": ("Occlusion", "algorithm1", "algorithm2"),
        "gbuffer.caster": ("GBuffer", "RayCaster"),
        "rendering.passes": ("Textures", "render", "render_view"),
        "rendering.settings": ("Settings", "default_radii"),
        "rendering.views": ("module_views",),
        "samples": ("make_samples", "square_points"),
        "scene.builtin": ("builtin_scene", "find_scene"),
        "scene.load": ("load_scene",),
        "scene.mesh": ("Mesh", "Paint"),
        "optics.view": ("View", "WorldToImage"),
        "rendering.viewer": ("LightField", "Photograph", "eye_point", "eye_range", "eye_view"),
    },
)

__all__ = [
    "Buffers", "Camera", "Display", "GBuffer", "GroundTruth", "InputError", "LfssaoError", "LightField", "Mesh",
    "MissingPackageError", "Module", "Occluders", "Occlusion", "Paint", "Part", "Photograph", "RayCaster", "Report",
    "Settings", "Textures", "View", "WorldToImage", "algorithm1", "algorithm2", "blur", "builtin_scene", "compare",
    "default_radii", "display_names", "display_text", "estimate", "eye_point", "eye_range", "eye_view",
    "find_display", "find_scene", "fit_roi", "load_scene", "make_samples", "merge", "module_views", "parse_display",
    "ray_cast_occlusion", "read_exr", "reference", "render", "render_view", "shade", "square_points", "write_exr",
]  # fmt: skip
