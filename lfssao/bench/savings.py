"""What leaving out what a scene does not need saves: renders of one view with and without, in turn.

All passes of one view in one thread, with everything run (``render --no-plan``), with the plan, and with one of its
cuts alone. Processor time, so that other work on the machine counts little; a ratio is the median of those of each
turn. The textures of all of them are compared: a cut that changed a bit would be no cut.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lfssao.bench.times import balanced_orders
from lfssao.display import Display
from lfssao.oracle import verdict
from lfssao.raycast import RayCaster
from lfssao.rendering import Settings, Textures, default_radii, module_views, render_view
from lfssao.scene.builtin import BUILTIN, builtin_scene
from lfssao.scene.mesh import Mesh
from lfssao.view import View
from lfssao.view_plan import ViewPlan

ALL, PLAN = "all", "plan"

# The plan, and its cuts one by one: fields of a ViewPlan that are taken from the plan.
CUTS: dict[str, tuple[str, ...]] = {
    "rays": ("window",),
    "radii": ("same_as", "one_sample"),
}


@dataclass(frozen=True)
class Case:
    """A scene and where it is in the texture.

    Attributes
    ----------
    name : str
        What tables call it.
    mesh : Mesh
        The scene.
    box : (2, 3) float64
        What is fitted into the display, world units.
    settings : Settings
        What the AO passes are run with.
    """

    name: str
    mesh: Mesh
    box: NDArray[np.float64]
    settings: Settings


@dataclass(frozen=True)
class Saving:
    """What a case takes, and how many times less without what it does not need.

    Attributes
    ----------
    scene : str
        The case's name.
    cover : float
        Share of the texels that see the scene.
    milliseconds : dict
        Processor time of everything, of the plan and of each cut alone, medians.
    ratios : dict
        Quartiles of the time of everything over that of the plan and of each cut alone.
    same : bool
        Whether all of them made the same textures, bit for bit.
    """

    scene: str
    cover: float
    milliseconds: dict[str, float]
    ratios: dict[str, tuple[float, float, float]]
    same: bool


def cases(display: Display, quick: bool) -> Iterator[Case]:
    """The embedded scenes fitted into the display and at a tenth of its middle module's texture, and others.

    Others: a scene beside the texture, radii 0 and twice, one radius without a blur, and a wall that fills the
    texture, of which nothing can be left out.
    """
    for name in ("statue",) if quick else tuple(BUILTIN):
        mesh = builtin_scene(name)
        fitted = Settings(default_radii(mesh))
        yield Case(f"{name}, fitted", mesh, mesh.bounds, fitted)
        yield Case(f"{name}, a tenth", mesh, at_a_tenth(mesh, display), fitted)
    radii = fitted.radii
    yield Case(f"{name}, beside", mesh, around(mesh, 3, (40, 0, 0)), fitted)
    special = Settings((0.0, *radii[:2], *radii[:2]))
    yield Case(f"{name}, radii 0 and twice", mesh, mesh.bounds, special)
    yield Case(f"{name}, one radius, no blur", mesh, mesh.bounds, Settings(radii[:1], blur=0.0))
    sheet, radii = wall(), (0.03, 0.06, 0.1, 0.18, 0.3)
    front = np.array([[-1.0, -0.75, -0.3], [1.0, 0.75, 0.3]])
    yield Case("wall", sheet, front, Settings(radii))
    yield Case("wall, a tenth", sheet, at_a_tenth(sheet, display), Settings(radii))


def around(
    mesh: Mesh, size: float, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> NDArray[np.float64]:  # fmt: skip
    """A box ``size`` times as large as the scene's, moved by shares of it: fitted instead, it makes the scene small."""
    low, high = mesh.bounds
    middle = 0.5 * (low + high)
    box: NDArray[np.float64] = middle + (mesh.bounds - middle) * size + np.array(moved) * (high - low)
    return box


def at_a_tenth(mesh: Mesh, display: Display) -> NDArray[np.float64]:
    """The box to fit where the mesh is to cover a tenth of the middle module's texture."""
    size = sqrt(10 * cover(mesh, display, mesh.bounds))
    for _ in range(6):
        size *= sqrt(cover(mesh, display, around(mesh, size)) / 0.1)
    return around(mesh, size)


def cover(mesh: Mesh, display: Display, box: NDArray[np.float64]) -> float:
    """Share of the middle module's texels that see the scene."""
    view = middle_view(mesh, display, box)
    return float((RayCaster(mesh, view.cast_from_world).gbuffer(view, None).triangle >= 0).mean())


def middle_view(mesh: Mesh, display: Display, box: NDArray[np.float64]) -> View:
    """The view of the display's middle module."""
    views = module_views(mesh, display, None, 0, box)
    return views[len(views) // 2]


def wall(n: int = 256) -> Mesh:
    """A bumpy sheet of 2 n^2 triangles, before the middle of a box that is half as wide and high."""
    y, x = (k.ravel() for k in np.mgrid[: n + 1, : n + 1] / n * 4.0 - 2.0)
    z = 0.05 * np.sin(9 * x) * np.cos(7 * y)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a + 1, a + n + 2, a + n + 1], 1)])
    return Mesh(np.stack([x, y, z], 1), faces.astype(np.int32), name="wall")


def savings(made: Iterable[Case], display: Display, repeats: int) -> Iterator[Saving]:
    """What each case takes with and without what it does not need; so many turns of each, after one to warm up."""
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        for case in made:
            view = middle_view(case.mesh, display, case.box)
            caster = RayCaster(case.mesh, view.cast_from_world)
            yield _saving(case, caster, view, ViewPlan.everything(view, case.settings), repeats)
    finally:
        numba.set_num_threads(threads)


def _saving(case: Case, caster: RayCaster, view: View, everything: ViewPlan, repeats: int) -> Saving:
    def planned() -> ViewPlan:
        return ViewPlan.of(view, caster.bounds, case.settings)

    def cut(fields: tuple[str, ...]) -> Callable[[], ViewPlan]:
        return lambda: replace(everything, **{name: getattr(planned(), name) for name in fields})

    variants: dict[str, Callable[[], ViewPlan]] = {ALL: lambda: everything, PLAN: planned}
    variants |= {name: cut(fields) for name, fields in CUTS.items()}
    times: dict[str, list[float]] = {name: [] for name in variants}
    first, same = render_view(caster, view, case.settings, (), everything), True
    names, orders = list(variants), balanced_orders(len(variants))
    for turn in range(repeats + 1):
        for name in (names[k] for k in orders[turn % len(orders)]):
            start = time.process_time()
            textures = render_view(caster, view, case.settings, (), variants[name]())
            taken = 1e3 * (time.process_time() - start)
            if turn:
                times[name].append(taken)
            else:
                same = same and equal_bits(first, textures)
    ratios = {}
    for name in variants:
        if name != ALL:
            low, middle, high = np.percentile(np.divide(times[ALL], times[name]), [25, 50, 75]).tolist()
            ratios[name] = low, middle, high
    milliseconds = {name: float(np.median(values)) for name, values in times.items()}
    return Saving(case.name, float((first.gbuffer.triangle >= 0).mean()), milliseconds, ratios, same)


def equal_bits(one: Textures, other: Textures) -> bool:
    """Whether two renders of a view made the same textures and counted the same samples outside."""
    if one.outside != other.outside:
        return False
    for a, b in zip(_layers(one), _layers(other), strict=True):
        if (a is None) != (b is None):
            return False
        if a is not None and b is not None and not verdict.equal_bits(a, b).all():
            return False
    return True


def _layers(textures: Textures) -> tuple[NDArray[Any] | None, ...]:
    seen = textures.gbuffer
    return (textures.merged, textures.blurred, textures.image, textures.shaded, *textures.ao, seen.depth,
            seen.positions, seen.triangle, seen.color, seen.normals)  # fmt: skip


HEAD = f"{'processor ms of everything (--no-plan), and how many times less with':69s}plan  (quartiles)  " + "".join(
    f"{name:>8s}" for name in CUTS
)


def as_text(saving: Saving) -> str:
    """One line of the table under ``HEAD``."""
    low, middle, high = saving.ratios[PLAN]
    each = "".join(f"{saving.ratios[name][1]:8.2f}" for name in CUTS)
    line = f"{saving.scene:36s}{100 * saving.cover:5.0f} % seen {saving.milliseconds[ALL]:14.1f}"
    return f"{line:67s}{middle:6.2f}  {low:.2f} to {high:.2f} {each}{'' if saving.same else '  BITS DIFFER'}"
