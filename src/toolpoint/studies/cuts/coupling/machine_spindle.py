"""Spindle and tips of a coupled tool: the spindle computed from a machine, tips coupled to it or to measured planes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.assembly.gyroscopics import fastest_spin
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.attached_tool import detach_tool
from toolpoint.studies.cuts.coupling.line_smoothing import smooth_tip
from toolpoint.studies.machines.machine_uncertainty import MACHINE_DRAW_COUNT, machine_uncertainty
from toolpoint.studies.machines.tool_point import tool_axes
from toolpoint.substructuring.receptance import PlaneReceptance, couple_tool
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.substructuring.spindle import CoupledTip, SpindleReceptance, couple_spindle
from toolpoint.vibration import Dof, Frf, frequency_response

MAX_FRF_DRAWS = 100  # draws of the tips that a response keeps
SPINDLE_LINES = np.linspace(20, 6000, 5981)  # Hz, of a computed spindle where nothing else is asked
# Freedoms of the section among x, y, z, rx, ry, rz, with sign: the slopes along a shaft that runs to -z are -ry and rx.
_SECTION_MOTIONS = ((0, 1.0), (4, -1.0), (1, 1.0), (3, 1.0), (2, 1.0), (5, 1.0))
_WAYS = ("+x", "+y", "+z")
_TURNS = ("+rx", "+ry", "+rz")


def bases_of_machine(machine: Machine, point: str, frequency: FloatArray | None = None, *,
                     pose: Mapping[str, float] | None = None) -> SpindleReceptance:
    """Return the receptance of a point of a machine, deflections and rotations in both planes, and of its table.

    frequency : (n_f,) Hz, every hertz from 20 to 6000 where left out. Axes are the tool's at the pose. Where the machine's
    identified numbers have a covariance, machines are drawn from it. The file's own tool there is taken off.

    Raises ToolpointError as `detach_tool` does.

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
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7, "rx": 1e6, "ry": 1e6}, loss_factor=0.04)
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("head", {"head": head}, {"spindle": joint},
    ...                                    points={"nose": PointDescription("head")}))
    >>> bases_of_machine(machine, "nose", np.arange(20.0, 200.0))
    SpindleReceptance(20..199 Hz, 180 lines, rigid work)
    """
    count_before = len(machine.description.doubts)
    machine = detach_tool(machine, point)
    lines = SPINDLE_LINES if frequency is None else np.asarray(frequency, float)
    values = _section_responses(machine, point, lines, pose)
    drawn = [_section_responses(sample, point, lines, pose) for sample in _drawn_machines(machine)]
    knowledge = (f"whose identified numbers are drawn from their covariance ({len(drawn)} machines)" if drawn
                 else "whose numbers are taken as exact")
    table = machine.description.table
    work = "the work stands still: the file names no table" if table is None else f"against its table {table}"
    notes = (*_doubts(machine), *machine.description.doubts[count_before:],
             f"the spindle is computed: point {point} of {machine.name}, {work}, {knowledge}")
    return SpindleReceptance(lines, values, np.stack(drawn) if drawn else None, notes)


def _section_responses(machine: Machine, point: str, lines: FloatArray, pose: Mapping[str, float] | None) -> ComplexArray:
    """Return the rows of `SpindleReceptance` of a machine at a pose, along the tool's axes there."""
    table = machine.description.table
    labels = [Dof(point, way) for way in (*_WAYS, *_TURNS)] + ([] if table is None else [Dof(table, way) for way in _WAYS])
    response = frequency_response.direct(assemble(machine, pose, labels), lines).values
    axes = tool_axes(machine, pose, point=point)[0]
    take = np.zeros((len(_SECTION_MOTIONS) + (0 if table is None else 2), len(labels)))
    for row, (motion, sign) in enumerate(_SECTION_MOTIONS):
        group = 3 * (motion // 3)
        take[row, group:group + 3] = sign * axes[:, motion % 3]
    if table is not None:
        take[6, 6:9], take[7, 6:9] = axes[:, 0], axes[:, 1]
    return np.asarray(take @ response @ take.T)


def _drawn_machines(machine: Machine) -> Iterator[Machine]:
    uncertainty = machine_uncertainty(machine)
    return iter(()) if uncertainty is None else uncertainty.samples(MACHINE_DRAW_COUNT, np.random.default_rng(0))


def _doubts(machine: Machine) -> list[Doubt]:
    """Return the doubt about a spindle whose modes change with its speed."""
    if not fastest_spin(machine.description):
        return []
    return [Doubt("spindle speed", "the machine has bodies that spin; the tool is coupled to it at the speed of its file, and "
                  "the limits at other speeds are of that response", "write the tool into the machine file as a body")]


def couple_tips(bases: Sequence[PlaneReceptance] | SpindleReceptance, tool: ShaftDescription, seed: int | None) -> CoupledTip:
    """Return the tip of a tool on a spindle; seed : of the tool's deviations, the same in both planes and for all lengths."""
    if isinstance(bases, SpindleReceptance):
        return couple_spindle(bases, tool, generator=_seeded(seed))
    # Neighbouring lines of a measured spindle are taken together; those of a computed one hold no noise.
    return CoupledTip(tuple(smooth_tip(couple_tool(base, tool, generator=_seeded(seed))) for base in bases))


def _seeded(seed: int | None) -> np.random.Generator | None:
    return None if seed is None else np.random.default_rng(seed)


def tip_frf(coupled: CoupledTip, notes: Sequence[str] = ()) -> Frf:
    """Return the tip of a tool in its planes as one Frf; nothing couples x with y where that is not known."""
    tips = coupled.tips
    labels = tuple(Dof("tool", f"+{tip.plane}") for tip in tips)
    n = len(tips)
    values = np.zeros((tips[0].frequency.size, n, n), complex)
    for k, tip in enumerate(tips):
        values[:, k, k] = tip.values[:, 0, 0]
    if n == 2 and coupled.cross is not None:
        values[:, 0, 1] = values[:, 1, 0] = coupled.cross
    frf = Frf(tips[0].frequency, values, labels, labels, notes=tuple(notes))
    # One plane without draws leaves the whole matrix without a variance: its zeros would say that the response is exact.
    if any(tip.draws is None for tip in tips):
        return frf
    draws = _drawn_values(coupled, values.shape)
    return replace(frf, draws=draws[:MAX_FRF_DRAWS], variance=draws.var(axis=0))


def _drawn_values(coupled: CoupledTip, shape: tuple[int, ...]) -> ComplexArray:
    """Return the draws of a tip, (n_draws, n_f, n, n)."""
    drawn = [tip.draws for tip in coupled.tips if tip.draws is not None]
    draws = np.zeros((min(map(len, drawn)), *shape), complex)
    for k, part in enumerate(drawn):
        draws[:, :, k, k] = part[:len(draws), :, 0, 0]
    if len(drawn) == 2 and coupled.cross_draws is not None:
        draws[:, :, 0, 1] = draws[:, :, 1, 0] = coupled.cross_draws[:len(draws)]
    return draws
