"""The page of a lenslet display in a real Chromium, against the pictures of ``lfssao view``; what it refuses."""

from base64 import b64decode

import numpy as np
import pytest
from jobs import render, sentence
from lenslet_files import LENSES
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

from lfssao import InputError, parse_display
from lfssao.cli.main import main
from lfssao.rendering.page import page as made
from lfssao.rendering.page.page import eye_page

DISPLAY = parse_display(LENSES, "small.toml").with_resolution(120, 90)
BOX = DISPLAY.eye_box
# The picture for an eye, drawn here and now, as base64 of its bytes.
PIXELS = """
Object.assign(state, arguments[0]);
draw();
const { data: pixels } = context.getImageData(0, 0, width, height);
return [width, height, btoa(Array.from(pixels, (code) => String.fromCharCode(code)).join(""))];
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("lenses")
    (path / "small.toml").write_text(LENSES)
    job = "statue", "--display", str(path / "small.toml"), "--radii", "10%", "--resolution", "120x90"
    return render(path / "out", *job)


@pytest.fixture(scope="module")
def page(browser, folder):
    path = folder / "page.html"
    assert main(["view", str(folder), "--html", str(path), "--width", "100"]) == 0
    browser.get(path.as_uri())
    WebDriverWait(browser, 60).until(lambda _: browser.find_elements("css selector", "canvas[data-ready]"))
    assert browser.get_log("browser") == []
    return browser


def pixels(browser, **state):
    """The page's picture, (H, W, 3) codes."""
    width, height, data = browser.execute_script(PIXELS, state)
    return np.frombuffer(b64decode(data), np.uint8).reshape(height, width, 4)[..., :3]


def state(browser):
    return browser.execute_script("return state;")


@pytest.mark.parametrize(("ao", "layer", "distance"), [(True, "shaded", 0.3), (False, "color", 0.2)])
def test_the_page_has_the_bits_of_view_at_five_eyes(page, folder, ao, layer, distance):
    target = folder / "expected.png"
    for x, y in ((0.0, 0.0), (BOX, -BOX), (-0.37 * BOX, 0.2 * BOX), (1.4 * BOX, 0.0), (0.0, -1.5 * BOX)):
        words = "--eye-x", x, "--eye-y", y, "--distance", distance, "--layer", layer, "--width", 100, "-o", target
        assert main(["view", str(folder), *map(str, words)]) == 0
        with Image.open(target) as image:
            expected = np.asarray(image)
        found = pixels(page, x=x, y=y, ao=ao, distance=distance, other=False)
        assert found.shape == (75, 100, 3)
        np.testing.assert_array_equal(found, expected)
        assert len(np.unique(found)) > 20


def test_orange_is_the_image_of_another_lens(page):
    """In the box nothing is; beyond it along x, columns are, from top to bottom."""
    inside = pixels(page, x=0.9 * BOX, y=0.0, distance=0.3, other=True)
    assert not (inside == [255, 128, 0]).all(axis=2).any()
    beyond = (pixels(page, x=1.4 * BOX, y=0.0, distance=0.3, other=True) == [255, 128, 0]).all(axis=2)
    assert 0.1 < beyond.mean() < 1
    assert (beyond == beyond.any(axis=0)).all()


def test_keys_and_the_mouse_move_the_eye(page):
    page.execute_script("look({ x: 0, y: 0, distance: 0.3, ao: true, other: false });")
    canvas = page.find_element("css selector", "canvas")
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, Keys.ARROW_UP, "-", "a")
    moved = state(page)
    assert moved["x"] == pytest.approx(3 * BOX / 60)
    assert moved["y"] == pytest.approx(6 * BOX / 60)
    assert moved["distance"] == pytest.approx(0.3 + 0.45 / 60)
    assert moved["ao"] is False
    ActionChains(page).drag_and_drop_by_offset(canvas, -20, 10).perform()
    dragged = state(page)
    assert dragged["x"] < moved["x"]
    assert dragged["y"] < moved["y"]
    page.execute_script("look({ x: 9 });")
    assert state(page)["x"] == pytest.approx(1.5 * BOX)
    assert float(page.find_element("id", "x").get_property("value")) == pytest.approx(1.5 * BOX)


def test_the_eye_where_it_begins_and_in_notebooks(folder):
    shown = eye_page(folder, eye_x=3 * BOX, eye_y=-0.01, width=80)
    assert f'"eye": [{3 * BOX}, -0.01], "eyes": [{-3 * BOX}, {3 * BOX}]' in shown.text
    assert f"eyes within {1000 * BOX:.3g} mm of" in shown.text
    assert "<iframe" in shown._repr_html_()


def test_refusals(folder, tmp_path, capsys, monkeypatch):
    modules = render(
        tmp_path / "modules", "corner", "--display", "sample-a", "--resolution", "40x24", "--modules", "9:11"
    )
    capsys.readouterr()
    target = str(tmp_path / "a.html")
    assert main(["view", str(modules), "--html", target, "--eye-y", "0.1"]) == 2
    assert sentence(capsys) == "eye y is for lenslet displays: the observers of sample-a stand on a line"
    with pytest.raises(InputError, match="eye y is inf, it must be a finite number"):
        eye_page(folder, eye_y=np.inf)
    monkeypatch.setattr(made, "MOST_BYTES", 2**16)
    assert main(["view", str(folder), "--html", target]) == 2
    assert sentence(capsys).endswith("0 MB of pictures, a page holds 0: take fewer modules or a smaller width")
