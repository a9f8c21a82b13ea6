"""The page of ``lfssao view --html`` in a real Chromium, against the pictures of ``lfssao view``; what it refuses."""

import re
import tomllib
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jobs import render, sentence
from PIL import Image
from quilt_files import QUILT
from reference import viewer as reference
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

import lfssao
from lfssao import InputError, LightField, eye_point, eye_range, find_display
from lfssao.cli.main import main
from lfssao.files.srgb import to_codes
from lfssao.rendering.page import page as made
from lfssao.rendering.page.page import eye_page

WORDS = ["--resolution", "96x58", "--radii", "5%", "--samples", "4"]
SIZE = 32, 20
EYES = "left", "right"
# The picture for an eye, drawn here and now, as base64 of its bytes from the bottom row on.
PIXELS = """
Object.assign(state, arguments[0]);
draw();
const pixels = new Uint8Array(4 * width * height);
gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
return [width, height, btoa(Array.from(pixels, (code) => String.fromCharCode(code)).join(""))];
"""


def odd(display):
    """The display with calibrated, distorted optics in one module and another turned away."""
    modules = list(display.modules)
    numbers = (30.0, 1.0, 15.0, -1.0, -31.0, 9.5, 0.05, -0.02, 1.0)
    modules[9] = replace(modules[9], homography=numbers, k1=-0.05, k2=0.01)
    modules[12] = replace(modules[12], field_of_view=50.0, yaw=25.0, roll=3.0)
    return replace(display, modules=tuple(modules))


DISPLAYS = {name: find_display(name).with_resolution(*SIZE) for name in ("sample-a", "sample-b", "picoarray", "c80")}
DISPLAYS["sample-a-conical"] = find_display("sample-a-conical").with_resolution(*SIZE)
DISPLAYS["odd"] = odd(DISPLAYS["sample-a"])
# Lenses above the observers' height and nearer to the screen than they are: the cone bends much.
DISPLAYS["conical"] = replace(
    DISPLAYS["sample-b"], modules=tuple(replace(m, y=0.2, z=0.3) for m in DISPLAYS["sample-b"].modules)
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return render(tmp_path_factory.mktemp("page") / "out", "gallery", "--display", "sample-a", *WORDS)


@pytest.fixture(scope="module")
def path(folder):
    assert main(["view", str(folder), "--html", str(folder / "page.html"), "--width", "300"]) == 0
    return folder / "page.html"


def opened(browser, path):
    """The page when its picture is there; its console has nothing to say but that reading pixels takes time."""
    browser.get("about:blank")
    browser.get(path.as_uri())
    WebDriverWait(browser, 60).until(lambda _: browser.find_elements("css selector", "canvas[data-ready]"))
    assert [entry for entry in browser.get_log("browser") if "ReadPixels" not in entry["message"]] == []
    return browser


def pixels(browser, **state):
    """The page's picture, (H, W, 3) codes."""
    width, height, data = browser.execute_script(PIXELS, state)
    return np.frombuffer(b64decode(data), np.uint8).reshape(height, width, 4)[::-1, :, :3].astype(int)


def view(folder, *words):
    """The picture of ``lfssao view``."""
    target = folder / "expected.png"
    assert main(["view", str(folder), *map(str, words), "-o", str(target)]) == 0
    with Image.open(target) as image:
        return np.asarray(image).astype(int)


def text(browser, selector):
    return browser.find_element("css selector", selector).get_attribute("textContent")


@pytest.mark.parametrize(
    ("ao", "layer", "distance"), [(True, "shaded", 2.0), (False, "color", 2.0), (True, "shaded", 1.4)]
)
def test_the_page_is_within_one_code_of_view_at_five_eyes(browser, folder, path, ao, layer, distance):
    opened(browser, path)
    left, right = eye_range("sample-a")
    for eye_x in (left, -0.37, 0.0, 0.511, right):
        expected = view(folder, "--eye-x", eye_x, "--width", 300, "--layer", layer, "--distance", distance)
        found = pixels(browser, x=eye_x, ao=ao, distance=distance)
        assert found.shape == expected.shape == (180, 300, 3)
        assert np.abs(found - expected).max() <= 1
        assert (found == expected).mean() > 0.9
        assert len(np.unique(found)) > 100


def random_page(monkeypatch, path, display, missing=()):
    """A page of random textures, saved; the textures."""
    rng = np.random.default_rng(5)
    chosen = [k for k in range(len(display.modules)) if k not in missing]
    textures = {k: 0.02 + 0.98 * rng.random((SIZE[1], SIZE[0], 3), np.float32) ** 3 for k in chosen}
    entries = {k: {"file": f"{k}.exr", "textures": {"shaded": k}} for k in chosen}
    monkeypatch.setattr(made, "read_views", lambda *_: (display, entries))
    monkeypatch.setattr(made, "read_layer", lambda _path, _layer, k: textures[k])
    eye_page("folder", width=123).save(path)
    return textures


@pytest.mark.parametrize("name", DISPLAYS)
def test_all_flat_displays_and_missing_modules(browser, monkeypatch, tmp_path, name):
    """Random textures have a step at each texel; every pixel that a module reaches is lit, all others are black."""
    display = DISPLAYS[name]
    reached = []
    textures = random_page(monkeypatch, tmp_path / "eye.html", display, (7, 8, len(display.modules) - 1))
    opened(browser, tmp_path / "eye.html")
    end, near, far = eye_range(display)[1], *browser.execute_script("return data.distances")
    own = -display.observer_z
    assert (near < own, far) == (True, 2 * own)
    for share, distance in ((-1.3, own), (-0.9, own), (0.0, own), (0.37, own), (1.1, own), (0.37, near), (-0.6, far)):
        moved = replace(display, observer_z=-distance, roi=((-0.01, -0.01, -0.01), (0.01, 0.01, 0.01)))
        field = LightField(moved, list(textures))
        for k, texture in textures.items():
            field.put(k, texture)
        shot = field.photograph(share * end, 123)
        expected = to_codes(shot.image).astype(int)
        found = pixels(browser, x=share * end, distance=distance)
        assert np.abs(found - expected).max() <= 1
        assert np.array_equal(found.any(axis=2), expected.any(axis=2))
        assert found.any(axis=2).sum() == expected[..., 0].size - shot.dark
        reached.append(shot.dark < expected[..., 0].size)
    assert sum(reached) >= 5


@pytest.mark.parametrize("name", ["sample-a", "conical"])
def test_orange_is_a_modules_share_of_the_light(browser, monkeypatch, tmp_path, name):
    display = DISPLAYS[name]
    textures = random_page(monkeypatch, tmp_path / "eye.html", display, (7,))
    opened(browser, tmp_path / "eye.html")
    options = [each.get_attribute("value") for each in browser.find_elements("css selector", "#module option")]
    assert options == ["-1", *map(str, textures)]
    numbers = [display.module_numbers(k) for k in range(len(display.modules))]
    plain = pixels(browser, x=0.03)
    height, width, _ = plain.shape
    eye = eye_point(display, 0.03)
    screen = (display.screen_width, display.screen_height)
    seen = reference.seen_by(numbers, [textures.get(k) for k in range(len(numbers))], eye, screen, width, height)
    weights = [reference.weigh(*each, reference.LINEAR) for each in seen]
    module = max(weights[width * (height // 2) + width // 2])
    share = np.array([each.get(module, 0.0) for each in weights]).reshape(height, width, 1)
    assert 0.01 < share.mean() < 0.3
    browser.find_element("css selector", f"#module option[value='{module}']").click()
    assert np.abs(pixels(browser) - (plain + 0.75 * share * (np.array([255, 127.5, 0]) - plain))).max() <= 1


def test_keys_slider_mouse_and_switch(browser, folder, path):
    opened(browser, path)
    place = lambda: browser.execute_script("return state.x")  # noqa: E731
    left, right = eye_range("sample-a")
    body = browser.find_element("tag name", "body")
    body.send_keys(Keys.RIGHT * 3 + Keys.LEFT)
    assert place() == pytest.approx(2 * (right - left) / 60)
    assert text(browser, "#x + output") == f"{place():.2f}"
    body.send_keys(Keys.RIGHT * 99)
    assert place() == pytest.approx(right)
    body.send_keys(Keys.UP * 2 + Keys.DOWN)
    assert browser.execute_script("return state.distance") == pytest.approx(2 - 3 / 60)
    assert text(browser, "#distance + output") == "1.95"
    before = pixels(browser)
    browser.find_element("css selector", "#distance").send_keys(Keys.END)
    assert browser.execute_script("return state.distance") == 4
    assert not np.array_equal(pixels(browser), before)
    canvas, slider = (browser.find_element("css selector", name) for name in ("canvas", "#x"))
    slider.send_keys(Keys.HOME)
    assert place() == pytest.approx(left, abs=1e-6)
    ActionChains(browser, duration=0).drag_and_drop_by_offset(canvas, 75, 0).perform()
    assert place() == pytest.approx(left + (right - left) * 75 / canvas.size["width"], abs=0.02)
    with_ao = pixels(browser)
    body.send_keys("a")
    assert not browser.find_element("id", "ao").is_selected()
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    without = pixels(browser)
    assert (without >= with_ao).all()
    assert without.sum() > 1.1 * with_ao.sum()
    browser.find_element("id", "ao").click()
    assert np.array_equal(pixels(browser), with_ao)


def test_a_scene_without_colours_has_no_switch(browser, tmp_path):
    render(tmp_path, "armadillo", "--display", "sample-a", "--modules", "8:13", *WORDS)
    assert main(["view", str(tmp_path), "--html", str(tmp_path / "eye.html"), "--modules", "9:12"]) == 0
    opened(browser, tmp_path / "eye.html")
    assert not browser.find_element("id", "switch").is_displayed()
    assert (browser.execute_script("return [width, modules.filter((m) => m.textures).length]")) == [900, 3]
    expected = view(tmp_path, "--modules", "9:12", "--width", "900")
    assert np.abs(pixels(browser, x=0.0) - expected).max() <= 1


def test_it_is_read_on_a_telephone_and_by_a_screen_reader(browser, path):
    metrics = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        opened(browser, path)
        assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
        texts = browser.find_elements("css selector", "p, label, output")
        assert min(float(each.value_of_css_property("font-size").removesuffix("px")) for each in texts) >= 14
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    inputs = browser.find_elements("css selector", "input, select")
    assert len(inputs) >= 2
    assert all(each.accessible_name for each in inputs)
    assert browser.find_element("tag name", "canvas").accessible_name == "What the eye sees"
    assert "two modules" in text(browser, "main")


def test_a_notebook_shows_the_page_in_a_frame(browser, folder, path):
    opened(browser, path)
    expected = pixels(browser, x=0.2)
    page = lfssao.eye_page(folder, width=300, eye_x=0.2)
    browser.get("about:blank")
    browser.execute_script("document.body.innerHTML = arguments[0]", page._repr_html_())
    frame = browser.find_element("tag name", "iframe")
    browser.switch_to.frame(frame)
    WebDriverWait(browser, 60).until(lambda _: browser.find_elements("css selector", "canvas[data-ready]"))
    assert text(browser, "#x + output") == "0.20"
    assert np.array_equal(pixels(browser), expected)
    assert browser.execute_script("return document.documentElement.scrollHeight <= innerHeight")


def test_a_browser_without_webgl_is_told(browser, path, tmp_path):
    script = "Object.defineProperty(HTMLCanvasElement.prototype, 'getContext', { value: () => null });"
    added = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
    try:
        browser.get(path.as_uri())
        assert text(browser, "#status") == "this browser has no WebGL 2, which the picture needs."
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def test_the_file_asks_no_network_and_names_are_text(browser, monkeypatch, tmp_path):
    hostile = "</script><b onclick=\"alert(1)\">&lt; 'a/b'$x"
    random_page(monkeypatch, tmp_path / "eye.html", replace(DISPLAYS["sample-a"], name=hostile))
    page = re.sub(r"[\w+/=]{60,}", "", (tmp_path / "eye.html").read_text())  # base64 may hold any word
    assert not re.search(r"https?:|[\"'(]//|url\(|@import|fetch\(|<link|<iframe|src=\"(?!data:)", page)
    assert "default-src 'none'; img-src data:; style-src 'sha256-" in page
    opened(browser, tmp_path / "eye.html")
    assert browser.find_elements("tag name", "b") == []
    assert text(browser, "h1").startswith(hostile)


def test_the_wheel_holds_what_the_page_is_made_of():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    held = [glob for glob in project["tool"]["setuptools"]["package-data"]["lfssao"] if "rendering/page" in glob]
    found = {path.name for glob in held for path in Path(lfssao.__file__).parent.glob(glob)}
    assert found == {path.name for path in (Path(lfssao.__file__).parent / "rendering/page").iterdir()
                     if path.is_file() and path.suffix != ".py"}  # fmt: skip
    assert {Path(name).suffix for name in found} == {".html", ".css", ".js", ".frag"}


@pytest.mark.parametrize(("words", "reason"), [
    (("--orbit", "4"), "--html does not go with --orbit, --output, --distance, --layer or --blend"),
    (("-o", "a.png"), "--html does not go with"),
    (("--distance", "1"), "--html does not go with"),
    (("--layer", "color"), "--html does not go with"),
    (("--blend", "nearest"), "--html does not go with"),
    (("--html", "eye.htm"), "--html: eye.htm does not end in .html"),
    (("--html", "/nowhere/eye.html"), "--html: there is no folder /nowhere"),
    (("--eye-x", "nan"), "--eye-x"),
    (("--modules", "21"), "modules 21:22 are not a part of 0:21"),
    (("--width", "16384"), "MB of pictures, a page holds 512: take fewer modules or a smaller width"),
])  # fmt: skip
def test_what_the_page_cannot_show_is_refused_in_one_sentence(folder, capsys, tmp_path, monkeypatch, words, reason):
    monkeypatch.chdir(tmp_path)
    assert main(["view", str(folder), "--html", "eye.html", *words]) == 2
    assert reason in sentence(capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("display", "reason"), [
    (find_display("convex"), "display convex: a page shows flat screens alone"),
    (replace(DISPLAYS["conical"], modules=(replace(DISPLAYS["conical"].modules[0], y=0.1),
                                           *DISPLAYS["conical"].modules[1:])), "only if their modules are in a line"),
    (find_display("virtual"), "it has one module, an eye needs two"),
])  # fmt: skip
def test_displays_that_the_page_does_not_know_are_refused(monkeypatch, display, reason):
    entries = {k: {"file": "a.exr", "textures": {"shaded": k}} for k in range(len(display.modules))}
    monkeypatch.setattr(made, "read_views", lambda *_: (display, entries))
    with pytest.raises(InputError, match=reason):
        eye_page("folder")


@pytest.mark.parametrize("texture", [np.zeros((2, 2, 3)), np.full((20, 32, 3), np.nan), np.zeros((20, 32, 1))])
def test_a_file_with_another_texture_is_refused(monkeypatch, texture):
    entries = {k: {"file": "a.exr", "textures": {"shaded": k}} for k in (9, 10, 11)}
    monkeypatch.setattr(made, "read_views", lambda *_: (DISPLAYS["sample-a"], entries))
    monkeypatch.setattr(made, "read_layer", lambda *_: texture.astype(np.float32))
    with pytest.raises(InputError, match=r"folder/a.exr: its part shaded is no finite texture of 32x20 texels"):
        eye_page("folder", width=20)


def codes_of(linear):
    """Codes of sRGB, not rounded."""
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def shares(eye, eyes, x, away):
    """The share of the left one of two views' eyes at columns x of the screen: by the sines of angles to the eye."""
    ways = [np.sin(abs(np.arctan((eye - x) / away) - np.arctan((each - x) / away))) for each in eyes]
    return (ways[1] / (ways[0] + ways[1]))[:, None]


def test_a_stereo_pair_shows_each_eye_its_view_and_both_between_them(browser, tmp_path, capsys):
    """The screen is the window of 50 degrees at the target, 9 before the eyes, which are 0.4 apart."""
    words = ["--camera", "perspective", "--eye", "0,2,9", "--target", "0,2,0", "--fov", "50", "--stereo", "0.4"]
    folder = render(tmp_path / "out", "corner", *words, "--resolution", "40x30", "--guard", "3", "--radii", "5%")
    assert main(["view", str(folder), "--html", str(tmp_path / "eye.html"), "--width", "40"]) == 0
    opened(browser, tmp_path / "eye.html")
    assert "scene units from the screen" in text(browser, "form")
    views = [lfssao.read_exr(folder / f"{name}.exr")["shaded"].pixels.astype(float) for name in EYES]
    height = 2 * 9 * np.tan(np.radians(25))
    x = height / 30 * (np.arange(40) - 19.5)
    for eye in (-0.2, -0.05, 0.2):
        share = shares(eye, (-0.2, 0.2), x, 9.0)
        found = pixels(browser, x=eye, distance=9.0)
        assert np.abs(found - codes_of(share * views[0] + (1 - share) * views[1])).max() <= 1.5
        assert len(np.unique(found)) > 20
    assert np.abs(codes_of(views[0]) - codes_of(views[1])).max() > 20
    capsys.readouterr()
    assert main(["view", str(folder)]) == 2
    assert sentence(capsys).endswith("it describes a stereo pair, which an eye sees by --html alone")


def test_a_quilt_shows_each_eye_its_view_and_two_between_them(browser, tmp_path, capsys):
    (tmp_path / "small.toml").write_text(QUILT)
    folder = render(tmp_path / "out", "statue", "--display", str(tmp_path / "small.toml"), "--radii", "5%")
    assert main(["view", str(folder), "--html", str(tmp_path / "eye.html"), "--width", "24"]) == 0
    opened(browser, tmp_path / "eye.html")
    away = 0.08 / np.tan(np.radians(7))
    eyes = away * np.tan(np.radians([-17.5, -10.5, -3.5, 3.5, 10.5, 17.5]))
    views = [lfssao.read_exr(folder / f"view_{k:03d}.exr")["shaded"].pixels.astype(float) for k in range(6)]
    x = 0.12 * ((np.arange(24) + 0.5) / 24 - 0.5)
    for eye, left, right in [(eyes[0], 0, 0), (eyes[2], 2, 2), (eyes[5], 5, 5), (-0.05, 1, 2), (0.13, 4, 5)]:
        share = 0.5 if left == right else shares(eye, eyes[[left, right]], x, away)
        found = pixels(browser, x=eye, distance=away)
        assert np.abs(found - codes_of(share * views[left] + (1 - share) * views[right])).max() <= 1.5
        assert len(np.unique(found)) > 50
    assert text(browser, "form").count("light of view") == 1
    (tmp_path / "small.toml").write_text(QUILT.replace("columns = 3\nrows = 2", "columns = 1\nrows = 1"))
    one = render(tmp_path / "one", "statue", "--display", str(tmp_path / "small.toml"), "--radii", "5%")
    capsys.readouterr()
    assert main(["view", str(one), "--html", str(tmp_path / "no.html")]) == 2
    assert sentence(capsys) == "display small: it has one view, a page moves between two"
