"""Sampling error of samples that turn from texel to texel: ``python benchmarks/bench_rotations.py``, a table.

Estimator lf with few samples against many that do not turn, after the blur, on scenes in a flat display and in one
whose projectors stand on an arc.
"""

import sys
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from lfssao import Settings, builtin_scene, make_samples
from lfssao.ao import post
from lfssao.bench.work_precision.figures import combine_others, rms
from lfssao.bench.work_precision.page import table
from lfssao.bench.work_precision.scene import BenchScene
from lfssao.bench.work_precision.settings import QUICK
from lfssao.rendering.passes import occlusions
from lfssao.rendering.settings import DEFAULT_RADII

SCENES = ("statue", "ammonite", "armadillo")
DISPLAYS = ("sample-a", "picoarray")
ROTATIONS = ("none", "hash", "tiles", "ign", "r2", "blue-noise")
COUNTS = (4, 8, 16)
BLURS = (0.0, 1.0, 2.0)
RADII = ((0.02,), DEFAULT_RADII)
SAMPLER, SEEDS, MANY = "latin", 4, 4096  # the references' number of samples


def errors_of(scene: BenchScene, radii: Sequence[float]) -> Iterator[tuple[str, list[float]]]:
    """Each rotation with its errors by samples and blur."""
    many = {by: textures_of(scene, radii, "none", by, MANY, 2**32) for by in ("sobol", "halton")}
    for rotation in ROTATIONS:
        errors = []
        for n in COUNTS:
            few = [textures_of(scene, radii, rotation, SAMPLER, n, seed) for seed in range(SEEDS)]
            for k in range(len(BLURS)):
                reference, _ = combine_others({by: textures[k] for by, textures in many.items()}, SAMPLER)
                errors.append(rms([rms(textures[k] - reference) for textures in few]))
        yield rotation, errors


def textures_of(scene: BenchScene, radii: Sequence[float], rotation: str, by: str, n: int, seed: int):
    """Occlusion of the surface texels by each blur."""
    settings = Settings(tuple(radius * scene.unit for radius in radii), make_samples(by, n, seed), rotation=rotation)
    found = occlusions(scene.buffers, settings)
    merged = post.merge([each.texture for each in found])
    return [post.blur(merged, blur)[scene.surface].astype(np.float64) for blur in BLURS]


def main() -> None:
    """Print the errors of all views together, and of each."""
    together: dict[str, list[list[float]]] = {}
    for name, display in product(SCENES, DISPLAYS):
        print(f"{name} on {display}", file=sys.stderr)
        scene = BenchScene(builtin_scene(name), QUICK, 2, display)
        for radii in RADII:
            for rotation, errors in errors_of(scene, radii):
                for view in ("all views", f"{name} on {display}"):
                    together.setdefault(f"{view}, {len(radii)} radii, {rotation}", []).append(errors)
    rows = sorted(together.items(), key=lambda row: not row[0].startswith("all"))
    head = [f"{n}, blur {blur:g}" for n, blur in product(COUNTS, BLURS)]
    cells = ((name, *(f"{rms(column):.3f}" for column in zip(*errors, strict=True))) for name, errors in rows)
    print("\n".join(table(("view, radii, rotation", *head), cells)))


if __name__ == "__main__":
    main()
