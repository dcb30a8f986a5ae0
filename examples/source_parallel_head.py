"""The parallel head of its source: kinematics, frequencies over its planes, responses over -30 .. 30 degrees, drawn springs."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.kinematics.three_rps import ThreeRps
from toolpoint.studies import Factor, draw_conclusions, map_frequencies, study_sensitivity
from toolpoint.studies.machines.tool_point import tool_point

TILTS, LINES = np.arange(-30, 31, 5), np.linspace(5, 120, 461)  # deg, Hz
HOME, TILTED = ({"Z": -0.55, "tilt": 0.0, "azimuth": 0.0}, {"Z": -0.75, "tilt": np.pi / 6, "azimuth": 0.0})
UNKNOWN = [Factor(what, paths, 1 / 3, 3.0) for what, paths in {
    **{f"slide {way}": (f"joints.slide*.stiffness.{way}",) for way in ("x", "y", "z", "rx", "ry", "rz")},
    "spherical joints": ("joints.ball*.stiffness.*",), "limb modulus": ("bodies.limb*.modulus",),
    "frames": ("bodies.frame*.mass",), "platform": ("bodies.platform.mass", "bodies.platform.inertia.*")}.items()]


def greatest(head: Any, azimuth: float) -> Any:
    """Return the greatest receptance along v and u over the tilts at 750 mm, um/N, and its frequency, Hz, each (13, 2)."""
    poses = [{"Z": -0.75, "tilt": tilt, "azimuth": azimuth} for tilt in np.radians(TILTS)]
    size = np.abs(np.diagonal(tool_point(head, poses, LINES).frf.values, axis1=2, axis2=3)[..., :2])
    return 1e6 * size.max(axis=1), LINES[size.argmax(axis=1)]


def judge(head: Any) -> dict[str, bool]:
    """Return which conclusions of the source hold for a head."""
    (f1, f2), (g1, g2) = tool_point(head, [HOME, TILTED], LINES).modes.frequency[:, :2]
    (about_y, _), (about_x, peak) = greatest(head, np.pi / 2), greatest(head, 0.0)
    return {"pair": f2 / f1 - 1 < 1e-6, "split": g2 / g1 > 1.02, "near_29": abs(f1 / 29 - 1) < 0.15,
            "u_largest_at_home": about_y[:, 1].argmax() == 6, "v_largest_at_home": about_y[:, 0].argmax() == 6,
            "v_largest_near_minus_5": about_x[:, 0].argmax() in (4, 5),
            "u_frequency_monotonic": abs(np.sign(np.diff(peak[:, 1])).sum()) >= 11}


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        head = read_machine(folder / "three_rps_tested_head.yaml")
    legs = ThreeRps(0.35, 0.25).inverse(0.75, np.pi / 6, np.pi)
    grid = {"Z": [-0.75, -0.55], "tilt": np.radians([0, 15, 30]), "azimuth": np.radians([20, 140, 260])}
    plane = map_frequencies(head, grid, 6)
    response, share = tool_point(head, [HOME], LINES).frf.values[0, :, 0, 0], study_sensitivity(head, None, 6, pose=HOME)
    aside, legs_off = ThreeRps(0.35, 0.25).parasitic(np.pi / 6, 0.0), head.chain.positions(TILTED)[0] - legs
    numbers = {"legs_nm": 1e9 * np.abs(legs_off).max(), "aside_mm": 1e3 * abs(aside[0]),
               "condition": pose_condition(head.chain, HOME).actuation[0], "symmetry_hz": np.ptp(plane.frequency, axis=2).max(),
               "imaginary": 1e6 * np.abs(response.imag).max(), "real": 1e6 * np.abs(response.real).max(),
               "limbs": 200 * sum(v[0] for v in share.cumulative("modulus").values()),
               "joints": 200 * sum(v[0] for v in share.cumulative("stiffness").values())}
    numbers |= {f"f{z}_{t}_{k + 1}": plane.frequency[i, j, 0, k] for i, z in enumerate((750, 550))
                for j, t in enumerate((0, 15, 30)) for k in range(6)}
    for name, (size, at) in {"y": greatest(head, np.pi / 2), "x": greatest(head, 0.0)}.items():
        numbers |= {f"{way}{name}{t:+d}": size[i, k] for i, t in enumerate(TILTS) for k, way in enumerate("vu")}
        numbers |= {f"{way}{name}{t:+d}_hz": at[i, k] for i, t in enumerate(TILTS) for k, way in enumerate("vu")}
    drawn = draw_conclusions(head, UNKNOWN, judge, draws=draws, rng=np.random.default_rng(1))
    return {name: float(value) for name, value in numbers.items()} | drawn.summary()


if __name__ == "__main__":
    main()
