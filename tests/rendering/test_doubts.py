"""One sentence on what is allowed and probably not meant: on the terminal once, in Python as a warning."""

import itertools
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

import lfssao
from lfssao import Camera, Settings, display_names, display_text, find_display, parse_display
from lfssao.cli.main import main
from lfssao.errors import InputError, InputWarning
from lfssao.rendering.doubts import of_display, subpixel_radii
from lfssao.rendering.views import module_views

SMALL = ["statue", "--display", "sample-a", "--resolution", "32x24", "--modules", "2:4", "--samples", "1"]
FINE = [*SMALL, "--radii", "20%"]


@pytest.fixture
def said(tmp_path, capsys):
    """The lines that a command writes on standard error, and whether it does so once."""

    def command(*words):
        assert main([*words, "-o", str(tmp_path / "out")]) == 0
        lines = capsys.readouterr().err.splitlines()
        assert len(set(lines)) == len(lines)
        return [line.removeprefix("lfssao: ") for line in lines]

    return command


def test_radii_below_half_a_texel_everywhere(statue):
    """Half a texel of an orthographic camera is the same everywhere, a module's is largest where the box is nearest."""
    camera = Camera.looking_at(statue.bounds, "orthographic")
    half = 0.5 * camera.extent / 36
    radii = (0.0, 0.5 * half, 0.999 * half, 1.001 * half, 1.0)
    boxes = [statue.bounds]
    assert subpixel_radii([camera.view(48, 36)], boxes, radii) == radii[1:3]
    assert subpixel_radii([camera.view(48, 36), camera.view(64, 48)], boxes, radii) == radii[1:2]
    for name in display_names():
        (view,) = module_views(statue, find_display(name).with_resolution(48, 36), range(1))
        corners = np.array([[x, y, z] for x, y, z in itertools.product(*statue.bounds.T)])
        aside = np.random.default_rng(1).normal(size=(400, 3))
        ball = view.world_to_image(corners[:, None] + 1e-4 * aside / np.linalg.norm(aside, axis=1)[:, None])
        moved = np.abs(ball - view.world_to_image(corners)[:, None])[..., :2].max()
        limit = 1e-4 * 0.5 / moved  # from below: 400 directions miss the farthest by little
        assert subpixel_radii([view], boxes, (0.9 * limit, 1.01 * limit)) == (0.9 * limit,)
        assert subpixel_radii([view], [*boxes, statue.bounds * 100], (0.9 * limit,)) == ()  # behind the lens too


def test_a_job_warns_of_such_radii_once(said):
    job = ["render", *SMALL, "--frames", "2", "--radii"]
    assert said(*job, "0.0001,20%") == ["radius 0.0001 is less than half a texel everywhere: its AO says nothing"]
    (sentence,) = said(*job, "0.0002,0.0001,20%")
    assert sentence == "radii 0.0002, 0.0001 are less than half a texel everywhere: their AO says nothing"
    assert said(*job, "0,20%") == said(*job, "0.0001", "--layers", "depth") == []  # no AO is asked for


def test_a_radius_beyond_half_of_the_diagonal(said, statue):
    size = np.linalg.norm(statue.bounds[1] - statue.bounds[0])
    wanted = f"more than half of the scene's diagonal, {size:g}: did you mean"
    job = ["render", *SMALL, "--radii"]
    assert said(*job, "5,20%") == [f"radius 5 is {wanted} 5 %?"]
    assert said(*job, "5,49%,7") == [f"radii 5, 7 are {wanted} 5 %, 7 %?"]
    assert said(*job, "49.9%") == []
    with pytest.warns(InputWarning, match="radius 5 is more than half") as caught:
        lfssao.render(statue, find_display("sample-a").with_resolution(32, 24), Settings((5.0,)))
    assert [warning.filename for warning in caught] == [__file__]


def test_a_display_in_millimetres(said, tmp_path, capsys):
    with_unit = {"width = 1.0": "width = 1000", "height = 0.6": "height = 600", "distance = 2.0": "distance = 2000",
                 "x = [-1.0, 1.0]": "x = [-1000, 1000]", "z = 0.7": "z = 700",
                 "-0.45, -0.27, -0.25": "-450, -270, -250", "0.45, 0.27, 0.25": "450, 270, 250"}  # fmt: skip
    text = display_text("sample-a")
    for metres, millimetres in with_unit.items():
        text = text.replace(metres, millimetres)
    (file := tmp_path / "mine.toml").write_text(text)
    sentence = "display sample-a: its screen is 1000 x 600 metres large: did you mean millimetres?"
    assert said("render", *FINE, "--display", str(file)) == [sentence]
    assert main(["display", str(file)]) == 0
    assert capsys.readouterr().err == f"lfssao: {sentence}\n"
    with pytest.warns(InputWarning, match="millimetres"):
        lfssao.render("statue", file, Settings((0.1,)))


LENGTHS = re.compile(
    r"(?m)^(?!name|diffuser|shape|layout|count|resolution|angles|field_of_view|yaw|pitch|roll|k1|k2)(\w+) = ([^#\n]+)"
)


@pytest.mark.parametrize("name", ["sample-a", "convex", "picoarray", "c80"])
def test_one_length_of_a_display_in_millimetres(name):
    """Each length of its file alone, and each coordinate alone; the display is asked about, or cannot exist."""
    text = display_text(name)
    asked = []
    text = re.sub(r"(?m)^height = 0\.0\b", "height = 0.1", text)
    text = re.sub(r"(?m)^y = 0\.0\b", "y = 0.1", text)
    assert not list(of_display(parse_display(text, name)))
    for line in LENGTHS.finditer(text):
        for number in re.finditer(r"-?\d+\.?\d*", line[2]):
            start = line.start(2) + number.start()
            end = line.start(2) + number.end()
            if float(number[0]) == 0:
                continue
            try:
                display = parse_display(f"{text[:start]}{float(number[0]) * 1000}{text[end:]}", name)
            except InputError:
                continue
            (sentence,) = of_display(display)
            assert sentence.endswith("metres: did you mean millimetres?") or "metres large" in sentence
            asked.append(line[1])
    assert len(set(asked)) > 3


def test_the_question_names_the_length(said, tmp_path):
    text = display_text("sample-a")
    (file := tmp_path / "mine.toml").write_text(text.replace("distance = 2.0", "distance = 2000.0"))
    sentence = "display sample-a: its observer.distance is 2000 metres: did you mean millimetres?"
    assert said("render", *FINE, "--display", str(file)) == [sentence]
    both = parse_display(text.replace("distance = 2.0", "distance = 2000.0").replace("z = 0.7", "z = 700"), "mine")
    sentence = "its observer.distance is 2000, its modules' z is 700 metres: did you mean millimetres?"
    assert list(of_display(both)) == [f"display sample-a: {sentence}"]


def test_views_that_see_nothing(said, statue):
    away = ["--camera", "--eye", "0,0,9", "--target", "30,0,0", "--fov", "20"]
    job = ["render", "statue", "--resolution", "32x24", "--samples", "1", "--radii", "20%"]
    assert said(*job, *away, "--frames", "2") == ["camera sees nothing of the scene"]
    narrow = find_display("sample-a").modules[:2]  # both look past a scene that is fitted into a box on the right
    narrow = [replace(module, width=8, height=6, field_of_view=5.0) for module in narrow]
    display = replace(find_display("sample-a"), modules=tuple(narrow), roi=((0.4, -0.1, -0.1), (0.5, 0.1, 0.1)))
    with pytest.warns(InputWarning, match="module_001 sees nothing of the scene"):
        lfssao.render(statue, display, Settings((1.0,)))[1]


def test_an_eye_that_no_light_reaches(said, tmp_path, capsys):
    main(["render", *FINE, "-o", str(tmp_path / "made")])
    assert capsys.readouterr().err == ""
    words = ["view", str(tmp_path / "made"), "--width", "9", "--eye-x"]
    assert main([*words, "50"]) == 0
    assert capsys.readouterr().err == "lfssao: display sample-a: no module's light goes to an eye at x = 50\n"


def test_textures_of_another_job_in_the_folder(said, tmp_path):
    out = tmp_path / "out"
    others = "module_020.exr", "camera.exr", "module_004.exr"
    for name in (*others, "module_003.exr", "mine.exr", "frame_0003/camera.exr"):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text("old")
    stale = "camera.exr, frame_0003/camera.exr, module_004.exr and 1 more are left there of another job"
    assert said("render", *FINE) == [f"{out}: {stale}"]
    assert (out / "module_004.exr").read_text() == "old"
    (out / "frame_0003" / "camera.exr").unlink()
    for name in others:
        (out / name).unlink()
    assert said("render", *FINE) == said("render", *FINE, "--resume") == []
    assert said("render", *FINE, "--png") == []
    assert said("render", *FINE) == [f"{out}: module_002.png, module_003.png are left there of another job"]
    for picture in out.glob("module_*.png"):
        picture.unlink()
    (sentence,) = said("render", *FINE, "--frames", "2")
    assert sentence == f"{out}: module_002.exr, module_003.exr are left there of another job"


def test_other_peoples_warnings_stay_what_they_are(monkeypatch):
    monkeypatch.setattr("lfssao.cli.display._display", lambda options: warnings.warn("numba's", stacklevel=1))
    with pytest.warns(UserWarning, match="numba's"):
        main(["display"])
