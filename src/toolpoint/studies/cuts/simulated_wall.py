"""Wall that a simulated cut leaves: profile along the feed, its roughness, waviness and form by lifting, its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.cutting.surface.filters import Separation, gaussian, separate, two_stage_rc
from toolpoint.cutting.surface.location import wall_side
from toolpoint.cutting.surface.roughness import profile_parameters
from toolpoint.cutting.surface.topography import dynamic_wall

WALL_FEEDS = 40  # feeds of a revolution along the wall
WALL_POINTS = 4001  # along it
SHOWN_PARAMETERS = ("Ra", "Rq", "Rz", "Rt")
RUN_UP_CUTOFFS = 2  # of a 2RC filter, from its start
# Wavelengths in feeds of a revolution: marks of teeth and run-out below, form above.
ROUGHNESS_FEEDS, FORM_FEEDS = 2.5, 10.0


@dataclass(frozen=True, eq=False)
class SimulatedWall:
    """Wall at the tool's tip.

    side : of the cut, ``exit`` or ``entry``; place, profile : (n,) m, along the feed and height of the material left (positive:
    undercut); parts : roughness, waviness and form, whose sum is the profile; parameters : Ra, Rz .. of the roughness, m;
    filtered : the same of the roughness by other filters of the same cutoff, as an instrument shows it; location_error : mean
    height over the ideal wall, m.
    """

    side: str
    place: FloatArray
    profile: FloatArray
    parts: Separation
    parameters: Mapping[str, float]
    filtered: Mapping[str, Mapping[str, float]]

    @property
    def location_error(self) -> float:
        """Mean height of the profile over the ideal wall, m: positive where material is left."""
        return float(self.profile.mean())

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value) of the wall."""
        ra, rz = (1e6 * self.parameters[name] for name in ("Ra", "Rz"))
        waviness = 1e6 * float(np.ptp(self.parts.waviness))
        return [("wall, mean height left", f"{1e6 * self.location_error:+.2f} µm"),
                ("wall, roughness Ra / Rz", f"{ra:.3f} / {rz:.3f} µm"), ("wall, waviness, peak to peak", f"{waviness:.3f} µm")]

    def to_dict(self) -> dict[str, Any]:
        """Return side, mean height, parameters and limits of the bands as plain data, m."""
        return {"side": self.side, "mean_height_m": self.location_error,
                "parameters_m": _chosen(self.parameters),
                "filtered_m": {name: _chosen(parameters) for name, parameters in self.filtered.items()},
                "band_limits_m": list(self.parts.limits), "waviness_m": float(np.ptp(self.parts.waviness))}


def _chosen(parameters: Mapping[str, float]) -> dict[str, float]:
    return {name: parameters[name] for name in SHOWN_PARAMETERS}


def measure_wall(run: Simulation) -> SimulatedWall | None:
    """Return the wall that the last revolutions of a simulated cut leave; None where it leaves none, or was stopped.

    Vibration of the later half of the kept revolutions is repeated along the wall.
    """
    side = wall_side(run.problem.engagement)
    if side is None or run.status != "complete":
        return None
    feed = run.problem.feed_per_tooth * run.problem.tool.teeth
    wall = dynamic_wall(run, WALL_FEEDS * feed, points=WALL_POINTS, side=side)
    spacing = float(wall.x[1] - wall.x[0])
    parts = separate(wall.profile, spacing, ROUGHNESS_FEEDS * feed, form_above=FORM_FEEDS * feed)
    return SimulatedWall(side, wall.x, wall.profile, parts, profile_parameters(parts.roughness, spacing),
                         _by_other_filters(wall.profile, spacing, parts.limits[0]))


def _by_other_filters(profile: FloatArray, spacing: float, cutoff: float) -> dict[str, dict[str, float]]:
    """Return the roughness parameters as an instrument with a Gaussian or a 2RC filter of the same cutoff shows them."""
    run_up = int(np.ceil(RUN_UP_CUTOFFS * cutoff / spacing))
    roughness = {"Gaussian (ISO 16610-21)": profile - gaussian(profile, spacing, cutoff),
                 "2RC (ISO 3274)": (profile - two_stage_rc(profile, spacing, cutoff))[run_up:]}
    return {name: profile_parameters(each, spacing) for name, each in roughness.items()}
