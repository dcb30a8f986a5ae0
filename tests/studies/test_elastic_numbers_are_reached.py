"""Numbers of elastic bodies reached by update, screen and improve: a known modulus comes back, frequencies go with its root."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, ElasticMaterial, PatchDescription
from toolpoint.studies import Factor, NamedMetrics, ResponsePeak, improve_machine, one_at_a_time, screen
from toolpoint.studies.measured.machine_update import update
from toolpoint.vibration.eigen import solve_undamped

MODULUS = "bodies.arm.elastic.materials.body.modulus"


@pytest.fixture
def arm(tmp_path, monkeypatch):
    """A steel arm of 0.6 m with a rail, on a stiff foot; tip and foot are interfaces."""
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path))
    boxes = (CastingBox((0, 0, 0), (0.06, 0.05, 0.6)), CastingBox((0.06, 0, 0), (0.075, 0.05, 0.6), material="rail"))
    faces = {"foot": PatchDescription((0.03, 0.025, 0.0), (1, 0, 0), (0, -1, 0), 0.06, 0.05),
             "tip": PatchDescription((0.03, 0.025, 0.6), (1, 0, 0), (0, 1, 0), 0.06, 0.05)}
    steel = ElasticMaterial(206e9, 7850.0, 0.3, 2e-3)
    body = ElasticDescription(boxes, faces, 900.0, 0.1, {"body": steel, "rail": replace(steel, modulus=150e9)})
    foot = JointDescription("ground", "arm", FrameDescription((0.03, 0.025, 0.0)),
                            {"x": 5e8, "y": 5e8, "z": 9e8, "rx": 3e6, "ry": 3e6, "rz": 2e6}, child_interface="foot")
    return build(MachineDescription("arm", {"arm": BodyDescription(elastic=body)}, {"foot": foot},
                                    points={"tip": PointDescription("arm", interface="tip")}, tool="tip"))


def test_update_finds_the_modulus_and_density_that_were_put_in(arm):
    rail = MODULUS.replace("body.modulus", "rail.density")
    truth = arm.with_values({MODULUS: 180e9, rail: 9000.0})
    modes = solve_undamped(assemble(truth, None, [f"tip:+{way}" for way in "xyz"])).selected(range(5))
    result = update(arm, [MODULUS, rail], modes)
    assert result.machine.value(MODULUS) == pytest.approx(180e9, rel=1e-4)
    assert result.machine.value(rail) == pytest.approx(9000.0, rel=1e-3)
    assert np.abs(result.after.frequency_error).max() < 1e-6


def test_screening_takes_moduli_by_pattern(arm):
    springs = tuple(f"joints.foot.stiffness.{way}" for way in ("x", "y", "z", "rx", "ry", "rz"))
    all_stiffness = Factor("stiffness", ("bodies.*.elastic.materials.*.modulus", *springs), 1.0, 2.0)
    result = screen(arm, one_at_a_time([all_stiffness]), NamedMetrics(("frequency 1",)))
    values = result.stated[:, 0]
    assert values.max() / values.min() == pytest.approx(2**0.5, rel=1e-9)


def test_improve_reaches_its_goal_by_a_modulus(arm):
    factors = [Factor("casting", (MODULUS,), 1.0, 1.5, cost=2.0), Factor("foot", ("joints.foot.stiffness.ry",), 1.0, 1.5)]
    before = improve_machine(arm, factors, ResponsePeak(static=True), goal=1e-12).start_value
    result = improve_machine(arm, factors, ResponsePeak(static=True), goal=0.85 * before)
    # The full model reduces the body anew: what the kept shapes lack is in the value and said.
    assert result.value == pytest.approx(0.85 * before, rel=0.01) and result.error < 0.01
    assert "the goal is met" in result.status
