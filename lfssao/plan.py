"""The plan of a job as something to read: what runs, what does not, why, and what that is expected to save.

``lfssao.view_plan`` decides, and says why the bits stay. Nothing here renders. What no one can know before the rays are
cast, where surfaces will be, is stated as a rule; the manifest says what it came to.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.registry import find_estimator
from lfssao.passes import gaussian_kernel
from lfssao.rendering import Settings
from lfssao.scene.mesh import Mesh
from lfssao.view import View
from lfssao.view_plan import ViewPlan

# When something is left out: by the plan, by a rule of the plan while it runs, or inside a kernel, plan or no plan.
PLANNED, AT_RUN_TIME, BUILT_IN = "planned", "at run time", "built in"

# Nanoseconds of one thread's processor time, rounded from the passes' times in the scenes of lfssao.bench.savings,
# nothing left out, on one machine busy with other work. They tell what is worth leaving out, not how long a job takes:
# a scene's texels and triangles cost up to twice as much or half, other machines have other numbers.
_NS_A_TRIANGLE = 30.0  # its bounds in each view
_NS_A_BACKGROUND_TEXEL = 5.0  # the G-buffer of a texel that sees nothing
_NS_A_SAMPLE = 1.4


@dataclass(frozen=True)
class Cut:
    """One thing that is left out, or that is not.

    Attributes
    ----------
    what : str
        Modules, rays, radii, samples and so on.
    where : str
        Which of them, in words.
    run, left_out : int or None
        How many run and how many do not, of the whole job; None where only the run will tell.
    saving : float or None
        Share, 0 to 1, of that work which is left out; None where only the run will tell.
    milliseconds : float or None
        What that is expected to save, of the whole job on one thread.
    when : str
        'planned', 'at run time', or 'built in': inside a kernel, whether there is a plan or not.
    reason : str
        One sentence.
    """

    what: str
    where: str
    run: int | None
    left_out: int | None
    saving: float | None
    milliseconds: float | None
    when: str
    reason: str


@dataclass(frozen=True, eq=False)
class Plan:
    """The plan of a job.

    Attributes
    ----------
    views : tuple of (str, ViewPlan)
        Name and plan of each view, frame by frame.
    cuts : tuple of Cut
        What is left out, and what is not.
    """

    views: tuple[tuple[str, ViewPlan], ...]
    cuts: tuple[Cut, ...]

    def summary(self) -> list[dict[str, Any]]:
        """The cuts as JSON has them."""
        return [asdict(cut) for cut in self.cuts]


def make_plan(
    mesh: Mesh, views: Sequence[View], settings: Settings, boxes: Sequence[NDArray[np.float64]] | None = None
) -> Plan:
    """The plan of a job.

    Parameters
    ----------
    mesh : Mesh
        The scene.
    views : sequence of View
        What is rendered, in each frame.
    settings : Settings
        What the AO passes are run with.
    boxes : sequence of (2, 3) float64, optional
        A box around the scene in each frame, world units; the mesh's own, one frame, by default.
    """
    frames = [mesh.bounds] if boxes is None else boxes
    plans = tuple((view.name, ViewPlan.of(view, box, settings)) for box in frames for view in views)
    only = [plan for _, plan in plans]
    seen = [plan for plan in only if plan.window.texels]
    cuts = (
        _modules(plans, len(mesh.faces)),
        _rays(seen),
        *_layers(mesh, settings, seen),
        *_radii(settings, seen),
        *_behind(settings, seen),
        Cut(
            "neighbours", f"{settings.neighbours} asked beside each module", settings.neighbours * len(seen), None,
            None, None, PLANNED,
            "their depth textures are cast as far as they may see the scene, none where none is asked; one that sees "
            "nothing is still asked, for it shows samples in the open",
        ),
        Cut(
            "64-bit", "rays", None, 0, 0.0, 0.0, PLANNED,
            "AO, merge, blur and image are float32 as it is; depth and positions are float64 results rounded once, "
            "which float32, an error of 2^-24 at each step, cannot give to the last bit; nor would it save time to "
            "leave out in float32 first what misses beyond doubt, 16 pairs of triangle and texel as a vector: first "
            "hits take 1.0 to 1.2 times as long so",
        ),
    )  # fmt: skip
    return Plan(plans, cuts)


def _modules(plans: Sequence[tuple[str, ViewPlan]], faces: int) -> Cut:
    empty = [(name, plan) for name, plan in plans if not plan.window.texels]
    if not empty:
        reason = "the image of the scene's box meets every texture"
        return Cut("modules", "all", len(plans), 0, 0.0, 0.0, PLANNED, reason)
    names = list(dict.fromkeys(name for name, _ in empty))
    where = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
    saved = sum(_NS_A_TRIANGLE * faces + _NS_A_BACKGROUND_TEXEL * plan.whole.texels for _, plan in empty) * 1e-6
    reason = "the image of the scene's box misses these textures: no ray can hit, all of them are background"
    return Cut("modules", where, len(plans) - len(empty), len(empty), len(empty) / len(plans), saved, PLANNED, reason)


def _rays(plans: Sequence[ViewPlan]) -> Cut:
    run, texels = sum(plan.window.texels for plan in plans), sum(plan.whole.texels for plan in plans)
    out = texels - run
    bounded = any(plan.window != plan.whole for plan in plans)
    reason = "rows above and below the image of the scene's box see nothing; in columns beside it no triangle is tried"
    if not bounded:
        reason = "the image of the scene's box has all rows of each texture, or reaches the lens or the viewers"
    return Cut("rays", "one a texel", run, out, _share(out, texels), out * _NS_A_BACKGROUND_TEXEL * 1e-6, PLANNED,
               reason)  # fmt: skip


def _layers(mesh: Mesh, settings: Settings, plans: Sequence[ViewPlan]) -> list[Cut]:
    count, out = len(plans), []
    colored = mesh.paint is not None
    out.append(
        Cut(
            "color",
            "layer",
            count * colored,
            count * (not colored),
            float(not colored),
            None,
            BUILT_IN,
            "the mesh has colour" if colored else "the mesh has no colour: white is shaded, no image is made",
        )
    )
    reads = find_estimator(settings.estimator).normals
    needed = settings.normals is not None
    reason = f"estimator {settings.estimator} reads normals" if reads else "normals were asked for"
    if not needed:
        reason = f"estimator {settings.estimator} reads no normals, and none were asked for"
    out.append(Cut("normals", "layer", count * needed, count * (not needed), float(not needed), None, BUILT_IN, reason))
    return out


def _radii(settings: Settings, plans: Sequence[ViewPlan]) -> list[Cut]:
    radii, count = settings.radii, len(plans)
    texels = sum(plan.window.texels for plan in plans)
    samples = 1 if settings.samples is None else len(settings.samples)
    first = [radii.index(radius) == number for number, radius in enumerate(radii)]
    again = count * (len(radii) - sum(first))
    a_layer = texels * samples * _NS_A_SAMPLE * 1e-6
    reason = "no radius comes twice" if not again else "a radius that comes again has the texture of the first"
    share = _share(again, count * len(radii))
    cuts = [
        Cut("radii", ", ".join(f"{r:g}" for r in radii), count * sum(first), again, share,
            share * len(radii) * a_layer, PLANNED, reason)
    ]  # fmt: skip
    zero = 0.0 in radii and settings.estimator == "lf"
    looked_up = count * samples * sum(first)
    saved = count * (samples - 1) * zero
    ms = texels * (samples - 1) * zero * _NS_A_SAMPLE * 1e-6
    reason = "around a point all samples of radius 0 have one outcome: one is asked" if zero else "no radius is 0"
    if settings.estimator != "lf":
        reason = f"samples of estimator {settings.estimator} are its own affair"
    cuts.append(
        Cut("samples", "of each radius and view", looked_up - saved, saved, _share(saved, looked_up), ms, PLANNED,
            reason)
    )  # fmt: skip
    cuts.append(
        Cut("AO", "texels without a surface", None, None, None, None, BUILT_IN,
            "rows are sampled in runs that see a surface; where a view shows none, no estimator runs")
    )  # fmt: skip
    return cuts


def _behind(settings: Settings, plans: Sequence[ViewPlan]) -> list[Cut]:
    count = len(plans)
    taps = len(gaussian_kernel(settings.blur))
    plain = taps == 1
    blur = Cut("blur", "passes", count * (not plain), count * plain, float(plain), None, BUILT_IN,
               "sigma is 0: the blur is a copy" if plain else f"sigma is {settings.blur:g}")  # fmt: skip
    return [blur]


def _share(part: float, whole: float) -> float:
    return part / whole if whole else 0.0
