"""Tilted planes: volumes of prisms, arcs of a ball on a tilted face by its closed form, and work handed from plane to plane."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError, studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.studies.machining.tilted_stages import StagedStudy

CUT = {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8}


def _run(text: str, box: tuple[float, ...] = (0, 0, -0.02, 0.04, 0.02, 0), *, spacing: float = 4e-4,
         **tool: float) -> StagedStudy:
    setup = studies.describe_machining(studies.stock_of("box", box), CuttingDescription.of(**CUT, **tool), spacing=spacing)
    return studies.run_stages(parse(text, start=(0, 0, 0.05)), setup)


def _chamfer(leg: float, head: str = "G68.2 J45\nG53.1", end: str = "G69") -> str:
    return (f"S9000\n{head}\nG0 X-7 Y0 Z9\nZ-{leg / np.sqrt(2):.6f}\nG1 X47 F1800\nG0 Z9\n{end}\n"
            "G0 X-7 Y15 Z5\nG0 Z-1\nG1 X47\nG0 Z9")


@pytest.mark.slow
@pytest.mark.parametrize(("head", "end", "spacing", "error"), [
    ("G68.2 J45\nG53.1", "G69", 4e-4, 1e-4), ('CYCLE800(0,"HEAD",0,57,0,0,0,45,0,0,0,0,0,-1)', "CYCLE800()", 5e-4, 3e-4)])
def test_a_chamfer_and_then_a_slot_take_their_prisms(head: str, end: str, spacing: float, error: float) -> None:
    """Leg^2/2 times the length, and the slot beside it upright, on the same work; the arc is that of the ridge's width."""
    study = _run(_chamfer(3.0, head, end), spacing=spacing)
    chamfer, slot = (1e9 * stage.removed.total_volume for stage in study.stages)
    assert chamfer == pytest.approx(3.0**2 / 2 * 40, rel=error) and slot == pytest.approx(400, rel=0.001)
    depth = 3 / np.sqrt(2)
    middle = np.abs(study.stages[0].removed.tip[:, 0] - 0.02) < 0.01
    assert 1e3 * study.stages[0].removed.reach[middle].max() == pytest.approx(depth, rel=2e-3)  # the ridge between the dexels
    width = 2 * (depth - depth / 20)  # at the middle of the lowest of ten slices
    assert np.nanmax(study.stages[0].blocks.arc) == pytest.approx(2 * np.arcsin(width / 10), abs=np.radians(0.5))


@pytest.mark.parametrize(("leg", "spacing"), [
    pytest.param(2.3, 4e-4, marks=pytest.mark.slow), pytest.param(3.0, 3.1e-4, marks=pytest.mark.slow)])
def test_prisms_whose_edges_lie_across_the_dexels_are_within_a_thousandth(leg: float, spacing: float) -> None:
    """Ridge and ends of the prism fall between the dexels: volumes taken and left by the closed form."""
    study = _run(_chamfer(leg), spacing=spacing)
    assert 1e9 * study.stages[0].removed.total_volume == pytest.approx(leg**2 / 2 * 40, rel=1e-3)
    assert 1e9 * study.stages[0].removed.left_volume == pytest.approx(16000 - leg**2 / 2 * 40, rel=1e-3)
    assert 1e9 * study.stages[1].removed.total_volume == pytest.approx(400, rel=1e-3)
    assert 1e9 * study.stages[1].removed.left_volume == pytest.approx(16000 - leg**2 / 2 * 40 - 400, rel=1e-3)


@pytest.mark.slow
def test_what_one_plane_took_is_gone_in_the_next() -> None:
    """The same chamfer twice: the second pass takes nothing; from upright again the slot is whole."""
    text = _chamfer(3.0)
    once, twice = _run(text, spacing=5e-4), _run(text.replace("G0 X-7 Y15 Z5", "G0 X-7 Y0 Z30\nG68.2 J45\nG53.1\n"
                                                "G0 X-7 Y0 Z9\nZ-2.121320\nG1 X47\nG0 Z9\n"
                                                "G69\nG0 X-7 Y15 Z5"), spacing=5e-4)
    volumes = [stage.removed.total_volume for stage in twice.stages]
    assert volumes[2] < 0.01 * volumes[0]
    assert twice.removed_volume == pytest.approx(once.removed_volume, rel=0.01)


@pytest.mark.parametrize("tilt", [20.0, pytest.param(50.0, marks=pytest.mark.slow)])
@pytest.mark.default_cases(1)
def test_arcs_of_a_ball_on_a_face_at_tilt_are_closed(tilt: float) -> None:
    """The ball's point at kappa and phi is below the face where cos(phi) n_y < (cos(kappa) n_z - 1 + a/R)/sin(kappa)."""
    depth, radius, angle = 1e-3, 5e-3, np.radians(tilt)
    # The centre runs R - a above the face z = 0; the tip is R below it along the tool's axis.
    normal = np.array([np.sin(angle), np.cos(angle)])  # of the face along the plane's y and z
    height, across = normal[1] * 1e3 * (radius - depth), normal[0] * 1e3 * (radius - depth)
    text = (f"S9000\nG68.2 X0 Y10 Z0 J{tilt:g}\nG53.1\nG0 X-9 Y{across:.6f} Z20\nG0 Z{height - 5:.6f}\n"
            "G1 X30 F1800\nG0 Z30\nG69\nG0 X0 Y0 Z40")
    study = _run(text, (0, 0, -0.006, 0.03, 0.02, 0), spacing=3e-4, corner_radius=radius)
    removed = study.stages[0].removed
    middle = int(np.flatnonzero((np.abs(removed.tip[:, 0] - 20e-3) < 1.3e-3) & (removed.reach > 0))[0])
    total = radius * np.arccos(1 - removed.reach[middle] / radius)
    errors = []
    for k in range(removed.arcs.shape[1]):
        kappa = total * (k + 0.5) / removed.arcs.shape[1] / radius
        limit = (np.cos(kappa) * normal[1] - 1 + depth / radius) / np.sin(kappa) / normal[0]
        exact = np.pi - np.arccos(np.clip(limit, -1, 1))
        errors.append(np.degrees(abs(float(removed.arc_length[middle, k]) - exact)))
    assert max(errors) < 1.0 and np.median(errors) < 0.5


def test_words_that_turn_axes_are_refused_with_their_line() -> None:
    program = parse("S9000\nG0 X-7 Y0\nG43 H1\nG1 X47 B30 F1800", start=(0, 0, 0.05))
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)), CuttingDescription.of(**CUT))
    with pytest.raises(ToolpointError, match="line 4 cut with A, B or C turned"):
        studies.run_program(program, setup)


def test_a_tilted_program_has_no_path_of_three_axes() -> None:
    with pytest.raises(ToolpointError, match="line 4 is in a tilted plane"):
        _ = parse(_chamfer(3.0), start=(0, 0, 0.05)).path


@pytest.mark.slow
def test_advice_and_a_record_go_with_stages() -> None:
    """A record of both stages with 20 % more load, 5 s of turning between: each stage finds its place and factor."""
    from toolpoint.studies.machining.recorded.spindle_load import spindle_load
    from toolpoint.vibration import Modes

    tip = studies.modal_dynamics(Modes([900.0, 1080.0], [0.02, 0.02], [[1.6, 0], [0, 1.5]], ("tool:+x", "tool:+y")))
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)), CuttingDescription.of(**CUT),
                                       spacing=6e-4)
    text = _chamfer(3.0).replace("G69", "G69\nS9000").replace("G1 X47\nG0 Z9", "G1 X20 F900\nX47 F2200\nG0 Z9")
    staged = studies.run_stages(parse(text, start=(0, 0, 0.05)), setup, tip, text=text, with_advice=True)
    assert all(stage.advice is not None for stage in staged.stages)
    speed, feed = staged.advised_words
    assert set(feed) <= set(range(1, 20)) and all(0.4 <= factor <= 1.3 for factor in speed.values())
    loads = [spindle_load(stage.laid, stage.removed, stage.loads, setup=stage.setup, step=0.01) for stage in staged.stages]
    noise = np.random.default_rng(0)
    parts = [np.concatenate([1.2 * load.total, np.zeros(500)]) for load in loads]
    values = 300 + np.concatenate(parts)
    time = 0.01 * np.arange(values.size)
    compared = studies.compare_stages(staged, time, values + noise.normal(0, 3, values.size))
    factors = [stage.record.fit.factor for stage in compared.stages if stage.record is not None]
    assert len(factors) == 2 and np.allclose(factors, 1.2, rtol=0.06)
    assert not compared.record_doubts
