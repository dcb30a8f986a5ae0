r"""Milling accuracy along a path: flexible against rigid run with the cut at the moving tool (the source's eqs. 16-27).

rel is the elastic motion of the tool's tip (flexible less rigid run, the actuators hold their set points), its unbiased error
:math:`e_i = rel_i - \frac1n \sum rel_i` (21); the radii of the spheres :math:`e_{pos,i} = |(e_x, e_y, e_z)|` (23) and
:math:`e_{rot,i}` (25) of the rotations, and their means (26, 27).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._doubt import Doubt, doubts_among, mark_notes, status_of
from toolpoint._notebook import NotebookText
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.simulation.pixel_bed import PixelBed
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.accuracy.chip import Chip, chip_kind, side_chip
from toolpoint.studies.accuracy.cut_course import Arc, cut_course, mill_bed
from toolpoint.studies.accuracy.cutting_table import check_regeneration, cutting_problem
from toolpoint.studies.accuracy.joint_servos import servo_words
from toolpoint.studies.accuracy.moving_structure import MovingStructure, structure_along
from toolpoint.studies.accuracy.refinement import MIN_STATED_ERROR, remaining_error
from toolpoint.studies.accuracy.run_store import RunStore
from toolpoint.studies.accuracy.side_run import MillingSetup, Progress, SideAccuracy, places_of, run_side
from toolpoint.studies.accuracy.side_stability import judge_cut
from toolpoint.studies.accuracy.tool_paths import PathSide
from toolpoint.vibration.simulation.varying import VaryingSystem

__all__ = ["MillingAccuracy", "MillingSetup", "SideAccuracy", "load_words", "mill_path", "mill_side"]

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")

# Nodes of a run that balances its energy are so many times nearer: of the blended step the energies are quadratic, and between
# nodes do not balance by the square of their distance (1e-6 of the work on elastic members 2 mm apart).
ENERGY_SPACING_DIVISOR = 4


@dataclass(frozen=True, eq=False)
class MillingAccuracy(NotebookText):
    """Accuracy of all sides of a path; loads in words; status says whether the stated halving bounds the error."""

    machine: str
    setup: MillingSetup
    sides: tuple[SideAccuracy, ...]

    @property
    def position_error(self) -> float:
        """Mean position error over the sides, m."""
        return float(np.mean([side.position_error for side in self.sides]))

    @property
    def rotation_error(self) -> float:
        """Mean rotation error over the sides, rad."""
        return float(np.mean([side.rotation_error for side in self.sides]))

    @property
    def loads(self) -> str:
        """Loads for which the errors hold, in words."""
        return load_words(self.setup.loads, self.setup.regenerative, self.setup.chip)

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the errors: a chip that contradicts the path's feed, cuts that chatter."""
        return tuple(doubts_among(self.notes))

    @property
    def status(self) -> str:
        """``doubtful`` where the cut chatters; else whether step and spacing leave more than a per cent."""
        if self.doubts:
            further_count = len(self.doubts) - 1
            return status_of(self.doubts[:1], "") + (f"; {further_count} more of the doubts" if further_count else "")
        return self.numerics

    @property
    def numerics(self) -> str:
        """Whether step and spacing leave less than a per cent in the means, from three levels of each (`refinement`)."""
        largest_halving = max((side.halving for side in self.sides), default=float("nan"))
        if np.isnan(largest_halving):
            return "not halved: nothing states the error of step and spacing"
        if largest_halving < 0.01:
            return f"converged: step and spacing leave an error of at most about {100 * largest_halving:.2g} % in the means"
        return (f"not converged: step and spacing leave an error of about {100 * largest_halving:.2g} % in the means; take a "
                f"smaller "
                "`spacing`, then more `steps`")

    @property
    def title(self) -> str:
        """Machine and cut in words."""
        return f"Accuracy of {self.machine} at {self.setup.speed:g} rev/min, {1e3 * self.setup.depth:g} mm deep"

    def table(self) -> str:
        """Return the means of every side as text."""
        from toolpoint.studies.text_table import text_table

        rows = [[side.name, f"{1e6 * side.position_error:.4g}", f"{1e6 * side.rotation_error:.4g}",
                 " ".join(f"{1e6 * v:.3g}" for v in side.mean_deflection[:3]),
                 " ".join(f"{1e6 * v:.3g}" for v in side.error.std(axis=0)),
                 f"{100 * side.halving:.2g} %"] for side in self.sides]
        header = ["side", "position µm", "rotation µrad", "mean µm, taken out", "rms x y z µm, rotations µrad", "halving"]
        return "\n".join([*mark_notes(self.doubts), text_table(self.title, header, rows), f"loads: {self.loads}", self.numerics,
                          *self.base_lines(), *(note for note in self.notes if not isinstance(note, Doubt))])

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of all sides, doubts among them, each once."""
        return tuple(dict.fromkeys(note for side in self.sides for note in side.notes))

    def base_lines(self) -> list[str]:
        """Return between which ends the reaction of the base (about the machine's origin) stays, a line a side that has it."""
        lines = []
        for side in self.sides:
            if len(side.base):
                ends = [f"{name} {lower:.4g} .. {upper:.4g}" for name, lower, upper in zip(
                    ("Fx", "Fy", "Fz", "Mx", "My", "Mz"), side.base.min(axis=0), side.base.max(axis=0), strict=True)]
                lines.append(f"base reaction, {side.name}: {', '.join(ends[:3])} N; {', '.join(ends[3:])} N m")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return the means as plain data, SI."""
        return {"doubts": list(self.doubts), "status": self.status, "numerics": self.numerics, "machine": self.machine,
                "loads": self.loads, "chip": self.setup.chip, "notes": list(self.notes),
                "position_error_m": self.position_error, "rotation_error_rad": self.rotation_error, "sides": [
                    {"name": s.name, "position_error_m": s.position_error, "rotation_error_rad": s.rotation_error,
                     "rms": s.error.std(axis=0).tolist(), "mean_deflection": s.mean_deflection.tolist(),
                     "base": _ends(s.base),
                     "halving": None if np.isnan(s.halving) else s.halving,
                     "energy_gap": None if s.energy is None else s.energy.gap} for s in self.sides]}

    def __repr__(self) -> str:
        cut = f"{self.setup.speed:g} rev/min, {1e3 * self.setup.depth:g} mm"
        return f"MillingAccuracy({self.machine!r}, {len(self.sides)} sides, {cut})"


def _ends(values: FloatArray) -> list[list[float]] | None:
    return [values.min(axis=0).tolist(), values.max(axis=0).tolist()] if len(values) else None


def load_words(loads: tuple[str, ...], regenerative: bool = False, chip: str = "") -> str:
    """Return the loads for which an error holds, in words."""
    words = {"cutting": "the cut", "gravity": "gravity's changing sag", "path": "inertia of the path"}
    chips = {"": "the chip as the cut's own entry says", "path": "the chip as the path gives it",
             "constant": "the chip constant"}
    what = " + ".join(words[name] for name in words if name in loads)
    return f"{what}, {chips[chip]}" + (", with regenerative feedback" if regenerative else "")


def mill_path(machine: Machine, sides: tuple[PathSide, ...], setup: MillingSetup, *, cut: CuttingDescription | None = None,
              progress: Progress | None = None, folder: str | Path | None = None, judged: bool = True) -> MillingAccuracy:
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
    folder : path, optional
        Where finished blocks of steps are kept: a run that was stopped, inside a side too, goes on from them to the same
        numbers; another machine, path or setup finds nothing there.
    judged : bool
        Whether every side is judged for chatter, which becomes a doubt.

    Examples
    --------
    Runs in ``examples/mill_a_square_with_a_robot.py``.
    """
    if setup.window is not None:
        positive("window", setup.window)
    described = _described(machine, cut)
    # The result states the chip that was taken, also where the cut chose it.
    setup = replace(setup, chip=chip_kind(described, setup.chip))
    # One block for all sides: each side mills what those before it left.
    bed = None if setup.work is None else setup.work.bed()
    # Progress goes by the time that is simulated.
    total = sum(_duration(side, setup) for side in sides)
    results, elapsed = [], 0.0
    for number, side in enumerate(sides):
        share = _duration(side, setup)
        results.append(mill_side(machine, side, setup, cut=described, bed=bed, folder=folder, name=f"side-{number + 1}",
                                 judged=judged,
                                 progress=_part_of(progress, elapsed / total, share / total) if progress else None))
        elapsed += share
    return MillingAccuracy(machine.name, setup, tuple(results))


def _part_of(progress: Progress, elapsed: float, share: float) -> Progress:
    """Return the progress of a part that begins after `elapsed` of the whole and is a `share` of it."""
    def report(finished: int, step_count: int) -> None:
        progress(int(1000 * (elapsed + share * finished / step_count)), 1000)

    return report


def _duration(side: PathSide, setup: MillingSetup) -> float:
    return side.law.duration if setup.window is None else min(setup.window, side.law.duration)


def mill_side(machine: Machine, side: PathSide, setup: MillingSetup, *, cut: CuttingDescription | None = None,
              progress: Progress | None = None, bed: PixelBed | None = None, folder: str | Path | None = None,
              name: str = "side", judged: bool = True) -> SideAccuracy:
    """Return the error along one side; see `mill_path`. bed : the rest of the block, from which the side is cut."""
    described = _described(machine, cut)
    problem = cutting_problem(described)
    tooth = 60 / (positive("speed", setup.speed) * problem.tool.teeth)
    spacing = setup.spacing / (ENERGY_SPACING_DIVISOR if setup.with_energy else 1)
    structure = structure_along(machine, side, setup.stance, spacing=spacing, loads=setup.loads, gravity=setup.gravity,
                                reference=1 / tooth,
                                span=places_of(side, setup, tooth), servos=setup.servos)
    if setup.regenerative:
        check_regeneration(problem)
    if setup.with_energy and any(servo.feeds_energy for servo in (setup.servos or {}).values()):
        fail("with_energy", "servos with an integral part or sampled loops", "feed energy as they like: there is no balance",
             remedy="take their integral gains and sample times (to 1e-9 s) away for it")
    chip = side_chip(described, side, tooth=tooth, requested=setup.chip)
    arcs = _arcs(structure, setup, bed, problem.tool.diameter / 2)

    def run(steps: int, system: VaryingSystem, chosen: MillingSetup, *, what: str) -> SideAccuracy:
        course = cut_course(problem, arcs, speed=setup.speed, depth=setup.depth, largest_feed=chip.largest_feed,
                            steps=steps, with_force=setup.with_force, is_constant=chip.kind == "constant")
        parts = machine.description, described, side.path, side.place, side.law, chosen, chip, arcs, steps, system.length
        store = None if folder is None else RunStore.of(Path(folder), f"{name}-{what}", *parts)
        return run_side(structure, system, chosen, cut=course, progress=progress if what == "fine" else None, store=store)

    fine = run(setup.steps, structure.system, setup, what="fine")
    halving = float("nan")
    if setup.halved:
        plain_setup, steps = replace(setup, with_energy=False, with_base=False), max(setup.steps // 2, 16)
        coarse = run(steps, structure.system, plain_setup, what="coarse")
        coarsest = run(max(setup.steps // 4, 16), structure.system, plain_setup, what="coarsest")
        # Every second node gives twice the spacing, without another reduction of the machine.
        thinned = structure.system.thinned()
        rough, roughest = (run(steps, system, plain_setup, what=what) for system, what in ((thinned, "rough"),
                                                                                           (thinned.thinned(), "roughest")))
        # Errors of step and spacing are added: together they may cancel.
        halving = max(remaining_error(*(getattr(level, mean) for level in (fine, coarse, coarsest)))
                      + remaining_error(*(getattr(level, mean) for level in (coarse, rough, roughest)))
                      for mean in ("position_error", "rotation_error"))
        halving = max(halving, MIN_STATED_ERROR)
    notes = _with_setup(fine, side, setup, chip=chip, arcs=arcs)
    if judged:
        notes = (*judge_cut(machine, structure, setup, cut=described), *notes)
    if "cutting" in setup.loads and setup.with_force:
        notes = (*chip.doubts(setup.speed, problem.tool.teeth), *notes)
    return replace(fine, halving=halving, notes=notes, path=side)


def _with_setup(fine: SideAccuracy, side: PathSide, setup: MillingSetup, *, chip: Chip, arcs: list[tuple[float, Arc]] | None
                ) -> tuple[str, ...]:
    """Return a side's notes with those of its chip, window, servos and block."""
    notes = fine.notes if arcs is None else (*fine.notes, _arc_words(arcs, side.length))
    if setup.servos:
        notes = (*notes, servo_words(setup.servos))
    if setup.window is not None and setup.window < side.law.duration:
        notes = (f"only {fine.duration:.6g} s of the middle of every side were run, in whole tooth periods", *notes)
    return (chip.words, *notes) if "cutting" in setup.loads and setup.with_force else notes


def _described(machine: Machine, cut: CuttingDescription | None) -> CuttingDescription:
    described = cut or machine.description.cutting
    if described is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    return described


def _arcs(structure: MovingStructure, setup: MillingSetup, bed: PixelBed | None, radius: float
          ) -> list[tuple[float, Arc]] | None:
    """Return the arcs of a side that the block leaves; None without a block."""
    if setup.work is None:
        return None
    side = structure.side
    # Of a tool that points against the normal of the path's plane left and right are exchanged.
    up = float(structure.axes[0][:, 2] @ side.place[:3, 2])
    if abs(up) < 0.99:
        fail("work", "a tool that leans to the plane of the path", "must stand upright on it for pixels",
             remedy="leave the block out: the cut's own arc holds then")
    return mill_bed(setup.work.bed() if bed is None else bed, side, radius, is_left=up > 0)


def _arc_words(arcs: list[tuple[float, Arc]], length: float) -> str:
    ends = [*(begin for begin, _ in arcs[1:]), length]
    air = sum(end - begin for (begin, arc), end in zip(arcs, ends, strict=True) if arc is None)
    # An arc of half a turn is a slot.
    slot = sum(end - begin for (begin, arc), end in zip(arcs, ends, strict=True) if arc is not None and arc[1] - arc[0] > 3.1)
    return (f"engagement from pixels, to a degree: {1e3 * slot:.4g} of {1e3 * length:.4g} mm in the full slot, "
            f"{1e3 * air:.4g} mm in the air")
