r"""Milling accuracy along a path: flexible against rigid run with the cut at the moving tool (the source's eqs. 16-27).

rel is the elastic motion of the tool's tip (flexible less rigid run, the actuators hold their set points), its unbiased error
:math:`e_i = rel_i - \frac1n \sum rel_i` (21); the radii of the spheres :math:`e_{pos,i} = |(e_x, e_y, e_z)|` (23) and
:math:`e_{rot,i}` (25) of the rotations, and their means (26, 27).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.accuracy.cutting_table import CuttingTable, check_regeneration, cutting_problem, cutting_table
from toolpoint.studies.accuracy.moving_structure import MovingStructure, ToolStance, structure_along
from toolpoint.studies.accuracy.tool_paths import PathSide
from toolpoint.vibration.varying import (
    CourseArrays,
    CutArrays,
    NodeArrays,
    RunArrays,
    StepNodes,
    VaryingSystem,
    step_nodes,
)

Progress = Callable[[int, int], None]
_BLOCK = 100_000
_KEPT = 1_000_000  # samples of a side that are kept at most
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class MillingSetup:
    """How a path is milled and computed.

    speed : rev/min; depth : m; loads : ``cutting``, with ``gravity`` its changing sag, with ``path`` the inertia of the nominal
    motion; regenerative : whether the vibration feeds back on the chip (linear: chips do not vanish); spacing : m between
    nodes of the structure; steps : in a tooth period; window : s of the middle of every side that is run, whole sides where
    left out; with_force : False leaves the cut's force out; halved : whether a run at twice the step and spacing states the
    error.
    """

    speed: float
    depth: float
    loads: tuple[str, ...] = ("cutting",)
    regenerative: bool = False
    spacing: float = 2e-3
    steps: int = 100
    window: float | None = None
    with_force: bool = True
    halved: bool = True
    with_energy: bool = False
    with_base: bool = False
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.80665)
    stance: ToolStance = field(default_factory=ToolStance)


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Work of all loads, energy lost, gain of energy, and work done by the moving structure, J; size : sum of |work| of the
    steps."""

    work: float
    lost: float
    gained: float
    by_structure: float
    size: float

    @property
    def gap(self) -> float:
        """What does not balance, over the sum of the sizes of the work."""
        return abs(self.work - self.lost - self.gained) / max(self.size, 1e-300)


@dataclass(frozen=True, eq=False)
class SideAccuracy:
    """Error along a side.

    time : (n,) s; length : (n,) m; relative : (n, 6) elastic motion of the tip (m, rad) in machine axes; base : (n, 6)
    reaction of the base about the machine's origin, empty where it was not asked for; halving : relative change of both means
    from the run at twice the step and spacing, not a number where it was not run.
    """

    name: str
    time: FloatArray
    length: FloatArray
    relative: FloatArray
    base: FloatArray
    halving: float
    energy: EnergyBalance | None
    notes: tuple[str, ...] = ()

    @property
    def error(self) -> FloatArray:
        """Unbiased error (21), (n, 6)."""
        return self.relative - self.relative.mean(axis=0)

    @property
    def position_radius(self) -> FloatArray:
        """Radius of the position sphere (23), m, (n,)."""
        return np.linalg.norm(self.error[:, :3], axis=1)

    @property
    def rotation_radius(self) -> FloatArray:
        """Radius of the rotation sphere (25), rad, (n,)."""
        return np.linalg.norm(self.error[:, 3:], axis=1)

    @property
    def position_error(self) -> float:
        """Mean radius of the position sphere (26), m."""
        return float(self.position_radius.mean())

    @property
    def rotation_error(self) -> float:
        """Mean radius of the rotation sphere (27), rad."""
        return float(self.rotation_radius.mean())

    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Return frequencies (Hz) and amplitudes (n_f, 6) of the unbiased error."""
        rate = 1 / float(self.time[1] - self.time[0])
        window = np.hanning(len(self.time))
        amplitude = 2 * np.abs(np.fft.rfft(self.error * window[:, None], axis=0)) / window.sum()
        return np.arange(len(amplitude)) * rate / len(self.time), amplitude


@dataclass(frozen=True, eq=False)
class MillingAccuracy(NotebookText):
    """Accuracy of all sides of a path; loads in words; status says whether the stated halving bounds the error."""

    machine: str
    setup: MillingSetup
    sides: tuple[SideAccuracy, ...]

    @property
    def position_error(self) -> float:
        """Mean over the sides, m."""
        return float(np.mean([side.position_error for side in self.sides]))

    @property
    def rotation_error(self) -> float:
        """Mean over the sides, rad."""
        return float(np.mean([side.rotation_error for side in self.sides]))

    @property
    def loads(self) -> str:
        """For which loads the errors hold."""
        return load_words(self.setup.loads, self.setup.regenerative)

    @property
    def status(self) -> str:
        """Whether half the step would change the means by more than a per cent."""
        worst = max((side.halving for side in self.sides), default=float("nan"))
        if np.isnan(worst):
            return "not halved: nothing states the error of step and spacing"
        return (f"converged: half the step and spacing changes the means by about {100 * worst / 3:.2g} %" if worst < 0.01 else
                f"not converged: from twice the step and spacing the means change by {100 * worst:.2g} %; take smaller ones")

    def table(self) -> str:
        """Return the means of every side as text."""
        from toolpoint.studies.text_table import text_table

        rows = [[side.name, f"{1e6 * side.position_error:.4g}", f"{1e6 * side.rotation_error:.4g}",
                 " ".join(f"{1e6 * v:.3g}" for v in side.error.std(axis=0)),
                 f"{100 * side.halving:.2g} %"] for side in self.sides]
        return "\n".join([text_table(repr(self), ["side", "position µm", "rotation µrad", "rms x y z µm, rotations µrad",
                                                  "halving"], rows),
                          f"loads: {self.loads}", self.status,
                          *dict.fromkeys(note for side in self.sides for note in side.notes)])

    def to_dict(self) -> dict[str, Any]:
        """Return the means as plain data, SI."""
        return {"machine": self.machine, "loads": self.loads, "status": self.status, "position_error_m": self.position_error,
                "rotation_error_rad": self.rotation_error, "sides": [
                    {"name": s.name, "position_error_m": s.position_error, "rotation_error_rad": s.rotation_error,
                     "rms": s.error.std(axis=0).tolist(), "mean_deflection": s.relative.mean(axis=0).tolist(),
                     "halving": None if np.isnan(s.halving) else s.halving,
                     "energy_gap": None if s.energy is None else s.energy.gap} for s in self.sides]}

    def __repr__(self) -> str:
        cut = f"{self.setup.speed:g} rev/min, {1e3 * self.setup.depth:g} mm"
        return f"MillingAccuracy({self.machine!r}, {len(self.sides)} sides, {cut})"


def load_words(loads: tuple[str, ...], regenerative: bool = False) -> str:
    """Return for which loads an error holds, in words."""
    words = {"cutting": "the cut", "gravity": "gravity's changing sag", "path": "inertia of the path"}
    what = " + ".join(words[name] for name in words if name in loads)
    return what + (", with regenerative feedback" if regenerative else ", the chip as the path gives it")


def mill_path(machine: Machine, sides: tuple[PathSide, ...], setup: MillingSetup, *, cut: CuttingDescription | None = None,
              progress: Progress | None = None) -> MillingAccuracy:
    """Return the milling accuracy along all sides of a path.

    Parameters
    ----------
    machine : Machine
        Names its tool point and, unless `cut` is given, its cut.
    sides : sequence of PathSide
        See `tool_paths`.
    setup : MillingSetup
    cut : CuttingDescription, optional
    progress : callable, optional
        Called with (done, all) steps.
    """
    total = sum(_duration(side, setup) for side in sides)
    results, before = [], 0.0
    for side in sides:
        share = _duration(side, setup)

        results.append(mill_side(machine, side, setup, cut=cut,
                                 progress=_part_of(progress, before / total, share / total) if progress else None))
        before += share
    return MillingAccuracy(machine.name, setup, tuple(results))


def _part_of(progress: Progress, before: float, share: float) -> Progress:
    """Return the progress of a part that begins after `before` of the whole and is a `share` of it."""
    def report(done: int, every: int) -> None:
        progress(int(1000 * (before + share * done / every)), 1000)

    return report


def _duration(side: PathSide, setup: MillingSetup) -> float:
    return side.law.duration if setup.window is None else min(setup.window, side.law.duration)


def mill_side(machine: Machine, side: PathSide, setup: MillingSetup, *, cut: CuttingDescription | None = None,
              progress: Progress | None = None) -> SideAccuracy:
    """Return the error along one side; see `mill_path`."""
    described = cut or machine.description.cutting
    if described is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    problem = cutting_problem(described)
    tooth = 60 / (positive("speed", setup.speed) * problem.tool.teeth)
    structure = structure_along(machine, side, setup.stance, spacing=setup.spacing, loads=setup.loads, gravity=setup.gravity,
                                reference=1 / tooth,
                                span=_places_of(side, setup, tooth))
    if setup.regenerative:
        check_regeneration(problem)
    top = float(side.law.sample(np.linspace(0, side.law.duration, 2001))[:, 1].max())
    table = cutting_table(problem, speed=setup.speed, depth=setup.depth, largest_feed=top * tooth, steps=setup.steps)
    fine = _run(structure, structure.system, setup, table, progress)
    halving = float("nan")
    if setup.halved:
        coarse = cutting_table(problem, speed=setup.speed, depth=setup.depth, largest_feed=top * tooth,
                               steps=max(setup.steps // 2, 16))
        rough = _run(structure, structure.system.thinned(), replace(setup, with_energy=False, with_base=False), coarse, None)
        halving = max(abs(getattr(rough, name) / getattr(fine, name) - 1) if getattr(fine, name) > 0 else 0.0
                      for name in ("position_error", "rotation_error"))
    return replace(fine, halving=halving)


def _run(structure: MovingStructure, system: VaryingSystem, setup: MillingSetup, cut: CuttingTable, progress: Progress | None
         ) -> SideAccuracy:
    """Step along a side, begun in the periodic state that the cut and the loads at its start would have in the end."""
    from toolpoint.vibration.varying_kernel import advance

    law, dt = structure.side.law, cut.step
    begin, end = _span(law.duration, setup.window, dt * cut.per_tooth)
    nodes = step_nodes(system, dt, with_energy=setup.with_energy)
    steps = int(np.ceil((end - begin) / dt - 1e-6))
    keep = max(1, -(-steps // _KEPT))
    keep += 1 - keep % 2 if keep > 1 else 0  # odd, so that all phases of the (even) tooth period are kept
    table = cut.table if setup.with_force else np.zeros_like(cut.table)
    size = system.size
    state, delayed = np.zeros(2 * size), np.zeros((cut.per_tooth, 3))
    first = law.sample(np.array([begin]))
    state[:], delayed[:] = _periodic_state(structure, system, nodes, table, cut, motion=first[0])
    totals = np.zeros(4 if setup.with_energy else 0)
    energy = _energy(system, state, float(first[0, 0]))
    at_nodes = NodeArrays(nodes.transition, nodes.deflection, nodes.reading, nodes.moving, nodes.dissipation, nodes.load_map,
                          system.mass, system.stiffness)
    of_cut = CutArrays(table, cut.regeneration, setup.depth if setup.regenerative and setup.with_force else 0.0)
    carried = RunArrays(state, delayed, totals)
    out, base = np.empty((-(-steps // keep), 6)), np.empty((-(-steps // keep) if setup.with_base else 0, 9))
    kept = 0
    for at in range(0, steps, _BLOCK):
        motion = law.sample(begin + (np.arange(at, min(at + _BLOCK, steps)) + 0.5) * dt)
        node, share = _between(system.length, motion[:, 0])
        feed = np.clip(motion[:, 1] * dt * cut.per_tooth / cut.largest_feed, 0.0, 1.0)
        kept += advance(at_nodes, of_cut, CourseArrays(node, share, feed, structure.load_factors(motion)), carried, keep, at,
                        out[kept:], base[kept:] if setup.with_base else base)
        if progress:
            progress(min(at + _BLOCK, steps), steps)
    time = begin + (np.arange(kept) * keep + 1) * dt
    travelled = law.sample(time)
    if not np.isfinite(out[:kept]).all() or np.abs(out[:kept, :3]).max(initial=0.0) > 0.1:
        fail("depth", f"{1e3 * setup.depth:g} mm at {setup.speed:g} rev/min", "the vibration grows without bound",
             "the cut chatters: take it below the stable depth (toolpoint lobes)")
    balance = None
    if setup.with_energy:
        work, lost, moved, gained = (float(total) for total in totals)
        change = _energy(system, state, float(law.sample(np.array([begin + steps * dt]))[0, 0])) - energy
        balance = EnergyBalance(work, lost, gained, change - gained, moved)
    return SideAccuracy(structure.side.name, time, travelled[:, 0], out[:kept], _base_history(structure, base[:kept],
                                                                                              travelled),
                        float("nan"), balance, _notes(structure))


def _span(duration: float, window: float | None, tooth: float) -> tuple[float, float]:
    """Begin and end of what is run; a window holds whole tooth periods."""
    if window is None:
        return 0.0, duration
    size = max(np.floor(min(positive("window", window), duration) / tooth), 1.0) * tooth
    return (duration - size) / 2, (duration + size) / 2


def _places_of(side: PathSide, setup: MillingSetup, tooth: float) -> tuple[float, float] | None:
    """The part of a side that a window needs, m."""
    if setup.window is None:
        return None
    ends = side.law.sample(np.array(_span(side.law.duration, setup.window, tooth)))[:, 0]
    return float(ends[0]), float(ends[1])


def _between(length: FloatArray, at: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Node before every length, and the share of the way to the next."""
    node = np.clip(np.searchsorted(length, at, side="right") - 1, 0, len(length) - 2)
    return node, (at - length[node]) / (length[node + 1] - length[node])


def _periodic_state(structure: MovingStructure, system: VaryingSystem, nodes: StepNodes, table: FloatArray, cut: CuttingTable,
                    *,
                    motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """State at the beginning of a revolution that repeats after it, and the tip's way in cutter axes over its last tooth
    period."""
    share = float(np.clip(motion[1] * cut.step * cut.per_tooth / cut.largest_feed, 0, 1))
    force = table[0] + share * (table[-1] - table[0])
    loads = np.concatenate([force, np.broadcast_to(structure.load_factors(motion[None])[0], (len(force),
                                                                                             nodes.deflection.shape[1] - 3))],
                           axis=1)
    node, part = (v[0] for v in _between(system.length, motion[:1]))

    def blend(values: FloatArray) -> FloatArray:
        return values[node] + part * (values[node + 1] - values[node])

    phi, still = blend(nodes.transition).T, np.zeros((len(nodes.transition[0]), loads.shape[1]))
    still[:system.size] = blend(nodes.deflection).T

    def revolve(state: FloatArray) -> FloatArray:
        states = [state]
        for row in loads:
            states.append(still @ row + phi @ (states[-1] - still @ row))
        return np.array(states)

    end = revolve(np.zeros(len(phi)))[-1]
    state = np.linalg.solve(np.eye(len(phi)) - np.linalg.matrix_power(phi, len(force)), end)
    way = revolve(state)[-cut.per_tooth - 1:-1, :system.size] @ blend(nodes.load_map)[:3].T
    return state, way


def _energy(system: VaryingSystem, state: FloatArray, at: float) -> float:
    u, v = state[:system.size], state[system.size:]
    return float(v @ system.blended("mass", at) @ v + u @ system.blended("stiffness", at) @ u) / 2


def _base_history(structure: MovingStructure, base: FloatArray, motion: FloatArray) -> FloatArray:
    """Reaction of the base: rate of momentum of the elastic motion less the force on the tip, and what holds the machine at
    rest."""
    if not len(base):
        return np.zeros((0, 6))
    node, share = _between(structure.system.length, motion[:, 0])

    def along(values: FloatArray) -> FloatArray:
        return values[node] + share.reshape(-1, *[1] * (values.ndim - 1)) * (values[node + 1] - values[node])

    force = (along(structure.axes) @ base[:, 6:, None])[..., 0]
    wrench = np.concatenate([force, np.cross(along(structure.tips), force)], axis=1)
    return base[:, :6] - wrench + along(structure.nominal)


def _notes(structure: MovingStructure) -> tuple[str, ...]:
    size = float(np.abs(np.diff(np.stack(list(structure.reach.batch().values())), axis=1)).max())
    return (f"forces of the axes' own speed on the vibration (Coriolis) are left out; between nodes no axis moves more than "
            f"{size:.2g} "
            "(rad, m)",)
