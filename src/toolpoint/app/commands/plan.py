"""Planning of hammer tests: plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, POSE


@click.command()
@click.argument("machine", type=FILE)
@POSE
@click.option("--points", "number", default=12, show_default=True, type=click.IntRange(1), help="Points to measure, three "
                                                                                             "directions each.")
@click.option("--file-points", is_flag=True, help="Choose among the points that the machine file names, not among 131 spread "
                                                  "over its bodies.")
@click.option("--highest", type=float, help="Highest mode that matters, Hz; all modes of the machine where left out.")
@click.option("--struck", default=3, show_default=True, type=click.IntRange(1), help="Most points and directions to strike.")
@click.option("--noise", default=1.0, show_default=True, type=float, help="Noise of the virtual test, percent of every "
                                                                          "channel.")
@click.option("--hits", default=3, show_default=True, type=click.IntRange(1), help="Blows at every set-up.")
@click.option("--seed", default=1, show_default=True, help="Seed of the points that could be measured, and of the virtual "
                                                           "tests.")
@click.option("--test", type=NEW_FILE, help="Write the test file for `toolpoint frf` here (YAML).")
@click.option("--geometry", type=NEW_FILE, help="Write the points here (CSV).")
@OUTPUT
@JSON
def plan(machine: Path, pose: dict[str, float] | None, number: int, file_points: bool, highest: float | None, struck: int,
         noise: float, hits: int, seed: int, test: Path | None, geometry: Path | None, output: Path, as_json: bool) -> None:
    """Plan a hammer test of a machine: where to measure and strike, how long, how fine, and which errors to expect.

    Points are chosen among 131 spread over the bodies, or among those that the file names, so that the modes of the file are
    told apart; a virtual test says what they give, beside random points.
    """
    from toolpoint.app.poses import machine_at
    from toolpoint.io.yaml.testing import plan_writing

    built = machine_at(machine, pose)
    with frame(output, as_json) as run, run.progress_of_parts() as progress:
        import numpy as np

        from toolpoint.pages.testing.test_plan import plan_page
        from toolpoint.studies.machines.virtual_test import list_points
        from toolpoint.studies.testing.modal_test_plan import plan_test

        result: Any = plan_test(built, number, pose=pose, highest=highest, struck=struck, noise=noise / 100, hits=hits,
                                candidates=list_points(built) if file_points else None,
                                rng=np.random.default_rng(seed), progress=progress)
        run.save(plan_page(result, run.warnings))
    if geometry is not None:
        plan_writing.write_geometry(result.candidates.coordinates, result.points, geometry)
    if test is not None:
        plan_writing.write_test(built.name, result.struck, test, block=result.block,
                                geometry=None if geometry is None else geometry.name)
    run.show(result, result.notes, {"Test file": test, "Points": geometry})
