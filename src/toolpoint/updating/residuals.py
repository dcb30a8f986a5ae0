"""Residuals of a prediction against targets, with their Jacobian; measured and predicted modes are paired anew every time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from toolpoint._check import Array, BoolArray, ComplexArray, FloatArray, fail
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.models.prediction import Prediction, ShapeSlopes
from toolpoint.vibration import Frf, Modes, correlation

FREQUENCY_WEIGHT = 0.1  # beside a MAC of 0 to 1: a factor of two in frequency costs 0.07, so that shapes decide
SILENT_RESPONSE_RATIO = 1e-12  # of the largest response: below, a model's response is rounding


@dataclass(frozen=True, eq=False)
class Tracking:
    """Pairing of predicted with measured modes: `model` (n_measured,) indices and their `mac` values."""

    model: np.ndarray
    mac: FloatArray

    def doubtful(self, lowest: float) -> tuple[int, ...]:
        """Return the measured modes (from 0) whose partner has a MAC below `lowest`."""
        return tuple(int(i) for i in np.flatnonzero(self.mac < lowest))


def track_modes(measured: Modes, predicted: Modes, weight: float = FREQUENCY_WEIGHT) -> Tracking:
    """Return the one-to-one pairing with the largest sum of MAC - weight |ln(f/f_m)| (at most 3 weight).

    The shapes decide, so modes are followed through crossings; the frequency decides between shapes that look alike at
    the measured Dofs.
    """
    if predicted.count < measured.count:
        fail("modes", f"{predicted.count} predicted for {measured.count} measured", "must be at least as many",
             remedy="predict more modes, or select fewer measured ones")
    shapes = predicted.shape if predicted.dofs == measured.dofs else predicted.shape_at(measured.dofs)
    matrix = correlation.mac(measured.shape, shapes)
    shift = np.abs(np.log(measured.frequency[:, None] / np.maximum(predicted.frequency, 1e-12)))
    rows, columns = linear_sum_assignment(matrix - weight * np.minimum(shift, 3.0), maximize=True)
    return Tracking(columns[np.argsort(rows)], matrix[rows, columns][np.argsort(rows)])


@dataclass(frozen=True, eq=False)
class Residuals:
    """Weighted residuals (n,), their Jacobian (n, n_parameters) or None, a block name per row, the tracking of modes and the
    predictions of every set of targets."""

    values: FloatArray
    jacobian: FloatArray | None
    blocks: tuple[tuple[str, int], ...]
    trackings: tuple[Tracking | None, ...]
    predictions: tuple[Prediction, ...] = ()

    def chi_square(self) -> dict[str, tuple[float, int]]:
        """Return the sum of squares and the number of residuals of every block."""
        result, partners = {}, 0
        for name, size in self.blocks:
            result[name] = (float((self.values[partners:partners + size] ** 2).sum()), size)
            partners += size
        return result


def join_residuals(parts: Sequence[Residuals], predictions: tuple[Prediction, ...]) -> Residuals:
    """Return the residuals of several sets of targets below each other, blocks named by their set where there are several."""
    # Derivatives have done their work in the Jacobian; kept, they would fill the memory that the next point needs.
    predictions = tuple(Prediction(p.modes, p.frf) for p in predictions)
    if len(parts) == 1:
        return replace(parts[0], predictions=predictions)
    jacobians = [part.jacobian for part in parts if part.jacobian is not None]
    blocks = tuple((f"set {k + 1} {name}", size) for k, part in enumerate(parts) for name, size in part.blocks)
    return Residuals(
        np.concatenate([part.values for part in parts]),
        np.concatenate(jacobians) if len(jacobians) == len(parts) else None,
        blocks, tuple(t for part in parts for t in part.trackings), predictions)


Block = tuple[str, FloatArray, FloatArray | None]


class Weighting:
    """Targets with their whitening worked out once."""

    def __init__(self, targets: Targets, frequency_weight: float = FREQUENCY_WEIGHT) -> None:
        self.targets, self.frequency_weight = targets, frequency_weight
        if targets.modes is not None:
            self.poles = targets.pole_whitening()
            length = np.linalg.norm(targets.modes.shape, axis=0)
            self.unit_shape = targets.modes.shape / length
            self.shape_sd, self.shape_whitening = targets.shape_deviation(), targets.shape_whitening()
        if targets.frf is not None:
            self.frf_sd = targets.frf_deviation()
            self.whitening = targets.frf_whitening()

    def residuals(self, prediction: Prediction) -> Residuals:
        """Return the weighted residuals of a prediction, with the Jacobian where it carries derivatives."""
        parts: list[Block] = []
        tracking = None
        if self.targets.modes is not None:
            tracking = self._modes(prediction, parts)
        if self.targets.frf is not None:
            parts.append(self._frf(prediction))
        jacobians = [j for _, _, j in parts if j is not None]
        jacobian = np.concatenate(jacobians) if len(jacobians) == len(parts) else None
        return Residuals(np.concatenate([r for _, r, _ in parts]), jacobian,
                         tuple((name, r.size) for name, r, _ in parts), (tracking,))

    def _modes(self, prediction: Prediction, parts: list[Block]) -> Tracking:
        if prediction.modes is None:
            fail("model", "a prediction without modes", "must predict them for measured modes")
        assert self.targets.modes is not None
        tracking = track_modes(self.targets.modes, prediction.modes, self.frequency_weight)
        if self.targets.frequency or self.targets.damping:
            parts += self._poles(prediction, tracking.model)
        if self.targets.shape or self.targets.mac:
            parts += self._shapes(prediction, tracking.model)
        return tracking

    def _poles(self, prediction: Prediction, partners: np.ndarray) -> list[Block]:
        measured, modes, white = self.targets.modes, prediction.modes, self.poles
        assert measured is not None and modes is not None
        frequency = modes.frequency[partners]
        damping, damping_slope = self.targets.damping_residual(modes.damping_ratio[partners])
        pair = np.stack([np.log(frequency / measured.frequency), damping])
        values = np.einsum("rab,br->ar", white, pair)
        slopes = None
        if prediction.frequency_slopes is not None and prediction.damping_slopes is not None:
            change = np.stack([prediction.frequency_slopes.T[partners] / frequency[:, None],
                               prediction.damping_slopes.T[partners] * damping_slope[:, None]])
            slopes = np.einsum("rab,brp->arp", white, change)
        used = [(k, name) for k, (name, on) in enumerate(
            (("frequency", self.targets.frequency), ("damping", self.targets.damping))) if on]
        return [(name, values[k], None if slopes is None else slopes[k]) for k, name in used]

    def _shapes(self, prediction: Prediction, partners: np.ndarray) -> list[Block]:
        modes, y = prediction.modes, self.unit_shape
        assert modes is not None and self.targets.modes is not None
        rows = [modes.dofs.index(d) for d in self.targets.dofs] if modes.dofs != self.targets.dofs else slice(None)
        phi = modes.shape[rows][:, partners]
        power, product = (np.abs(phi) ** 2).sum(axis=0), (phi.conj() * y).sum(axis=0)
        factor = product / power
        turned = None
        if prediction.shape_slopes is not None:
            turned = _Turned(prediction.shape_slopes, modes.shape, rows, partners, phi, y, power)
        result: list[Block] = []
        if self.targets.shape:
            slopes = None if turned is None else _real_rows(self._whitened(turned.scaled(factor)), y)
            result.append(("shape", _real_rows(self._whitened(factor * phi - y), y), slopes))
        if self.targets.mac:
            value, slopes = np.abs(product) ** 2 / power, None
            if turned is not None:
                change = 2 * np.real(product.conj()[:, None] * turned.product) / power[:, None]
                slopes = (value[:, None] * turned.growth - change) / self.targets.mac_sd
            result.append(("mac", (1 - value) / self.targets.mac_sd, slopes))
        return result

    def _whitened(self, shapes: Array) -> Array:
        """Return deviations of shapes, (n_dofs, n_modes, ...), made independent of unit variance."""
        if self.shape_whitening is None:
            return shapes / self.shape_sd.reshape(self.shape_sd.shape + (1,) * (shapes.ndim - 2))
        return np.asarray(np.einsum("rab,br...->ar...", self.shape_whitening, shapes))

    def _frf(self, prediction: Prediction) -> Block:
        measured, frf = self.targets.frf, prediction.frf
        if frf is None or measured is None or frf.values.shape != measured.values.shape:
            fail("model", f"a prediction of {frf!r}", f"must be at the lines and Dofs of {measured!r}")
        slopes = prediction.frf_slopes
        silent = silent_responses(frf)
        if silent.any():  # nothing that is moved changes them: they hold no information, and no logarithm
            ones = np.where(silent, 1.0, frf.values)
            frf, measured = replace(frf, values=ones), replace(measured, values=np.where(silent, 1.0, measured.values))
            slopes = None if slopes is None else slopes * ~silent
        if self.targets.frf_kind == "log":
            sd = self.frf_sd / np.maximum(np.abs(measured.values), 1e-300)
            used = (frf.values != 0) & (measured.values != 0)  # a line that is exactly zero has no logarithm
            ratio = np.where(used, frf.values, 1.0) / np.where(used, measured.values, 1.0)
            difference: ComplexArray = np.asarray(np.log(ratio) / sd, complex)
            per_value = np.where(used, 1.0, 0.0) / (np.where(used, frf.values, 1.0) * sd)
            slopes = None if slopes is None else slopes * per_value
            # Errors of the logarithm are those of the response turned back by its phase.
            turn = None if self.whitening is None else np.exp(1j * np.angle(measured.values))
        else:
            difference, turn = (frf.values - measured.values) / self.frf_sd, None
            slopes = None if slopes is None else slopes / self.frf_sd
        if self.whitening is not None:
            difference = self.whitening.applied(difference if turn is None else difference * turn)
            if slopes is not None:
                slopes = self.whitening.applied(slopes if turn is None else slopes * turn)
        values = np.concatenate([difference.real.ravel(), difference.imag.ravel()])
        if slopes is None:
            return "frf", values, None
        flat = slopes.reshape(len(slopes), -1).T
        return "frf", values, np.concatenate([flat.real, flat.imag])


def silent_responses(frf: Frf) -> BoolArray:
    """Return which responses (n_outputs, n_inputs) a model makes zero: within rounding of the largest, at all lines."""
    size = np.abs(frf.values).max(axis=-3)
    return np.asarray(size <= SILENT_RESPONSE_RATIO * size.max())


class _Turned:
    """Derivatives of paired shapes: growth (m, p) of phi^H phi over it, product (m, p) of phi^H y."""

    def __init__(self, slopes: Array | ShapeSlopes, shapes: Array, rows: list[int] | slice, partners: np.ndarray, phi: Array,
                 y: Array, power: FloatArray) -> None:
        known_slopes = slopes if isinstance(slopes, ShapeSlopes) else ShapeSlopes.of(slopes, shapes)
        self.basis, self.power = known_slopes.basis[rows], power
        self.turns = np.ascontiguousarray(known_slopes.turns[:, partners])
        self.coordinates = known_slopes.coordinates_of(partners)
        self.growth = np.real(np.einsum("im,imp->mp", 2 * (self.basis.T @ phi.conj()) / power, self.turns))
        self.product = np.einsum("im,imp->mp", self.basis.T @ y, self.turns.conj())

    def scaled(self, factor: Array) -> Array:
        """Return the derivative (n_dofs, m, p) of factor phi, factor = phi^H y / phi^H phi."""
        change = self.product / self.power[:, None] - factor[:, None] * self.growth
        moved = self.turns * factor[:, None] + self.coordinates[:, :, None] * change
        return np.asarray((self.basis @ moved.reshape(len(moved), -1)).reshape(len(self.basis), *moved.shape[1:]))


def _real_rows(array: Array, measured: Array) -> FloatArray:
    """Return rows of real numbers: (dofs, modes) flattened, real and imaginary part of complex shapes below each other.

    array : (n_dofs, n_modes), or (n_dofs, n_modes, n_parameters) for rows (2 n_dofs n_modes, n_parameters).
    """
    flat = array.reshape(-1, *array.shape[2:])
    if not np.iscomplexobj(measured):
        return np.asarray(flat.real)
    return np.concatenate([flat.real, flat.imag]) * np.sqrt(2.0)
