"""Study of a robot's datasheet: every step to its machine, numbers published, computed or chosen, and contradictions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.machine.assembly.inverse_dynamics import axis_mass_matrix
from toolpoint.machine.description import MachineDescription, MeshDescription
from toolpoint.machine.description.elastic import SolidBody
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.build import build
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.machine.robot.gearing import AxisGearing, compute_gearing, reducers_of
from toolpoint.machine.robot.model import bending_members, rigid_members, robot_machine
from toolpoint.machine.robot.rotors import rotor_momenta, with_rotors
from toolpoint.studies.robots.statics import BaseLoad, base_load, holding_torque, stop_loads, stop_time_for, stretch_arm
from toolpoint.studies.text_table import text_table

RIGID, BEAMS, ELEMENTS = "members rigid", "members as beams", "members by finite elements"
# Axis (from 0) that alone makes each of the two moments of a power-off stop as it brakes, stretched out.
_STOPS = ((1, "vertical_moment"), (0, "horizontal_moment"))


@dataclass(frozen=True, eq=False)
class DatasheetStudy(NotebookText):
    """Machine and numbers that follow from a datasheet.

    gearing : one for each axis; pose : the arm stretched out; rest_load : base reaction there at rest; stops : while axes stop;
    holding : torque of every axis there, N m; inertia : of every axis there, kg m^2; frequency : Hz at the reference pose;
    ways : the same with all members rigid, as beams, and by finite elements; rotors : what their spin does to them, in words;
    slopes : what the loads do to them where the torsion of reducers hangs on the load, in words; differences : what does not
    follow or does not agree, a line each; origins : what every number rests on.
    """

    sheet: RobotDatasheet
    machine: Machine
    gearing: tuple[AxisGearing, ...]
    pose: Mapping[str, float]
    rest_load: BaseLoad
    stops: tuple[BaseLoad, ...]
    holding: FloatArray
    inertia: FloatArray
    frequency: FloatArray
    ways: Mapping[str, FloatArray]
    rotors: str
    slopes: tuple[str, ...]
    differences: tuple[str, ...]
    origins: tuple[tuple[str, str, str], ...]

    @property
    def rigid(self) -> FloatArray:
        """Natural frequencies with all members rigid, Hz."""
        return self.ways[RIGID]

    def mode_rows(self) -> list[list[str]]:
        """Return a row for every mode: its frequency as in the file, and with members modelled in other ways.

        The error of each is that against the most detailed way.
        """
        # The last way is the most detailed one.
        best = list(self.ways.values())[-1]
        return [[str(i + 1), f"{f:.2f}", *(f"{v[i]:.2f} ({100 * (v[i] / best[i] - 1):+.1f} %)" for v in self.ways.values())]
                for i, f in enumerate(self.frequency)]

    def table(self) -> str:
        """Return gearing, base reactions, differences and origins as text."""
        rows = [[row.axis, f"{row.total_ratio:.1f}", f"{row.reducer_ratio:.1f}", f"{row.torque:.1f}",
                 "" if row.deviation is None else f"{100 * row.deviation:+.0f} %", row.reducer, f"{hold:.1f}", f"{inertia:.3g}",
                 "" if row.reflected_inertia is None else f"{row.reflected_inertia:.3g}"]
                for row, hold, inertia in zip(self.gearing, self.holding, self.inertia, strict=True)]
        gearing = text_table(f"{self.sheet.name}: gear ratios and torques", [
            "axis", "R_t", "R_r", "T_t N m", "against load moment", "reducer", "holds N m", "inertia kg m^2",
            "rotor through ratio"], rows)
        loads = text_table("Forces on the base, arm stretched out", ["case", "M_v N m", "F_v N", "M_h N m", "F_h N"],
                           [self.rest_load.row(), *(["manual, " + name, f"{p.vertical_moment:.1f}", f"{p.vertical_force:.1f}",
                                                     f"{p.horizontal_moment:.1f}", f"{p.horizontal_force:.1f}"]
                                                    for name, p in self._manual()), *(load.row() for load in self.stops)])
        origins = text_table("What the numbers rest on", ["part", "numbers", "origin"], [list(row) for row in self.origins])
        best = list(self.ways)[-1]
        modes = text_table(f"Natural frequencies at the reference pose, Hz; in brackets the error against {best}",
                           ["mode", "as in the file", *self.ways], self.mode_rows())
        lines = ["Differences:", *(f"- {line}" for line in self.differences)]
        stop = f"stops: every axis from its largest speed to rest in {1e3 * self.sheet.stop_time:g} ms, evenly"
        return "\n".join([gearing, loads, stop, modes, *self.slopes, self.rotors, *lines, origins])

    def _manual(self) -> list[tuple[str, Any]]:
        named = [("still", self.sheet.stillness), ("power-off stop", self.sheet.power_off)]
        return [(name, part) for name, part in named if part is not None]

    def to_dict(self) -> dict[str, Any]:
        """Return the study as plain numbers and text, SI."""
        return {"gearing": [{"axis": r.axis, "total_ratio": r.total_ratio, "reducer_ratio": r.reducer_ratio, "torque": r.torque,
                             "deviation": r.deviation, "reducer": r.reducer, "reflected_inertia": r.reflected_inertia}
                            for r in self.gearing],
                "still": vars(self.rest_load), "stops": [vars(load) for load in self.stops], "pose": dict(self.pose),
                "holding_torque": self.holding.tolist(), "inertia": self.inertia.tolist(),
                "frequency_hz": self.frequency.tolist(), "rigid_frequency_hz": self.rigid.tolist(),
                "frequency_by_members_hz": {name: values.tolist() for name, values in self.ways.items()},
                "rotors": self.rotors, "slopes": list(self.slopes),
                "differences": list(self.differences), "origins": [list(row) for row in self.origins]}

    def __repr__(self) -> str:
        return f"DatasheetStudy({self.sheet.name!r}, {len(self.gearing)} axes, {len(self.differences)} differences)"


def study_datasheet(sheet: RobotDatasheet, description: MachineDescription, *, finite_elements: bool = True,
                    pose: Mapping[str, float] | None = None) -> DatasheetStudy:
    """Return the steps from a datasheet to the machine that `io` or `robot_machine` made of it.

    With `finite_elements` the members that bend are also reduced from finite elements, to say what rigid members and beams
    are worth (some seconds). pose : rad, at whose load the description's reducers were linearised; the reference pose where
    left out.

    Examples
    --------
    Runs in ``examples/make_a_robot_of_its_datasheet.py``.
    """
    machine = build(description)
    gearing = compute_gearing(sheet)
    # Weights and inertia are those of the members as they stand; finite elements have none of their own there.
    meshes, solids = _given_shapes(sheet, description)
    bends = any(body.modal_count for body in machine.bodies)
    arm = build(robot_machine(rigid_members(sheet), meshes=meshes, solids=solids)) if bends else machine
    stretched = stretch_arm(arm)
    rest_load = base_load(arm, "at rest", stretched, sheet=sheet)
    stops = tuple(stop_loads(arm, sheet, stretched))
    inertia = np.diagonal(axis_mass_matrix(arm, stretched)[0])
    frequency = natural_frequencies(machine, {}, 4)[0]
    return DatasheetStudy(sheet, machine, gearing, stretched, rest_load, stops, holding_torque(arm, sheet, stretched), inertia,
                          frequency,
                          _by_members(sheet, description, finite_elements, pose), _rotors(sheet, description, frequency),
                          tuple(_slopes(sheet, description, stretched, pose)),
                          tuple(_differences(sheet, arm, gearing, stretched, rest_load)),
                          tuple(_origins(sheet, description)))


def _rotors(sheet: RobotDatasheet, description: MachineDescription, frequency: FloatArray) -> str:
    """Return the effect of the rotors' spin on the natural frequencies at the axes' largest speeds."""
    momenta = rotor_momenta(sheet)
    if not momenta:
        return "rotors: no placed motor has a known inertia; their gyroscopic part is not judged"
    # Spin at the largest speeds bounds what it does at any.
    spun = natural_frequencies(build(with_rotors(description, sheet)), {}, 4)[0]
    change = float(np.abs(spun / frequency - 1).max())
    largest_momentum = max(momenta.values())
    words = (f"rotors: at the largest speeds of all axes their momenta reach {largest_momentum:.2g} N m s and change these "
             f"frequencies by "
             f"{change:.1e} of themselves")
    return words + ("; left out below" if change < 1e-4 else "; put them in with machine.robot.rotors.with_rotors")


def _slopes(sheet: RobotDatasheet, description: MachineDescription, stretched: Mapping[str, float],
            pose: Mapping[str, float] | None) -> list[str]:
    """Return the effect of the reducers' load on the natural frequencies, on members as beams."""
    if not any(part.has_slopes for part in reducers_of(sheet).values()):
        return []
    meshes, solids = _given_shapes(sheet, description)
    beams = bending_members(sheet, "beam")
    frequency = natural_frequencies(build(robot_machine(beams, meshes=meshes, solids=solids, pose=pose)), {}, 4)[0]
    cases = {"with no load": robot_machine(beams, meshes=meshes, solids=solids, loads={}),
             "with the load of the stretched arm": robot_machine(beams, meshes=meshes, solids=solids, pose=stretched)}
    lines = [line for line in description.assumptions if "slopes is linearised" in line]
    for words, other in cases.items():
        change = natural_frequencies(build(other), {}, 4)[0] / frequency - 1
        lines.append(f"the same frequencies {words} on the reducers: " + ", ".join(f"{100 * v:+.1f} %" for v in change))
    return [*lines, "a machine holds for the load it is made about: make that of the pose you mill at (`pose`)"]


def _by_members(sheet: RobotDatasheet, description: MachineDescription, finite_elements: bool,
                pose: Mapping[str, float] | None) -> dict[str, FloatArray]:
    """Return the first natural frequencies with members rigid, as beams, and by finite elements."""
    meshes, solids = _given_shapes(sheet, description)
    sheets = {RIGID: rigid_members(sheet), BEAMS: bending_members(sheet, "beam")}
    if finite_elements:
        sheets[ELEMENTS] = bending_members(sheet, "finite elements")
    return {name: natural_frequencies(build(robot_machine(part, meshes=meshes, solids=solids, pose=pose)), {}, 4)[0]
            for name, part in sheets.items()}


def _given_shapes(sheet: RobotDatasheet, description: MachineDescription
                  ) -> tuple[dict[str, MeshDescription], dict[str, SolidBody]]:
    """Return the surfaces and the finite elements of the members that are meshes, by member."""
    meshes: dict[str, MeshDescription] = {}
    solids: dict[str, SolidBody] = {}
    links: set[int] = set()
    for name, member in sheet.members.items():
        # The first member of a link names its body after the link; further members have bodies of their own.
        body = description.bodies.get(name if member.link in links else f"link{member.link}")
        links.add(member.link)
        if member.kind == "mesh" and body is not None:
            if body.mesh is not None:
                meshes[name] = body.mesh
            if body.solid is not None:
                solids[name] = body.solid
    return meshes, solids


def _differences(sheet: RobotDatasheet, machine: Machine, gearing: tuple[AxisGearing, ...], pose: Mapping[str, float],
                 rest_load: BaseLoad) -> list[str]:
    lines = [f"axis {row.axis}: {text}" for row in gearing for text in row.disagreements]
    lines += [f"axis {row.axis}: {row.reducer} is named, {row.nearest_reducer} is nearer in ratio" for row in gearing
              if row.reducer != row.nearest_reducer]
    lines += _reach_lines(sheet)
    lines += [f"axis {axis.name}: holding the stretched arm takes {abs(torque):.1f} N m, more than the {row.torque:.1f} N m "
              f"at stall"
              for axis, row, torque in zip(sheet.axes, gearing, holding_torque(machine, sheet, pose), strict=True)
              if abs(torque) > row.torque]
    if sheet.stillness is not None:
        lines.append(f"at rest M_v is {rest_load.vertical_moment:.1f} N m, the manual states "
                     f"{sheet.stillness.vertical_moment:g}: "
                     "the distribution of mass along the arm is chosen, and the manual's pose is not known")
    if sheet.power_off is not None:
        for axis, field in _STOPS:
            value = getattr(sheet.power_off, field)
            time = stop_time_for(machine, sheet, pose, axis=axis, field=field, value=value)
            lines.append(f"power-off stop: the manual's {field.replace('_', ' ')} of {value:g} N m is that of "
                         f"{sheet.axes[axis].name} alone stopping in {1e3 * time:.0f} ms; {1e3 * sheet.stop_time:.0f} ms is "
                         "chosen, the manual's motion is not "
                         "published")
    return lines


def _reach_lines(sheet: RobotDatasheet) -> list[str]:
    """Return a line where the printed reach contradicts the table: for six axes, a_1 + a_2 + the forearm's diagonal."""
    if sheet.reach is None or len(sheet.axes) < 4:
        return []
    first, second, third, fourth = sheet.axes[:4]
    # Straight arm of a vertical six-axis robot: offset, upper arm, and the forearm with its offset.
    reach = abs(first.a) + abs(second.a) + float(np.hypot(third.a, fourth.d))
    # Half a millimetre is the rounding of a printed reach.
    if abs(reach - sheet.reach) < 5e-4:
        return []
    return [f"reach printed {1e3 * sheet.reach:g} mm, the table's lengths give {1e3 * reach:.1f} mm to the wrist"]


def _origins(sheet: RobotDatasheet, description: MachineDescription) -> list[tuple[str, str, str]]:
    rows = [(f"axis {axis.name}", "lengths, angles, speed, load moment, stage", axis.source) for axis in sheet.axes]
    rows += [(f"motor {name}", "stall torque, speed, mass", part.source) for name, part in sheet.motors.items()]
    rows += [(f"reducer of {axis}", f"torsion {', '.join(f'{k:g}' for k in part.torsion)}, bending {part.bending:g} N m/rad, "
              "mass", part.source)
             for axis, part in reducers_of(sheet).items()]
    rows += [(name, "shape and place", part.source) for name, part in sheet.members.items()]
    rows += [(f"motor of {place.axis}", "place", place.source) for place in sheet.motor_places]
    rows.append(("payload", "mass and size", sheet.payload.source))
    rows += [("ratios, torques", "R_t = n_max/w_max, R_r = R_t/R_m, T_t = R_t T_s", "computed")]
    rows += [("density", next((line for line in description.assumptions if line.startswith("computed")), ""), "computed")]
    return rows
