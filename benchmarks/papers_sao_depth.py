"""Depth and normals that SAO rebuilds from a depth buffer, measured and judged, float32."""

from typing import Any

import numpy as np
from papers_common import Claim, Found, Judged, Scale, camera_buffers, curves, tiles

from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao.kernels.reconstruct import linear_depth
from lfssao.ao.estimators.sao.texel_rays import linear_z, plane_constants


def stored(z: Any, near: float, far: float, bits: int) -> Any:
    """Depth buffer values: float32 projection row times the point, division, storage in 16 or 24 bits or float32."""
    one = np.float32
    a, b = (one(1), one(near)) if far == np.inf else (one(far / (far - near)), one(far * near / (far - near)))
    z = z.astype(np.float32)
    d = (a * z - b) / z
    if bits == 32:
        return d
    steps = 2.0**bits - 1
    return (np.floor(d.astype(float) * steps + 0.5) / steps).astype(np.float32)


def z_errors(scale: Scale, near: float = 0.1) -> Found:
    """Figure 3: error of z from a depth buffer, millimetres."""
    z = np.linspace(1, 60, 200_001).astype(np.float32)
    rows = {}
    figure, (axes,) = curves(1, 6.4)
    for bits in (16, 24, 32):
        for far in (100.0, np.inf):
            back = np.empty((1, len(z)), np.float32)
            constants = [np.float32(x) for x in plane_constants(near, far)]
            linear_depth(stored(z, near, far, bits)[None], True, *constants, back)
            error = 1e3 * np.abs(back[0].astype(float) - z)
            finite = np.where(np.isfinite(error), error, np.nan)
            name = f"{bits} bits, far plane {'infinite' if far == np.inf else '100 m'}"
            rows[name] = {"mean": float(np.nanmean(finite)), "worst": float(np.nanmax(finite))}
            axes.semilogy(z[:-1].reshape(-1, 2000).mean(1), np.nanmean(finite[:-1].reshape(-1, 2000), 1), label=name)
    axes.set(xlabel="z, m", ylabel="mean error of z, mm")
    axes.legend(fontsize="x-small")
    scale.save("sao-figure-3", figure)
    return {"rows": rows}


def judge_z_errors(found: Found, limit: float) -> Judged:
    mean = {tuple(name.split(" bits, far plane ")): row["mean"] for name, row in found["rows"].items()}
    far = min(max(a / b, b / a) for a, b in ((mean[bits, "100 m"], mean[bits, "infinite"]) for bits in ("24", "32")))
    form = max(mean["24", plane] / mean["32", plane] for plane in ("100 m", "infinite"))
    worst = found["rows"]["24 bits, far plane infinite"]["worst"]
    fits = far > form, worst <= limit
    return all(fits), any(fits), {"far": far, "form": form, "worst": worst}


def in_bytes(normals: Any) -> Any:
    """True normals as a texture of three bytes a texel keeps them."""
    back = 2 * np.round(255 * (0.5 * normals + 0.5)) / 255 - 1
    return back / np.linalg.norm(back, axis=-1, keepdims=True)


def sixteen_bits(_: Scale, found: Found) -> Found:
    """Figure 3 with 16 bits under the name of 24."""
    rows = found["rows"]
    return {"rows": {name: rows[name.replace("24", "16")] for name in rows}}


def normal_errors(scale: Scale, stored_true: Any = None) -> Found:
    """Figure 4: angle between rebuilt and triangle normals where the texels of the differences see one triangle.

    stored_true: what a G-buffer makes of the triangles' normals, in place of rebuilt ones.
    """
    buffers, _, gbuffer = camera_buffers(*scale.size(1024, 768))
    true = gbuffer.normals.astype(float)
    view = scalable.sao_view(buffers, linear_z(buffers), scalable.AppendixOptions())
    made = stored_true(true) if stored_true else view.normals.reshape(true.shape).astype(float)
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(made, true), axis=-1), (made * true).sum(-1)))
    t = gbuffer.triangle
    pair = t.reshape(t.shape[0], -1, 2)[..., ::-1].reshape(t.shape)
    below = t.reshape(-1, 2, t.shape[1])[:, ::-1].reshape(t.shape)
    inside = (t >= 0) & (t == pair) & (t == below)
    steep = np.abs((true * buffers.directions).sum(-1)) <= np.cos(np.radians(80))
    shown = np.where(inside, 1 - np.minimum(angle / 0.02, 1), np.where(t >= 0, 0.8, 1))
    scale.save(
        "sao-figure-4", tiles({"grey: a texel beside an edge": shown[len(shown) // 4 : -len(shown) // 4]}, 1, 8.0)
    )
    cases = {"all": angle[inside], "seen within 80 degrees": angle[inside & ~steep]}
    quantiles = {"median": 50, "p999": 99.9, "worst": 100}
    return {"rows": {name: {k: np.percentile(a, q) for k, q in quantiles.items()} for name, a in cases.items()}}


def judge_normal_errors(found: Found, limit: float) -> Judged:
    worst = found["rows"]["all"]["worst"]
    most = found["rows"]["seen within 80 degrees"]["p999"]
    return worst <= limit, most <= limit, {"worst": worst, "most": most}


ORDERS = ("in order", "in pairs", "fused, in order", "fused, translation first")


def summed(row: Any, points: Any, order: str) -> Any:
    """A row of a matrix times points, float32, its four products added in an order."""
    one = np.float32
    a, b, c = (row[k] * points[:, k] for k in range(3))
    if order == "in order":
        return ((a + b) + c) + row[3]
    if order == "in pairs":
        return (a + b) + (c + row[3])

    def fused(k: int, so_far: Any) -> Any:
        return (row[k].astype(float) * points[:, k] + so_far).astype(one)  # exact product, all but rounded once

    if order == "fused, in order":
        return fused(2, fused(1, a)) + row[3]
    return fused(0, fused(1, fused(2, np.full(len(points), row[3], one))))


def products(_: Scale) -> Found:
    """Section 2.1: error of camera z by the order of a product's sum, in ulps of z, over 200 cameras in a hall."""
    rng = np.random.default_rng(0)
    errors = {order: [] for order in ORDERS}
    for _k in range(200):
        axis = np.linalg.qr(rng.normal(size=(3, 3)))[0][2]
        row = np.array([*axis, -axis @ rng.uniform(-15, 15, 3)]).astype(np.float32)
        points = rng.uniform(-15, 15, (4000, 3)).astype(np.float32)
        exact = points.astype(float) @ row[:3].astype(float) + float(row[3])
        near = (exact > 1) & (exact < 60)
        for order in ORDERS:
            error = (summed(row, points, order).astype(float) - exact)[near]
            errors[order].append(error / np.spacing(exact[near].astype(np.float32)))
    rows = {order: {"ulps": float(np.sqrt(np.mean(np.concatenate(e) ** 2)))} for order, e in errors.items()}
    for row in rows.values():
        row["bits"] = float(np.log2(rows["in order"]["ulps"] / row["ulps"]))
    return {"rows": rows}


def judge_products(found: Found, limit: float, least: float) -> Judged:
    bits = {name: row["bits"] for name, row in found["rows"].items()}
    gain = max(bits.values()) - min(bits.values())
    return gain >= limit, gain >= least, {"gain": gain, "best": max(bits, key=lambda name: bits[name])}


def one_order(_: Scale, found: Found) -> Found:
    """Both products in the same order."""
    return {"rows": dict.fromkeys(found["rows"], found["rows"]["in order"])}


CLAIMS = {
    "SAO section 2.1, half a bit": Claim(products, judge_products, one_order),
    "SAO figure 3": Claim(z_errors, judge_z_errors, sixteen_bits),
    "SAO figure 4": Claim(normal_errors, judge_normal_errors, lambda scale, _: normal_errors(scale, in_bytes)),
}
