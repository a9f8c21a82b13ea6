"""Parts of a job's manifest: descriptions of everything that its textures depend on, and digests."""

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao import __version__
from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.post import blur_weights
from lfssao.optics.display import Display, Module
from lfssao.optics.kernels.projection import DISPLAY, MATRIX
from lfssao.optics.view import KINDS, View, WorldToImage, finite_numbers
from lfssao.rendering.settings import Settings
from lfssao.scene.mesh import Mesh

FORMAT = 1
MANIFEST = "manifest.json"
PANEL = "panel.exr"  # of a lenslet display
# Angles or vectors of texels, where they are no rotation that has a name, by the names of the setting 'rotation'.
NOISE = {"angles": "angles.npy", "vectors": "vectors.npy"}
_PACKAGES = ("numpy", "numba", "llvmlite", "trimesh", "embreex", "OpenImageIO", "pillow")


def digest(array: NDArray[Any]) -> str:
    """SHA-256 of an array's numbers, little-endian, row by row; hexadecimal."""
    return hashlib.sha256(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).data).hexdigest()


def short_digest(value: Any) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of a value of JSON."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:16]


def describe_scene(mesh: Mesh) -> dict[str, Any]:
    """Name, sizes and digests of a mesh, one digest of all arrays of its colours."""
    paint = mesh.paint
    sums: list[Any] | None = None
    if paint is not None:
        arrays = [paint.factors, paint.face_material, paint.uv, paint.vertex_colors, *paint.textures]
        digests = {key: digest(array) for key, array in {id(a): a for a in arrays if a is not None}.items()}
        sums = [None if array is None else [list(array.shape), digests[id(array)]] for array in arrays]
        sums += [] if paint.samplers is None else [paint.samplers]  # as before where nothing but repeats
    return {
        "name": mesh.name,
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "degenerate_faces_left_out": mesh.degenerate,
        "notes": list(mesh.notes),
        "colored": mesh.paint is not None,
        "bounds": mesh.bounds.tolist(),
        "vertices_sha256": digest(mesh.vertices),
        "faces_sha256": digest(mesh.faces),
        "normals_sha256": None if mesh.normals is None else digest(mesh.normals),
        "paint_sha256": None if sums is None else hashlib.sha256(json.dumps(sums).encode()).hexdigest(),
    }


def describe_settings(settings: Settings) -> dict[str, Any]:
    """All settings of the AO passes, the sample table included; noise of one's own is in a file of its own."""
    angles = settings.rotation if isinstance(settings.rotation, np.ndarray) else None
    text = find_estimator(settings.estimator).text
    return {
        "estimator": settings.estimator,
        **({"estimator_sha256": text} if text else {}),  # of one's own
        "parameters": dict(settings.parameters),
        "units": settings.units,
        "neighbours": settings.neighbours,
        "radii": list(settings.radii),
        "samples": None if settings.samples is None else np.asarray(settings.samples).tolist(),
        "weights": None if settings.weights is None else np.asarray(settings.weights).tolist(),
        "rotation": settings.rotation if angles is None else name_of_noise(angles),
        "angles_sha256": None if angles is None else digest(angles),
        "rotation_seed": settings.rotation_seed,
        "blur_sigma": settings.blur,
        "blur_weights": blur_weights(settings.blur).tolist(),
        "merge": "maximum",
        "color_filter": settings.color_filter,
        "normals": settings.normals,
        "layers": list(settings.kept),
        "caster": settings.caster,
        **({} if settings.light is None else {"light": asdict(settings.light)}),
    }


def name_of_noise(noise: NDArray[Any]) -> str:
    """Return the name of ``NOISE`` of angles, (h, w), or vectors, (h, w, 2 or 3)."""
    return "angles" if noise.ndim == 2 else "vectors"


def describe_view(view: View) -> dict[str, Any]:
    """Return the numbers of one view's mapping, in the order of ``lfssao.optics.kernels.projection``."""
    return {
        "width": view.width,
        "height": view.height,
        "guard": view.guard,
        "depth": view.depth_kind,
        "cast_from_world": view.cast_from_world.tolist(),
        "world_from_cast": view.world_from_cast.tolist(),
        "lens": view.lens.tolist(),
        "world_to_image_kind": KINDS[view.world_to_image.kind],
        "world_to_image": view.world_to_image.numbers.tolist(),
        "screen_to_world": None if view.screen_to_world is None else view.screen_to_world.tolist(),
    }


def view_of(name: str, described: Mapping[str, Any]) -> View:
    """Return the view of a name that ``describe_view`` described; KeyError, TypeError or ValueError if it did not."""
    kind = KINDS.index(described["world_to_image_kind"])
    back = described["screen_to_world"]
    sizes = {"lens": (32 if kind == DISPLAY else 8,), "world_to_image": (44 if kind == DISPLAY else 16,)}
    shapes: dict[str, tuple[int, ...]] = {**sizes, "cast_from_world": (3, 4), "world_from_cast": (3, 4)}
    shapes |= {"screen_to_world": (4, 4)} if back is not None else {}
    if (back is None) == (kind == MATRIX):
        raise ValueError("screen_to_world does not fit world_to_image")
    numbers: dict[str, Any] = {key: finite_numbers(key, described[key], *shape) for key, shape in shapes.items()}
    mapping = WorldToImage(kind, numbers.pop("world_to_image"))
    size = {key: int(described[key]) for key in ("width", "height", "guard")}
    if not 0 <= 2 * size["guard"] < min(size["width"], size["height"]):
        raise ValueError("the guard band is out of range")
    more = {"screen_to_world": None, "depth_kind": str(described["depth"]), "world_to_image": mapping}
    return View(name, **{**more, **numbers, **size})


def describe_machine(threads: int, command: Sequence[str] = ()) -> dict[str, Any]:
    """Return versions of all packages, the processor, the number of threads, and the command if there was one."""
    return {
        "lfssao": __version__,
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "processor": _processor(),
        "threads": threads,
        "command": list(command),
    }


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    """Return the processor's name from /proc/cpuinfo, else from Python."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "")


def display_of(values: dict[str, Any], entries: dict[int, dict[str, Any]]) -> Display:
    """The display of a manifest's ``values``, in the resolution of its views, the ``entries`` of modules by number."""
    modules = [Module(**{**m, "homography": m["homography"] and tuple(m["homography"])}) for m in values["modules"]]
    display = Display(**{**values, "roi": tuple(map(tuple, values["roi"])), "modules": tuple(modules)})
    if not entries or not set(entries) <= set(range(len(modules))):
        raise ValueError(f"views are not modules of {display.name}: {sorted(entries)}")
    guards = {k: 2 * e["view"].get("guard", 0) for k, e in entries.items()}
    sizes = {k: (e["view"]["width"] - guards[k], e["view"]["height"] - guards[k]) for k, e in entries.items()}
    if any(sizes[k] != (display.modules[k].width, display.modules[k].height) for k in sizes):
        if len(set(sizes.values())) > 1:
            raise ValueError("the sizes of its views are not those of the display's modules")
        display = display.with_resolution(*next(iter(sizes.values())))
    return display
