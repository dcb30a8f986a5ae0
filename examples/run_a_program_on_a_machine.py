"""An NC program over its stock: forces and stability of every block, and what to change (as `toolpoint machining`)."""

import tempfile

import numpy as np

from toolpoint.io.program.gcode import parse
from toolpoint.pages.machining.program import machining_page
from toolpoint.studies import cuts_of_options, describe_machining, modal_dynamics, run_program, stock_of
from toolpoint.vibration import Modes

PROGRAM = """G21 G90
T1 M6 S12000 M3
G0 X-10 Y0
Z-0.45
G1 X60 F2400
G0 Z5
X-10 Y7
Z-0.45
G1 X60
G0 Z5
"""


def main() -> float:
    """Return the blocks that chatter at the advised speed, of two that do at the programmed one."""
    modes = Modes([900.0, 1080.0], [0.02, 0.02], np.diag([4.0, 3.5]), ("tip:+x", "tip:+y"))
    cut = cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8})
    setup = describe_machining(stock_of("box", (0, -0.03, -0.02, 0.05, 0.03, 0)), cut, spacing=4e-4)
    program = parse(PROGRAM, start=(0.0, 0.0, 0.1))
    result = run_program(program, setup, modal_dynamics(modes), text=PROGRAM, with_advice=True)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(machining_page(result).save(folder))
    return float(result.advice.tools[0].chatter_after)


if __name__ == "__main__":
    main()
