"""What the ground holds is the weight, at the centre of mass of the pose."""

import json

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import io
from toolpoint.app.main import main
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf
from toolpoint.studies import study_base_reactions


def weight_and_centre(machine, pose):
    place, mass, first = place_machine(machine, pose), 0.0, np.zeros(3)
    for link, body in enumerate(machine.bodies):
        moment = body.mass[3:6, :3] / body.mass[0, 0]
        centre = tf.move(place.frames[0, link], np.array([moment[2, 1], moment[0, 2], moment[1, 0]])[None])[0]
        mass, first = mass + body.mass[0, 0], first + body.mass[0, 0] * centre
    return mass, first / mass


@pytest.mark.parametrize("pose", [{}, {"X": 0.3, "Y": -0.1, "Z": 0.2}])
def test_the_ground_holds_the_weight_at_the_centre_of_mass(pose):
    machine = io.read_machine(MACHINES / "three_axis_vertical.yaml")
    result = study_base_reactions(machine, [pose])
    mass, centre = weight_and_centre(machine, pose)
    weight = np.array([0, 0, -9.80665 * mass])
    assert result.mass == pytest.approx(mass)
    np.testing.assert_allclose(result.wrench[0], [*-weight, *-np.cross(centre, weight)], rtol=1e-9, atol=1e-5)
    assert "states no gravity" in result.notes[0]


def test_the_command_prints_and_gives_plain_data(capsys, tmp_path):
    text = (MACHINES / "three_axis_vertical.yaml").read_text(encoding="utf-8")
    (tmp_path / "m.yaml").write_text(text + "\ngravity: [0, -10, 0]\n", encoding="utf-8")
    main(["base", str(tmp_path / "m.yaml"), "--pose", "X=0.1", "--pose", "X=-100mm", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert len(told["reactions"]) == 2 and told["notes"] == []
    assert told["reactions"][0]["force_n"] == pytest.approx([0, 10 * told["mass_kg"], 0])
    main(["base", str(MACHINES / "three_axis_vertical.yaml")])
    assert "mass" in capsys.readouterr().out
