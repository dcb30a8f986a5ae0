"""A program on a machine: loads by the laws, verdicts of the engine, advice that holds, programs written anew, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toolpoint import ToolpointError, io, studies
from toolpoint.cutting import Engagement, MillingProblem, stability
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.drives import JerkLimits
from toolpoint.io.program.gcode import parse
from toolpoint.io.program.rewriting import SpeedAndFeed, rewritten
from toolpoint.machine import build
from toolpoint.machine.description import (
    BodyDescription,
    IdentifiedDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.material_removal import Stock
from toolpoint.studies.machining.program_path import raise_reference_moves, travel_doubts
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

MM = 1e-3
CUT = {"diameter": 0.01, "teeth": 4, "helix": np.radians(30), "tangential": 8e8, "normal": 3e8, "edge_tangential": 2e4,
       "flute_length": 0.022}
BLOCK = Stock.box(np.array([0, -30, -20]) * MM, np.array([50, 30, 0]) * MM)
STRAIGHT = {"helix": 0.0}  # the engine of straight teeth is quick
PROGRAM = """G21 G90 G17
T1 M6 S{speed} M3
G0 X-10 Y0
G0 Z5
G0 Z-{depth}
G1 X60 F2400 (slot)
G0 Z5
G0 X-10 Y7
G0 Z-{depth}
G1 X60
G0 Z5
M30
"""


def _tip(frequency: float = 900.0) -> Any:
    modes = Modes([frequency, 1.2 * frequency], [0.02, 0.02], [[4.0, 0], [0, 3.5]], ("tool:+x", "tool:+y"))
    return studies.modal_dynamics(modes)


def _run(text: str, *, dynamics: Any = None, stock: Stock = BLOCK, cut: dict[str, Any] | None = None,
         **values: Any) -> MachiningStudy:
    advice, folder = values.pop("with_advice", False), values.pop("folder", None)
    described = CuttingDescription.of(**{**CUT, **(cut or {})})
    setup = studies.describe_machining(stock, described, spacing=0.4 * MM, **values)
    return studies.run_program(parse(text, start=(0, 0, 0.2)), setup, dynamics, text=text, with_advice=advice, folder=folder)


def _line(result: MachiningStudy, line: int) -> int:
    return int(np.flatnonzero(result.blocks.line == line)[0])


@pytest.mark.parametrize("corner_radius", [0.0, 0.005])
@pytest.mark.default_cases(1)
def test_loads_of_a_slot_are_those_of_the_force_law(corner_radius: float) -> None:
    """Within 1 % of `rigid_forces` in the middle of a slot, also of bull noses and balls."""
    result = _run(PROGRAM.format(speed=12000, depth=3), cut={"corner_radius": corner_radius})
    described = CuttingDescription.of(**CUT, corner_radius=corner_radius)
    problem = MillingProblem(tool_of(described), Engagement.slot(), coefficients_of(described), _tip().response, "tool:+x",
                             "tool:+y",
                             feed_per_tooth=0.04 / (12000 / 60 * 4))
    exact = rigid_forces(problem, 3 * MM, np.linspace(0, np.pi / 2, 721), slices=400)
    block, k = _line(result, 6), result.laid.moves.block[result.removed.piece]
    middle = int(np.flatnonzero((k == block) & (np.abs(result.removed.tip[:, 0] - 25 * MM) < 1.3 * MM))[0])
    from toolpoint.studies.machining.loads import place_loads

    loads = place_loads(result.removed, result.laid, result.setup)
    assert loads.lateral[middle] == pytest.approx(np.hypot(exact.force[:, 0], exact.force[:, 1]).max(), rel=0.01)
    assert loads.torque[middle] == pytest.approx(exact.torque[:-1].mean(), rel=0.01)
    assert loads.power[middle] == pytest.approx(exact.torque[:-1].mean() * 12000 * np.pi / 30, rel=0.01)


def test_power_of_a_slot_is_energy_times_removal_rate() -> None:
    """Without edge forces the mean power is K_t times the volume a second."""
    result = _run(PROGRAM.format(speed=12000, depth=3), cut={"edge_tangential": 0.0})
    power = result.blocks.loads["power"][_line(result, 6)]
    assert power == pytest.approx(8e8 * 10 * MM * 3 * MM * 0.04, rel=0.01)


def test_verdicts_are_those_of_the_exact_engine() -> None:
    """Every twentieth place: the engine at the place's own arc agrees, and limits of groups are within their stated error."""
    result = _run(PROGRAM.format(speed=12000, depth=0.35), dynamics=_tip(), cut=STRAIGHT)
    described, arcs, margins = CuttingDescription.of(**{**CUT, **STRAIGHT}, immersion=1.0), result.arcs, result.margins
    assert arcs is not None and margins is not None
    assert margins.stable.any() and not margins.stable.all()
    for m in range(0, arcs.place.size, 20):
        problem = MillingProblem(tool_of(described), Engagement(float(arcs.entry[m]), float(arcs.exit[m])),
                                 coefficients_of(described),
                                 _tip().response, "tool:+x", "tool:+y", feed_angle=float(arcs.angle[m]))
        chart = stability.chart(problem, np.array([12000.0]), depth_max=1.4 * MM)
        assert bool(chart.stable(arcs.depth[m:m + 1])[0, 0]) is bool(margins.stable[m])


@pytest.mark.slow
def test_advice_holds_when_the_written_program_is_run(tmp_path: Path) -> None:
    """The program that is written is stable at every block, moves as before, and its old words stand in comments."""
    text = PROGRAM.format(speed=12000, depth=0.45)
    result = _run(text, dynamics=_tip(), with_advice=True, cut=STRAIGHT)
    assert result.chatter_blocks.size and result.advice is not None
    assert result.advice.tools[0].chatter_after == 0
    path = io.write_program(text, SpeedAndFeed(result.advice.speed, result.advice.feed), tmp_path / "new.nc")
    written = path.read_text()
    assert "(was S12000)" in written
    again = _run(written, dynamics=_tip(), cut=STRAIGHT)
    assert not again.chatter_blocks.size and (again.blocks.verdict == 1).sum() == 2
    assert again.blocks.loads["lateral"].max() <= 1.01 * result.blocks.loads["lateral"].max()


@pytest.mark.slow
def test_a_speed_that_holds_is_raised_where_that_is_asked_for() -> None:
    """Unasked it stays; asked for, the faster program is stable at every block, and no faster than the spindle turns."""
    text = PROGRAM.format(speed=9000, depth=0.2)
    kept = _run(text, dynamics=_tip(), with_advice=True, cut=STRAIGHT)
    raised = _run(text, dynamics=_tip(), with_advice=True, cut=STRAIGHT, raises_speed=True)
    held = _run(text, dynamics=_tip(), with_advice=True, cut=STRAIGHT, raises_speed=True,
                limits=studies.CuttingLimits(speed=9000.0))
    assert kept.advice is not None and raised.advice is not None and held.advice is not None
    assert not kept.chatter_blocks.size and kept.advice.tools[0].speed == held.advice.tools[0].speed == 9000
    advice = raised.advice.tools[0]
    assert 9000 < advice.speed <= 1.3 * 9000 and "which the edges must bear" in advice.words
    assert raised.advice.time_after < 0.98 * kept.advice.time_after
    written = rewritten(text, SpeedAndFeed(raised.advice.speed, raised.advice.feed))
    again = _run(written, dynamics=_tip(), cut=STRAIGHT)
    assert not again.chatter_blocks.size and (again.blocks.verdict == 1).sum() == 2


@pytest.mark.slow
def test_a_limit_of_power_lowers_the_feed() -> None:
    result = _run(PROGRAM.format(speed=12000, depth=3), dynamics=_tip(), with_advice=True, cut=STRAIGHT,
                  limits=studies.CuttingLimits(power=1500.0))
    assert any(doubt.what == "spindle power" and doubt.grave for doubt in result.doubts)
    assert result.advice is not None and result.advice.power_after <= 1500


def test_rapids_and_holders_are_named_with_line_and_place() -> None:
    text = PROGRAM.format(speed=12000, depth=3).replace("G0 Z5\nG0 X-10 Y7", "G0 X-10 Y7")
    result = _run(text, stick_out=0.023, holder_diameter=0.05)
    assert any(doubt.startswith("rapid through stock: line 7, 3 mm deep at X ") for doubt in result.doubts)
    assert result.answer.startswith("Do not run it as it is (rapid through stock)")
    with pytest.raises(ToolpointError, match="must not be run, and no speed or feed mends it: rapid through stock"):
        assert result.advised_words  # no program is written for it
    deep = _run(PROGRAM.format(speed=12000, depth=3).replace("Z-3\nG1", "Z-21\nG1"), stick_out=0.0205, holder_diameter=0.05,
                cut={"flute_length": 0.02})
    assert any(doubt.what == "holder in the work" for doubt in deep.doubts)
    assert any(doubt.what == "cut below the stock" for doubt in deep.doubts)


def test_walls_of_the_level_above_are_touched_and_not_cut() -> None:
    """The same square at two levels: each takes its own 2 mm with the same force, in its corners too. Before, a corner counted
    as cut as deep as all levels above, as the tool lies there along the whole wall that they left."""
    square = "G1 X12 F1000\nY10\nX0\nY0\n"
    text = "S9000 G0 X0 Y0 Z5\n" + "".join(f"G1 Z-{2 * k} F200\n{square}" for k in (1, 2)) + "G0 Z9\nM30"
    result = _run(text, stock=Stock.box((-0.01, -0.01, -0.02), (0.03, 0.03, 0)), cut={**STRAIGHT, "edge_tangential": 0.0},
                  slices=4)
    cuts = result.blocks.verdict > 0
    assert cuts.sum() == 8 and 1e3 * result.blocks.depth[cuts] == pytest.approx(2.0, abs=0.02)
    assert np.ptp(result.blocks.loads["lateral"][cuts]) < 0.01 * result.blocks.loads["lateral"].max()


def test_a_ramp_to_and_fro_cuts_twice_its_step_at_its_ends() -> None:
    """A slot in ramps that all end at the same walls: at an end the step of two ramps stands before the tool, no more."""
    step, ends = 0.5, (1.0, 13.0)
    text = "S9000 G0 X1 Y0 Z0.1\nG1 Z0 F200\n" + "".join(
        f"G1 X{ends[(k + 1) % 2]:g} Z-{step * (k + 1):g} F1000\n" for k in range(6)) + "G0 Z9\nM30"
    result = _run(text, stock=Stock.box((-0.01, -0.01, -0.02), (0.03, 0.03, 0)), cut=STRAIGHT)
    deepest = result.blocks.depth[result.blocks.verdict > 0][1:]
    assert 1e3 * deepest == pytest.approx(2 * step, rel=0.02)


def test_travel_counts_rapids_and_a_tool_longer_than_z() -> None:
    """A rapid beyond the travel, a raised one to the reference point that is not, and a tool longer than the travel of Z."""
    text = "G0 X0 Y0\nG0 Z150\nG1 Z-1 F100\nG91 G28 Z0\nG90\nM30\n"
    path, axes = parse(text, start=(0, 0, 0.1)).path, {"Z": (-0.2, 0.1)}
    raised = raise_reference_moves(path, text, 0.12)
    (doubt,) = travel_doubts(raised, axes, {}, length=0.0, height=0.12)
    assert doubt.grave and "line 2 goes to 150 mm" in doubt
    doubts = travel_doubts(raised, {"Z": (-0.2, 0.2)}, {}, length=0.5, height=0.12)
    assert ["the tool sticks out 500 mm, and Z goes 400 mm" in doubt for doubt in doubts] == [True]


def test_a_feed_that_no_tooth_takes_is_grave() -> None:
    result = _run("S1 G1 F2400 X-10 Y7 Z-1\nX20\n")
    assert any(doubt.what == "chips" and doubt.grave for doubt in result.doubts)
    assert not any(doubt.what == "chips" for doubt in _run("S9000 G1 F2400 X-10 Y7 Z-1\nX20\n").doubts)


def test_each_tool_has_its_own_stick_out() -> None:
    setup = studies.describe_machining(Stock.box((0, 0, -0.02), (0.05, 0.03, 0)), CuttingDescription.of(
        diameter=0.01, teeth=4, tangential=8e8, normal=3e8), stick_out=0.04, stick_outs={3: 0.055}, holder_diameter=0.05)
    assert setup.holder_of(3).heights == (0.055,) and setup.holder_of(1).heights == (0.04,)
    with pytest.raises(ToolpointError, match="stick_out: 10 mm"):
        studies.describe_machining(setup.stock, setup.cut, cuts={3: CuttingDescription.of(
            diameter=0.01, teeth=4, tangential=8e8, normal=3e8, flute_length=0.02)}, stick_out=0.04, stick_outs={3: 0.01})


def test_a_gouge_is_named_with_its_line() -> None:
    c = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * [0.05, 0.06, 0.0175] + [0, -0.03, -0.02]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    part = np.array([[c[a], c[b], c[d]] for a, b, d, _ in quads] + [[c[a], c[b], c[d]] for a, _, b, d in quads])
    result = _run(PROGRAM.format(speed=12000, depth=3), part=1e3 * part)
    (gouge,) = [doubt for doubt in result.doubts if doubt.what == "gouge"]
    assert "cuts 0.5 mm into the part" in gouge and gouge.grave


@pytest.mark.parametrize(("change", "message"), [
    (("S12000", ""), "line 6 cuts without a spindle speed"),
    (("G1 X60\n", "T2 M6 S9000\nG1 X60\n"), "T2 from line 11"),
])
def test_programs_that_cannot_be_judged_are_refused_with_their_line(change: tuple[str, str], message: str) -> None:
    with pytest.raises(ToolpointError, match=message):
        _run(PROGRAM.format(speed=12000, depth=3).replace(*change))


def test_stock_elsewhere_and_unknown_materials_are_refused() -> None:
    with pytest.raises(ToolpointError, match="is met by no cutting move"):
        _run(PROGRAM.format(speed=12000, depth=3), stock=Stock.box((1, 1, -1), (2, 2, 0)))
    with pytest.raises(ToolpointError, match="unobtainium"):
        studies.cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "material": "unobtainium"})
    with pytest.raises(ToolpointError, match="`kt`, `kn` missing"):
        studies.cuts_of_options(None, {"diameter": 0.01, "teeth": 4})
    with pytest.raises(ToolpointError, match="stick_out"):
        _run(PROGRAM.format(speed=12000, depth=3), stick_out=0.01)


def test_words_that_are_computed_or_per_revolution_are_refused() -> None:
    for line, words in (("G1 X1 F#1", "computes"), ("G95 F0.1", "G95")):
        with pytest.raises(ToolpointError, match=words):
            rewritten(f"G21\n{line}\n", SpeedAndFeed())


def test_only_words_s_and_f_change() -> None:
    """Factors of one change nothing; others change S and F alone, modal feeds stay right."""
    text = "G21\nS1000 M3\nG1 X10 F100 ; F in a comment S5\nX20\nX30 (keep)\nG4 F2\nX40\n"
    assert rewritten(text, SpeedAndFeed({2: 1.0}, dict.fromkeys((3, 4, 5, 7), 1.0)))== text
    new = rewritten(text, SpeedAndFeed({2: 1.5}, {3: 1.0, 4: 0.5, 5: 0.5, 7: 1.0}))
    lines = new.splitlines()
    assert lines[1].startswith("S1500 M3") and "was S1000" in lines[1]
    assert [("F50" in line, "F100" in line.split("(")[0].split(";")[0]) for line in lines[2:]] == [
        (False, True), (True, False), (False, False), (False, False), (False, True)]
    assert np.allclose(parse(new, feed=1.0).feed * 60e3, [100, 50, 50, 100])


def test_an_interrupted_run_goes_on_with_what_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second run of the same program solves nothing anew, and says the same."""
    from toolpoint.studies.machining.solver import StabilitySolver

    text = "S12000 G1 F2400 X-10 Y7 Z-0.4\nX20\n"
    first = _run(text, dynamics=_tip(), cut=STRAIGHT, folder=tmp_path)
    monkeypatch.setattr(StabilitySolver, "chart", lambda *_, **__: pytest.fail("solved anew"))
    assert _run(text, dynamics=_tip(), cut=STRAIGHT, folder=tmp_path).table() == first.table()


def test_the_interval_of_the_machines_numbers_reaches_the_block() -> None:
    """A head on identified springs: the limit of the block nearest to it has an interval about the limit itself."""
    stiffness, share = 3e7, 0.01
    joint = JointDescription("ground", "head", stiffness={"x": stiffness, "y": stiffness}, loss_factor=0.04)
    head = BodyDescription(1.0, inertia=InertiaDescription(1e-3, 1e-3, 1e-3))
    identified = IdentifiedDescription(("joints.slide.stiffness.x",), ((float((share * stiffness) ** 2),),))
    machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")},
                                       tool="tip",
                                       identified=identified))
    result = _run("S7000 G1 F2400 X-10 Y7 Z-2\nX20\n", dynamics=machine, cut=STRAIGHT)
    (note,) = [note for note in result.notes if "95 % interval of the least limit" in note]
    assert note.startswith("line 2, the block nearest to its limit") and "joint slide" in note


def test_the_planner_gives_feeds_and_times() -> None:
    """A long block reaches its feed; a short one only what its length and the acceleration allow, and takes longer."""
    text = "S12000 G1 F2400 X-10 Y7 Z-1\nX20\nX20.05\nG9 X20.1\n"
    limits = JerkLimits(speed=0.5, acceleration=1.0, jerk=50.0)
    result = _run(text, planned=limits)
    free = _run(text)
    assert result.laid.feed[1] == pytest.approx(0.04, rel=1e-9)
    assert result.laid.feed[3] < 0.04 and result.laid.time[3] > free.laid.time[3]
    assert result.laid.time.sum() > free.laid.time.sum()
