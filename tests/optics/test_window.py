"""Rows of texels that can see a box: no ray of another row hits anything in it."""

import itertools

import numpy as np
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast

from lfssao.optics.window import seen_rows


def cast(view, vertices, faces):
    hits = raycast.first_hits(raycast.texel_rays(*view.rays, view.width, view.height), vertices[faces])
    return hits.triangle.reshape(view.height, view.width) >= 0


BOX_FACES = np.array([(0, 1, 3), (0, 3, 2), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 3, 7), (2, 7, 6),
                      (0, 2, 6), (0, 6, 4), (1, 3, 7), (1, 7, 5)])  # fmt: skip


@settings(max_examples=80)
@given(
    name=st.sampled_from(list(scenes.VIEWS)),
    size=st.sampled_from([(20, 15), (33, 9), (1, 1), (24, 18)]),
    seed=st.integers(0, 2**32),
)
def test_no_ray_outside_the_rows_hits_what_is_in_the_box(name, size, seed):
    """Boxes anywhere, drawn as their six sides, by brute force; at most 3 rows too many on each side."""
    view, rng = scenes.VIEWS[name](*size), np.random.default_rng(seed)
    points = scenes.anywhere(view, rng, 2, 0.6)
    points = points[0] + (points - points[0]) * rng.choice([1.0, 0.3, 0.02])
    bounds = scenes.to_world(view, points)
    bounds = np.stack([bounds.min(axis=0), bounds.max(axis=0)])
    corners = np.array(list(itertools.product(*bounds.T)))
    hit = cast(view, np.stack(raycast.affine(view.cast_from_world, *corners.T), axis=1), BOX_FACES)
    rows, seen = seen_rows(view, bounds), np.flatnonzero(hit.any(axis=1))
    if len(seen):
        assert rows.start <= seen[0] <= seen[-1] < rows.stop
        if rows.start > 0 and rows.stop < view.height:  # not cut off by the texture's border
            assert seen[0] - rows.start <= 3
            assert rows.stop - 1 - seen[-1] <= 3


def test_all_rows_are_cast_for_a_box_at_a_singular_plane():
    """A box that reaches the eye, the lens or the observers' line, or lies where rounding is not small."""
    for name in scenes.VIEWS:
        view = scenes.VIEWS[name](20, 15)
        end = 9.0 + (0.0 if name in ("perspective", "orthographic") else float(view.lens[1]))
        around = scenes.to_world(view, np.array([[-9.0, -9.0, -9.0], [9.0, 9.0, end]]))
        assert seen_rows(view, np.sort(around, axis=0)) == range(view.height), name
    view = scenes.VIEWS["virtual"](20, 15)
    middle = np.array([[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]])
    assert seen_rows(view, middle) != range(view.height)
    for axis in range(2):
        box = middle.copy()
        box[:, axis] = 1e14 * (1 - 1e-3), 1e14
        assert seen_rows(view, box) == range(view.height)
