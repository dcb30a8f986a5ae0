"""PlaneDynamics: the response between tool and work in the cutting plane (or space), from Modes or from a measured Frf."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import Array, BoolArray, ComplexArray, FloatArray, ToolpointWarning, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.interpolation import interpolate
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.dof import dofs as as_dofs
from toolpoint.vibration.frequency_response import modal

Label = Dof | str | int | None
RESIDUAL_FREQUENCY_RATIO = 4.0  # of the highest mode: frequency of the mode that stands for an upper residual
RESIDUAL_DAMPING_RATIO = 0.9  # of that mode: static below, gone above, without a resonance
NEGLIGIBLE_RESIDUAL_FRACTION = 1e-6  # of the response: a smaller lower residual is not mentioned
WARNED_RESIDUAL_FRACTION = 0.02  # of the response: a larger lower residual is warned of


@dataclass(frozen=True, eq=False)
class PlaneDynamics(NotebookText):
    r"""Receptance :math:`G(i\omega)` of the tool relative to the work in the feed frame (x feed, y normal to it, z the axis).

    Shape (2, 2), or (3, 3) where the response along z is known; d stands for 2 or 3.

    Either modal, :math:`G = \sum_r R_r/(i\omega - s_r) + R_r^*/(i\omega - s_r^*) + G_u`, or lines of a measured FRF. Structural
    damping has a response of its own (`response`), which no impulse response has: what marches in time takes the sum above,
    which is equal at the resonances.

    Parameters
    ----------
    poles : (n,) complex
        Upper poles, rad/s; empty for a measured FRF.
    residues : (n, d, d) complex
        m rad/(N s).
    static : (d, d) floats
        Receptance of the modes above the band (upper residual), m/N.
    frequency, values : (n_f,) floats and (n_f, d, d) complex, optional
        Hz and m/N of a measured FRF.
    variance : (n_f, d, d) floats, optional
        E|noise|^2 of the lines, (m/N)^2, where the measurement states it.
    draws : (n_draws, n_f, d, d) complex, optional
        Equally likely lines, m/N: they keep what the lines of an uncertain response have in common.
    notes : sequence of str
    structural : (n,) bools, optional
        Poles whose damping is structural.
    deviation : (m,) floats and (m, d, d) complex, optional
        Lines, Hz, and what the sum of the modes lacks there, m/N: of viscous and structural damping together.
    """

    poles: ComplexArray
    residues: ComplexArray
    static: FloatArray
    frequency: FloatArray | None = None
    values: ComplexArray | None = None
    notes: tuple[str, ...] = ()
    variance: FloatArray | None = None
    structural: BoolArray | None = None
    deviation: tuple[FloatArray, ComplexArray] | None = None
    draws: ComplexArray | None = None

    @property
    def is_modal(self) -> bool:
        """Whether poles and residues are known."""
        return self.frequency is None

    @property
    def lines(self) -> tuple[FloatArray, ComplexArray]:
        """Frequency, Hz, (n_f,), and values, m/N, (n_f, d, d), of a measured FRF; an error for modes."""
        if self.frequency is None or self.values is None:
            fail("dynamics", "modes", "must be a measured FRF here")
        return self.frequency, self.values

    @property
    def size(self) -> int:
        """Number of directions: 2, or 3 with the response along the tool's axis z."""
        return int(self.static.shape[0])

    @property
    def is_hysteretic(self) -> bool:
        """Whether the sum of the modes is only an equivalent of the response: there is structural damping."""
        return self.deviation is not None or (self.structural is not None and bool(self.structural.any()))

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Return G at these frequencies (Hz), shape (..., d, d): the cubic through four measured lines, zero outside them."""
        f = np.asarray(frequency, float)
        if self.frequency is None:
            causal = self.causal_response(f)
            return causal if not self.is_hysteretic else causal + self.hysteresis(f)
        inside = ((f >= self.frequency[0]) & (f <= self.frequency[-1]))[..., None, None]
        between = interpolate(self.frequency, self.lines[1], np.clip(f, self.frequency[0], self.frequency[-1]).ravel())
        return np.where(inside, between.reshape(*f.shape, *between.shape[1:]), 0)

    def every_other_line(self, first: int) -> PlaneDynamics:
        """Return a measured response with every other line alone, from the `first` (0 or 1) on."""
        kept = slice(first, None, 2)
        frequency, values = self.lines
        return replace(self, frequency=frequency[kept], values=values[kept], draws=None,
                       variance=None if self.variance is None else self.variance[kept])

    def causal_response(self, frequency: FloatArray) -> ComplexArray:
        """Return the sum of the modes at these frequencies (Hz), shape (..., d, d): what methods that march in time solve."""
        s = 2j * np.pi * np.asarray(frequency, float)[..., None]
        first = np.tensordot(1 / (s - self.poles), self.residues, 1)
        return np.asarray(first + np.tensordot(1 / (s - self.poles.conj()), self.residues.conj(), 1) + self.static, complex)

    def hysteresis(self, frequency: FloatArray) -> ComplexArray:
        r"""Return what the sum of the modes lacks of the response of structural damping, m/N, shape (..., d, d).

        At positive frequencies a structurally damped mode answers with :math:`R/(s - s_r) - R/(s + s_r)`; the sum has
        :math:`R^*/(s - s_r^*)` in place of the second term, whose pole no impulse response has. The difference is imaginary
        and largest at low frequencies, of the order of the loss factor times the static receptance.
        """
        f = np.asarray(frequency, float)
        size, shape = np.abs(f), (*f.shape, self.size, self.size)
        value = np.zeros(shape, complex)
        if self.deviation is not None:
            lines, lacking = self.deviation
            value = value + scipy.interpolate.CubicSpline(lines, lacking)(np.clip(size, lines[0], lines[-1])).reshape(shape)
        if self.structural is not None and self.structural.any():
            poles, residues = self.poles[self.structural], self.residues[self.structural]
            s = 2j * np.pi * size[..., None]
            value = value - np.tensordot(1 / (s + poles), residues, 1)
            value = value - np.tensordot(1 / (s - poles.conj()), residues.conj(), 1)
        turn = np.sign(f)[..., None, None]
        return np.where(turn < 0, value.conj(), np.where(turn == 0, value.real + 0j, value))

    def rotated(self, angle: float) -> PlaneDynamics:
        """Return the response in axes turned by `angle` (rad, from x towards y): the feed runs along the new x."""
        if angle == 0:
            return self
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(self.size)
        turn[:2, :2] = [[c, s], [-s, c]]
        values = None if self.values is None else turn @ self.values @ turn.T
        variance = None if self.variance is None else turn**2 @ self.variance @ turn.T**2
        deviation = None if self.deviation is None else (self.deviation[0], turn @ self.deviation[1] @ turn.T)
        draws = None if self.draws is None else turn @ self.draws @ turn.T
        return replace(self, residues=turn @ self.residues @ turn.T, static=turn @ self.static @ turn.T, values=values,
                       variance=variance, deviation=deviation, draws=draws)

    def at_draw(self, index: int) -> PlaneDynamics:
        """Return one of the equally likely responses, without an uncertainty of its own."""
        if self.draws is None:
            fail("at_draw", "no draws", "must be a response with draws")
        return replace(self, values=self.draws[index], variance=None, draws=None)

    def with_modal_residual(self) -> PlaneDynamics:
        r"""Return the response with its static part (upper residual) given by heavily damped modes far above the others.

        :math:`G_u \omega_h^2/(s^2 + 2 \zeta_h \omega_h s + \omega_h^2)`: static below, gone above, without a resonance.
        """
        if not np.abs(self.static).max(initial=0.0):
            return self
        omega_h = RESIDUAL_FREQUENCY_RATIO * float(np.abs(self.poles).max())
        damped = omega_h * np.sqrt(1 - RESIDUAL_DAMPING_RATIO**2)
        pole = -RESIDUAL_DAMPING_RATIO * omega_h + 1j * damped
        residue = (self.static * omega_h**2 / (2j * damped))[None]
        lag = np.degrees(np.arctan2(2 * RESIDUAL_DAMPING_RATIO / RESIDUAL_FREQUENCY_RATIO, 1 - RESIDUAL_FREQUENCY_RATIO**-2))
        note = (f"upper residual given by a mode at {omega_h / (2 * np.pi):.4g} Hz with a damping ratio of "
                f"{RESIDUAL_DAMPING_RATIO:g}: it has no place of its own in this method, and lags by {lag:.0f} degrees at the "
                "highest mode")
        structural = None if self.structural is None else np.append(self.structural, False)
        return replace(self, poles=np.append(self.poles, pole), residues=np.concatenate([self.residues, residue]),
                       static=np.zeros_like(self.static), notes=(*self.notes, note), structural=structural)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest frequency that matters, Hz: of the measured band, or of the poles."""
        if self.frequency is not None:
            return float(self.frequency[0]), float(self.frequency[-1])
        f = np.abs(self.poles) / (2 * np.pi)
        return float(f.min()), float(f.max())

    def __repr__(self) -> str:
        frequency_min, frequency_max = self.span
        kind = f"{self.poles.size} modes" if self.is_modal else f"measured, {self.lines[0].size} lines"
        return f"PlaneDynamics({kind}, {frequency_min:.4g}..{frequency_max:.4g} Hz)"


def from_modes(modes: Modes, x: Label, y: Label, *, z: Label = None) -> PlaneDynamics:
    """Return the plane dynamics of modes (one pose); `y` may be ``"same"`` or None where only x is known; with `z` the
    response has three directions."""
    if modes.frequency.ndim > 1:
        fail("dynamics", f"{modes.frequency.shape[0]} poses", "must be one pose",
             remedy="use at_pose(i) or stability.chart_poses")
    if modes.count == 0:
        fail("dynamics", "no modes", "must have at least one", remedy="a tool that does not vibrate is stable at every depth")
    if modes.is_rigid.any():
        fail("dynamics", "a rigid-body mode", "cutting needs a tool and work that are held",
             remedy="leave rigid-body modes out")
    if modes.scaling == "unscaled" and modes.participation is None:
        fail("dynamics", "unscaled mode shapes", "must carry a scale", remedy="identify with a driving point")
    if (modes.damping_ratio <= 0).any():
        fail("dynamics", f"damping ratio {modes.damping_ratio.min():g}", "must be above zero in every mode",
             remedy="without damping every depth is unstable at some speed")
    x, y, notes = _choose_labels(modes.dofs, x, y)
    notes = (*notes, *_without_lower_residual(modes))
    labels = (x, y) if z is None else (x, y, z)
    left = _signed(modes.shape, modes.dofs, labels, 0)
    right = left if modes.participation is None else _signed(modes.participation, modes.input_dofs, labels, 0)
    poles = modes.poles
    if modes.scaling == "unit modal mass":
        poles, factor, scaling_notes = _real_poles(modes)
        notes += scaling_notes
        left = left.astype(complex) * factor
    residues = np.einsum("im,jm->mij", left, right).astype(complex)
    single = (np.abs(poles.imag) <= 1e-9 * np.abs(poles)) & (modes.scaling != "unit modal mass")
    residues[single] /= 2  # the conjugate term doubles a real pole
    static = np.zeros((len(labels), len(labels))) if modes.upper_residual is None else _static(modes, labels)
    if y == "same":
        residues, static = _copy_x_to_y(residues), _copy_x_to_y(static)
    hysteretic = modes.damping == "structural" and modes.scaling == "unit modal mass"
    plane = PlaneDynamics(poles.astype(complex), residues, static.real.astype(float), notes=(*modes.notes, *notes),
                          structural=np.full(poles.size, hysteretic))
    return plane if modes.direct is None else replace(plane, deviation=_deviation(plane, from_frf(modes.direct, x, y, z=z)))


def _deviation(plane: PlaneDynamics, direct: PlaneDynamics) -> tuple[FloatArray, ComplexArray]:
    """Return lines (Hz) and what the sum of the modes lacks of a response there."""
    lines, values = direct.lines
    return lines, values - plane.causal_response(lines)


def _without_lower_residual(modes: Modes) -> tuple[str, ...]:
    """Return the note on a neglected lower residual; warn too where it is more than 2 % of the response.

    It stands for all below the measured band and goes with 1/f^2: without bound where the low harmonics of a cut are.
    """
    if modes.lower_residual is None:
        return ()
    lowest = float(modes.omega.min())
    response = np.abs(modal(modes, np.array([lowest / (2 * np.pi)])).values[0])
    share = float((np.abs(modes.lower_residual) / lowest**2).max() / max(float(response.max()), 1e-300))
    if share < NEGLIGIBLE_RESIDUAL_FRACTION:
        return ()
    note = f"the lower residual of the modes is left out: {100 * share:.2g} % of the response at {lowest / (2 * np.pi):.4g} Hz"
    if share > WARNED_RESIDUAL_FRACTION:
        note += "; measure to lower frequencies and identify the modes there"
        warnings.warn(note, ToolpointWarning, stacklevel=4)
    return (note,)


def _real_poles(modes: Modes) -> tuple[ComplexArray, ComplexArray, tuple[str, ...]]:
    zeta, w = np.asarray(modes.damping_ratio), np.asarray(modes.omega)
    notes: tuple[str, ...] = ()
    if modes.damping == "structural":
        # (w^2 (1 + 2 i zeta) - omega^2) vanishes at the pole itself, whatever the damping: exact at the resonance.
        pole = w * np.sqrt(1 + 2j * zeta)
        return 1j * pole, 1 / (2j * pole), ("structural damping replaced by viscous damping equal at each resonance",)
    # A critically damped mode is a double pole; nudged apart it is the difference of two close ones.
    zeta = np.where(np.abs(zeta - 1) < 1e-6, 1 - 1e-6, zeta)
    if (zeta > 1).any():
        fail("dynamics", f"an overdamped mode (damping ratio {zeta.max():g})", "must be below 1",
             remedy="give it as two real poles in 'modal A' scaling")
    wd = w * np.sqrt(1 - zeta**2)
    return (-zeta * w + 1j * wd).astype(complex), (1 / (2j * wd)).astype(complex), notes


def _copy_x_to_y(matrix: Array) -> Array:
    out = np.array(matrix)
    out[..., 1, 1], out[..., 0, 1], out[..., 1, 0] = out[..., 0, 0], 0, 0
    return out


def _static(modes: Modes, directions: tuple[Label, ...]) -> Array:
    inputs = modes.input_dofs or modes.dofs
    assert modes.upper_residual is not None
    rows = _signed(modes.upper_residual, modes.dofs, directions, 0)
    return _signed(rows, inputs, directions, 1)


def _signed(array: Array, labels: Sequence[Dof], directions: tuple[Label, ...], axis: int) -> Array:
    """Return rows (or columns) of x, y (and z); a label found only with the opposite sign is turned; a missing y is zero."""
    parts = []
    for label in directions:
        if label is None or label == "same":
            parts.append(np.zeros_like(np.take(array, 0, axis)))
            continue
        index, sign = _place(label, labels)
        parts.append(sign * np.take(array, index, axis))
    return np.stack(parts, axis)


def _place(label: Label, labels: Sequence[Dof]) -> tuple[int, float]:
    if isinstance(label, int) and not isinstance(label, bool):
        if not 0 <= label < len(labels):
            fail("dynamics", f"index {label}", f"must be within 0 .. {len(labels) - 1}")
        return label, 1.0
    dof = as_dofs([label])[0]  # type: ignore[list-item]
    turn = 1.0
    if dof.vector is None and dof.direction[0] == "-":
        dof, turn = Dof(dof.point, "+" + dof.direction[1:]), -1.0
    for index, candidate in enumerate(labels):
        if candidate == dof:
            return index, turn
        if candidate.vector is None and candidate.point == dof.point and candidate.direction == "-" + dof.direction[1:]:
            return index, -turn
    fail("dynamics", f"no {label}", "must be one of " + ", ".join(str(candidate) for candidate in labels[:8]))


def _choose_labels(labels: Sequence[Dof], x: Label, y: Label) -> tuple[Label, Label, tuple[str, ...]]:
    """Return the labels of x and y: the given ones, or the only point that has both, or the only Dof there is."""
    if x is None:
        along_x = [d for d in labels if d.vector is None and d.direction[1:] == "x"]
        if len(labels) == 1:
            x = labels[0]
        elif len(along_x) == 1:
            x = along_x[0]
            partner = [d for d in labels if d.point == along_x[0].point and d.direction[1:] == "y" and d.vector is None]
            y = partner[0] if y is None and partner else y
        else:
            fail("dynamics", f"{len(labels)} labels: " + ", ".join(str(label) for label in labels[:6]),
                 "the directions in the cutting plane are not plain", remedy="give x='point:+x', y='point:+y'")
    if y is None:
        return x, y, (f"response known along x ({x}) only; rigid along y",)
    if y == "same":
        return x, y, (f"response along y taken as that along x ({x}), no cross response",)
    return x, y, ()


def from_frf(frf: Frf, x: Label, y: Label, *, z: Label = None) -> PlaneDynamics:
    """Return the plane dynamics of a measured FRF (one pose), as receptance; `y` as in `from_modes`."""
    if frf.values.ndim > 3:
        fail("dynamics", f"{frf.values.shape[0]} poses", "must be one pose", remedy="use at_pose(i) or stability.chart_poses")
    if frf.frequency.size < 2:
        fail("dynamics", f"{frf.frequency.size} lines", "must be at least two")
    notes: tuple[str, ...] = ()
    if frf.quantity != "receptance" and frf.frequency[0] == 0:
        frf = frf.between(frf.frequency[1], frf.frequency[-1])
        notes = ("line at 0 Hz left out (integrated to receptance)",)
    frf = frf.converted_to("receptance")
    x, y, choice_notes = _choose_labels(frf.outputs, x, y)
    labels = (x, y) if z is None else (x, y, z)
    d = len(labels)
    if len(frf.outputs) == 1 == len(frf.inputs) and d == 2:  # one measurement between two points is taken as it is labelled
        def place(array: Array) -> Array:
            return array * np.eye(2)[0] * np.eye(2)[:, :1]
    else:
        def place(array: Array) -> Array:
            return _signed(_signed(array, frf.outputs, labels, -2), frf.inputs, labels, -1)
    values, variance, draws = (None if array is None else place(array) for array in (frf.values, frf.variance, frf.draws))
    variance = None if variance is None else np.abs(variance)
    if y == "same":
        values, variance, draws = (None if array is None else _copy_x_to_y(array) for array in (values, variance, draws))
    empty = np.zeros((0, d, d), complex)
    return PlaneDynamics(np.zeros(0, complex), empty, np.zeros((d, d)), floats("frequency", frf.frequency), values,
                         (*frf.notes, *notes, *choice_notes), variance, draws=draws)
