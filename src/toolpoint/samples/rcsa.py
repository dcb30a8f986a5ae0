"""Sample of receptance coupling: a gauge struck in a spindle, its shaft file, and that of a tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint.io.yaml import shaft_file
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf
from toolpoint.vibration.dof import dofs

GAUGE = """# Gauge: a plain bar that was struck in the spindle, from the spindle to its free end.
toolpoint: 1
name: gauge bar
segments:
  bar: {length: 120 mm, diameter: 40 mm, loss_factor: 0.1 %}
stations: {a: 115 mm, b: 65 mm, c: 15 mm}  # places that were struck and measured, from the spindle
"""
TOOL = """# Tool that was never measured, from the spindle to its tip.
toolpoint: 1
name: carbide end mill of 16 mm
segments:
  shank:
    length: 70 mm
    diameter: 16 mm
    material: carbide
    loss_factor: 0.5 %
    contact: {stiffness: 300 N/um, rotational_stiffness: 2e5 N*m/rad, loss_factor: 0.12}  # of the collet
  flutes: {length: 40 mm, diameter: 16 mm, material: carbide, fluted: true, loss_factor: 0.5 %}
contact_deviation: 0  # how well the collet is known, a share: try 0.1, and see the interval
"""
LINES_HZ = np.arange(10.0, 4500.0, 2.5)
# Receptances of the spindle at its nose: modes (Hz, N/m, turn over motion in 1/m) and what is above them (m/N, rad/(N m)).
SPINDLE_MODES = ((600.0, 1e8, 5.0), (1400.0, 1.8e8, -15.0))
SPINDLE_ABOVE = (1e-9, 4e-6)


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the gauge's responses and both shaft files; return what was put in, and the commands."""
    (folder / "gauge.yaml").write_text(GAUGE, encoding="utf-8")
    (folder / "tool.yaml").write_text(TOOL, encoding="utf-8")
    bar = station_stiffness(shaft_file.read(folder / "gauge.yaml"), LINES_HZ)
    stiffness = bar.matrix.copy()
    stiffness[:, :2, :2] += np.linalg.inv(_spindle())
    rows = [2 * section for section in bar.sections.values()]
    values = np.linalg.inv(stiffness)[:, rows][:, :, rows]
    rng = np.random.default_rng(2)
    noise = rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape)
    labels = dofs([f"{name}:+x" for name in bar.sections])
    io.write_frf(Frf(LINES_HZ, values * (1 + 0.002 * noise), labels, labels), folder / "gauge.uff")
    truth = ["The spindle has modes at 600 and 1400 Hz at its nose (100 and 180 N/um, 4 % damping).",
             "Noise of the gauge's responses: 0.2 % of each value in real and imaginary part."]
    return truth, ["toolpoint rcsa tool.yaml --frf gauge.uff --gauge gauge.yaml --noise 0.3 --save tip.h5",
                   "toolpoint lobes --frf tip.h5 --diameter 16 --teeth 4 --kt 800 --kn 250 --immersion 0.5 --direction down"]


def _spindle() -> np.ndarray:
    """Return displacement and turn by force and moment at the nose, (n_lines, 2, 2)."""
    values = np.zeros((LINES_HZ.size, 2, 2), complex) + np.diag(SPINDLE_ABOVE)
    for frequency, stiffness, slope in SPINDLE_MODES:
        ratio = LINES_HZ / frequency
        values += np.outer([1, slope], [1, slope]) / stiffness / (1 - ratio**2 + 0.08j * ratio)[:, None, None]
    return values
