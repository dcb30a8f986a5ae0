"""A shaker as the thesis uses one, on a machining centre of ours: hung from outside, and standing on the table."""

from importlib.resources import files
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import stand_shaker
from toolpoint.substructuring.shaker import ElectrodynamicShaker

MACHINE = read_machine(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
LINES = np.linspace(10.0, 200.0, 191)


def change(body: float, suspension: float) -> float:
    """Return by how much, in percent, a shaker on the table changes the tool's response along z at the most."""
    shaker = ElectrodynamicShaker(body, 0.4, suspension, suspension_damping=5.0)
    return 100 * float(np.nanmax(stand_shaker(MACHINE, shaker, "tool:+z", stand="table", frequency=LINES).change))


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; bodies of 5 to 60 kg and suspensions of 1 to 50 N/mm are drawn."""
    rng = np.random.default_rng(1)
    drawn = np.array([change(rng.uniform(5, 60), 10 ** rng.uniform(3, 4.7)) for _ in range(draws)])
    return {"shaker_change": change(20.0, 5e3), "shaker_least": drawn.min(), "shaker_most": drawn.max(),
            "draws": drawn.size, "shaker_holds": int(np.sum(drawn > 10))}


if __name__ == "__main__":
    print(main())
