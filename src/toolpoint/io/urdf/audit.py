"""Doubts about the inertias of a robot: total mass, impossible moments, density over the hull, placeholders."""

from __future__ import annotations

import numpy as np
import scipy

from toolpoint._doubt import Doubt
from toolpoint.bodies.inertia import inertia_fault
from toolpoint.io.urdf.robot import UrdfLink, UrdfRobot

# Kg/m^3 over the hull; hollow castings are light, nothing of a robot is heavier than lead
HULL_DENSITY_RANGE = (200.0, 12000.0)
MOMENT_RATIO_RANGE = (0.02, 4.0)  # principal moment over that of the box around the hull, filled evenly


def question_inertias(robot: UrdfRobot, mass: float | None = None) -> list[Doubt]:
    """Return doubts about the inertias of a robot; `mass` (kg) is that of the whole by its catalogue."""
    moving = [link for link in robot.links.values() if link.mass is not None]
    lines = list[Doubt]()
    if mass is not None and abs(robot.mass / mass - 1) > 0.05:
        lines.append(Doubt("mass", f"the links weigh {robot.mass:.4g} kg together, {100 * (robot.mass / mass - 1):+.0f} % off "
                           f"the {mass:g} kg given", figure=abs(robot.mass / mass - 1)))
    for link in moving:
        lines += _link_doubts(link)
    tensors = [tuple(np.round(np.linalg.eigvalsh(link.inertia), 12)) for link in moving]
    equal_links = [link.name for link, tensor in zip(moving, tensors, strict=True) if tensors.count(tensor) > 1]
    if len(equal_links) > 2:
        lines.append(Doubt(f"links {', '.join(equal_links)}", "have the same inertia to the last digit: placeholders?"))
    return lines


def _link_doubts(link: UrdfLink) -> list[Doubt]:
    assert link.mass is not None
    moments = np.linalg.eigvalsh(link.inertia)
    lines, name = list[Doubt](), f"link {link.name}"
    fault = inertia_fault(link.inertia)
    if fault:
        lines.append(Doubt(name, fault))
    # Three equal round moments are what exporters and people write to make a simulator start: no body has them.
    if np.ptp(moments) < 1e-12 and any(np.isclose(moments[0], v) for v in (1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-6)):
        lines.append(Doubt(name, f"inertia {moments[0]:g} kg m^2 alike about all axes: a placeholder?"))
    if np.isclose(link.mass, 1.0, atol=1e-12) and np.ptp(moments) < 1e-12:
        lines.append(Doubt(name, "mass of exactly 1 kg with a round inertia: a placeholder?"))
    if len(link.corners) < 4:
        return lines
    try:
        hull = scipy.spatial.ConvexHull(link.corners)
    except scipy.spatial.QhullError:
        return lines
    density, span = link.mass / hull.volume, np.ptp(link.corners, axis=0)
    if not HULL_DENSITY_RANGE[0] < density < HULL_DENSITY_RANGE[1]:
        lines.append(Doubt(name, f"density {density:.3g} kg/m^3 over its hull; believed are {HULL_DENSITY_RANGE[0]:g} to "
                                 f"{HULL_DENSITY_RANGE[1]:g}"))
    # The centre of mass lies inside the convex hull, so inside the box of the mesh; else it is in another frame or unit.
    if (link.centre < link.corners.min(axis=0) - 1e-9).any() or (link.centre > link.corners.max(axis=0) + 1e-9).any():
        lines.append(Doubt(name, "its centre of mass lies outside of its shape"))
    box = np.sort(link.mass / 12 * (np.sum(span**2) - span**2))
    ratio = moments / box
    if ratio.min() < MOMENT_RATIO_RANGE[0] or ratio.max() > MOMENT_RATIO_RANGE[1]:
        lines.append(Doubt(name, f"principal moments {moments[0]:.3g} .. {moments[2]:.3g} kg m^2 against {box[0]:.3g} .. "
                           f"{box[2]:.3g} of a filled box around it", "check the unit (kg m^2, not kg mm^2) and the point they "
                           "are about"))
    return lines
