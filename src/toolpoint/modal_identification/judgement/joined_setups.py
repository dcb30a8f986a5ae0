r"""One set of modes from set-ups of sensors whose mass moved the frequencies, with that mass taken out.

In the coordinates of the bare modes (unit modal mass, shapes :math:`\Phi`, :math:`\Lambda = \mathrm{diag}\,\omega^2`), sensors
of mass m at the points of a set-up g give :math:`\Lambda x = \omega_g^2 (I + m\,\Phi_g^T \Phi_g)\,x` (Ewins, Modal Testing, 2nd
ed., section 3.11). The bare modes are those whose set-ups have the measured frequencies and residues, found by iteration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.judgement.complexity import real_modes
from toolpoint.modal_identification.judgement.repeated_modes import RepeatedModes
from toolpoint.modal_identification.scaling import scale_shapes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.modes import Modes

BARE_MODE_ITERATIONS = 20  # each reduces the error by about the mass ratio
MAX_UNEXPLAINED_SPREAD = 0.35  # of the spread of a mode over its set-ups, after their mass is taken out
CORRECTION_ERROR = 0.05  # of the correction, one standard deviation: modes outside the band, directions not measured
MAX_UNDOUBTED_SENSOR_SHIFT = 2e-3  # of a frequency, by one sensor, without a doubt


@dataclass(frozen=True, eq=False)
class JoinedModes:
    """Modes of all set-ups, the identified modes that each of them joins, and doubts about them."""

    modes: Modes
    members: tuple[tuple[int, ...], ...]
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]


def join_setups(modes: Modes, repeated: RepeatedModes, mass: float) -> JoinedModes:
    """Return every mode once; the mass (kg) of the sensors at all points of its set-up is taken out of scaled shapes.

    Where they have none, or the mass does not explain the frequencies, the highest frequency is kept, as of the set-up that
    moved it least, with an interval as wide as the set-ups differ, and a doubt.
    """
    in_groups = {k for member in repeated.members for k in member}
    members = tuple(sorted((*repeated.members, *((k,) for k in range(modes.count) if k not in in_groups))))
    joined = _join_modes(modes, repeated, members)
    # A rigid mass lowers frequencies, so the highest is nearest to the bare structure.
    spread = np.array([float(np.ptp(modes.frequency[list(member)])) for member in members])
    if joined.scaling == "unscaled":
        doubt = Doubt("sensor's mass", "no driving point gives the shapes a scale, so its mass cannot be taken out: "
                      "frequencies are those of the set-up that moved each least, too low still", "measure a driving point",
                      figure=float(np.max(spread / joined.frequency)))
        return JoinedModes(_widen_intervals(joined, spread), members, (doubt,), ())
    bare, scatter = _remove_mass(modes, repeated, members, joined, mass)
    unexplained = float(np.linalg.norm(scatter)) / max(float(np.linalg.norm(spread / joined.frequency)), 1e-300)
    if unexplained > MAX_UNEXPLAINED_SPREAD:
        doubt = Doubt("sensor's mass",
                      f"{1e3 * mass:.3g} g at every point of a set-up leave {100 * unexplained:.0f} % of what the "
                      "set-ups differ: frequencies are those of the set-up that moved each least", "check the mass, and which "
                      "points carried a sensor at once; else the structure itself has changed", figure=unexplained)
        return JoinedModes(_widen_intervals(joined, spread), members, (doubt,), ())
    change = bare.frequency - joined.frequency
    deviation = scatter * bare.frequency + CORRECTION_ERROR * np.abs(change)
    note = (f"the mass of {1e3 * mass:.3g} g at every point of each set-up is taken out of the modes: up to "
            f"{100 * float(np.abs(change / bare.frequency).max()):.2g} % of a frequency; directions that were not measured and "
            "modes outside the band are not in it")
    return JoinedModes(_widen_intervals(bare, deviation), members, (), (note,))


def question_sensor(modes: Modes, mass: float) -> list[Doubt]:
    """Doubt frequencies that one sensor of a mass (kg) moves, in a test where no set-up shows modes of its own."""
    scaled = real_modes(modes)
    if scaled.scaling != "unit modal mass":
        return []
    shifts = mass * (np.abs(scaled.shape) ** 2).max(axis=0) / 2
    mode = int(shifts.argmax())
    if shifts[mode] < MAX_UNDOUBTED_SENSOR_SHIFT:
        return []
    return [Doubt(f"mode {mode + 1} at {modes.frequency[mode]:.4g} Hz",
                  f"a sensor of {1e3 * mass:.3g} g lowers it by "
                  f"{100 * shifts[mode]:.2g} % where it moves most", "measure with a lighter sensor: no set-ups can be told "
                  "apart, so its mass is not taken out", figure=float(shifts[mode]))]


def _join_modes(modes: Modes, repeated: RepeatedModes, members: tuple[tuple[int, ...], ...]) -> Modes:
    """Return every mode once: the rows of each set-up from its own member, at the highest frequency."""
    shares = modes.participation
    assert shares is not None
    shape = np.zeros((len(modes.dofs), len(members)), complex)
    participation = np.zeros((len(modes.input_dofs), len(members)), complex)
    variance = None if modes.shape_variance is None else np.zeros(shape.shape)
    points, is_scaled = driving_points(modes.dofs, modes.input_dofs), True
    for place, member in enumerate(members):
        strongest = max(member, key=lambda k: float(np.abs(modes.shape[:, k]).max() * np.abs(shares[:, k]).max()))
        reference_shares = shares[:, strongest]
        for k in member:
            rows = slice(None) if len(member) == 1 else repeated.setup == repeated.setup_of_mode[k]
            ratio = np.vdot(reference_shares, shares[:, k]) / np.vdot(reference_shares, reference_shares)
            shape[rows, place] = modes.shape[rows, k] * ratio
            if variance is not None and modes.shape_variance is not None:
                variance[rows, place] = modes.shape_variance[rows, k] * abs(ratio) ** 2
        scaled, participation[:, place], usable = scale_shapes(shape[:, place], reference_shares, points)
        if variance is not None:
            variance[:, place] *= (np.abs(scaled).max() / max(float(np.abs(shape[:, place]).max()), 1e-300)) ** 2
        shape[:, place], is_scaled = scaled, is_scaled and usable
    highest = [member[-1] for member in members]
    damping = np.array([_mean_damping(modes, member) for member in members])
    covariance = None if modes.covariance is None else modes.covariance[highest]
    return Modes(modes.frequency[highest], damping, shape, modes.dofs, "modal A" if is_scaled else "unscaled",
                 participation=participation, input_dofs=modes.input_dofs, covariance=covariance, shape_variance=variance,
                 notes=modes.notes)


def _mean_damping(modes: Modes, member: tuple[int, ...]) -> float:
    """Return the mean damping ratio of the members of a mode, weighted by their variances."""
    ratios = modes.damping_ratio[list(member)]
    if modes.covariance is None:
        return float(ratios.mean())
    variance = np.maximum(modes.covariance[list(member), 1, 1], 1e-30)
    return float((ratios / variance).sum() / (1 / variance).sum())


def _remove_mass(modes: Modes, repeated: RepeatedModes, members: tuple[tuple[int, ...], ...], joined: Modes, mass: float
          ) -> tuple[Modes, FloatArray]:
    """Return the modes without the sensors, and the relative scatter of each frequency over its set-ups."""
    start = np.real(real_modes(joined).shape)
    shape, frequency = start.copy(), joined.frequency.copy()
    setups = np.unique(repeated.setup[repeated.setup >= 0])
    measured = np.full((setups.size, len(members)), np.nan)
    for place, member in enumerate(members):
        for k in member:
            rows_of_setup = slice(None) if repeated.setup_of_mode[k] < 0 else int(np.searchsorted(setups,
                                                                                                  repeated.setup_of_mode[k]))
            measured[rows_of_setup, place] = modes.frequency[k]
    reference = [point.row for point in driving_points(modes.dofs, modes.input_dofs)]
    error = np.zeros_like(measured)
    for _ in range(BARE_MODE_ITERATIONS):
        change = np.ones_like(shape)
        for row, setup in enumerate(setups):
            rows = repeated.setup == setup
            predicted, loaded = _add_mass(frequency, shape, rows, mass)
            error[row] = measured[row] / predicted - 1
            # Measured residues are those with the sensors: at the reference, too.
            gain = _reference_gain(loaded[reference], shape[reference])
            change[rows] = start[rows] / np.where(np.abs(loaded[rows]) > 0, loaded[rows] * gain, 1.0)
        reference_setup = repeated.setup[reference[0]]
        _, loaded = _add_mass(frequency, shape, repeated.setup == reference_setup, mass)
        change *= _reference_gain(loaded[reference], shape[reference])
        frequency = frequency * (1 + np.nanmean(error, axis=0))
        shape = shape * np.clip(change, 0.5, 2.0)
    in_several_setups = (~np.isnan(measured)).sum(axis=0) > 1
    scatter = np.where(in_several_setups, np.nanstd(error, axis=0), np.nanstd(error[:, in_several_setups])
                       if in_several_setups.any() else 0.0)
    factor = np.where(np.abs(start) > 0, shape / np.where(np.abs(start) > 0, start, 1.0), 1.0)
    return replace(joined, frequency=frequency, shape=joined.shape * factor), scatter


def _reference_gain(loaded: FloatArray, bare: FloatArray) -> FloatArray:
    """Return the factor by which the sensors change the participation of each mode at the reference."""
    return np.asarray((loaded * bare).sum(axis=0) / np.maximum((bare**2).sum(axis=0), 1e-300))


def _add_mass(frequency: FloatArray, shape: FloatArray, rows: np.ndarray, mass: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (Hz) and shapes of unit modal mass with a mass at some rows, in the order of the bare modes."""
    root = np.linalg.cholesky(np.eye(frequency.size) + mass * shape[rows].T @ shape[rows])
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse * (2 * np.pi * frequency) ** 2 @ inverse.T)
    order = np.argsort(np.argsort(frequency, kind="stable"), kind="stable")
    mixed = (inverse.T @ vectors)[:, order]
    return np.sqrt(values[order]) / (2 * np.pi), shape @ (mixed * np.sign(np.diagonal(mixed)))


def _widen_intervals(modes: Modes, deviation: FloatArray) -> Modes:
    """Return modes whose frequencies may be off by a deviation (Hz) more."""
    order = np.argsort(modes.frequency, kind="stable")
    if modes.covariance is None:
        return modes.selected(order.tolist())
    covariance = modes.covariance.copy()
    covariance[:, 0, 0] += deviation**2
    return replace(modes, covariance=covariance).selected(order.tolist())
