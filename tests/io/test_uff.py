"""Universal files: round trips to the last bit, vendor quirks, bad files, agreement with pyuff."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from toolpoint import Dof, Frf, Modes, Record, ToolpointError, ToolpointWarning
from toolpoint.io import uff
from toolpoint.io.uff.geometry import MeasuredGeometry


def responses(seed: int = 0, points: int = 3, lines: int = 40, quantity: str = "accelerance") -> Frf:
    rng = np.random.default_rng(seed)
    outputs = [Dof(point + 1, way) for point in range(points) for way in ("+x", "-y", "+rz")]
    values = rng.standard_normal((lines, len(outputs), 2)) + 1j * rng.standard_normal((lines, len(outputs), 2))
    return Frf(np.arange(lines) / 3, values, outputs, [Dof(1, "+x"), Dof(2, "-z")], quantity,
               coherence=rng.random(values.shape))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.unv"


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_binary_responses_come_back_to_the_last_bit(path, quantity):
    frf = responses(quantity=quantity)
    uff.write(path, frf)
    back = uff.read_frf(path)
    assert np.array_equal(back.values, frf.values)
    assert np.array_equal(back.frequency, frf.frequency)
    assert np.array_equal(back.coherence, frf.coherence)
    assert (back.outputs, back.inputs, back.quantity, back.notes) == (frf.outputs, frf.inputs, quantity, ())


@settings(deadline=None, max_examples=30)
@given(hnp.arrays(float, st.integers(2, 30), elements=st.floats(1e-6, 1e6), unique=True),
       st.floats(allow_nan=False, allow_infinity=False, width=64), st.booleans())
def test_any_axis_and_any_number_survive(tmp_path_factory, axis, number, even):
    path = tmp_path_factory.mktemp("uff") / "a.unv"
    axis = np.sort(axis)
    frequency = axis[0] + np.arange(axis.size) * float(axis[-1] - axis[0] + 1) if even else axis
    values = np.full((axis.size, 1, 1), number - 1j * number)
    uff.write(path, Frf(frequency, values, ["7:-y"], ["7:-y"]))
    back = uff.read_frf(path)
    assert np.array_equal(back.frequency, frequency)
    assert np.array_equal(back.values, values)


def test_text_responses_come_back_to_thirteen_digits(path):
    frf = responses()
    uff.write(path, frf, text=True)
    back = uff.read_frf(path)
    assert np.allclose(back.values, frf.values, rtol=1e-12, atol=0)
    assert np.array_equal(back.frequency, frf.frequency)
    assert b"58b" not in path.read_bytes()


def test_an_overwritten_and_an_appended_binary_file_read_back(path):
    first, second = responses(0), responses(1)
    uff.write(path, first)
    uff.write(path, second)
    assert np.array_equal(uff.read_frf(path).values, second.values)
    other = Frf(second.frequency, second.values, [Dof(9 + i, "x") for i in range(9)], second.inputs, "accelerance",
                second.coherence)
    uff.write(path, other, append=True)
    assert uff.read_frf(path).outputs == (*second.outputs, *other.outputs)


def test_records_geometry_and_modes_round_trip(path):
    rng = np.random.default_rng(0)
    record = Record(rng.standard_normal((50, 2)), 1000 / 3, ["1:+x", "2:-z"], ("force", "acceleration"), start=-0.1)
    shape = MeasuredGeometry((1, 2, 30), rng.standard_normal((3, 3)), ((1, 2), (2, 30, 1)))
    modes = Modes([10.0, 20.0], [0.01, 0.02], rng.standard_normal((3, 2)) + 1j * rng.standard_normal((3, 2)),
                  ["1:+x", "2:-y", "30:+z"], "modal A")
    uff.write(path, record, shape, modes)
    back = uff.read_record(path)
    assert np.array_equal(back.samples, record.samples)
    assert back.quantities == record.quantities and back.channels == record.channels
    assert back.sample_rate == pytest.approx(record.sample_rate, rel=1e-12)
    points = uff.read_geometry(path)
    assert np.array_equal(points.coordinates, shape.coordinates)
    assert points.lines == shape.lines and points.points == shape.points
    found = uff.read_modes(path)
    assert np.allclose(found.poles, modes.poles, rtol=1e-4)
    assert found.scaling == "modal A"
    sign = [1 if dof.direction[0] == "+" else -1 for dof in modes.dofs]
    at = [found.dofs.index(Dof(dof.point, "+" + dof.direction[1])) for dof in modes.dofs]
    assert np.allclose(found.shape[at] * np.array(sign)[:, None], modes.shape, rtol=1e-5, atol=1e-5)


def test_real_modes_keep_modal_mass_and_damping(path):
    modes = Modes([10.0], [0.01], np.array([[0.5], [-2.0]]), ["1:+x", "2:+rz"])
    uff.write(path, modes)
    found = uff.read_modes(path)
    assert found.scaling == "unit modal mass" and not np.iscomplexobj(found.shape)
    assert found.damping_ratio == pytest.approx([0.01])
    assert set(found.dofs) == set(modes.dofs)


def test_only_headers_are_read_when_a_file_is_opened(path, monkeypatch):
    uff.write(path, responses())
    monkeypatch.setattr(uff.UniversalFile, "payload", lambda *_: pytest.fail("values were read"))
    heads = uff.headers(path)
    assert len(heads) == 36 and heads[0].response == Dof(1, "+x")
    assert "58b" in repr(uff.UniversalFile(path))


def repaired(path, data: bytes) -> Frf:
    path.write_bytes(data)
    with pytest.warns(ToolpointWarning):
        return uff.read_frf(path)


def text_file(path, **more) -> bytes:
    frf = responses(points=1, lines=7)
    uff.write(path, Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, "accelerance"), text=True, **more)
    return path.read_bytes()


@pytest.mark.parametrize(("change", "note"), [
    (lambda d: d.replace(b"E+", b"D+").replace(b"E-", b"D-"), "D exponents"),
    (lambda d: b"\r\n\n" + d, "blank lines"),
    (lambda d: d[:d.index(b"    -1\n   164")] + d[d.index(b"    -1\n    58"):], "no units set 164"),
    (lambda d: d.replace(b"    -1\n    -1\n", b"    -1\n"), "one delimiter line"),
    (lambda d: d.rstrip()[:-2].rstrip(b" "), "not closed"),
    (lambda d: d.replace(b"frequency response" + b" " * 62, b"frequency response" * 6), "longer"),
    (lambda d: d.replace(b"    4         0    0         0 NONE", b"4 0 0 0 NONE"), "columns"),
    (lambda d: d.replace(b"    -1\n    58", b"    -1\n\n    58"), "blank line"),
])
def test_vendor_quirks_are_read_and_reported(path, change, note):
    good = text_file(path)
    expected = uff.read_frf(path).values
    found = repaired(path, change(good))
    assert np.allclose(found.values, expected, rtol=1e-12)
    assert any(note in line for line in found.notes), found.notes


@pytest.mark.parametrize("end", [b"\r\n", b"\r"])
def test_any_line_end_is_read_without_repair(path, end):
    good = text_file(path)
    expected = uff.read_frf(path).values
    path.write_bytes(good.replace(b"\n", end))
    assert np.array_equal(uff.read_frf(path).values, expected)


def test_numbers_that_touch_are_parted(path):
    good = text_file(path)
    expected = uff.read_frf(path).values
    found = repaired(path, good.replace(b" -", b"-"))
    assert np.allclose(found.values, expected, rtol=1e-12)


def test_a_wrong_byte_count_of_a_binary_set_is_repaired(path):
    frf = responses(points=1, lines=16)
    uff.write(path, frf)
    data = path.read_bytes()
    found = repaired(path, data.replace(b"         256 ", b"         128 ").replace(b"         256", b"         128"))
    assert np.array_equal(found.values, frf.values)
    assert any("bytes" in note for note in found.notes)


def test_other_units_and_g_become_si(path):
    good = text_file(path)
    expected = uff.read_frf(path).values
    length = good.index(b"1.0000000000000000D+00")
    path.write_bytes(good[:length] + b"1.0000000000000000D+03" + good[length + 22:])
    assert np.allclose(uff.read_frf(path).values, expected / 1000)
    found = repaired(path, good.replace(b"m/s^2" + b" " * 15, b"g" + b" " * 19))
    assert np.allclose(found.values, expected * 9.80665)


def without_units_set(data):
    return data[:data.index(b"    -1\n   164")] + data[data.index(b"    -1\n    58"):]


@pytest.mark.parametrize(("motion", "force", "factor"), [
    (b"mm/s^2", b"N", 1e-3), (b"g", b"lbf", 9.80665 / 4.4482216152605), (b"um/s^2", b"N", None), (b"NONE", b"NONE", 1.0),
    (b"g/N", b"NONE", 9.80665), (b"m/s^2", b"kN", 1e-3)])
def test_unit_labels_are_followed_where_no_units_set_stands(path, motion, force, factor):
    """A file of mm/s^2 without its units set was read as m/s^2."""
    good = text_file(path)
    expected = uff.read_frf(path).values
    bare = without_units_set(good).replace(b"m/s^2" + b" " * 15, motion.ljust(20))
    data = bare.replace(b" N" + b" " * 19, b" " + force.ljust(20))
    frf = repaired(path, data)
    if factor is None:
        assert any("'um/s^2' is not known: SI is assumed" in note for note in frf.notes)
    else:
        assert np.allclose(frf.values, expected * factor, rtol=1e-12)
        assert any("by their unit labels" in note for note in frf.notes) == (factor != 1.0)


def test_a_label_that_contradicts_the_units_set_is_noted(path):
    good = text_file(path)
    expected = uff.read_frf(path).values
    frf = repaired(path, good.replace(b"m/s^2" + b" " * 15, b"mm/s^2" + b" " * 14))
    assert np.array_equal(frf.values, expected) and any("the set is followed" in note for note in frf.notes)


def test_what_is_no_universal_file_is_refused(path):
    for data in (b"frequency, real, imaginary\n1, 2, 3\n", b"\x89HDF\r\n\x1a\n" + bytes(100), b"    -1\nhello\n"):
        path.write_bytes(data)
        with pytest.raises(ToolpointError, match="not a universal file"):
            uff.read_frf(path)
    path.write_bytes(b"")
    with pytest.raises(ToolpointError, match="empty file"):
        uff.read_frf(path)
    with pytest.raises(ToolpointError, match="cannot be read"):
        uff.read_frf(path.with_name("nowhere.unv"))


def test_incomplete_and_contradicting_files_are_refused(path):
    frf = responses(points=1, lines=9)
    uff.write(path, Frf(frf.frequency, frf.values, frf.outputs, frf.inputs))
    whole = path.read_bytes()
    uff.write(path, Frf(frf.frequency, frf.values, frf.outputs, frf.inputs), append=True)
    with pytest.raises(ToolpointError, match="twice"):
        uff.read_frf(path)
    last = whole.rindex(b"    -1\n    58b")
    path.write_bytes(whole[:last])
    with pytest.raises(ToolpointError, match="missing"):
        uff.read_frf(path)
    path.write_bytes(whole[:last + 1100])
    with pytest.raises(ToolpointError, match="cut short"):
        uff.read_frf(path)
    other = Frf(frf.frequency * 2 + 1, frf.values, [Dof(5, "x"), Dof(6, "x"), Dof(7, "x")], frf.inputs)
    path.write_bytes(whole)
    uff.write(path, other, append=True)
    with pytest.raises(ToolpointError, match="axes must be equal"):
        uff.read_frf(path)


ANY_LABELS = ["tool:+x", "tip-work:-y", 7, "Größe 3:+rz", Dof("tool", "test +x", (0.6, 0.0, 0.8)), Dof(900001, "-z"),
              Dof(-4, "+y"), Dof(7, "slant", (0.0, 0.6, -0.8)), Dof(10**12, "+x")]


def any_dofs():
    return [label if isinstance(label, Dof) else Dof.parse(str(label) if ":" in str(label) else f"{label}:+x")
            for label in ANY_LABELS]


@pytest.mark.parametrize("text", [False, True])
def test_labels_of_every_kind_are_read_back(path, text):
    """Named, relative and negative points, numbers beyond ten columns, directions off the axes: functions, records, shapes."""
    rng, dofs = np.random.default_rng(1), any_dofs()
    frf = Frf([1.0, 2.0, 3.0], rng.normal(size=(3, len(dofs), 2)) + 0j, dofs, dofs[:2])
    uff.write(path, frf, text=text)
    back = uff.read_frf(path)
    assert back.outputs == frf.outputs and back.inputs == frf.inputs
    np.testing.assert_allclose(back.values, frf.values, rtol=1e-12)
    modes = Modes([5.0, 9.0], 0.01, rng.normal(size=(len(dofs), 2)), dofs, "unscaled")
    uff.write(path, modes)
    read = uff.read_modes(path)
    assert set(read.dofs) == {d if d.direction[0] != "-" else Dof(d.point, "+" + d.direction[1:]) for d in dofs}
    np.testing.assert_allclose(read.shape_at([dofs[4], dofs[7]]), modes.shape_at([dofs[4], dofs[7]]), rtol=1e-4)
    record = Record(rng.normal(size=(8, len(dofs))), 100.0, dofs, ("acceleration",) * len(dofs))
    uff.write(path, record, text=text)
    assert uff.read_record(path).channels == record.channels


def test_what_is_appended_later_keeps_labels_apart(path):
    first, second = (Frf([1.0, 2.0], k * np.ones((2, 1, 1)), [f"{name}:+x"], ["tip:+x"]) for k, name in ((1, "a"), (2, "b")))
    uff.write(path, first)
    uff.write(path, second, append=True)
    back = uff.read_frf(path)
    assert [str(dof) for dof in back.outputs] == ["a:+x", "b:+x"] and back.inputs == first.inputs
    np.testing.assert_array_equal(back.values[0, :, 0], [1, 2])


def test_a_damaged_table_of_labels_is_refused(path):
    uff.write(path, Frf([1.0, 2.0], np.ones((2, 1, 1)), ["tool:+x"], ["tool:+x"]))
    path.write_bytes(path.read_bytes().replace(b'"tool"]', b'"to'))
    with pytest.raises(ToolpointError, match="table of labels"):
        uff.read_frf(path)


def test_a_value_that_is_not_finite_is_refused(path):
    frf = Frf([1.0, 2.0], np.ones((2, 1, 1)), ["1:+x"], ["1:+x"])
    uff.write(path, frf)
    data = path.read_bytes().replace(np.float64(1.0).tobytes(), np.float64(np.nan).tobytes())
    path.write_bytes(data)
    with pytest.raises(ToolpointError, match=r"1:\+x / 1:\+x is not finite at 1 Hz"):
        uff.read_frf(path)


def test_pyuff_reads_what_is_written_and_the_other_way_round(path):
    pyuff = pytest.importorskip("pyuff")
    frf = responses(points=1)
    uff.write(path, Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, "accelerance"))
    sets = [one for one in pyuff.UFF(str(path)).read_sets() if one["type"] == 58]
    assert np.allclose(sets[0]["data"], frf.values[:, 0, 0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        assert uff.read_frf(path).values.shape == frf.values.shape


def test_real_shapes_among_complex_ones_share_their_scaling(path):
    real = Modes(np.array([10.0]), np.array([0.01]), np.array([[0.5], [-2.0]]), ["1:+x", "2:+x"])
    uff.write(path, real)
    uff.write(path, Modes(np.array([20.0]), np.array([0.02]), np.array([[1 + 1j], [2.0]]), ["1:+x", "2:+x"], "modal A"),
              append=True)
    found = uff.read_modes(path)
    assert found.scaling == "modal A"
    assert np.allclose(found.shape[:, 0] ** 2, real.shape[:, 0] ** 2 / (2j * real.poles[0].imag), rtol=1e-4)


def changed(path, was: bytes, now: bytes) -> None:
    data = path.read_bytes()
    assert was in data
    path.write_bytes(data.replace(was, now))


def test_a_complex_response_behind_a_real_one_keeps_its_imaginary_part(path):
    first, second = (Frf([1.0, 2.0], np.full((2, 1, 1), value), [dof], ["1:+x"])
                     for value, dof in ((1.0, "1:+x"), (2 - 3j, "2:+x")))
    uff.write(path, first, second, text=True)
    data = path.read_bytes()
    form, numbers = b"%10d%10d%10d" % (6, 2, 1), b"".join(b"%20.12E" % x for x in (1, 0, 1, 0))
    assert form in data and numbers in data
    path.write_bytes(data.replace(form, b"%10d%10d%10d" % (4, 2, 1), 1).replace(numbers, numbers[:20] + numbers[40:60]))
    assert uff.read_frf(path).values[:, :, 0].tolist() == [[1, 2 - 3j]] * 2


@pytest.mark.parametrize(("was", "now", "words"), [
    (b"        13    0    0    0", b"        12    0    0    0", "18 of 18 responses .* motion over acceleration; .*swapped"),
    (b"        12    0    0    0", b"        13    0    0    0", "18 of 18 responses .* force over another channel; .*swapped"),
])
def test_swapped_channels_are_refused_unless_the_quantity_is_stated(path, was, now, words):
    frf = responses()
    uff.write(path, Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, "accelerance"))
    changed(path, was, now)
    with pytest.raises(ToolpointError, match=words):
        uff.read_frf(path)
    with pytest.warns(ToolpointWarning, match="not stated as motion over force"):
        assert uff.read_frf(path, "accelerance").quantity == "accelerance"


@pytest.mark.parametrize(("was", "now", "words"), [
    (b"         6         7         1", b"         6      four         1", "header of function .*damaged"),
    (b"         6         7         1", b"         6         0         1", "data type 6 and 0 values"),
    (b"         6         7         1", b"         3         7         1", "data type 3 and 7 values"),
    (b"        12    0    0    0", b"     metre    0    0    0", "header of function .*damaged"),
    (b"         1   1\n", b"      NONE   1\n", "header of function .*damaged"),
])
def test_a_header_that_is_damaged_is_refused_with_its_function(path, was, now, words):
    text_file(path)
    changed(path, was, now)
    with pytest.raises(ToolpointError, match=words):
        uff.read_frf(path)


def test_a_units_set_scales_forces_and_motions_of_time_records_apart(path):
    """Set 164 with 1000 units in a metre and 2 in a newton: motions over 1000, forces over 2."""
    record = Record(np.arange(20.0).reshape(10, 2) + 1, 100.0, (Dof(1, "+x"), Dof(2, "+x")), ("force", "acceleration"))
    uff.write(path, record, text=True)
    good = path.read_bytes()
    one = b"1.0000000000000000D+00"
    first = good.index(one)
    second = good.index(one, first + 22)
    path.write_bytes(good[:first] + b"1.0000000000000000D+03" + good[first + 22:second] + b"2.0000000000000000D+00"
                     + good[second + 22:])
    assert np.allclose(uff.read_record(path).samples, record.samples / [2, 1000])
