"""Stiff and extreme cases, by name: what is stiff about each, what it is run on, and what it must come to."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench import curved, probes
from lfssao.bench.measure import FINE, PATHS, Measured, Stiff, measure
from lfssao.bench.refusals import REFUSALS
from lfssao.display import Display, Module
from lfssao.errors import InputError
from lfssao.matrix import Matrix

WITHIN = "within bound"
DEGRADED = "degraded as stated"
REFUSED = "refused"
BROKEN = "broken"
SIZE = 8
STEPS = 60
AT_THE_SLIT = "the point's own rounding over its distance from the slit, which it cannot say any finer"

_UNCHANGED = np.hstack([np.eye(3), np.zeros((3, 1))])


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    case, stiff, input, path : str
        The case, what is stiff about it, its input, and 'float32' or 'float64'.
    measured : Measured or None
        Errors and decisions; None where the case is refused.
    verdict : str
        WITHIN, DEGRADED, REFUSED, or BROKEN where it is not what the case states.
    reason : str
        What degrades, or the sentence of the refusal.
    """

    case: str
    stiff: str
    input: str
    path: str
    measured: Measured | None
    verdict: str
    reason: str = ""


@dataclass(frozen=True)
class Case:
    """Inputs of one kind of stiffness, whose image is compared with the exact one.

    Attributes
    ----------
    name, stiff : str
        What it is called, and what is stiff about it.
    inputs : function
        Yields pairs of a text and a Stiff, or a function that measures a path.
    degraded : mapping
        Path to the sentence that says what degrades on it; a path that is not in it stays within 2^-8 texel.
    """

    name: str
    stiff: str
    inputs: Callable[[], Iterator[tuple[str, Stiff | Callable[[str], Measured]]]]
    degraded: Mapping[str, str]

    def rows(self) -> Iterator[Row]:
        """Measure all inputs on both paths."""
        for text, stiff in self.inputs():
            for path in PATHS:
                measured = measure(stiff, path) if isinstance(stiff, Stiff) else stiff(path)
                verdict = DEGRADED if measured.bound > FINE or measured.flipped else WITHIN
                stated = path in self.degraded
                if measured.exceeded or (verdict == DEGRADED and not stated):
                    verdict = BROKEN
                yield Row(
                    self.name, self.stiff, text, path, measured, verdict,
                    self.degraded[path] if verdict == DEGRADED else "",
                )  # fmt: skip


@dataclass(frozen=True)
class Refusal:
    """What cannot be served, and is refused before the work starts.

    Attributes
    ----------
    name, stiff, text : str
        What it is called, what is stiff about it, and its input.
    attempt : function
        Asks for it.
    says : str
        A part of the sentence.
    """

    name: str
    stiff: str
    text: str
    attempt: Callable[[], object]
    says: str

    def rows(self) -> Iterator[Row]:
        """One row: BROKEN unless the attempt is refused, in these words."""
        try:
            self.attempt()
        except InputError as error:
            sentence = str(error)
            verdict = REFUSED if self.says in sentence else BROKEN
            yield Row(self.name, self.stiff, self.text, "both", None, verdict, sentence)
        else:
            yield Row(self.name, self.stiff, self.text, "both", None, BROKEN, "it was served")


def lattice() -> NDArray[np.float64]:
    """(8, 8, 3) points of the open cube (-1, 1)^3, spread evenly by multiples of irrational numbers, in 2^-20 steps."""
    steps = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
    k = np.arange(1, SIZE * SIZE + 1)[:, None]
    share = np.floor((k * steps) % 1.0 * 2**19) + 0.5
    points: NDArray[np.float64] = (share / 2**18 - 1.0).reshape(SIZE, SIZE, 3)
    return points


def display(
    module_x: float = 0.25, module_z: float = 2.5, observer_y: float = 0.125, observer_z: float = -4.0
) -> Display:
    """A flat display of 2 x 1 m with one module of 8 x 8 texels, and observers."""
    roi = ((-0.8, -0.4, -0.3), (0.8, 0.4, 0.3))
    return Display("bench", 2.0, 1.0, observer_y, observer_z, (Module(module_x, 0.0, module_z, SIZE, SIZE),), roi)


def scene(
    points: NDArray[np.float64],
    shown_by: Display | None = None,
    physical_from_world: Matrix = _UNCHANGED,
    offset: Any = (0.0, 0.0, 0.0),
) -> Stiff:
    """Points, (8, 8, 3) world, on a display, with a surface of depths between the points'."""
    shown_by = display() if shown_by is None else shown_by
    z = points @ physical_from_world[2, :3] + physical_from_world[2, 3]
    share = (lattice()[::-1, ::-1, 1] + 1) / 2
    depth = (z.min() + share * (z.max() - z.min())).astype(np.float32)
    return Stiff(shown_by, physical_from_world, points, np.array(offset, np.float64), depth)


def _ordinary() -> Iterator[tuple[str, Stiff]]:
    yield "a box of 1.4 x 0.8 x 0.5 m on the screen", scene(lattice() * [0.7, 0.4, 0.25])


def _far_scale() -> Iterator[tuple[str, Stiff]]:
    for power in (-30, -12, 12, 30):
        size = 10.0**power
        world = _UNCHANGED / size
        yield f"a scene of size 1e{power}", scene(lattice() * np.array([0.7, 0.4, 0.25]) * size, None, world)


def _offset() -> Iterator[tuple[str, Stiff]]:
    for power in (2, 4, 6, 8):
        world = _UNCHANGED.copy()
        world[0, 3] = -(10.0**power)
        points = lattice() * [0.7, 0.4, 0.25] + [10.0**power, 0, 0]
        yield f"x from 1e{power} - 0.7 to 1e{power} + 0.7", scene(points, None, world)


def _aspect() -> Iterator[tuple[str, Stiff]]:
    for power in (-6, -3, 3, 6):
        box = np.array([0.7, 0.7 * 10.0**power, 0.25]) if power < 0 else np.array([0.4 * 10.0**-power, 0.4, 0.25])
        yield f"width / height 1e{-power}", scene(lattice() * box)


def _near_lens() -> Iterator[tuple[str, Stiff]]:
    for k in range(1, STEPS + 1):
        yield f"z = m_z (1 - t 2^-{k})", near_lens(k)


def _near_observers() -> Iterator[tuple[str, Stiff]]:
    for k in range(1, STEPS + 1):
        yield f"z = z_o (1 - t 2^-{k})", near_observers(k)


def near_lens(k: int) -> Stiff:
    """Points within 2^-k of the lens, of a module in the middle."""
    shown_by = display(0.0, 2.5, 0.0, -5.0)
    return scene(_close(shown_by.modules[0].z, k, 0), shown_by)


def near_observers(k: int) -> Stiff:
    """Points within 2^-k of the observers, who stand at height 0."""
    shown_by = display(0.0, 2.5, 0.0, -5.0)
    return scene(_close(shown_by.observer_z, k, 1), shown_by)


def _close(slit: float, k: int, axis: int) -> NDArray[np.float64]:
    """Points within 2^-k of a slit at 0 along the axis, so close to it that they stay on the texture.

    They are numbers of float32 as long as that can tell them from the slit.
    """
    points = lattice() * [0.7, 0.4, 0.0]
    points[..., axis] *= 2.0**-k
    points[..., 2] = slit * (1 - (3 + 0.987654321 * lattice()[..., 2]) / 4 * 2.0**-k)
    return points.astype(np.float32 if k < 23 else np.float64).astype(np.float64)


def _outer_lens() -> Iterator[tuple[str, Stiff]]:
    shown_by = display(0.625, 2.0)
    for k in (10, 20, 30):
        points = _close(2.0, k, 0)
        points[..., 0] += 0.625
        yield f"m_x = 0.625, z = m_z (1 - t 2^-{k})", scene(points, shown_by)


def _radius() -> Iterator[tuple[str, Stiff]]:
    for power in (-12, -6, 6, 12):
        offset = np.array([0.0, 0.0, 0.5]) * 10.0**power
        yield f"R = 1e{power}, from points on the surface", on_surface(offset)


def _wide_module() -> Iterator[tuple[str, Stiff]]:
    for place in (10.0, 1e3):
        shown_by = display(place, 0.5)
        points = lattice() * [0.7, 0.4, 0.25]
        yield f"a lens at x = {place:g} m, 0.5 m behind the screen", scene(points, shown_by)


def _on_edges() -> Iterator[tuple[str, Stiff]]:
    shown_by = display(0.0, 2.0)
    points = np.zeros((SIZE, SIZE, 3))
    points[..., 0] = np.arange(-4, 4) / 4
    points[..., 1] = -np.arange(-4, 4)[:, None] / 8
    stiff = scene(points, shown_by)
    depth = np.where(np.indices((SIZE, SIZE)).sum(axis=0) % 2, np.float32(-0.5), np.float32(0.5))
    yield "u and v whole numbers, a chessboard of depths", replace(stiff, depth=depth)


def _touching() -> Iterator[tuple[str, Stiff]]:
    yield "samples on the surface itself", on_surface(np.zeros(3))
    yield "z = -0, the surface at 0", on_surface(np.zeros(3), 0.0, -0.0)
    yield "z = 0, the surface at -0", on_surface(np.zeros(3), -0.0, 0.0)


def _blur() -> Iterator[tuple[str, Callable[[str], Measured]]]:
    for sigma in (1e-6, 1e-2, 1.0, 1e2, 1e4, 1e6):
        yield f"sigma = {sigma:g}", partial(probes.blurred, sigma)


def _counts() -> Iterator[tuple[str, Callable[[str], Measured]]]:
    for samples in (2**24 + 1, 2**31 - 1):
        yield f"counts up to {samples}", partial(probes.counted, samples)


def _slivers() -> Iterator[tuple[str, Callable[[str], Measured]]]:
    yield "edges within 2 ulp of the ray", probes.slivers


def _curved() -> Iterator[tuple[str, Callable[[str], Measured]]]:
    for share in (0.5, 0.9, 0.999):
        yield f"picoarray's outermost modules, {share:g} of the way to the lens", partial(curved.picoarray, share)


def on_surface(
    offset: NDArray[np.float64],
    depth: float | None = None,
    z: float | None = None,
    texture: NDArray[np.float32] | None = None,
    shown_by: Display | None = None,
) -> Stiff:
    """Points at the centres of the texels, at the depths of the texture or all at z; depths are float32 numbers."""
    shown_by = display() if shown_by is None else shown_by
    texture = (lattice()[..., 1] / 4).astype(np.float32) if texture is None else texture
    if depth is not None:
        texture[...] = depth
    v, u = np.indices((SIZE, SIZE)) + 0.5
    origin, direction, _ = shown_by.texel_ray(0, u, v)
    places = texture.astype(np.float64) if z is None else np.full((SIZE, SIZE), z)
    places = np.where(np.isfinite(places), places, 0.0)
    points = origin + places[..., None] * direction
    points[..., 2] = places
    return Stiff(shown_by, _UNCHANGED, points, offset, texture)


def _deep() -> Display:
    """A display 40 km deep, whose texels are 0.25 m: slopes of 89.99 degrees fit in."""
    return display(0.0, 4e4, 0.0, -4e4)


def _grazing() -> Iterator[tuple[str, Stiff]]:
    slope = 5729.577893  # tan 89.99 degrees
    texture = np.tile((np.arange(SIZE) - 3.5) * 0.25 * slope, (SIZE, 1)).astype(np.float32)
    for height in (1e-1, 1e-2, 1e-4):
        for side in (1, -1):
            normal = side * height * np.array([1.0, 0.0, -1 / slope])
            where = "behind" if side < 0 else "before"
            yield f"89.99 degrees, {height:g} m {where} the surface", on_surface(normal, None, None, texture, _deep())


def _depth_range() -> Iterator[tuple[str, Stiff]]:
    texture = np.float32(10.0) ** np.linspace(-4, 4, SIZE * SIZE, dtype=np.float32).reshape(SIZE, SIZE)
    for step in (1e-2, 1e-5):
        yield (
            f"depths 1e-4 to 1e4, samples {step:g} behind",
            on_surface(np.array([0, 0, step]), None, None, texture, _deep()),
        )


def _stored() -> Iterator[tuple[str, Stiff]]:
    for name, step in (("float16", 2.0**-13), ("uint16", 0.25 / 65535), ("uint24", 0.25 / (2**24 - 1))):
        depth = ((lattice()[..., 1] + 1) / 8).astype(np.float32)
        wide = depth.astype(np.float64)
        rounded = wide.astype(np.float16) if name == "float16" else np.rint(wide / step) * step
        stored = np.asarray(rounded, np.float32)
        case = on_surface(np.array([0, 0, step / 4]), None, None, depth)
        yield (
            f"{name} over 0.25 m, a quarter of its step behind",
            replace(case, stored=stored, step=step / 2 + 2.0**-26),
        )


def _subnormal() -> Iterator[tuple[str, Stiff]]:
    for size in (1e-40, 5e-324):
        points = np.sign(lattice()) * size
        yield f"coordinates of {size:g}", replace(scene(points), depth=np.zeros((SIZE, SIZE), np.float32))


def _background() -> Iterator[tuple[str, Stiff]]:
    case = scene(lattice() * [0.7, 0.4, 0.25], offset=(0.25, 0.125, 0.125))
    depth = np.where(np.indices((SIZE, SIZE)).sum(axis=0) % 3 == 0, np.float32(np.inf), case.depth)
    yield "a third of the texels without a surface", replace(case, depth=depth)


def _one_sample() -> Iterator[tuple[str, Stiff]]:
    yield "each AO is 0 or 1", scene(lattice() * [0.7, 0.4, 0.25], offset=(0.1, 0.05, 0.1))


CASES: tuple[Case | Refusal, ...] = (
    Case("ordinary", "nothing: what the others are compared with", _ordinary, {}),
    Case("scene scale", "numbers far from 1", _far_scale, {}),
    Case(
        "offset", "world coordinates far from 0", _offset,
        {"float32": "positions are rounded to float32: its ulp at the offset is what they miss"},
    ),
    Case("aspect", "a box much wider than high, or higher than wide", _aspect, {}),
    Case("near the lens", "z within 2^-k of m_z", _near_lens, {"float32": AT_THE_SLIT}),
    Case("near the observers", "z within 2^-k of z_o", _near_observers, {"float32": AT_THE_SLIT}),
    Case("outer lens", "near a lens that is not in the middle", _outer_lens, {"float32": AT_THE_SLIT}),
    Case(
        "radius", "R beside the scene", _radius,
        {"float32": "a sample nearer to the surface than the rounding of z is counted as on it"},
    ),
    Case("texel edges", "samples exactly between texels", _on_edges, {}),
    Case("on the surface", "samples exactly at the surface's depth; -0", _touching, {}),
    Case(
        "grazing", "a surface nearly along the rays", _grazing,
        {"float32": "a sample nearer to the surface than the rounding of its depth falls on either side"},
    ),
    Case(
        "depth range", "near and far depths in one texture", _depth_range,
        {"float32": "far away a sample is nearer to the surface than the rounding of its depth"},
    ),
    Case(
        "stored depth", "a depth texture of few bits", _stored,
        {path: "a surface is known to half a step of its format" for path in PATHS},
    ),
    Case(
        "subnormals", "numbers below the normal range, the surface at 0", _subnormal,
        {"float32": "what is below 2^-150 is 0"},
    ),
    Case("background", "infinite depths", _background, {}),
    Case("one sample", "N = 1", _one_sample, {}),
    Case("wide module", "rays along the screen", _wide_module, {}),
    Case("curved screen", "modules at the widest angle, near the lens", _curved, {"float32": AT_THE_SLIT}),
    Case("blur", "sigma", _blur, {"float32": "a sum of 6 million products is rounded as often"}),
    Case("counts", "more samples than float32 has whole numbers", _counts, {}),
    Case("slivers", "triangles a few ulp wide", _slivers, {}),
    *(Refusal(*refusal) for refusal in REFUSALS),
)  # fmt: skip
