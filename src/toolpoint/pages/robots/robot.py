"""The page of a robot's datasheet: gearing, forces on the base, differences, and what every number rests on."""

from __future__ import annotations

from toolpoint._rounding import number_text
from toolpoint.plot import Cell, Listing, Notes, Report, Table
from toolpoint.studies.robots.datasheet_study import DatasheetStudy


def robot_page(result: DatasheetStudy, text: str, name: str) -> Report:
    """Return the page of a datasheet study; `text` is the file.

    Examples
    --------
    Runs in ``examples/make_a_robot_of_its_datasheet.py``.
    """
    report = Report(f"From the datasheet: {result.sheet.name}", _answer(result), subtitle=result.sheet.source)
    gearing = Table(
        ["axis", "R_t", "R_r", "T_t, N m", "against load moment, %", "reducer", "holds, N m", "inertia, kg m^2"],
        [[row.axis, row.total_ratio, row.reducer_ratio, row.torque,
          "" if row.deviation is None else f"{100 * row.deviation:+.0f}",
          row.reducer, float(hold), float(inertia)]
         for row, hold, inertia in zip(result.gearing, result.holding, result.inertia, strict=True)],
        "R_t = n_max/w_max, R_r = R_t/R_m, T_t = R_t T_s; holding torque and inertia with the arm stretched out")
    loads = [result.rest_load, *result.stops]
    base = Table(["case", "M_v, N m", "F_v, N", "M_h, N m", "F_h, N"],
                 [[load.name, load.vertical_moment, load.vertical_force, load.horizontal_moment, load.horizontal_force]
                  for load in loads], f"Axes stop from their largest speed in {1e3 * result.sheet.stop_time:.0f} ms")
    modes = Table(["mode", "as in the file, Hz", *(f"{name}, Hz" for name in result.ways)], result.mode_rows(),
                  f"At the reference pose, undamped; in brackets the error against {list(result.ways)[-1]}")
    origins = Table(["part", "numbers", "origin"], [[part, what, Cell(origin, origin.split()[0].rstrip(";:"))]
                                                    for part, what, origin in result.origins])
    report = report.with_doubts(*result.differences)
    report = report.with_section("Gear ratios and torques", gearing).with_section("Forces on the base", base)
    report = report.with_section("Natural frequencies", modes, Notes([result.rotors], "note", "Rotors of the motors"))
    if result.slopes:
        report = report.with_section("Reducers of several slopes",
                                     Notes(result.slopes, "note", "Their torsion hangs on the load"))
    report = report.with_section("What the numbers rest on", origins).with_assumptions(
        *result.machine.description.assumptions, "Modes are those at the reference pose, without damping.")
    return report.with_section("File", Listing(name, text))


def _answer(result: DatasheetStudy) -> str:
    """Return the lowest frequency and how far the load moments agree."""
    drop = 100 * (float(result.frequency[0]) / float(result.rigid[0]) - 1)
    deviations = [abs(row.deviation) for row in result.gearing if row.deviation is not None]
    words = (f"The lowest natural frequency is {number_text(float(result.frequency[0]))} Hz ({drop:+.0f} % against rigid "
             "members), at the reference pose, undamped")
    return words + (f"; torques by gear ratio and stated load moments differ by up to {100 * max(deviations):.0f} %."
                    if deviations else ".")
