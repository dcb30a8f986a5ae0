r"""Gains of the directions of a moved sensor, estimated from the rigid motions of all components together.

Each direction of a sensor has one calibration error, the same at every point and in every mode. A point at :math:`p` of a
rigid component then shows

.. math:: u_{ir} = (1 + \gamma_{d(i)})\, d_i \cdot (v_r + w_r \times (p_i + \delta_i))

With :math:`J` the displacements by the twists, of one direction each, and :math:`Q` the weights of the displacements beside
all twists and offsets (eliminated with their prior), the gains are

.. math:: \gamma = (J^T Q J + I / s^2)^{-1} J^T Q u

with the covariance :math:`(J^T Q J + I / s^2)^{-1}` and the prior standard deviation s of a calibration (Gauss-Markov).
Rotations couple the directions, so that modes which turn the components determine the ratios of the gains. A gain common to all
directions looks like other motions: it belongs to the scale of the test, and is left out here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.point_places import weigh_motions
from toolpoint.vibration import Modes

ASSUMED_CALIBRATION_DEVIATION = 0.01  # of the calibration of a direction where none is stated: that of a usual certificate
MAX_CORRECTED_GAIN = 0.1  # of a gain from one: a larger one is a wrong entry, which is named and never corrected
MAX_GAIN_DEVIATIONS = 4.0  # stated ones, by which a gain may differ from one without a doubt
_MIN_AXIS_COSINE = 0.999  # cosine, from which a measured direction is one of the sensor's
_MAX_AXES_COSINE = 0.05  # of two directions of one sensor
_GAIN_ROUNDS = 4  # of gains and noise in turn
_AXIS_NAMES = "xyz"


@dataclass(frozen=True, eq=False)
class SensorGains:
    """Gains of the directions of a sensor.

    axes : (n, 3) unit directions; factors : (n,), measured over true displacement, without a factor common to all; covariance :
    (n, n) of their logarithms; deviation : prior standard deviation of each.
    """

    axes: FloatArray
    factors: FloatArray
    covariance: FloatArray
    deviation: float

    @property
    def root(self) -> FloatArray:
        """Columns (n, m), one for each independent combination of the gains, in standard deviations."""
        values, vectors = np.linalg.eigh(self.covariance)
        kept = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
        return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))

    @property
    def common_deviation(self) -> float:
        """Standard deviation of the gain that stays common to all responses: force, and mean of the directions."""
        return self.deviation * float(np.sqrt(1 + 1 / len(self.axes)))

    def rows(self, ways: FloatArray) -> FloatArray:
        """Return (n_rows, n): 1 where a measured direction is that of the gain, else 0."""
        return np.asarray(np.abs(ways @ self.axes.T) > _MIN_AXIS_COSINE, float)

    def errors_of(self, part: Component) -> FloatArray:
        """Return the change (n_rows, n, m) of a component's displacements by each independent combination of the gains."""
        return np.asarray((self.rows(part.ways) @ self.root)[:, :, None] * part.values[:, None])

    def corrected(self, modes: Modes) -> Modes:
        """Return modes with their shapes divided by the gains."""
        ways = np.array([dof.unit[:3] for dof in modes.dofs]).reshape(-1, 3)
        factors = np.exp(self.rows(ways) @ np.log(self.factors))
        variance = modes.shape_variance
        return replace(modes, shape=modes.shape / factors[:, None],
                       shape_variance=None if variance is None else variance / factors[:, None] ** 2)

    @property
    def doubts(self) -> list[Doubt]:
        """Doubt about the calibration where a gain differs from one by more than its stated deviation allows."""
        error = np.abs(np.log(self.factors))
        if (error <= MAX_GAIN_DEVIATIONS * np.sqrt(self.deviation**2 + np.diag(self.covariance))).all():
            return []
        return [Doubt("gains of the sensor's directions", f"{self._words()} by the rigid motions of the components, beyond the "
                      f"{100 * self.deviation:.2g} % of their calibration", "compare the sensitivity of each channel of the "
                      "moved sensor with its certificate", figure=float(error.max()))]

    @property
    def note(self) -> str:
        """Sentence on the gains and on what was done with them."""
        return (f"gains of the sensor's directions by the rigid motions (beside their mean): {self._words()}; shapes are "
                "corrected by them, and the intervals cover what is left open")

    def _words(self) -> str:
        half = NORMAL_QUANTILE_95 * self.factors * np.sqrt(np.diag(self.covariance))
        return ", ".join(f"{_name_of(axis)} {with_uncertainty(factor, width)}"
                         for axis, factor, width in zip(self.axes, self.factors, half, strict=True))


def fit_gains(parts: Mapping[str, Component], coordinate_deviation: float, calibration: float | None) -> SensorGains | None:
    """Return the gains of the sensor's directions; None where directions are not those of one sensor, or only one was measured.

    Parameters
    ----------
    parts : components at their stated places
    coordinate_deviation : float
        Standard deviation of each coordinate of the points, m.
    calibration : float, optional
        Stated standard deviation of a gain, as a share of it; `ASSUMED_CALIBRATION_DEVIATION` is taken where it is None.
    """
    deviation = ASSUMED_CALIBRATION_DEVIATION if calibration is None else calibration
    axes = _sensor_axes(np.concatenate([part.ways for part in parts.values()]))
    if axes is None or len(axes) < 2 or deviation <= 0:
        return None
    gains = SensorGains(axes, np.ones(len(axes)), deviation**2 * np.eye(len(axes)), deviation)
    noise = dict.fromkeys(parts, 1.0)
    for _ in range(_GAIN_ROUNDS):
        information, force = np.eye(len(axes)) / deviation**2, -np.log(gains.factors) / deviation**2
        for name, part in parts.items():
            corrected = _with_gains(part, gains)
            weights = weigh_motions(corrected, coordinate_deviation, noise[name])
            columns = gains.rows(part.ways).T[:, :, None] * weights.rigid
            weighted = np.array([weights.weigh(column) for column in columns])
            information += np.einsum("air,bir->ab", columns, weighted)
            force += np.einsum("air,ir->a", weighted, corrected.values)
            noise[name] *= weights.excess
        covariance = np.linalg.inv(information)
        change = covariance @ force
        factors = gains.factors * np.exp(change)
        gains = replace(gains, factors=factors / np.exp(np.log(factors).mean()), covariance=_without_mean(covariance))
        if np.abs(np.log(gains.factors)).max() > MAX_CORRECTED_GAIN:
            return None
    return gains


def _with_gains(part: Component, gains: SensorGains) -> Component:
    """Return a component with its displacements divided by the gains."""
    factors = np.exp(gains.rows(part.ways) @ np.log(gains.factors))[:, None]
    return replace(part, values=part.values / factors,
                   variance=None if part.variance is None else part.variance / factors**2)


def _without_mean(covariance: FloatArray) -> FloatArray:
    """Return the covariance of the gains beside their mean."""
    count = len(covariance)
    centring = np.eye(count) - np.ones((count, count)) / count
    return np.asarray(centring @ covariance @ centring)


def _sensor_axes(ways: FloatArray) -> FloatArray | None:
    """Return the directions (n, 3) of one sensor of up to three perpendicular ones; None for any other set of directions."""
    axes: list[FloatArray] = []
    for way in ways:
        if not any(abs(way @ axis) > _MIN_AXIS_COSINE for axis in axes):
            axes.append(way)
        if len(axes) > 3:
            return None
    found = np.array(axes).reshape(-1, 3)
    cosine = np.abs(found @ found.T - np.eye(len(found)))
    return found if (cosine < _MAX_AXES_COSINE).all() else None


def _name_of(axis: FloatArray) -> str:
    """Return the name of a direction."""
    place = int(np.argmax(np.abs(axis)))
    return _AXIS_NAMES[place] if abs(axis[place]) > _MIN_AXIS_COSINE else f"({', '.join(f'{value:.2f}' for value in axis)})"
