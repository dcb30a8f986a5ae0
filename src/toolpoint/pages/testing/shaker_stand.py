"""The page of a machine's responses as a shaker measures them, hung and standing on the machine."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.shaker import plot_force_per_volt
from toolpoint.studies.testing.shaker_stand import STAND_HEADER, ShakerStand


def shaker_stand_page(result: ShakerStand, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the responses, hung beside standing, and of the force per volt where the coil is known.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription, InertiaDescription, JointDescription, MachineDescription, PointDescription)
    >>> from toolpoint.studies import stand_shaker
    >>> from toolpoint.substructuring.shaker import ElectrodynamicShaker
    >>> inertia = InertiaDescription(1.0, 1.0, 1.0)
    >>> bodies = {"bed": BodyDescription(600.0, inertia=inertia), "head": BodyDescription(200.0, inertia=inertia)}
    >>> joints = {"lower": JointDescription("ground", "bed", stiffness={"z": 1e7}),
    ...           "upper": JointDescription("bed", "head", stiffness={"z": 5e6})}
    >>> points = {"table": PointDescription("bed"), "tip": PointDescription("head")}
    >>> machine = build(MachineDescription("slide", bodies, joints, points=points, damping_ratio=0.02))
    >>> shaker = ElectrodynamicShaker(20.0, 0.4, 5e3, suspension_damping=5.0)
    >>> stand = stand_shaker(machine, shaker, "tip:+z", stand="table", frequency=np.linspace(10, 60, 101))
    >>> shaker_stand_page(stand).title
    'slide: a shaker at tip:+z, hung or standing at table:+z'
    """
    report = Report(f"{result.name}: a shaker at {result.driven}, hung or standing at {result.stand}", result.status)
    report = report.with_doubts(*result.doubts)
    report = report.with_section("Responses", Table(list(STAND_HEADER), result.rows()))
    for output in result.hung.outputs:
        curves = {name: frf.selected([output], frf.inputs)
                  for name, frf in (("hung: true", result.hung), ("standing", result.standing))}
        report = report.with_section(f"{output}", Chart(bode(curves, title=f"{output} / {result.driven}"),
                                                        "By the force cell at the driving point."))
    if result.force is not None:
        chart = plot_force_per_volt(result.hung.frequency, {"hung": result.force[:, 0], "standing": result.force[:, 1]})
        report = report.with_section("Force per volt", Chart(chart, "Where it drops, noise takes its place."))
    return with_remarks(report, list(result.notes), warnings)
