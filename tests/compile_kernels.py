"""One small call of every compiled engine, so that the kernels are compiled once, before the test workers begin.

Each kernel is kept on disk beside its module; two workers that begin at once would both compile all of them.
Run by `conftest.py`, or by hand: python tests/compile_kernels.py
"""

from __future__ import annotations

import contextlib
import gc
import sys
import warnings
from pathlib import Path

import numpy as np

from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL, Casting, Cuboid
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.simulation.milling import simulate
from toolpoint.io import read_drives, read_machine
from toolpoint.machine import Machine, build
from toolpoint.machine import description as d
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_side
from toolpoint.studies.accuracy.tool_paths import line
from toolpoint.studies.servos.drive_experiment import run_drives
from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription, couple_tool
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Dof, Modes, frequency_response
from toolpoint.vision.clip import clip_of
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import windows_at
from toolpoint.vision.rendering import texture
from toolpoint.vision.rendering.scene import MARGIN, Camera, PicturedBody, Scene2D, film

ROOT = Path(__file__).resolve().parents[1]
MACHINES = ROOT / "src" / "toolpoint" / "app" / "machines"


def milling(tool: Tool) -> MillingProblem:
    """A cut on two modes, one a direction."""
    modes = Modes([922.0, 950.0], [0.011, 0.012], np.diag([5.0, 4.8]), [Dof("tool", "+x"), Dof("tool", "+y")])
    return MillingProblem(tool, Engagement.down(0.3), CuttingCoefficients(6e8, 2e8), modes, "tool:+x", "tool:+y")


def slide() -> Machine:
    """A slide that is driven along x and gives way along y, with a cut at its tip."""
    cut = CuttingDescription.of(diameter=0.006, teeth=2, tangential=1.8e9, normal=6e8, direction="slot", feed_per_tooth=1e-5)
    body = d.BodyDescription(mass=8.0, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"y": 4e5}, damping={"y": 60.0})
    return build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", "x")},
                                      {"tip": d.PointDescription("slide")}, tool="tip", cutting=cut))


def main() -> None:
    """Compile; an engine that refuses its case compiles at its first test instead."""
    gc.disable()  # a compiler's trees are let go of as they are done with: looking for garbage takes a tenth of the time
    plain, helical = milling(Tool(0.012, 2)), milling(Tool(0.012, 2, 0.5))
    speeds = np.array([9000.0])
    for problem, names in ((plain, ("floquet", "panel")), (helical, ("auto", "panel"))):
        for name in names:
            with contextlib.suppress(ToolpointError):
                stability.chart(problem, speeds, stability.method_named(name), depth_max=0.004)
    simulate(plain.changed(feed_per_tooth=1e-4), 9000.0, 1e-3, revolutions=4)
    frf = frequency_response.modal(Modes([922.0], [0.011], [[5.0]], [Dof("tool", "+x")]), np.linspace(400, 1600, 300))
    measured = MillingProblem(Tool(0.012, 2), Engagement.down(0.3), CuttingCoefficients(6e8, 2e8), frf, "tool:+x", "same")
    stability.chart(measured, speeds, stability.method_named("hill"), depth_max=0.002)
    natural_frequencies(read_machine(MACHINES / "three_axis_vertical.yaml"), {"X": np.zeros(2)}, path="compiled")
    rod = ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})
    couple_tool(PlaneReceptance(np.array([100.0, 200.0]), np.tile(1e-8 * np.eye(2), (2, 1, 1))), rod)
    station_stiffness(rod, np.array([100.0]))
    moved = np.random.default_rng(1).integers(0, 255, (40, 64, 64), dtype=np.uint8)
    scanned = scan(clip_of(moved, 100.0))
    for method in ("templates", "lucas-kanade", "phase"):
        measure(scanned, windows_at(scanned.reference, np.array([[20, 20]]), 17), method)
    block = Casting([Cuboid([0, 0, 0], [1, 1, 1])], {"body": STEEL}).meshed(0.5)
    block.stiffness() @ np.ones(block.size)
    body = PicturedBody("body", (20, 20, 8, 8), texture.plain((8 + 2 * MARGIN,) * 2, 130.0), np.zeros((1, 2, 6)))
    scene = Scene2D((body,), lambda t: np.ones((len(t), 1)), texture.plain((48 + 2 * MARGIN,) * 2, 205.0))
    film(scene, Camera(shape=(48, 48), frame_rate=100.0), 4, rng=np.random.default_rng(1))
    feed = line([0, 0, 0], [0.002, 0, 0])[0]
    mill_side(slide(), feed, MillingSetup(15000, 0.5e-3, window=None, steps=20, halved=False))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run_drives(read_drives(MACHINES / "three_axis_vertical_servo.yaml"), circle=(2e-3, 0.05))


if __name__ == "__main__":
    sys.exit(main())
