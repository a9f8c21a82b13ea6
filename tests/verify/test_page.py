"""The page of ``lfssao compare --html`` as a real Chromium shows it, and how large it is."""

import re
import tomllib
from base64 import b64decode
from dataclasses import replace
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from time import sleep

import numpy as np
import pytest
from compare_folders import LAYERS, MODULES, changed, compare, poke, remade, single, with_a_wrong_code
from jobs import edit, manifest_of, render
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains, ScrollOrigin
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

import lfssao
from lfssao.errors import InputError
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.page import textures
from lfssao.verify.compare.result import Result
from lfssao.verify.verdict import Judgement, Verdict

SIZE, PLANTED = (48, 32), (24, 16)  # columns and rows of a texture, and a wrong texel of module_004's ao_2
HOSTILE = "</script><b onclick=\"alert(1)\">&lt; 'a/b'{{ 7 * 7 }}#%\udcff"
# The contrast ratio (WCAG 2) of each element with text of its own: its colour on the ground of its nearest ancestor.
CONTRASTS = """
const linear = (v) => v / 255 <= 0.04045 ? v / 3294.6 : ((v / 255 + 0.055) / 1.055) ** 2.4;
const light = (c) => c.match(/[\\d.]+/g).slice(0, 3).map(linear)
  .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0.05);
const ground = (e, c = getComputedStyle(e).backgroundColor) => c.endsWith(", 0)") ? ground(e.parentElement) : c;
const own = (e) => e.checkVisibility() && [...e.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
return [...document.body.querySelectorAll("*")].filter(own).map((e) => {
  const [a, b] = [light(getComputedStyle(e).color), light(ground(e))];
  return [e.outerHTML.slice(0, 60), Math.max(a, b) / Math.min(a, b), ground(e)];
});
"""


@pytest.fixture(scope="module")
def mine(tmp_path_factory, reference):
    return changed(reference, tmp_path_factory.mktemp("page") / "mine", "module_004", poke("ao_2", PLANTED[::-1], 0.7))


@pytest.fixture(scope="module")
def page(mine, reference):
    assert compare(mine, reference, "--html", mine / "page.html") == 2
    return mine / "page.html"


@pytest.fixture(scope="module")
def report(mine, reference):
    return lfssao.compare(mine, reference, page=True)


def opened(browser, path, theme="light"):
    """The canvases of a page, when it shows its first texture; its console has nothing to say."""
    media = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    browser.get("about:blank")
    browser.get(path.as_uri())
    canvases = browser.find_elements("tag name", "canvas")
    WebDriverWait(browser, 30).until(lambda _: canvases[0].is_displayed())
    assert browser.get_log("browser") == []
    return canvases


def texts(browser, selector):
    found = browser.find_elements("css selector", selector)
    return [" ".join(item.get_attribute("textContent").split()) for item in found]


def readout(browser):
    return dict(zip(texts(browser, "#readout dt"), texts(browser, "#readout dd"), strict=True))


def hover(browser, canvas, column, row, size=SIZE):
    """The readout of a texel of a texture that is seen whole, with the pointer on it."""
    x, y = ((at + 0.5) / n - 0.5 for at, n in zip((column, row), size, strict=True))
    where = round(x * canvas.size["width"]), round(y * canvas.size["height"])
    ActionChains(browser, duration=0).move_to_element_with_offset(canvas, *where).perform()
    return readout(browser)


def digits(values):
    return " ".join(f"{v:.9g}" for v in values)


def test_the_pointer_reads_the_planted_texel(browser, page, report, reference):
    (worst,) = (r.worst[0] for r in report.results if (r.module, r.layer) == ("module_004", "ao_2"))
    right = single(reference, "module_004", "ao_2")[PLANTED[::-1]]
    for canvas in opened(browser, page):
        found = hover(browser, canvas, *PLANTED)
        assert (found["texel"], found["verdict"]) == ("24, 16", "outside the interval")
        assert (found["mine"], found["reference"]) == (digits([np.float32(0.7)]), digits(right))
        assert float(found["off by"]) == pytest.approx(0.7 - float(right[0]))
        assert found["interval"] == f"{digits(worst.lower)} to {digits(worst.upper)}"
        assert found["why"] == worst.reason != ""
        there = hover(browser, canvas, 25, 16)
        assert (there["texel"], there["verdict"], there["why"]) == ("25, 16", "equal bits", "")


def test_a_wrong_texel_that_is_none_of_the_worst_has_a_reason(browser, tmp_path, reference):
    mine = reference
    for layer, value in {"merged": 0.7, "blurred": 0.9}.items():
        mine = changed(mine, tmp_path / layer, "module_004", poke(layer, np.s_[:4, :4], value))
    report = lfssao.compare(mine, reference, diagnosis=False, page=True)
    report.write_html(tmp_path / "page.html")
    corner = {(i, j) for i in range(4) for j in range(4)}  # sixteen wrong texels, of which at most ten are listed
    for layer, words in {"merged": "each texel has its own reason", "blurred": "expected: the blur of"}.items():
        (result,) = (r for r in report.results if (r.module, r.layer) == ("module_004", layer))
        place = min(corner - {(t.column, t.row) for t in result.worst})
        browser.get("about:blank")
        browser.get(f"{(tmp_path / 'page.html').as_uri()}#module_004/{layer}")
        WebDriverWait(browser, 30).until(lambda _: browser.find_element("tag name", "canvas").is_displayed())
        found = hover(browser, browser.find_element("tag name", "canvas"), *place)
        assert (found["verdict"], found["why"][: len(words)]) == ("outside the interval", words)


def test_a_stored_texture_has_the_reference_as_it_is_read(browser, tmp_path, reference):
    mine, (column, row), right, code = with_a_wrong_code(reference, tmp_path / "mine")
    assert compare(mine, reference, "--no-diagnosis", "--html", tmp_path / "page.html") == 2
    canvas, *_ = opened(browser, tmp_path / "page.html")
    found = hover(browser, canvas, column, row)
    assert found["reference"] == f"{digits([np.float32(code / 255)])} ({digits([right])} before it is stored)"
    assert float(found["off by"]) == pytest.approx(10 / 255, rel=1e-6)
    lower, upper = map(float, found["interval"].split(" to "))
    assert lower <= float(found["reference"].split()[0]) <= upper
    assert hover(browser, canvas, 0, 0)["reference"] == "0, as stored"


def test_doubles_channels_and_infinities_are_read_exactly(browser, tmp_path):
    right = np.random.default_rng(3).normal(size=(5, 8, 3))
    right[0, 0], own = (-0.0, np.inf, np.nan), right.copy()
    own[2, 3, 1], own[0, 0] = np.nextafter(own[2, 3, 1], 9), (0.0, -np.inf, 1.5)
    for name, array in (("a", own), ("b", right)):
        np.save(tmp_path / f"{name}.npy", array)
    assert compare(tmp_path / "a.npy", tmp_path / "b.npy", "--html", tmp_path / "page.html") == 2
    canvas, *_ = opened(browser, tmp_path / "page.html")
    found = hover(browser, canvas, 3, 2, (8, 5))
    assert (found["mine"], found["verdict"], found["interval"]) == (digits(own[2, 3]), "different", "none is known")
    assert [float(v) for v in found["off by"].split()] == pytest.approx(own[2, 3] - right[2, 3], rel=1e-6, abs=0)
    assert hover(browser, canvas, 4, 2, (8, 5))["verdict"] == "equal bits"
    assert hover(browser, canvas, 0, 0, (8, 5))["mine"] == "0 -inf 1.5"


def test_every_texture_has_a_cell_and_the_worst_texels_are_links(browser, page, report):
    opened(browser, page)
    assert texts(browser, ".verdicts th") == ["module", *LAYERS, *MODULES]
    cells = dict(zip([(m, n) for m in MODULES for n in LAYERS], texts(browser, ".verdicts td"), strict=True))
    assert cells["module_003", "ao_1"] == "= equal bits"
    assert cells["module_004", "ao_2"] == "✕ outside 1"
    (diagnosis,) = (r.diagnosis for r in report.results if r.layer == "ao_2" and r.diagnosis)
    assert f"{diagnosis.words('module_004')}." in texts(browser, "article:not([hidden]) p")
    browser.find_element("link text", str(PLANTED)).click()
    assert readout(browser)["texel"] == "24, 16"
    assert browser.execute_script("return view.zoom") >= 12


def test_keys_and_wheel_and_drag_move_all_three_pictures(browser, page):
    canvases = opened(browser, page)
    browser.find_element("css selector", 'a[href="#module_003/depth"]').send_keys(Keys.ENTER)
    WebDriverWait(browser, 30).until(lambda _: texts(browser, "article:not([hidden]) h2") == ["module_003, depth"])
    pictures, keys = browser.switch_to.active_element, ActionChains(browser)  # what was opened has the keys
    assert "holds a preview" in hover(browser, canvases[1], 10, 10)["why"]
    keys.key_down(Keys.SHIFT).send_keys(Keys.RIGHT, Keys.DOWN, Keys.DOWN).key_up(Keys.SHIFT).perform()
    assert readout(browser)["texel"] == "11, 12"
    hover(browser, canvases[1], *PLANTED)
    places = []
    for step in (
        lambda: None,
        lambda: pictures.send_keys("+++"),
        lambda: pictures.send_keys(Keys.LEFT * 3),
        lambda: ActionChains(browser).scroll_from_origin(ScrollOrigin.from_element(canvases[0]), 0, -300).perform(),
        lambda: ActionChains(browser).drag_and_drop_by_offset(canvases[2], 60, 30).perform(),
        lambda: pictures.send_keys("0"),
    ):
        step()
        places.append(browser.execute_script("return [view.zoom, view.left, view.top]"))
        shown = [canvas.screenshot_as_png for canvas in canvases[:2]]
        assert shown[0] == shown[1]  # equal bits, under one zoom and pan
    whole, near, left, nearer, dragged, again = np.array(places)
    assert (near[0] / whole[0], again.tolist()) == (pytest.approx(1.5**3), whole.tolist())
    assert left == pytest.approx(near - [0, 120 / near[0], 0])
    assert nearer[0] > left[0]
    assert dragged == pytest.approx(nearer - np.array([0, 60, 30]) / nearer[0])


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_has_contrast(browser, page, theme):
    opened(browser, page, theme)
    found = browser.execute_script(CONTRASTS)
    assert [item for item in found if item[1] < 4.5] == []
    assert len(found) > 60
    assert ("rgb(255, 255, 255)" in {item[2] for item in found}) == (theme == "light")


def test_names_are_text_and_never_markup(browser, tmp_path, report):
    results = Result(HOSTILE, HOSTILE, Verdict.MISSING, HOSTILE), report.first_failure
    replace(report, mine=HOSTILE, notes=(HOSTILE,), results=results).write_html(tmp_path / "page.html")
    browser.get((tmp_path / "page.html").as_uri())
    shown = HOSTILE.replace("\udcff", "\\udcff")
    assert (texts(browser, "b"), texts(browser, "li")) == ([], [shown])
    assert texts(browser, ".verdicts th")[-2:] == [shown, "module_004"]
    browser.find_elements("css selector", ".verdicts a")[0].click()
    opened = [f"{shown}, {shown}"]
    WebDriverWait(browser, 10).until(lambda page: texts(page, "article:not([hidden]) h2") == opened)
    assert browser.get_log("browser") == []


def test_the_file_asks_no_network(page):
    text = re.sub(r"[\w+/=]{60,}", "", page.read_text())  # base64 may hold any word
    assert not re.search(r"https?:|[\"'(]//|url\(|@import|fetch\(|<link|<iframe|src=\"(?!data:)", text)
    assert "default-src 'none'; img-src data:; style-src 'sha256-" in text.replace("&#39;", "'")


def test_without_page_no_textures_are_kept(tmp_path, reference):
    with pytest.raises(InputError, match="page=True"):
        lfssao.compare(reference, reference).write_html(tmp_path / "page.html")


def test_wrong_textures_are_kept_texel_by_texel(report):
    wrong = [made for made in report.textures.kept.values() if "values" in made]
    assert wrong
    for made in wrong:
        with Image.open(BytesIO(b64decode(made["difference"]))) as picture:
            assert picture.size == (made["width"], made["height"])


def test_the_wheel_holds_the_template_the_style_and_the_script():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    (held,) = (glob for glob in project["tool"]["setuptools"]["package-data"]["lfssao"] if "compare/page" in glob)
    assert {path.suffix for path in Path(lfssao.__file__).parent.glob(held)} >= {".j2", ".css", ".js"}


@pytest.mark.slow
@pytest.mark.parametrize("limits", [{}, {"FULL": 1e6}, {"ALL": 1e6}], ids=str)
def test_a_display_of_wrong_modules_is_less_than_20_mb(tmp_path, monkeypatch, report, limits):
    """Occlusion as of eight samples, in a tenth of which it is wrong."""
    for name, most in limits.items():
        monkeypatch.setattr(textures, name, most)
    random = np.random.default_rng(7)
    page = textures.Textures(exact=False)
    blocks = random.integers(0, 9, (2, 150, 250)) / 8
    blocks[1] = np.where(random.random(blocks[1].shape) < 0.1, blocks[1], blocks[0])
    right, own = np.kron(blocks, np.ones((4, 4))).astype(np.float32)
    judged = Judgement(Verdict.OUTSIDE, "", own != right, own != right, Bounds(right, right))
    count = 8 if limits else 21
    results = [replace(report.first_failure, module=f"module_{k:03d}", layer="ao_1") for k in range(count)]
    for result in results:
        page.add(result, *(Layer("ao_1", ("AO",), (texture,), None) for texture in (own, right)), judged)
    replace(report, results=tuple(results), textures=page).write_html(tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < 20e6
    full = ["values" in made for made in page.kept.values()]
    assert full == sorted(full, reverse=True)  # the first wrong ones
    assert full[0]
    files = [each for made in page.kept.values() if "values" in made for each in made.values() if isinstance(each, str)]
    assert sum(map(len, files)) < limits.get("FULL", textures.FULL)
    assert (len(full) == count, all(full)) == ("ALL" not in limits, not limits)
    text = (tmp_path / "page.html").read_text()
    said = {words: n for n, words in re.findall(r"(\d+) (?:wrong )?textures? ha\w+ (a preview only|no picture)", text)}
    counts = {"a preview only": len(full) - sum(full), "no picture": count - len(full)}
    assert said == {words: str(count) for words, count in counts.items() if count}


def test_it_says_how_both_were_made_and_which_files_were_read(browser, page, mine, reference):
    opened(browser, page)
    facts = dict(zip(texts(browser, ".facts dt"), texts(browser, ".facts dd"), strict=True))
    settings, command = (manifest_of(reference)[key] for key in ("settings", "machine"))
    assert facts["compared"].endswith(f"UTC, by lfssao {lfssao.__version__}")
    assert facts["command"].split() == command["command"]
    assert [float(r) for r in facts["radii"].removesuffix(" world units").split(", ")] == pytest.approx(
        settings["radii"], rel=1e-5
    )
    for folder in (mine, reference):
        for path in folder.glob("module_*.exr"):
            assert facts[str(path)] == f"SHA-256 {sha256(path.read_bytes()).hexdigest()}"


@pytest.mark.parametrize(("words", "name", "fact"), [
    (("--camera", "--resolution", "16x12"), "camera", "perspective"),
    (("--camera", "--stereo", "0.1", "--resolution", "16x12"), "camera", "perspective"),
    (("--display", "looking-glass-go", "--modules", "3", "--resolution", "8x6"), "display", "looking-glass-go"),
    (("--display", "near-eye", "--modules", "112", "--resolution", "216x216"), "display", "near-eye"),
], ids=["camera", "stereo", "quilt", "lenslet"])  # fmt: skip
def test_it_says_what_views_are_of(tmp_path, words, name, fact):
    folder = render(tmp_path / "out", "statue", *words, "--radii", "5%", "--samples", "2")
    facts = dict(lfssao.compare(folder, folder, page=True).facts)
    assert facts[name] == fact
    assert ("camera" in facts) != ("display" in facts)
    edit(folder, "sampling", value=5)
    with pytest.raises(InputError, match="its manifest is not what 'lfssao render' writes"):
        lfssao.compare(folder, folder, page=True)


def test_failures_alone_are_shown_on_demand(browser, page):
    opened(browser, page)
    rows = browser.find_elements("css selector", ".verdicts tbody tr")
    assert [row.is_displayed() for row in rows] == [True] * len(rows)
    browser.find_element("id", "failures").click()
    assert [row.text.split()[0] for row in rows if row.is_displayed()] == ["module_004"]
    cells = [link.text for link in browser.find_elements("css selector", ".verdicts td a") if link.is_displayed()]
    assert cells
    assert all("outside" in text for text in cells)


def test_mine_and_the_reference_blink(browser, page):
    opened(browser, page)
    caption = browser.find_elements("css selector", "#pictures figcaption")[1]
    assert caption.text == "reference"
    press = browser.find_element("css selector", "[data-key=B]").click
    press()
    WebDriverWait(browser, 10, 0.1).until(lambda _: caption.text == "mine")
    WebDriverWait(browser, 10, 0.1).until(lambda _: caption.text == "reference")
    WebDriverWait(browser, 10, 0.1).until(lambda _: caption.text == "mine")
    press()
    assert caption.text == "reference"
    sleep(0.7)  # more than a blink
    assert caption.text == "reference"


def test_a_histogram_counts_texels_inside_and_outside(browser, page):
    opened(browser, page)
    titles = [bar.get_attribute("title") for bar in browser.find_elements("css selector", "#histogram div > span")]
    counts = np.array([[int(n) for n in re.findall(r"(\d+) (?:inside|outside)", title)] for title in titles])
    assert counts.sum(axis=0).tolist() == [0, 1]
    inside, outside = textures._counts(np.array([[0, 1, 120, 121, 240, 241]], np.uint8))
    assert (inside, outside) == ([1, *[0] * 22, 1], [1, *[0] * 22, 1])


def test_it_fits_a_telephone(browser, page):
    opened(browser, page)
    size = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_worst_texels_have_a_picture_of_their_samples(browser, page, report, reference):
    opened(browser, page)
    (picture,) = browser.find_elements("css selector", "[data-texel='24,16'] svg.samples")
    assert picture.is_displayed()
    made = report.textures.samples["module_004", "ao_2", *PLANTED]
    dots = re.findall(r'<g class="(\w+)"><title>sample (\d+) is (\w+): it reads texel \((\d+), (\d+)\)', made)
    half = len(dots) // 2
    assert dots[:half] == dots[half:]  # each sample has a dot in both panels
    assert all(kind == told for kind, _, told, *_ in dots)
    (right,) = single(reference, "module_004", "ao_2")[PLANTED[::-1]]
    assert sum(kind == "occluded" for kind, *_ in dots[:half]) == pytest.approx(6 * float(right), abs=1e-5)
    assert 0 < right < 1
    width = float(re.search(r'class="own"[^/]* width="([\d.]+)"', made)[1])  # pixels of a texel
    own = [float(v) for v in re.search(r'class="own" x="([\d.]+)" y="([\d.]+)"', made).groups()]
    for x, y, (_, _, _, column, row) in zip(*circles(made, half), dots[:half], strict=True):
        assert [(x - own[0]) // width, (y - own[1]) // width] == [int(column) - PLANTED[0], int(row) - PLANTED[1]]
    assert "samples" not in texts(browser, "#readout dd")[-1]


def circles(made, count):
    """Columns and rows, pixels, of the first dots of a picture."""
    found = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', made)[:count]
    return np.array(found, float).T


def test_many_modules_are_signs_in_rows_of_their_layers(browser, tmp_path, report):
    fails = report.first_failure
    equal = replace(fails, verdict=Verdict.EQUAL_BITS, outside=0)
    results = [replace(fails if k == 41 else equal, module=f"module_{k:03d}") for k in range(80)]
    replace(report, results=tuple(results)).write_html(tmp_path / "page.html")
    for width in (1280, 390):
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False},
        )
        browser.get((tmp_path / "page.html").as_uri())
        links = browser.find_elements("css selector", ".verdicts a")
        assert [link.text for link in links] == ["="] * 41 + ["✕ 41"] + ["="] * 38
        assert links[41].get_attribute("title") == "module_041, ao_2: outside"
        table = browser.find_element("css selector", ".verdicts")
        assert browser.execute_script("return arguments[0].scrollWidth <= arguments[0].clientWidth", table)
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_an_option_that_makes_it_right_is_there_to_copy(browser, tmp_path, reference):
    mine = changed(reference, tmp_path / "mine", "module_004", remade("merged", lambda pixels: 1 - pixels))
    assert compare(mine, reference, "--html", tmp_path / "page.html") == 2
    opened(browser, tmp_path / "page.html")
    (flag,), (words,) = texts(browser, ".flag code"), texts(browser, ".flag")
    assert words == f"compare again with {flag}"
    option, rule = flag.split()
    assert option == "--map"
    judged = lfssao.compare(mine, reference, rules=dict([rule.split("=")[::-1]]), layers=["merged"], diagnosis=False)
    verdicts = {result.module: result.verdict for result in judged.results}
    assert verdicts["module_004"] in (Verdict.EQUAL_BITS, Verdict.EQUAL_VALUES, Verdict.INSIDE)
    assert verdicts["module_003"] is Verdict.OUTSIDE  # whose merged AO is no visibility
