"""Frames a second of the animated shape page with software rendering, 10 000 nodes, with its drawing error beside it.

Run: python benchmarks/plot/shape_view.py [--nodes N] [--seconds S] [--json]
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.plot import AnimatedShapes, Scene, ShapeView

ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--disable-background-networking", "--no-first-run"]
TARGET_RATE, TARGET_SIZE = 30.0, 1_000_000
VIEW = "window.toolpointViews.shapes"


def tube(nodes: int) -> tuple[Scene, AnimatedShapes]:
    """Return a closed wavy tube of about `nodes` nodes and six modes, three of them complex (travelling)."""
    around = 100
    along = max(nodes // around, 2)
    z, a = np.meshgrid(np.linspace(0, 2, along), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij")
    radius = 0.3 + 0.05 * np.sin(3 * z)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), z], axis=-1).reshape(-1, 3)
    at = np.arange(along * around).reshape(along, around)
    p, q, r, s = at[:-1], np.roll(at, -1, 1)[:-1], at[1:], np.roll(at, -1, 1)[1:]
    faces = np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([q, s, r], -1).reshape(-1, 3)])
    lines = np.concatenate([np.stack([p, q], -1).reshape(-1, 2), np.stack([p, r], -1).reshape(-1, 2)])
    rng = np.random.default_rng(1)  # a small roughness, so that the packed size is not that of a perfect surface
    points = points + rng.normal(scale=0.002, size=points.shape)
    shapes = []
    for k in range(1, 7):
        wave = np.sin(k * np.pi * points[:, 2] / 4)
        other = np.cos(k * np.pi * points[:, 2] / 4) if k > 3 else 0 * wave
        shapes.append(np.stack([wave, 1j * other, 0.1 * wave + 0.2j * other], axis=-1)
                      * (1 + 0.01 * rng.normal(size=(points.shape[0], 3))))
    return Scene(points, faces, lines), AnimatedShapes(20.0 * np.arange(1, 7), 0.01, np.array(shapes))


def measured(html: str, scene: Scene, shapes: AnimatedShapes, seconds: float) -> dict[str, float]:
    """Open the page, count frames while it plays, and compare the shader's positions with the formula."""
    from playwright.sync_api import sync_playwright

    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
    if path is None:
        sys.exit("no Chromium or Chrome on this machine")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = Path(folder, "page.html")
        file.write_text(html, "utf-8")
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(file.as_uri())
        page.evaluate(f"{VIEW}.showMode(4)")
        page.wait_for_timeout(4000)  # the page adapts its level of detail in this time
        start = page.evaluate(f"[{VIEW}.frames, performance.now()]")
        page.wait_for_timeout(1000 * seconds)
        end = page.evaluate(f"[{VIEW}.frames, performance.now()]")
        canvas = page.evaluate(f"[{VIEW}.canvas.width, {VIEW}.canvas.height, {VIEW}.level]")
        page.evaluate(f"{VIEW}.setPhase(0.9)")
        drawn = np.reshape(page.evaluate(f"{VIEW}.positions()"), (-1, 3))
        scale = page.evaluate(f"{VIEW}.scale(0)")
        browser.close()
    error = float(np.abs(drawn - scene.nodes - scale * shapes.at_phase(0.9)[4]).max()) / scene.size
    return {"frames_per_second": 1000 * (end[0] - start[0]) / (end[1] - start[1]), "position_error_of_size": error,
            "canvas_width": canvas[0], "canvas_height": canvas[1],
            "detail_left_out": canvas[2], "load": os.getloadavg()[0]}


def main() -> None:
    """Measure and print; the last line is the figure."""
    parser = CommandLine(__doc__)
    parser.add_argument("--nodes", type=int, default=10_000)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.json()
    options = parser.parse_args()
    scene, shapes = tube(options.nodes)
    html = ShapeView(scene, shapes).html()
    result = {"nodes": scene.nodes.shape[0], "triangles": scene.triangles.shape[0], "lines": scene.lines.shape[0],
              "modes": shapes.count, "html_bytes": len(html.encode()), "cores": os.cpu_count(),
              **measured(html, scene, shapes, options.seconds)}
    if options.json:
        print(json.dumps(result))
        return
    for name, value in result.items():
        print(f"{name:24s} {value:.6g}")
    size = result["html_bytes"] / 1e6
    print(f"{result['frames_per_second']:.1f} frames/s (target {TARGET_RATE:g}), page {size:.2f} MB "
          f"(target {TARGET_SIZE / 1e6:g}), software rendering, {result['nodes']} nodes")


if __name__ == "__main__":
    main()
