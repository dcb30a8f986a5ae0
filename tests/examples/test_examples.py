"""The examples run as they are; one number of each is asserted."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"


def run(name):
    return runpy.run_path(str(FOLDER / name))["main"]()


def test_machine_against_its_test():
    # The paper's own model deviates from its experiment by 4.8 % at most (table 5).
    assert run("compare_a_machine_with_its_test.py") == pytest.approx(4.8, abs=0.3)


def test_joint_to_stiffen():
    assert run("find_the_joint_to_stiffen.py").startswith("joints.foundation.stiffness.")


def test_lobes_of_one_mode():
    # The lowest converged depths of this slot over 5000 .. 25000 rev/min lie about 0.0475 mm.
    assert run("draw_stability_lobes_of_one_mode.py") == pytest.approx(0.0475, rel=0.1)


def test_modes_from_hammer_blows():
    # The bar for the full test (131 points, 1 % noise) is 0.1 %.
    assert run("identify_a_machine_from_hammer_blows.py") < 0.1


def test_every_example_is_tested():
    text = Path(__file__).read_text(encoding="utf-8")
    assert all(path.name in text for path in FOLDER.glob("*.py"))
