"""The smallest error that ``compare`` finds, and that it names: ``python benchmarks/bench_smallest.py``, 10 minutes.

One module of sample-a at 640x480 shows the statue; a renderer errs by one number. Printed are the smallest size that is
outside, to a tenth of it; the first, in steps of a fifth, from which on the right name is told, alone or as one of two
that explain the texture equally well; and their ratio. Seeds, and a sample that is left out, have no size.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import lfssao
from lfssao.cli.main import main as run
from lfssao.files.exr import read_exr, write_exr
from lfssao.optics.display import Display
from lfssao.rendering.manifest import describe_machine
from lfssao.samples import texel_turns

MODULE = 9
SIZE = (640, 480)
RADIUS = 0.09
_DOUBLED = 18  # times, at most
Make = Callable[[float], np.ndarray]


class Renderer:
    """Occlusion of one module with numbers of one's own."""

    def __init__(self, folder: Path) -> None:
        self.folder, mesh = folder, lfssao.find_scene("statue")
        self.display = lfssao.find_display("sample-a").with_resolution(*SIZE)
        self.axes = lfssao.fit_roi(mesh.bounds, self.display.roi)
        self.view = self.display.view(MODULE, self.axes)
        self.file = folder / "reference" / f"{self.view.name}.exr"
        job = ["statue", "--display", "sample-a", "--modules", f"{MODULE}:{MODULE + 1}", "--radii", str(RADIUS)]
        job += ["--resolution", "x".join(map(str, SIZE)), "--blur", "1.3", "-o", str(folder / "reference")]
        run(["render", *job])
        self.parts = read_exr(self.file)
        self.depth, self.positions, self.merged = (
            np.ascontiguousarray(np.squeeze(self.parts[name].pixels)) for name in ("depth", "positions", "merged")
        )
        self.samples = lfssao.make_samples()
        self.turns = texel_turns("hash", *self.depth.shape, 0, np.dtype(np.float32))

    def ao(self, **wrong: object) -> np.ndarray:
        """Algorithm 2 with other arguments."""
        given = {
            "depth": self.depth,
            "positions": self.positions,
            "world_to_image": self.view.world_to_image,
            "samples": self.samples,
            "radius": RADIUS,
            "turns": self.turns,
        }
        return lfssao.algorithm2(**{**given, **wrong}).texture

    def seen_by(self, display: Display, axes: np.ndarray | None = None) -> np.ndarray:
        """Algorithm 2 by the mapping of another display."""
        view = display.view(MODULE, self.axes if axes is None else axes)
        return self.ao(world_to_image=view.world_to_image)

    def compared(self, layer: str, texture: np.ndarray, diagnosis: bool) -> lfssao.Report:
        """The report on a texture in place of the reference's."""
        with tempfile.TemporaryDirectory() as folder:
            part = self.parts[layer]
            parts = {**self.parts, layer: replace(part, pixels=texture.reshape(part.pixels.shape))}
            write_exr(Path(folder) / self.file.name, list(parts.values()))
            return lfssao.compare(folder, self.file.parent, layers=[layer], diagnosis=diagnosis)


def errors(r: Renderer) -> Iterator[tuple[str, str, str, str, float, Make]]:
    """Each error, its unit, the layer, the name that is right, the least size, and the texture of a size."""
    c = r.display
    module = r.display.modules[MODULE]

    def shifted(s: float) -> np.ndarray:
        numbers = r.view.world_to_image.numbers.copy()
        numbers[14] += s
        return r.ao(world_to_image=replace(r.view.world_to_image, numbers=numbers))

    def turned(s: float) -> np.ndarray:
        turn = np.array([[np.cos(s), np.sin(s), 0], [-np.sin(s), np.cos(s), 0], [0, 0, 1]])
        return r.ao(samples=r.samples @ turn)

    def of_module(name: str, s: float, factor: bool) -> np.ndarray:
        value = getattr(module, name)
        other = replace(module, **{name: value * (1 + s) if factor else value + s})
        return r.seen_by(replace(c, modules=(*c.modules[:MODULE], other, *c.modules[MODULE + 1 :])))

    def of_display(name: str, s: float, factor: bool) -> np.ndarray:
        value = getattr(c, name)
        return r.seen_by(replace(c, **{name: value * (1 + s) if factor else value + s}))

    def of_place(s: float, axis: int) -> np.ndarray:
        axes = r.axes.copy()
        centre = np.mean(np.array(c.roi), axis=0)
        if axis < 0:
            axes[:, :3], axes[:, 3] = (1 + s) * axes[:, :3], centre + (1 + s) * (axes[:, 3] - centre)
        else:
            axes[axis, 3] += s
        return r.seen_by(c, axes)

    def of_one_sample(s: float) -> np.ndarray:
        return r.ao(samples=r.samples * np.where(np.arange(len(r.samples)) == 3, 1 + s, 1)[:, None])

    yield "radius", "factor - 1", "ao_1", "radius", 1e-6, lambda s: r.ao(radius=RADIUS * (1 + s))
    yield "depth bias", "m", "ao_1", "depth bias", 1e-9, lambda s: r.ao(depth=r.depth + np.float32(s))
    yield "u shift", "texels", "ao_1", "shift of u", 1e-5, shifted
    yield "turn about z", "rad", "ao_1", "turned samples", 1e-6, turned
    yield "one sample's length", "factor - 1", "ao_1", "length of sample 3", 1e-6, of_one_sample
    yield (
        "observer distance",
        "factor - 1",
        "ao_1",
        "observer distance",
        1e-6,
        partial(of_display, "observer_z", factor=True),
    )
    yield "observer height", "m", "ao_1", "observer height", 1e-7, partial(of_display, "observer_height", factor=False)
    yield "lens x", "m", "ao_1", "lens x", 1e-7, partial(of_module, "x", factor=False)
    yield "lens z", "factor - 1", "ao_1", "lens z", 1e-6, partial(of_module, "z", factor=True)
    yield "screen width", "factor - 1", "ao_1", "screen width", 1e-6, partial(of_display, "screen_width", factor=True)
    yield (
        "screen height",
        "factor - 1",
        "ao_1",
        "screen height",
        1e-6,
        partial(of_display, "screen_height", factor=True),
    )
    for name in ("k1", "k2"):
        yield name, "", "ao_1", name, 1e-6, partial(of_module, name, factor=False)
    yield "ROI scale", "factor - 1", "ao_1", "ROI scale", 1e-6, partial(of_place, axis=-1)
    for axis, name in enumerate("xyz"):
        yield f"ROI offset in {name}", "m", "ao_1", f"ROI offset in {name}", 1e-7, partial(of_place, axis=axis)
    yield "sigma of the blur", "factor - 1", "blurred", "sigma", 1e-7, lambda s: lfssao.blur(r.merged, 1.3 * (1 + s))


def discrete(r: Renderer) -> Iterator[tuple[str, str, np.ndarray]]:
    """Errors without a size: what is wrong, the name that is right, the texture."""
    yield "seed of the samples", "samples of seed 17 in place of 0", r.ao(samples=lfssao.make_samples(seed=17))
    turns = texel_turns("hash", *r.depth.shape, 17, np.dtype(np.float32))
    yield "seed of the turns", "turns of seed 17 in place of 0", r.ao(turns=turns)
    n = len(r.samples)
    kept = np.where(np.isfinite(r.depth), r.ao(samples=np.delete(r.samples, 3, axis=0)) * np.float32((n - 1) / n), 0)
    yield "a sample left out", f"sample 3 dropped, count divided by {n}", kept


def named(report: lfssao.Report, kind: str) -> bool:
    """Whether the report's only cause is that kind, or one that explains as much."""
    return len(report.causes) == 1 and kind in (report.causes[0].kind, *report.causes[0].equal)


def smallest(r: Renderer, layer: str, kind: str, size: float, make: Make) -> tuple[float | None, float | None]:
    """The smallest size that is outside, and the first from which on the name is told; None for none."""

    def is_outside(size: float) -> bool:
        return r.compared(layer, make(size), False).exit_code == 2

    doubled = (size * 2**k for k in range(_DOUBLED))
    outside = next((size for size in doubled if is_outside(size)), None)
    if outside is None:
        return None, None
    within = outside / 2
    for _ in range(3):
        middle = (within * outside) ** 0.5
        within, outside = (within, middle) if is_outside(middle) else (middle, outside)
    first = None
    for k in range(6, 40) if kind else ():
        size = outside * 1.2**k
        told = named(r.compared(layer, make(size), True), kind)
        first = (first or size) if told else None
        if first is not None and size >= 2 * first:
            break
    return outside, first


def main() -> int:
    """Print the table and write JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results/smallest.json"))
    options.add_argument("--only", help="rows whose name begins so")
    given = options.parse_args()
    target = given.output
    rows = []
    only = given.only or ""
    with tempfile.TemporaryDirectory() as folder:
        r = Renderer(Path(folder))
        print("| wrong | first that is outside | first that is named | ratio |\n|---|---|---|---|")
        for what, unit, layer, kind, least, make in (row for row in errors(r) if row[0].startswith(only)):
            outside, first = smallest(r, layer, kind, least, make)
            ratio = f"{first / outside:.1f}" if first and outside else "-"
            cells = [f"{x:.2g} {unit}".strip() if x else "-" for x in (outside, first)]
            print(f"| {what} | {cells[0]} | {cells[1]} | {ratio} |", flush=True)
            rows.append({"wrong": what, "unit": unit, "outside": outside, "named": first})
        for what, kind, texture in (row for row in discrete(r) if row[0].startswith(only)):
            report = r.compared("ao_1", texture, True)
            print(
                f"| {what} | {'yes' if report.exit_code == 2 else 'no'} | {'yes' if named(report, kind) else 'no'} | |"
            )
            rows.append({"wrong": what, "outside": report.exit_code == 2, "named": named(report, kind)})
    target.parent.mkdir(exist_ok=True)
    target.write_text(json.dumps({"machine": describe_machine(1, sys.argv), "rows": rows}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
