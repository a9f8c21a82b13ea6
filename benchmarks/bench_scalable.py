"""Scalable Ambient Obscurance's claims on our scene, its passes against C: ``python benchmarks/bench_scalable.py``.

Table 1 (which filter of the z hierarchy is nearest to none, and its bias), figure 3 (error of z from a depth buffer),
figure 4 (rebuilt face normals), figure 5 (time over radius), and each pass beside the same loops in plain C, compiled
here with gcc -O3 -march=native and held to lfssao's bits with -ffp-contract=off. The gallery from an ordinary camera,
1024x768, float32. ``--cpu`` counts processor time of one thread, for a machine that others use too. Prints tables,
writes JSON, and a picture from the textures.
"""

import argparse
import ctypes
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np
from PIL import Image

from lfssao import Buffers, Camera, RayCaster, builtin_scene, estimate
from lfssao.estimators import scalable
from lfssao.estimators.texel_lines import linear_z, plane_constants, positions_of, texel_lines
from lfssao.kernels import bilateral, z_pyramid
from lfssao.kernels import scalable as kernels
from lfssao.kernels.blur import gaussian_weights
from lfssao.kernels.linear_depth import linear_depth
from lfssao.kernels.quad import average_quads
from lfssao.kernels.reconstruct import face_normals
from lfssao.manifest import describe_machine
from lfssao.rendering import diagonal

FOLDER = Path(__file__).parent
RADII = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # shares of the scene's diagonal


def gallery():
    mesh = builtin_scene()
    view = Camera.looking_at(mesh.bounds).view(1024, 768)
    gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric")
    return mesh, view, gbuffer


# Table 1


def filters(buffers, radius):
    """Errors of occlusion against no hierarchy, by filter, before averaging and blur."""
    seen = np.isfinite(buffers.depth)
    raw = {"quad_edge": 0.0, "gauss": 0.0}
    ao = {how: estimate("sao", buffers, radius, mip=how, **raw).texture for how in scalable.FILTERS}
    rows = {}
    print(f"table 1: occlusion against none, radius {radius:.3g}: root mean square, mean difference, worst")
    for how, texture in ao.items():
        error = (texture.astype(float) - ao["none"])[seen]
        rows[how] = {"rms": float(np.sqrt(np.mean(error**2))), "bias": float(error.mean()), "worst": abs(error).max()}
        print(f"  {how:10s} {rows[how]['rms']:.5f}  {rows[how]['bias']:+.5f}  {rows[how]['worst']:.3f}")
    return rows, ao


# Figure 3


def stored(z, near, far, bits):
    """Depth buffer values: float32 projection row times the point, division, storage in 16 or 24 bits or float32."""
    one = np.float32
    a, b = (one(1), one(near)) if far == np.inf else (one(far / (far - near)), one(far * near / (far - near)))
    z = z.astype(np.float32)
    d = (a * z - b) / z
    if bits == 32:
        return d
    steps = 2.0**bits - 1
    return (np.floor(d.astype(float) * steps + 0.5) / steps).astype(np.float32)


def z_errors(near=0.1, finite=100.0):
    """Mean and worst error of z, float32 all through, for z up to 60 and near plane 0.1 (the paper's metres)."""
    z = np.linspace(1, 60, 200_001).astype(np.float32)
    rows = {}
    print("figure 3: error of z in mm, near 0.1 m, z from 1 to 60 m: mean, worst")
    for bits in (16, 24, 32):
        for far in (finite, np.inf):
            back = np.empty((1, len(z)), np.float32)
            c = [np.float32(x) for x in plane_constants(near, far)]
            linear_depth(stored(z, near, far, bits)[None], True, *c, back)
            error = 1e3 * np.abs(back[0].astype(float) - z)
            error = error[np.isfinite(error)]
            name = f"{bits} bit, far {'infinite' if far == np.inf else far}"
            rows[name] = {"mean_mm": float(error.mean()), "worst_mm": float(error.max()), "lost": len(z) - len(error)}
            mean, worst, lost = rows[name].values()
            print(f"  {name:22s} {mean:9.3f} {worst:9.3f}  at infinity: {lost}")
    return rows


# Figure 4


def normal_errors(view, gbuffer):
    """Angle between rebuilt and triangle normals where the texels of the differences see one triangle."""
    buffers = Buffers.of(gbuffer, view)
    z = linear_z(buffers)
    lines = texel_lines(view, z.dtype)
    positions = positions_of(buffers, z, lines)
    normals = np.empty_like(positions)
    face_normals(z, positions, lines.kind, lines.numbers, lines.table, lines.world, normals)
    cosine = (normals.astype(float) * gbuffer.normals).sum(-1)
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(normals.astype(float), gbuffer.normals), axis=-1), cosine))
    t = gbuffer.triangle
    pair = t.reshape(t.shape[0], -1, 2)[..., ::-1].reshape(t.shape)
    below = t.reshape(-1, 2, t.shape[1])[:, ::-1].reshape(t.shape)
    inside = (t >= 0) & (t == pair) & (t == below)
    slant = np.abs((gbuffer.normals.astype(float) * buffers.directions).sum(-1))
    rows = {}
    print("figure 4: degrees between rebuilt and true face normal, within a triangle: median, 99.9 %, worst")
    for name, where in (("all", inside), ("seen within 80 degrees", inside & (slant > np.cos(np.radians(80))))):
        a = angle[where]
        rows[name] = {
            "texels": len(a),
            "median": float(np.median(a)),
            "p999": float(np.percentile(a, 99.9)),
            "worst": float(a.max()),
        }
        print("  " + name, {k: round(v, 5) for k, v in rows[name].items()})
    return rows


# Figure 5


def turns_taken(runs, repeats, clock):
    """Milliseconds of each run, the runs taking turns: (25, 50, 75) percentiles."""
    for run in runs.values():
        run()
    times = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            start = clock()
            run()
            times[name].append(1e3 * (clock() - start))
    return {name: [float(p) for p in np.percentile(values, [25, 50, 75])] for name, values in times.items()}


def captured(buffers, radius, **changed):
    """The kernel call that the sampling pass makes, and its arguments."""
    z = linear_z(buffers)
    lines = texel_lines(buffers.view, z.dtype)
    p = {k: v for k, v in scalable._PASSES.items() if k in ("taps", "turns", "hashed", "mip", "log_q", "max_level")}
    calls, real = [], kernels.scalable_visibility
    kernels.scalable_visibility = lambda *a: calls.append(a)
    try:
        scalable.sample(buffers, z, lines, radius, (0.01, 0.0), 5 / 9, True, epsilon=0.01, **{**p, **changed})
    finally:
        kernels.scalable_visibility = real
    return calls[0]


def over_radius(buffers, size, repeats, clock):
    """Milliseconds of the sampling pass over the radius, with the hierarchy, without, and with 12 taps without."""
    kinds = {"hierarchy": {}, "no hierarchy": {"mip": "none"}, "no hierarchy, 12 taps": {"mip": "none", "taps": 12}}
    runs = {}
    for name, changed in kinds.items():
        for share in RADII:
            arguments = captured(buffers, share * size, **changed)
            runs[f"{name} {share}"] = lambda arguments=arguments: kernels.scalable_visibility(*arguments)
    times = turns_taken(runs, repeats, clock)
    rows = {name: {share: times[f"{name} {share}"] for share in RADII} for name in kinds}
    print("figure 5: ms of the sampling pass over the radius (share of the diagonal)")
    print("  " + " " * 22 + "".join(f"{share:8g}" for share in RADII))
    for name, row in rows.items():
        print(f"  {name:22s}" + "".join(f"{row[share][1]:8.2f}" for share in RADII))
    return rows


# Passes against C


def pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def compile_peers(folder, *options):
    library = Path(folder) / f"scalable{len(options)}.so"
    command = ["gcc", "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", *options]
    subprocess.run([*command, "-o", str(library), str(FOLDER / "scalable.c")], check=True)
    peers = ctypes.CDLL(str(library))
    peers.set_threads(numba.get_num_threads())
    return peers


def passes(buffers, radius):
    """Each pass as (lfssao's run, C's run of a library), both giving the output."""
    z = linear_z(buffers)
    lines = texel_lines(buffers.view, z.dtype)
    height, width = z.shape
    call = captured(buffers, radius)
    ours, c_out = np.empty_like(z), np.empty_like(z)
    k = np.array([call[9], call[10], call[11], call[14], call[17], call[18]], np.float32)
    kernels.scalable_visibility(*call)
    visibility = call[19].copy()
    keys = scalable.keys_of(z, lines.origin, 0.0)
    weights = np.empty(7)
    gaussian_weights(3.0, 3, weights)
    weights = weights.astype(np.float32)
    edge = np.float32(0.02 * radius)
    size = ctypes.c_int(width), ctypes.c_int(height)
    level, c_level = (np.empty(((height + 1) // 2, (width + 1) // 2), np.float32) for _ in range(2))

    def sample_ours():
        kernels.scalable_visibility(*call)
        return call[19]

    def sample_c(library):
        library.sampling(
            *size, pointer(call[0]), pointer(call[1]), pointer(call[2]), len(call[2]), *map(pointer, call[3:7]),
            len(call[6]), pointer(call[7]), pointer(call[8]), pointer(k), 3, pointer(c_out),
        )  # fmt: skip
        return c_out

    def blur_ours(one_pass):
        one_pass(visibility, keys, weights, 3, np.float32(2048), ours)
        return ours

    def blur_c(library, vertical):
        library.bilateral(
            *size, pointer(visibility), pointer(keys), pointer(weights), ctypes.c_float(2048), vertical, pointer(c_out)
        )
        return c_out

    def quads_ours():
        average_quads(visibility, z, edge, ours)
        return ours

    def quads_c(library):
        library.quads(*size, pointer(visibility), pointer(z), ctypes.c_float(edge), pointer(c_out))
        return c_out

    def level_ours():
        z_pyramid.next_level(z, z_pyramid.ROTATED, np.float32(0), level)
        return level

    def level_c(library):
        library.rotated_level(*size, pointer(z), pointer(c_level))
        return c_level

    return {
        "sampling": (sample_ours, sample_c),
        "bilateral, rows": (lambda: blur_ours(bilateral.bilateral_horizontal), lambda lib: blur_c(lib, 0)),
        "bilateral, columns": (lambda: blur_ours(bilateral.bilateral_vertical), lambda lib: blur_c(lib, 1)),
        "2x2 average": (quads_ours, quads_c),
        "level 1, rotated grid": (level_ours, level_c),
    }


def against_c(cases, repeats, clock):
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        fast, exact = compile_peers(folder), compile_peers(folder, "-ffp-contract=off")
        for case, (buffers, radius) in cases.items():
            runs = {}
            for name, (ours, in_c) in passes(buffers, radius).items():
                if not np.array_equal(ours().view(np.int32).copy(), in_c(exact).view(np.int32)):
                    raise SystemExit(f"{case}, {name}: C without contraction does not give lfssao's bits")
                runs[f"{name}, lfssao"], runs[f"{name}, C"] = ours, lambda in_c=in_c: in_c(fast)
            times = turns_taken(runs, repeats, clock)
            print(f"passes against plain C, {case}: ms lfssao [25 %, 75 %], ms C, ratio")
            rows[case] = {}
            for name in dict.fromkeys(key.rsplit(", ", 1)[0] for key in runs):
                mine, c = times[f"{name}, lfssao"], times[f"{name}, C"]
                rows[case][name] = {"ms": mine, "ms_c": c, "ratio": c[1] / mine[1]}
                print(f"  {name:22s} {mine[1]:7.2f} [{mine[0]:.2f}, {mine[2]:.2f}] {c[1]:7.2f}   {c[1] / mine[1]:5.2f}")
    return rows


def relief(view):
    """A wavy sheet that fills the camera's texture."""
    near, far = view.lens[4:6]
    v, u = np.mgrid[: view.height, : view.width] / 100.0
    z = 0.5 * (near + far) * (1 + 0.02 * np.sin(3 * u) * np.sin(4 * v))
    depth = (far / (far - near) * (1 - near / z)).astype(np.float32)
    return Buffers(view, depth, np.zeros((*depth.shape, 3), np.float32))


def picture(ao, path):
    """Without hierarchy, rotated grid, and four times each filter's difference, as in table 1."""
    tiles = [1 - ao["none"], 1 - ao["rotated"]]
    tiles += [1 - np.minimum(4 * np.abs(ao[how] - ao["none"]), 1) for how in ao if how != "none"]
    tiles.append(np.ones_like(tiles[0]))
    rows = [np.hstack([tile[::2, ::2] for tile in tiles[k : k + 4]]) for k in (0, 4)]
    Image.fromarray((255 * np.vstack(rows) + 0.5).astype(np.uint8)).save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--json", type=Path, default=FOLDER / "results" / "scalable.json")
    options = parser.parse_args()
    threads = 1 if options.cpu else options.threads
    clock = time.process_time if options.cpu else time.perf_counter
    numba.set_num_threads(threads)
    mesh, view, gbuffer = gallery()
    buffers, size = Buffers.of(gbuffer, view), diagonal(mesh)
    result = {"machine": describe_machine(threads, sys.argv), "load": os.getloadavg(), "cpu_time": options.cpu}
    result["table 1"], ao = filters(buffers, 0.2 * size)
    result["figure 3"] = z_errors()
    result["figure 4"] = normal_errors(view, gbuffer)
    sheet = relief(view)
    result["figure 5"] = over_radius(sheet, size, options.repeats, clock)
    cases = {"gallery": (buffers, 0.05 * size), "relief": (sheet, 0.05 * size)}
    result["against C"] = against_c(cases, options.repeats, clock)
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1, default=float))
    picture(ao, options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
