"""Samples and noise vectors of a file: as a shader's own, in tiles or whole, in every way that a render takes them."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest
from jobs import manifest_of

import lfssao
from lfssao.cli.main import main
from lfssao.samples import noise_turns, texel_angles
from lfssao.samples.formats import FORMATS

SMALL = ["render", "corner", "--camera", "--resolution", "24x18", "--radii", "0.4"]
RADIUS = 0.5
BIAS = 0.02
F64 = np.dtype(np.float64)


def rendered(folder, *options):
    assert main([*SMALL, "-o", str(folder), *options]) == 0
    return lfssao.read_exr(folder / manifest_of(folder)["views"][0]["file"])["ao_1"].pixels


# Noise


def unit_tile():
    """Cosine and sine of the rotation 'tiles', (4, 4, 2)."""
    angles = np.pi * texel_angles("tiles", 4, 4)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1).astype(np.float32)


@pytest.mark.parametrize("estimator", ["lf", "oriented-hemisphere"])
def test_vectors_of_unit_length_turn_samples_as_the_rotation_that_they_are_of(tmp_path, estimator):
    """In a tile, as a whole texture, and with rows from below, of which 18 are no multiple of 4."""
    words = "--estimator", estimator
    tile = unit_tile()
    whole = np.tile(unit_tile(), (5, 6, 1))[:18]
    np.save(tmp_path / "tile.npy", tile)
    np.save(tmp_path / "whole.npy", np.dstack([whole, np.zeros((18, 24), np.float32)]))
    np.save(tmp_path / "below.npy", whole[::-1][:4, :4])
    named = rendered(tmp_path / "named", *words, "--rotate", "tiles")
    for name, more in (("tile", ()), ("whole", ()), ("below", ("--rotate-rows", "below"))):
        made = rendered(tmp_path / name, *words, "--rotate", str(tmp_path / f"{name}.npy"), *more)
        assert np.array_equal(made, named)
        assert manifest_of(tmp_path / name)["settings"]["rotation"] == "vectors"
    wrong = rendered(tmp_path / "wrong", *words, "--rotate", str(tmp_path / "below.npy"))
    assert not np.array_equal(wrong, named)


def hidden_by_loops(buffers, points, noise):
    """Occlusion of the oriented hemisphere, no range check, in float64 by the shader's own lines: t of the noise."""
    view = buffers.view
    made = np.zeros(buffers.depth.shape)
    numbers, (right, up, away) = view.world_to_image.numbers, view.world_from_cast[:, :3].T
    depth = view.cast_from_world[2]
    for j, i in np.argwhere(buffers.depth < np.inf):
        c, n, (x, y, z) = buffers.positions[j, i], buffers.normals[j, i], noise[j % 4, i % 4]
        r = x * right + y * up - z * away
        t = r - n * (n @ r)
        t /= np.linalg.norm(t)
        for a, b, h in points:
            s = np.append(c + RADIUS * (a * t + b * np.cross(n, t) + abs(h) * n), 1)
            q = numbers[12:] @ s
            u = numbers[:4] @ s / q
            v = numbers[4:8] @ s / q
            if not (q > 0 and 0 <= u < view.width and 0 <= v < view.height):
                continue
            seen = buffers.positions[int(v), int(u)]
            if np.isfinite(seen).all() and depth @ s - depth @ np.append(seen, 1) >= BIAS * RADIUS:
                made[j, i] += 1 / len(points)
    return made


def test_vectors_of_three_numbers_make_the_frame_that_a_shader_makes_of_them():
    """Diagonal noise, a z of -1 and vectors of no length, (4, 4, 3)."""
    buffers = scenes.buffers("concave crease", scenes.SIGHTS["perspective"](24, 18))
    noise = np.random.default_rng(5).normal(size=(4, 4, 3))
    noise[0, 0], noise[1, 1] = (0.7, 0.7, 0.7), (0.3, -0.2, -1.0)
    points = lfssao.make_samples("latin", 12, 3, r_min=0.1)
    seen = replace(buffers, turns=noise_turns(noise, 18, 24, F64))
    options = {"bias": BIAS, "range_check": "none"}
    made = lfssao.estimate("oriented-hemisphere", seen, RADIUS, points, **options).texture
    right = hidden_by_loops(buffers, points, noise)
    assert (np.abs(made - right) < 1e-9).mean() > 0.999  # rounding may decide a sample
    flat = hidden_by_loops(buffers, points, noise * [1, 1, 0])
    assert (np.abs(flat - right) > 0.05).mean() > 0.1


def test_a_reference_with_vectors_of_a_file_is_judged_by_them(tmp_path, capsys):
    noise = np.random.default_rng(2).normal(size=(4, 4, 3)).astype(np.float32)
    np.save(tmp_path / "noise.npy", noise)
    np.save(tmp_path / "flat.npy", noise[..., :2])
    words = "--estimator", "oriented-hemisphere", "--rotate"
    for name in ("noise", "flat"):
        rendered(tmp_path / name, *words, str(tmp_path / f"{name}.npy"))
    assert main(["compare", str(tmp_path / "noise"), str(tmp_path / "noise")]) == 0
    assert main(["compare", str(tmp_path / "flat"), str(tmp_path / "noise")]) == 2
    assert "noise vectors' z is left out" in capsys.readouterr().out


# Samples


@pytest.mark.parametrize("ending", [ending for ending in FORMATS if ending != "glsl-function"])
def test_samples_of_a_file_are_those_of_the_method_that_wrote_it(tmp_path, ending):
    file = tmp_path / f"points.{ending}"
    words = ("--estimator", "point", "--rotate", "none")
    assert (
        main(
            [
                "samples",
                "make",
                "latin",
                "-n",
                "6",
                "--seed",
                "4",
                "--r-min",
                "0.8",
                "--format",
                ending,
                "-o",
                str(file),
            ]
        )
        == 0
    )
    named = rendered(tmp_path / "named", *words, "--samples", "6", "--seed", "4")
    made = rendered(tmp_path / "made", *words, "--samples", str(file))
    single = ending == "glsl"  # whose numbers are rounded to float32, and samples' products with R once more
    assert np.mean(made == named) > 0.99 if single else np.array_equal(made, named)
    again = rendered(tmp_path / "again", *words, "--samples", str(tmp_path / "made" / "manifest.json"))
    assert np.array_equal(again, made)
    assert manifest_of(tmp_path / "made")["sampling"] == {"method": "file", "count": 6, "seed": 0}


def test_weights_of_a_file_are_read(tmp_path):
    points = np.column_stack([lfssao.make_samples("latin", 4, 1), [1.0, 2.0, 3.0, 4.0]])
    rows = "".join(",".join(map(repr, row)) + "\n" for row in points.tolist())
    (tmp_path / "own.csv").write_text(f"x,y,z,weight\n{rows}")
    made = rendered(tmp_path / "made", "--estimator", "vo-points", "--samples", str(tmp_path / "own.csv"))
    assert manifest_of(tmp_path / "made")["settings"]["weights"] == [1.0, 2.0, 3.0, 4.0]
    assert not np.array_equal(made, rendered(tmp_path / "same", "--estimator", "vo-points"))


@pytest.mark.parametrize(("name", "text", "options", "said"), [
    ("a.csv", "x,y\n0,0\n", (), "a.csv: it has points of 2 numbers, estimator lf takes points of the ball"),
    ("a.json", '{"points": [[0, 0]], "domain": "square"}', ("--estimator", "alchemy"),
     "a.json: it has points of the square, estimator alchemy takes points of the disk"),
    ("a.csv", "x,y,z,weight\n0,0,1,1\n", (), "a.csv: it has weights, which estimator lf does not read"),
    ("a.csv", "0,0,1\n", ("--sampling", "latin"), "a.csv has the samples, and a --sampling or a --seed would"),
    ("a.csv", "0,0,1\n", ("--rotate", "none", "--seed", "1"), "a.csv has the samples, and a --sampling or a --seed"),
    ("a.csv", "0,0,1\n", ("--estimator", "hbao"), "estimator hbao takes no samples"),
    ("a.csv", "0,0,nan\n", (), "a number is not finite"),
    ("a.glsl", "vec3 k[2] = vec3[2](vec3(1, 0, 0), normalize(vec3(1, 1, 0)));", (), "it has 0 arrays of vectors"),
    ("a.glsl", "vec2 a[1] = vec2[](vec2(1, 0)); vec2 b[1] = vec2[](vec2(1, 0));", (), "it has 2 arrays of vectors"),
    ("a.pdf", "", (), "format of points"),
    ("none.csv", None, (), "none.csv: there is no such file"),
])  # fmt: skip
def test_samples_that_do_not_fit_are_refused(tmp_path, capsys, name, text, options, said):
    if text is not None:
        (tmp_path / name).write_text(text)
    assert main([*SMALL, "-o", str(tmp_path / "out"), "--samples", str(tmp_path / name), *options]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_shaders_arrays_are_read_in_the_ways_that_shaders_write_them(tmp_path):
    (tmp_path / "a.hlsl").write_text("""
        static const float radius = 0.5f; // none of the points
        /* the kernel */ static const float3 kernel[3] = { float3(0.1f, -.2, 3e-1), {1, 2.0, 3.}, float3(0, 0, 1) };
        static const float weights[3] = { 1.0f, 0.5f, 2 };
    """)
    points, weights, domain = lfssao.samples.formats.read_points(tmp_path / "a.hlsl")
    assert points.tolist() == [[0.1, -0.2, 0.3], [1, 2, 3], [0, 0, 1]]
    assert (weights.tolist(), domain) == ([1, 0.5, 2], None)
