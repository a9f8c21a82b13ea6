"""A render job: what becomes of the results, and what it needs."""

import json
import os
import re
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lfssao.ao.estimators.registry import find_estimator
from lfssao.core.files import remove_leftovers, write_text, write_whole
from lfssao.core.sums import sum_in_order
from lfssao.errors import InputError
from lfssao.rendering import plan
from lfssao.rendering.contact import contact_sheet
from lfssao.rendering.manifest import FORMAT
from lfssao.rendering.output import Result
from lfssao.rendering.work import Item, Work

_MOST_TEXELS = 2**31 - 1  # kernels count texels in int32


def check_memory(width: int, height: int, radius_count: int, texel_bytes: int) -> None:
    """Refuse a texture that this machine has no memory for, before any is taken.

    Parameters
    ----------
    width, height : int
        Of the texture, guard band included.
    radius_count : int
        How many radii are merged.
    texel_bytes : int
        The estimator's (``Estimator.texel_bytes``).

    Raises
    ------
    InputError
        If the passes of one view need more than is available, or texels cannot be counted in int32.
    """
    texels = width * height
    if texels > _MOST_TEXELS:
        raise InputError(f"resolution {width}x{height}: a texture has at most {_MOST_TEXELS} texels")
    needed, available = needed_memory(texels, radius_count, texel_bytes), available_memory()
    if available is not None and needed > available:
        raise InputError(
            f"resolution {width}x{height}: the passes of one texture and {radius_count} radii need about "
            f"{needed / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available"
        )


def needed_memory(texels: int, radius_count: int, texel_bytes: int) -> int:
    """Bytes that one view takes, from its ray cast to its file; ``texel_bytes`` is the estimator's."""
    # Peaks of shading and writing, measured at 12 and 48 million texels with 5 and with 40 radii; and of the last
    # radius' estimate, beside the G-buffer and the other radii.
    return texels * (4 * radius_count + max(108, 40 + texel_bytes))


def views_at_once(work: Work, most: int) -> int:
    """How many views may be in memory at the same time, at least 1 and at most ``most``."""
    available = available_memory()
    if available is None:
        return most
    radius_count, texel_bytes = len(work.settings.radii), find_estimator(work.settings.estimator).texel_bytes
    needed = max(needed_memory(view.width * view.height, radius_count, texel_bytes) for view in work.views)
    return max(1, min(most, available // needed))


def available_memory() -> int | None:
    """Bytes that programs can still take without swapping, else all there are; None where the system does not say."""
    with suppress(OSError):
        found = re.search(r"MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(encoding="ascii"))
        if found:
            return 1024 * int(found[1])
    with suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


class Job:
    """Gathers the results of a work's items and writes each frame's contact sheet and, last, its manifest.

    Parameters
    ----------
    work : Work
        What is rendered.
    head : dict
        What the manifests say of scene, display and machine.
    seconds : dict
        Seconds of what came before.
    """

    def __init__(self, work: Work, head: dict[str, Any], seconds: dict[str, float]) -> None:
        self._work = work
        self._head = head
        self._seconds = seconds
        self._start = time.perf_counter()
        self._results: dict[int, dict[int, Result]] = {}

    def open(self, items: Iterable[Item]) -> None:
        """Make folders ready for the items that are still to be done.

        The manifest and the sheet of an earlier job go before its files are replaced: they show files that are gone.
        """
        for frame in range(self._work.frame_count):
            remove_leftovers(self._work.frame_folder(frame))
        for frame in {item.frame for item in items}:
            for name in ("manifest.json", "contact.png"):
                if (path := self._work.frame_folder(frame) / name).is_file():
                    path.unlink()

    def add(self, item: Item, result: Result) -> None:
        """Take one result, in any order; the last one of a frame finishes the frame."""
        frame = self._results.setdefault(item.frame, {})
        frame[item.view] = result
        if len(frame) == len(self._work.views):
            self.finish(item.frame, [frame[view] for view in range(len(frame))])
            self._results[item.frame] = {}

    def finish(self, frame: int, results: Sequence[Result]) -> None:
        """Write a frame's contact sheet, if it has one, and manifest."""
        folder, entries = self._work.frame_folder(frame), [result.entry for result in results]
        remove_leftovers(folder)  # of workers that were killed on the way
        if self._work.has_sheet:
            sheet = contact_sheet([(r.entry["name"], r.strip) for r in results if r.strip is not None])
            write_whole(folder / "contact.png", sheet.save)
        seconds = {
            **self._seconds,
            "render": time.perf_counter() - self._start,
            "passes": _sums([entry["seconds"] for entry in entries]),
        }
        manifest = {"format": FORMAT, **self._head, "frame": self._frame(frame), "plan": self._plan(frame, entries)}
        manifest |= {"seconds": seconds, "views": entries}
        write_text(folder / "manifest.json", json.dumps(manifest, indent=1, allow_nan=False) + "\n")

    def _plan(self, frame: int, entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """What was left out of a frame."""
        work, texels = self._work, sum(view.width * view.height for view in self._work.views)
        left = plan.planned(work.views, [work.boxes[frame]], work.settings, work.mesh.paint is not None)
        left += plan.background(work.settings, texels, sum(entry["surface_texels"] for entry in entries))
        return plan.described(left)

    def _frame(self, frame: int) -> dict[str, Any] | None:
        if self._work.transforms is None:
            return None
        transform = self._work.transform(frame).tolist()
        return {"number": frame, "count": self._work.frame_count, "world_from_scene": transform}


def _sums(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    """Each pass's seconds over all views."""
    names: Iterable[str] = dict.fromkeys(name for row in rows for name in row)
    return {name: sum_in_order(row.get(name, 0.0) for row in rows) for name in names}
