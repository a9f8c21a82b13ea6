"""A page on which an eye walks along a rendered display, in one file without network.

On a flat screen a module shows each screen point the same light wherever the eye is; the eye's place decides how much
of it counts. So the page holds each module's texture as it is read at the picture's pixels, in 8-bit sRGB, and a shader
blends two of them as ``LightField.photograph`` does with blend 'linear', within one code of its 8-bit picture. Rays of
a quilt's view meet in its eye; so the page takes it for a module that stands there, before the screen. A stereo pair
is a quilt of two views, which shows the left eye's view, the right eye's, or both, blended. Through lenses
an eye sees texels of the panel as they are: their page holds the panel, and its picture is that of ``LensletView``.
"""

import json
import os
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from html import escape
from importlib.resources import files
from math import isfinite
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfssao.core.arguments import as_number
from lfssao.errors import InputError, shown
from lfssao.files.exr import use_one_thread_a_file
from lfssao.files.pictures import image_png
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_text
from lfssao.optics.display import Display
from lfssao.optics.kernels.display import display_module, screen_to_image
from lfssao.optics.lenslet import LensletDisplay
from lfssao.optics.quilt import Quilt
from lfssao.rendering.folder import fill, read_layer, read_views
from lfssao.rendering.lenslet_viewer import LensletView
from lfssao.rendering.viewer import check_modules, eye_point, eye_range, picture_size

MOST_BYTES = 2**29  # of texels on a graphics card, four bytes each
_FRAME = '<iframe srcdoc="{}" style="width: 100%; height: {}px; border: 0"></iframe>'
_TO_IMAGE: Any = screen_to_image  # a formula, which takes arrays too
_BELOW = 325  # pixels, for what stands around the picture


@dataclass(frozen=True, eq=False)
class EyePage:
    """A page of ``eye_page``, which a notebook shows.

    Attributes
    ----------
    text : str
        The HTML file.
    height : int
        Its picture's, pixels.
    """

    text: str
    height: int

    def save(self, path: str | Path) -> None:
        """Write the file, whole or not at all; InputError if it cannot be written."""
        write_text(Path(path), self.text)

    def _repr_html_(self) -> str:
        return _FRAME.format(escape(self.text), self.height + _BELOW)


def eye_page(
    folder: str | Path,
    modules: Any = None,
    eye_x: float | None = None,
    width: int = 900,
    bar: Callable[..., Any] = lambda steps, total: steps,
    eye_y: float | None = None,
) -> EyePage:
    """The page of a display that ``lfssao render`` wrote into a folder: textures with AO, and without if coloured.

    ``modules`` are the numbers of those, or of a quilt's views, that shine (default: all); the eye begins at ``eye_x``,
    metres (default: as near to the middle as light reaches), before lenses at ``eye_y``, too; ``width`` is the
    picture's, pixels. ``bar`` passes on one step a module. InputError as ``LightField``, and if a quilt has one view,
    there is no shaded texture, the pictures take more than ``MOST_BYTES``, the screen is curved, the display is conical
    and its modules are not in a line, or ``eye_y`` is given of a display without lenses.

    >>> from lfssao.cli.main import main
    >>> main("render corner --display sample-a --modules 9:12 --resolution 50x30 -o out".split())
    out: 3 EXR files, manifest.json, contact.png
    0
    >>> page = lfssao.eye_page("out", width=100)  # in a notebook it shows itself
    >>> page.save("eye.html")
    """
    folder = Path(folder)
    display, entries = read_views(folder, "shaded", modules)
    chosen = list(entries)
    layers = [name for name in ("color", "shaded") if all(name in entry["textures"] for entry in entries.values())]
    size = picture_size(display, width)
    if isinstance(display, LensletDisplay):
        _check_size(folder, 4 * len(layers) * display.width * display.height)
        view = LensletView(display, chosen, 3 * len(layers))
        fill(view, folder, layers, entries, partial(bar, total=len(chosen)))
        return EyePage(_page_of_lenses(view, size, (eye_x or 0.0, eye_y or 0.0)), size[1])
    if eye_y is not None:
        raise InputError(f"eye y is for lenslet displays: the observers of {display.name} stand on a line")
    numbers = _of_quilt(display, chosen, eye_x) if isinstance(display, Quilt) else _of_display(display, chosen, eye_x)
    _check_size(folder, 4 * len(layers) * len(chosen) * size[0] * size[1])

    def packed(index: int) -> tuple[list[str], NDArray[np.bool_]]:
        return _packed(display, index, size, folder, entries[index], layers)

    use_one_thread_a_file()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        packs = dict(zip(chosen, bar(pool.map(packed, chosen), len(chosen)), strict=True))
    lit = np.flatnonzero(np.any([rows for _, rows in packs.values()], axis=0)).tolist() or [0]
    modules = [
        {"x": x, "y": y, "z": z, "textures": packs[k][0] if k in packs else None}
        for k, (x, y, z) in enumerate(numbers.pop("places"))
    ]
    data = {
        "layers": len(layers),
        "rows": (lit[0], lit[-1] + 1),
        "screen": (display.screen_width, display.screen_height),
        "modules": modules,
        **numbers,
    }
    left, right = data["eyes"]
    near, far = data["distances"]
    kind = "view" if isinstance(display, Quilt) else "module"
    distance = f"{data['distance']:.3g}"
    unit = display.UNIT if isinstance(display, Quilt) else "metres"
    more = {"kind": kind, "unit": unit, "left": left, "right": right, "near": near, "far": far, "distance": distance}
    return EyePage(_filled("eye", display.name, size, data, **more), size[1])


def _check_size(folder: Path, needed: int) -> None:
    """Refuse (InputError) pictures that take more bytes on a graphics card than a page may."""
    if needed > MOST_BYTES:
        reason = f"{needed >> 20} MB of pictures, a page holds {MOST_BYTES >> 20}"
        raise InputError(f"{folder}: {reason}: take fewer modules or a smaller width")


def _of_display(display: Display, chosen: Sequence[int], eye_x: float | None) -> dict[str, Any]:
    """Return the page's numbers of the places of modules and eyes."""
    _check(display)
    left, right = eye_range(display, chosen)
    start = min(max(0.0, left), right) if eye_x is None else eye_point(display, eye_x)[0]
    eyes = min(left, start), max(right, start)
    return {
        "conical": display.diffuser == "conical",
        "height": display.observer_height,
        "distance": -display.observer_z,
        "distances": _distances(display, *eyes),
        "curvature": display.observer_curvature,
        "eye": start,
        "eyes": eyes,
        "places": [(m.x, m.y, m.z) for m in display.modules],
    }


def _of_quilt(quilt: Quilt, chosen: Sequence[int], eye_x: float | None) -> dict[str, Any]:
    """The page's numbers of a quilt, as of ``_of_display``: eyes lie in a row, and each view's rays meet in its own."""
    if quilt.count < 2:
        raise InputError(f"display {quilt.name}: it has one view, a page moves between two")
    left = quilt.eye_x(min(chosen))
    right = quilt.eye_x(max(chosen))
    start = min(max(0.0, left), right) if eye_x is None else as_number(eye_x)
    if not isfinite(start):
        raise InputError(f"eye x is {shown(eye_x)}, it must be a finite number")
    return {
        "conical": False,
        "height": 0.0,
        "distance": quilt.distance,
        "distances": (0.5 * quilt.distance, 2 * quilt.distance),
        "curvature": 0.0,
        "eye": start,
        "eyes": (min(left, start), max(right, start)),
        "places": [(quilt.eye_x(k), 0.0, -quilt.distance) for k in range(quilt.count)],
    }


def _page_of_lenses(view: LensletView, size: tuple[int, int], eye: tuple[float, float]) -> str:
    """The file's text for a lenslet display and its panel's textures: the eye moves in a plane before the lenses."""
    display = view.display
    box = view.display.eye_box
    for name, place in zip("xy", eye, strict=True):
        if not isfinite(as_number(place)):
            raise InputError(f"eye {name} is {shown(place)}, it must be a finite number")
    # So far that lenses show others' images, too.
    farthest = max(1.5 * box if box > 0 else 0.1 * display.observer_distance, *map(abs, eye))
    layers = np.split(view.panel, view.panel.shape[2] // 3, axis=2)
    data = {
        "panels": [b64encode(image_png(Image.fromarray(to_codes(layer)))).decode() for layer in layers],
        "size": (display.width, display.height),
        "panel": (display.panel_width, display.panel_height),
        "screen": (display.screen_width, display.screen_height),
        "start": 0.5 if display.middle == "lens" else 0.0,
        "lensPitch": display.lens_pitch,
        "imagePitch": display.image_pitch,
        "gap": display.gap,
        "focalLength": display.focal_length,
        "eye": eye,
        "eyes": (-farthest, farthest),
        "distance": display.observer_distance,
        "distances": (0.5 * display.observer_distance, 2 * display.observer_distance),
    }
    return _filled("lenses", display.name, size, data, box=f"{1000 * max(box, 0.0):.3g}")


def _distances(display: Display, left: float, right: float) -> tuple[float, float]:
    """Least and greatest distance of the observers that the page offers, metres: all its eyes are before the screen."""
    distance = -display.observer_z
    bulge = max(distance + eye_point(display, x)[2] for x in (left, 0.0, right))
    return min(max(0.5 * distance, 1.1 * bulge), distance), 2 * distance


def _check(display: Display) -> None:
    """Refuse (InputError) a display of one module, and one that the page cannot show."""
    name = f"display {display.name}"
    modules = display.modules
    check_modules(display)
    if display.screen_curvature != 0:
        raise InputError(f"{name}: a page shows flat screens alone, of a curved one each eye sees other points")
    in_line = len({(m.y, m.z) for m in modules}) == 1 and len({m.x for m in modules}) == len(modules)
    if display.diffuser == "conical" and not in_line:
        raise InputError(f"{name}: a page shows conical displays only if their modules are in a line")


def _packed(
    display: Display | Quilt,
    index: int,
    size: tuple[int, int],
    folder: Path,
    entry: Mapping[str, Any],
    layers: Sequence[str],
) -> tuple[list[str], NDArray[np.bool_]]:
    """Layers of a module at the picture's pixels, each a PNG file in base64, and which rows of them are not black.

    They are transparent where the module shows nothing. InputError if its file does not hold them.
    """
    columns, rows = size
    path = folder / Path(entry["file"]).name
    textures = []
    module = display if isinstance(display, Quilt) else display.modules[index]
    for layer in layers:
        texture = read_layer(path, layer, entry["textures"][layer])
        if texture.shape != (module.height, module.width, 3) or not np.isfinite(texture).all():
            raise InputError(f"{path}: its part {layer} is no finite texture of {module.width}x{module.height} texels")
        textures.append(texture)
    across, down = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    if isinstance(display, Quilt):
        u = module.width * across
        v = module.height * down
        formed = np.ones(across.shape, np.bool_)
    else:
        x = display.screen_width * (across - 0.5)
        y = display.screen_height * (0.5 - down)
        with np.errstate(all="ignore"):  # where the optics form no picture
            u, v, ahead, formed = _TO_IMAGE(display_module(display.module_numbers(index)), x, y, 0.0)
            formed = ahead & formed
    with np.errstate(invalid="ignore"):
        visible = formed & (u >= 0) & (u < module.width) & (v >= 0) & (v < module.height)
    light = np.zeros((rows, columns, 3 * len(layers)))
    light[visible] = _bilinear(np.concatenate(textures, axis=2), u[visible], v[visible])
    pictures = []
    for codes in np.split(to_codes(light), len(layers), axis=2):
        picture = Image.fromarray(codes)
        if not visible.all():
            picture.putalpha(Image.fromarray(np.where(visible, np.uint8(255), np.uint8(0))))
        pictures.append(b64encode(image_png(picture)).decode())
    lit: NDArray[np.bool_] = np.any(light, axis=(1, 2))
    return pictures, lit


def _bilinear(texture: NDArray[np.float32], u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a texture, (H, W, C), at n image points inside it: (n, C)."""
    height, width, channels = texture.shape
    x = np.clip(u - 0.5, 0, width - 1)
    y = np.clip(v - 0.5, 0, height - 1)
    column = x.astype(np.int64)
    row = y.astype(np.int64)
    f = (x - column)[:, None]
    g = (y - row)[:, None]
    right = np.minimum(column + 1, width - 1)
    below = np.minimum(row + 1, height - 1)
    texels = texture.reshape(-1, channels)
    top = (1 - f) * texels[row * width + column] + f * texels[row * width + right]
    bottom = (1 - f) * texels[below * width + column] + f * texels[below * width + right]
    blend: NDArray[np.float64] = (1 - g) * top + g * bottom
    return blend


def _filled(page: str, name: str, size: Sequence[int], data: Mapping[str, Any], **more: Any) -> str:
    """The text of the file that a page's template gives, of a display of that name; ``more`` is what it says, too."""
    here = files(__package__)
    names = f"{page}.html", "eye.css", "eye.frag", f"{page}.js"
    text, style, shader, script = ((here / name).read_text("utf-8") for name in names)
    allowed = [f"'sha256-{b64encode(sha256(part.encode()).digest()).decode()}'" for part in (style, script)]
    return Template(text).substitute(
        name=escape(name.encode("utf-8", "backslashreplace").decode()),
        policy=f"default-src 'none'; img-src data:; style-src {allowed[0]}; script-src {allowed[1]}",
        style=style,
        shader=shader,
        script=script,
        width=size[0],
        height=size[1],
        data=json.dumps(data).replace("<", "\\u003c"),
        **more,
    )
