"""Work that gives way along a program: its response beside a fresh mesh of what is left, walls, limits, doubts and refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toolpoint import ToolpointError, io, studies
from toolpoint.app.main import main
from toolpoint.bodies.solid import Casting, Cuboid, Material, PlaneFaces, SolidModel
from toolpoint.bodies.solid.element_places import locate
from toolpoint.cutting import Engagement, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.course_doubts import question_lines
from toolpoint.studies.machining.thin_walls.part_stages import solve_stage
from toolpoint.studies.machining.thin_walls.part_states import solve_between
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.sparse import factorise, modes

MM = 1e-3
ALUMINIUM = Material(70e9, 0.33, 2700.0)
LENGTH, HEIGHT = 48 * MM, 30 * MM
FOOT = PlaneFaces((0, 0, 0), (0, 0, 1))
CUT = CuttingDescription.of(diameter=0.024, teeth=4, tangential=4e9, normal=2e9)
# The plate is cut from 4 to 3 mm down to its foot, then a finishing pass of 0.05 mm takes the upper 3 mm.
PROGRAM = "S{speed} M3\nF600\nG0 X-16 Y15 Z60\nG0 Z0\nG1 X64\nG0 Z60\nG0 X-16 Y14.95\nG0 Z27\nG1 X64\nG0 Z60\n"
FINISHING_LINE = 9


def plate(thickness: float = 4 * MM, size: float = 4 * MM, material: Material = ALUMINIUM) -> SolidModel:
    return Casting([Cuboid((0, 0, 0), (LENGTH, thickness, HEIGHT))], {"body": material}).meshed(size)


def tip(stiffness_factor: float = 1.0) -> ToolDynamics:
    return studies.modal_dynamics(Modes([900.0, 1100.0], [0.03, 0.03], np.diag([2.0, 2.0]) / np.sqrt(stiffness_factor),
                                        ("tip:+x", "tip:+y")))


def run(work: Any, *, speed: float = 9000, dynamics: ToolDynamics | None = None, text: str = PROGRAM, **values: Any
        ) -> MachiningStudy:
    lengths = (0, 0, 0, LENGTH, 4 * MM, HEIGHT)
    setup = studies.describe_machining(studies.stock_of("box", lengths), CUT, spacing=0.5 * MM, **values)
    program = text.format(speed=speed)
    return studies.run_program(parse(program, start=(0, 0, 0.1)), setup, tip() if dynamics is None else dynamics,
                               text=program, work=work, progress=lambda name, finished, total: name * (total - finished))


def members_of(study: MachiningStudy, line: int) -> np.ndarray:
    """Return the places of a line that cut between 15 and 33 mm along the wall."""
    assert study.arcs is not None and study.judged is not None
    x = study.removed.tip[study.arcs.place, 0]
    return np.flatnonzero((study.laid.path.line[study.judged.block] == line) & (x > 15 * MM) & (x < 33 * MM))


@pytest.fixture(scope="module")
def study() -> MachiningStudy:
    return run(ClampedPart(plate(), (FOOT,), damping_ratio=0.02, stage_change=0.08))


class FreshPlate:
    """The plate of 3 mm by a mesh of its own, and its response at the finishing pass, over the height of the cut.

    is_begun : the finishing pass has come to the place: 0.05 mm are gone behind it.
    """

    def __init__(self, place: float, is_begun: bool = False) -> None:
        self.model = plate(3 * MM)
        if is_begun:
            skin, top = 2.95 * MM, 27 * MM
            boxes = [Cuboid((0, 0, 0), (LENGTH, skin, HEIGHT)), Cuboid((0, skin, 0), (LENGTH, 3 * MM, top)),
                     Cuboid((place, skin, top), (LENGTH, 3 * MM, HEIGHT))]
            self.model = Casting(boxes, {"body": ALUMINIUM}).meshed(4 * MM)
        self.free = self.model.free_coordinates(self.model.nodes_in((-1, -1, 0), (1, 1, 0)))
        stiffness, mass = self.model.assembled()
        self.stiffness, self.mass = (part[self.free][:, self.free] for part in (stiffness, mass))
        block, heights = self.model.blocks[0], 27.0 + 3 * (np.arange(4) + 0.5) / 4
        places = np.array([[place, (2.95 if is_begun else 3.0) * MM, z * MM] for z in heights])
        located = locate([(block.kind, block.nodes, self.model.nodes[block.nodes])], places)
        self.loads = np.zeros((self.model.size, 3))
        for nodes, values in zip(located.nodes, located.values, strict=True):
            for way in range(3):
                np.add.at(self.loads[:, way], 3 * nodes + way, values / 4)

    def response(self, frequency: float) -> np.ndarray:
        """Return the undamped response (3, 3), m/N."""
        load = self.loads[self.free]
        dynamic = self.stiffness - (2 * np.pi * frequency) ** 2 * self.mass
        return load.T @ factorise(dynamic, is_positive=frequency == 0).solve(load)

    def frequencies(self, count: int) -> np.ndarray:
        return modes(self.stiffness, self.mass, count, is_counted=False).frequency[:count]


@pytest.mark.slow
def test_the_response_of_the_last_stage_is_that_of_a_fresh_mesh(study):
    """At a place of the finishing pass: all directions, from the static response to beyond the first mode."""
    assert study.work is not None and study.arcs is not None
    middle = members_of(study, FINISHING_LINE)
    m = int(middle[len(middle) // 2])
    response = study.work.dynamics[int(study.work.group[m])].response
    assert isinstance(response, Modes)
    leaders = members_of(study, FINISHING_LINE)[study.work.group[members_of(study, FINISHING_LINE)] == study.work.group[m]]
    fresh = [FreshPlate(float(study.removed.tip[study.arcs.place[k], 0])) for k in leaders[:3]]
    assert response.frequency[:4] == pytest.approx(fresh[0].frequencies(4), rel=0.01)
    first = float(response.frequency[0])
    for frequency in (0.0, 0.5 * first, 0.9 * first, 1.2 * first):
        omega = 2 * np.pi * frequency
        own = (response.shape / (response.omega**2 - omega**2)) @ response.shape.T
        gaps = [np.abs(own - other.response(frequency)).max() / np.abs(own).max() for other in fresh]
        assert min(gaps) < 0.06
    static = np.diag((response.shape / response.omega**2) @ response.shape.T)
    ratio = np.array([static / np.diag(other.response(0.0)) for other in fresh])
    assert np.abs(ratio - 1).max(axis=1).min() < 0.08  # along z twelve modes hold a fifth of it


@pytest.mark.slow
def test_stages_follow_the_frequencies(study):
    """No more than the stated change between neighbours; the last is the plate that is left; volume as the stock's."""
    course = study.work.stages
    assert len(course.stages) > 3 and course.change.max() <= 0.08
    last = course.stages[-1]
    assert last.state.volume == pytest.approx(LENGTH * (HEIGHT * 3 * MM - 3 * MM * 0.05 * MM), rel=1e-3)
    assert not any("part and stock" in doubt for doubt in study.doubts)


@pytest.mark.slow
def test_between_stages_the_modes_of_both_have_the_frequencies_of_the_part_there(study):
    """Beside modes of the state's own: 0.02 % where the stages differ by 8 %, and never below; without the residual 0.2 %."""
    course = study.work.stages
    part = ClampedPart(plate(), (FOOT,), damping_ratio=0.02)
    for k in (2, 5):
        around = course.stages[k], course.stages[k + 1]
        piece = (around[0].piece + around[1].piece + 1) // 2
        exact = solve_stage(course.cut, part, piece).frequency[:4]
        ratio = solve_between(course.cut, part, piece, around=around, inverse=around[0].solver()).frequency[:4] / exact
        assert ratio.min() > 1 - 1e-9 and ratio.max() < 1.0002


@pytest.mark.slow
def test_limits_are_those_of_tool_and_wall_together(study):
    """At places of the finishing pass: the engine with the sum of both, the wall's from a fresh mesh with many modes."""
    m = int(members_of(study, FINISHING_LINE)[3])
    fresh = FreshPlate(float(study.removed.tip[study.arcs.place[m], 0]), is_begun=True)
    pairs = modes(fresh.stiffness, fresh.mass, 40, is_counted=False)
    shape = fresh.loads[fresh.free].T @ pairs.vectors
    wall = ToolDynamics(Modes(pairs.frequency, 0.02, shape[:2], ("wall:+x", "wall:+y")), "wall:+x", "wall:+y")
    both = studies.with_work(tip(), wall)
    problem = milling_problem(CUT.replaced(direction="slot"), both.response, both.x, y=both.y).changed(
        engagement=Engagement(float(study.arcs.entry[m]), float(study.arcs.exit[m])), feed_angle=float(study.arcs.angle[m]))
    chart = stability.chart(problem, np.array([9000.0]), depth_max=20 * MM)
    own = float(study.margins.limit[m])
    assert np.isfinite(own)
    # A frequency that is 0.2 % off, of the plate before or behind the pass, moves this limit by 4 %.
    assert 0.97 < own / float(chart.limit[0]) < 1.03


def test_measured_responses_hold_from_their_lines(tmp_path: Path):
    """Each block has the limit of its own stage; a wall that was struck along y is rigid along x."""
    early, late = (studies.modal_dynamics(Modes([f], [0.02], [[4.0]], ["wall:+y"])) for f in (2500.0, 1500.0))
    work = studies.MeasuredWork({1: early, FINISHING_LINE: late})
    result = run(work)
    assert result.work is not None and result.judged is not None and result.arcs is not None
    for line, wall in ((5, early), (FINISHING_LINE, late)):
        m = int(members_of(result, line)[0])
        shape = np.array([[0.0], [4.0]])
        placed = ToolDynamics(Modes(wall.response.frequency, 0.02, shape, ("w:+x", "w:+y")), "w:+x", "w:+y")
        both = studies.with_work(tip(), placed)
        solved = result.judged.solver.dynamics_of(0, int(result.judged.pose[result.arcs.place[m]])).response
        assert solved.frequency.tolist() == both.response.frequency.tolist()
        assert np.array_equal(solved.shape, both.response.shape)
    assert any("one measured response" in doubt for doubt in result.doubts)
    with pytest.raises(ToolpointError, match="must hold from line 5 at the latest"):
        run(studies.MeasuredWork({FINISHING_LINE: late}))


def test_a_measured_line_along_y_stays_along_y():
    lines = np.linspace(10.0, 2000.0, 300)
    values = (1 / (1e6 - lines**2 + 10j * lines))[:, None, None]
    wall = ToolDynamics(Frf(lines, values, ["w:+y"], ["w:+y"], "receptance"), "w:+y", "same")
    placed = studies.MeasuredWork({1: wall}).responses[1]
    assert np.array_equal(placed.response.values[:, 1, 1], values[:, 0, 0])
    assert not placed.response.values[:, 0].any()


@pytest.mark.slow
def test_what_a_part_cannot_carry_is_doubted_first():
    """One element across, a stock that is not the part, damping of the material alone."""
    part = ClampedPart(plate(5 * MM, 6 * MM, replace(ALUMINIUM, loss_factor=0.01)), (FOOT,), stage_change=0.3,
                               compared=plate(5 * MM, 9 * MM, replace(ALUMINIUM, loss_factor=0.01)))
    doubts = run(part).doubts
    for words in ("elements thick", "part and stock", "of its material alone"):
        assert any(words in doubt for doubt in doubts), words
    mesh = [doubt for doubt in doubts if doubt.startswith("mesh of the work")]
    assert len(mesh) == 1 and "err by about" in mesh[0]


def test_lines_of_a_tool_that_are_too_coarse_for_the_wall_are_doubted():
    """Peaks between lines, and modes above the band; modes of the tool, and a band that holds both, are not."""
    wall = [ToolDynamics(Modes([500.0, 4000.0], 0.002, np.array([[0.0, 0.0], [1.0, 3.0]]), ("w:+x", "w:+y")), "w:+x", "w:+y")]

    def tool(spacing: float, last: float) -> Frf:
        lines = np.arange(10.0, last, spacing)
        return Frf(lines, (1 / (1e7 - lines**2))[:, None, None] + 0j, ["t:+x"], ["t:+x"], "receptance")

    coarse, short, fine = (question_lines(tool(*each), wall) for each in ((5.0, 5000.0), (0.25, 2000.0), (0.25, 5000.0)))
    assert "peaks between lines are missed" in coarse[0] and coarse[0].grave and len(coarse) == 1
    assert "12 % of its compliance" in short[0] and len(short) == 1
    assert fine == [] and question_lines(tip().response, wall) == []


FILE = """toolpoint: 1
name: wall
bodies:
  wall:
    elastic:
      mesh_size: 6 mm
      band: 10 kHz
      materials: {{body: {{modulus: 70 GPa, density: 2700 kg/m^3, poisson: 0.33, loss_factor: {loss}}}}}
      boxes: [{{low: [0, 0, 0], high: [48 mm, 4 mm, 30 mm]}}]
      interfaces: {{foot: {{plane: {{at: [0, 0, 0], normal: [0, 0, 1]}}}}}}
joints:
  clamp: {{parent: ground, child: wall, child_interface: foot, at: [0, 0, 0],
           stiffness: {{x: 1e9, y: 1e9, z: 1e9, rx: 1e6, ry: 1e6, rz: 1e6}}}}
"""


def test_a_part_is_read_from_a_machine_file_and_refused_by_name(tmp_path: Path):
    path = tmp_path / "wall.yaml"
    path.write_text(FILE.format(loss=0.01))
    description = io.read_description(path)
    part = studies.describe_part(description, ["foot"])
    assert part.compared is not None and part.compared.element_count < part.model.element_count
    with pytest.raises(ToolpointError, match="must be an interface of wall: foot"):
        studies.describe_part(description, ["fot"])
    spring = part.springs[0]  # a clamp with stiffness is a spring by its key, without it the face does not move
    assert spring.stiffness == pytest.approx(np.diag([1e9] * 3 + [1e6] * 3)) and not part.held and not part.doubts
    path.write_text(FILE.format(loss=0.01).replace("rx: 1e6, ", ""))
    with pytest.raises(ToolpointError, match="stiffness without rx"):
        studies.describe_part(io.read_description(path), ["foot"])
    path.write_text(FILE.format(loss=0.01).replace("mesh_size: 6 mm", "mesh_size: 60 mm"))
    one = studies.describe_part(io.read_description(path), ["foot"])  # a coarser mesh would be one element, too
    assert one.compared is not None and one.compared.element_count > one.model.element_count
    path.write_text(FILE.format(loss=0))
    with pytest.raises(ToolpointError, match="no damping"):
        studies.describe_part(io.read_description(path), ["foot"])
    mesh = Casting([Cuboid((1, 1, 0), (1.048, 1.004, 0.03))], {"body": ALUMINIUM}).meshed(6 * MM)
    beside = ClampedPart(mesh, (PlaneFaces((1, 1, 0), (0, 0, 1)),), damping_ratio=0.02)
    with pytest.raises(ToolpointError, match="no material of it is cut"):
        run(beside)
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, 0, 0.048, 0.004, 0.03)), CUT)
    program = parse(PROGRAM.format(speed=9000), start=(0, 0, 0.1))
    with pytest.raises(ToolpointError, match="without the dynamics of the tool"):
        studies.run_program(program, setup, work=part)
    for run_turned, words in ((studies.run_stages, "tilted planes"), (studies.run_five_axes, "five axes")):
        with pytest.raises(ToolpointError, match=f"a program of {words}"):
            run_turned(program, setup, tip(), work=part)


@pytest.mark.slow
def test_the_command_takes_the_part(tmp_path: Path, capsys):
    """--work and --held: the stages stand in the table, and a response from a line on is the other door."""
    (tmp_path / "wall.yaml").write_text(FILE.format(loss=0.02))
    (tmp_path / "wall.nc").write_text(PROGRAM.format(speed=9000))
    io.write_noun(Modes([900.0, 1100.0], 0.03, np.diag([2.0, 2.0]), ("tip:+x", "tip:+y")), tmp_path / "tip.h5")
    io.write_noun(Modes([2500.0], 0.02, [[4.0]], ["wall:+y"]), tmp_path / "struck.h5")
    common = ["machining", str(tmp_path / "wall.nc"), "--modes", str(tmp_path / "tip.h5"), "--stock", "box=0,0,0,48,4,30",
              "--diameter", "24", "--teeth", "2", "--material", "al7075", "--spacing", "0.5", "--lobes", "0", "--json"]
    main([*common, "--work", str(tmp_path / "wall.yaml"), "--held", "foot", "--stage-change", "30"])
    told = json.loads(capsys.readouterr().out)
    assert len(told["work"]["stages"]) >= 2 and told["work"]["mesh_error"] > 0
    main([*common, "--work-response", f"1={tmp_path / 'struck.h5'}"])
    assert any("one measured response" in doubt for doubt in json.loads(capsys.readouterr().out)["doubts"])
