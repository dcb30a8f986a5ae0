"""Cutting as the thesis has it, on a tool of ours: coefficients from forces at its feeds, and the wall with its bands."""

from typing import Any

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.total_energy import TotalEnergy
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.cutting.surface.filters import separate
from toolpoint.cutting.surface.topography import static_wall
from toolpoint.studies import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

FEEDS = 1e-3 * np.array([0.0197, 0.0296, 0.0395, 0.0494, 0.0592, 0.0691, 0.0790, 0.0889])  # m a tooth, figures 6.12 to 6.19
RIGID = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
LABELS = tuple(Dof("tool", f"+{way}") for way in "xyz")
LAW, MATERIAL = TotalEnergy(9e8, 0.25, 0.4), CuttingCoefficients(7e8, 2e8)


def problem(feed: float, immersion: float) -> MillingProblem:
    """Return a rigid cut of a 16 mm tool with four teeth."""
    return MillingProblem(Tool(0.016, 4), Engagement.down(immersion), MATERIAL, RIGID, feed_per_tooth=feed)


def study(rng: np.random.Generator, law: TotalEnergy | None = None) -> Any:
    """Return the fit to forces at the thesis' feeds with 2 % noise, by the linear-edge or the total-energy law."""
    records, angle = [], 2 * np.pi * 50 * np.arange(4000) / 10000.0
    for feed in FEEDS:
        force = rigid_forces(problem(feed, 0.5), 2e-3, angle, law=law).force
        force = force + 0.02 * np.abs(force).max() * rng.standard_normal(force.shape)
        records.append((f"{1e3 * feed:.4f} mm", Record(force, 10000.0, LABELS, ("force",) * 3)))
    test = CuttingTest({"diameter": 0.016, "teeth": 4, "immersion": 0.5}, 3000.0, 2e-3, tuple(FEEDS), runout=False,
                       law="total-energy" if law else "linear-edge")
    return calibrate(records, test)


def calibrated(rng: np.random.Generator) -> Any:
    """Return coefficients of the linear-edge law over those put in, and numbers of the total-energy law over its own."""
    fit, law = study(rng).fit.coefficients, study(rng, LAW).energy.values[:3]
    return (fit.kt / 7e8, fit.kn / 2e8, *(law / np.array([LAW.energy, LAW.exponent, LAW.normal_ratio])))


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; a twentieth of `draws` of the noise of the forces."""
    rng = np.random.default_rng(1)
    fits = 100 * (np.array([calibrated(rng) for _ in range(max(draws // 20, 1))]) - 1)
    wall = static_wall(problem(FEEDS[-1], 0.1), 20 * FEEDS[-1], points=4001)
    parts = separate(wall.height[0], float(wall.x[1] - wall.x[0]), 2.5 * FEEDS[-1], form_above=10 * FEEDS[-1])
    left = np.abs(parts.roughness + parts.waviness + parts.form - wall.height[0]).max()
    return {"kt_percent": np.abs(fits[:, 0]).max(), "kr_percent": np.abs(fits[:, 1]).max(),
            "energy_percent": np.abs(fits[:, 2]).max(), "exponent_percent": np.abs(fits[:, 3]).max(),
            "ratio_percent": np.abs(fits[:, 4]).max(), "sum_nm": 1e9 * left,
            "scallop_nm": 1e9 * np.ptp(wall.height[0]), "by_formula_nm": 1e9 * FEEDS[-1] ** 2 / (8 * 0.008)}


if __name__ == "__main__":
    print(main())
