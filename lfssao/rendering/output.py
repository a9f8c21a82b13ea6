"""The files of a job: an EXR file a view, and the contact sheet and manifest of each frame.

An EXR file proves itself: its metadata hold the SHA-256 of each part's pixels, that of its headers, and the identity
of what they were made from (``Job.identity``), so that a later job can take it up. Its bytes hold the time too and may
differ.
"""

import json
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Image

from lfssao.core.affine import sum_in_order
from lfssao.core.files import remove_leftovers, write_text, write_whole
from lfssao.errors import InputError
from lfssao.optics.view import View
from lfssao.rendering import plan
from lfssao.rendering.contact import contact_sheet, sheet_rows, strip
from lfssao.rendering.exr import Part, read_exr, write_exr
from lfssao.rendering.job import Item, Job
from lfssao.rendering.manifest import ANGLES, FORMAT, MANIFEST, describe_view, digest, short_digest
from lfssao.rendering.passes import Textures
from lfssao.rendering.settings import Settings

SHEET = "contact.png"
_OCCLUSION = "occlusion: 0 open, 1 covered; visibility is 1 - AO"


class Result(NamedTuple):
    """The view's entry in the manifest, and its row of the contact sheet, if it has one."""

    entry: dict[str, Any]
    strip: Image | None


def exr_parts(textures: Textures) -> list[Part]:
    """The layers of one view that are kept as the parts of an EXR file, the shaded image first: viewers show part 0.

    Channels: R G B (shaded); Z (depth); P.X P.Y P.Z (world position); color.R color.G color.B; ao_K.AO for radius K,
    merged.AO, blurred.AO; N.X N.Y N.Z (world normals) if asked for. AO is occlusion everywhere, and the metadata says
    so. Depth, positions, colour and normals keep the guard band, as a data window larger than the display window.
    """
    gbuffer, guard, settings = textures.gbuffer, textures.view.guard, textures.settings
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
    parts = [_with(part, sha256=digest(part.pixels), channels=" ".join(part.channels)) for part in parts]
    return [_with(parts[0], surface_texels=textures.surface_texels), *parts[1:]]


def _occlusion_part(name: str, texture: NDArray[np.float32], attributes: dict[str, float | str]) -> Part:
    """A layer of occlusion, (H, W), as a part."""
    return Part(name, (f"{name}.AO",), texture[..., None], {"AO": _OCCLUSION, **attributes})


def write_view(job: Job, item: Item, textures: Textures) -> Result:
    """Write an item's file, with digests and identity; InputError if it cannot be written."""
    begin = time.perf_counter()
    parts = exr_parts(textures)
    parts[0] = _with(parts[0], made_from=json.dumps(job.identity(item)))
    parts[0] = _with(parts[0], header_sha256=_header_digest(parts))
    hashed = time.perf_counter()
    write_exr(job.path(item), parts)
    written = time.perf_counter()
    picture = _strip(job, item, parts)
    seconds = {"digest": hashed - begin, "write": written - hashed, "contact": time.perf_counter() - written}
    entry = entry_of(job.views[item.view], job.path(item), parts, {**textures.seconds, **seconds})
    return Result(entry, picture)


def recover_view(job: Job, item: Item) -> Result | None:
    """An item's file as an earlier job left it, its pixels verified; None where there is none, or a damaged one.

    Raises InputError if the file was made from something else.
    """
    path, start = job.path(item), time.perf_counter()
    try:
        parts = [_in_order(part) for part in read_exr(path).values()]
        if parts[0].attributes["header_sha256"] != _header_digest(parts):
            return None
        made_from = dict(json.loads(parts[0].attributes["made_from"]))
        whole = [digest(part.pixels) for part in parts] == [part.attributes["sha256"] for part in parts]
        entry = entry_of(job.views[item.view], path, parts, {})
    except (InputError, KeyError, ValueError, IndexError, AttributeError, TypeError):
        return None  # no file, or none of ours: it is made anew, as any file in the way is
    wanted = job.identity(item)
    if made_from != wanted:
        other = [name for name in wanted if made_from.get(name) != wanted[name]]
        raise InputError(
            f"{path}: it was rendered with other parameters ({', '.join(other)}): --resume goes on with the same job "
            "only"
        )
    if not whole:
        return None
    picture = _strip(job, item, parts)
    return Result({**entry, "seconds": {"verify": time.perf_counter() - start}}, picture)


def _header_digest(parts: Sequence[Part]) -> str:
    """The SHA-256 of all that the parts' headers say but itself, numbers as the file has them."""
    said = []
    for part in parts:
        attributes = {name: value for name, value in part.attributes.items() if name != "header_sha256"}
        rounded = {name: float(np.float32(v)) if isinstance(v, float) else v for name, v in attributes.items()}
        said.append([part.name, part.channels, part.pixels.shape, part.guard, rounded])
    return short_digest(said)


def _with(part: Part, **attributes: str | int) -> Part:
    return replace(part, attributes={**part.attributes, **attributes})


def _in_order(part: Part) -> Part:
    """A part's channels as they were written: files have an order of their own."""
    names = tuple(part.attributes["channels"].split(" "))
    pixels = np.ascontiguousarray(part.pixels[..., [part.channels.index(name) for name in names]])
    return replace(part, channels=names, pixels=pixels)


def _strip(job: Job, item: Item, parts: Iterable[Part]) -> Image | None:
    if not job.has_sheet or item.view not in sheet_rows(len(job.views)):
        return None
    by_name = {part.name: part for part in parts}
    color = _inside(by_name["color"]) if "color" in by_name else None
    surface = _inside(by_name["depth"])[..., 0] < np.inf
    return strip(color, surface, by_name["blurred"].pixels[..., 0], by_name["shaded"].pixels)


def _inside(part: Part) -> NDArray[np.float32]:
    """A part's pixels without its guard band."""
    height, width, _ = part.pixels.shape
    return part.pixels[part.guard : height - part.guard, part.guard : width - part.guard]


def entry_of(view: View, path: Path, parts: Sequence[Part], seconds: dict[str, float]) -> dict[str, Any]:
    """The view's entry in the manifest, from its parts alone, so that a file taken up again has the same."""
    return {
        "name": view.name,
        "file": path.name,
        "bytes": path.stat().st_size,
        "view": describe_view(view),
        "surface_texels": parts[0].attributes["surface_texels"],
        "samples_outside": [int(part.attributes["outside"]) for part in parts if part.name.startswith("ao_")],
        "seconds": seconds,
        "textures": {
            part.name: {
                "channels": list(part.channels),
                "shape": list(part.pixels.shape),
                "dtype": str(part.pixels.dtype),
                "sha256": part.attributes["sha256"],
            }
            for part in parts
        },
    }


def make_ready(job: Job, items: Iterable[Item]) -> None:
    """Make folders ready for the items that are still to be done.

    The manifest and the sheet of an earlier job go before its files are replaced: they show files that are gone.
    """
    for frame in range(job.frame_count):
        remove_leftovers(job.frame_folder(frame))
    for frame in {item.frame for item in items}:
        for name in (MANIFEST, SHEET):
            if (path := job.frame_folder(frame) / name).is_file():
                path.unlink()


def write_frame(job: Job, frame: int, results: Sequence[Result], seconds: dict[str, float]) -> None:
    """Write a frame's contact sheet, if it has one, and its manifest, from the results of all its views.

    ``seconds`` is the wall time of each step of the job.
    """
    folder, entries = job.frame_folder(frame), [result.entry for result in results]
    remove_leftovers(folder)  # of workers that were killed on the way
    if job.has_sheet:
        sheet = contact_sheet([(r.entry["name"], r.strip) for r in results if r.strip is not None])
        write_whole(folder / SHEET, sheet.save)
    texels = sum(view.width * view.height for view in job.views)
    left = plan.planned(job.views, [job.boxes[frame]], job.settings, job.mesh.paint is not None)
    left += plan.background(job.settings, texels, sum(entry["surface_texels"] for entry in entries))
    place = {"number": frame, "count": job.frame_count, "world_from_scene": job.transform(frame).tolist()}
    passes = dict.fromkeys(name for entry in entries for name in entry["seconds"])
    manifest = {
        "format": FORMAT,
        **job.head,
        "frame": None if job.transforms is None else place,
        "plan": plan.described(left),
        "seconds": {
            **seconds,
            "passes": {name: sum_in_order(entry["seconds"].get(name, 0.0) for entry in entries) for name in passes},
        },
        "views": entries,
    }
    write_manifest(folder, manifest, job.settings)


def write_manifest(folder: Path, manifest: dict[str, Any], settings: Settings) -> None:
    """Write a manifest, and the angles that it speaks of."""
    if isinstance(settings.rotation, np.ndarray):
        write_whole(folder / ANGLES, partial(np.save, arr=settings.rotation))
    write_text(folder / MANIFEST, json.dumps(manifest, indent=1, allow_nan=False) + "\n")
