"""Scalable Ambient Obscurance's claims on our scene: ``python benchmarks/bench_scalable.py``.

Table 1 (which filter of the z hierarchy is nearest to none, and its bias), figure 3 (error of z from a depth buffer)
and figure 4 (rebuilt face normals). The gallery from an ordinary camera, 1024x768, float32. Prints tables, writes JSON,
and a picture from the textures. Figure 5, time over the radius, is in bench_estimators.py.
"""

import argparse
import json
import sys
from pathlib import Path

import numba
import numpy as np
from PIL import Image

from lfssao import Buffers, Camera, RayCaster, builtin_scene, estimate
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao.kernels.face_normals import face_normals
from lfssao.ao.estimators.sao.kernels.reconstruct import linear_depth
from lfssao.ao.estimators.sao.texel_rays import linear_z, plane_constants, positions_of, texel_rays
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import diagonal

FOLDER = Path(__file__).parent


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
    ao = {how: estimate("sao", buffers.turned("sao-hash"), radius, mip=how, **raw).texture for how in scalable.FILTERS}
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
    lines = texel_rays(view, z.dtype)
    positions = positions_of(buffers, z, lines)
    normals = np.empty_like(positions)
    face_normals(z, positions, lines, normals)
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


def picture(ao, path):
    """Without hierarchy, rotated grid, and four times each filter's difference, as in table 1."""
    tiles = [1 - ao["none"], 1 - ao["rotated"]]
    tiles += [1 - np.minimum(4 * np.abs(ao[how] - ao["none"]), 1) for how in ao if how != "none"]
    tiles.append(np.ones_like(tiles[0]))
    rows = [np.hstack([tile[::2, ::2] for tile in tiles[k : k + 4]]) for k in (0, 4)]
    Image.fromarray((255 * np.vstack(rows) + 0.5).astype(np.uint8)).save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, default=FOLDER / "results" / "scalable.json")
    options = parser.parse_args()
    mesh, view, gbuffer = gallery()
    buffers, size = Buffers.of(gbuffer, view), diagonal(mesh)
    result = {"machine": describe_machine(numba.get_num_threads(), sys.argv)}
    result["table 1"], ao = filters(buffers, 0.2 * size)
    result["figure 3"] = z_errors()
    result["figure 4"] = normal_errors(view, gbuffer)
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1, default=float))
    picture(ao, options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
