from . import samples, testing, viz
from .ao import reference
from .ao.bent import bent_normals
from .ao.estimators.own import read_estimator
from .ao.estimators.registry import estimate
from .ao.ground_truth import GroundTruth, Occluders, ray_cast_occlusion
from .ao.post import Light, blur, merge, shade
from .ao.ssao import Occlusion, algorithm1, algorithm2
from .ao.textures import Buffers
from .errors import InputError, InputWarning, LfssaoError, MissingPackageError
from .files.exr import Part, read_exr, write_exr
from .gbuffer.caster import GBuffer, RayCaster
from .optics.camera import Camera
from .optics.display import Display, Module, fit_roi
from .optics.display_file import display_names, display_text, find_display, find_views, parse_display
from .optics.lenslet import LensletDisplay
from .optics.quilt import Quilt
from .optics.view import View, WorldToImage
from .rendering.page.page import eye_page
from .rendering.passes import Rendered, render, render_view
from .rendering.settings import Settings, default_radii
from .rendering.textures import Textures
from .rendering.viewer import LightField, Photograph, eye_point, eye_range, eye_view
from .rendering.views import module_views
from .samples import make_samples, square_points
from .scene.builtin import builtin_scene, find_scene
from .scene.load import load_scene
from .scene.mesh import Mesh, Paint
from .verify.case import Case
from .verify.compare.compare import compare
from .verify.compare.report import Report

__version__: str
__all__ = [
    "Buffers", "Camera", "Case", "Display", "GBuffer", "GroundTruth", "InputError", "InputWarning", "LensletDisplay",
    "LfssaoError", "Light", "LightField", "Mesh", "MissingPackageError", "Module", "Occluders", "Occlusion", "Paint",
    "Part", "Photograph", "Quilt", "RayCaster", "Rendered", "Report", "Settings", "Textures", "View", "WorldToImage",
    "algorithm1", "algorithm2", "bent_normals", "blur", "builtin_scene", "compare", "default_radii", "display_names",
    "display_text", "estimate", "eye_page", "eye_point", "eye_range", "eye_view", "find_display", "find_scene",
    "find_views", "fit_roi", "load_scene", "make_samples", "merge", "module_views", "parse_display",
    "ray_cast_occlusion", "read_estimator", "read_exr", "reference", "render", "render_view", "samples", "shade",
    "square_points", "testing", "viz", "write_exr",
]  # fmt: skip
