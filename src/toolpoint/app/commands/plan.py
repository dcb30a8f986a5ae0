"""Planning of hammer tests: plan."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from toolpoint import io, pages, studies
from toolpoint.app.declare import Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import MachineFile, Pose
from toolpoint.app.values import NewFile


@command()
def plan(run: Frame, machine: MachineFile, *, pose: Pose = None,
         number: Annotated[int, Help("Points to measure, three directions each.", name="--points", least=1)] = 12,
         file_points: Annotated[bool, Help("Choose among the points that the machine file names, not among 131 spread over its "
                                           "bodies.")] = False,
         highest: Annotated[float | None, Help("Highest mode that matters, Hz; all modes of the machine where left "
                                               "out.")] = None,
         struck: Annotated[int, Help("Most points and directions to strike.", least=1)] = 3,
         noise: Annotated[float, Help("Noise of the virtual test, percent of every channel.")] = 1.0,
         hits: Annotated[int, Help("Blows at every set-up.", least=1)] = 3,
         seed: Annotated[int, Help("Seed of the points that could be measured, and of the virtual tests.")] = 1,
         test: Annotated[NewFile | None, Help("Write the test file for `toolpoint frf` here (YAML).")] = None,
         geometry: Annotated[NewFile | None, Help("Write the points here (CSV).")] = None) -> None:
    """Plan a hammer test of a machine: where to measure and strike, how long, how fine, and which errors to expect.

    Points are chosen among 131 spread over the bodies, or among those that the file names, so that the modes of the file are
    told apart; a virtual test says what they give, beside random points.
    """
    built = io.read_machine_at(machine, pose)
    result = studies.plan_test(built, number, pose=pose, highest=highest, struck=struck, noise=noise / 100, hits=hits,
                               candidates=studies.list_points(built) if file_points else None,
                               rng=np.random.default_rng(seed), progress=run.progress_of_parts())
    run.save(pages.plan_page, result, run.warnings)
    if geometry is not None:
        io.write_points(result.candidates.coordinates, result.points, geometry)
    if test is not None:
        io.write_planned_test(built.name, result.struck, test, block=result.block,
                              geometry=None if geometry is None else geometry.name)
    run.show(result, result.notes, {"Test file": test, "Points": geometry})
