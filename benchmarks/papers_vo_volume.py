"""The VO paper's section 4, measured and judged: identities, falloff, areas, tangent sphere, contact shadows."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from papers_common import Claim, Found, Judged, Scale, camera_buffers, changed, correlation, moved, moved_buffers, tiles
from papers_sao import box
from papers_vo import limit_of, occlusion, rays_of, samples
from scipy import ndimage

import lfssao
from lfssao.bench.work_precision.figures import rms

RADIUS = 0.5  # of scenes of boxes, whose floor is at z = 0


def boxes(scale: Scale, *corners: Any, seen: Any = None) -> tuple[Any, Any]:
    """A floor and boxes on it, before a camera: the mesh, and its textures from a place that does not depend on it."""
    parts = [box((-2, -2, -1), (2, 2, 0)), *(box(*each) for each in corners)]
    faces = np.concatenate([f + 8 * k for k, (_, f) in enumerate(parts)]).astype(np.int32)
    mesh = lfssao.Mesh(np.concatenate([v for v, _ in parts]).astype(float), faces)
    bounds = np.array([[-2.0, -2, -1], [2, 2, 2]])
    camera = lfssao.Camera.placed(bounds, eye=(0.0, 3.0, 4.0), target=(0.0, 0.2, 0.3), fov=35.0)
    return mesh, moved_buffers(mesh, camera, *scale.size(512, 384))[0]


def floor_of(buffers: Any, far: float) -> Any:
    """Texels of the floor before a wall at y = 0, up to a distance from it."""
    x, y, z = (buffers.positions[..., k] for k in range(3))
    return np.isfinite(buffers.depth) & (np.abs(z) < 1e-4) & (np.abs(x) < 1) & (y > 1e-3) & (y < far)


def rays(mesh: Any, buffers: Any, weighting: str, falloff: str, seed: int = 0) -> Any:
    occluders = lfssao.Occluders(mesh)
    how = {"tolerance": 0.01, "rounds": (2, 8), "seed": seed}
    return lfssao.ray_cast_occlusion(occluders, buffers, RADIUS, weighting, falloff, **how).texture


def single_solid(scale: Scale) -> Found:
    """Section 4: volume against rays, whose attenuation is the integral of the volume's falloff."""
    walls = {"thick wall": (-1.0, 0.0), "wall of R / 10": (-RADIUS / 10, RADIUS / 10)}
    rows = {}
    for name, (back, thick) in walls.items():
        mesh, buffers = boxes(scale, ((-2, back, 0), (2, 0, 2)))
        floor = floor_of(buffers, RADIUS)
        cast = rays(mesh, buffers, "uniform", "cubic")
        volume = occlusion("vo-lines-normal", buffers, RADIUS, 64, thickness=thick)
        rows[name] = {"volume": volume[floor].mean(), "rays": cast[floor].mean(), "rmse": rms((volume - cast)[floor])}
    return {"rows": rows}


def judge_single_solid(found: Found, limit: float) -> Judged:
    thick, thin = (row["rmse"] for row in found["rows"].values())
    return thick <= limit, False, {"thick": thick, "thin": thin}


def thin_for_thick(_: Scale, found: Found) -> Found:
    """The thin wall, which rays leave behind it, under the name of the thick one."""
    return changed(found, {"thick wall": found["rows"]["wall of R / 10"]})


def separable(scale: Scale) -> Found:
    """Section 4: occlusion by two objects against the sum of that by each."""
    objects = ((-0.6, -0.2, 0), (0.6, 0.0, 0.15)), ((-0.6, 0.25, 0), (0.6, 0.45, 0.15))
    seen = [boxes(scale, *each) for each in (objects, objects[:1], objects[1:], ())]
    same = np.all([np.isfinite(b.depth) & (np.abs(b.positions[..., 2]) < 1e-4) for _, b in seen], axis=0)
    made = {
        "volume": [occlusion("vo-lines-normal", b, RADIUS, 64, thickness=0.15) for _, b in seen],
        "rays": [rays(mesh, b, "cosine", "constant") for mesh, b in seen],
    }
    rows = {}
    for name, (both, first, second, neither) in made.items():
        near = same & (first > 0.02) & (second > 0.02)
        off = (both - (first + second - neither))[near]
        rows[name] = {"both": float(both[near].mean()), "off": rms(off), "bias": float(off.mean())}
    return {"rows": rows}


def judge_separable(found: Found, limit: float) -> Judged:
    volume, cast = (row["off"] / row["both"] for row in found["rows"].values())
    return volume <= limit * cast, volume < cast, {"volume": volume, "rays": cast}


def rays_for_volume(_: Scale, found: Found) -> Found:
    """The rays' numbers under the volume's name."""
    return changed(found, {"volume": found["rows"]["rays"]})


def quadratic(scale: Scale) -> Found:
    """Section 4: a falloff of 1 - r^2 against none, by the same points."""
    buffers, unit, _ = camera_buffers(*scale.size(512, 384))
    points, weights = samples("vo-points", 64)
    lighter = weights * (1 - (points**2).sum(axis=1))
    there = np.isfinite(buffers.depth)
    rows = {}
    constant = lfssao.estimate("vo-points", buffers, 0.03 * unit, points, weights).texture
    others = {"quadratic": (0.03, lighter), "constant, R / 4": (0.0075, weights)}
    for name, (share, own) in others.items():
        made = lfssao.estimate("vo-points", buffers, share * unit, points, own).texture
        difference = (made - constant)[there]
        rows[name] = {"rms": rms(difference), "p99": float(np.percentile(np.abs(difference), 99))}
        rows[name]["correlation"] = correlation(made[there], constant[there])
    return {"rows": rows}


def judge_quadratic(found: Found, limit: float) -> Judged:
    own = found["rows"]["quadratic"]
    return own["rms"] <= limit, own["rms"] <= 2 * limit, {"rms": own["rms"], "correlation": own["correlation"]}


def quarter_radius(_: Scale, found: Found) -> Found:
    """Another radius under the name of the falloff."""
    return changed(found, {"quadratic": found["rows"]["constant, R / 4"]})


def area_sample(scale: Scale, place: Any = lambda ao, _: ao) -> Found:
    """Section 4.2: one area sample, and few lines; place: where the area sample's ao is put."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.03)
    creases = there & (truth >= np.percentile(truth[there], 90))
    made = {"1 area": place(lfssao.estimate("vo-area", buffers, radius).texture, there)}
    made |= {f"{n} line{'s' if n > 1 else ''}": occlusion("vo-lines", buffers, radius, n) for n in (1, 3, 5)}
    pictures = {name: 1 - t for name, t in {**made, "64 lines": truth}.items()}
    scale.save("vo-section-42-one-area-sample", tiles(pictures, 3))
    return {"rows": {name: {"correlation": correlation(t[there], truth[there]), "rmse": rms((t - truth)[there]),
                            "creases": float(t[creases].mean() - t[there].mean())} for name, t in made.items()},
            "creases": float(truth[creases].mean() - truth[there].mean())}  # fmt: skip


def judge_area_sample(found: Found, limit: float, darker: float) -> Judged:
    own = found["rows"]["1 area"]
    line = found["rows"]["1 line"]
    fits = own["correlation"] >= max(limit, line["correlation"]), own["creases"] >= darker * found["creases"]
    told = {"area": own["correlation"], "line": line["correlation"], "creases": own["creases"] / found["creases"]}
    return all(fits), any(fits), told


def top_level(scale: Scale) -> Found:
    """Section 4.2: the pyramid with and without a blur, at a large radius."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.1)
    inner = ndimage.binary_erosion(there, iterations=2)
    rows = {}
    for name, blurred in (("without blur", False), ("with blur", True)):
        made = lfssao.estimate("vo-area", buffers, radius, randomize=False, prefilter=blurred).texture.astype(float)
        rows[name] = {"rmse": rms((made - truth)[there]), "uneven": rms(ndimage.laplace(made)[inner])}
    rows["64 lines"] = {"rmse": 0.0, "uneven": rms(ndimage.laplace(truth.astype(float))[inner])}
    return {"rows": rows}


def judge_top_level(found: Found, limit: float) -> Judged:
    without = found["rows"]["without blur"]
    with_ = found["rows"]["with blur"]
    told = {"uneven": with_["uneven"] / without["uneven"], "error": with_["rmse"] / without["rmse"]}
    return told["uneven"] <= limit and told["error"] <= 1.1, told["uneven"] < 1, told


def exchanged(_: Scale, found: Found) -> Found:
    """The pyramids under each other's names."""
    rows = found["rows"]
    return changed(found, {"with blur": rows["without blur"], "without blur": rows["with blur"]})


def tangent_sphere(scale: Scale) -> Found:
    """Section 4.4: points in the largest sphere above the tangent plane, against those of the half ball."""
    size = scale.size(512, 384)
    buffers, unit, _ = camera_buffers(*size)
    (truth, seen), radius = rays_of(size, 0.05), 0.05 * unit
    points = lfssao.make_samples("sobol", 64, 0, 0.0)

    def sphere(normals: Any) -> Any:
        middle = replace(buffers, positions=buffers.positions + np.float32(radius / 2) * normals)
        return lfssao.estimate("point", middle.turned("hash"), radius / 2, points).texture

    made = {"tangent sphere": sphere(buffers.normals), OTHERS: sphere(moved(buffers.normals, seen))}
    made["half ball"] = lfssao.estimate("hemisphere", buffers.turned("hash"), radius, points).texture
    return {"rows": {name: {"correlation": correlation(t[seen], truth[seen]), "rmse": rms((t - truth)[seen])}
                     for name, t in made.items()}}  # fmt: skip


OTHERS = "sphere by another texel's normal"


def judge_tangent_sphere(found: Found) -> Judged:
    own, _, half = (row["correlation"] for row in found["rows"].values())
    errors = [found["rows"][name]["rmse"] for name in ("tangent sphere", "half ball")]
    return own > half and errors[0] < errors[1], own > half or errors[0] < errors[1], {
        "sphere": own, "half": half, "sphere_error": errors[0], "half_error": errors[1],
    }  # fmt: skip


def other_sphere(_: Scale, found: Found) -> Found:
    """The sphere that touches another texel's plane."""
    return changed(found, {"tangent sphere": found["rows"][OTHERS]})


def contact(scale: Scale) -> Found:
    """Section 6: the width of a wall's shadow, and the shadow of a thin bar, by volume and by rays."""
    wall = boxes(scale, ((-2, -1, 0), (2, 0, 2)))
    thin = boxes(scale, ((-2, -0.02, 0.1), (2, 0, 0.12)))
    rows: dict[str, Any] = {}
    for name in ("volume", "rays", "rays again"):
        if name == "volume":
            made = [occlusion("vo-lines-normal", buffers, RADIUS, 64) for _, buffers in (wall, thin)]
        else:
            made = [rays(*scene, "cosine", "constant", len(rows)) for scene in (wall, thin)]
        edges = np.linspace(0, RADIUS, 26)
        y = wall[1].positions[..., 1]
        floor = floor_of(wall[1], RADIUS)
        profile = np.array([made[0][floor & (y >= a) & (y < b)].mean() for a, b in pairwise(edges)])
        half = np.interp(-0.25, -profile, (edges[1:] + edges[:-1]) / 2) / RADIUS
        near = floor_of(thin[1], RADIUS)
        rows[name] = {"half": float(half), "thin": float(made[1][near].mean())}
    return {"rows": rows}


def judge_contact(found: Found, limit: float) -> Judged:
    volume = found["rows"]["volume"]
    cast = found["rows"]["rays"]
    ratio = {key: volume[key] / cast[key] for key in ("half", "thin")}
    apart = [abs(ratio[key] - 1) > limit for key in ratio]
    return all(apart), any(apart), {"half": volume["half"], "rays": cast["half"], "thin": ratio["thin"]}


def rays_again(_: Scale, found: Found) -> Found:
    """Other rays under the volume's name."""
    return changed(found, {"volume": found["rows"]["rays again"]})


CLAIMS = {
    "VO section 4, single solid": Claim(single_solid, judge_single_solid, thin_for_thick),
    "VO section 4, separable": Claim(separable, judge_separable, rays_for_volume),
    "VO section 4, quadratic falloff": Claim(quadratic, judge_quadratic, quarter_radius),
    "VO section 4.2, one area sample": Claim(
        area_sample, judge_area_sample, lambda scale, _: area_sample(scale, moved)
    ),
    "VO section 4.2, Gaussian blur": Claim(top_level, judge_top_level, exchanged),
    "VO section 4.4, tangent sphere": Claim(tangent_sphere, judge_tangent_sphere, other_sphere),
    "VO section 6, contact": Claim(contact, judge_contact, rays_again),
}
