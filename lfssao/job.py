"""A render job: textures to EXR files, a manifest and a contact sheet in one folder."""

import json
import os
import re
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.contact import contact_sheet, sheet_rows, strip
from lfssao.errors import InputError
from lfssao.exr import Part, write_exr
from lfssao.files import write_whole
from lfssao.manifest import FORMAT, describe_view, digest
from lfssao.render import Settings, Textures

_OCCLUSION = "occlusion: 0 open, 1 covered; visibility is 1 - AO"


_MOST_TEXELS = 2**31 - 1  # kernels count texels in int32


def check_memory(width: int, height: int, radius_count: int) -> None:
    """Refuse a texture that this machine has no memory for, before any is taken.

    Raises
    ------
    InputError
        If the passes of one view need more than is available, or texels cannot be counted in int32.
    """
    texels = width * height
    if texels > _MOST_TEXELS:
        raise InputError(f"resolution {width}x{height}: a texture has at most {_MOST_TEXELS} texels")
    # Peaks of shading and writing and, with many radii, of the merge: measured at 12 and 48 million texels.
    needed = texels * max(108 + 4 * radius_count, 48 + 8 * radius_count)
    available = available_memory()
    if available is not None and needed > available:
        raise InputError(
            f"resolution {width}x{height}: the passes of one texture and {radius_count} radii need about "
            f"{needed / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available"
        )


def available_memory() -> int | None:
    """Bytes that programs can still take without swapping, else all there are; None where the system does not say."""
    with suppress(OSError):
        found = re.search(r"MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(encoding="ascii"))
        if found:
            return 1024 * int(found[1])
    with suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def exr_parts(textures: Textures, settings: Settings) -> list[Part]:
    """The textures of one view as the parts of an EXR file, the shaded image first, as viewers show part 0.

    Channels: R G B (shaded); Z (depth); P.X P.Y P.Z (world position); color.R color.G color.B; ao_K.AO for radius K,
    merged.AO, blurred.AO; N.X N.Y N.Z (world normals) if asked for. AO is occlusion everywhere, and the metadata says
    so. Depth, positions, colour and normals keep the guard band, as a data window larger than the display window.
    """
    gbuffer, guard = textures.gbuffer, textures.view.guard
    parts = [
        Part("shaded", ("R", "G", "B"), textures.shaded, {"depth": textures.view.depth_kind}),
        Part("depth", ("Z",), gbuffer.depth[..., None], {"depth": textures.view.depth_kind}, guard),
        Part("positions", ("P.X", "P.Y", "P.Z"), gbuffer.positions, {"space": "world"}, guard),
    ]
    if gbuffer.color is not None:
        parts.append(Part("color", ("color.R", "color.G", "color.B"), gbuffer.color, {"space": "linear RGB"}, guard))
    if gbuffer.normals is not None:
        parts.append(Part("normals", ("N.X", "N.Y", "N.Z"), gbuffer.normals, {"space": "world"}, guard))
    for number, (radius, texture) in enumerate(zip(settings.radii, textures.ao, strict=True), start=1):
        name = f"ao_{number}"
        parts.append(_occlusion_part(name, texture, {"radius": float(radius)}))
    parts.append(_occlusion_part("merged", textures.merged, {}))
    parts.append(_occlusion_part("blurred", textures.blurred, {"sigma": float(settings.blur)}))
    return parts


def _occlusion_part(name: str, texture: Any, attributes: dict[str, float]) -> Part:
    return Part(name, (f"{name}.AO",), texture[..., None], {"AO": _OCCLUSION, **attributes})


class Job:
    """Writes the views of one job into a folder as they come, the manifest last.

    A manifest of an earlier job goes with the first file that is replaced: it would speak of files that are gone.

    Parameters
    ----------
    folder : Path
        Where to; it exists.
    settings : Settings
        What the AO passes were run with.
    count : int
        How many views will come.
    head : dict
        What the manifest says of scene, display and machine.
    """

    def __init__(self, folder: Path, settings: Settings, count: int, head: dict[str, Any]) -> None:
        self._folder = folder
        self._settings = settings
        self._shown = sheet_rows(count)
        self._strips: list[tuple[str, Any]] = []
        self._entries: list[dict[str, Any]] = []
        self._head = head

    def add(self, textures: Textures) -> None:
        """Write one view's EXR file and remember what the manifest and the contact sheet say of it."""
        start = time.perf_counter()
        parts = exr_parts(textures, self._settings)
        path = self._folder / f"{textures.view.name}.exr"
        manifest = self._folder / "manifest.json"
        if manifest.is_file():
            manifest.unlink()
        write_exr(path, parts)
        if len(self._entries) in self._shown:
            self._strips.append((textures.view.name, strip(textures.image, textures.blurred, textures.shaded)))
        seconds = {**textures.seconds, "write": time.perf_counter() - start}
        self._entries.append(
            {
                "name": textures.view.name,
                "file": path.name,
                "bytes": path.stat().st_size,
                "view": describe_view(textures.view),
                "surface_texels": int((textures.gbuffer.triangle >= 0).sum()),
                "samples_outside": list(textures.outside),
                "seconds": seconds,
                "textures": {part.name: _describe_part(part) for part in parts},
            }
        )

    def finish(self, seconds: dict[str, float]) -> None:
        """Write the contact sheet and, last, the manifest; ``seconds`` are those of the whole job."""
        sheet = contact_sheet(self._strips)
        write_whole(self._folder / "contact.png", sheet.save)
        manifest = {
            "format": FORMAT,
            **self._head,
            "seconds": {**seconds, "passes": _sums([entry["seconds"] for entry in self._entries])},
            "views": self._entries,
        }
        text = json.dumps(manifest, indent=1, allow_nan=False)
        write_whole(self._folder / "manifest.json", lambda path: _write_text(path, text + "\n"))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _describe_part(part: Part) -> dict[str, Any]:
    return {
        "channels": list(part.channels),
        "shape": list(part.pixels.shape),
        "dtype": str(np.dtype(part.pixels.dtype)),
        "sha256": digest(part.pixels),
    }


def _sums(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    """Each pass's seconds over all views."""
    names: Iterable[str] = dict.fromkeys(name for row in rows for name in row)
    return {name: sum(row.get(name, 0.0) for row in rows) for name in names}
