"""Common ground of the measurements of the three papers: scenes, errors, pictures, the papers' numbers."""

import json
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from scipy import ndimage

from lfssao import Buffers, Camera, RayCaster, builtin_scene
from lfssao.rendering.settings import diagonal

RESULTS = Path(__file__).parent / "results"


PAPERS: dict[str, Any] = {
    name: claim
    for paper in ("lf", "sao", "vo")
    for name, claim in tomllib.loads((Path(__file__).parent / f"papers_{paper}.toml").read_text()).items()
}

# A claim's rows of measured numbers, and whatever else its verdict needs.
Found = dict[str, Any]
# Whether the claim holds, whether in part, and the numbers of the sentence that tells it.
Judged = tuple[bool, bool, dict[str, Any]]


class Scale(NamedTuple):
    """Whether it is a trial, the folder of the pictures, and whether pictures are kept: those of controls are not."""

    quick: bool
    folder: Path = RESULTS
    pictures: bool = True

    def size(self, *texels: int) -> tuple[int, ...]:
        """A texture's size: a quarter of it for a trial."""
        return tuple(n // 4 for n in texels) if self.quick else texels

    def repeats(self, n: int) -> int:
        """How often something is timed."""
        return min(n, 3) if self.quick else n

    def save(self, name: str, figure: Figure | Image.Image) -> None:
        """A picture of few colours, which keeps its file small."""
        if not self.pictures:
            return
        if isinstance(figure, Figure):
            buffer = BytesIO()
            figure.savefig(buffer, dpi=90)
            figure = Image.open(buffer).convert("RGB")
        self.folder.mkdir(exist_ok=True)
        figure.quantize(48, dither=Image.Dither.NONE).save(self.folder / f"{name}.png", optimize=True)


class Claim(NamedTuple):
    """A claim's numbers, the judge of them, and numbers that this judge must not find 'reproduced'.

    A control measures a damaged input as the claim is measured, or damages the claim's own numbers. So a timed claim
    has a control without new times.
    """

    measure: Callable[[Scale], Found]
    judge: Callable[..., Judged]
    control: Callable[[Scale, Found], Found]


def measured_before(scale: Scale, name: str) -> dict[str, Any]:
    """Rows of another claim, measured before: its times serve for this one too."""
    path = scale.folder / "papers.json"
    held = json.loads(path.read_text()) if path.exists() else {}
    if name not in held:
        raise SystemExit(f"measure {name!r} first: its times are not in {path}")
    rows: dict[str, Any] = held[name]["measured"]["rows"]
    return rows


def changed(found: Found, rows: Mapping[str, Any]) -> Found:
    """Measured numbers, with some numbers of some rows changed."""
    return found | {"rows": {name: row | rows.get(name, {}) for name, row in found["rows"].items()}}


def renamed(found: Found) -> Found:
    """Measured numbers, with each row under the name of the row before it."""
    first, *others = found["rows"].values()
    return found | {"rows": dict(zip(found["rows"], [*others, first], strict=True))}


def moved(texture: Any, seen: Any) -> Any:
    """The texture of other texels: each surface value half of all surface texels further, in reading order."""
    values = texture[seen]
    out = texture.copy()
    out[seen] = np.roll(values, len(values) // 2, axis=0)
    return out


def mean_of(texture: Any, seen: Any) -> Any:
    """A texture's mean on all its surface."""
    return np.where(seen, texture[seen].mean(), 0).astype(texture.dtype)


def correlation(a: Any, b: Any) -> float:
    """Pearson's correlation, 0 where either is constant."""
    first, second = (np.asarray(each, np.float64) - np.mean(each, dtype=np.float64) for each in (a, b))
    return float((first * second).mean() / max(first.std() * second.std(), 1e-30))


def fine(texture: Any, seen: Any, size: int = 9) -> Any:
    """A texture less its mean over the surface texels of a square window."""
    weight = ndimage.uniform_filter(seen.astype(np.float64), size)
    mean = ndimage.uniform_filter(np.where(seen, texture, 0).astype(np.float64), size) / np.maximum(weight, 1e-9)
    return np.where(seen, texture - mean, 0)


@cache
def camera_buffers(
    width: int, height: int, guard: int = 0, move: float = 0.0, scene: str = "gallery"
) -> tuple[Buffers, float, Any]:
    """A scene before an ordinary camera, moved to the right by some texels; its diagonal and its G-buffer."""
    mesh = builtin_scene(scene)
    start = Camera.looking_at(mesh.bounds)
    return moved_buffers(mesh, start, width, height, guard, move)


def moved_buffers(
    mesh: Any, start: Camera, width: int, height: int, guard: int = 0, move: float = 0.0
) -> tuple[Buffers, float, Any]:
    step = move * start.extent / height
    eye, target = ((p[0] + step, p[1], p[2]) for p in (start.eye, start.target))
    camera = Camera(start.projection, eye, target, start.up, start.extent, start.near, start.far)
    view = camera.view(width, height, guard)
    gbuffer = RayCaster(mesh, view.cast_from_world, 2).gbuffer(view, None, "geometric")
    return Buffers.of(gbuffer, view), diagonal(mesh), gbuffer


def tiles(pictures: Mapping[str, Any], columns: int, width: float = 9.6, **shown: Any) -> Figure:
    """Pictures in rows under their titles, grey from 0 to 1 unless told otherwise."""
    rows = -(-len(pictures) // columns)
    height, across = next(iter(pictures.values())).shape[:2]
    figure = Figure(figsize=(width, rows * (width / columns * height / across + 0.3)), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    for axes, (title, picture) in zip(panels, pictures.items(), strict=False):
        axes.imshow(picture, **{"cmap": "gray", "vmin": 0, "vmax": 1, "interpolation": "antialiased"} | shown)
        axes.set_title(title, fontsize="small")
    return figure


def curves(panels: int, width: float = 9.6) -> tuple[Figure, Any]:
    """A figure of some plots beside each other."""
    figure = Figure(figsize=(width, 3.4), layout="constrained")
    axes = figure.subplots(1, panels, squeeze=False)[0]
    for each in axes:
        each.grid(visible=True, which="both", alpha=0.3)
    return figure, axes
