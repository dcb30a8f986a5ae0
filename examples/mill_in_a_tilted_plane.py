"""A chamfer in a tilted plane (G68.2) and a slot beside it: each plane is a stage over the work that was left before."""

import tempfile

from toolpoint import studies
from toolpoint.io.program.gcode import parse
from toolpoint.pages.machining.program import stages_page

PROGRAM = """S9000 M3
G68.2 X0 Y0 Z0 I0 J45 K0
G53.1
G0 X-7 Y0 Z9
Z-2.12132
G1 X47 F1800 (chamfer of 3 mm)
G0 Z9
G69
G0 X-7 Y15 Z5
Z-1
G1 X47 (slot)
G0 Z9
"""


def main() -> float:
    """Return the volume of the chamfer, mm^3: 3 x 3/2 x 40."""
    cut = studies.cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8})
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)), cut, spacing=4e-4)
    study = studies.run_stages(parse(PROGRAM, start=(0, 0, 0.05)), setup, text=PROGRAM)
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(stages_page(study).save(folder))
    return 1e9 * study.stages[0].removed.total_volume


if __name__ == "__main__":
    main()
