"""Time saved by leaving out what a scene does not need: ``python benchmarks/bench_plan.py``, JSON beside the table.

All passes of one view run in one thread as planned, and in turn with one thing done that the plan leaves out:

- rows: a box so large that all rows are cast;
- background: AO of a depth texture whose background is a surface far away, in place of the view's own;
- radii: radii that come again, and radius 0, replaced by others so near that the textures are the same.

Processor time is measured, so that other work on the machine counts little; a ratio is the median over the turns.
Textures with all rows and all radii are compared with those of the plan: leaving something out must not change a bit.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import sqrt
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from turns import turns

from lfssao.ao.textures import Buffers
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.display_file import find_display
from lfssao.optics.view import View
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.passes import occlusions, render_view
from lfssao.rendering.plan import other_radii, without_background
from lfssao.rendering.settings import Settings, default_radii
from lfssao.rendering.textures import Textures
from lfssao.rendering.views import module_views
from lfssao.scene.builtin import BUILTIN, builtin_scene
from lfssao.scene.mesh import Mesh

RULES = ("rows", "background", "radii")


@dataclass(frozen=True)
class Case:
    """A scene, the box that is fitted into the display, and the settings of the AO passes."""

    name: str
    mesh: Mesh
    box: NDArray[np.float64]
    settings: Settings


@dataclass(frozen=True)
class Saving:
    """Time of a case, and its ratio with things done that the plan leaves out."""

    scene: str  # the case's name
    cover: float  # fraction of the texels that see the scene
    milliseconds: float  # processor time of all passes as planned, the median
    # For each rule, and for all together ('all'), three quartiles of the time without the rule over the time as planned
    ratios: dict[str, tuple[float, ...]]
    same: bool  # whether the textures are the same, bit for bit


def cases(display: Display, quick: bool) -> Iterator[Case]:
    """Yield the embedded scenes fitted into the display and at a tenth of its middle module's texture, and others.

    Others: a scene outside the texture, radii 0 and twice, one radius without a blur, and a wall that fills the
    texture and leaves nothing to save.
    """
    for name in ("statue",) if quick else tuple(BUILTIN):
        mesh = builtin_scene(name)
        fitted = Settings(default_radii(mesh))
        yield Case(f"{name}, fitted", mesh, mesh.bounds, fitted)
        yield Case(f"{name}, a tenth", mesh, at_a_tenth(mesh, display), fitted)
    radii = fitted.radii
    yield Case(f"{name}, outside", mesh, around(mesh, 3, (40, 0, 0)), fitted)
    special = Settings((0.0, *radii[:2], *radii[:2]))
    yield Case(f"{name}, radii 0 and twice", mesh, mesh.bounds, special)
    yield Case(f"{name}, one radius, no blur", mesh, mesh.bounds, Settings(radii[:1], blur=0.0))
    sheet = wall()
    radii = (0.03, 0.06, 0.1, 0.18, 0.3)
    front = np.array([[-1.0, -0.75, -0.3], [1.0, 0.75, 0.3]])
    yield Case("wall", sheet, front, Settings(radii))
    yield Case("wall, a tenth", sheet, at_a_tenth(sheet, display), Settings(radii))


def around(mesh: Mesh, size: float, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    """A box ``size`` times as large as the scene's, moved by multiples of it: fitted instead, it makes it small."""
    low, high = mesh.bounds
    middle = 0.5 * (low + high)
    box: NDArray[np.float64] = middle + (mesh.bounds - middle) * size + np.array(moved) * (high - low)
    return box


def at_a_tenth(mesh: Mesh, display: Display) -> NDArray[np.float64]:
    """The box whose fit makes the mesh cover a tenth of the middle module's texture."""
    size = sqrt(10 * cover(mesh, display, mesh.bounds))
    for _ in range(6):
        size *= sqrt(cover(mesh, display, around(mesh, size)) / 0.1)
    return around(mesh, size)


def cover(mesh: Mesh, display: Display, box: NDArray[np.float64]) -> float:
    """Fraction of the middle module's texels that see the scene."""
    view = middle_view(mesh, display, box)
    return float((RayCaster(mesh, view.cast_from_world).gbuffer(view, None).triangle >= 0).mean())


def middle_view(mesh: Mesh, display: Display, box: NDArray[np.float64]) -> View:
    """The view of the display's middle module."""
    views = module_views(mesh, display, None, 0, box)
    return views[len(views) // 2]


def wall(n: int = 256) -> Mesh:
    """A bumpy sheet of 2 n^2 triangles, 4 wide and high."""
    y, x = (k.ravel() for k in np.mgrid[: n + 1, : n + 1] / n * 4.0 - 2.0)
    z = 0.05 * np.sin(9 * x) * np.cos(7 * y)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a + 1, a + n + 2, a + n + 1], 1)])
    return Mesh(np.stack([x, y, z], 1), faces.astype(np.int32), name="wall")


def savings(made: Iterable[Case], display: Display, repeats: int) -> Iterator[Saving]:
    """Yield the times of each case over ``repeats`` turns, after one to warm up."""
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        for case in made:
            view = middle_view(case.mesh, display, case.box)
            yield _saving(case, RayCaster(case.mesh, view.cast_from_world), view, repeats)
    finally:
        numba.set_num_threads(threads)


def _saving(case: Case, caster: RayCaster, view: View, repeats: int) -> Saving:
    settings = case.settings
    all_rows = RayCaster(case.mesh, view.cast_from_world)
    all_rows.bounds = case.mesh.bounds * 1e6  # around the lens and the observers, so that no row is known to miss it
    first = render_view(caster, view, settings)
    seen = Buffers.of(first.gbuffer, view)
    filled = Buffers.of(without_background(first.gbuffer), view)
    renders = {
        "plan": partial(render_view, caster, view, settings),
        "rows": partial(render_view, all_rows, view, settings),
        "radii": partial(render_view, caster, view, replace(settings, radii=other_radii(settings.radii))),
    }
    same = all(bits(render()) == bits(first) for render in renders.values())
    ao = {"ao": partial(occlusions, seen, settings), "ao of all texels": partial(occlusions, filled, settings)}
    times = {name: warm for name, (_, warm) in turns({**renders, **ao}, repeats, time.process_time).items()}
    plan = times["plan"]
    more = {
        "rows": times["rows"] - plan,
        "background": times["ao of all texels"] - times["ao"],
        "radii": times["radii"] - plan,
    }
    more["all"] = more["rows"] + more["background"] + more["radii"]
    ratios = {name: tuple(np.percentile(1 + extra / plan, [25, 50, 75]).tolist()) for name, extra in more.items()}
    cover = float((first.gbuffer.triangle >= 0).mean())
    return Saving(case.name, cover, float(np.median(plan)), ratios, same)


def bits(textures: Textures) -> list[Any]:
    """All arrays and counts of a render, comparable."""
    seen = textures.gbuffer
    layers: list[NDArray[Any] | None] = [textures.merged, textures.blurred, textures.shaded, *textures.ao]
    layers += [seen.depth, seen.positions, seen.triangle, seen.color, seen.normals]
    return [textures.outside, *(None if layer is None else layer.tobytes() for layer in layers)]


HEAD = f"{'processor ms, and how many times as long with what is left out':64s}all  (quartiles)  " + "".join(
    f"{name:>12s}" for name in RULES
)


def as_text(saving: Saving) -> str:
    """One line of the table under ``HEAD``."""
    low, middle, high = saving.ratios["all"]
    each = "".join(f"{saving.ratios[name][1]:12.2f}" for name in RULES)
    line = f"{saving.scene:36s}{100 * saving.cover:5.0f} % seen {saving.milliseconds:9.1f}"
    return f"{line:61s}{middle:6.2f}  {low:.2f} to {high:.2f} {each}{'' if saving.same else '  BITS DIFFER'}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one embedded scene and the wall")
    parser.add_argument("--display", default="virtual")
    parser.add_argument("--repeats", type=int, default=25)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "plan.json")
    options = parser.parse_args(arguments)
    display = find_display(options.display)
    made = []
    print(HEAD, flush=True)
    for saving in savings(cases(display, options.quick), display, options.repeats):
        print(as_text(saving), flush=True)
        made.append(saving)
    result = {"machine": describe_machine(1, sys.argv), "scenes": [asdict(saving) for saving in made]}
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n")
    if not all(saving.same for saving in made):
        raise SystemExit("leaving something out changed bits")


if __name__ == "__main__":
    main()
