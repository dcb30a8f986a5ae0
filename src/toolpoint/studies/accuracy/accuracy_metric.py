"""Milling accuracy of a machine as a metric of screenings: mean errors of every side and over all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.accuracy.chip import side_chip
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, load_words, mill_path
from toolpoint.studies.accuracy.moving_structure import structure_along
from toolpoint.studies.accuracy.side_stability import judge_cut
from toolpoint.studies.accuracy.tool_paths import PathSide


@dataclass(frozen=True)
class AccuracyMetric:
    """``position error`` (m) and ``rotation error`` (rad), means over the sides, and each side's own.

    folder : where finished blocks of the steps of a run are kept, see `mill_path`; no part of what the metric is.

    Examples
    --------
    >>> from toolpoint.studies.accuracy.tool_paths import square
    >>> AccuracyMetric(square(0.1), MillingSetup(speed=6000.0, depth=2e-3)).loads
    "the cut, the chip as the cut's own entry says"
    """

    sides: tuple[PathSide, ...]
    setup: MillingSetup
    cut: CuttingDescription | None = None
    folder: Path | None = None

    @property
    def identity(self) -> str:
        """Key of this metric among others."""
        places = [(side.name, side.path.start.tolist(), side.path.end.tolist(), side.place.tolist(),
                   repr(side.law)) for side in self.sides]
        return repr((places, self.setup, self.cut))

    @property
    def loads(self) -> str:
        """Loads for which the errors hold, in words."""
        return load_words(self.setup.loads, self.setup.regenerative, self.setup.chip)

    def on_branch(self, branch: str) -> AccuracyMetric:
        """Return the metric with the arm on another branch."""
        return replace(self, setup=replace(self.setup, stance=replace(self.setup.stance, branch=branch)))

    def kept_in(self, folder: Path) -> AccuracyMetric:
        """Return the metric with the blocks of its runs kept in a folder."""
        return replace(self, folder=folder)

    def judge(self, machine: Machine) -> tuple[str, ...]:
        """Return doubts that the cut chatters along the sides, see `judge_cut`; a line for each side that cannot be judged."""
        cut = self.cut or machine.description.cutting
        if cut is None:
            return ()
        lines: list[str] = []
        for side in self.sides:
            try:  # with the spacing of the runs: farther apart, axes that turn fast look like a jump
                structure = structure_along(machine, side, self.setup.stance, spacing=self.setup.spacing)
            except ToolpointError as error:
                lines.append(f"whether the cut chatters was not judged: {error}")
                continue
            lines += judge_cut(machine, structure, self.setup, cut=cut)
            lines += self._chip_doubts(side, cut)
        return tuple(dict.fromkeys(lines))

    def _chip_doubts(self, side: PathSide, cut: CuttingDescription) -> tuple[Doubt, ...]:
        teeth = cut.tool.teeth
        chip = side_chip(cut, side, tooth=60 / (self.setup.speed * teeth), requested=self.setup.chip)
        return chip.doubts(self.setup.speed, teeth)

    def __call__(self, machine: Machine) -> dict[str, float]:
        """Return the errors of a machine."""
        result = mill_path(machine, self.sides, self.setup, cut=self.cut, judged=False, folder=self.folder)
        errors = {"position error": result.position_error, "rotation error": result.rotation_error}
        if len(result.sides) > 1:
            errors |= {f"position error {side.name}": side.position_error for side in result.sides}
            errors |= {f"rotation error {side.name}": side.rotation_error for side in result.sides}
        return errors
