"""Residuals of a prediction against targets, with their Jacobian; measured and predicted modes are paired anew every time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from toolpoint._check import Array, FloatArray, fail
from toolpoint.updating.prediction import Prediction
from toolpoint.updating.targets import Targets
from toolpoint.vibration import Modes, correlation

FREQUENCY_WEIGHT = 0.1


@dataclass(frozen=True, eq=False)
class Tracking:
    """Which predicted mode belongs to each measured one: `model` (n_measured,) indices and their `mac` values."""

    model: np.ndarray
    mac: FloatArray

    def doubtful(self, lowest: float) -> tuple[int, ...]:
        """Return the measured modes (from 0) whose partner has a MAC below `lowest`."""
        return tuple(int(i) for i in np.flatnonzero(self.mac < lowest))


def tracked(measured: Modes, predicted: Modes, weight: float = FREQUENCY_WEIGHT) -> Tracking:
    """Return the one-to-one pairing with the largest sum of MAC - weight |ln(f/f_m)| (at most 3 weight).

    The shapes decide, so modes are followed through crossings; the frequency decides between shapes that look alike at
    the measured Dofs.
    """
    if predicted.count < measured.count:
        fail("modes", f"{predicted.count} predicted for {measured.count} measured", "must be at least as many",
             "predict more modes, or select fewer measured ones")
    shapes = predicted.shape if predicted.dofs == measured.dofs else predicted.shape_at(measured.dofs)
    matrix = correlation.mac(measured.shape, shapes)
    shift = np.abs(np.log(measured.frequency[:, None] / np.maximum(predicted.frequency, 1e-12)))
    rows, columns = linear_sum_assignment(matrix - weight * np.minimum(shift, 3.0), maximize=True)
    return Tracking(columns[np.argsort(rows)], matrix[rows, columns][np.argsort(rows)])


@dataclass(frozen=True, eq=False)
class Residuals:
    """Weighted residuals (n,), their Jacobian (n, n_numbers) or None, a block name per row, and the tracking of modes."""

    values: FloatArray
    jacobian: FloatArray | None
    blocks: tuple[tuple[str, int], ...]
    tracking: Tracking | None

    def chi_square(self) -> dict[str, tuple[float, int]]:
        """Return the sum of squares and the number of residuals of every block."""
        result, at = {}, 0
        for name, size in self.blocks:
            result[name] = (float((self.values[at:at + size] ** 2).sum()), size)
            at += size
        return result


class Weighting:
    """Targets with their whitening worked out once."""

    def __init__(self, targets: Targets, frequency_weight: float = FREQUENCY_WEIGHT) -> None:
        self.targets, self.frequency_weight = targets, frequency_weight
        if targets.modes is not None:
            self.poles = targets.pole_whitening()
            length = np.linalg.norm(targets.modes.shape, axis=0)
            self.unit_shape = targets.modes.shape / length
            self.shape_sd = targets.shape_deviation()
        if targets.frf is not None:
            self.frf_sd = targets.frf_deviation()

    def residuals(self, prediction: Prediction) -> Residuals:
        """Return the weighted residuals of a prediction, with the Jacobian where it carries derivatives."""
        parts: list[tuple[str, FloatArray, FloatArray | None]] = []
        tracking = None
        if self.targets.modes is not None:
            tracking = self._modes(prediction, parts)
        if self.targets.frf is not None:
            parts.append(self._frf(prediction))
        jacobian = None if any(j is None for _, _, j in parts) else np.concatenate([j for _, _, j in parts])  # type: ignore
        return Residuals(np.concatenate([r for _, r, _ in parts]), jacobian,
                         tuple((name, r.size) for name, r, _ in parts), tracking)

    def _modes(self, prediction: Prediction, parts: list[tuple[str, FloatArray, FloatArray | None]]) -> Tracking:
        if prediction.modes is None:
            fail("model", "a prediction without modes", "must predict them for measured modes")
        tracking = tracked(self.targets.modes, prediction.modes, self.frequency_weight)  # type: ignore[arg-type]
        if self.targets.frequency or self.targets.damping:
            parts += self._poles(prediction, tracking.model)
        if self.targets.shape or self.targets.mac:
            parts += self._shapes(prediction, tracking.model)
        return tracking

    def _poles(self, prediction: Prediction, at: np.ndarray) -> list[tuple[str, FloatArray, FloatArray | None]]:
        measured, modes, white = self.targets.modes, prediction.modes, self.poles
        assert measured is not None and modes is not None
        frequency = modes.frequency[at]
        damping, damping_slope = self.targets.damping_residual(modes.damping_ratio[at])
        pair = np.stack([np.log(frequency / measured.frequency), damping])
        values = np.einsum("rab,br->ar", white, pair)
        slopes = None
        if prediction.frequency_slopes is not None and prediction.damping_slopes is not None:
            change = np.stack([prediction.frequency_slopes[:, at] / frequency,
                               prediction.damping_slopes[:, at] * damping_slope])
            slopes = np.einsum("rab,bpr->arp", white, change)
        used = [(k, name) for k, (name, on) in enumerate(
            (("frequency", self.targets.frequency), ("damping", self.targets.damping))) if on]
        return [(name, values[k], None if slopes is None else slopes[k]) for k, name in used]

    def _shapes(self, prediction: Prediction, at: np.ndarray) -> list[tuple[str, FloatArray, FloatArray | None]]:
        modes, y = prediction.modes, self.unit_shape
        assert modes is not None and self.targets.modes is not None
        rows = [modes.dofs.index(d) for d in self.targets.dofs] if modes.dofs != self.targets.dofs else slice(None)
        phi = np.real(modes.shape[rows][:, at])
        power, product = (phi**2).sum(axis=0), (phi * y).sum(axis=0)
        turned = None if prediction.shape_slopes is None else prediction.shape_slopes[:, rows][..., at]
        result = []
        factor = product / power
        growth = None if turned is None else 2 * (turned * phi).sum(axis=1) / power
        change = None if turned is None else (turned * y).sum(axis=1)
        if self.targets.shape:
            slopes = None
            if turned is not None and growth is not None and change is not None:
                moved = (change / power - factor * growth)[:, None, :] * phi + factor * turned
                slopes = _real_rows(np.moveaxis(moved / self.shape_sd, 0, -1), y)
            result.append(("shape", _real_rows((factor * phi - y) / self.shape_sd, y), slopes))
        if self.targets.mac:
            value, slopes = np.abs(product) ** 2 / power, None
            if growth is not None and change is not None:
                slopes = -(2 * np.real(product.conj() * change) / power - value * growth).T / self.targets.mac_sd
            result.append(("mac", (1 - value) / self.targets.mac_sd, slopes))
        return result

    def _frf(self, prediction: Prediction) -> tuple[str, FloatArray, FloatArray | None]:
        measured, frf = self.targets.frf, prediction.frf
        if frf is None or measured is None or frf.values.shape != measured.values.shape:
            fail("model", f"a prediction of {frf!r}", f"must be at the lines and Dofs of {measured!r}")
        slopes = prediction.frf_slopes
        if self.targets.frf_kind == "log":
            sd = self.frf_sd / np.maximum(np.abs(measured.values), 1e-300)
            difference = np.log(frf.values / measured.values) / sd
            slopes = None if slopes is None else slopes / (frf.values * sd)
        else:
            difference = (frf.values - measured.values) / self.frf_sd
            slopes = None if slopes is None else slopes / self.frf_sd
        values = np.concatenate([difference.real.ravel(), difference.imag.ravel()])
        if slopes is None:
            return "frf", values, None
        flat = slopes.reshape(len(slopes), -1).T
        return "frf", values, np.concatenate([flat.real, flat.imag])


def _real_rows(array: Array, measured: Array) -> FloatArray:
    """Return rows of real numbers: (dofs, modes, ...) flattened, real and imaginary part of complex shapes below each other."""
    flat = array.reshape(-1, *array.shape[2:])
    if not np.iscomplexobj(measured):
        return np.asarray(flat.real)
    return np.concatenate([flat.real, flat.imag]) * np.sqrt(2.0)
