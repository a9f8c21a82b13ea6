"""Time of a frame of an eye's page in a browser: ``python benchmarks/bench_page.py eye.html``.

The page is one of ``lfssao view --html``. Chromium draws it without a graphics card, for eyes from its leftmost to its
rightmost, and a pixel is read back after each frame, which waits for it. Other programs on the machine lengthen the
wall time; the processor time of Chromium's drawing process, on all of its threads, hardly.
"""

import argparse
import shutil
import time
from pathlib import Path

import numpy as np
from selenium import webdriver
from selenium.webdriver.support.wait import WebDriverWait

FLAGS = ("headless", "no-sandbox", "disable-gpu", "enable-unsafe-swiftshader", "window-size=1400,1000")
FRAMES = """
const [count, pixel, times] = [arguments[0], new Uint8Array(4), []];
for (let k = 0; k < count; k++) {
  const begin = performance.now();
  state.x = data.eyes[0] + (data.eyes[1] - data.eyes[0]) * k / (count - 1);
  draw();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  times.push(performance.now() - begin);
}
return [times, width, height, modules.length];
"""


def processor_seconds(profile: str) -> float:
    """User and system time of the drawing process of the Chromium that has a profile (Linux)."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            command = (folder / "cmdline").read_text()
            if "--type=gpu-process" in command and profile in command:
                user, system = (folder / "stat").read_text().rpartition(")")[2].split()[11:13]
                return (int(user) + int(system)) / 100
        except OSError:  # it has ended
            pass
    raise SystemExit("Chromium's drawing process is not there")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path)
    parser.add_argument("--frames", type=int, default=100)
    options = parser.parse_args()
    made = webdriver.ChromeOptions()
    made.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS:
        made.add_argument(f"--{flag}")
    browser = webdriver.Chrome(options=made, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        begin = time.perf_counter()
        browser.get(options.page.resolve().as_uri())
        WebDriverWait(browser, 600).until(lambda _: browser.find_elements("css selector", "canvas[data-ready]"))
        opened = time.perf_counter() - begin
        profile = browser.capabilities["chrome"]["userDataDir"]
        browser.execute_script(FRAMES, 5)
        before = processor_seconds(profile)
        times, width, height, modules = browser.execute_script(FRAMES, options.frames)
        processor = 1000 * (processor_seconds(profile) - before) / options.frames
    finally:
        browser.quit()
    print(f"{modules} modules, {width}x{height}: opened in {opened:.1f} s; a frame takes {np.median(times):.1f} ms")
    print(f"(at least {min(times):.1f}), {processor:.1f} ms of processor time")


if __name__ == "__main__":
    main()
