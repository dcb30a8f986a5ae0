"""Workbench in headless Chromium on the demo mill: first view from `serve`, its bytes, and 50 moves of each slider.

A move ends when modes, responses and the limit of the cut have been drawn anew: the answer is in the page, and two frames have
passed. While a slider is on its way, as here, the limit is the single-frequency one; the exact one follows when it rests. The
page animates the mode between moves, in software rendering. Usage: python benchmarks/workbench/browser.py [--moves 50]
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from playwright.sync_api import sync_playwright

from benchmarks.frame import CommandLine

ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--disable-background-networking", "--no-first-run"]
READY_WATCH = """window.addEventListener("DOMContentLoaded", () => {
  window.scriptReady = performance.now();
  new MutationObserver(() => { if (document.body.dataset.ready && !window.viewReady) window.viewReady = performance.now(); })
    .observe(document.body, { attributes: true });
});"""
MOVE = """async ([id, value]) => {
  const slider = document.getElementById(id), count = window.Workbench.moves, start = performance.now();
  slider.value = value;
  slider.dispatchEvent(new Event("input"));
  while (window.Workbench.moves === count) await new Promise((go) => setTimeout(go, 1));
  await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));
  return performance.now() - start;
}"""


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("moves", 50)
    parser.add_argument("--first", action="store_true", help="the first view alone")
    parser.add_argument("--project", type=Path, help="a project that has been run; the demo project is made where left out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.project or _demo(Path(scratch))
        chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
            print("load of the machine:", ", ".join(f"{load:.1f}" for load in os.getloadavg()))
            _first_views(browser, folder)
            if not options.first:
                _moves(browser, folder, options.moves)
            browser.close()


def _demo(scratch: Path) -> Path:
    from toolpoint.project import Project, write_demo

    write_demo(scratch / "mill")
    Project.open(scratch / "mill").run()
    return scratch / "mill"


def _serve(folder: Path) -> tuple[subprocess.Popen[str], str]:
    process = subprocess.Popen([sys.executable, "-m", "toolpoint", "serve", str(folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().split()[-1]


def _cpu_seconds(process: subprocess.Popen[str]) -> float:
    """Return the processor time of a process so far, s (Linux)."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _open(page, address: str, sizes: list[int]):
    # Compressed or not, what crosses the socket: the server sends no compression.
    page.on("response", lambda response: sizes.append(int(response.headers.get("content-length", 0))))
    page.goto(address)
    while page.evaluate("document.body.dataset.ready") != "project":
        time.sleep(0.005)
    return page


def _tab(browser):
    """Return an empty tab of a browser that runs; its own clock says when the page itself says that it is ready."""
    page = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    page.add_init_script(READY_WATCH)
    return page


def _first_views(browser, folder: Path, repeats: int = 7) -> None:
    """Print the first view, from the start of the process to the page's own word that it is ready, and the shares of it."""
    rows = []
    for _ in range(repeats):
        sizes: list[int] = []
        page, start = _tab(browser), time.time()
        process, address = _serve(folder)
        listening = time.time() - start
        _open(page, address, sizes)
        origin, script, ready = page.evaluate("[performance.timeOrigin, window.scriptReady, window.viewReady]")
        request = origin / 1e3 - start  # s after the start of the process
        rows.append((request + ready / 1e3, listening, request - listening, script / 1e3, (ready - script) / 1e3,
                     _cpu_seconds(process), os.getloadavg()[0]))
        page.context.close()
        process.kill()
        process.wait()
    first, listening, leaving, script, view, cpu, load = np.median(rows, axis=0)
    print(f"first view {first:.2f} s after serve at a load of {load:.1f} (slowest {np.max(rows, axis=0)[0]:.2f} s): listening "
          f"{listening:.2f}, to the browser's request {leaving:.2f}, page and scripts {script:.2f}, numbers and drawing "
          f"{view:.2f}; the server's CPU {cpu:.2f} s, {sum(sizes) / 1e6:.2f} MB")


def _moves(browser, folder: Path, moves: int) -> None:
    process, address = _serve(folder)
    page = _open(_tab(browser), address, [])
    page.evaluate("location.hash = '#/machine'")
    while page.evaluate("document.body.dataset.ready") != "machine" or not page.evaluate("window.Workbench.moves || 0"):
        time.sleep(0.05)
    time.sleep(2.0)
    rng = np.random.default_rng(1)
    sliders = page.evaluate("[...document.querySelectorAll('input[type=range]')].map((one) => [one.id, +one.min, +one.max])")
    figures = []
    for name, prefix in (("stiffness", "k-"), ("pose", "axis-")):
        chosen = [slider for slider in sliders if slider[0].startswith(prefix)]
        times, before = [], _cpu_seconds(process)
        for number in range(moves + 3):
            identifier, lower, upper = chosen[number % len(chosen)] if prefix == "axis-" else chosen[0]
            value = lower + (upper - lower) * rng.uniform(0.3, 0.7)
            times.append(page.evaluate(MOVE, [identifier, value]))
        median, late = np.percentile(times[3:], [50, 95])
        cpu = (_cpu_seconds(process) - before) / (moves + 3)
        figures.append(f"{name} {median:.0f} ms, {late:.0f} ms")
        print(f"{name}: median {median:.0f} ms, 95 % {late:.0f} ms; the server's CPU a move {1e3 * cpu:.0f} ms")
    process.kill()
    process.wait()
    print(f"median and 95 % of {moves} moves: " + "; ".join(figures))


if __name__ == "__main__":
    main()
