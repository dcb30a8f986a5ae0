"""The page of a machine's responses: magnitude with its intervals, magnitude and phase, where the intervals come from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.frf import bode
from toolpoint.plot.figures.response_bands import magnitude_bands
from toolpoint.studies.machines.machine_responses import HEADER, MachineResponses
from toolpoint.studies.machines.pose_words import pose_words


def responses_page(result: MachineResponses, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the responses of a machine at poses."""
    names = [pose_words(result.machine, pose) for pose in result.poses]
    report = Report(f"Responses of {result.machine.name}", subtitle="; ".join(names))
    report = report.with_doubts(*result.notes, *warnings)
    report = report.with_section("Greatest receptances", Table(list(HEADER), result.rows()))
    first = result.frfs[0]
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
    return report
