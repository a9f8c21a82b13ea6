"""Descriptions of another renderer's textures: a TOML file, a set of cameras, or a folder of ``render``."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lfssao.core.affine import Matrix, multiply, to_4x4
from lfssao.core.arguments import check_whole
from lfssao.errors import InputError, check_choice, errors_of
from lfssao.files.whole import read_json, read_text
from lfssao.optics.camera import view_of_matrix
from lfssao.optics.display import PHYSICAL_Z
from lfssao.optics.display_file import find_display, parse_toml
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, Slits
from lfssao.optics.view import KINDS, View, WorldToImage, finite_numbers, inverse_of
from lfssao.rendering.camera_set import MOST_BITS, camera_of_set
from lfssao.rendering.folder import load_manifest, reading_manifest
from lfssao.rendering.manifest import MANIFEST, view_of

CHOICES = {
    "rows": ("above", "below"),
    "depth_kind": ("image", "window", "window-gl", "reversed", "linear", "view-z", "radial", "logarithmic"),
    "positions_space": ("world", "view"),
    "normals_space": ("world", "view"),
    "normals_kind": ("xyz", "unorm", "octahedral", "octahedral unorm"),
}
CLIPS = ("opengl", "d3d", "vulkan", "opengl reversed", "d3d reversed", "vulkan reversed")
LAYOUTS = ("rows", "columns")
_RIGID = 1e-4
_LARGEST = float(np.finfo(np.float32).max)
_ENDLESS = 2.0**59  # near planes that a far plane is away which stands for none

Size = tuple[int, int, int]  # width and height of a texture, its guard band included, and the band's width, texels


@dataclass(frozen=True, eq=False)
class Description:
    """How another renderer's textures are read."""

    view: View  # how they were seen
    eye: Matrix | None = None  # (3, 4) float64, world to the renderer's own eye space, rigid; None: it is not known
    rows: str = "above"  # where row 0 is: 'above' or 'below', as OpenGL reads them back
    # 'image' (``View.depth_kind``); of a camera also 'window' (0 near, 1 far), 'window-gl' (-1 near, 1 far), 'reversed'
    # (1 near, 0 far), 'linear' (distance along the axis), 'view-z' (z of the eye space), 'radial' (distance from the
    # eye of a perspective camera) or 'logarithmic' (ln(C z + 1) / ln(C far + 1), z along the axis)
    depth_kind: str = "image"
    depth_constant: float | None = None  # C of 'logarithmic'
    background: float | None = None  # a depth, as it is stored, of texels without a surface, next to those of its kind
    # Bits of whole numbers, by whose largest they are divided; colours of such are sRGB
    depth_bits: int | None = None
    color_bits: int | None = None
    positions_space: str = "world"  # or 'view', the eye space
    normals_space: str = "world"  # as positions_space
    # 'xyz', 'unorm' (n / 2 + 1 / 2), or two numbers of -1 to 1, 'octahedral', or of 0 to 1, 'octahedral unorm'
    normals_kind: str = "xyz"

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            with errors_of(name):
                check_choice("choice", getattr(self, name), choices)
        if self.view.screen_to_world is None and self.depth_kind != "image":
            raise InputError(f"depth_kind is '{self.depth_kind}', a module's depth is 'image'")
        lens = self.view.lens
        if self.depth_kind == "radial" and lens[6]:
            raise InputError("depth_kind is 'radial', an orthographic camera has no eye to be away from")
        for name in ("depth_constant", "background"):
            if getattr(self, name) is not None:
                finite_numbers(name, getattr(self, name))
        for name in [each for each in ("depth_bits", "color_bits") if getattr(self, each) is not None]:
            check_whole(name, getattr(self, name), 1, MOST_BITS)
        if self.background is not None and not abs(self.background) <= _LARGEST:
            raise InputError(f"background is {self.background:g}, which no float32 is")
        if (self.depth_kind == "logarithmic") != (self.depth_constant is not None):
            raise InputError("depth_constant, C of ln(C z + 1) / ln(C far + 1), is of depth_kind 'logarithmic' alone")
        if self.depth_constant is not None:
            if not (self.depth_constant > 0 and lens[5] > 0):
                raise InputError(f"depth_constant is {self.depth_constant:g}, it and the far plane must be positive")
            if not lens[5] < _ENDLESS * abs(lens[4]):
                raise InputError("depth_kind is 'logarithmic', and the projection has no far plane")
        if self.eye is None and "view" in (self.positions_space, self.normals_space, self.depth_kind.partition("-")[0]):
            raise InputError("the renderer's eye space is not known: give kind = 'camera' with view and projection")


_FIELDS = tuple(field.name for field in fields(Description)[2:])  # that are keys of a file


def read_description(path: Path, name: str, size: Size) -> Description:
    """Return the description of textures of a size; InputError, with the file and the key, if a value is wrong.

    ``path`` is a folder that 'lfssao render' wrote, with a view ``name``; a JSON file of a set of cameras, with a
    camera ``name`` (``camera_of_set``); or a TOML file with the fields of ``Description`` and ``kind``: one of
    ``KINDS`` with the arguments of ``WorldToImage``'s method of that name, or

    - 'camera': ``view`` (world -> eye) and ``projection``, 4 x 4, rows as written for columns x, y, z, 1, or the
      transposes of these by ``layout`` 'columns', and ``clip``, one of ``CLIPS``: depth from -1 ('opengl') or 0 to 1, y
      up or ('vulkan') down;
    - 'module': ``display``, a preset or a TOML file, ``module``, its number, and ``physical_from_world``, 3 x 4;
    - 'folder': ``folder`` and ``name`` of a view of a rendered one.
    """
    if path.is_dir() or path.name == MANIFEST:
        return Description(_folder(size, str(path if path.is_dir() else path.parent), name))
    is_set = path.suffix.lower() == ".json"
    eye = None
    fields_of_file: dict[str, Any]
    values = read_json(path) if is_set else parse_toml(read_text(path), str(path))
    with errors_of(str(path)), np.errstate(all="ignore"):  # numbers that overflow are refused
        if is_set:
            view, depth_bits, color_bits = camera_of_set(values, name, size)
            fields_of_file = {"depth_kind": "reversed", "depth_bits": depth_bits, "color_bits": color_bits}
        else:
            fields_of_file = {field: values.pop(field) for field in _FIELDS if field in values}
            view = _made(values, size)
            eye = _rigid(values["view"], values.get("layout", LAYOUTS[0])) if "projection" in values else None
        numbers = view.lens, view.cast_from_world, view.world_from_cast, view.world_to_image.numbers
        if not all(np.isfinite(each).all() for each in numbers):
            raise InputError("its numbers are too large, or too small: those of the view are not finite")
        return Description(view, eye, **fields_of_file)


def _made(values: dict[str, Any], size: Size) -> View:
    own: dict[str, Callable[..., View]] = {"camera": _camera, "module": _module, "folder": _folder}
    kind = values.pop("kind", None)
    check_choice("kind", kind, (*own, *KINDS))
    make: Callable[..., Any] = own.get(kind) or getattr(WorldToImage, kind.replace(" ", "_"))
    parameters = {name: p.default for name, p in signature(make).parameters.items() if name != "size"}
    for name in values:
        check_choice("key", name, ("kind", *parameters, *_FIELDS))
    for name, default in parameters.items():
        if default is Parameter.empty and name not in values:
            raise InputError(f"{name} is missing")
    return own[kind](size, **values) if kind in own else _of_mapping(size, make(**values))


def _of_mapping(size: Size, mapping: WorldToImage) -> View:
    """Return the view of a mapping; slits have the lens at x = 0, observers at y = 0. InputError if there is none."""
    if mapping.kind == MATRIX:
        return view_of_matrix(mapping.numbers.reshape(4, 4), *size)
    cast = mapping.numbers[:12].reshape(3, 4)
    lens = mapping.numbers[12:]
    if mapping.kind == CROSSED_SLITS:
        z_m, z_o, u_0, v_0 = Slits(*lens.tolist())
        if not z_o < 0 < z_m:
            raise InputError(f"z_o is {z_o:g} and z_m is {z_m:g}, they must be z_o < 0 < z_m, the screen's z")
        lens = np.array([0.0, z_m, 0.0, z_o, 1 / z_m, u_0, 1 / z_o, v_0])
    width, height, guard = size
    return View("", width, height, lens, cast, inverse_of("M", cast), mapping, None, PHYSICAL_Z, guard)


def _rigid(view: ArrayLike, layout: str) -> Matrix:
    """Return world -> eye, (3, 4); InputError if it is not rigid."""
    matrix = finite_numbers("view", view, 4, 4)
    rows = matrix if layout == LAYOUTS[0] else matrix.T
    if rows[3].tolist() != [0, 0, 0, 1]:
        other = LAYOUTS[layout == LAYOUTS[0]]
        fits = f": layout = '{other}' fits" if matrix.T[3].tolist() == [0, 0, 0, 1] or layout == other else ""
        raise InputError(f"view: its last row, with layout = '{layout}', is not 0 0 0 1{fits}")
    if not np.abs(multiply(rows[:3, :3], rows[:3, :3].T) - np.eye(3)).max() < _RIGID:
        raise InputError("view: it scales or skews, expected a rotation, or a reflection, and a translation")
    return rows[:3]


def _camera(size: Size, view: ArrayLike, projection: ArrayLike, clip: str, layout: str = LAYOUTS[0]) -> View:
    check_choice("clip", clip, CLIPS)
    check_choice("layout", layout, LAYOUTS)
    eye = _rigid(view, layout)
    matrix = finite_numbers("projection", projection, 4, 4)
    x, y, z, w = multiply(matrix if layout == LAYOUTS[0] else matrix.T, to_4x4(eye))
    width, height, guard = size
    system, _, backwards = clip.partition(" ")
    depth = z if system != "opengl" else 0.5 * z + 0.5 * w
    depth = w - depth if backwards else depth
    y = y if system == "vulkan" else -y
    inner = width / 2 - guard, height / 2 - guard
    rows = np.array([inner[0] * x + width / 2 * w, inner[1] * y + height / 2 * w, depth, w])
    facing = np.sign(multiply(depth[None, :3], eye[2:, :3].T)[0, 0])
    if w[:3].any():
        along, square = (multiply(a[None, :3], w[:3, None])[0, 0] for a in (depth, w))
        if not along * w[3] - depth[3] * square > 0:
            other = clip.removesuffix(" reversed") if backwards else f"{clip} reversed"
            raise InputError(f"projection: depth falls with the distance by clip = '{clip}': give '{other}'")
        return view_of_matrix(rows, *size)
    return view_of_matrix(rows, *size, axis=facing * eye[2])


def _module(size: Size, display: str, module: int, physical_from_world: ArrayLike) -> View:
    affine = finite_numbers("physical_from_world", physical_from_world, 3, 4)
    width, height, guard = size
    found = find_display(str(display)).with_resolution(width - 2 * guard, height - 2 * guard)
    if not isinstance(module, int) or not 0 <= module < len(found.modules):
        raise InputError(f"module is {module!r:.40}, {display} has 0 to {len(found.modules) - 1}")
    return found.view(module, affine, guard)


def _folder(size: Size, folder: str, name: str) -> View:
    """Return a view of a rendered folder by the numbers of its manifest."""
    path = Path(str(folder))
    name = str(name)
    manifest = load_manifest(path)
    with reading_manifest(path), errors_of(f"{path}: its manifest"):
        views = {str(entry["name"]): entry["view"] for entry in manifest["views"]}
        check_choice("view", name, views)
        view = view_of(name, views[name])
    described = view.width, view.height, view.guard
    if described != size:
        sizes = [f"{w}x{h} texels, {g} of them a guard band on each side," for w, h, g in (described, size)]
        raise InputError(f"{path}: its view {name} has {sizes[0]} the textures have {sizes[1].rstrip(',')}")
    return view
