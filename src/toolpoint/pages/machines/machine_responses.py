"""The page of a machine's responses: magnitude with its intervals, magnitude and phase, where the intervals come from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.response_bands import magnitude_bands
from toolpoint.studies.machines.machine_responses import HEADER, MachineResponses
from toolpoint.studies.machines.pose_words import pose_words


def responses_page(result: MachineResponses, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the responses of a machine at poses.

    Examples
    --------
    Runs in ``examples/ask_an_identified_machine.py``.
    """
    names = [pose_words(result.machine, pose) for pose in result.poses]
    report = Report(f"Responses of {result.machine.name}", _answer(result, names), subtitle="; ".join(names))
    report = report.with_doubts(*result.notes, *warnings)
    report = report.with_section("Greatest receptances", Table(list(HEADER), result.rows()))
    first = result.frfs[0]
    # Direct responses only, where there are any: all pairs of many points would fill the page.
    pairs = [(i, j) for i, a in enumerate(first.outputs) for j, b in enumerate(first.inputs) if a == b] or [(0, 0)]
    for i, j in pairs:
        label = f"{first.outputs[i]} / {first.inputs[j]}"
        parts = []
        if result.spread is not None:
            curves = {}
            for k, name in enumerate(names):
                band = result.band(k)
                assert band is not None
                curves[name] = (np.abs(result.frfs[k].values[:, i, j]), band[0][:, i, j], band[1][:, i, j])
            parts.append(Chart(magnitude_bands(first.frequency, curves, title=label),
                               "Bands: 95 % intervals from the covariance of the identified numbers."))
        singles = {name: frf.selected([i], [j]) for name, frf in zip(names, result.frfs, strict=True)}
        parts.append(Chart(bode(singles, title=label), "Receptance by direct solution."))
        report = report.with_section(label, *parts)
    return report.with_assumptions(
        "Receptances of the linear machine about each pose, solved directly.",
        *(("Intervals hold what the covariance of the identified numbers holds; all other numbers are taken as exact.",)
          if result.spread is not None else ("No number of the machine has a covariance: the responses carry no interval.",)))


def _answer(result: MachineResponses, names: list[str]) -> str:
    """Return the greatest receptance over all poses, outputs and inputs (µm/N), with its 95 % interval where one is known."""
    peaks = [float(np.abs(frf.values).max()) for frf in result.frfs]
    k = int(np.argmax(peaks))
    frf = result.frfs[k]
    line, i, j = (int(n) for n in np.unravel_index(int(np.argmax(np.abs(frf.values))), frf.values.shape))
    size = f"{number_text(1e6 * peaks[k], digits=3)} µm/N"
    band = result.band(k) if result.spread is not None else None
    if band is not None:
        lower_end, upper_end = (1e6 * float(part[line, i, j]) for part in band)
        size += f" ({number_text(lower_end, digits=3)} to {number_text(upper_end, digits=3)}, 95 %)"
    pose_text = f" at {names[k]}" if len(names) > 1 else ""
    return f"The greatest response, {frf.outputs[i]} / {frf.inputs[j]}, is {size} at {frf.frequency[line]:.1f} Hz{pose_text}."
