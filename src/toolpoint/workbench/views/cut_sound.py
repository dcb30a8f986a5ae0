"""Sound of a simulated cut: the verdict in time domain, and the tool's velocity as a tone that a browser plays."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import doubts_among
from toolpoint.cutting.description import flat_values
from toolpoint.cutting.option_words import cut_words
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.studies import simulate_cut
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.lobes_view import ask_cut
from toolpoint.workbench.views.machine_look import pack, resolve_speed
from toolpoint.workbench.views.view import command_line, pose_words_of

SOUND_RATE = 22050  # samples a second: tones up to 11 kHz
MAX_SOUND_SECONDS = 3.0  # s of the last part of the cut that are played


def sound_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the verdict on the asked cut, its vibration (peak to peak, m), and its sound, packed, at `SOUND_RATE`.

    The sound is the tool's velocity along the direction in which it moves most, scaled to one at its peak: how loud it is says
    nothing, its tone does. Raises ToolpointError for a request without a depth.
    """
    project, cut, systems = ask_cut(desk, request)
    depth = request.cut_values.get("depth")
    if depth is None:
        fail("depth", "none", "must be given: a sound is that of one cut")
    speed = resolve_speed(cut, request)
    values = {key: value for key, value in flat_values(cut).items() if value is not None and value != "" and key != "speeds"}
    result = simulate_cut(systems.nominal(request.pose), values, speed=speed, depth=depth)
    tone, peak = tone_of(result.run)
    frequency = chatter_line(result.run) if result.state == "chatter" else None
    file = None if not project.machine_file.is_file() else project.machine_file.relative_to(desk.folder).as_posix()
    pose = ["--pose", pose_words_of(request.pose)] if request.pose else []
    command = [] if file is None or request.values else [command_line(
        "mill", file, *pose, *cut_words(cut), "--speed", f"{speed:g}", "--depth", f"{1e3 * depth:g}")]
    return {"state": result.state, "reason": result.reason, "frequency_hz": frequency, "peak_to_peak_m": peak,
            "speed_rpm": speed, "depth_m": depth, "rate": SOUND_RATE, "sound": pack(tone), "commands": command,
            "doubts": [str(doubt) for doubt in doubts_among(result.notes)], "notes": [str(note) for note in result.notes]}


def chatter_line(run: Simulation) -> float | None:
    """Return the largest line (Hz) of the tool's motion that is no multiple of the spindle's turns, None without one."""
    way = int(np.argmax(np.ptp(run.displacement, axis=0)))
    lines = [(amplitude, frequency) for frequency, amplitude, kind in run.spectrum(direction=way).lines() if kind == "chatter"]
    return max(lines)[1] if lines else None


def tone_of(run: Simulation) -> tuple[FloatArray, float]:
    """Return the velocity of the last seconds at `SOUND_RATE`, scaled to a peak of one, and the motion peak to peak, m."""
    times = np.asarray(run.time)
    displacement = run.displacement[times >= times[-1] - MAX_SOUND_SECONDS]
    times = times[times >= times[-1] - MAX_SOUND_SECONDS]
    way = int(np.argmax(np.ptp(displacement, axis=0)))
    velocity = np.gradient(displacement[:, way], times)
    samples = np.arange(times[0], times[-1], 1 / SOUND_RATE)
    tone = np.interp(samples, times, velocity - velocity.mean())
    return tone / max(float(np.abs(tone).max()), 1e-300), float(np.ptp(displacement[:, way]))
