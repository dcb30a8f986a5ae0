"""Shapes of windows and bodies of a picture as Modes in the machine's axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray, fail, suggestion
from toolpoint.vibration import Dof, Modes
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.modes.bodies import BodyMotion
from toolpoint.vision.modes.projection import PointShapes
from toolpoint.vision.view import View

RIGID_NUMBERS = 3  # of a rigid motion in the plane of a picture: two translations and a rotation


def window_modes(poles: Modes, field: DisplacementField, shapes: PointShapes, *, view: View) -> Modes:
    """Return the modes at the measured directions of windows, metres where the view knows its scale, else pixels."""
    _, _, window, direction = field.measured()
    labels = field.record(view).channels
    factor = 1.0 if view.scale is None else view.scale
    shape = np.einsum("mi,mir->mr", direction, shapes.shape[window]) * factor
    trace = np.trace(shapes.basis.covariance, axis1=1, axis2=2)
    variance = np.einsum("mi,mij,mj->m", direction, shapes.covariance[window], direction)[:, None] * trace * factor**2
    return Modes(poles.frequency, poles.damping_ratio, shape, labels, "unscaled", covariance=poles.covariance,
                 shape_variance=variance)


def body_modes(poles: Modes, bodies: Sequence[BodyMotion], view: View, *, places: Mapping[str | int, tuple[str, FloatArray]]
               ) -> Modes:
    """Return the modes at places on bodies, (3,) in m, in both directions of the picture, metres."""
    bodies_by_name = {body.name: body for body in bodies}
    rows, variances, labels = [], [], []
    for name, (owner, place) in places.items():
        if owner not in bodies_by_name:
            fail("places", f"no body {owner!r} in the video", f"must be of {', '.join(bodies_by_name) or 'none'}",
                 remedy=suggestion(owner, list(bodies_by_name)))
        body = bodies_by_name[owner]
        if "unknown" in body.orders:
            continue
        pixel = view.project(np.asarray(place, float)[None])
        rows.append(body.shape_at(pixel)[0] * view.metres)
        variances.append((body.deviation_at(pixel)[0] * view.metres) ** 2)
        labels += [Dof(name, view.right), Dof(name, view.down)]
    if not rows:
        fail("places", "none on a body whose motion is known", "must be one at least", remedy="put texture on the bodies")
    return Modes(poles.frequency, poles.damping_ratio, np.concatenate(rows), tuple(labels), "unscaled",
                 covariance=poles.covariance, shape_variance=np.concatenate(variances))


def body_covariance(poles: Modes, bodies: Sequence[BodyMotion], view: View, *,
                    places: Mapping[str | int, tuple[str, FloatArray]], floor: float) -> FloatArray:
    """Return the covariance E[e e^H] of the shapes of `body_modes` at the same places, (n_modes, n_dofs, n_dofs), m^2.

    All places of a body move with its few coefficients, so their errors are common; bodies err independently.

    floor : deviation of a body's motion, over the root mean square of the shape at all places, that it has at least. It is
    that of the three numbers of a rigid motion, not of each place: it is spread over the rows of the body.
    """
    bodies_by_name = {body.name: body for body in bodies}
    by_body: dict[str, list[FloatArray]] = {}
    rows: dict[str, list[int]] = {}
    count = 0
    for owner, place in places.values():
        if "unknown" not in bodies_by_name[owner].orders:
            by_body.setdefault(owner, []).append(view.project(np.asarray(place, float)[None])[0])
            rows.setdefault(owner, []).extend((count, count + 1))
            count += 2
    power = (np.abs(body_modes(poles, bodies, view, places=places).shape) ** 2).mean(axis=0)
    result = np.zeros((poles.count, count, count))
    for owner, pixels in by_body.items():
        joint = bodies_by_name[owner].joint_covariance_at(np.array(pixels)) * view.metres**2
        floor_variance = floor**2 * max(1.0, len(rows[owner]) / RIGID_NUMBERS) * power
        joint += floor_variance[:, None, None] * np.eye(len(rows[owner]))
        place = np.array(rows[owner])
        result[:, place[:, None], place] = joint
    return result
