"""The mesh of a reference: it gives bounds of depth and colour in place of estimates."""

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numba import config

from lfssao.errors import InputError, MissingPackageError
from lfssao.gbuffer.caster import RayCaster
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.manifest import describe_scene, view_of
from lfssao.scene.builtin import BUILTIN, find_scene
from lfssao.scene.mesh import Mesh, moved
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.depth import color_bounds, depth_bounds
from lfssao.verify.bounds.error_model import ErrorModel


class Surface:
    """The scene of a rendered folder, read when it is first needed: ``file``, or the embedded scene in the manifest."""

    def __init__(self, path: Path, manifest: dict[str, Any], file: str | None) -> None:
        self._path = path
        self._manifest = manifest
        self._file = file
        self._caster: RayCaster | None = None  # all views of a folder share their cast space

    @cached_property
    def mesh(self) -> Mesh | None:
        """The mesh in the folder's frame; None if it is not available, InputError if ``file`` was not rendered."""
        with reading_manifest(self._path):
            scene = self._manifest["scene"]
            frame = self._manifest.get("frame")
            if not isinstance(scene["name"], str):
                raise TypeError(f"the scene's name is {scene['name']!r}")
            name = self._file or scene["name"]
            if self._file is None and name not in BUILTIN:
                return None
            mesh = find_scene(name)
            found = describe_scene(mesh)
            if any(found[part] != scene[part] for part in ("vertices_sha256", "faces_sha256")):
                if self._file is None:
                    return None
                described = f"the scene that the reference was rendered of, {scene['name']}"
                raise InputError(f"--mesh: {name} is not {described}")
            self._has_colors = mesh.paint is not None and found["paint_sha256"] == scene["paint_sha256"]
            return mesh if frame is None else moved(mesh, np.reshape(frame["world_from_scene"], (3, 4)))

    def caster(self, entry: dict[str, Any]) -> RayCaster | None:
        """A caster of the mesh for a view; None if the mesh or the caster's package is not available."""
        with reading_manifest(self._path):
            if self.mesh is None:
                return None
            try:
                threads = int(config.NUMBA_NUM_THREADS)
                view = view_of(entry["name"], entry["view"])
                caster = self._caster or RayCaster(self.mesh, view.cast_from_world, threads)
                self._caster = caster.of_view(view)
            except MissingPackageError:
                return None
            return self._caster

    def bounds(self, entry: dict[str, Any], shape: tuple[int, ...], model: ErrorModel) -> dict[str, Bounds]:
        """Bounds of a view's depth, of shape ``shape``, and colour; empty without a mesh or a caster."""
        with reading_manifest(self._path):
            if self.mesh is None or shape != (entry["view"]["height"], entry["view"]["width"]):
                return {}
            view = view_of(entry["name"], entry["view"])
            caster = self.caster(entry)
            if caster is None:
                return {}
            bounds = {"depth": depth_bounds(caster, view, model)}
            if self._has_colors:
                chosen = self._manifest["settings"]["color_filter"]
                bounds["color"] = color_bounds(caster, view, chosen, model)
            return bounds
