"""STEP files: unit, size, one body, mesh and mass against closed forms; the mesher's own geometry kernel writes the files."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError, ToolpointWarning, studies
from toolpoint.bodies.solid import STEEL
from toolpoint.io import read_step, read_surface
from toolpoint.io.meshes.step_file import file_unit
from toolpoint.io.meshes.surface_file import volume_within

HEADER = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n"
MILLIMETRE = "#1 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
METRE = "#2 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) );\n"
INCH = "#3 = ( CONVERSION_BASED_UNIT('INCH',#9) LENGTH_UNIT() NAMED_UNIT(#8) );\n"
meshed = pytest.mark.skipif(importlib.util.find_spec("netgen") is None, reason="Netgen (extra 'mesh') is not installed")


@pytest.fixture(scope="module")
def kept_meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Meshes of this module: each answer of the mesher costs a process that loads a geometry kernel."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def own_cache(kept_meshes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOOLPOINT_CACHE", str(kept_meshes))


@pytest.fixture(scope="module")
def drawn_beam(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A steel bar 200 x 20 x 30 mm with a bore of 10 mm across, from x = 100 mm on.

    Drawn once: a second drawing has another date, and so other content.
    """
    from netgen.occ import Box, Cylinder, Pnt, Z

    path = tmp_path_factory.mktemp("drawn") / "bar.step"
    (Box(Pnt(100, 0, 0), Pnt(300, 20, 30)) - Cylinder(Pnt(200, 10, -1), Z, r=5, h=32)).WriteStep(str(path))
    return path


@pytest.fixture
def beam(drawn_beam: Path, tmp_path: Path) -> Path:
    """The drawn bar in a folder of the test's own."""
    return Path(shutil.copy(drawn_beam, tmp_path))


@pytest.mark.parametrize(("units", "size"), [(MILLIMETRE, 1e-3), (METRE, 1.0), (INCH + MILLIMETRE, 0.0254)])
def test_the_file_unit_is_read(tmp_path: Path, units: str, size: float) -> None:
    path = tmp_path / "part.step"
    path.write_text(HEADER + units)
    assert file_unit(path) == size


@pytest.mark.parametrize(("text", "words"), [
    ("solid part", "no STEP file"), (HEADER, "states no length unit"), (HEADER + METRE + MILLIMETRE, "lengths in mm and m")])
def test_files_without_one_unit_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "part.stp"
    path.write_text(text)
    with pytest.raises(ToolpointError, match=words):
        file_unit(path)


def test_the_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "part.step"
    path.write_text(HEADER + MILLIMETRE)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ToolpointError, match=r"toolpoint\[mesh\]"):
        read_step(path, STEEL, mesh_size=0.01)


@meshed
def test_mass_centre_and_inertia_are_those_of_the_drawing(beam: Path) -> None:
    part = read_step(beam, STEEL, mesh_size=0.012)
    a, b, c, r = 0.2, 0.02, 0.03, 0.005
    bore = np.pi * r**2 * c
    mass = STEEL.density * (a * b * c - bore)
    # Box less cylinder along z, both about the common centre.
    about_z = STEEL.density * (a * b * c * (a**2 + b**2) / 12 - bore * r**2 / 2)
    about_x = STEEL.density * (a * b * c * (b**2 + c**2) / 12 - bore * (3 * r**2 + c**2) / 12)
    known = part.model.mass_properties
    assert known.mass == pytest.approx(mass, rel=2e-4)
    assert known.centre == pytest.approx([0.2, 0.01, 0.015], abs=1e-6)
    assert known.inertia[2, 2] == pytest.approx(about_z, rel=2e-4)
    assert known.inertia[0, 0] == pytest.approx(about_x, rel=2e-4)
    assert part.geometry.volume == pytest.approx(mass / STEEL.density, rel=1e-9)
    assert part.geometry.inertia[2, 2] * STEEL.density == pytest.approx(about_z, rel=1e-9)
    assert part.geometry.inertia[0, 0] * STEEL.density == pytest.approx(about_x, rel=1e-9)
    assert "% and inertia" in part.notes[0]
    assert part.check.jacobian_ratio > 0.1
    assert "bar.step in mm" in part.notes[0]


@meshed
@pytest.mark.slow  # two processes of the mesher: the mesh is held by its mass and inertia, the element by its own tests
def test_a_slender_bar_bends_as_a_beam(tmp_path: Path) -> None:
    from netgen.occ import Box, Pnt

    from toolpoint.vibration.sparse import modes

    path = tmp_path / "slender.step"
    Box(Pnt(0, 0, 0), Pnt(1000, 20, 30)).WriteStep(str(path))
    model = read_step(path, STEEL, mesh_size=0.02).model
    shift = (2 * np.pi * 20) ** 2
    found = modes(model.stiffness() + shift * model.mass(), model.mass(), 8).frequency
    elastic = np.sqrt(np.maximum(found**2 - 20.0**2, 0))[6:]
    # Free-free Euler-Bernoulli, 4.730041 the first root of cos x cosh x = 1; shear and rotary inertia take below 0.5 %.
    for frequency, depth in zip(elastic, (0.02, 0.03), strict=True):
        slender = 4.730041**2 / (2 * np.pi) * np.sqrt(STEEL.modulus / STEEL.density / 12) * depth
        assert frequency == pytest.approx(slender, rel=5e-3)


@meshed
def test_the_mesh_is_kept_by_content(beam: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = read_step(beam, STEEL, mesh_size=0.012).model
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)  # no mesher is asked again
    again = read_step(beam, STEEL, mesh_size=0.012).model
    assert np.array_equal(first.nodes, again.nodes)
    with pytest.raises(ToolpointError, match="needs Netgen"):
        read_step(beam, STEEL, mesh_size=0.031)


@meshed
@pytest.mark.parametrize(("unit", "length"), [("m", "200 m"), ("cm", "2 m")])
def test_a_unit_that_contradicts_a_sensible_file_is_refused(beam: Path, unit: str, length: str) -> None:
    with pytest.raises(ToolpointError, match=f"{length} long.*states mm and so is 0.2 m"):
        read_step(beam, STEEL, mesh_size=0.03, unit=unit)


@meshed
def test_millimetres_that_a_file_calls_metres_are_refused_and_can_be_put_right(beam: Path) -> None:
    wrong = beam.with_name("wrong.step")
    wrong.write_text(beam.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    with pytest.raises(ToolpointError, match=r"size: 200 m.*unit='mm'"):
        read_step(wrong, STEEL, mesh_size=0.03)
    with pytest.warns(ToolpointWarning, match="read in mm, though the file states m"):
        part = read_step(wrong, STEEL, mesh_size=0.03, unit="mm")
    assert part.check.size == pytest.approx([0.2, 0.02, 0.03])


@meshed
def test_a_part_of_millimetres_is_asked_about(tmp_path: Path) -> None:
    from netgen.occ import Box, Pnt

    path = tmp_path / "bed.step"
    Box(Pnt(0, 0, 0), Pnt(3.0, 0.8, 0.6)).WriteStep(str(path))  # a bed of three metres, drawn in metres
    with pytest.warns(ToolpointWarning, match="only 3 mm long: was it drawn in m"), \
            pytest.raises(ToolpointError, match="mass"):
        read_step(path, STEEL, mesh_size=0.5e-3)


@meshed
def test_two_bodies_a_damaged_file_and_a_tiny_mesh_are_refused(tmp_path: Path, beam: Path) -> None:
    from netgen.occ import Box, Glue, Pnt

    two = tmp_path / "two.step"
    Glue([Box(Pnt(0, 0, 0), Pnt(30, 30, 30)), Box(Pnt(50, 0, 0), Pnt(80, 30, 30))]).WriteStep(str(two))
    with pytest.raises(ToolpointError, match=r"2 solids.*30 x 30 x 30 mm.*must be one body"):
        read_step(two, STEEL, mesh_size=0.03)
    cut = tmp_path / "cut.step"
    text = beam.read_text()
    unit = next(line for line in text.splitlines() if "LENGTH_UNIT()" in line)
    cut.write_text(text[:2000] + "\n" + unit)
    with pytest.raises(ToolpointError, match="no whole STEP file"):
        read_step(cut, STEEL, mesh_size=0.03)
    with pytest.raises(ToolpointError, match="larger elements"):
        read_step(beam, STEEL, mesh_size=1e-4)


@meshed
def test_what_the_mesher_cannot_do_is_said_with_what_to_try(tmp_path: Path) -> None:
    from netgen.occ import Cylinder, Pnt, Z

    path = tmp_path / "tube.step"
    (Cylinder(Pnt(0, 0, 0), Z, r=50, h=300) - Cylinder(Pnt(0, 0, -1), Z, r=48, h=302)).WriteStep(str(path))
    with pytest.raises(ToolpointError, match=r"cannot mesh it with elements of 30 mm; take a smaller mesh_size"):
        read_step(path, STEEL, mesh_size=0.03)


@meshed
@pytest.mark.slow
def test_a_small_part_whose_file_says_metres_is_asked_about_by_its_mass(tmp_path: Path) -> None:
    from netgen.occ import Box, Pnt

    path = tmp_path / "clamp.step"
    Box(Pnt(0, 0, 0), Pnt(8, 2, 2)).WriteStep(str(path))
    path.write_text(path.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    with pytest.warns(ToolpointWarning, match=r"2\.51e\+05 kg: was it drawn in mm\?"):
        read_step(path, STEEL, mesh_size=2.0)


def test_folded_elements_are_straightened() -> None:
    from toolpoint.bodies.solid.element_kinds import TETRAHEDRON
    from toolpoint.bodies.solid.straighten import straighten

    nodes = TETRAHEDRON.nodes.copy()
    nodes[4] = [0.5, 0.45, 0.45]  # a mid-side node pushed through the opposite side
    straight, count = straighten(nodes, np.arange(10)[None])
    assert count == 1
    assert straight == pytest.approx(TETRAHEDRON.nodes)
    assert straighten(TETRAHEDRON.nodes, np.arange(10)[None])[1] == 0


@meshed
def test_a_stock_has_the_volume_of_its_solid(beam: Path) -> None:
    """Triangles in mm, closed: a bar of 200 x 20 x 30 mm less its bore of 10 mm."""
    triangles = read_surface(beam)
    volume = 200 * 20 * 30 - np.pi * 25 * 30
    assert volume_within(triangles) == pytest.approx(volume, rel=5e-4)
    edges = np.sort(np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)[1].reshape(-1, 3)[
        :, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    stock = studies.stock_of("", (), triangles)
    assert stock.lower == pytest.approx([0.1, 0, 0], abs=1e-9) and stock.upper == pytest.approx([0.3, 0.02, 0.03], abs=1e-9)


def test_a_stock_of_a_step_file_names_the_missing_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "part.STEP"
    path.write_text(HEADER + MILLIMETRE)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ToolpointError, match=r"toolpoint\[mesh\]"):
        read_surface(path)
