r"""Doubts about responses of a tool's tip: whether a structure can have them, their direction, their units, their band.

All commands that cut on measured responses or on modes ask here: lobes, turn, mill, rcsa, report, tap. A grave doubt withholds
their advice. Single driving points are judged in `signals.driving_doubts`, which `frf`, `identify` and `update` ask too; this
module judges what holds for tips alone: their directions, stiffness, band of the softest modes, and sensor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.signals.driving_doubts import question_driving_point, question_shared_delay, select_lines
from toolpoint.signals.passivity import BandLines, active_matrix_share, find_peaks, look_outside
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.frequency_response import modal

TIP_STIFFNESS_RANGE = (2e5, 3e8)  # N/m, static, of tips of tools
GRAVITY_FACTOR = 9.80665  # of a response whose sensor's unit is g where m/s^2 was taken
TIP_MASS_RANGE = (2e-3, 2e3)  # kg, modal mass of the softest mode of a tip
OUTSIDE_DAMPING_RATIO = 0.02  # assumed of a mode outside the band
# of the band; of the largest response, from which it is large at the edge
TIP_EDGE_FRACTION, MIN_EDGE_RESPONSE_RATIO = 0.02, 0.7
MIN_CUT_OFF_RATIO = 1.2  # first believed over first measured line: below it, the band is as it was given
# least real part of lightly damped modes outside the band over the least one inside
MAX_SOFTNESS_ABOVE, MAX_SOFTNESS_BELOW = 1.0, 0.55
MAX_SENSOR_CHANGE, MAX_SENSOR_SHIFT = 0.05, 0.02  # of the least real part, of the largest peak's frequency, by a sensor's mass
MAX_ACTIVE_PAIRS = 0.05  # share of lines at which some mix of directions gives off power
# One direction in g: factor about 9.81 between the stiffnesses of x and y; distance of the logarithms of their largest peaks
MAX_GAIN_MISFIT, MAX_GAIN_FREQUENCY_DISTANCE = 1.3, 0.15
MODAL_LINES = 4000  # at which modes are judged
MODAL_NOISE = 0.02  # of a response of identified modes, as a share of it, and a tenth of that of the largest
WITHHELD = "withheld"


def question_tip(frf: Frf, *, names: Mapping[Dof, str] | None = None, sensor_mass: float | None = None,
                 measured_from: float | None = None) -> list[Doubt]:
    """Return the doubts about measured responses of a tip; each label that is output and input is a direction of it.

    Parameters
    ----------
    names : mapping of Dof to str, optional
        What the responses of a direction are called in the doubts.
    sensor_mass : float, optional
        kg, of the sensor that was on the tip while it was struck.
    measured_from : float, optional
        Hz, the lowest line that was measured, where lower ones than those given were left out as noise or drift.
    """
    called = names or {}
    doubts: list[Doubt] = []
    first = _first_omega(frf) if measured_from is None else 2 * np.pi * measured_from
    for dof in frf.outputs:
        if dof in frf.inputs:
            name = called.get(dof, str(dof))
            direct = frf.selected([dof], [dof])
            said = question_driving_point(direct, name)
            lines = select_lines(direct)
            # What is no driving point has no stiffness and no band to be judged.
            doubts += said or ([] if lines is None else [*_question_stiffness(name, lines),
                                                         *_question_band(name, lines, first)])
            if sensor_mass and lines is not None and not said:
                doubts += _question_sensor(name, lines, sensor_mass)
    return doubts or question_mixes(frf)


def question_modes(modes: Modes, labels: list[str], name: str) -> list[Doubt]:
    """Return the doubts about the modes of a tip: those about their response over all of them."""
    frequency = modes.frequency[modes.frequency > 0]
    if not frequency.size or modes.scaling == "unscaled":
        return []
    lines = np.linspace(0.3 * float(frequency.min()), 1.3 * float(frequency.max()), MODAL_LINES)
    response = modal(modes, lines).selected(labels, labels)
    size = np.abs(response.values)
    # A share of the line itself, as gains err, and of the largest, as a sensor's noise does not fall with the response.
    noise = MODAL_NOISE * (size + 0.1 * size.max(axis=0))
    frf = Frf(lines, response.values, response.outputs, response.inputs, "receptance", variance=noise**2)
    return [doubt.within(name) for doubt in question_tip(frf)]


def question_directions(ways: Mapping[str, Frf]) -> list[Doubt]:
    """Return the doubt that files given for x and y were measured along the other direction, by their labels."""
    along = {way: frf.outputs[0].direction[-1:] for way, frf in ways.items() if way in "xy" and frf.outputs[0].vector is None}
    if along.get("x") == "y" and along.get("y") == "x":
        return [Doubt("directions", f"what is given along x was measured along {ways['x'].outputs[0]}, and along y "
                      f"{ways['y'].outputs[0]}: x and y are exchanged", "change the files over, or correct the labels",
                      grave=True)]
    # a file without labels counts as measured along x: one label alone decides nothing
    plane = {way: frf for way, frf in ways.items() if way in "xy"}
    is_late = any(question_driving_point(frf) for frf in plane.values())
    return _question_gains(ways) or ([] if is_late else question_shared_delay(plane))


def _question_gains(ways: Mapping[str, Frf]) -> list[Doubt]:
    """Return the doubt that one of two directions was measured in g and taken for m/s^2: as soft as a tenth of the other at the
    same frequencies."""
    parts = {way: lines for way, frf in ways.items() if way in "xy" and (lines := select_lines(frf)) is not None}
    if len(parts) < 2:
        return []
    highest = {way: find_peaks(lines) for way, lines in parts.items()}
    if not all(highest.values()):
        return []
    peak = {way: max(peaks, key=lambda each: each.height).frequency for way, peaks in highest.items()}
    ratio = _static_stiffness(parts["y"]) / _static_stiffness(parts["x"])
    size = max(ratio, 1 / ratio) / GRAVITY_FACTOR
    if max(size, 1 / size) > MAX_GAIN_MISFIT or abs(np.log(peak["x"] / peak["y"])) > MAX_GAIN_FREQUENCY_DISTANCE:
        return []
    soft, stiff = ("x", "y") if ratio > 1 else ("y", "x")
    return [Doubt("directions", f"{soft} is {max(ratio, 1 / ratio):.3g} times as soft as {stiff}, with its largest peak near "
                  f"the other's at {peak[stiff]:.4g} Hz: g for m/s^2 in one of them makes 9.81",
                  "compare the sensitivities of both sensors and their units (mV/g, mV/(m/s^2))", figure=ratio)]


def gain_notes(frf: Frf) -> list[str]:
    """Return the remarks that a driving point's accelerance does not tell g from m/s^2, where its stiffness leaves that open.

    A factor of 9.81 moves limits as much, and leaves every other property of a response as it is.
    """
    notes = []
    for dof in (dof for dof in frf.outputs if dof in frf.inputs and frf.quantity == "accelerance"):
        lines = select_lines(frf.selected([dof], [dof]))
        stiffness = 0.0 if lines is None else _static_stiffness(lines)
        others = [stiffness * factor for factor in (GRAVITY_FACTOR, 1 / GRAVITY_FACTOR)
                  if TIP_STIFFNESS_RANGE[0] < stiffness * factor < TIP_STIFFNESS_RANGE[1]]
        if others:
            # Two digits: it is a tenth off that of the modes, which stands beside it in the result of `tap`.
            would_be = " or ".join(f"{value / 1e6:.2g}" for value in others)
            notes.append(f"{dof}: static stiffness {stiffness / 1e6:.2g} N/µm by what its lines lose; were g taken for m/s^2 "
                         f"it would be {would_be} N/µm, which tips have too, and limits 9.81 "
                         "times off: this response alone does not tell; a known mass that is struck does")
    return notes


def _first_omega(frf: Frf) -> float:
    return float(frf.omega[frf.omega > 0][0])


def _static_stiffness(lines: BandLines) -> float:
    """Return the static stiffness, N/m, by what is lost at all lines and what stays outside of them."""
    outside = look_outside(lines)
    # Lines below the noise lose nothing that is known: at the lowest ones the receptance of noise grows as 1/frequency^2.
    loss = np.maximum(-lines.receptance.imag, 0.0) * lines.is_loud
    inside = 2 / np.pi * float(np.trapezoid(loss / lines.omega, lines.omega))
    return 1 / max(inside + max(outside.above, 0.0) + max(outside.below, 0.0), 1e-300)


def _question_stiffness(name: str, lines: BandLines) -> list[Doubt]:
    """Doubt a static stiffness or a modal mass that no tip of a tool has."""
    peaks = find_peaks(lines)
    stiffness = _static_stiffness(lines)
    remedy = "check the sensitivities and their units (mV/N, mV/g, mV/(m/s^2)), and `quantity`"
    if not TIP_STIFFNESS_RANGE[0] < stiffness < TIP_STIFFNESS_RANGE[1]:
        return [Doubt(name, f"its static stiffness is {stiffness / 1e6:.3g} N/µm, which no tip of a tool has", remedy,
                      grave=True)]
    if peaks:
        peak = peaks[0]
        mass = 1 / (2 * peak.damping * peak.height * (2 * np.pi * peak.frequency) ** 2)
        if not TIP_MASS_RANGE[0] < mass < TIP_MASS_RANGE[1]:
            return [Doubt(name, f"its mode at {peak.frequency:.0f} Hz has a modal mass of {mass:.2g} kg at the tip, which no "
                          "tool has", remedy, grave=True)]
    return []


def _question_band(name: str, lines: BandLines, first_line: float) -> list[Doubt]:
    """Doubt a band that leaves out modes as soft as those in it; `first_line` (rad/s) of those that were measured."""
    omega, values = lines.omega, lines.receptance
    size = np.abs(values)
    frequency_min, frequency_max = float(omega[0]) / (2 * np.pi), float(omega[-1]) / (2 * np.pi)
    edge = max(3, round(TIP_EDGE_FRACTION * omega.size))
    last, largest = float(np.median(size[-edge:])), float(size.max())
    deepest = float(np.maximum(-values.real, 0.0).max())
    outside = look_outside(lines)
    above, below = (part / (4 * OUTSIDE_DAMPING_RATIO) / max(deepest, 1e-300) for part in (outside.above, outside.below))
    if last > MIN_EDGE_RESPONSE_RATIO * largest or above > MAX_SOFTNESS_ABOVE:
        return [_outside_doubt(name, f"above {frequency_max:.4g} Hz", max(outside.above, last), above,
                               "strike with a harder tip, sample faster, and give the whole band")]
    # Lines that noise takes away are not left out: charts carry their noise.
    if omega[0] < MIN_CUT_OFF_RATIO * first_line and below > MAX_SOFTNESS_BELOW:
        return [_outside_doubt(name, f"below {frequency_min:.4g} Hz", outside.below, below,
                               "strike harder with a softer tip, take longer records, and give the whole band")]
    return []


def _outside_doubt(name: str, where: str, softness: float, figure: float, remedy: str) -> Doubt:
    return Doubt(name, f"what vibrates {where} is as soft as {softness * 1e6:.2g} µm/N or softer: it may chatter before any "
                 "mode that was seen", remedy, figure=figure, grave=True)


def _question_sensor(name: str, lines: BandLines, mass: float) -> list[Doubt]:
    r"""Doubt a response that the sensor's mass changes: without it, :math:`H = H'/(1 + m \omega^2 H')`."""
    bare = lines.receptance / (1 + mass * lines.omega**2 * lines.receptance)
    change = float(lines.receptance.real.min() / bare.real.min() - 1)
    peak, was = (float(lines.omega[int(np.argmax(np.abs(values)))]) / (2 * np.pi) for values in (bare, lines.receptance))
    if abs(change) < MAX_SENSOR_CHANGE and abs(was / peak - 1) < MAX_SENSOR_SHIFT:
        return []
    return [Doubt(name, f"the sensor's {1e3 * mass:.3g} g change its least real part by {100 * change:+.0f} % and move its "
                  f"largest peak from {peak:.0f} to {was:.0f} Hz", "measure with a lighter sensor, or take its mass out "
                  "(toolpoint.signals.without_mass)", figure=abs(change), grave=True)]


def question_mixes(frf: Frf) -> list[Doubt]:
    """Doubt measured cross responses by which some mix of directions gives off power."""
    both = [dof for dof in frf.outputs if dof in frf.inputs]
    if len(both) < 2:
        return []
    square = frf.selected(both, both)
    cross = square.values.copy()
    cross[:, range(len(both)), range(len(both))] = 0
    if not np.abs(cross).any():
        return []
    share = active_matrix_share(square)
    if share <= MAX_ACTIVE_PAIRS:
        return []
    words = ", ".join(map(str, both))
    return [Doubt(words, f"at {100 * share:.0f} % of the lines some force between these directions would take power out of the "
                  "structure", "check signs and labels of the cross responses, and that all are of one point", figure=share,
                  grave=True)]


def withheld_words(doubts: Sequence[Doubt]) -> str:
    """Return why advice is withheld, as words for a table."""
    first = doubts[0]
    remainder = f" (and {len(doubts) - 1} more)" if len(doubts) > 1 else ""
    return f"{WITHHELD}: {first.what}: {first.why}{remainder}"

