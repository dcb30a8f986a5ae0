"""Response between tool and work in a cut: of a machine at a pose, of measured responses, or of modes."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, ToolpointError, ToolpointWarning
from toolpoint._doubt import Doubt, grave_among
from toolpoint.machine import Machine
from toolpoint.signals.usable_band import usable_band
from toolpoint.studies.cuts.tip_doubts import gain_notes, question_directions, question_mixes, question_modes, question_tip
from toolpoint.studies.cuts.tool_directions import along_positive_axes, check_driving_points, tool_directions
from toolpoint.studies.machines.tool_point import STUDY_LINES, condense_unreliable, speed_dynamics, tool_point
from toolpoint.studies.machines.tool_seat import question_tool_seat
from toolpoint.vibration import Dof, Frf, Modes

MIN_LINE_FIT = 0.9  # of a response that its modes explain, where they replace its lines
JUDGED_FRACTION_MIN = 0.02  # of the highest line: below, responses are not judged for such slips
DRIFT_FRACTION_MAX = 0.02  # of the highest line: above, no line is left out as drift
ENTRIES_BY_WAY = {"x": ((0, 0),), "y": ((1, 1),), "xy": ((0, 1), (1, 0))}  # of the response between x and y
WORDS_BY_WAY = {"x": "along x", "y": "along y", "xy": "across (x to y and y to x)"}


@dataclass(frozen=True, eq=False)
class ToolDynamics:
    """Modes or lines of one pose with the labels of the cutting plane; y is ``same`` or None (rigid) where not known.

    machine : the machine that they are of, where there is one; notes : what the response is of, and what was assumed;
    what : the name of the data, for messages; at_speed : the modes at a spindle speed (rev/min), where bodies spin;
    pose : of the machine; parts : the tool's and the work's own dynamics, where these are the sum of both.
    """

    response: Modes | Frf
    x: str
    y: str | None
    machine: Machine | None = None
    notes: tuple[str, ...] = ()
    what: str = "the data"
    at_speed: Callable[[float], Modes] | None = None
    pose: Mapping[str, float] = field(default_factory=dict)
    parts: tuple[ToolDynamics, ToolDynamics] | None = None

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts: advice that rests on these dynamics is withheld."""
        return grave_among(self.notes)


def machine_dynamics(machine: Machine, pose: Mapping[str, float] | None = None, y: str | None = None) -> ToolDynamics:
    """Return the dynamics of a machine's tool against its table at a pose; `y` may be ``same`` or ``rigid``.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.02))
    >>> dynamics = machine_dynamics(machine)
    >>> dynamics.x, dynamics.y
    ('tip:+x', 'tip:+y')
    """
    study = tool_point(machine, [dict(pose or {})], STUDY_LINES)
    across = f"{study.point}:+y" if y is None else None if y == "rigid" else y
    at_speeds = speed_dynamics(machine, pose)
    notes = () if at_speeds is None else ("bodies spin: every spindle speed has modes of its own",)
    modes = condense_unreliable(machine, study.modes.at_pose(0))
    remarks = (*question_tool_seat(machine), *notes, *study.leaning())
    return ToolDynamics(modes, f"{study.point}:+x", across, machine, remarks, machine.name, at_speeds, dict(pose or {}))


def modal_dynamics(modes: Modes, x: str | None = None, y: str | None = None, *, what: str = "the modes") -> ToolDynamics:
    """Return the dynamics of identified modes; x and y as in `tool_directions`. Its notes begin with the doubts of the tip.

    >>> tip = Modes([150.0], [0.03], [[0.2]], ["tip:+x"])
    >>> str(modal_dynamics(tip).x)
    'tip:+x'
    """
    ways = tool_directions(modes.dofs, x, y, what=what)
    return ToolDynamics(modes, ways.x, ways.y, None, (*question_modes(modes, ways.labels, what), *ways.notes), what)


def response_dynamics(frf: Frf, x: str | None = None, y: str | None = None, *, band: tuple[float, float] | None = None,
                      what: str = "the measurement", sensor_mass: float | None = None) -> ToolDynamics:
    """Return the dynamics of measured responses, cut to a band (Hz); x and y as in `tool_directions`.

    what : the name of the data, for notes; sensor_mass : kg, of the sensor that was on the tip. The notes begin with the doubts
    about the tip's responses (`tip_doubts.question_tip`).

    Examples
    --------
    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([80.0, 120.0], [0.02, 0.03], [[0.1, 0.05]], ["tool:+x"])
    >>> response_dynamics(frequency_response.modal(modes, np.arange(1.0, 300.0)), band=(20.0, 250.0)).x
    'tool:+x'
    """
    frf = along_positive_axes(frf)
    ways = tool_directions(check_driving_points(frf, what), x, y, what=what)
    lines = take_band(frf, band).selected(ways.labels, ways.labels)
    judged = lines_to_judge(lines, band)
    doubts = question_tip(judged, names={dof: f"{what}, {dof}" for dof in lines.outputs}, sensor_mass=sensor_mass)
    across = "" if ways.y in (None, "same") else f", along y {ways.y}"
    note = f"{what}, {frf.quantity}: response along x is {ways.x}{across}"
    return ToolDynamics(lines, ways.x, ways.y, None, (*doubts, note, *ways.notes, *lines.notes, *gain_notes(judged)), what)


def separate_dynamics(x: Frf, y: Frf | None = None, xy: Frf | None = None, *, across: str | None = None,
                      band: tuple[float, float] | None = None, names: Mapping[str, str] | None = None,
                      sensor_mass: float | None = None) -> ToolDynamics:
    """Return the dynamics of separate measurements of one response each: along x, along y, and between them.

    y and xy are brought to the lines of x; without y the response `across` is the same as along x, or ``rigid``.
    names : what to call each in notes (keys x, y, xy); sensor_mass : kg, of the sensor that was on the tip. The notes begin
    with the doubts about the tip's responses.

    Examples
    --------
    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([80.0, 120.0], [0.02, 0.03], [[0.1, 0.05]], ["tool:+x"])
    >>> separate_dynamics(frequency_response.modal(modes, np.arange(1.0, 300.0, 2.0))).notes[1]
    'the response across is taken as that along x'
    """
    called = {"x": "the first", "y": "the second", "xy": "the cross response"} | dict(names or {})
    parts: dict[str, Frf] = {}
    notes: list[str] = []
    for way, response in (("x", x), ("y", y), ("xy", xy)):
        if response is None:
            continue
        frf = along_positive_axes(response)
        if frf.values.shape[1:] != (1, 1):
            raise ToolpointError(f"`frf_{way}`: {called[way]} holds {len(frf.outputs)} x {len(frf.inputs)} responses; must be "
                                 "one; a file with several is given with `frf`, `x` and `y`")
        _check_way(way, frf, called[way])
        notes.append(f"{WORDS_BY_WAY[way]}: {called[way]}, {frf.quantity}")
        parts[way] = take_band(frf, band)
    judged = {way: lines_to_judge(part, band) for way, part in parts.items() if way != "xy"}
    doubts = question_directions(judged)
    for way, part in judged.items():
        doubts += question_tip(part, names={part.outputs[0]: f"{called[way]}, along {way}"}, sensor_mass=sensor_mass)
        notes += gain_notes(part)
    what = ", ".join(called[way] for way in parts)
    joined = _one_direction(parts["x"], across, notes, what) if y is None else _two_directions(parts, notes, what)
    if xy is not None and not doubts:
        assert isinstance(joined.response, Frf)
        doubts = question_mixes(joined.response)
    return replace(joined, notes=tuple(dict.fromkeys([*doubts, *joined.notes])))


def _check_way(way: str, frf: Frf, name: str) -> None:
    """Refuse a cross response, by its labels, as the driving point along x or y."""
    if way != "xy" and frf.outputs != frf.inputs:
        raise ToolpointError(f"`frf_{way}`: {name} is the response at {frf.outputs[0]} to a force at {frf.inputs[0]}, no "
                             "driving point; the cut needs the response where the force acts")


def _two_directions(parts: dict[str, Frf], notes: list[str], what: str) -> ToolDynamics:
    parts = _on_common_lines(parts, notes)
    x, y = parts["x"].values[:, 0, 0], parts["y"].values[:, 0, 0]
    cross = parts["xy"].values[:, 0, 0] if "xy" in parts else np.zeros_like(x)
    notes += [] if "xy" in parts else ["no cross response between x and y"]
    values = np.stack([np.stack([x, cross], -1), np.stack([cross, y], -1)], -2)
    labels = (Dof("tool", "+x"), Dof("tool", "+y"))
    notes += [note for part in parts.values() for note in part.notes]
    frf = Frf(parts["x"].frequency, values, labels, labels, "receptance", draws=_joined_draws(parts, values))
    return ToolDynamics(frf, "tool:+x", "tool:+y", None, tuple(dict.fromkeys(notes)), what)


def _joined_draws(parts: Mapping[str, Frf], values: ComplexArray) -> ComplexArray | None:
    """Return draws (n, n_f, 2, 2) of separate measurements, one of each in turn; None where none has any."""
    drawn = {way: part.draws for way, part in parts.items() if part.draws is not None}
    if not drawn:
        return None
    result = np.repeat(values[None], min(map(len, drawn.values())), axis=0)
    for way, draws in drawn.items():
        for row, column in ENTRIES_BY_WAY[way]:
            result[:, :, row, column] = draws[:len(result), :, 0, 0]
    return result


def _one_direction(frf: Frf, across: str | None, notes: list[str], what: str) -> ToolDynamics:
    label = (Dof("tool", "+x"),)
    y = None if across == "rigid" else "same"
    note = "the response across is taken as that along x" if y else "the tool is taken as rigid along y"
    return ToolDynamics(replace(frf, outputs=label, inputs=label), "tool:+x", y, None, (*notes, note, *frf.notes), what)


def lines_to_judge(lines: Frf, band: tuple[float, float] | None) -> Frf:
    """Return the lines by which a tip's responses are judged: all of a stated band, else those above 2 % of the range.

    The chart takes lower ones too. An accelerance that is read as receptance, or the other way round, differs by a factor that
    grows without limit towards 0 Hz: a few low lines would decide which slip explains all of them.
    """
    if band is not None:
        return lines
    frequency_min = JUDGED_FRACTION_MIN * float(lines.frequency[-1])
    return lines.between(frequency_min, float(lines.frequency[-1])) if (lines.frequency >= frequency_min).sum() > 1 else lines


def take_band(frf: Frf, band: tuple[float, float] | None) -> Frf:
    """Return measured responses as receptance, cut to a band (Hz).

    Without a band the lines at the low end that drift or noise fill are left out, with a note: receptances integrated from
    accelerations grow without limit there. Lines that show neither stay, however low: a machine on its feet has modes there.
    The damping of an exponential window that the lines hold is warned of.
    """
    if frf.decay > 0:
        warnings.warn(f"the lines hold the damping of an exponential window ({frf.decay:.3g} 1/s): limits come out too high; "
                      "identify the modes, which are freed of it, and cut on them (toolpoint identify FILE -m modes.h5, then "
                      "`modes`)",
                      ToolpointWarning, stacklevel=3)
    if band is not None:
        inside = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
        if inside.sum() < 2:
            raise ToolpointError(f"`band` {band[0]:g}:{band[1]:g}: holds {int(inside.sum())} lines; the measurement goes from "
                                 f"{frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz")
        if frf.quantity != "receptance" and band[0] == 0:
            inside &= frf.frequency > 0  # a line at 0 Hz cannot be integrated
        lines = frf.frequency[inside]
        return frf.between(float(lines[0]), float(lines[-1])).converted_to("receptance")
    # Lines at 0 Hz cannot be integrated; the others go by what they show, up to the part of the range where drift can be.
    frequency_min = min(usable_band(frf).low, DRIFT_FRACTION_MAX * float(frf.frequency[-1]))
    low_lines = [line for line in frf.frequency if 0 < line < frequency_min]
    kept = frf.between(max(frequency_min, float(np.nextafter(0, 1))), float(frf.frequency[-1])).converted_to("receptance")
    if not low_lines:
        return kept
    return kept.noted(f"Lines below {frequency_min:.4g} Hz are left out: drift and noise of integrated accelerations are what "
                       "they show. Choose another band with `band`.")


def _on_common_lines(parts: dict[str, Frf], notes: list[str]) -> dict[str, Frf]:
    first = parts["x"].frequency
    if all(part.frequency.shape == first.shape and np.allclose(part.frequency, first, rtol=1e-9) for part in parts.values()):
        return parts
    frequency_min, frequency_max = (max(p.frequency[0] for p in parts.values()), min(p.frequency[-1] for p in parts.values()))
    lines = first[(first >= frequency_min) & (first <= frequency_max)]
    if lines.size < 2:
        spans = "; ".join(f"{way}: {p.frequency[0]:g} .. {p.frequency[-1]:g} Hz" for way, p in parts.items())
        raise ToolpointError(f"`frf_x`, `frf_y`: no common lines ({spans}); measure both over one band")
    notes.append(f"the files have other lines: taken at those of x within {frequency_min:g} .. {frequency_max:g} Hz, linearly "
                 f"between their own")
    return {way: part.interpolated(lines) for way, part in parts.items()}


def as_modes(dynamics: ToolDynamics) -> ToolDynamics:
    """Return dynamics whose measured lines are replaced by their modes, for simulations in time.

    A note states how well the modes explain the lines. Modes stay as they are.

    Raises ToolpointError where the modes do not explain the lines.
    """
    frf = dynamics.response
    if not isinstance(frf, Frf):
        return dynamics
    from toolpoint.modal_identification import identify  # loads for half a second, and few cuts need it

    is_apart = len(frf.outputs) == 2 and not np.abs(frf.values[:, 0, 1]).max()
    fits = [identify(frf.selected([k], [k])) for k in (0, 1)] if is_apart else [identify(frf)]
    least_fit = min(float(fit.quality.min()) for fit in fits)
    if least_fit < MIN_LINE_FIT:
        raise ToolpointError(f"{dynamics.what}: a simulation in time needs modes, and those found here explain only "
                             f"{100 * least_fit:.0f} % of a response; identify them with care: toolpoint identify FILE -m "
                             f"modes.h5 "
                             "--band LOW:HIGH, then give --modes modes.h5")
    modes = _side_by_side(fits[0].modes, fits[1].modes) if is_apart else fits[0].modes
    lines = ", ".join(f"{f:.0f}" for f in modes.frequency[:8]) + (" ..." if modes.count > 8 else "")
    note = (f"a simulation in time needs modes: {modes.count} identified from {dynamics.what} ({lines} Hz); they explain "
            f"{100 * least_fit:.1f} % of every response, or more")
    return replace(dynamics, response=modes, notes=(*dynamics.notes, note))


def _side_by_side(x: Modes, y: Modes) -> Modes:
    """Return the modes of two directions that do not answer each other as one."""
    def blocks(a: Any, b: Any) -> Any:
        return None if a is None or b is None else np.block([[a, np.zeros((1, b.shape[1]))], [np.zeros((1, a.shape[1])), b]])

    labels = (*x.dofs, *y.dofs)
    return Modes(np.append(x.frequency, y.frequency), np.append(x.damping_ratio, y.damping_ratio), blocks(x.shape, y.shape),
                 labels, "modal A" if x.scaling == y.scaling == "modal A" else "unscaled",
                 participation=blocks(x.participation, y.participation), input_dofs=labels,
                 lower_residual=blocks(x.lower_residual, y.lower_residual),
                 upper_residual=blocks(x.upper_residual, y.upper_residual))
