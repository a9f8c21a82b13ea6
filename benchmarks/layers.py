"""Estimators on all surfaces along each texel's ray, where a depth texture has the first alone.

Hits of a ray with triangles that face the viewer begin a solid, others end it; solids that overlap are one. A solid
that no hit ends goes on for ever, and a back before which no solid has begun hides nothing: both are of meshes that are
not closed. An estimator that reads depth takes all behind the first hit for solid. On all layers it is

- *solids*, of samples that are points or lines: what it finds behind the beginnings of all solids, less what it finds
  behind their ends. Its terms are measures of what lies behind a depth, so this is exact.
- *range check*, where a term depends on how far away the surface is: a point sees the first solid of its texel's ray
  that does not end in front of it.
- *points of surfaces*, whose terms are of the surface's point itself: the largest term of all hits of the sample's ray.
- *march*, along directions: each step takes all hits of its ray, nearest first.

The others read depth through passes of their own (SAO's levels, average and blur, resolutions, means and variances of
areas), of which none says what it would make of a second layer.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao import Buffers, RayCaster
from lfssao.ao.estimators.estimator import Estimator, Options
from lfssao.ao.estimators.registry import find_estimator, options_at
from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.kernels.folds import fold_steps
from lfssao.ao.kernels.sums import sum_samples
from lfssao.ao.ssao import run_kernel
from lfssao.ao.textures import Texture
from lfssao.bench.work_precision.settings import Inputs
from lfssao.core.affine import determinant
from lfssao.core.distinct import distinct
from lfssao.core.jit import kernel
from lfssao.core.numbers import larger
from lfssao.gbuffer.kernels.bvh import LEAF
from lfssao.gbuffer.kernels.triangle import edge_functions, hit_triangle, triangle_at
from lfssao.optics.kernels.rays import clip_to_slab, texel_ray, write_lines

Depths = NDArray[np.float64]
_MOST = 32  # hits of a ray, at first


class Layers(NamedTuple):
    """Cast z of all hits of a view's rays, nearest first, and of the beginnings and ends of solids; +infinity for none.

    hits: (m, H, W), begins, ends: (n, H, W), float64. points: (m, H, W, 3), the hits' world coordinates.
    """

    hits: Depths
    points: Depths
    begins: Depths
    ends: Depths

    def cropped(self, guard: int) -> "Layers":
        """The layers without a guard band."""
        inside = slice(guard, self.hits.shape[1] - guard), slice(guard, self.hits.shape[2] - guard)
        return Layers(*(each[:, *inside] for each in self))


@kernel(rows="count")
def _find_hits(begin, stop, rays, tree, z, area, count):
    """Write z of all hits of each texel's ray, and twice the area of the triangle as the ray sees it, in no order.

    z, area: (H, W, n), out. count: (H, W), out, how many hits there are, more than n too.
    """
    boxes = tree.boxes
    stack = np.empty(128, np.int64)
    most = z.shape[2]
    first_leaf = (boxes.shape[0] + 1) // 2 - 1
    for j in range(begin, stop):
        for i in range(count.shape[1]):
            ox, oy, _, dx, dy, _, near, far = texel_ray(rays, i + 0.5, j + 0.5)
            count[j, i], stack[0], top = 0, 0, 1
            while top > 0 and near < far:
                top -= 1
                node = stack[top]
                first, last = clip_to_slab(ox, dx, boxes[node, 0], boxes[node, 3], boxes[node, 2], boxes[node, 5])
                first, last = clip_to_slab(oy, dy, boxes[node, 1], boxes[node, 4], first, last)
                if not first <= last + 1e-9 * (abs(first) + abs(last)):
                    continue
                if node < first_leaf:
                    stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
                    top += 2
                    continue
                start = LEAF * (node - first_leaf)
                for p in range(start, min(start + LEAF, tree.order.shape[0])):
                    triangle = triangle_at(tree.corners, p)
                    hit, at = hit_triangle(ox, oy, dx, dy, triangle)
                    if hit and near < at < far:
                        u, v, w = edge_functions(ox, oy, dx, dy, triangle)
                        place = min(count[j, i], most - 1)
                        z[j, i, place], area[j, i, place] = at, (u + v) + w
                        count[j, i] += 1


def layers_of(caster: RayCaster, view: Any) -> Layers:
    """Return the layers of a view, by the caster of its cast space."""
    most = _MOST
    size = (view.height, view.width)
    while True:
        z = np.full((*size, most), np.inf)
        area = np.zeros((*size, most))
        count = np.zeros(size, np.int64)
        _find_hits(view.rays, caster._tree.arrays, z, area, count)
        if count.max() <= most:
            break
        most = int(count.max())
    # A triangle that is counterclockwise from outside has, seen along the ray, the sign of the map's determinant.
    front = area * determinant(view.cast_from_world) < 0
    order = np.lexsort((~front, z))[..., : max(count.max(), 1)]
    hits, front = (np.moveaxis(np.take_along_axis(each, order, 2), 2, 0) for each in (z, front))
    return Layers(np.ascontiguousarray(hits), _points(view, hits), *_solids(hits, front))


def _points(view: Any, z: Depths) -> Depths:
    """World coordinates of the points of texels' rays at cast z, (m, H, W, 3); infinity for z that are."""
    v, u = (each.ravel() + 0.5 for each in np.mgrid[: view.height, : view.width])
    lines = np.empty((len(u), 8))
    write_lines(view.rays, np.ravel(view.world_from_cast), u, v, lines)
    start, end = (lines[:, k : k + 3].reshape(*z.shape[1:], 3) for k in (0, 3))
    hit = z[..., None] < np.inf
    return np.where(hit, start + np.where(hit, z[..., None], 0) * (end - start), np.inf)


def _solids(hits: Depths, front: NDArray[np.bool_]) -> tuple[Depths, Depths]:
    """Beginnings and ends of solids, of hits from the nearest on, (n, H, W) each."""
    begins = np.full(hits.shape, np.inf)
    ends = np.full(hits.shape, np.inf)
    depth = np.zeros(hits.shape[1:], np.int64)
    solid = np.zeros((1, *hits.shape[1:]), np.int64)
    for z, faces in zip(hits, front, strict=True):
        hit = z < np.inf
        for wanted, target in ((hit & faces & (depth == 0), begins), (hit & ~faces & (depth == 1), ends)):
            held = np.take_along_axis(target, solid, 0)
            np.put_along_axis(target, solid, np.where(wanted, z, held), 0)
        solid += hit & ~faces & (depth == 1)
        solid = np.minimum(solid, len(hits) - 1)
        depth = np.maximum(depth + np.where(hit, np.where(faces, 1, -1), 0), 0)
    kept = max(int((begins < np.inf).any(axis=(1, 2)).sum()), 1)
    return begins[:kept], ends[:kept]


# Formulas on layers, which lie behind each other in the view's textures


class OnLayers(NamedTuple):
    """An estimator's numbers, and what they are on layers but for samples.

    points: the estimator's. steps, sides: its own, of estimators that march. layers: how many textures lie behind each
    other. size: texels of one.
    """

    points: Any
    steps: int
    sides: int
    inner: Any
    layers: int
    size: int

    def start(self, view: Any, texel: Any) -> Any:
        """The estimator's."""
        return self.inner.start(view, texel)

    def counts(self, view: Any, here: Any) -> Any:
        """The estimator's."""
        return self.inner.counts(view, here)

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The estimator's."""
        return self.inner.place(view, here, s)

    def background(self) -> Any:
        """The estimator's."""
        return self.inner.background()

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The estimator's."""
        return self.inner.begin(view, here, s)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """The estimator's."""
        return self.inner.part(view, texel, k)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The estimator's."""
        return self.inner.leave(view, here, s, state)

    def end(self, total: Any) -> Any:
        """The estimator's."""
        return self.inner.end(total)


class Peeled(OnLayers):
    """Points see the first solid that does not end in front of them; layers: beginnings and ends of solids in turn."""

    __slots__ = ()

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The estimator's, of that solid's beginning."""
        passed = np.uint32(0)
        for k in range(1, self.layers, 2):
            passed += np.uint32(view.surface(np.uint32(seen + np.uint32(k * self.size))) <= z)
        passed = min(passed, np.uint32(self.layers // 2 - 1))
        return self.inner.term(view, here, s, z, texel, np.uint32(seen + passed * np.uint32(2 * self.size)))


class Largest(OnLayers):
    """Samples have the largest term of their ray's hits."""

    __slots__ = ()

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The largest of the hits' terms."""
        term = self.inner.term(view, here, s, z, texel, seen)
        for k in range(1, self.layers):
            other = np.uint32(seen + np.uint32(k * self.size))
            term = larger(term, self.inner.term(view, here, s, z, texel, other))
        return term


class Marched(OnLayers):
    """Each step takes all hits of its ray."""

    __slots__ = ()

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """The sum of the hits' numbers, and the state after all."""
        total, after = self.inner.step(view, here, s, k, state, texel, seen)
        for layer in range(1, self.layers):
            other = np.uint32(seen + np.uint32(layer * self.size))
            added, after = self.inner.step(view, here, s, k, after, texel, other)
            total = total + added
        return total, after


class Run(NamedTuple):
    """The view's textures and layers, the estimator's numbers and options: all that a rule reads."""

    buffers: Buffers
    layers: Layers
    numbers: Any
    options: Options

    def view(self) -> Any:
        """The view as formulas read it."""
        return float_view(self.buffers, words_of(self.numbers), self.options)

    def surfaces(self, z: Depths) -> Texture:
        """Cast z of surfaces as the estimator reads them, image z where it asks for that."""
        if "image_z" in words_of(self.numbers):
            view = self.buffers.view
            hit = z < np.inf
            z = np.where(hit, view.image_z(view.depth_at(np.where(hit, z, 1.0))), np.inf)
        return np.ascontiguousarray(z, self.buffers.depth.dtype)

    def beside(self) -> dict[str, Any]:
        """The fields of ``OnLayers`` but for the number of layers."""
        marches = {key: getattr(self.numbers, key, 0) for key in ("steps", "sides")}
        return {"points": self.numbers.points, "inner": self.numbers, "size": self.buffers.depth.size, **marches}


def _on_solids(run: Run) -> Texture:
    view = run.view()
    total = np.zeros(run.buffers.depth.shape)
    for sign, depths in ((1, run.layers.begins), (-1, run.layers.ends)):
        for z in depths:
            if (z < np.inf).any():
                behind = view._replace(surfaces=run.surfaces(z).ravel())
                total += sign * run_kernel(sum_samples, run.buffers.depth, behind, distinct(run.numbers)).texture
    return total


def _on_peeled(run: Run) -> Texture:
    both = np.stack([run.layers.begins, run.layers.ends], axis=1)
    view = run.view()._replace(surfaces=run.surfaces(both).ravel())
    numbers = Peeled(layers=2 * len(both), **run.beside())
    return run_kernel(sum_samples, run.buffers.depth, view, distinct(numbers)).texture


def _with_points(run: Run) -> Any:
    """The view with the positions of all hits, the first as its texture has them."""
    points = np.ascontiguousarray(run.layers.points, run.buffers.depth.dtype)
    points[0] = run.buffers.positions
    return run.view()._replace(positions=points.ravel())


def _on_points(run: Run) -> Texture:
    numbers = Largest(layers=len(run.layers.hits), **run.beside())
    return run_kernel(sum_samples, run.buffers.depth, _with_points(run), distinct(numbers)).texture


def _on_march(run: Run) -> Texture:
    numbers = Marched(layers=len(run.layers.hits), **run.beside())
    return run_kernel(fold_steps, run.buffers.depth, _with_points(run), distinct(numbers)).texture


RULES: dict[str, Callable[[Run], Texture]] = {
    **dict.fromkeys(("lf", "point", "hemisphere"), _on_solids),
    **dict.fromkeys(("vo-points", "vo-points-normal", "vo-lines", "vo-lines-normal"), _on_solids),
    "oriented-hemisphere": _on_peeled,
    "alchemy": _on_points,
    **dict.fromkeys(("hbao", "gtao", "visibility-bitmask"), _on_march),
}


def on_all_layers(
    estimator: Estimator, buffers: Buffers, radius: float, inputs: Inputs, layers: Layers, rule: Any = None
) -> Texture:
    """Return an estimator's occlusion, (H, W), on all layers of a view, by the rule of ``RULES`` or another."""
    (points, weights), parameters = inputs
    wanted = find_estimator("point") if estimator.name == "lf" else estimator  # its text in formulas
    (options,) = options_at(wanted, buffers, (radius,), "radii", parameters)
    if points is None:
        points, weights = wanted.default_samples()
    assert wanted.formulas is not None
    numbers = wanted.formulas(buffers, radius, points, weights, options)
    return (rule or RULES[estimator.name])(Run(buffers, layers, numbers, options))
