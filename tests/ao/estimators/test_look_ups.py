"""Borders and backgrounds of look-ups, against loops that share nothing with the kernels but the mapping."""

import numpy as np
import pytest

import lfssao
from lfssao.errors import InputError

RADIUS = 0.9
POINTS = np.random.default_rng(3).uniform(-0.55, 0.55, (6, 3))
DISPLAY = lfssao.find_display("sample-a").with_resolution(18, 12)
MESH = lfssao.builtin_scene("corner")
PART = np.array([[-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]])  # of the scene, so that it leaves the texture on all sides
VIEWS = {
    "module": lambda: lfssao.module_views(MESH, DISPLAY, range(4, 5), bounds=PART)[0],
    "camera": lambda: lfssao.Camera.looking_at(PART).view(18, 12),
}
# Borders of GPU samplers, by the names that NumPy has for them.
MODES = {"clamp": "edge", "repeat": "wrap", "mirror": "symmetric"}


def buffers_of(kind, dtype=np.float64):
    """Textures of a part of a scene, a fifth of whose texels shows no surface."""
    view = VIEWS[kind]()
    gbuffer = lfssao.RayCaster(MESH, view.cast_from_world).gbuffer(view, None, "geometric")
    holes = np.random.default_rng(5).random(gbuffer.depth.shape) < 0.2
    depth, positions, normals = (np.array(each, dtype) for each in (gbuffer.depth, gbuffer.positions, gbuffer.normals))
    depth[holes], positions[holes], normals[holes] = np.inf, np.inf, 0.0
    return lfssao.Buffers(view, depth, positions, normals)


def read(padded, x, y, linear):
    """A texture at an image point."""
    if not linear:
        return padded[int(np.floor(y)), int(np.floor(x))]
    left = int(np.floor(x - 0.5))
    top = int(np.floor(y - 0.5))
    across = x - 0.5 - left
    down = y - 0.5 - top
    four = padded[top : top + 2, left : left + 2]
    return np.inf if np.isinf(four).any() else [1 - down, down] @ four @ [1 - across, across]


def shares(buffers, border, beyond, cleared, linear=False):
    """LF Algorithm 2 in float64: shares of hidden points, a rule beyond the border, and depth of background."""
    height, width = buffers.depth.shape
    far = 40 * max(height, width)
    depth = np.where(buffers.depth < np.inf, buffers.depth, cleared)
    padded = np.pad(depth, far, MODES[border]) if border in MODES else np.pad(depth, far, constant_values=beyond)
    if border == "open" and linear:  # beside a sample inside the texture its edge goes on
        padded = np.pad(depth, far, "edge")
    made = np.zeros(depth.shape)
    for row, column in np.argwhere(buffers.depth < np.inf):
        u, v, z = buffers.view.world_to_image(buffers.positions[row, column] + RADIUS * POINTS).T
        hidden = [
            read(padded, x + far, y + far, linear) < deep
            for x, y, deep in zip(u, v, z, strict=True)
            if np.isfinite(x) and (border != "open" or (0 <= x < width and 0 <= y < height))
        ]
        made[row, column] = np.count_nonzero(hidden) / len(POINTS)
    return made


@pytest.mark.parametrize("kind", VIEWS)
@pytest.mark.parametrize("border", ["open", "clamp", "repeat", "mirror", "background"])
@pytest.mark.parametrize("is_cleared", [False, True])
@pytest.mark.parametrize("linear", [False, True])
def test_points_see_what_options_say(kind, border, is_cleared, linear):
    buffers = buffers_of(kind)
    options = {"border": border, "filter": "linear" if linear else "nearest"}
    seen = np.inf
    if is_cleared:
        options |= {"background": "cleared", "cleared": {"module": -0.2, "camera": 2.5}[kind]}
        seen = float(buffers.view.depth_at(np.array(options["cleared"])))
    made = lfssao.estimate("point", buffers, RADIUS, POINTS, **options).texture
    expected = shares(buffers, border, seen if border == "background" else np.inf, seen, linear)
    assert np.array_equal(made, expected)
    plain = lfssao.estimate("point", buffers, RADIUS, POINTS).texture
    changes = is_cleared or linear or border in MODES
    assert np.array_equal(made, plain) is not changes


def test_a_place_at_the_eye_hides_all_that_is_looked_up_there():
    buffers = buffers_of("camera")
    options = {"background": "cleared", "border": "background"}  # at distance 0
    made = lfssao.estimate("point", buffers, RADIUS, POINTS, **options).texture
    occludes = lfssao.estimate("point", buffers, RADIUS, POINTS, background="occludes", border="background").texture
    assert np.array_equal(made, occludes)
    assert made.sum() > lfssao.estimate("point", buffers, RADIUS, POINTS).texture.sum()


def test_positions_are_cleared_to_places_on_the_rays():
    """Alchemy sees a wall where background was, its distance given; by loops over the taps' texels."""
    buffers = buffers_of("camera")
    wall = 1.05 * float(np.max(buffers.view.cast_z(buffers.depth[buffers.depth < np.inf])))
    made = lfssao.estimate("alchemy", buffers, RADIUS, background="cleared", cleared=wall).texture
    rows, columns = np.nonzero(~(buffers.depth < np.inf))
    depth = buffers.depth.copy()
    positions = buffers.positions.copy()
    depth[rows, columns] = buffers.view.depth_at(np.array(wall))
    back = np.array(buffers.view.screen_to_world)
    for row, column in zip(rows, columns, strict=True):
        place = back @ [column + 0.5, row + 0.5, depth[row, column], 1.0]
        positions[row, column] = place[:3] / place[3]
    filled = lfssao.Buffers(buffers.view, depth, positions, buffers.normals)
    there = buffers.depth < np.inf
    assert np.allclose(made[there], lfssao.estimate("alchemy", filled, RADIUS).texture[there], rtol=1e-9)
    assert not np.array_equal(made, lfssao.estimate("alchemy", buffers, RADIUS).texture)


@pytest.mark.parametrize("name", ["hbao", "sao"])
def test_steps_and_taps_that_are_held_inside_are_none_outside(name):
    buffers = buffers_of("module", np.float32)
    opened, held = (lfssao.estimate(name, buffers, RADIUS, border=border) for border in ("open", "clamp"))
    assert opened.outside > 0 == held.outside
    assert not np.array_equal(opened.texture, held.texture)


@pytest.mark.parametrize("name", ["hbao", "gtao", "visibility-bitmask", "oriented-hemisphere", "alchemy"])
@pytest.mark.parametrize("filter_", ["nearest", "linear"])
def test_background_beyond_the_border_that_is_open_hides_nothing(name, filter_):
    """Between four texels one beyond the border is the nearest inside, or background, and then nothing hides."""
    buffers = buffers_of("module", np.float32)  # in which other tests compile these kernels anyway
    opened, beyond = (
        lfssao.estimate(name, buffers, RADIUS, border=border, filter=filter_) for border in ("open", "background")
    )
    assert opened.outside > beyond.outside
    assert beyond.texture.sum() <= opened.texture.sum()
    assert filter_ == "linear" or np.array_equal(opened.texture, beyond.texture)


@pytest.mark.parametrize(("name", "options", "words"), [
    ("lf", {"border": "clamp"}, "has no parameter 'border'"),
    ("point", {"border": "edge"}, "border is 'edge', choose one of open, clamp, repeat, mirror, background"),
    ("sao", {"border": "background"}, "choose one of open, clamp, repeat, mirror"),
    ("alchemy", {"background": "occludes"}, "choose one of open, cleared"),
    ("alchemy", {"cleared": np.nan}, "cleared is nan, it must be finite"),
])  # fmt: skip
def test_a_border_that_is_none_is_refused(name, options, words):
    with pytest.raises(InputError, match=words):
        lfssao.estimate(name, buffers_of("module"), RADIUS, **options)
