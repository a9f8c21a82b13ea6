"""Sampling error of samples that turn from texel to texel, against many that do not, on several views."""

from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import Any

from lfssao.ao import post
from lfssao.bench.work_precision.references import Texture, combine_others, rms, rmse
from lfssao.bench.work_precision.scene import BenchScene
from lfssao.bench.work_precision.settings import Grid
from lfssao.rendering.passes import occlusions
from lfssao.rendering.settings import DEFAULT_RADII, Settings
from lfssao.samples import make_samples
from lfssao.scene.builtin import builtin_scene

SCENES, DISPLAYS = ("statue", "ammonite", "armadillo"), ("sample-a", "picoarray")  # flat, and projectors on an arc
ROTATIONS = ("none", "hash", "tiles", "ign", "blue-noise")
COUNTS, BLURS, RADII = (4, 8, 16), (0.0, 1.0, 2.0), ((0.02,), DEFAULT_RADII)
SAMPLER, MANY = "latin", 4096  # the references' number of samples


def rotation_errors(grid: Grid, threads: int, tick: Callable[[str], None]) -> Iterator[dict[str, Any]]:
    """Yield errors of estimator lf by view, radii, rotation, samples and blur."""
    for name, display in product(SCENES, DISPLAYS):
        tick(f"rotations, {name} on {display}")
        scene = BenchScene(builtin_scene(name), grid, threads, display)
        for radii in RADII:
            many = {by: _made(scene, radii, "none", by, MANY, 2**32) for by in grid.reference_samplers}
            for rotation, n in product(ROTATIONS, COUNTS):
                few = [_made(scene, radii, rotation, SAMPLER, n, seed) for seed in range(grid.seeds)]
                for k, blur in enumerate(BLURS):
                    reference = combine_others({by: textures[k] for by, textures in many.items()}, SAMPLER)
                    error = rms([rmse(textures[k], reference.texture) for textures in few])
                    facts = {"view": f"{name} on {display}", "radii": len(radii), "rotation": rotation, "samples": n}
                    yield {**facts, "blur": blur, "sampling": error, "reference_error": reference.error}


def _made(scene: BenchScene, radii: Sequence[float], rotation: str, by: str, n: int, seed: int) -> list[Texture]:
    """Occlusion of the surface texels by each blur."""
    scaled, samples = tuple(radius * scene.unit for radius in radii), make_samples(by, n, seed)
    found = occlusions(scene.buffers["float32"], Settings(scaled, samples, rotation=rotation, rotation_seed=seed))
    merged = post.merge([each.texture for each in found])
    return [scene.of_surface(post.blur(merged, blur)) for blur in BLURS]
