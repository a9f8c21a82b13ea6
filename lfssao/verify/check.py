"""Digests of small textures: a machine whose digests are the stored ones computes the same bits."""

import hashlib
import json
from collections.abc import Iterator
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import of_one_view
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.camera import Camera
from lfssao.optics.display_file import display_names, find_views
from lfssao.optics.view import View
from lfssao.rendering.passes import render_view
from lfssao.rendering.settings import Settings, default_radii
from lfssao.rendering.views import chosen_modules, module_views
from lfssao.samples import METHODS, ROTATIONS, sample_set, texel_turns
from lfssao.scene.builtin import builtin_scene

SIZE = 64, 48  # texels of a texture
PANEL = 720, 720  # texels of the texture of all lenses
_DIGESTS = files("lfssao.verify").joinpath("check.json")


def expected_digests() -> dict[str, str]:
    """The stored SHA-256 of each case's arrays, by the case's name."""
    digests: dict[str, str] = json.loads(_DIGESTS.read_text(encoding="utf-8"))
    return digests


def found_digests() -> Iterator[tuple[str, str]]:
    """Yield each case's name and the SHA-256 of the arrays that this machine computes.

    The cases are the statue through a module of each preset display, a view of each preset quilt, the middle lens of
    each preset panel, both cameras and each estimator, all sample sets of each domain, and all turns of texels.
    """
    mesh = builtin_scene("statue")
    settings = partial(Settings, default_radii(mesh), normals="smooth")
    for name in (*display_names(), *display_names("quilt")):
        (view,) = module_views(mesh, find_views(name).with_resolution(*SIZE), [0])
        yield f"display {name}", _digest(_textures(view, settings()))
    for name in display_names("lenslet"):
        display = find_views(name).with_resolution(*PANEL)
        (view,) = module_views(mesh, display, [chosen_modules(display, None)[-1] // 2])
        yield f"display {name}", _digest(_textures(view, settings()))
    for projection in ("perspective", "orthographic"):
        view = Camera.looking_at(mesh.bounds, projection).view(*SIZE)
        yield f"camera {projection}", _digest(_textures(view, settings()))
    (view,) = module_views(mesh, find_views("sample-a").with_resolution(*SIZE), [0])
    for name in of_one_view():
        yield f"estimator {name}", _digest(_textures(view, settings(estimator=name)))
    for domain, methods in METHODS.items():
        yield f"samples {domain}", _digest([sample_set(domain, method, 16, seed=4).points for method in methods])
    yield "turns", _digest([texel_turns(name, *SIZE, 4, np.dtype(np.float32)) for name in ROTATIONS])


def _textures(view: View, settings: Settings) -> list[NDArray[Any]]:
    """All textures of a view of the statue."""
    rendered = render_view(RayCaster(builtin_scene("statue"), view.cast_from_world), view, settings)
    gbuffer = rendered.gbuffer
    layers = (
        gbuffer.depth,
        gbuffer.positions,
        gbuffer.normals,
        gbuffer.color,
        *rendered.ao,
        rendered.merged,
        rendered.blurred,
        rendered.shaded,
    )
    return [layer for layer in layers if layer is not None]


def _digest(arrays: list[NDArray[Any]]) -> str:
    """SHA-256 of arrays' shapes, dtypes and little-endian bytes."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.shape} {array.dtype} ".encode())
        digest.update(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()
