"""Compilation of all kernels ahead of their first use: one small call of every compiled engine, on as many cores as asked for.

A kernel is compiled where it is first called and kept on disk beside its module, so a first command takes half a minute that
later ones do not. Each part below calls the engines of one question; a command needs the kernels of its own part alone.
"""

from __future__ import annotations

import contextlib
import gc
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from toolpoint._check import ToolpointError, count
from toolpoint._notebook import NotebookText
from toolpoint.studies.text_table import text_table

if TYPE_CHECKING:
    from toolpoint.cutting import MillingProblem

Progress = Callable[[str, int, int], None]
HEADER = ("part", "s", "state")


@dataclass(frozen=True)
class CompiledPart:
    """Kernels of one part: seconds that the calls took, and the reason where a call failed."""

    name: str
    seconds: float
    failure: str = ""


@dataclass(frozen=True)
class KernelCompilation(NotebookText):
    """Result: the parts in the order in which they ended, and the wall-clock seconds of all together."""

    parts: tuple[CompiledPart, ...]
    seconds: float

    @property
    def is_whole(self) -> bool:
        """Whether every part was compiled."""
        return not any(part.failure for part in self.parts)

    def table(self) -> str:
        """Return the parts as text."""
        rows = [[part.name, f"{part.seconds:.1f}", part.failure or "compiled"] for part in self.parts]
        return text_table("Kernels", HEADER, rows) + f"\nall together in {self.seconds:.1f} s"

    def to_dict(self) -> dict[str, Any]:
        """Return the parts as plain data."""
        return {"whole": self.is_whole, "seconds": self.seconds, "parts": [vars(part) for part in self.parts]}


def compile_kernels(workers: int = 1, *, progress: Progress | None = None) -> KernelCompilation:
    """Compile every kernel that is not on disk yet.

    Parameters
    ----------
    workers : int
        Processes that compile side by side; with one, this process does it all.
    progress : function of name, done, total, optional

    Raises
    ------
    ToolpointError
        For fewer than one worker.
    """
    number = min(count("workers", workers), len(PARTS))
    begin = time.perf_counter()
    results = _in_this_process(progress) if number == 1 else _in_processes(number, progress)
    return KernelCompilation(tuple(results), time.perf_counter() - begin)


def compile_part(name: str) -> CompiledPart:
    """Call the engines of one part of `PARTS` once; a failure is a result."""
    begin = time.perf_counter()
    failure = ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            PARTS[name]()
        except ToolpointError as error:
            failure = str(error)
    return CompiledPart(name, time.perf_counter() - begin, failure)


def _in_this_process(progress: Progress | None) -> list[CompiledPart]:
    results = []
    # A compiler's trees are let go of as they are done with: looking for garbage among them takes a tenth of the time.
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for name in PARTS:
            results.append(compile_part(name))
            if progress is not None:
                progress("kernels", len(results), len(PARTS))
    finally:
        if was_enabled:
            gc.enable()
    return results


def _in_processes(workers: int, progress: Progress | None) -> list[CompiledPart]:
    """Return the results of processes of their own, the longest parts first; none is left behind when this one is stopped."""
    waiting, running, results = list(PARTS), dict[str, tuple[subprocess.Popen[str], float]](), list[CompiledPart]()
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                name = waiting.pop(0)
                running[name] = subprocess.Popen([sys.executable, "-c", _PROGRAM, name], stdout=subprocess.DEVNULL,
                                                 stderr=subprocess.PIPE, text=True), time.perf_counter()
            for name, (process, begin) in list(running.items()):
                if process.poll() is not None:
                    words = process.communicate()[1].strip().splitlines()
                    failure = "" if process.returncode == 0 else (words[-1] if words else f"ended with {process.returncode}")
                    results.append(CompiledPart(name, time.perf_counter() - begin, failure))
                    del running[name]
                    if progress is not None:
                        progress("kernels", len(results), len(PARTS))
            time.sleep(POLL_SECONDS)
    finally:
        for process, _ in running.values():
            process.kill()
            process.wait()
    return results


POLL_SECONDS = 0.05
_PROGRAM = ("import gc, sys; gc.disable(); from toolpoint.kernel_compilation import compile_part; "
            "failure = compile_part(sys.argv[1]).failure; sys.exit(failure or 0)")


def _milling(helix: float) -> MillingProblem:
    """A cut on two modes, one a direction."""
    from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
    from toolpoint.vibration import Dof, Modes

    dofs = Dof("tool", "+x"), Dof("tool", "+y")
    modes = Modes(np.array([922.0, 950.0]), np.array([0.011, 0.012]), np.diag([5.0, 4.8]), dofs)
    tool, engagement = Tool(0.012, 2, np.array([helix])), Engagement.down(0.3)
    return MillingProblem(tool, engagement, CuttingCoefficients(6e8, 2e8), modes, "tool:+x", "tool:+y")


def _chart(problem: MillingProblem, names: Sequence[str], depth_max: float) -> None:
    from toolpoint.cutting import stability

    for name in names:
        # An engine that refuses this case compiles at its first use instead.
        with contextlib.suppress(ToolpointError):
            stability.chart(problem, np.array([9000.0]), stability.method_named(name), depth_max=depth_max)


def _charts() -> None:
    # Straight and helical edges share most of their kernels: side by side both would be compiled twice.
    _chart(_milling(0.0), ("floquet", "panel"), 0.004)
    _chart(_milling(0.5), ("auto", "panel"), 0.004)


def _programs() -> None:
    from toolpoint.cutting.description import CuttingDescription
    from toolpoint.io.program.gcode import parse
    from toolpoint.material_removal import Stock
    from toolpoint.studies.machining.run_program import run_program
    from toolpoint.studies.machining.setup import MachiningSetup

    program = parse("S9000 G1 F1800 X-20 Y25 Z-2\nX20\n", start=(-0.02, 0.025, 0.1))
    cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    run_program(program, MachiningSetup(Stock.box((0, 0, -0.01), (0.04, 0.05, 0)), cut, spacing=2e-3))


def _five_axes() -> None:
    """Directions of a leaning tool over tri-dexels."""
    from toolpoint.cutting.description import CuttingDescription
    from toolpoint.io.program.gcode import parse
    from toolpoint.material_removal import Stock
    from toolpoint.studies.machining.described_setup import describe_machining
    from toolpoint.studies.machining.five_axes.run_five_axes import run_five_axes

    cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8, flute_length=0.02)
    program = parse("S9000\nG43.5 H1\nG0 X-8 Y0 Z-3 J-1 K1\nG1 X48 J-1 K1.1 F1800\nG49", start=(0, 0, 0.05))
    run_five_axes(program, describe_machining(Stock.box((0, 0, -0.01), (0.04, 0.02, 0)), cut, spacing=2e-3))


def _tilted_planes() -> None:
    """Planes that see the work of others, and a stock by a mesh: kernels of their own."""
    from toolpoint.cutting.description import CuttingDescription
    from toolpoint.io.program.gcode import parse
    from toolpoint.material_removal import Stock
    from toolpoint.studies.machining.described_setup import describe_machining
    from toolpoint.studies.machining.run_program import run_program
    from toolpoint.studies.machining.tilted_stages import run_stages

    cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    text = "S9000\nG0 X-20 Y10 Z5\nZ-1\nG1 X60 F1800\nG0 Z50\nG68.2 X0 Y0 Z0 J90\nG53.1\nG0 X-7 Y-5 Z5\nZ-2\nG1 X47\nG69"
    tilted = parse(text, start=(0, 0, 0.05))
    run_stages(tilted, describe_machining(Stock.box((0, 0, -0.01), (0.04, 0.02, 0)), cut, spacing=2e-3))
    # A tetrahedron of four faces, outward.
    corners = np.array([[0.0, 0.0, -0.01], [0.04, 0.0, -0.01], [0.0, 0.04, -0.01], [0.0, 0.0, 0.0]])
    faces = corners[np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]
    upright = parse("S9000 G1 F1800 X-20 Y5 Z-5\nX40\n", start=(-0.02, 0.005, 0.1))
    run_program(upright, describe_machining(Stock.mesh(faces), cut, spacing=2e-3))


def _measured_response() -> None:
    from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
    from toolpoint.vibration import Dof, Modes, frequency_response

    mode = Modes(np.array([922.0]), np.array([0.011]), np.array([[5.0]]), (Dof("tool", "+x"),))
    frf = frequency_response.modal(mode, np.linspace(400, 1600, 300))
    measured = MillingProblem(Tool(0.012, 2), Engagement.down(0.3), CuttingCoefficients(6e8, 2e8), frf, "tool:+x", "same")
    _chart(measured, ("hill",), 0.002)


def _simulated_cut() -> None:
    from toolpoint.cutting.simulation.milling import simulate

    simulate(_milling(0.0).changed(feed_per_tooth=1e-4), 9000.0, 1e-3, revolutions=4)


def _frequency_maps() -> None:
    from toolpoint.io import read_machine
    from toolpoint.machine.frequencies import natural_frequencies

    natural_frequencies(read_machine(_MACHINES / "three_axis_vertical.yaml"), {"X": np.zeros(2)}, path="compiled")


def _tool_coupling() -> None:
    from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription, couple_tool
    from toolpoint.substructuring.shaft_stiffness import station_stiffness

    rod = ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})
    couple_tool(PlaneReceptance(np.array([100.0, 200.0]), np.tile(1e-8 * np.eye(2), (2, 1, 1))), rod)
    station_stiffness(rod, np.array([100.0]))


def _video() -> None:
    from toolpoint.vision.clip import clip_of
    from toolpoint.vision.displacement.measure import measure, scan
    from toolpoint.vision.displacement.points import windows_at
    from toolpoint.vision.rendering import texture
    from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, PicturedBody, Scene2D, film

    scanned = scan(clip_of(np.random.default_rng(1).integers(0, 255, (40, 64, 64), dtype=np.uint8), 100.0))
    for method in ("templates", "lucas-kanade", "phase"):
        measure(scanned, windows_at(scanned.reference, np.array([[20, 20]]), 17), method)
    body = PicturedBody("body", (20, 20, 8, 8), texture.plain((8 + 2 * TEXTURE_MARGIN,) * 2, 130.0), np.zeros((1, 2, 6)))
    scene = Scene2D((body,), lambda t: np.ones((len(t), 1)), texture.plain((48 + 2 * TEXTURE_MARGIN,) * 2, 205.0))
    film(scene, Camera(shape=(48, 48), frame_rate=100.0), 4, rng=np.random.default_rng(1))


def _castings() -> None:
    from toolpoint.bodies.solid import STEEL, Casting, Cuboid

    block = Casting((Cuboid(np.zeros(3), np.ones(3)),), {"body": STEEL}).meshed(0.5)
    block.stiffness() @ np.ones(block.size)


def _milled_side() -> None:
    from toolpoint.cutting.description import CuttingDescription
    from toolpoint.machine import build
    from toolpoint.machine import description as d
    from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_side
    from toolpoint.studies.accuracy.tool_paths import line

    cut = CuttingDescription.of(diameter=0.006, teeth=2, tangential=1.8e9, normal=6e8, direction="slot", feed_per_tooth=1e-5)
    body = d.BodyDescription(mass=8.0, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"y": 4e5}, damping={"y": 60.0})
    slide = build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", "x")},
                                       {"tip": d.PointDescription("slide")}, tool="tip", cutting=cut))
    feed = line([0, 0, 0], [0.002, 0, 0])[0]
    mill_side(slide, feed, MillingSetup(15000, 0.5e-3, window=None, steps=20, halved=False))


def _drives() -> None:
    from toolpoint.io import read_drives
    from toolpoint.studies.servos.drive_experiment import run_drives

    run_drives(read_drives(_MACHINES / "three_axis_vertical_servo.yaml"), circle=(2e-3, 0.05))


_MACHINES = Path(__file__).resolve().parent / "app" / "machines"
# What is compiled, by the question that it answers; the longest first, so that several processes end together.
PARTS: dict[str, Callable[[], None]] = {
    "stability charts": _charts,
    "milling of a side": _milled_side,
    "video": _video,
    "stability by measured responses": _measured_response,
    "frequencies over poses": _frequency_maps,
    "simulated cut": _simulated_cut,
    "programs on a machine": _programs,
    "programs in tilted planes": _tilted_planes,
    "programs of five axes": _five_axes,
    "drives": _drives,
    "castings": _castings,
    "coupling of tools": _tool_coupling,
}
