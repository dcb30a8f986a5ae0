"""A cut in time: forces, vibration, chatter or not, and the page (as `toolpoint mill --speed 9000 --depth 2`)."""

import tempfile

import numpy as np

from toolpoint.pages.cuts.simulated_cut import simulation_page
from toolpoint.studies import chart_lobes, modal_dynamics, simulate_cut
from toolpoint.vibration import Modes

CUT = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 6e8, "normal": 2e8}
SPEED = 9000.0


def main() -> tuple[str, str]:
    """Return the states of cuts below and above the limit of the lobes: stable and chatter."""
    tip = modal_dynamics(Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y")))
    limit = float(chart_lobes(tip, CUT, speeds=np.array([SPEED])).chart.limit[0])
    low, high = (simulate_cut(tip, CUT, speed=SPEED, depth=share * limit) for share in (0.7, 1.6))
    print(high.table())
    with tempfile.TemporaryDirectory() as folder:
        print(simulation_page(high).save(folder))
    return low.state, high.state


if __name__ == "__main__":
    main()
