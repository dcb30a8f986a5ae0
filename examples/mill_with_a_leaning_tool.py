"""A chamfer whose angle turns along the edge, in five axes: tool centre control with vectors of the tool (G43.5)."""

from toolpoint import studies
from toolpoint.io.program.gcode import parse

PROGRAM = """S9000 M3
G0 X-8 Y0 Z20
G43.5 H1
G0 X-8 Y0 Z-3 I0 J-1 K1
G1 X0 F1800
X40 J-1 K0.75 (from 45 to 53 degrees)
X48
G49
G0 Z50
"""


def main() -> float:
    """Return the volume of the chamfer, mm^3."""
    cut = studies.cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8,
                                         "flute_length": 0.02})
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.01, 0.04, 0.02, 0)), cut, spacing=4e-4)
    study = studies.run_five_axes(parse(PROGRAM, start=(0, 0, 0.05)), setup, text=PROGRAM)
    print(study.table())
    return 1e9 * study.removed.total_volume


if __name__ == "__main__":
    main()
