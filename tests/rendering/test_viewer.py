"""The virtual viewer: against the reference, against direct ray casts, and ``lfssao view``."""

import math
from dataclasses import replace

import bench_edges
import numpy as np
import pytest
from reference import viewer as reference

from lfssao import InputError, LightField, Mesh, Paint, RayCaster, eye_point, eye_range, eye_view, find_display
from lfssao.errors import InputWarning
from lfssao.optics.kernels.display import display_module
from lfssao.rendering.kernels.light_field import ray_sine
from lfssao.rendering.viewer import BLENDS

IDENTITY = np.eye(3, 4)

PRESETS = ("sample-a", "sample-b", "convex", "picoarray")
SIZE = 32, 20


def odd(display):
    """The display with calibrated, distorted optics in one module and another turned away."""
    modules = list(display.modules)
    m = modules[9]
    modules[9] = replace(m, homography=(30.0, 1.0, 15.0, -1.0, -31.0, 9.5, 0.05, -0.02, 1.0), k1=-0.05, k2=0.01)
    modules[12] = replace(modules[12], field_of_view=50.0, yaw=25.0, roll=3.0)
    return replace(display, modules=tuple(modules))


DISPLAYS = {name: find_display(name).with_resolution(*SIZE) for name in PRESETS}
DISPLAYS["odd"] = odd(DISPLAYS["sample-a"])

# Lenses above the observers' height and nearer to the screen than they are: the cone differs from the straight line.
CONICAL = DISPLAYS["sample-b"]
DISPLAYS["conical"] = replace(CONICAL, modules=tuple(replace(m, y=0.2, z=0.3) for m in CONICAL.modules))
DISPLAYS["concave"] = replace(DISPLAYS["sample-a"], screen_curvature=-0.4, observer_curvature=0.3)


def random_field(display, rng, missing=(), channels=3):
    """Random textures on a display, and their list with None for those missing."""
    count = len(display.modules)
    field = LightField(display, [k for k in range(count) if k not in missing], channels)
    textures = [None] * count
    for k in range(count):
        if k not in missing:
            m = display.modules[k]
            textures[k] = rng.random((m.height, m.width, channels), np.float32)
            assert k in field.missing
            field.put(k, textures[k][..., :1], textures[k][..., 1:])
    assert field.missing == []
    return field, textures


@pytest.mark.parametrize("name", DISPLAYS)
def test_the_reference_composes_the_same_bits(name):
    display = DISPLAYS[name]
    rng = np.random.default_rng(5)
    missing = (7, 8, len(display.modules) - 1)
    field, textures = random_field(display, rng, missing, channels=2)
    numbers = [display.module_numbers(k) for k in range(len(display.modules))]
    screen = display.screen_width, display.screen_height
    dark = dict.fromkeys(BLENDS, 0)
    for share in (-0.9, 0.0, 0.37, 1.1):
        eye_x = share * eye_range(display)[1]
        shots = {blend: field.photograph(eye_x, 41, blend) for blend in BLENDS}
        height = shots[BLENDS[0]].image.shape[0]
        pixels = reference.seen_by(numbers, textures, eye_point(display, eye_x), screen, 41, height)
        for number, blend in enumerate(BLENDS):
            shot = shots[blend]
            expected, missed = reference.compose(pixels, textures, number, 41, height)
            assert shot.image.tobytes() == expected.tobytes(), blend
            assert shot.dark == missed
            assert 0 <= shot.image.min() <= shot.image.max() <= 1
            dark[blend] += missed
    for missed in dark.values():
        assert 0 < missed < 4 * 41 * height  # the modules that shine reach some of it and not all


@pytest.mark.parametrize("name", DISPLAYS)
def test_photographs_that_are_announced_have_the_same_bits_and_keep_what_they_see(name, monkeypatch):
    display = DISPLAYS[name]
    rng = np.random.default_rng(3)
    room = []
    monkeypatch.setattr("lfssao.rendering.viewer.check_available", lambda _, needed: room.append(needed))
    count = len(display.modules)
    end = eye_range(display)[1]
    whole, textures = random_field(display, rng, channels=2)
    for blend in BLENDS:
        shots = [(share * end, 41, blend) for share in (-0.9, 0.37)]
        few = LightField(display, range(count), 2, shots)
        assert room[-1] < 8 * count * SIZE[0] * SIZE[1] == room[0]
        for k in reversed(range(count)):
            with pytest.raises(InputError, match=rf"cannot be taken: modules .*\b{k}\b.* have no textures"):
                few.photograph(*shots[0])
            few.put(k, textures[k])
        for shot in shots:
            assert few.photograph(*shot).image.tobytes() == whole.photograph(*shot).image.tobytes()
        with pytest.raises(InputError, match="cannot be taken: announced are"):
            few.photograph(0.0, 41, blend)
    assert 3 * room[1] < room[0] or count < 16  # of many modules an eye sees a few columns each


def test_nothing_is_seen_where_no_module_reaches():
    display = DISPLAYS["sample-a"]
    field, _ = random_field(display, np.random.default_rng(2))
    for blend in BLENDS:
        with pytest.warns(InputWarning, match="no module's light goes to an eye at x = 8"):
            seen = field.photograph(8.0, 40, blend)
        assert not seen.image.any()
        assert seen.dark == 40 * 24
        left, right = eye_range(display)
        for eye_x in (left, 0.0, right):
            assert field.photograph(eye_x, 40, blend).dark == 0
        assert field.photograph(right + 0.3, 40, blend).dark > 0


def test_a_module_whose_ray_is_90_degrees_from_the_eye_is_not_seen():
    """From the origin the ray goes to (2, 0, -1); an eye at (-1/2, 0, -1) is exactly square to it."""
    module = display_module(find_display("sample-a").module_numbers(0))._replace(m_x=-2.0, m_y=0.0, m_z=1.0)
    square, within = (ray_sine(module, (0.0, 0.0, 0.0), (e_x, 0.0, -1.0)) for e_x in (-0.5, -0.4375))
    assert math.isnan(square)
    assert 0.99 < abs(within) < 1


# Against direct ray casts
def line(count):
    """sample-a with so many modules on its line and a low screen, 100 x 2 texels: what is measured is horizontal."""
    display = replace(find_display("sample-a"), screen_height=0.02).with_resolution(100, 2)
    modules = tuple(replace(display.modules[0], x=-1 + 2 * k / (count - 1)) for k in range(count))
    return replace(display, modules=modules)


def sheet(z, wave=0.0):
    """A sheet across the whole screen at depth z with a smooth colour, world = physical space."""
    n = 8001  # its facets are smaller than the displacements measured
    x, y = np.meshgrid(np.linspace(-2, 2, n), [-2.0, 0.0, 2.0])
    vertices = np.stack([x, y, z + wave * np.cos(5 * x)], axis=-1).reshape(-1, 3)
    i = (np.arange(2)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)]).astype(np.int32)
    wave_of = [0.5 + 0.4 * np.sin(k * vertices[:, 0] + 0.7) for k in (4, 6, 9)]
    return Mesh(vertices, faces, Paint.from_vertex_colors(np.stack(wave_of, 1).astype(np.float32), len(faces)))


def layers(mesh, display, texture):
    """The textures of a display's modules, of a mesh in physical space: one of the G-buffer's textures."""
    caster = RayCaster(mesh, IDENTITY)
    field = LightField(display, range(len(display.modules)))
    for k in range(len(display.modules)):
        field.put(k, getattr(caster.gbuffer(display.view(k, IDENTITY)), texture))
    return field


def direct(mesh, display, eye_x, texture, width=100):
    view = eye_view(display, IDENTITY, eye_x, width)
    return getattr(RayCaster(mesh, view.cast_from_world).gbuffer(view), texture)


def rms(difference):
    return float(np.sqrt(np.mean(np.square(difference.astype(np.float64)))))


def slope(counts, errors):
    return np.polyfit(np.log(1 / (np.array(counts) - 1)), np.log(errors), 1)[0]


COUNTS = (17, 33, 65)


@pytest.mark.parametrize(("z", "wave"), [(0.25, 0.0), (-0.25, 0.0), (0.2, 0.03)])
def test_the_picture_approaches_the_direct_ray_cast(z, wave):
    """First order in the modules' pitch for the nearest module, second order for two neighbours, and as foretold."""
    mesh = sheet(z, wave)
    eye_x = 0.123
    errors = {blend: [] for blend in BLENDS}
    for count in COUNTS:
        display = line(count)
        field = layers(mesh, display, "color")
        true = direct(mesh, display, eye_x, "color")
        for blend in BLENDS:
            shot = field.photograph(eye_x, 100, blend)
            assert shot.dark == 0
            errors[blend].append(rms(shot.image - true))
    assert slope(COUNTS, errors["nearest"]) == pytest.approx(1, abs=0.05)
    assert slope(COUNTS, errors["linear"]) == pytest.approx(2, abs=0.05)
    assert slope(COUNTS, errors["gaussian"]) == pytest.approx(2, abs=0.3)
    # Errors of colours 0.4 sin(k x): f' shift / sqrt(12) and f'' shift^2 / (2 sqrt(30)), RMS over one pitch.
    shift = abs(z) / 0.7 * 2 / (COUNTS[-1] - 1)
    first, second = (0.4 * math.sqrt(sum(k ** (2 * n) for k in (4, 6, 9)) / 6) for n in (1, 2))
    assert errors["nearest"][-1] == pytest.approx(first * shift / math.sqrt(12), rel=0.1)
    assert errors["linear"][-1] == pytest.approx(second * shift**2 / (2 * math.sqrt(30)), rel=0.2)


@pytest.mark.parametrize("name", PRESETS)
def test_all_presets_show_what_the_eye_would_see(name):
    display = find_display(name).with_resolution(120, 80)
    box = np.array(display.roi)
    mesh = sheet(0.5 * box[1, 2], 0.0)
    eye_x = 0.25 * eye_range(display)[1]
    shot = layers(mesh, display, "color").photograph(eye_x, 120)
    true = direct(mesh, display, eye_x, "color", 120)
    assert np.isfinite(shot.image).all()
    lit = shot.image.any(axis=2)
    # Modules on an arc inside a convex screen's circle: no eye is reached from all of it.
    assert lit.mean() > (0.45 if name == "convex" else 0.95)
    assert rms((shot.image - true)[lit]) < 0.01


def test_the_eye_view_looks_along_the_pixels_lines():
    display = find_display("convex")
    eye = eye_point(display, 0.4)
    view = eye_view(display, IDENTITY, 0.4, 70)
    near, far = view.lens[4:6]
    assert near == pytest.approx(-eye[2] / 100)
    assert far == pytest.approx(max(m.z for m in display.modules) - eye[2])
    for i, j in ((0, 0), (33, 7), (69, 39)):
        x = display.screen_width * ((i + 0.5) / 70 - 0.5)
        y = display.screen_height * (0.5 - (j + 0.5) / view.height)
        for z in (near, 0.3 * far, far):
            point = np.array(eye) - z / eye[2] * (np.array([x, y, 0.0]) - eye)
            depth = (1 / near - 1 / z) / (1 / near - 1 / far)
            assert view.world_to_image(point) == pytest.approx([i + 0.5, j + 0.5, depth], abs=1e-9)


def test_eyes_are_on_the_line_or_the_arc():
    assert eye_point(find_display("sample-a"), 0.4) == (0.4, 0.0, -2.0)
    x, _, z = eye_point(find_display("picoarray"), 0.6)
    assert math.hypot(x, z) == pytest.approx(1.0)
    for eye_x in (1.0, 2.0, -1.5, math.nan, math.inf):
        with pytest.raises(InputError):
            eye_point(find_display("picoarray"), eye_x)


def test_what_a_light_field_refuses():
    display = DISPLAYS["sample-a"]
    with pytest.raises(InputError, match="one module"):
        LightField(find_display("virtual"), [0])
    field = LightField(display, [3, 4])
    good = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    for index, texture in ((5, good), (3, good[1:]), (3, good[..., :2]), (3, good + np.float32(np.inf))):
        with pytest.raises(InputError):
            field.put(index, texture)
    field.put(3, good)
    for values in ((0.0, 0, "linear"), (0.0, 10, "cubic"), (math.nan, 10, "linear")):
        with pytest.raises(InputError):
            field.photograph(*values)


# Straight edges (benchmarks/bench_edges.py)
@pytest.mark.parametrize("index", [10, 20])
def test_straight_edges_bend_with_the_square_of_their_length(index):
    display = find_display("sample-a")
    lengths = (0.001, 0.004, 0.016)
    errors = [
        bench_edges.chord_errors(display, index, *bench_edges.edges(display, length, 60), points=65).max()
        for length in lengths
    ]
    assert bench_edges.slope(lengths, errors) == pytest.approx(2, abs=0.02)
    flat = bench_edges.chord_errors(display, index, *bench_edges.edges(display, 0.1, 0), points=65)
    assert flat.max() < 1e-9
