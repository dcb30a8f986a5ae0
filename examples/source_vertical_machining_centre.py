"""The machining centre of its source: frequencies beside table 5, modes that move the tool against the table, drawn masses."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.modal_identification import significance
from toolpoint.studies import Factor, draw_conclusions, list_points, solve_modes
from toolpoint.studies.machines.virtual_test import true_modes

PARTS = {"base": ("base", "saddle", "table"), "column": ("column", "head"), "magazine": ("magazine",)}
WITH_INERTIA = ("base", "column")  # the inertia of the others follows from their boxes
TEST, MODEL = np.array([21, 26.5, 31.5, 38, 44, 58]), np.array([21.5, 26.4, 32.8, 39.8, 44.4, 58.0])  # Hz, table 5
UNKNOWN = [Factor(name, (*(f"bodies.{body}.mass" for body in bodies), *(f"bodies.{body}.inertia.*" for body in bodies
                                                                        if body in WITH_INERTIA)), 0.7, 1.4)
           for name, bodies in PARTS.items()]


def judge(machine: Any) -> dict[str, bool]:
    """Return which conclusions on the frequencies hold for a machine."""
    frequency = solve_modes(machine, None, 6).frequency
    worst = np.abs(frequency / TEST - 1).max()
    return {"within_5": worst < 0.05, "within_15": worst < 0.15, "below_100": frequency[-1] < 100}


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        machine, driven = (read_machine(folder / f"three_axis_vertical{name}.yaml") for name in ("", "_drives"))
    numbers: dict[str, Any] = {"size": assemble(machine).size, "size_driven": assemble(driven).size}
    frequency = solve_modes(machine, None, 6).frequency
    for k, (f, test, model) in enumerate(zip(frequency, TEST, MODEL, strict=True), 1):
        numbers |= {f"f{k}": f, f"to_test{k}": 100 * (f / test - 1), f"to_model{k}": 100 * (f / model - 1)}
    share = significance(true_modes(machine, list_points(machine), 0.03), "tool", "table").share
    numbers |= {f"share{k}": 100 * value for k, value in enumerate(share, 1)}
    drawn = draw_conclusions(machine, UNKNOWN, judge, draws=draws, rng=np.random.default_rng(1))
    print(drawn.table())
    return numbers | drawn.summary()


if __name__ == "__main__":
    main()
