"""Facts of a comparison for its page: when and by which version, how its reference was rendered, digests of files."""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from lfssao import __version__
from lfssao.rendering.folder import reading_manifest
from lfssao.verify.compare.source import Mine, Reference

Facts = tuple[tuple[str, str], ...]


def facts_of(mine: Mine, reference: Reference, modules: Sequence[str]) -> Facts:
    """Names and texts of the facts, in the order of the page; a reference without a manifest has few.

    Each readable file of these modules has its SHA-256. A manifest may lack everything that ``compare`` has not read
    before. InputError if it holds something that 'lfssao render' does not write.
    """
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    with reading_manifest(reference.path):
        texts = {"compared": f"{now}, by lfssao {__version__}", **_reference_facts(reference.manifest or {})}
    facts = [(name, text) for name, text in texts.items() if text]
    paths = [file.path for name in modules for file in mine.files[name]]
    for path in filter(Path.is_file, dict.fromkeys([*paths, *(reference.files[name] for name in modules)])):
        with suppress(OSError), path.open("rb") as file:
            facts.append((str(path), f"SHA-256 {hashlib.file_digest(file, 'sha256').hexdigest()}"))
    return tuple(facts)


def _reference_facts(manifest: Mapping[str, Any]) -> dict[str, str]:
    machine, settings, sampling = (manifest.get(key) or {} for key in ("machine", "settings", "sampling"))
    views = [manifest[kind]["name"] for kind in ("display", "quilt", "lenslet") if manifest.get(kind)]
    radii = ", ".join(f"{radius:.6g}" for radius in settings.get("radii", ()))
    words = (str(sampling[key]) for key in ("count", "method") if key in sampling)
    return {
        "reference": f"rendered by lfssao {machine['lfssao']}" if "lfssao" in machine else "",
        "command": shlex.join(map(str, machine.get("command") or ())),
        "scene": str((manifest.get("scene") or {}).get("name", "")),
        "display": str(views[0] if views else ""),
        "camera": str(manifest.get("camera") or ""),
        "estimator": str(settings.get("estimator", "")),
        "radii": radii and f"{radii} world units",
        "samples": " ".join(words) + (f", seed {sampling['seed']}" if "seed" in sampling else ""),
    }
