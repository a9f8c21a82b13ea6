"""One view's EXR file: written, described, and taken up again by a later job.

A file proves itself: its metadata hold the SHA-256 of each part's pixels and the identity of what they were made from
(``Work.identity``). Files of the same job are equal where their pixels are; their bytes may differ, as OpenImageIO
writes the time into them.
"""

import json
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lfssao.errors import InputError
from lfssao.rendering.contact import sheet_rows, strip
from lfssao.rendering.digests import digest
from lfssao.rendering.exr import Part, read_exr, write_exr
from lfssao.rendering.manifest import describe_view
from lfssao.rendering.passes import Textures
from lfssao.rendering.settings import Settings
from lfssao.rendering.work import Item, Work

if TYPE_CHECKING:
    from PIL.Image import Image

_OCCLUSION = "occlusion: 0 open, 1 covered; visibility is 1 - AO"


@dataclass(frozen=True, eq=False)
class Result:
    """What is left of an item once its file is there.

    Attributes
    ----------
    entry : dict
        What the manifest says of the view.
    strip : PIL.Image.Image or None
        Its row of the contact sheet, if it has one.
    """

    entry: dict[str, Any]
    strip: "Image | None"


def exr_parts(textures: Textures, settings: Settings) -> list[Part]:
    """The layers of one view that are kept as the parts of an EXR file, the shaded image first: viewers show part 0.

    Channels: R G B (shaded); Z (depth); P.X P.Y P.Z (world position); color.R color.G color.B; ao_K.AO for radius K,
    merged.AO, blurred.AO; N.X N.Y N.Z (world normals) if asked for. AO is occlusion everywhere, and the metadata says
    so. Depth, positions, colour and normals keep the guard band, as a data window larger than the display window.
    """
    gbuffer, guard = textures.gbuffer, textures.view.guard
    depth_kind = textures.view.depth_kind
    parts = []
    if textures.shaded is not None:
        parts.append(Part("shaded", ("R", "G", "B"), textures.shaded, {"depth": depth_kind}))
    if "depth" in textures.layers:
        parts.append(Part("depth", ("Z",), gbuffer.depth[..., None], {"depth": depth_kind}, guard))
    if gbuffer.positions is not None:
        parts.append(Part("positions", ("P.X", "P.Y", "P.Z"), gbuffer.positions, {"space": "world"}, guard))
    if gbuffer.color is not None:
        parts.append(Part("color", ("color.R", "color.G", "color.B"), gbuffer.color, {"space": "linear RGB"}, guard))
    if gbuffer.normals is not None:
        parts.append(Part("normals", ("N.X", "N.Y", "N.Z"), gbuffer.normals, {"space": "world"}, guard))
    for k, texture in enumerate(textures.ao):
        # As text: EXR's numbers are 32 bits wide.
        radius, outside = float(settings.radii[k]), str(textures.outside[k])
        parts.append(_occlusion_part(f"ao_{k + 1}", texture, {"radius": radius, "outside": outside}))
    if textures.merged is not None:
        parts.append(_occlusion_part("merged", textures.merged, {}))
    if textures.blurred is not None:
        parts.append(_occlusion_part("blurred", textures.blurred, {"sigma": float(settings.blur)}))
    return parts


def _occlusion_part(name: str, texture: Any, attributes: dict[str, float | str]) -> Part:
    return Part(name, (f"{name}.AO",), texture[..., None], {"AO": _OCCLUSION, **attributes})


def write_view(work: Work, item: Item, textures: Textures) -> Result:
    """Write an item's file, with the digest of each part's pixels and the identity of what they were made from.

    Parameters
    ----------
    work : Work
        What the item is of.
    item : Item
        Which view of which frame.
    textures : Textures
        All textures of the view.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    begin = time.perf_counter()
    parts = exr_parts(textures, work.settings)
    parts = [_with(part, sha256=digest(part.pixels), channels=" ".join(part.channels)) for part in parts]
    parts[0] = _with(parts[0], made_from=json.dumps(work.identity(item)), surface_texels=textures.surface_texels)
    hashed = time.perf_counter()
    write_exr(work.path(item), parts)
    written = time.perf_counter()
    picture = _strip(work, item, parts)
    seconds = {"digest": hashed - begin, "write": written - hashed, "contact": time.perf_counter() - written}
    return Result(_entry(work, item, parts, {**textures.seconds, **seconds}), picture)


def recover_view(work: Work, item: Item) -> Result | None:
    """An item's file as an earlier job left it, its pixels verified; None where there is none, or a damaged one.

    Raises
    ------
    InputError
        If the file was made from something else.
    """
    path, start = work.path(item), time.perf_counter()
    try:
        parts = list(read_exr(path).values())
        made_from = json.loads(parts[0].attributes["made_from"])
        parts = [_in_order(part) for part in parts]
        attributes = [part.attributes["sha256"] for part in parts]
        _told(parts)
    except (InputError, KeyError, ValueError, IndexError):
        return None  # no file, or none of ours: it is made anew, as any file in the way is
    wanted = work.identity(item)
    if made_from != wanted:
        other = [name for name in wanted if made_from.get(name) != wanted[name]]
        raise InputError(
            f"{path}: it was rendered with other parameters ({', '.join(other)}): --resume goes on with the same job "
            "only"
        )
    if [digest(part.pixels) for part in parts] != attributes:
        return None
    picture = _strip(work, item, parts)
    return Result(_entry(work, item, parts, {"verify": time.perf_counter() - start}), picture)


def _with(part: Part, **attributes: str | int) -> Part:
    return replace(part, attributes={**part.attributes, **attributes})


def _in_order(part: Part) -> Part:
    """A part's channels as they were written: files have an order of their own."""
    names = tuple(part.attributes["channels"].split(" "))
    pixels = np.ascontiguousarray(part.pixels[..., [part.channels.index(name) for name in names]])
    return replace(part, channels=names, pixels=pixels)


def _strip(work: Work, item: Item, parts: Iterable[Part]) -> "Image | None":
    if not work.has_sheet or item.view not in sheet_rows(len(work.views)):
        return None
    by_name = {part.name: part for part in parts}
    color = _inside(by_name["color"]) if "color" in by_name else None
    surface = _inside(by_name["depth"])[..., 0] < np.inf
    return strip(color, surface, by_name["blurred"].pixels[..., 0], by_name["shaded"].pixels)


def _inside(part: Part) -> Any:
    """A part's pixels without its guard band."""
    height, width, _ = part.pixels.shape
    return part.pixels[part.guard : height - part.guard, part.guard : width - part.guard]


def _entry(work: Work, item: Item, parts: Sequence[Part], seconds: dict[str, float]) -> dict[str, Any]:
    """What the manifest says of a view: from its parts alone, so that a file taken up again says the same."""
    view, path = work.views[item.view], work.path(item)
    return {
        "name": view.name,
        "file": path.name,
        "bytes": path.stat().st_size,
        "view": describe_view(view),
        **_told(parts),
        "seconds": seconds,
        "textures": {part.name: _describe_part(part) for part in parts},
    }


def _told(parts: Sequence[Part]) -> dict[str, Any]:
    """What the parts' metadata say of the passes."""
    outside = [int(part.attributes["outside"]) for part in parts if part.name.startswith("ao_")]
    return {"surface_texels": parts[0].attributes["surface_texels"], "samples_outside": outside}


def _describe_part(part: Part) -> dict[str, Any]:
    return {
        "channels": list(part.channels),
        "shape": list(part.pixels.shape),
        "dtype": str(np.dtype(part.pixels.dtype)),
        "sha256": part.attributes["sha256"],
    }
