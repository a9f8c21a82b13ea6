"""Views and mappings: numbers that float32 cannot hold are refused; mappings of one's own; rows that see a box."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import raycast_scenes as scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import raycast

from lfssao import Camera, InputError, Module, WorldToImage, find_display
from lfssao.optics import lens as optics
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import seen_rows

CAMERA = Camera("perspective", (1.0, 2.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0)


@pytest.mark.parametrize("factor", [1e39, 1e-41])
def test_mappings_beyond_float32_are_refused(factor):
    mapping = WorldToImage(MATRIX, factor * np.eye(4).ravel())
    assert mapping.as_type(np.float64).numbers[0] == factor
    with pytest.raises(InputError, match="leaves the range of float32: scale the world"):
        mapping.as_type(np.float32)


@pytest.mark.parametrize(("field", "value", "words"), [
    ("lens", np.zeros(7), r"lens has shape \(7,\), expected \(8,\)"),
    ("lens", np.zeros(32), r"lens has shape \(32,\), expected \(8,\)"),
    ("lens", "lens", "lens is .*, expected numbers"),
    ("cast_from_world", np.eye(4), r"cast_from_world has shape \(4, 4\), expected \(3, 4\)"),
    ("world_from_cast", np.eye(3), r"world_from_cast has shape \(3, 3\), expected \(3, 4\)"),
    ("screen_to_world", np.eye(3, 4), r"screen_to_world has shape \(3, 4\), expected \(4, 4\)"),
    ("world_to_image", find_display("convex").view(0, np.eye(3, 4)).world_to_image, r"lens .*, expected \(32,\)"),
    ("world_to_image", np.eye(4), "world_to_image is"),
])  # fmt: skip
def test_a_view_whose_numbers_a_kernel_would_read_beyond_their_end_is_refused(field, value, words):
    with pytest.raises(InputError, match=words):
        replace(CAMERA.view(8, 6), **{field: value})


# Mappings of one's own

WORLD = np.array([[0.5, 0.1, 0.0, -0.1], [-0.1, 0.45, 0.05, 0.01], [0.0, 0.1, -0.6, 0.05]])
SAMPLE = find_display("sample-a")
CONVEX = find_display("convex")
CALIBRATED = Module(0.3, 0.05, 0.7, 32, 24, homography=(32.5, 0.6, 16.2, -0.4, -31.2, 12.3, 0.02, -0.03, 1.0), k1=-0.06)
DISPLAYS = {
    "crossed slits": SAMPLE,
    "curved": CONVEX,
    "conical": replace(SAMPLE, diffuser="conical"),
    "calibrated": replace(SAMPLE, modules=(CALIBRATED,)),
}


def bits(mapping):
    return mapping.kind, mapping.numbers.tobytes()


def own_mapping(display, module):
    """A module's mapping by the arguments that a display's numbers are, not by ``Display.view``."""
    w = display.screen_width
    h = display.screen_height
    z_o = display.observer_z
    y_o = display.observer_height
    width = module.width
    height = module.height
    if display is SAMPLE:
        x, y, z = WORLD - [[0, 0, 0, module.x], [0, 0, 0, y_o], [0, 0, 0, 0]]
        rows = [module.z * (width / w) * x, z_o * (-height / h) * y, z]
        offsets = width / 2 + width / w * module.x, height / 2 - height / h * y_o
        return WorldToImage.crossed_slits(rows, module.z, z_o, *offsets)
    homography = module.homography or optics.aligned_homography((w, h), (width, height))
    bent = {"screen_curvature": display.screen_curvature, "observer_curvature": display.observer_curvature}
    radial = {"c_u": width / 2, "c_v": height / 2, "unit": width / 2, "k1": module.k1, "k2": module.k2}
    place = {"m_x": module.x, "m_y": module.y, "m_z": module.z, "y_o": y_o, "z_o": z_o, "diffuser": display.diffuser}
    return WorldToImage.display(WORLD, **place, homography=homography, **bent, **radial)


@pytest.mark.parametrize("name", DISPLAYS)
def test_a_mapping_of_ones_own_has_the_bits_of_the_displays(name):
    display = DISPLAYS[name]
    index = len(display.modules) // 3
    assert bits(own_mapping(display, display.modules[index])) == bits(display.view(index, WORLD).world_to_image)


@pytest.mark.parametrize("name", [*DISPLAYS, "camera"])
def test_a_mapping_is_printed_as_the_call_that_makes_it(name):
    """Its lines break between arguments, and no number loses a digit."""
    mapping = (CAMERA.view(40, 30) if name == "camera" else DISPLAYS[name].view(0, 1e-5 * WORLD)).world_to_image
    assert max(map(len, repr(mapping).splitlines())) < 120
    assert bits(eval(repr(mapping), {"WorldToImage": WorldToImage})) == bits(mapping)


@pytest.mark.parametrize("name", ["sample-a", "convex"])
def test_the_viewers_distance_is_the_physical_z_from_the_observers_in_world_units(name):
    """One map takes a world four times as large as the display, turned about x, to physical space."""
    display = find_display(name)
    view = display.view(0, np.array([[0.25, 0, 0, 0], [0, 0, 0.25, 0.1], [0, -0.25, 0, 0.2]]))
    a, b, c, d = view.viewer_distance()
    for x, y, z in ((0.0, 0.0, 0.0), (1.0, 2.0, -3.0)):
        physical = -0.25 * y + 0.2
        assert a * x + b * y + c * z + d == pytest.approx(4 * (physical - display.observer_z))


# Rows of texels that can see a box: no ray of another row hits anything in it


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
    view = scenes.VIEWS[name](*size)
    rng = np.random.default_rng(seed)
    points = scenes.anywhere(view, rng, 2, 0.6)
    points = points[0] + (points - points[0]) * rng.choice([1.0, 0.3, 0.02])
    bounds = scenes.to_world(view, points)
    bounds = np.stack([bounds.min(axis=0), bounds.max(axis=0)])
    corners = np.array(list(product(*bounds.T)))
    hit = cast(view, np.stack(raycast.affine(view.cast_from_world, *corners.T), axis=1), BOX_FACES)
    rows = seen_rows(view, bounds)
    seen = np.flatnonzero(hit.any(axis=1))
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
