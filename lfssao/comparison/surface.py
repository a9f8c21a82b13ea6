"""The mesh that a reference was rendered of: with it the intervals of depth and colour are bounds and no estimates."""

from typing import TYPE_CHECKING, Any

import numpy as np

from lfssao.errors import InputError, MissingPackageError
from lfssao.matrix import Matrix
from lfssao.oracle.bounds import Bounds
from lfssao.oracle.depth import DepthBounds, color_bounds, depth_bounds
from lfssao.oracle.error_model import ErrorModel

if TYPE_CHECKING:
    from lfssao.raycast import RayCaster
    from lfssao.scene.mesh import Mesh
    from lfssao.view import View


class Surface:
    """The scene of a rendered folder.

    Parameters
    ----------
    mesh : Mesh
        The scene, where it stands in the folder's frame.
    manifest : dict
        The folder's.
    colored : bool
        Whether its colours, too, are those of the folder.
    """

    def __init__(self, mesh: "Mesh", manifest: dict[str, Any], colored: bool) -> None:
        self._mesh, self._manifest, self._colored = mesh, manifest, colored
        self._caster: RayCaster | None = None  # all views of a folder share their cast space

    @classmethod
    def of(cls, manifest: dict[str, Any], file: str | None) -> "Surface | None":
        """Load a mesh file or, where none is given, the embedded scene that the manifest names.

        Returns
        -------
        Surface or None
            None where no file is given and the scene is none of the embedded ones, or another version's.

        Raises
        ------
        InputError
            If the file cannot be read or is not the scene that the manifest describes.
        """
        from lfssao.frames import moved
        from lfssao.manifest import describe_scene
        from lfssao.scene.builtin import BUILTIN, builtin_scene
        from lfssao.scene.load import load_scene

        scene, frame = manifest["scene"], manifest.get("frame")
        if not isinstance(scene["name"], str):
            raise TypeError(f"the scene's name is {scene['name']!r}")
        if file is None and scene["name"] not in BUILTIN:
            return None
        mesh = builtin_scene(file or scene["name"]) if (file or scene["name"]) in BUILTIN else load_scene(str(file))
        found = describe_scene(mesh)
        if any(found[part] != scene[part] for part in ("vertices_sha256", "faces_sha256")):
            if file is None:
                return None
            raise InputError(f"--mesh: {file} is not the scene that the reference was rendered of, {scene['name']}")
        if frame is not None:
            mesh = moved(mesh, _affine(frame["world_from_scene"]))
        return cls(mesh, manifest, found["paint_sha256"] == scene["paint_sha256"])

    def bounds(self, entry: dict[str, Any], model: ErrorModel) -> tuple[DepthBounds, Bounds | None] | None:
        """Bounds of a view's depth and colour, the latter without guard band and None where there is none.

        None for both where rays cannot be cast here, or the view is not one that the manifest's numbers make again.
        """
        from numba import config

        from lfssao.raycast import RayCaster

        view = self._view(entry)
        if view is None:
            return None
        try:
            if self._caster is None:
                self._caster = RayCaster(self._mesh, view.cast_from_world, int(config.NUMBA_NUM_THREADS))
        except MissingPackageError:
            return None
        color = None
        if self._mesh.paint is not None and self._colored:
            chosen = self._manifest["settings"]["color_filter"]
            color = color_bounds(self._caster, view, chosen, model).crop(view.guard)
        return depth_bounds(self._caster, view, model), color

    def _view(self, entry: dict[str, Any]) -> "View | None":
        """The view of a manifest's entry."""
        from lfssao.camera import Camera
        from lfssao.rendered import display_of

        described = entry["view"]
        guard = described["guard"]
        if self._manifest["display"] is None:
            camera = Camera.looking_at(self._mesh.bounds, self._manifest["camera"])
            view = camera.view(described["width"] - 2 * guard, described["height"] - 2 * guard, guard)
        else:
            index = int(entry["name"].removeprefix("module_"))
            display = display_of(self._manifest["display"], {index: entry})
            view = display.view(index, _affine(described["cast_from_world"]), guard)
        return view if np.array_equal(view.world_to_image.numbers, described["world_to_image"]) else None


def _affine(values: Any) -> Matrix:
    matrix = np.array(values, np.float64)
    if matrix.shape != (3, 4):
        raise ValueError(f"an affine map has shape {matrix.shape}")
    return matrix
