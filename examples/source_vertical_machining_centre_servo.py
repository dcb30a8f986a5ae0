"""The servo of the machining centre's source: torque and contour error on lines and arcs, friction drawn."""

import warnings
from dataclasses import replace
from importlib import resources
from typing import Any

import numpy as np

from toolpoint import ToolpointWarning
from toolpoint.drives.program.path import polyline
from toolpoint.io import read_drives
from toolpoint.studies import run_drives

FEED, RADIUS = 4.0 / 60, 0.02  # m/s, published; m, chosen: the source does not print its path


def changed(drives: Any, inertia: float, coulomb: float, bristle: float) -> Any:
    """Return the drives with another inertia (kg m^2), Coulomb over static friction, and bristle stiffness."""
    axes = {}
    for name, axis in drives.axes.items():
        friction = replace(axis.friction, coulomb=coulomb * axis.friction.static, bristle_stiffness=bristle)
        axes[name] = replace(axis, mechanics=replace(axis.mechanics, inertia=inertia), friction=friction)
    return replace(drives, axes=axes)


def circle(drives: Any) -> dict[str, Any]:
    """Return what the source says of arcs, judged, with the numbers: cusps where an axis turns back."""
    run = run_drives(drives, circle=(RADIUS, FEED))
    peaks, torque = 1e6 * run.turn.peaks, run.result.signal("torque_set", "X")
    return {"deviation": 1e6 * run.circle.deviation, "peak_x": peaks[0], "peak_y": peaks[1], "torque": np.abs(torque).max(),
            "cusps": bool(peaks.min() > 2), "x_larger": bool(peaks[0] > peaks[1])}


def main(draws: int = 1) -> dict[str, Any]:
    """Return the numbers of the page, by name."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical_servo.yaml") as path:
        drives = read_drives(path)
    corner = polyline(np.array([[0, 0], [0.05, 0], [0.05, 0.05]]), FEED)
    rng, held = np.random.default_rng(1), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        run = run_drives(drives, path=corner)
        printed = circle(changed(drives, 0.01, 0.0115 / 4.7318, 4000.0))
        numbers = {"corner_um": 1e6 * run.errors["scale"].length.max(), **circle(drives)}
        numbers |= {f"printed_{name}": value for name, value in printed.items()}
        for _ in range(draws):
            share = 1 - np.exp(rng.uniform(np.log(0.05), np.log(0.9976)))  # of the static friction: 0.24 to 95 %
            held.append(circle(changed(drives, 0.003 * 10**rng.random(), share, 1e3 * 16**rng.random())))
    size = np.percentile([one["deviation"] for one in held], (5, 50, 95))
    numbers |= {f"deviation_p{p}": value for p, value in zip((5, 50, 95), size, strict=True)}
    numbers |= {f"holds_{name}": sum(one[name] for one in held) for name in ("cusps", "x_larger")}
    return {name: float(value) for name, value in numbers.items() if not isinstance(value, bool)} | {"servo_draws": draws}


if __name__ == "__main__":
    print(main())
