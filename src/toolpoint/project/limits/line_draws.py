"""Tips from files of responses, with the draws that these hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint import io, studies
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, response_dynamics
from toolpoint.vibration import Frf


def read_tip_file(path: Path, *, quantity: str | None = None, band: tuple[float, float] | None = None) -> ToolDynamics:
    """Return the dynamics of a tip or a work from one file: FRFs along x and y, or modes; band : Hz, of FRFs."""
    modes, frf = io.read_test_nouns([path], quantity=quantity)
    if modes is not None:
        return studies.modal_dynamics(modes, what=str(path))
    assert frf is not None
    return studies.response_dynamics(frf, band=band, what=path.name)


def read_work_file(path: Path, *, quantity: str | None = None, band: tuple[float, float] | None = None) -> ToolDynamics:
    """Return the dynamics of a work from one file, as `read_tip_file`; of a machine file (YAML) at the place of its `tool`."""
    if path.suffix.lower() in (".yaml", ".yml"):
        return studies.machine_work(io.read_machine(path))
    return read_tip_file(path, quantity=quantity, band=band)


@dataclass(frozen=True, eq=False)
class LineDraws:
    """Tips from responses that hold draws, as `toolpoint rcsa` saves them; poses play no part.

    dynamics : of the likeliest tip, as lines or modes; name : of their file.
    """

    dynamics: ToolDynamics
    name: str
    count: int
    seed: int

    def nominal(self, pose: Mapping[str, float]) -> ToolDynamics:
        """Return the dynamics of the likeliest tip."""
        return self.dynamics

    def drawn(self, pose: Mapping[str, float]) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws; where none are known all are the likeliest."""
        frf = self.dynamics.response
        if not isinstance(frf, Frf) or frf.draws is None or not len(frf.draws):
            return [self.dynamics] * self.count
        band = float(frf.frequency[0]), float(frf.frequency[-1])
        return [response_dynamics(Frf(frf.frequency, frf.draws[k % len(frf.draws)], frf.outputs, frf.inputs), band=band,
                                  what=self.name) for k in range(self.count)]

    def shares(self, pose: Mapping[str, float], cut: CuttingDescription) -> dict[str, float]:
        """Return the one source of draws."""
        return {f"response of {self.name}": 1.0}

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubt where the scatter of the response is not known."""
        frf = self.dynamics.response
        if isinstance(frf, Frf) and frf.draws is not None and len(frf.draws):
            return ()
        return (Doubt("interval of the limits", f"{self.name} holds no draws: for its tool the interval is of the coefficients "
                      "alone", "couple the tool with draws (toolpoint rcsa --save TIP.h5)"),)
