"""Wrong readings of the kit's specification, planted in a copy of the independent reader: each fails a case."""

import importlib
import shutil
import sys
from pathlib import Path

import pytest
from reference import kit as reference

FORMED_APART = "images(kind, m, point, rows) for"
FORMED_TOGETHER = """(to_image(kind, m, [affine_row(m, 0, *np.add(point, o)), *(
            a + b for a, b in zip(affine_rows(kind, m, point)[1:], row[1:], strict=True))])
            for o, row in zip(offsets, rows, strict=True)) for"""

# Cases, a file of the reader, its words and a wrong reading in their place, ...
READINGS = {
    "offset turned before L": (
        ["offsets_turned_crossed_slits", "offsets_turned_convex", "far_algorithm2_turned", "far_point_turned"],
        "mapping", "[turned_row(m, row, *offset, *turn) for row",
        "[linear_row(m, row, offset[0] * turn[0] - offset[1] * turn[1], offset[0] * turn[1] + offset[1] * turn[0],"
        " offset[2]) for row",
    ),
    "vo-points: offset turned before L": (
        ["far_vo-points_turned"], "volumetric", "scene.linear(point, turn)", "scene.linear(turned_offset(point, turn))",
    ),
    "row 0 of the sum of point and offset": (
        ["far_algorithm1", "far_algorithm2"], "passes", FORMED_APART, FORMED_TOGETHER,
        "import affine_row, images", "import affine_row, affine_rows, to_image",
    ),
    "background beside a range check": (
        ["background_point", "background_hemisphere"], "points", '== "occludes" and reach is None', '== "occludes"',
    ),
    "oriented: background beside a range check": (
        ["background_oriented-hemisphere_distance", "background_oriented-hemisphere_smoothstep"],
        "volumetric", '== "occludes" and options["range_check"] == "none"', '== "occludes"',
    ),
    "cut before the sum": (
        ["landing_floor"], "scalable", '"floor": lambda d: d,', '"floor": np.floor,',
    ),
    "cut towards zero": (
        ["landing_floor"], "scalable", '"floor": lambda d: d,', '"floor": np.trunc,',
    ),
    "halves to even": (
        ["landing_nearest"], "scalable", "np.floor(d + d.dtype.type(0.5))", "np.rint(d)",
    ),
    "halves of bytes to even": (
        ["packed_half"], "scalable", "int(a[place] * 255 + keys.dtype.type(0.5))", "int(np.rint(a[place] * 255))",
    ),
    "the bias in binary32": (
        ["bias_at_surface"], "volumetric",
        'options["bias"] * far], dtype)',
        'float(dtype(options["bias"]) * dtype(far))], dtype)',
    ),
    "rho <= 1": (
        ["radius_apart"], "volumetric", "if rho < 1 and", "if rho <= 1 and",
    ),
    "0 <= t_s": (
        ["border_on_screen"], "mapping", "not (t_s > 0 and", "not (t_s >= 0 and",
    ),
    "no max of the distance": (
        ["eye_plane_alchemy"], "points",
        "max(affine_row(distance, 0, *here), dtype(0))", "affine_row(distance, 0, *here)",
    ),
    "no least square": (
        ["squares_alchemy"], "points", " and square > 0", "",
    ),
    "no largest square": (
        ["squares_alchemy"], "points", " and square < np.inf", "",
    ),
    "inside at the fold": (
        ["border_folded"], "mapping", "if not r < fold:", "if not r <= fold:",
    ),
    "no fold where both are one": (
        ["numbers_fold_two_in_one"], "mapping", "elif b * b - 4 * a >= 0:", "elif b * b - 4 * a > 0:",
    ),
    "occlusion of no number is 1": (
        ["longest_both", "longest_average"], "multiresolution",
        "value if value > zero else zero", "zero if value <= zero else value",
    ),
    "the larger of a number and none": (
        ["longest_maximum"], "multiresolution", "max(most, high / weights)", "np.maximum(most, high / weights)",
    ),
    "ties of weights away from zero": (
        ["blur_tie"], "passes", "round(one * weight)", "int(one * weight + 0.5)",
    ),
    "sao: weights of whole quanta": (
        ["passes_sao_holes"], "scalable", "rounded(blur_weights(options[\"gauss\"], 3), dtype)", "blur_table(1.0)",
        "import blur_weights", "import blur_table, blur_weights",
    ),
}  # fmt: skip


@pytest.mark.parametrize("reading", READINGS)
def test_a_wrong_reading_fails_a_case(kit, tmp_path, monkeypatch, reading):
    cases, module, *words = READINGS[reading]
    folder = tmp_path / "reference"
    shutil.copytree(Path(reference.__file__).parent, folder, ignore=shutil.ignore_patterns("__pycache__"))
    path = folder / f"{module}.py"
    text = path.read_text()
    for right, wrong in zip(words[::2], words[1::2], strict=True):
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    path.write_text(text)
    for name in [name for name in sys.modules if name.partition(".")[0] == "reference"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path)
    wrong_reader = importlib.import_module("reference.kit")
    assert Path(wrong_reader.__file__).parent == folder
    for case in cases:
        stage, parameters, inputs, outputs = wrong_reader.read_case(kit / "cases" / case)
        assert wrong_reader.differing(wrong_reader.solve(stage, parameters, inputs), outputs)
