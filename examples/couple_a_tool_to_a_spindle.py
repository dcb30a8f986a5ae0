"""The tool-point response of a tool that was never measured, from a gauge struck in the spindle (as `toolpoint rcsa`)."""

import tempfile

import numpy as np

from toolpoint.pages.cuts.tool_coupling import tool_coupling_page
from toolpoint.studies import bases_from_gauge, study_tool
from toolpoint.substructuring import SegmentDescription, ShaftDescription
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf

GAUGE = ShaftDescription({"bar": SegmentDescription(0.060, 0.040, loss_factor=0.001)}, stations={"1": 0.055, "2": 0.015})
TOOL = ShaftDescription({"shank": SegmentDescription(0.050, 0.016, material="carbide"),
                         "flutes": SegmentDescription(0.030, 0.016, material="carbide", fluted=True)})
LINES, SHIFT, TILT = np.arange(10.0, 2000.0, 5.0), 1e8, 1e6  # Hz; N/m and N m/rad of a spindle without mass


def struck_gauge() -> Frf:
    """Return what hammer and sensor see at the gauge's stations in that spindle."""
    whole = station_stiffness(GAUGE, LINES)
    matrix = whole.matrix.copy()
    matrix[:, :2, :2] += np.diag([SHIFT, TILT]) * (1 + 0.05j)
    at = [2 * k for k in whole.sections.values()]
    return Frf(LINES, np.linalg.inv(matrix)[:, at][:, :, at], ["1:+x", "2:+x"], ["1:+x", "2:+x"])


def main() -> float:
    """Return the predicted response at 10 Hz over the static one by hand: spindle, bending and shear of both segments."""
    bases = bases_from_gauge(struck_gauge(), GAUGE, noise=0.001, generator=np.random.default_rng(1))
    result = study_tool(bases, TOOL, stick_out=("shank", np.array([0.04, 0.06])))
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(tool_coupling_page(result).save(folder))
    (_, e, shear, a1, i1, *_), (*_, a2, i2, _, _) = TOOL.rows.real
    bending = (0.08**3 - 0.03**3) / (3 * e * i1) + 0.03**3 / (3 * e * i2) + (0.05 / a1 + 0.03 / a2) / shear
    return float(abs(result.tips[0].values[0, 0, 0]) / (1 / SHIFT + 0.08**2 / TILT + bending))


if __name__ == "__main__":
    main()
