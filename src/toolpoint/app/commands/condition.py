"""Commands about the condition of a machine over time: drift."""

from __future__ import annotations

from typing import Annotated

from toolpoint import io, pages, studies
from toolpoint.app.declare import Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Band, Files, Geometry, Naming, Pose, Quantity
from toolpoint.app.values import SourceFile


@command(steps=4)
def drift(run: Frame, files: Files, *,
          baselines: Annotated[tuple[SourceFile, ...], Help("Modes or responses of the machine as it was; several tests of it "
                                                            "show "
                                                            "how well tests repeat.", name="--baseline")],
          machine: Annotated[SourceFile | None, Help("The machine file (YAML), calibrated on the baseline: which joint or mass "
                                                     "changed is ranked by it.")] = None,
          pose: Pose = None, geometry: Geometry = None,
          components: Annotated[SourceFile | None, Help("YAML: which measured points ride on which body of the machine; "
                                                        "otherwise "
                                                        "equal names are the same points.",
                                                        needs="--geometry, for the positions of the points")] = None,
          repeatability: Annotated[float, Help("What frequencies of two tests of an unchanged machine differ by, besides noise "
                                               "(standard deviation), %.", scale=1e-2, above=0)] = 0.2,
          false_alarms: Annotated[float, Help("How often an unchanged machine may be called changed, %.", scale=1e-2,
                                              above=0)] = 1.0,
          band: Band = None, quantity: Quantity = None, naming: Naming) -> None:
    """Whether a machine has changed since an earlier test, which modes moved, and which joint is likeliest.

    FILES are later tests in their order in time, a file each: modes saved by `identify` or `operational`, or responses.
    """
    first, current = ([io.read_test_nouns([file], quantity=quantity, **naming.keywords) for file in group]
                      for group in (baselines, files))
    built = None if machine is None else io.read_machine_at(machine, pose)
    places = None if geometry is None else io.read_geometry(geometry).points
    owner = None if components is None else io.read_components(components).points
    if built is not None and owner is not None and places is not None:
        built = studies.with_measured_points(built, places, owner)
    run.step("modes")
    baseline, tests = ([studies.modes_of_test(*nouns, band=band)[0] for nouns in group] for group in (first, current))
    run.step("comparison")
    result = studies.study_drift(baseline, tests, built, pose=pose, names=[file.stem for file in files],
                                 repeatability=studies.Repeatability(repeatability), false_alarms=false_alarms)
    run.present(pages.drift_page, result, "" if built is None else built.name, warnings=run.warnings)
