"""A screening that is stopped within a variant goes on from what that variant had finished."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from conftest import MACHINES
from toolpoint import io
from toolpoint.machine.description.variation import Factor
from toolpoint.studies.screening.designs import one_at_a_time
from toolpoint.studies.screening.screen import PARTS, screen

STEPS = 4


@dataclass(frozen=True)
class SlowMetric:
    """A metric of four steps, each kept as a file; stopped after so many steps of all."""

    log: list
    stop: int
    folder: Path | None = None

    @property
    def identity(self):
        return "slow"

    def kept_in(self, folder):
        return replace(self, folder=folder)

    def __call__(self, machine):
        self.folder.mkdir(parents=True, exist_ok=True)
        for step in range(STEPS):
            part = self.folder / str(step)
            if not part.exists():
                if len(self.log) == self.stop:
                    raise KeyboardInterrupt
                self.log.append(step)
                part.write_text("done")
        return {"answer": 1.0}


def test_no_step_is_run_twice_and_finished_variants_leave_no_parts(tmp_path):
    machine = io.read_machine(MACHINES / "three_axis_vertical.yaml")
    design = one_at_a_time([Factor("damping", ("damping_ratio",), 0.5, 2.0)])
    log: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        screen(machine, design, SlowMetric(log, STEPS + 2), folder=tmp_path, chunk_seconds=1e-6)
    assert len(log) == STEPS + 2 and len(list((tmp_path / PARTS).glob("*/*"))) == 2
    result = screen(machine, design, SlowMetric(log, 1000), folder=tmp_path, chunk_seconds=1e-6)
    assert len(log) == STEPS * len(design.points) and not result.failures
    assert not list((tmp_path / PARTS).glob("*"))
