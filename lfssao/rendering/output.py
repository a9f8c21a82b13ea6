"""The files of a job: an EXR file a view, and a picture if asked for, and each frame's contact sheet and manifest.

An EXR file proves itself: its metadata hold the SHA-256 of each part's pixels, that of the file, and the identity of
the inputs that they were made from (``Job.identity``), so that a later job can take it up.
"""

import json
import time
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL.Image import Image

from lfssao import __version__
from lfssao.core.affine import sum_in_order
from lfssao.errors import InputError
from lfssao.files.exr import Part, is_sealed, read_exr, write_exr
from lfssao.files.srgb import to_codes
from lfssao.files.whole import remove_leftovers, write_text, write_whole
from lfssao.optics.display_file import ViewSet, set_of
from lfssao.optics.view import View, without_guard
from lfssao.rendering import doubts, plan
from lfssao.rendering.contact import contact_sheet, sheet_rows, side_by_side, strip, white, with_ao, without_ao
from lfssao.rendering.job import Item, Job
from lfssao.rendering.manifest import FORMAT, MANIFEST, NOISE, PANEL, describe_view, digest, display_of, name_of_noise
from lfssao.rendering.settings import Settings
from lfssao.rendering.textures import Textures, exr_parts, shaded_png, with_attributes
from lfssao.rendering.viewer import LightField

SHEET = "contact.png"
VIEW = "view.png"
ANIMATION = "animation.png"
MOST_PICTURES = 360  # of an animation
_SHOT = (0.0, 900, "linear")  # view.png: the place of the eye, pixels across, how modules are blended


class Result(NamedTuple):
    """The view's entry in the manifest, and its row of the contact sheet, if it has one."""

    entry: dict[str, Any]
    strip: Image | None


def write_view(job: Job, item: Item, textures: Textures) -> Result:
    """Write an item's file, with digests and identity; InputError if it cannot be written."""
    begin = time.perf_counter()
    parts = exr_parts(textures)
    parts[0] = with_attributes(parts[0], **_metadata_of(job, item), made_from=json.dumps(job.identity(item)))
    hashed = time.perf_counter()
    write_exr(job.path(item), parts, sealed=True)
    described = _write_picture(job, item, parts)
    written = time.perf_counter()
    picture = _strip(job, item, parts)
    seconds = {"digest": hashed - begin, "write": written - hashed, "contact": time.perf_counter() - written}
    neighbours = job.neighbours[item.view]
    entry = entry_of(job.views[item.view], job.path(item), parts, {**textures.seconds, **seconds}, neighbours)
    return Result(entry | described, picture)


def _write_picture(job: Job, item: Item, parts: Sequence[Part]) -> dict[str, Any]:
    """Write the shaded texture, the first part, as 8-bit sRGB, if the job has pictures: what the entry says of it.

    A file that has these bytes already stays as it is.
    """
    if not job.png:
        return {}
    path = job.picture(item)
    data = shaded_png(parts[0].pixels)
    _remove_device(path)
    if not path.is_file() or path.read_bytes() != data:
        write_whole(path, lambda part: part.write_bytes(data))
    return {"picture": {"file": path.name, "sha256": sha256(data).hexdigest()}}


def _metadata_of(job: Job, item: Item) -> dict[str, str]:
    """Return a file's metadata on the job, which any viewer shows; the manifest has all of it."""
    views = set_of(job.head)
    sampling = job.head["sampling"]
    display = job.head["display"] if views is None else {"name": views.name}
    return {
        "software": f"lfssao {__version__}",
        "display": display["name"] if display else "none",
        "module": job.views[item.view].name,
        "estimator": job.settings.estimator,
        "radii": ", ".join(f"{radius:.9g}" for radius in job.settings.radii),
        "samples": f"{sampling['count']} {sampling['method']}",
        "seed": str(sampling["seed"]),
    }


def recover_view(job: Job, item: Item) -> Result | None:
    """An item's file of an earlier job, verified; None for none or a damaged one, InputError for one made otherwise."""
    path = job.path(item)
    start = time.perf_counter()
    try:
        parts = [_in_order(part) for part in read_exr(path).values()]
        if not is_sealed(path):
            return None
        made_from = dict(json.loads(parts[0].attributes["made_from"]))
        whole = [digest(part.pixels) for part in parts] == [part.attributes["sha256"] for part in parts]
        entry = entry_of(job.views[item.view], path, parts, {}, job.neighbours[item.view])
    except (InputError, OSError, KeyError, ValueError, IndexError, AttributeError, TypeError):
        return None  # no file, or none of ours: it is made anew, as any file in the way is
    wanted = job.identity(item)
    if made_from != wanted:
        names = {**wanted, **made_from}
        other = ", ".join(name for name in names if made_from.get(name) != wanted.get(name))
        reason = f"it was rendered with other parameters ({other}): --resume goes on with the same job only"
        raise InputError(f"{path}: {reason}")
    if not whole:
        return None
    described = _write_picture(job, item, parts)
    picture = _strip(job, item, parts)
    return Result({**entry, **described, "seconds": {"verify": time.perf_counter() - start}}, picture)


def _in_order(part: Part) -> Part:
    """Return a part's channels as they were written: files have an order of their own."""
    names = tuple(part.attributes["channels"].split(" "))
    pixels = np.ascontiguousarray(part.pixels[..., [part.channels.index(name) for name in names]])
    return replace(part, channels=names, pixels=pixels)


def _strip(job: Job, item: Item, parts: Iterable[Part]) -> Image | None:
    if not job.has_sheet or item.view not in sheet_rows(len(job.views)):
        return None
    by_name = {part.name: part for part in parts}
    image = by_name["color"].pixels if "color" in by_name else white(by_name["depth"].pixels[..., 0])
    guard = by_name["depth"].guard
    normals = without_guard(by_name["normals"].pixels, guard) if "normals" in by_name else None
    image = without_ao(without_guard(image, guard), normals, job.settings.light)
    return strip(image, by_name["blurred"].pixels[..., 0], by_name["shaded"].pixels)


def entry_of(
    view: View, path: Path, parts: Sequence[Part], seconds: dict[str, float], neighbours: Sequence[View] = ()
) -> dict[str, Any]:
    """Return the view's entry in the manifest, from its parts alone, so that a file taken up again has the same."""
    return {
        "name": view.name,
        "file": path.name,
        "bytes": path.stat().st_size,
        "view": describe_view(view),
        "neighbours": [{"name": each.name, "view": describe_view(each)} for each in neighbours],
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


def make_ready(job: Job, items: Collection[Item]) -> None:
    """Make folders ready for the items that are still to be done.

    The manifest and the sheet of an earlier job go before its files are replaced: they show files that are gone.
    """
    own = [*map(job.path, job.items()), *(map(job.picture, job.items()) if job.png else ())]
    doubts.warn(doubts.of_folder(job.folder, own))
    for frame in range(job.frame_count):
        remove_leftovers(job.frame_folder(frame))
    frames = {item.frame for item in items}
    names = MANIFEST, *NOISE.values(), SHEET, VIEW, PANEL, *job.quilts.values()
    old = [job.frame_folder(frame) / name for frame in frames for name in names]
    for path in (job.folder / ANIMATION, *old):
        if path.exists() and not path.is_dir():
            path.unlink(missing_ok=True)  # another task of the job may be as far
    for path in map(job.path, items):
        _remove_device(path)


def _remove_device(path: Path) -> None:
    """Remove a pipe or a device in the way of a file, else the file would be written into it."""
    if path.exists() and not path.is_file() and not path.is_dir():
        path.unlink()


def write_frame(
    job: Job, frame: int, results: Sequence[Result], seconds: dict[str, float], field: LightField | None
) -> Image | None:
    """Write a frame's contact sheet, manifest and pictures, from its views' results and the job's times.

    ``field`` has textures of view.png; the others are read from the files. Returned is the picture of the frame's
    middle view with AO, if it has a sheet.
    """
    folder = job.frame_folder(frame)
    entries = [result.entry for result in results]
    doubts.warn(doubts.of_views([entry["name"] for entry in entries if not entry["surface_texels"]]))
    remove_leftovers(folder)  # of workers that were killed on the way
    strips = [(result.entry["name"], result.strip) for result in results if result.strip is not None]
    if job.has_sheet:
        write_whole(folder / SHEET, partial(contact_sheet(strips).save, compress_level=1))
    texels = sum(view.width * view.height for view in job.views)
    left = plan.planned(job.views, [job.boxes[frame]], job.settings, job.mesh.paint is not None)
    left |= plan.background(job.settings, texels, sum(entry["surface_texels"] for entry in entries))
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
    views = set_of(job.head)
    if views is not None:
        _write_joint_files(job, folder, views, entries)
    if job.has_view:
        write_whole(folder / VIEW, partial(_view(job, results, field).save, compress_level=1))
    return with_ao(strips[len(strips) // 2][1]) if strips else None


def _write_joint_files(job: Job, folder: Path, views: ViewSet, entries: Sequence[dict[str, Any]]) -> None:
    """Write pictures of all views of a quilt, or the one texture of a lenslet display's panel."""
    from lfssao.optics.lenslet import LensletDisplay  # late, as all here: most displays have modules
    from lfssao.optics.quilt import Quilt
    from lfssao.rendering.panels import write_panel
    from lfssao.rendering.quilts import write_quilts

    if isinstance(views, Quilt):
        write_quilts(folder, job.quilts, entries, views.columns, views.rows)
    if job.panel and isinstance(views, LensletDisplay):
        write_panel(folder, views, entries)


def _view(job: Job, results: Sequence[Result], field: LightField | None) -> Image:
    """The picture for an eye in the middle of the observer line, without AO, if there are colours, and with it."""
    layers = _seen(job)
    field = field or empty_field(job)
    if field.missing:
        from lfssao.rendering.folder import fill  # late: a job that nothing interrupts has all textures at hand

        fill(field, job.folder, layers, {k: result.entry for k, result in enumerate(results)})
    codes = np.split(to_codes(field.photograph(*_SHOT).image), len(layers), axis=2)
    made = "AO" if job.settings.light is None else "light and AO"
    titles = {"color": f"without {made}", "shaded": f"with {made}"}
    return side_by_side({titles[layer]: picture for layer, picture in zip(layers, codes, strict=True)})


def _seen(job: Job) -> list[str]:
    """Return the layers that view.png shows."""
    return ["shaded"] if job.mesh.paint is None else ["color", "shaded"]


def empty_field(job: Job) -> LightField:
    """Room for all that view.png shows of the textures, which are put in as they are made."""
    modules = {k: {"view": describe_view(view)} for k, view in enumerate(job.views)}
    return LightField(display_of(job.head["display"], modules), modules, 3 * len(_seen(job)), [_SHOT])


def put_view(field: LightField, job: Job, item: Item, textures: Textures) -> None:
    """Give a light field the textures of an item that view.png shows."""
    pixels: list[Any] = [textures.image if layer == "color" else textures.shaded for layer in _seen(job)]
    field.put(item.view, *pixels)


def write_manifest(folder: Path, manifest: dict[str, Any], settings: Settings) -> None:
    """Write a manifest, and the angles or vectors that it speaks of."""
    if isinstance(settings.rotation, np.ndarray):
        from lfssao.files.npy import write_npy  # late: most rotations have a name

        file = folder / NOISE[name_of_noise(settings.rotation)]
        write_whole(file, partial(write_npy, array=settings.rotation))
    write_text(folder / MANIFEST, json.dumps(manifest, indent=1, allow_nan=False) + "\n")
