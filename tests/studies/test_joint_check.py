"""Identified machine beside its own test: a doubt names what differs, and that alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from toolpoint._doubt import Doubt
from toolpoint.studies.measured.joint_study import JointStudy
from toolpoint.studies.measured.machine_check import MachineCheck
from toolpoint.vibration import Modes


def check(frequency=100.0, damping=0.02, mac=0.999, partner=0):
    measured = Modes([100.0], [0.02], np.ones((1, 1)), ["1:+x"])
    one = np.ones(1)
    return MachineCheck(frequency * one, damping * one, measured, np.array([partner]), mac * one, one, 0 * one)


def test_a_machine_that_gives_back_its_test_is_not_doubted():
    assert check(100.4, 0.022).doubts == ()  # within 0.5 % and 15 %


@pytest.mark.parametrize(("change", "words"), [
    ({"mac": 0.906}, "its shape has a MAC of 0.906 only"), ({"frequency": 99.0}, "its frequency is -1 % off"),
    ({"damping": 0.03}, "its damping is +50 % off")])
def test_what_differs_is_named_and_what_agrees_is_not(change, words):
    (doubt,) = check(**change).doubts
    assert doubt.why == f"is not the measured one: {words}" and doubt.remedy


def test_a_doubt_of_several_joints_is_said_once_with_all_of_them():
    turned, soft = Doubt("points [18]", "do not move with bed"), Doubt("stiffness", "is known within 60 % only")
    joints = [SimpleNamespace(parent=parent, child=child, doubts=doubts) for parent, child, doubts in (
        ("ground", "bed", (turned,)), ("bed", "column", (turned, soft)))]
    identified = SimpleNamespace(joints=joints, doubts=(), machine=None)
    study = JointStudy(identified, None, None, None, None)
    assert study.doubts == ("ground - bed, bed - column: points [18]: do not move with bed",
                            "bed - column: stiffness: is known within 60 % only")


def test_a_measured_mode_without_a_partner_is_named_with_its_frequency():
    assert str(check(300.0, partner=-1).doubts[0]).startswith("measured modes at 100 Hz: are without a partner")
