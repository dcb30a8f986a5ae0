"""Profiled-rail guideway: carriages with rolling elements at a contact angle, preloaded against each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._quantity import Quantity
from toolpoint.joints.rolling_contact import compliance_constant, contact_stiffness, spring_matrix

Place = tuple[Annotated[float, Quantity("length", "m")], ...]  # three coordinates
AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class GuidewayCarriage:
    """A carriage type: four rows of elements, two on either side of the rail, at a contact angle (X or O arrangement).

    `preload` is that of each row's contact force over the dynamic load rating (0.02 light to 0.13 heavy are usual classes);
    `elements` carry in each row at a time; `row_length` is the length over which they stand, `rows_across` and `rows_above` the
    distances of the rows across the rail and up; `roller_length` makes them rollers of that effective length.
    """

    dynamic_load: Annotated[float, Quantity("force", "N", above=0)]
    preload: Annotated[float, Quantity("ratio", "1", above=0, most=0.5)]
    elements: int
    element_diameter: Annotated[float, Quantity("length", "m", above=0)]
    row_length: Annotated[float, Quantity("length", "m", above=0)]
    rows_across: Annotated[float, Quantity("length", "m", above=0)]
    rows_above: Annotated[float, Quantity("length", "m", above=0)]
    contact_angle: Annotated[float, Quantity("angle", "rad", above=0, most=1.5)] = np.pi / 4
    arrangement: Literal["O", "X"] = "O"
    roller_length: Annotated[float, Quantity("length", "m", above=0)] | None = None

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the middle of the carriage: travel along x, y across the rail, z up; N/m, N m/rad.

        Only the rolling contacts deform: rail and carriage count as rigid, so a catalogue, which measures all, states less
        (often half). The linear stiffness holds while no element lifts off.
        """
        kind = "ball" if self.roller_length is None else "roller"
        constant = compliance_constant(kind, self.element_diameter, self.roller_length or 0.0)
        element_stiffness = contact_stiffness(kind, self.preload * self.dynamic_load / self.elements, constant)
        total = np.zeros((6, 6))
        positions = np.linspace(-0.5, 0.5, self.elements) * self.row_length if self.elements > 1 else np.zeros(1)
        sense = 1.0 if self.arrangement == "O" else -1.0
        for side in (-1, 1):
            for height in (-1, 1):
                normal = np.array([0.0, side * np.cos(self.contact_angle), sense * height * np.sin(self.contact_angle)])
                # Element by element, not a row as one spring: rows resist pitch and yaw by the spread of their elements.
                for position in positions:
                    contact_point = np.array([position, side * self.rows_across / 2, height * self.rows_above / 2])
                    total += spring_matrix(contact_point, normal, element_stiffness)
        return total


@dataclass(frozen=True)
class GuidewayDescription:
    """Carriages of one type at places in the joint's frame, travel along `along`, `up` away from the rail.

    `stiffness` of a catalogue in place of a carriage's geometry: `radial` (up), `lateral`, both N/m a carriage; then carriages
    hold no moments of their own, only by their distances.
    """

    at: tuple[Place, ...]
    along: Literal["x", "y", "z"] = "x"
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    carriage: GuidewayCarriage | None = None
    radial: Annotated[float, Quantity("stiffness", "N/m", above=0)] | None = None
    lateral: Annotated[float, Quantity("stiffness", "N/m", above=0)] | None = None

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the joint's frame; none along the travel."""
        if self.carriage is not None:
            single = self.carriage.stiffness
        else:
            single = np.diag([0.0, self.lateral or 0.0, self.radial or 0.0, 0.0, 0.0, 0.0])
        frame = np.zeros((3, 3))
        frame[AXES[self.along], 0] = 1.0
        frame[AXES[self.up[-1]], 2] = -1.0 if self.up[0] == "-" else 1.0
        frame[:, 1] = np.cross(frame[:, 2], frame[:, 0])
        return sum((move_stiffness(single, frame, np.array(place)) for place in self.at), np.zeros((6, 6)))


def move_stiffness(stiffness: FloatArray, rotation: FloatArray, place: FloatArray) -> FloatArray:
    """Return a stiffness (6, 6) given in a frame at a place, about the origin: A^T K A with the adjoint A of its inverse."""
    from toolpoint.spatial import transform as tf

    if np.shape(place) != (3,):
        fail("at", f"{np.size(place)} numbers", "must be three for every place")
    to_place = tf.adjoint(tf.inverse(tf.transform(rotation, place)))
    return to_place.T @ stiffness @ to_place
