"""What analysis programs and analysers write beside responses: modes in set 2414, elements in set 2412, spectra, repeated
channels."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.io import uff
from toolpoint.io.uff import functions
from toolpoint.vibration import Dof, Frf, Modes

NOTED = pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.unv"


def set_2414(frequency: float, ratio: float, mass: float, table: dict[int, list[float]], *, form: str = "13.5E", kind: int = 2,
             analysis: int = 2, result: int = 8, pole: tuple[float, ...] = (0.0,) * 6) -> str:
    head = [f"{1:10d}", "mode", f"{1:10d}", *["NONE"] * 5, f"{1:10d}{analysis:10d}{2:10d}{result:10d}{kind:10d}{3:10d}",
            "".join(f"{v:10d}" for v in (1, 0, 1, 0, 1, 1, 0, 0)), f"{0:10d}{0:10d}",
            "".join(f"{v:13.5E}" for v in (0.0, frequency, (2 * np.pi * frequency) ** 2, mass, ratio, 0.0)),
            "".join(f"{v:13.5E}" for v in pole)]
    body = [line for point, row in table.items()
            for line in (f"{point:10d}", *("".join(f"{v:{form}}" for v in row[at:at + 6]) for at in range(0, len(row), 6)))]
    return "    -1\n  2414\n" + "\n".join(head + body) + "\n    -1\n"


@NOTED
@pytest.mark.parametrize(("form", "kind"), [("13.5E", 2), ("20.12E", 4)])
def test_normal_modes_of_set_2414_are_the_modes_that_set_55_would_give(path, form, kind):
    modes = Modes([10.0, 20.0], [0.01, 0.02], np.array([[0.5, 1.0], [-2.0, 0.25], [1.5, -1.0]]), ["1:+x", "1:+y", "7:+z"])
    uff.write(path, modes)
    old = uff.read_modes(path)
    path.write_text("".join(
        set_2414(float(modes.frequency[i]), float(modes.damping_ratio[i]), 1.0,
                 {1: [modes.shape[0, i], modes.shape[1, i], 0.0], 7: [0.0, 0.0, modes.shape[2, i]]}, form=form, kind=kind)
        for i in (1, 0)))
    new = uff.read_modes(path)
    assert new.dofs == old.dofs and new.scaling == old.scaling == "unit modal mass"
    assert np.allclose(new.frequency, old.frequency) and np.allclose(new.damping_ratio, old.damping_ratio)
    assert np.allclose(new.shape, old.shape, rtol=1e-5)


@NOTED
def test_complex_modes_of_set_2414_have_the_pole_and_modal_a_of_their_record(path):
    pole, a = complex(-3.0, 200.0), complex(0.5, -2.0)
    row = [1.0, 0.5, 0.0, 0.0, -2.0, 1.0]
    path.write_text(set_2414(0.0, 0.0, 0.0, {3: row}, kind=5, analysis=3, pole=(pole.real, pole.imag, a.real, a.imag, 0, 0)))
    modes = uff.read_modes(path)
    assert modes.poles[0] == pytest.approx(pole, rel=1e-5)
    assert modes.scaling == "modal A"
    at = [modes.dofs.index(Dof(3, way)) for way in ("+x", "+z")]
    assert np.allclose(modes.shape[at, 0] * np.sqrt(a), [1 + 0.5j, -2 + 1j], rtol=1e-5)


def test_results_that_are_no_mode_shapes_are_left_out_with_a_warning(path):
    path.write_text(set_2414(10.0, 0.01, 1.0, {1: [1.0, 0.0, 0.0]}) + set_2414(0.0, 0.0, 0.0, {1: [1.0, 0, 0]}, result=2))
    with pytest.warns(ToolpointWarning, match="set 2414 of analysis type 2, location 1, result type 2"):
        assert uff.read_modes(path).count == 1


@NOTED
@pytest.mark.parametrize(("kind", "nodes", "count"), [
    (94, 4, 4), (95, 8, 8), (91, 3, 3), (111, 4, 6), (112, 6, 9), (115, 8, 12), (116, 20, 24), (118, 10, 12), (113, 15, 18),
    (11, 2, 1), (24, 3, 2), (136, 2, 1), (161, 1, 0)])
def test_an_element_is_drawn_by_all_its_edges(path, kind, nodes, count):
    """Euler: a closed polyhedron has V - E + F = 2, so its edges (halved by their middle nodes) are known."""
    uff.write(path, uff.MeasuredGeometry(tuple(range(1, nodes + 1)), np.random.default_rng(0).standard_normal((nodes, 3))))
    numbers = [f"{n:10d}" for n in range(1, nodes + 1)]
    beam = [f"{0:10d}{1:10d}{1:10d}"] if kind in (11, 24) else []
    lines = [f"{1:10d}{kind:10d}{1:10d}{1:10d}{7:10d}{nodes:10d}", *beam,
             *("".join(numbers[at:at + 8]) for at in range(0, nodes, 8))]
    with path.open("a") as file:
        file.write("    -1\n  2412\n" + "\n".join(lines) + "\n    -1\n")
    shape = uff.read_geometry(path)
    assert len(shape.lines) == count
    degree = np.bincount(np.array(shape.lines).ravel(), minlength=nodes + 1)[1:] if count else np.zeros(nodes)
    assert (degree >= (1 if count else 0)).all()  # no node hangs in the air


@NOTED
def test_a_parabolic_solid_puts_its_middle_nodes_between_corners(path):
    """Corners of a parabolic brick on a cube, each middle node half-way: then every drawn line is half an edge long."""
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    around = np.array([point for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True) for point in (a, (a + b) / 2)])
    points = [*([x, y, 0.0] for x, y in around), *([x, y, 0.5] for x, y in ring), *([x, y, 1.0] for x, y in around)]
    uff.write(path, uff.MeasuredGeometry(tuple(range(1, 21)), np.array(points)))
    with path.open("a") as file:
        numbers = "".join(f"{n:10d}" + "\n" * (n % 8 == 0) for n in range(1, 21))
        file.write(f"    -1\n  2412\n{1:10d}{116:10d}{1:10d}{1:10d}{7:10d}{20:10d}\n{numbers}\n    -1\n")
    shape = uff.read_geometry(path)
    lengths = [np.linalg.norm(np.subtract(*shape.coordinates[[a - 1, b - 1]])) for a, b in shape.lines]
    assert np.allclose(lengths, 0.5)


def test_an_unknown_element_is_left_out_and_a_damaged_one_refused(path):
    uff.write(path, uff.MeasuredGeometry((1, 2, 3), np.eye(3)))
    plain = path.read_text()
    path.write_text(plain + f"    -1\n  2412\n{1:10d}{999:10d}{1:10d}{1:10d}{7:10d}{3:10d}\n{1:10d}{2:10d}{3:10d}\n    -1\n")
    with pytest.warns(ToolpointWarning, match="1 elements of kind 999"):
        assert uff.read_geometry(path).lines == ()
    path.write_text(plain + f"    -1\n  2412\n{1:10d}{94:10d}{1:10d}{1:10d}{7:10d}{4:10d}\n{1:10d}{2:10d}\n    -1\n")
    with pytest.raises(ToolpointError, match="element 1 of a set 2412 lists 2 nodes; must be 4"):
        uff.read_geometry(path)


def function(kind: int, response: str, reference: str | None, data, numerator: int, lines) -> bytes:
    """A function of any type: written as a response, then its type is put in its place of record 6."""
    raw = functions.written(functions.RESPONSE_TYPE, Dof.parse(response), Dof.parse(reference) if reference else None,
                            numerator=numerator, denominator=13, abscissa=lines, data=data, text=False)
    head = f"{functions.RESPONSE_TYPE:5d}{0:10d}{0:5d}{0:10d} NONE".encode()
    assert head in raw
    return raw.replace(head, f"{kind:5d}{0:10d}{0:5d}{0:10d} NONE".encode(), 1)


def causal(lines: np.ndarray, *frequencies: float) -> np.ndarray:
    omega = 2 * np.pi * lines
    return sum((1 / ((2 * np.pi * f) ** 2 - omega**2 + 2j * 0.02 * (2 * np.pi * f) * omega) for f in frequencies),
               np.zeros(lines.size, complex))


@NOTED
@pytest.mark.parametrize(("cross", "auto"), [(3, 2), (9, 9)])
def test_cross_spectra_and_densities_give_the_response_that_made_them(path, cross, auto):
    lines = np.arange(1, 400) * 0.5
    response, force, noise = causal(lines, 30.0, 80.0), 2.0 + np.cos(lines / 40), 0.1
    motion = np.abs(response) ** 2 * force * (1 + noise)
    uff.write(path)
    path.write_bytes(path.read_bytes() + function(cross, "2:+x", "1:+x", response * force, 8, lines)
                     + function(auto, "1:+x", "1:+x", force, 13, lines) + function(auto, "2:+x", "2:+x", motion, 8, lines))
    frf = uff.read_frf(path)
    assert np.allclose(frf.values[:, 0, 0], response, rtol=1e-12)
    assert frf.coherence is not None and np.allclose(frf.coherence, 1 / (1 + noise))
    assert any("H1 of 1 cross spectra" in note for note in frf.notes)
    assert [f.type for f in uff.read_functions(path)] == [uff.spectra.TYPES[k] for k in (cross, auto, auto)]


@NOTED
def test_forces_measured_together_are_taken_apart_by_their_cross_spectra(path):
    lines = np.arange(1, 300) * 0.5
    h = np.stack([causal(lines, 30.0), causal(lines, 50.0)])
    g11, g22, g12 = np.full(lines.size, 2.0), np.full(lines.size, 3.0), np.full(lines.size, 0.5 + 0.7j)
    forces = np.array([[g11 + 0j, g12], [g12.conj(), g22 + 0j]]).transpose(2, 0, 1)
    gxf = (h.T[:, None, :] @ forces)[:, 0]
    uff.write(path)
    path.write_bytes(path.read_bytes() + function(3, "9:+x", "1:+x", gxf[:, 0], 8, lines)
                     + function(3, "9:+x", "2:+x", gxf[:, 1], 8, lines) + function(3, "1:+x", "2:+x", g12, 13, lines)
                     + function(2, "1:+x", None, g11, 13, lines) + function(2, "2:+x", None, g22, 13, lines))
    assert np.allclose(uff.read_frf(path).values[:, 0], h.T, rtol=1e-10)


def test_conjugate_cross_spectra_are_seen_to_run_backward(path):
    lines = np.arange(400) * 0.5
    uff.write(path)
    path.write_bytes(path.read_bytes() + function(3, "2:+x", "1:+x", causal(lines, 30.0).conj(), 8, lines)
                     + function(2, "1:+x", None, np.ones(lines.size), 13, lines))
    with pytest.warns(ToolpointWarning, match="run backward in time"):
        uff.read_frf(path)


def test_spectra_without_the_force_are_refused(path):
    lines = np.arange(1, 50) * 1.0
    uff.write(path)
    path.write_bytes(path.read_bytes() + function(3, "2:+x", "1:+x", causal(lines, 30.0), 8, lines))
    with pytest.raises(ToolpointError, match="0 auto spectra of the force at 1"):
        uff.read_frf(path)


def test_two_channels_of_one_dof_are_renamed_with_a_warning(path):
    lines = np.arange(1, 20) * 1.0
    first, second = (Frf(lines, np.full((19, 1, 1), value), ["3:+x"], ["1:+x"]) for value in (1.0, 2.0))
    uff.write(path, first)
    uff.write(path, second, append=True)
    with pytest.warns(ToolpointWarning, match=r"two channels of 3:\+x: number 2 is named 3_2:\+x"):
        frf = uff.read_frf(path)
    assert [str(dof) for dof in frf.outputs] == ["3:+x", "3_2:+x"]
    assert np.array_equal(frf.values[0, :, 0], [1.0, 2.0])
    record = functions.written(functions.TIME_RECORD_TYPE, Dof(3, "+x"), None, numerator=12, denominator=0,
                               abscissa=np.arange(8) / 100, data=np.arange(8.0), text=False)
    uff.write(path)
    path.write_bytes(path.read_bytes() + record + record)
    with pytest.warns(ToolpointWarning, match="two channels"):
        assert [str(dof) for dof in uff.read_record(path).channels] == ["3:+x", "3_2:+x"]
