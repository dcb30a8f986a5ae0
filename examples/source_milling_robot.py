"""The milling robot of its source: gear ratios, base forces, even region, real-part lobes of the responses, cutting forces."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_datasheet, read_machine, read_robot_machine
from toolpoint.studies import plane_directions, search_regions, study_datasheet
from toolpoint.studies.machines.reach import reach_places
from toolpoint.studies.machines.tool_point import tool_point

REGION = np.stack([np.full(5, 0.49), np.zeros(5), np.linspace(0.16, 0.36, 5)], axis=1)  # m, the wrist
LOADS = [(what, way) for what in ("force", "moment") for way in ("vertical", "horizontal")]
GRID = np.array([(x, 0.0, z) for x in np.arange(0.2, 0.6, 0.05) for z in np.arange(-0.3, 0.4, 0.05)])
LINES = np.arange(150, 2500.1, 0.25)  # Hz, as the source


def cut(angle: Any, depth: float) -> Any:
    """Return the forces (N) along the feed and across it of one tooth at angles, for a depth in mm (eqs. 17-20)."""
    tangential, normal = depth * (17.8 * np.sin(angle) + 9), depth * (5.93 * np.sin(angle) + 7)
    return np.stack([-np.cos(angle) * tangential - np.sin(angle) * normal, np.sin(angle) * tangential - np.cos(angle) * normal])


def lobes_of(response: Any) -> Any:
    """Return where the real part begins to be negative and comes back, Hz, and its least value there, m/N, (n, 3)."""
    sign = np.signbit(response.real).astype(int)
    down, up = np.flatnonzero(np.diff(sign) > 0) + 1, np.flatnonzero(np.diff(sign) < 0) + 1
    return np.array([(LINES[i], LINES[j], response.real[i:j].min()) for i in down for j in up[up > i][:1]]).reshape(-1, 3)


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    numbers: dict[str, Any] = {}
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        sheet, robot = folder / "milling_robot_datasheet.yaml", read_machine(folder / "milling_robot.yaml")
        study = study_datasheet(read_datasheet(sheet), read_robot_machine(sheet))
    for k, row in enumerate(study.gearing, 1):
        numbers |= {f"total{k}": row.total_ratio, f"reducer{k}": row.reducer_ratio, f"torque{k}": row.torque}
    for load in (study.rest_load, *study.stops):
        name = load.name.replace(" ", "").replace("+", "_")
        numbers |= {f"{name}_{what[0]}{way[0]}": getattr(load, f"{way}_{what}") for what, way in LOADS}
    place = search_regions(robot, REGION[:1], np.array([[0, 0, 1.0]]), point="wrist").best
    best = search_regions(robot, GRID, plane_directions([1, 0, 0], [0, 0, 1]), point="wrist").best
    numbers |= {"spread_hz": place.total, "even_hz": best.total, "even_x": 1e3 * best.start[0], "even_z": 1e3 * best.start[2],
                **{f"mode{k + 1}_hz": place.values[:, k].mean() for k in range(4)}}
    middle = reach_places(robot, REGION[2:3], point="wrist").poses[0]
    response = tool_point(robot, [middle or {}], LINES).frf.values[0]
    for k, way in enumerate("xyz"):
        lobes = lobes_of(response[:, k, k])
        numbers |= {f"lobes_{way}": len(lobes), f"lobe_{way}_hz": ", ".join(f"{v:.0f}" for v in lobes[:, 0]) or "none",
                    f"least_{way}": 1e6 * response[:, k, k].real.min()}
    numbers["depth_mm"] = 1e3 / (2 * 1780e6 * np.hypot(1, 593 / 1780) * -response[:, 2, 2].real.min())
    force = cut(np.linspace(0, np.pi, 2001), 1.0)
    numbers |= {f"force_{way}_{end}": getattr(force[k], end)() for k, way in enumerate("xy") for end in ("min", "max")}
    numbers |= {"largest_deg": 180 * force[1].argmax() / 2000, "turns_deg": 180 * (force[0] > 0).argmax() / 2000}
    return numbers


if __name__ == "__main__":
    print(main())
