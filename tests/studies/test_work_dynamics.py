"""A work that gives way beside the tool: one sum whatever holds it, in either order, with the limits of one structure."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError, studies
from toolpoint.app.main import main
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.io import write_frf, write_noun
from toolpoint.studies.cuts.work_dynamics import BOTH_LABELS
from toolpoint.vibration import Frf, Modes, frequency_response

LINES = np.arange(20.0, 3000.0, 1.0)
TIP = Modes([700.0, 950.0], [0.03, 0.02], [[1.0, 0.2], [0.1, 1.1]], ["tip:+x", "tip:+y"])
WALL = Modes([420.0, 1500.0], [0.01, 0.01], [[0.2, 0.1], [0.8, 0.5]], ["wall:+x", "wall:+y"])


@cache
def whole():
    """Both as one structure: the motion of the tool against the work is the difference."""
    return Modes([*TIP.frequency, *WALL.frequency], [*TIP.damping_ratio, *WALL.damping_ratio],
                 np.hstack([TIP.shape, -WALL.shape]), BOTH_LABELS)


@cache
def tip(kind):
    return studies.modal_dynamics(TIP) if kind == "modes" else studies.response_dynamics(frequency_response.modal(TIP, LINES))


@cache
def wall(kind):
    return studies.modal_dynamics(WALL) if kind == "modes" else studies.response_dynamics(frequency_response.modal(WALL, LINES))


@pytest.mark.parametrize("second", ["modes", "lines"])
@pytest.mark.parametrize("first", ["modes", "lines"])
@pytest.mark.default_cases(2)
def test_both_are_the_response_of_one_structure(first, second):
    expected = frequency_response.modal(whole(), LINES, BOTH_LABELS, inputs=BOTH_LABELS).values
    for one, other in ((tip(first), wall(second)), (wall(second), tip(first))):
        response = studies.with_work(one, other).response
        lines = LINES[5:-5]
        frf = response.interpolated(lines) if isinstance(response, Frf) else frequency_response.modal(
            response, lines, BOTH_LABELS, inputs=BOTH_LABELS)
        assert frf.values == pytest.approx(expected[5:-5], rel=1e-9, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("second", ["modes", "lines"])
def test_what_was_solved_directly_beside_modes_goes_on(second):
    """The tool's true response is 5 % above its modes: it stays in lines, and beside modes as their direct response."""
    modes = frequency_response.modal(TIP, LINES)
    solved = replace(modes, values=1.05 * modes.values)
    tool = replace(tip("modes"), response=replace(TIP, direct=solved))
    response = studies.with_work(tool, wall(second)).response
    both = response.direct if second == "modes" else response
    expected = 1.05 * modes.values + frequency_response.modal(WALL, LINES).values
    lines = LINES[5:-5]
    assert both.interpolated(lines).values == pytest.approx(expected[5:-5], rel=1e-9, abs=1e-12 * np.abs(expected).max())


def test_modes_of_two_scalings_are_joined_as_modes():
    """Real modes of unit modal mass beside complex ones of modal A."""
    damped = WALL.omega * np.sqrt(1 - WALL.damping_ratio**2)
    complex_wall = Modes(WALL.frequency, WALL.damping_ratio, WALL.shape.astype(complex), WALL.dofs, "modal A",
                         participation=WALL.shape / (2j * damped), input_dofs=WALL.dofs)
    response = studies.with_work(tip("modes"), studies.modal_dynamics(complex_wall)).response
    expected = frequency_response.modal(whole(), LINES, BOTH_LABELS, inputs=BOTH_LABELS).values
    assert isinstance(response, Modes)
    values = frequency_response.modal(response, LINES, BOTH_LABELS, inputs=BOTH_LABELS).values
    assert values == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max())


def test_directions_that_are_the_same_or_rigid():
    narrow = Modes([700.0], [0.03], [[1.0]], ["tip:+x"])
    lines = frequency_response.modal(narrow, LINES)
    for across, share in (("same", 1.0), ("rigid", 0.0)):
        both = studies.with_work(studies.modal_dynamics(narrow, y=across), wall("modes")).response
        values = frequency_response.modal(both, [650.0], BOTH_LABELS, inputs=BOTH_LABELS).values[0]
        measured = studies.with_work(studies.response_dynamics(lines, y=across), wall("modes")).response
        assert measured.interpolated([650.0]).values[0] == pytest.approx(values, rel=1e-9)
        alone = frequency_response.modal(narrow, [650.0]).values[0, 0, 0]
        work = frequency_response.modal(WALL, [650.0]).values[0]
        assert values == pytest.approx(work + alone * np.diag([1.0, share]), rel=1e-9)


def test_limits_are_those_of_one_structure():
    speeds = np.array([6000.0, 9000.0, 14000.0])
    limits = [stability.chart(MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(8e8, 2.5e8), modes), speeds,
                              depth_max=0.02).limit
              for modes in (studies.with_work(tip("modes"), wall("modes")).response, whole())]
    assert np.all(limits[1] < 0.019) and limits[0] == pytest.approx(limits[1], rel=1e-6)


def test_what_does_not_fit_is_told():
    low = studies.response_dynamics(frequency_response.modal(TIP, np.arange(20.0, 300.0)))
    high = studies.response_dynamics(frequency_response.modal(WALL, np.arange(400.0, 3000.0)))
    with pytest.raises(ToolpointError, match=r"0 lines in common \(20 to 299 Hz and 400 to 2999 Hz\)"):
        studies.with_work(low, high)


@pytest.mark.slow
@pytest.mark.usefixtures("without_other_cuts")
@pytest.mark.parametrize("kind", ["modes", "lines"])
def test_the_command_takes_the_work_beside_every_source(tmp_path, capsys, kind):
    tool_file, work_file = tmp_path / "tip.h5", tmp_path / "wall.h5"
    write_frf(frequency_response.modal(TIP, LINES), tool_file)
    if kind == "modes":
        write_noun(WALL, work_file)
    else:
        write_frf(frequency_response.modal(WALL, LINES), work_file)
    cut = ["--diameter", "12", "--teeth", "2", "--kt", "800", "--kn", "250", "--immersion", "0.3", "--speeds", "6000:14000:3"]
    main(["lobes", "--frf", str(tool_file), *cut, "-o", str(tmp_path / "a"), "--json"])
    alone = json.loads(capsys.readouterr().out)
    main(["lobes", "--frf", str(tool_file), "--work", str(work_file), *cut, "-o", str(tmp_path / "b"), "--json"])
    both = json.loads(capsys.readouterr().out)
    assert json.dumps(both) != json.dumps(alone) and "the work gives way too" in json.dumps(both)
    main(["lobes", str(MACHINES / "three_axis_vertical_drives.yaml"), "--work", str(work_file), *cut, "-o", str(tmp_path / "c"),
          "--json"])
    assert "wall.h5 is added to" in capsys.readouterr().out


@pytest.mark.parametrize("known", [True, False])
def test_the_direction_of_the_axis_stays_where_the_tool_has_it(known):
    """G along z is the sum of both; a work whose response there is not known is rigid along it, which a note says."""
    ways = ("+x", "+y", "+z")
    tool = studies.modal_dynamics(Modes([700.0, 800.0, 900.0], 0.03, np.diag([1.0, 2.0, 3.0]), [f"tip:{way}" for way in ways]))
    count = 3 if known else 2
    shape = np.array([[0.5], [1.0], [2.0]])[:count]
    wall = studies.modal_dynamics(Modes([300.0], 0.01, shape, [f"w:{way}" for way in ways[:count]]))
    both = studies.with_work(tool, wall)
    lines = np.array([10.0, 500.0])
    parts = [frequency_response.modal(part.response, lines, part.response.dofs).values for part in (tool, wall)]
    expected = parts[0].copy()
    expected[:, :count, :count] += parts[1]
    assert frequency_response.modal(both.response, lines, both.response.dofs).values == pytest.approx(expected, rel=1e-12)
    assert any("rigid along the tool's axis" in note for note in both.notes) is not known


PART = "  part: {mass: 15 kg, inertia: {xx: 0.2, yy: 0.2, zz: 0.2}}"
BEARING = "  bearing: {parent: ground, child: head, stiffness: {x: 3e7, y: 5e7}, loss_factor: 0.06}"
CLAMP = "  clamp: {parent: ground, child: part, stiffness: {x: 2e7, y: 9e7}, loss_factor: 0.02}"


def machine_text(bodies, joints, points, tool, table=""):
    """A machine file of these bodies, joints and points."""
    return "\n".join(["toolpoint: 1", "name: cut", "bodies:", *bodies, "joints:", *joints, "points:", *points,
                      f"tool: {tool}", table])


def test_a_machine_file_of_the_work_is_the_table_of_one_file(tmp_path, capsys):
    """Tool and work in one file, tool against table, or in two: the same least depth by the same command."""
    head = "  head: {mass: 40 kg, inertia: {xx: 1, yy: 1, zz: 1}}"
    tip_point, wall_point = "  tip: {body: head}", "  wall: {body: part}"
    (tmp_path / "both.yaml").write_text(machine_text([head, PART], [BEARING, CLAMP], [tip_point, wall_point], "tip",
                                                     "table: wall"))
    (tmp_path / "tool.yaml").write_text(machine_text([head], [BEARING], [tip_point], "tip"))
    (tmp_path / "work.yaml").write_text(machine_text([PART], [CLAMP], [wall_point], "wall"))
    least = []
    for files in (["both.yaml"], ["tool.yaml", "--work", str(tmp_path / "work.yaml")]):
        main(["lobes", str(tmp_path / files[0]), *files[1:], "--method", "zero-order", "--teeth", "2",
              "--kt", "800", "--kn", "240", "--diameter", "20", "--immersion", "0.5", "--direction", "down",
              "--speeds", "4000:9000:40", "--json", "-o", str(tmp_path / "page")])
        least.append(json.loads(capsys.readouterr().out)["lowest_limit"])
    assert least[1] == pytest.approx(least[0], rel=1e-6)
    assert 0 < least[0]["depth_m"] < 0.01
