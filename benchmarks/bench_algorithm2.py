"""Algorithm 2 against C: ``python benchmarks/bench_algorithm2.py``, JSON beside the printed table.

One run, 1024x768, 8 samples, one radius, float32, all programs in turn, each after each other equally often; median and
quartiles in milliseconds. The C programs are compiled here with gcc -O3 -march=native; a second build with
-ffp-contract=off must give lfssao's bits. The AO pass of five radii is timed with samples that turn and that do not.
"""

import argparse
import ctypes
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from c_baselines import compile_baselines
from turns import in_turn

from lfssao import builtin_scene, find_display, make_samples, module_views
from lfssao.ao.kernels import ssao
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.kernels.projection import Projection
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import DEFAULT_RADII, diagonal
from lfssao.samples import texel_turns

RADIUS = 0.02  # share of the scene's diagonal

Case = tuple[np.ndarray, np.ndarray, np.ndarray, Projection]


def gallery_case(width: int = 1024, height: int = 768) -> Case:
    """The default scene in the default display: depth, positions, offsets and mapping, float32."""
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual").with_resolution(width, height))[0]
    gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view)
    offsets = (RADIUS * diagonal(mesh) * make_samples()).astype(np.float32)
    return gbuffer.depth, gbuffer.positions, offsets, view.world_to_image.as_type(np.float32)


def relief_case() -> Case:
    """A wavy sheet that fills the texture, so that no texel can be skipped."""
    view = find_display("virtual").view(0, np.diag([1.0, 1.0, -1.0, 0.0])[:3])
    j, i = np.mgrid[0:768, 0:1024]
    x = (i + 0.5 - 512) / 1024
    y = (384 - j - 0.5) / 1024
    z = 0.05 * np.sin(40 * x) * np.sin(30 * y)
    # The point of each texel's ray at depth -z: the flat forms with m = (0, 0, 0.7), observers at -2.
    positions = np.stack([x * (0.7 + z) / 0.7, y * (2.0 - z) / 2.0, z], axis=-1).astype(np.float32)
    offsets = (0.02 * make_samples()).astype(np.float32)
    return (-z).astype(np.float32), positions, offsets, view.world_to_image.as_type(np.float32)


def image_offsets(case: Case) -> np.ndarray:
    """The offsets after the linear part of the mapping's first three rows, (n, 3): done once a sample, as in lfssao."""
    _, _, offsets, projection = case
    return np.ascontiguousarray(ssao.transform_offsets(offsets, projection, None)[:, 2, :3])


def in_c(library: ctypes.CDLL, name: str, case: Case) -> Callable[[], np.ndarray] | None:
    """The C function under that name on a case; None where this processor's build does not have it."""
    function = getattr(library, name, None)
    if function is None:
        return None
    (depth, positions, _, projection), offsets = case, image_offsets(case)
    ao = np.empty_like(depth)
    inputs = (depth, positions, offsets, projection.numbers, ao)
    height, width = depth.shape

    def run() -> np.ndarray:
        function(width, height, len(offsets), *(a.ctypes.data_as(ctypes.c_void_p) for a in inputs))
        return ao

    return run


def ours(case: Case, factors: tuple[float, ...] = (1.0,), rotation: str = "none") -> Callable[[], np.ndarray]:
    """Algorithm 2 at the case's radius times factors, the samples turned by a rotation or shared."""
    depth, positions, offsets, projection = case
    scaled = np.stack([np.float32(factor) * offsets for factor in factors])
    ao = np.empty((len(factors), *depth.shape), depth.dtype)
    outside = np.empty((len(factors), len(depth)), np.int64)
    turns = None if rotation == "none" else texel_turns(rotation, *depth.shape, 0, depth.dtype)

    def run() -> np.ndarray:
        ssao.algorithm2(depth, positions, scaled, projection, turns, ao, outside)
        return ao[0]

    return run


def bench_turned(case: Case, repeats: int) -> dict[str, float]:
    """Milliseconds of the AO pass of the default radii by rotation, and what turning costs."""
    factors = tuple(radius / RADIUS for radius in DEFAULT_RADII)
    times = in_turn({rotation: ours(case, factors, rotation) for rotation in ("none", "hash")}, repeats)
    made = {rotation: t.median for rotation, t in times.items()}
    print(
        f"  five radii {made['none']:7.2f} ms, turned {made['hash']:.2f}: {made['hash'] / made['none']:.2f} x as long"
    )
    return made


def bench(case: Case, fast: ctypes.CDLL, exact: ctypes.CDLL, repeats: int) -> dict[str, dict[str, float]]:
    runs: dict[str, Callable[[], np.ndarray]] = {"lfssao": ours(case)}
    reference = runs["lfssao"]().copy()
    for name in ("plain_c", "avx2_c", "avx512_c"):
        run = in_c(fast, name, case)
        same = in_c(exact, name, case)
        if run is None or same is None:
            print(f"  {name}: this processor does not have it, skipped")
            continue
        if not np.array_equal(same().view(np.int32), reference.view(np.int32)):
            raise SystemExit(f"{name} without contraction does not give lfssao's bits: not the same algorithm")
        runs[name] = run
    times = in_turn(runs, repeats)
    rows = {}
    for name, t in times.items():
        times_ours = t.median / times["lfssao"].median
        rows[name] = {"ms": t.median, "ms_25": t.low, "ms_75": t.high, "times_lfssao": times_ours}
        print(f"  {name:10s} {t.median:7.2f} ms  [{t.low:.2f}, {t.high:.2f}]   {times_ours:5.2f} x lfssao")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=60)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "algorithm2.json")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    result: dict[str, object] = {"machine": describe_machine(options.threads, sys.argv)}
    with tempfile.TemporaryDirectory() as folder:
        fast, exact = (compile_baselines(Path(folder), options.threads, *more) for more in ((), ("-ffp-contract=off",)))
        for name, case in (("gallery", gallery_case()), ("relief", relief_case())):
            print(f"{name}: {np.isfinite(case[0]).mean():.0%} of the texels see a surface")
            result[name] = bench(case, fast, exact, options.repeats)
            result[f"{name}, turned"] = bench_turned(case, options.repeats)
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
