"""The small mill with the 16 springs and dampers of its source, all linear: updated from the source's starting values."""

from importlib import resources
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.studies import Factor, Measurement, draw_conclusions, solve_modes, update_machine
from toolpoint.vibration import frequency_response

LINES, NOSE = np.linspace(5.0, 100.0, 381), ("spindle_nose:+x", "spindle_nose:+y")
JOINTS = ("floor_base", "base_column", "column_housing", "base_cross_slide")
PATHS = {joint: [f"joints.{joint}.{kind}.{way}" for kind in ("stiffness", "damping") for way in "xy"] for joint in JOINTS}
UNKNOWN = [*(Factor(joint, (f"joints.{joint}.stiffness.*",), 0.5 if k % 2 == 0 else 0.1, 2.0 if k % 2 == 0 else 10.0)
             for k, joint in enumerate(JOINTS)),  # floor and housing are known from the modes within a factor of two
           Factor("damping", ("joints.*.damping.*",), 0.2, 5.0), Factor("density", ("bodies.*.density",), 0.7, 1.4)]


def direct(machine: Any) -> Any:
    """Return the direct responses at the spindle nose in both planes."""
    return frequency_response.direct(assemble(machine, None, NOSE), LINES).values.diagonal(axis1=1, axis2=2)


def errors(machine: Any) -> dict[str, float]:
    """Return how far twice the springs and dampers of each interface move the direct responses, relative (mean of planes)."""
    now, twice = direct(machine), {joint: {path: 2 * machine.value(path) for path in PATHS[joint]} for joint in JOINTS}
    return {joint: float(np.mean(np.abs(direct(machine.with_values(values)) - now).sum(0) / np.abs(now).sum(0)))
            for joint, values in twice.items()}


def judge(machine: Any) -> dict[str, bool]:
    """Return which conclusions of the source hold for a mill."""
    floor, bolts, housing, slide = errors(machine).values()
    return {"springs_matter": min(floor, housing) > max(bolts, slide), "springs_nothing": max(bolts, slide) < 0.05}


def at_published_modes(machine: Any) -> Any:
    """Return the mill whose floor and housing give 13 and 64 Hz in both planes, damped by some 2 and 10 %."""
    def changed(logarithms: Any) -> Any:
        return machine.with_values({path: float(np.exp(size)) * (0.0005 if ".damping." in path else 1)
                                    for joint, size in zip(JOINTS[::2], logarithms, strict=True) for path in PATHS[joint]})
    return changed(least_squares(lambda x: solve_modes(changed(x), None, 4).frequency[::2] - (13, 64), np.log([6e6, 2e7])).x)


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "small_mill_springs.yaml") as path:
        machine = read_machine(path)
    truth = at_published_modes(machine)
    test = Measurement(frf=frequency_response.direct(assemble(truth, None, NOSE), LINES))
    result = update_machine(machine, [test], [path for paths in PATHS.values() for path in paths])
    numbers: dict[str, Any] = {"springs_moved": len(result.update.fit.free)} | {
        f"springs_start{k}": f for k, f in enumerate(solve_modes(machine, None, 4).frequency[::2], 1)}
    for when, agreement in (("before", result.update.before), ("after", result.update.after)):
        numbers |= {f"springs_{when}_{p}": f for p, f in zip(("xz", "yz"), np.diagonal(agreement.frac), strict=True)}
    numbers |= {f"springs_{joint}": truth.value(PATHS[joint][0]) for joint in JOINTS[::2]} | {
        f"springs_change_{joint}": 100 * value for joint, value in errors(truth).items()}
    return numbers | draw_conclusions(truth, UNKNOWN, judge, draws=draws, rng=np.random.default_rng(1)).summary()


if __name__ == "__main__":
    print(main())
