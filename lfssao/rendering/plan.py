"""Work that a job leaves out because its scene does not need it, why, and what that saves; textures stay the same."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import inf
from timeit import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import Buffers, Neighbour
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View, seen_rows
from lfssao.rendering.passes import COUNTING, occlusions
from lfssao.rendering.settings import Settings
from lfssao.rendering.textures import Textures

RULES = {
    "modules": "the image of the scene's box misses the texture: nothing is cast, and no pass runs",
    "rows": "rows outside the image of the scene's box see nothing and are not cast (flat displays and cameras)",
    "background": "AO of a texel without a surface is 0: estimators lf and lf-neighbours look up no sample of it",
    "radii": "a radius that comes again has the texture of the first",
    "samples of radius 0": "all of radius 0 have one outcome: estimators lf and lf-neighbours look up one of them",
    "normals": "neither the estimator reads normals nor were they asked for",
    "colour": "the mesh has no colour: AO is multiplied into white",
}


# How many of a thing are left out, and of how many in all, by its name; ``RULES`` says why.
LeftOut = dict[str, tuple[int, int]]


def planned(views: Sequence[View], boxes: Sequence[NDArray[np.float64]], settings: Settings, colored: bool) -> LeftOut:
    """Work left out that is known before rays are cast; ``boxes`` are the scene's in each frame, (2, 3) float64."""
    visible = [(view, seen_rows(view, box)) for view, box in product(views, boxes)]
    heights = [(view.height, len(rows)) for view, rows in visible if rows]
    samples = 1 if settings.samples is None else len(settings.samples)
    radii = len(settings.radii)
    one = settings.estimator in COUNTING and 0.0 in settings.radii
    counts = {
        "modules": (len(visible) - len(heights), len(visible)),
        "rows": (sum(height - cast for height, cast in heights), sum(height for height, _ in heights)),
        "radii": (radii - len(set(settings.radii)), radii),
        "samples of radius 0": ((samples - 1) * one, samples),
        "normals": (len(heights) * (settings.normals is None), len(heights)),
        "colour": (len(heights) * (not colored), len(heights)),
    }
    return {what: numbers for what, numbers in counts.items() if numbers[0]}


def background(settings: Settings, texels: int, surface_texels: int) -> LeftOut:
    """The texels whose AO is not computed, known once rays are cast."""
    skipped = (texels - surface_texels) * (settings.estimator in COUNTING)
    return {"background": (skipped, texels)} if skipped else {}


def ao_seconds(textures: Textures, settings: Settings, neighbours: Sequence[Neighbour] = ()) -> tuple[float, float]:
    """Return seconds of a view's AO as it runs, and with all that is left out; the shortest of five runs each."""
    view = textures.view
    gbuffer = textures.gbuffer
    all_radii = replace(settings, radii=other_radii(settings.radii))
    cases = (gbuffer, settings), (without_background(gbuffer), all_radii)
    works = (partial(occlusions, Buffers.of(seen, view, neighbours), chosen) for seen, chosen in cases)
    as_it_runs, with_all = (min(repeat(work, number=1, repeat=5)) for work in works)
    return as_it_runs, with_all


def other_radii(radii: Iterable[float]) -> tuple[float, ...]:
    """Radii that are not 0, differ, and have the offsets of these in float32 but for one in millions."""
    # Each some ulps larger: float32 rounds their offsets to the same numbers.
    return tuple((radius or 1e-60) * (1 + k * 2.0**-52) for k, radius in enumerate(radii))


def without_background(gbuffer: GBuffer) -> GBuffer:
    """Return the G-buffer with its farthest surface in all texels that see none."""
    assert gbuffer.positions is not None  # AO reads them
    seen = gbuffer.triangle >= 0
    at = np.argmax(np.where(seen, gbuffer.depth, -inf))
    far = gbuffer.depth.flat[at]
    point = gbuffer.positions.reshape(-1, 3)[at]
    if not seen.any():
        far = np.float32(0)
        point = np.zeros(3, np.float32)
    depth = np.where(seen, gbuffer.depth, far)
    positions = np.where(seen[..., None], gbuffer.positions, point)
    return replace(gbuffer, depth=depth, positions=positions)


def described(left: LeftOut) -> list[dict[str, Any]]:
    """Return the entries of the manifest."""
    return [{"what": what, "left_out": count, "of": of, "why": RULES[what]} for what, (count, of) in left.items()]
