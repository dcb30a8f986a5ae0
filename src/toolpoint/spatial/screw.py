r"""Screws: the axis, pitch and size of a rigid motion. Source: Ball, A Treatise on the Theory of Screws, 1900."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, floats
from toolpoint._notebook import NotebookText


@dataclass(frozen=True, eq=False)
class Screw(NotebookText):
    """Axis of a rigid motion.

    Parameters
    ----------
    direction : (3,) floats
        Unit vector.
    point : (3,) floats
        Point of the axis nearest to the origin, m; zero for a pure translation.
    pitch : float
        Translation along the axis per rad, m/rad; infinite for a pure translation.
    magnitude : float
        Rotation in rad, or translation in m for a pure translation.

    Examples
    --------
    A turn of 0.5 rad about z, which rises by 0.1 m with it:

    >>> axis = screw([0, 0, 0.1, 0, 0, 0.5])
    >>> axis.direction.tolist(), axis.pitch, axis.magnitude
    ([0.0, 0.0, 1.0], 0.2, 0.5)
    """

    direction: FloatArray
    point: FloatArray
    pitch: float
    magnitude: float

    @property
    def twist(self) -> FloatArray:
        """Twist (v, w) about the origin, shape (6,)."""
        if np.isinf(self.pitch):
            return np.concatenate([self.direction * self.magnitude, np.zeros(3)])
        v = self.pitch * self.direction - np.cross(self.direction, self.point)
        return self.magnitude * np.concatenate([v, self.direction])

    def distance(self, point: ArrayLike) -> float:
        """Return the distance of a point from the axis, m."""
        offset = floats("point", point, (3,)) - self.point
        return float(np.linalg.norm(offset - self.direction * (offset @ self.direction)))

    def __repr__(self) -> str:
        d, p = (np.array2string(v, precision=4, suppress_small=True) for v in (self.direction, self.point))
        return f"Screw(direction {d}, through {p} m, pitch {self.pitch:.4g} m/rad, magnitude {self.magnitude:.4g})"


def screw(twist: ArrayLike, translation_below: float = 1e-12) -> Screw:
    r"""Return the screw of a twist (v, w) about the origin.

    :math:`u = w/|w|,\ p = w \times v/|w|^2,\ h = w \cdot v/|w|^2`; a motion with ``|w|`` below `translation_below` times
    ``|v|`` (1/m) is a pure translation.

    Examples
    --------
    >>> from toolpoint.spatial import screw
    >>> turn = screw([0.0, -0.5, 0.0, 0.0, 0.0, 1.0])  # rotation about z through x = 0.5 m
    >>> (turn.point + 0.0).tolist(), turn.pitch
    ([0.5, 0.0, 0.0], 0.0)
    """
    xi = floats("twist", twist, (6,))
    v, w = xi[:3], xi[3:]
    rotation, translation = float(np.linalg.norm(w)), float(np.linalg.norm(v))
    if rotation <= translation_below * translation or rotation == 0:
        unit = v / translation if translation > 0 else np.array([0.0, 0.0, 1.0])
        return Screw(unit, np.zeros(3), float("inf"), translation)
    return Screw(w / rotation, np.cross(w, v) / rotation**2, float(w @ v) / rotation**2, rotation)
