"""Robots in URDF: places, axes and masses as the file says; doubts about inertias; what is no tree of links is refused."""

import contextlib
import json

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io import read_machine
from toolpoint.io.urdf import read, read_robot
from toolpoint.machine import build
from toolpoint.machine.assembly.inverse_dynamics import gravity_force
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import rotation

LINK = """<link name="{name}"><inertial><origin xyz="{centre}" rpy="0 0 0"/><mass value="{mass}"/>
<inertia ixx="{i}" iyy="{i}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="{centre}"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>"""
JOINT = """<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/><parent link="{parent}"/><child link="{child}"/>
<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="1" velocity="1"/>{more}</joint>"""


def link(name, mass=8.0, centre="0 0 0.2", i=0.11, z=None):
    return LINK.format(name=name, mass=mass, centre=centre, i=i, z=z or 0.12 * i)


def joint(name, parent, child, kind="revolute", **values):
    given = {"xyz": "0 0 0.4", "rpy": "0 0 0", "axis": "0 1 0", "low": -2, "high": 2, "more": "", **values}
    return JOINT.format(name=name, parent=parent, child=child, kind=kind, **given)


def robot(*parts):
    return f'<?xml version="1.0"?>\n<robot name="two">{"".join(parts)}</robot>'


WHOLE = robot('<link name="base"/>', link("upper"), link("lower", 4.0, i=0.055), '<link name="flange"/>',
              joint("a", "base", "upper", xyz="0 0 0.3", rpy="0 0 0.5"), joint("b", "upper", "lower", axis="0 -1 0"),
              joint("c", "lower", "flange", "fixed", xyz="0.05 0 0.4"))


def write(tmp_path, text):
    path = tmp_path / "two.urdf"
    path.write_text(text)
    return path


def test_places_axes_and_weights_are_those_of_the_file(tmp_path):
    machine = read_machine(write(tmp_path, WHOLE))
    assert [axis.name for axis in machine.chain.axes] == ["a", "b"]
    a, b = 0.4, -0.7
    place = place_machine(machine, {"a": a, "b": b})
    first = rotation.about("z", 0.5) @ rotation.about("y", a)
    second = first @ rotation.about("y", -b)
    expected = [0, 0, 0.3] + first @ [0, 0, 0.4] + second @ [0.05, 0, 0.4]
    np.testing.assert_allclose(place.position(machine.description.points["flange"])[0], expected, atol=1e-12)
    centres = [[0, 0, 0.3] + first @ [0, 0, 0.2], [0, 0, 0.3] + first @ [0, 0, 0.4] + second @ [0, 0, 0.2]]
    hinge = first @ [0, 1, 0]
    moments = [np.cross(c - np.array([0, 0, 0.3]), [0, 0, -9.81 * m]) for c, m in zip(centres, (8.0, 4.0), strict=True)]
    force = gravity_force(machine, {"a": a, "b": b}, [0, 0, -9.81])[0]
    assert force[0] == pytest.approx(-hinge @ sum(moments), abs=1e-10)


def test_stiffness_given_to_joints_makes_it_vibrate(tmp_path):
    path = write(tmp_path, WHOLE)
    with pytest.raises(ValueError, match="no elastic or free direction"):
        natural_frequencies(read_machine(path), {})
    springs = {name: {"rx": 1e5, "ry": 1e5, "rz": 4e4} for name in ("a", "b")}
    assert natural_frequencies(build(read(path, springs)), {}, 6).shape == (1, 6)


def test_mimicking_joints_are_driven_by_the_axis_they_follow(tmp_path):
    text = WHOLE.replace(joint("b", "upper", "lower", axis="0 -1 0"),
                         joint("b", "upper", "lower", more='<mimic joint="a" multiplier="-1"/>'))
    machine = read_machine(write(tmp_path, text))
    assert [axis.name for axis in machine.chain.axes] == ["a"]
    turned = machine.chain.displacements({"a": 0.3})[0, machine.link("lower"), :3, :3]
    np.testing.assert_allclose(turned, np.eye(3), atol=1e-12)


def test_audit_of_inertias(tmp_path, capsys):
    doubtful = robot('<link name="base"/>', link("light", 0.05, i=7e-4), link("turned", 8.0, i=110.0),
                     link("one", 1.0, i=1.0, z=1.0),
                     *(joint(f"j{i}", parent, child) for i, (parent, child) in enumerate(
                         [("base", "light"), ("light", "turned"), ("turned", "one")])))
    path = write(tmp_path, doubtful)
    doubts = " | ".join(read_robot(path, mass=25.0).doubts)
    for text in ("-64 % off the 25 kg", "link light: density 12.5 kg/m^3", "link turned: principal moments",
                 "link one: mass of exactly", "a placeholder?"):
        assert text in doubts, doubts
    assert read_robot(write(tmp_path, WHOLE), mass=12.0).doubts == ()
    with contextlib.suppress(SystemExit):
        main(["check", str(write(tmp_path, doubtful)), "--mass", "25", "--json"])
    assert any("density" in doubt for doubt in json.loads(capsys.readouterr().out)["doubts"])


@pytest.mark.parametrize(("text", "message"), [
    (WHOLE[:-20], "no valid XML"), ("<robot/>", "no links"), ("<machine/>", "must be <robot>"),
    (WHOLE.replace('child link="lower"', 'child link="arm"'), "'arm'; is no link"),
    (WHOLE.replace('lower="-2" upper="2"', 'lower="2" upper="-2"'), "reversed"),
    (WHOLE.replace('type="revolute"', 'type="planar"'), "type 'planar'"),
    (WHOLE.replace('mass value="4.0"', 'mass value="nan"'), "finite numbers"),
    (WHOLE.replace(link("lower", 4.0, i=0.055), '<link name="lower"/>'), "link lower: no inertia"),
    (WHOLE.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'), "axis of length 0"),
    (robot(link("a"), link("b"), link("c"), joint("x", "a", "b"), joint("y", "c", "b")), "two joints have it"),
    (robot(link("a"), link("b"), joint("x", "a", "b"), joint("y", "b", "a")), "hangs on itself"),
    ('<!DOCTYPE robot [<!ENTITY a "b">]><robot/>', "document type"),
    (WHOLE.replace('iyy="0.055"', 'iyy="5.5"'), "triangle inequality")])
def test_faults_are_named(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_machine(write(tmp_path, text))
