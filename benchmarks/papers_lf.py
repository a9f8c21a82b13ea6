"""The LF paper's table and figures, measured and judged: 1024x768 and five radii as there, if not said otherwise."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from cpu_times import least
from papers_common import PAPERS, Claim, Found, Judged, Scale, changed, correlation, fine, mean_of, moved, tiles
from scipy import ndimage

import lfssao
from lfssao.bench.work_precision.figures import rms
from lfssao.rendering import contact
from lfssao.rendering.passes import finish_view
from lfssao.rendering.viewer import LightField, eye_view
from lfssao.viz import agreement
from lfssao.viz.radii import deciding_radius

MODELS = ("statue", "ammonite", "armadillo")


class Model(NamedTuple):
    """A model in one view; cover: the share of texels with a surface."""

    mesh: Any
    view: Any
    caster: Any
    settings: Any
    gbuffer: Any
    cover: float


def model(mesh: Any, size: tuple[int, ...], scale: float = 1.0) -> Model:
    """A model whose box, enlarged by a scale, is fitted into the display."""
    middle = mesh.bounds.mean(axis=0)
    display = lfssao.find_display("virtual").with_resolution(*size)
    view = lfssao.module_views(mesh, display, bounds=middle + scale * (mesh.bounds - middle))[0]
    caster = lfssao.RayCaster(mesh, view.cast_from_world, 1)
    gbuffer = caster.gbuffer(view)
    settings = lfssao.Settings(lfssao.default_radii(mesh))
    return Model(mesh, view, caster, settings, gbuffer, float(np.mean(gbuffer.triangle >= 0)))


def covering(seen: Model, cover: float, size: tuple[int, ...]) -> Model:
    """The same model, its box enlarged until it covers that share, within one in a hundred of it."""
    scale = 1.0
    for _ in range(8):
        if abs(seen.cover / cover - 1) <= 0.01:
            break
        scale *= (seen.cover / cover) ** 0.5
        seen = model(seen.mesh, size, scale)
    return seen


def face_counts(scale: Scale) -> Found:
    """Table 1."""
    size = scale.size(1024, 768)
    shown = [model(lfssao.builtin_scene(name), size) for name in MODELS]
    smallest = min(each.cover for each in shown)
    models = {f"{name}, as shown": m for name, m in zip(MODELS, shown, strict=True)}
    models |= {f"{name}, equal cover": covering(m, smallest, size) for name, m in zip(MODELS, shown, strict=True)}
    runs: dict[Any, Any] = {name: partial(finish_view, m.gbuffer, m.view, m.settings) for name, m in models.items()}
    runs |= {(name, "before"): partial(m.caster.gbuffer, m.view) for name, m in models.items()}
    times = least(runs, scale.repeats(60))
    facts = {name: {"faces": len(m.mesh.faces), "cover": m.cover} for name, m in models.items()}
    return {"rows": {n: facts[n] | times[n] | {"before": times[n, "before"]["ms"]} for n in models}}


def judge_face_counts(found: Found, limit: float) -> Judged:
    ms = {state: [row["ms"] for name, row in found["rows"].items() if state in name] for state in ("shown", "equal")}
    spread = {state: 100 * (max(t) - min(t)) / float(np.mean(t)) for state, t in ms.items()}
    return spread["shown"] <= limit, spread["equal"] <= limit, spread


def frames_without(_: Scale, found: Found) -> Found:
    """The paper's times of frames without SSAO."""
    theirs = PAPERS["LF table 1"]["milliseconds"]
    return changed(found, {name: {"ms": theirs[name.split(",")[0]][0]} for name in found["rows"]})


def contrast(image: Any, seen: Any) -> Any:
    """Deviation of a pixel's light from that around it, a share of the mean light."""
    light = image.mean(axis=-1, dtype=np.float64)
    return fine(light, seen) / float(light[seen].mean())


def roughness(normals: Any, seen: Any, size: int = 9) -> Any:
    """Deviation of the normals in a square window: 0 on a plane, 1 where they cancel."""
    weight = np.maximum(ndimage.uniform_filter(seen.astype(float), size), 1e-9)
    mean = [ndimage.uniform_filter(np.where(seen, normals[..., k], 0).astype(float), size) / weight for k in range(3)]
    return np.sqrt(np.maximum(1 - np.square(mean).sum(axis=0), 0))


def shaded_models(scale: Scale, place: Any = lambda ao, _: ao) -> Found:
    """Figure 10; place: where the ao is put."""
    rows = {}
    strips = []
    for name in MODELS:
        m = model(lfssao.builtin_scene(name), scale.size(1024, 768))
        seen = m.gbuffer.triangle >= 0
        rough = roughness(m.caster.gbuffer(m.view, normals="smooth").normals, seen)
        rougher = seen & (rough > np.median(rough[seen]))
        few = finish_view(m.gbuffer, m.view, m.settings)
        many = finish_view(m.gbuffer, m.view, lfssao.Settings(m.settings.radii, lfssao.make_samples("sobol", 64)))
        images = {"none": few.image}
        images |= {n: few.image * (1 - place(t.blurred, seen)[..., None]) for n, t in (("8", few), ("64", many))}
        deviation = {key: contrast(image, seen) for key, image in images.items()}
        rows[name] = {key: rms(each[seen]) for key, each in deviation.items()}
        for part, texels in (("rough", rougher), ("smooth", seen & ~rougher)):
            rows[name][part] = rms(deviation["64"][texels]) - rms(deviation["none"][texels])
        rows[name]["visibility"] = float(1 - few.blurred[seen].mean())
        (box,) = ndimage.find_objects(seen.astype(int))
        cut = [texture[box] for texture in (few.image, few.blurred, few.shaded)]
        strips.append((name, contact.strip(*cut, width=250).convert("RGB")))
    scale.save("lf-figure-10", contact.contact_sheet(strips))
    return {"rows": rows}


def judge_shaded_models(found: Found, limit: float) -> Judged:
    rows = found["rows"].values()
    gains = [row["64"] - row["none"] for row in rows]
    rougher = [row["64"] > row["none"] and row["rough"] >= limit * row["smooth"] for row in rows]
    rough, smooth = (np.mean([row[part] for row in rows]) for part in ("rough", "smooth"))
    told = {"low": min(gains), "high": max(gains), "rough": rough, "smooth": smooth}
    return all(rougher), any(rougher), told


def single_pixels(scale: Scale, filtered: Any = lambda made, _: made.blurred) -> Found:
    """Figure 11: samples that turn by the hash, and shared ones; filtered: what the blur makes of them."""
    m = model(lfssao.builtin_scene("statue"), scale.size(1024, 768))
    seen = m.gbuffer.triangle >= 0
    ring = np.ones((3, 3), bool)
    ring[1, 1] = False
    (box,) = ndimage.find_objects(seen.astype(int))
    part = tuple(slice(side.start + length // 3, side.start + length // 3 + 150) for side, length in
                 ((side, side.stop - side.start) for side in box))  # fmt: skip
    many = lfssao.make_samples("sobol", 1024, r_min=0.8)
    limit = finish_view(m.gbuffer, m.view, lfssao.Settings(m.settings.radii, many, rotation="none")).merged
    rows = {}
    pictures = {}
    for rotation in ("hash", "none"):
        made = finish_view(m.gbuffer, m.view, lfssao.Settings(m.settings.radii, rotation=rotation))
        for stage, texture in (("before", made.merged), ("after", filtered(made, seen))):
            white = ndimage.maximum_filter(1 - texture, footprint=ring) <= 1 - texture - 0.25
            rows[f"{rotation}, {stage}"] = {"single": int((white & seen).sum()), "rmse": rms((texture - limit)[seen])}
            pictures[f"{rotation}, {stage} the blur"] = np.where(seen, 1 - texture, 1)[part]
    rows["a constant"] = {"single": 0, "rmse": rms(limit[seen] - limit[seen].mean(dtype=np.float64))}
    scale.save("lf-figure-11", tiles(pictures, 4))
    return {"rows": rows, "texels": int(seen.sum())}


def judge_single_pixels(found: Found, limit: float) -> Judged:
    before, after = (found["rows"][f"hash, {stage}"] for stage in ("before", "after"))
    constant = found["rows"]["a constant"]["rmse"]
    kept = after["single"]
    better = after["rmse"] < min(before["rmse"], constant)
    told = {"before": before["single"], "after": kept, "texels": found["texels"]}
    told |= {"rmse_before": before["rmse"], "rmse_after": after["rmse"], "constant": constant}
    whole = better and before["single"] > 0 and 100 * kept <= limit * before["single"]
    return whole, better and kept < before["single"], told


def mean_merged(made: Any, seen: Any) -> Any:
    """The mean of what is blurred."""
    return mean_of(made.merged, seen)


def best_radius_drawn(gbuffer: Any, view: Any, radii: Any, n: int, best: int) -> Any:
    """The maximum over as many draws of one radius as there are radii."""
    return np.max([
        finish_view(gbuffer, view, lfssao.Settings((radii[best],), lfssao.make_samples("latin", n, seed),
                                                   rotation_seed=seed)).merged
        for seed in range(len(radii))
    ], axis=0)  # fmt: skip


DRAWS = "maximum of five draws"


def several_radii(scale: Scale) -> Found:
    """Figures 12 and 13; five draws: of the radius that is best with that number of samples."""
    mesh = lfssao.builtin_scene("statue")
    view = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(*scale.size(500, 300)), [10])[0]
    gbuffer = lfssao.RayCaster(mesh, view.cast_from_world, 2).gbuffer(view, normals="geometric")
    radii = lfssao.default_radii(mesh)
    seen = gbuffer.triangle >= 0
    rays = (lfssao.Occluders(mesh), lfssao.Buffers.of(gbuffer, view), max(radii), "uniform")
    truth = lfssao.ray_cast_occlusion(*rays, tolerance=0.03, rounds=(2, 8)).texture[seen]
    (box,) = ndimage.find_objects(seen.astype(int))
    names = [*(f"R = {radius:.3g}" for radius in radii), "maximum", DRAWS]
    rows: dict[str, Any] = {name: {} for name in names}
    for n in (8, 64):
        made = finish_view(gbuffer, view, lfssao.Settings(radii, lfssao.make_samples("latin", n)))
        decided = deciding_radius(made.ao)
        best = int(np.argmax([correlation(layer[seen], truth) for layer in made.ao]))
        draws = best_radius_drawn(gbuffer, view, radii, n, best)
        layers = dict(zip(names, (*made.ao, made.merged, draws), strict=True))
        for k, (name, layer) in enumerate(layers.items()):
            rows[name] |= {f"mean {n}": layer[seen].mean(), f"correlation {n}": correlation(layer[seen], truth)}
            rows[name] |= {f"decides {n}": np.mean(decided[seen] == k)} if k < len(radii) else {}
        if n == 8:
            shown = {name: np.where(seen, 1 - layer, 1)[box] for name, layer in layers.items()}
            shown["the radius that decides (white: the largest)"] = ((decided + 1) / len(radii))[box]
            scale.save("lf-figures-12-and-13", tiles(shown, 4, 8.0))
    return {"rows": rows}


def judge_several_radii(found: Found) -> Judged:
    rows = list(found["rows"].values())
    told = {"smallest": rows[0]["decides 64"]}
    for word, n in (("few", 8), ("many", 64)):
        *each, told[word], told[f"{word}_draws"] = (row[f"correlation {n}"] for row in rows)
        told[f"{word}_one"] = max(each)
    better = [told[word] > max(told[f"{word}_one"], told[f"{word}_draws"]) for word in ("few", "many")]
    return all(better), any(better), told


def draws_as_radii(_: Scale, found: Found) -> Found:
    """The maximum over draws of one radius under the name of that over all radii."""
    return changed(found, {"maximum": found["rows"][DRAWS]})


EYES = (-0.4, 0.4, 0.0)


def seen_by_a_viewer(scale: Scale, places: tuple[float, ...] = EYES) -> Found:
    """Figure 14; places: where the display is seen from, for each eye."""
    mesh = lfssao.builtin_scene("statue")
    display = lfssao.find_display("sample-a").with_resolution(*scale.size(500, 300))
    modules = range(len(display.modules))
    world = lfssao.fit_roi(mesh.bounds, display.roi)
    settings = lfssao.Settings(lfssao.default_radii(mesh))
    field = LightField(display, modules, 7)
    made = list(lfssao.render(mesh, display, settings, threads=2))
    for k, t in zip(modules, made, strict=True):
        field.put(k, np.concatenate([t.image, t.shaded, t.blurred[..., None]], axis=-1))
    rows = {}
    for eye, place in zip(EYES, places, strict=True):
        view = eye_view(display, world, eye, scale.size(500)[0])
        own = finish_view(lfssao.RayCaster(mesh, view.cast_from_world, 2).gbuffer(view), view, settings)
        shown = field.photograph(place, view.width).image
        seen = own.gbuffer.triangle >= 0
        inner = ndimage.binary_erosion(seen, iterations=3)
        both = shown[..., 6][inner], own.blurred[inner]
        rows[f"eye at {eye:g} m"] = {"correlation": correlation(*both), "rmse": rms(both[0] - both[1])}
    (box,) = ndimage.find_objects(seen.astype(int))
    light = [np.clip(shown[..., k : k + 3], 0, 1) ** (1 / 2.2) for k in (0, 3)]
    visible = [np.where(seen, 1 - ao, 1) for ao in (shown[..., 6], own.blurred)]
    titles = "seen at 0 m without SSAO", "seen with SSAO", "1 - ao as seen", "1 - ao of the eye's own"
    pictures = {title: picture[box] for title, picture in zip(titles, light + visible, strict=True)}
    scale.save("lf-figure-14", tiles(pictures, 4))
    points = agreement.surface_points(made[10].gbuffer, 3000)
    views = [t.view for t in made]
    gbuffers = [t.gbuffer for t in made]
    values = agreement.over_modules(points, views, gbuffers, [t.blurred for t in made], settings.radii[0])
    return {"rows": rows, "modules": len(made), "deviation": agreement.spread(values).deviation}


def judge_seen_by_a_viewer(found: Found, limit: float) -> Judged:
    each = [row["correlation"] for row in found["rows"].values()]
    told = {"low": min(each), "modules": found["modules"], "deviation": found["deviation"]}
    return min(each) >= limit, max(each) >= limit, told


CLAIMS = {
    "LF table 1": Claim(face_counts, judge_face_counts, frames_without),
    "LF figure 10": Claim(shaded_models, judge_shaded_models, lambda scale, _: shaded_models(scale, moved)),
    "LF figure 11": Claim(
        single_pixels,
        judge_single_pixels,
        lambda scale, _: single_pixels(scale, mean_merged),
    ),
    "LF figures 12 and 13": Claim(several_radii, judge_several_radii, draws_as_radii),
    "LF figure 14": Claim(
        seen_by_a_viewer, judge_seen_by_a_viewer, lambda scale, _: seen_by_a_viewer(scale, (*EYES[1:], EYES[0]))
    ),
}
