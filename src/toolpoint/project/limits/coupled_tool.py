"""Tips of a project's tool at another stick-out: its shaft coupled to the spindle, with draws of gauge and tool."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._check import fail
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import Machine
from toolpoint.machine.description.project_plan import CoupledTool
from toolpoint.project.limits.attached_tool_draws import AttachedToolDraws, prediction_doubt
from toolpoint.project.limits.line_draws import LineDraws
from toolpoint.studies.cuts.coupling.machine_spindle import tip_frf
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, response_dynamics
from toolpoint.substructuring.receptance import PlaneReceptance
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.substructuring.spindle import CoupledTip

KEPT_SPINDLES = 4  # in memory, by the content of their files
COUPLED_NAME = "the coupled tool"  # in messages
MAX_STICK_OUT_RATIO = 1.6  # of the described length, to either side: what a tool is clamped at


@dataclass(frozen=True, eq=False)
class CoupledDraws:
    """Tips of a tool on a struck spindle, drawn from the scatter of the gauge's responses and the deviations of the tool; poses
    play no part.

    coupled : the tip in the planes that are known; stick_out : m; notes : of the coupling, doubts first.
    """

    coupled: CoupledTip
    stick_out: float
    notes: tuple[str, ...]
    count: int
    seed: int

    def nominal(self, pose: Mapping[str, float]) -> ToolDynamics:
        """Return the dynamics of the likeliest tip."""
        return self._lines.nominal(pose)

    def drawn(self, pose: Mapping[str, float]) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws; where no scatter is known all are the likeliest."""
        return self._lines.drawn(pose)

    def shares(self, pose: Mapping[str, float], cut: CuttingDescription) -> dict[str, float]:
        """Return the one source of draws."""
        return {"gauge and tool": 1.0}

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts of the coupling, and that it is a prediction."""
        return (*doubts_among(self.notes), prediction_doubt(self.stick_out))

    @cached_property
    def _lines(self) -> LineDraws:
        frf = tip_frf(self.coupled, self.notes)
        band = float(frf.frequency[0]), float(frf.frequency[-1])
        return LineDraws(response_dynamics(frf, band=band, what=COUPLED_NAME), COUPLED_NAME, self.count, self.seed)


def stick_out_range(plan: CoupledTool, folder: Path) -> tuple[str, float, float, float]:
    """Return the segment whose length is the stick-out, its described length, and the ends of a range about it, m."""
    segment, length = _segment(plan, io.read_shaft(folder / plan.tool))
    return segment, length, length / MAX_STICK_OUT_RATIO, length * MAX_STICK_OUT_RATIO


def couple_at(plan: CoupledTool, folder: Path, stick_out: float, *, machine: Machine | None = None, draws: int, seed: int
              ) -> CoupledDraws | AttachedToolDraws:
    """Return the draws of a project's tool at a stick-out, m: on the machine where it begins at one of its points (and then at
    any pose), otherwise on the spindle that a gauge gives.

    Raises ToolpointError for a point without a machine, and for lengths beyond `MAX_STICK_OUT_RATIO` of the described one.
    """
    tool = io.read_shaft(folder / plan.tool)
    segment, length = _segment(plan, tool)
    if not length / MAX_STICK_OUT_RATIO <= stick_out * (1 + 1e-9) or stick_out > length * MAX_STICK_OUT_RATIO * (1 + 1e-9):
        fail("stick_out", f"{1e3 * stick_out:.4g} mm", f"must be within a factor of {MAX_STICK_OUT_RATIO:g} of the "
             f"{1e3 * length:.4g} mm of segment {segment}", remedy="describe the tool at about this length")
    shaft = tool.with_length(segment, stick_out)
    if plan.point is not None:
        if machine is None:
            fail("coupling.point", repr(plan.point), "needs a machine (machine, or a test with components and geometry)")
        return AttachedToolDraws(machine, draws, seed, plan.point, shaft, stick_out)
    study = studies.study_tool(_spindle_of(plan, folder, draws, seed), shaft, generator=np.random.default_rng(seed))
    return CoupledDraws(study.coupled, stick_out, study.notes, draws, seed)


def _segment(plan: CoupledTool, tool: ShaftDescription) -> tuple[str, float]:
    name = plan.segment or next(iter(tool.segments))
    if name not in tool.segments:
        fail("coupling.segment", repr(name), f"must be of {', '.join(tool.segments)}")
    return name, tool.segments[name].length


def _spindle_of(plan: CoupledTool, folder: Path, draws: int, seed: int) -> list[PlaneReceptance]:
    """Return the receptance of a struck spindle in the planes that are known, kept while its files stay."""
    files = tuple(str(folder / name) for name in (str(plan.gauge), *plan.responses))
    stamps = tuple((Path(name).stat().st_size, Path(name).stat().st_mtime_ns) for name in files)
    return list(_struck_spindle(files, stamps, plan.noise, draws, seed))


@lru_cache(maxsize=KEPT_SPINDLES)
def _struck_spindle(files: tuple[str, ...], stamps: tuple[Any, ...], noise: float | None, draws: int, seed: int
                    ) -> tuple[PlaneReceptance, ...]:
    """Return the spindle of a gauge's files; stamps : of these files, so that a changed one is read anew."""
    frf, gauge = io.read_frf(list(map(Path, files[1:]))), io.read_shaft(Path(files[0]))
    return tuple(studies.bases_from_gauge(frf, gauge, noise=noise, draws=draws, generator=np.random.default_rng(seed)))


def coupling_words(plan: CoupledTool, machine_file: str, stick_out: float, *, segment: str) -> list[str]:
    """Return the words of the command that couples the tool at this stick-out."""
    words = ["rcsa", plan.tool, "--stick-out", f"{segment}={1e3 * stick_out:.6g}mm:{1e3 * stick_out:.6g}mm:1"]
    if plan.point is not None:
        return [*words, "--machine", machine_file, "--at", plan.point]
    words += [word for name in plan.responses for word in ("--frf", name)]
    words += ["--gauge", str(plan.gauge)]
    return [*words, *(["--noise", f"{100 * plan.noise:g}"] if plan.noise is not None else [])]
