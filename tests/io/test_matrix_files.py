"""Matrix files: the samples, bit for bit there and back in every variant, and damaged files."""

import h5py
import numpy as np
import pytest
import scipy.io
from scipy.sparse import csc_array, save_npz

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.io import read_matrices
from toolpoint.io.matrices import abaqus_mtx, ansys_full, dmig, harwell_boeing, matrix_files, matrix_market, op4, op4_writer
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix
from toolpoint.studies.finite_elements.matrix_modes import solve_matrix_modes
from toolpoint.vibration import Dof


def sample(name="KAA", seed=1, shape=(12, 12), is_complex=False, is_symmetric=True):
    rng = np.random.default_rng(seed)
    dense = rng.standard_normal(shape) * 10.0 ** rng.integers(-9, 9, shape) * (rng.random(shape) < 0.4)
    if is_complex:
        dense = dense + 1j * rng.standard_normal(shape) * (dense != 0)
    if is_symmetric:
        dense = np.triu(dense) + np.triu(dense, 1).T + np.eye(shape[0])
    dofs = tuple(Dof(k // 3 + 1, "xyz"[k % 3]) for k in range(shape[0]))
    return LabelledMatrix(name, csc_array(dense), dofs, dofs if is_symmetric else ())


def same(a, b):
    return a.shape == b.shape and a.dtype == b.dtype and (a.toarray() == b.toarray()).all()


@pytest.mark.parametrize("storage", op4_writer.STORAGES)
@pytest.mark.parametrize("options", [
    {"is_text": True}, {"order": "<"}, {"order": ">"}, {"order": "<", "integers": 8}, {"order": ">", "integers": 8}], ids=str)
@pytest.mark.parametrize("is_single", [False, True])
def test_op4_is_read_back_bit_for_bit(tmp_path, storage, options, is_single):
    written = [sample(), sample("RECT", 2, (30, 7), is_complex=True, is_symmetric=False)]
    if is_single:
        written = [LabelledMatrix(m.name, csc_array(m.matrix.astype("c8" if m.matrix.dtype.kind == "c" else "f4").astype(
            m.matrix.dtype))) for m in written]
    op4_writer.write(tmp_path / "a.op4", written, storage=storage, is_single=is_single, **options)
    back = op4.read(tmp_path / "a.op4")
    assert [m.name for m in back] == ["KAA", "RECT"]
    assert all(same(a.matrix, b.matrix) for a, b in zip(written, back, strict=True))


@pytest.mark.parametrize("layout", ["coordinate", "array"])
@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("is_complex", [False, True])
def test_matrix_market_is_read_back_bit_for_bit(tmp_path, layout, symmetry, is_complex):
    item = sample(is_complex=is_complex)
    matrix_market.write(tmp_path / "a.mtx", item, symmetry=symmetry, layout=layout)
    assert same(matrix_files.read_labelled(tmp_path / "a.mtx")[0].matrix, item.matrix)


@pytest.mark.parametrize("layout", ["matrix input", "coordinate"])
def test_abaqus_is_read_back_bit_for_bit(tmp_path, layout):
    item = sample()
    abaqus_mtx.write(tmp_path / "a.mtx", item, layout=layout)
    back = matrix_files.read_labelled(tmp_path / "a.mtx")[0]
    assert same(back.matrix, item.matrix) and (back.rows == item.rows if layout == "matrix input" else back.rows == ())


def test_abaqus_held_rows_are_left_out_and_noted(tmp_path):
    (tmp_path / "k.mtx").write_text("1,1, 1,1, 2.0\n1,1, 1,2, -1.0\n1,2, 1,2, 1e36\n")
    back = abaqus_mtx.read(tmp_path / "k.mtx")[0]
    assert back.matrix.toarray().tolist() == [[2.0]] and "1 held rows" in back.notes[0]


@pytest.mark.parametrize("symmetry", ["unsymmetric", "symmetric"])
def test_harwell_boeing_is_read_back_bit_for_bit(tmp_path, symmetry):
    item = sample()
    harwell_boeing.write(tmp_path / "a.hb", item, symmetry=symmetry)
    assert same(harwell_boeing.read(tmp_path / "a.hb")[0].matrix, item.matrix)


def test_dmig_is_read_back_to_the_digits_of_its_fields(tmp_path):
    """Sixteen characters hold ten digits of a signed number with its exponent: the format's own limit."""
    items = [sample(), sample("CPLX", 3, is_complex=True, is_symmetric=False)]
    items[1] = LabelledMatrix("CPLX", items[1].matrix, items[0].rows, items[0].rows)
    dmig.write(tmp_path / "a.pch", items)
    back = dmig.read(tmp_path / "a.pch")
    for a, b in zip(items, back, strict=True):
        assert a.name == b.name
        rows = [a.rows.index(dof) for dof in b.rows]
        assert np.allclose(a.matrix.toarray()[np.ix_(rows, rows)], b.matrix.toarray(), rtol=1e-9, atol=0)
    dmig.write(tmp_path / "b.pch", back)
    assert all(same(a.matrix, b.matrix) for a, b in zip(back, dmig.read(tmp_path / "b.pch"), strict=True))


def test_dmig_numbers_hold_every_digit_that_fits():
    """Sixteen characters always; whole where few digits say it, within half of the last digit that fits where not."""
    rng = np.random.default_rng(2)
    values = np.concatenate([rng.standard_normal(50) * 10.0 ** rng.integers(-320, 308, 50), [0.0, 1.5, -2e9, 2.0**-20, 1e-310]])
    for value in values:
        text = dmig._sixteen(float(value))
        assert len(text) == 16 and abs(float(text.replace("D", "E")) - value) <= 5.1e-9 * abs(value)
    for value in (1.5, -2e9, 2.0**-10, 123456.789012, 0.0):
        assert float(dmig._sixteen(value).replace("D", "E")) == value


def test_dmig_in_small_and_free_fields(tmp_path):
    (tmp_path / "a.bdf").write_text("DMIG,STIF,0,6,2,0\nDMIG,STIF,1,1,,1,1,2.5+3\n,2,1,-1.D0\n"
                                    "DMIG    STIF    2       1               2       1       3.\nENDDATA\n")
    back = dmig.read(tmp_path / "a.bdf")[0]
    assert back.matrix.toarray().tolist() == [[2500.0, -1.0], [-1.0, 3.0]] and back.rows == (Dof(1, "+x"), Dof(2, "+x"))


def test_the_op4_samples_hold_the_same_matrices_in_three_variants(measured):
    """One set of matrices in text and in two binary forms: text to its 10 digits, single precision to its 7."""
    folder = measured / "matrices"
    exact = op4.read(folder / "double_nonbigmat_be_i64.op4")
    for name, digits in (("double_bigmat_ascii.op4", 1e-9), ("single_dense_le.op4", 1e-7)):
        for a, b in zip(exact, op4.read(folder / name), strict=True):
            assert np.allclose(a.matrix.toarray(), b.matrix.toarray(), rtol=digits, atol=0)


def test_the_dmig_sample(measured):
    """What the file is made to hold: the identity over 21 rows, and a pattern whose column numbers are its values."""
    items = {m.name: m.matrix.toarray() for m in dmig.read(measured / "matrices" / "matrix_factory.pch")}
    assert (items["IDENT"] == np.eye(21)).all()
    assert (items["PATRN"] == np.arange(1, 22)).all(axis=1).all() or (items["PATRN"] == np.arange(1, 22)[:, None]).all()
    assert items["CMPLX"].dtype.kind == "c"


def test_the_full_sample(measured):
    """Mass and frequencies that came with the file (README of the data): a free body of 345 rows, upper triangle stored."""
    body = read_matrices(measured / "matrices" / "sparse.full")
    assert np.allclose(body.directional_mass, 77.96604704575776, rtol=1e-14)
    modes = body.modes(12)
    assert (modes.frequency[:6] == 0).all() and modes.frequency.size == 13
    # More than half of all are solved for at once: the same lowest ones, and every row has its mode.
    whole = body.modes(500).frequency
    assert whole.size == 345 and whole[:13] == pytest.approx(modes.frequency, rel=1e-7, abs=1e-9)
    printed = [116.733109, 116.733109, 230.605375, 279.987386, 313.302135, 322.573947]
    assert np.allclose(modes.frequency[6:12], printed, rtol=6e-8)


def test_modes_of_two_files(tmp_path):
    """A chain of three masses on springs to the ground: k = [2 -1 0; ...], m = 1: 2 - 2 cos(pi j / 4)."""
    k = csc_array(np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]]))
    matrix_market.write(tmp_path / "k.mtx", LabelledMatrix("k", k))
    matrix_market.write(tmp_path / "m.mtx", LabelledMatrix("m", csc_array(np.eye(3))))
    modes = read_matrices(tmp_path / "k.mtx", tmp_path / "m.mtx").modes(3)
    assert np.allclose(modes.omega**2, 2 - 2 * np.cos(np.pi * np.arange(1, 4) / 4), rtol=1e-12)
    with pytest.raises(ToolpointError, match="holds k alone; must hold mass too"):
        read_matrices(tmp_path / "k.mtx")


def test_unsymmetric_imported_stiffness_is_refused(tmp_path):
    matrix_market.write(tmp_path / "k.mtx", LabelledMatrix("k", csc_array(np.array([[2.0, -1], [0, 2]]))))
    matrix_market.write(tmp_path / "m.mtx", LabelledMatrix("m", csc_array(np.eye(2))))
    with pytest.raises(ToolpointError, match=r"ImportedMatrices.stiffness: unsymmetric by 1"):
        read_matrices(tmp_path / "k.mtx", tmp_path / "m.mtx")


def test_mass_that_differs_by_direction_is_doubted(tmp_path):
    dofs = (Dof(1, "+x"), Dof(1, "+y"))
    items = [LabelledMatrix(name, csc_array(np.diag(d)), dofs, dofs) for name, d in (("KAA", [4.0, 5]), ("MAA", [1.0, 2]))]
    dmig.write(tmp_path / "a.pch", items)
    with pytest.warns(ToolpointWarning, match="mass differs by direction: 1, 2, 0 kg"):
        assert read_matrices(tmp_path / "a.pch").notes


def files_of_every_format(folder):
    """One small file of every format, with its reader."""
    item = sample()
    matrix_market.write(folder / "market.mtx", item)
    abaqus_mtx.write(folder / "abaqus.mtx", item)
    op4_writer.write(folder / "binary.op4", [item])
    op4_writer.write(folder / "text.op4", [item], is_text=True, storage="sparse")
    harwell_boeing.write(folder / "hb.hb", item)
    dmig.write(folder / "dmig.pch", [item])
    return {"market.mtx": matrix_market.read, "abaqus.mtx": abaqus_mtx.read, "binary.op4": op4.read, "text.op4": op4.read,
            "hb.hb": harwell_boeing.read, "dmig.pch": dmig.read}


def damaged(raw, rng, turn):
    """Cut the file, blot a run of bytes, or drop one; the first twelve are cuts, which no reader may take for whole."""
    at = int(rng.integers(1, len(raw) - 40))
    if turn < 12:
        return raw[:at]
    if turn < 16:
        return raw[:at] + bytes(rng.integers(0, 256, 40, dtype=np.uint8)) + raw[at + 40:]
    return raw[:at] + raw[at + int(rng.integers(1, 30)):]


def refusal(reader, path):
    """The words of the reader's own error, none where it reads; any other exception passes."""
    try:
        reader(path)
    except ToolpointError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", ["market.mtx", "abaqus.mtx", "binary.op4", "text.op4", "hb.hb", "dmig.pch", "sparse.full"])
def test_twenty_damaged_files_of_each_format(tmp_path, name, request):
    """A reader answers with its own error that names the file, or reads what is still a matrix; never anything else."""
    readers = files_of_every_format(tmp_path)
    if name == "sparse.full":
        readers[name] = ansys_full.read
        (tmp_path / name).write_bytes((request.getfixturevalue("measured") / "matrices" / name).read_bytes()[:160000])
    raw, rng, refused = (tmp_path / name).read_bytes(), np.random.default_rng(5), 0
    for turn in range(20):
        path = tmp_path / ("x" + name)
        path.write_bytes(damaged(raw, rng, turn))
        refused += path.name in refusal(readers[name], path)
    # A line less of a format that does not say how many there are is a matrix still.
    assert refused >= {"abaqus.mtx": 8, "dmig.pch": 8}.get(name, 15)


def _chain_files(folder, *, loose=False):
    """Stiffness and mass of thirty masses on a line as Matrix Market files, entries (row, column, value) from 1."""
    n = 30
    stiffness = [(i, i, 1e6 if loose and i in (1, n) else 2e6) for i in range(1, n + 1)]
    stiffness += [(i + 1, i, -1e6) for i in range(1, n)]
    return stiffness, [(i, i, 2.0) for i in range(1, n + 1)], n


def _market(path, entries, n, *, kind="real symmetric"):
    path.write_text(f"%%MatrixMarket matrix coordinate {kind}\n{n} {n} {len(entries)}\n"
                    + "\n".join(" ".join(f"{v!r}" for v in entry) for entry in entries) + "\n")
    return path


def test_matrices_that_cannot_be_are_refused_with_their_file(tmp_path):
    stiffness, mass, n = _chain_files(tmp_path)
    k, m = _market(tmp_path / "k.mtx", stiffness, n), _market(tmp_path / "m.mtx", mass, n)
    read_matrices(k, m)
    turned = _market(tmp_path / "ku.mtx", [*stiffness, (3, 8, 1e5)], n, kind="real general")
    with pytest.raises(ToolpointError, match=r"ku.mtx: .*unsymmetric by"):
        read_matrices(turned, m)
    negative = _market(tmp_path / "mn.mtx", [(i, j, -1.0 if i == 5 else v) for i, j, v in mass], n)
    with pytest.raises(ToolpointError, match=r"mn.mtx: .*-1 on the diagonal of row 5 .*must not be negative"):
        read_matrices(k, negative)
    imaginary = _market(tmp_path / "mc.mtx", [(i, j, v, 0.1) for i, j, v in mass], n, kind="complex symmetric")
    with pytest.raises(ToolpointError, match=r"mc.mtx: .*a mass must be real"):
        read_matrices(k, imaginary)


def test_imaginary_stiffness_is_left_out_and_said(tmp_path):
    stiffness, mass, n = _chain_files(tmp_path)
    k = _market(tmp_path / "k.mtx", [(i, j, v, 0.02 * v) for i, j, v in stiffness], n, kind="complex symmetric")
    matrices = read_matrices(k, _market(tmp_path / "m.mtx", mass, n))
    assert any("structural damping) are left out" in note for note in matrices.notes)
    closed = np.sqrt(1e6 / 2) * 2 * np.sin(np.pi / (2 * (n + 1))) / (2 * np.pi)
    assert matrices.modes(1).frequency[0] == pytest.approx(closed, rel=1e-9)


def test_more_rigid_motions_than_one_body_has_are_doubted(tmp_path):
    """Seven chains that nothing joins; all modes asked for: no rigid motion seems unstable by rounding."""
    stiffness, mass, n = _chain_files(tmp_path, loose=True)
    both = [[(i + s * n, j + s * n, v) for s in range(7) for i, j, v in part] for part in (stiffness, mass)]
    files = [_market(tmp_path / name, part, 7 * n) for name, part in zip(("k.mtx", "m.mtx"), both, strict=True)]
    matrices = read_matrices(*files)
    result = solve_matrix_modes(matrices, 12)
    assert str(result.notes[0]).startswith("modes at 0 Hz: 7 of them; one free body has six")
    whole = solve_matrix_modes(matrices, 7 * n).modes.frequency
    closed = np.sqrt(1e6 / 2) * 2 * np.sin(np.pi * np.arange(n) / (2 * n)) / (2 * np.pi)
    assert whole == pytest.approx(np.repeat(closed, 7), rel=1e-7, abs=1e-3)


def test_rows_without_labels_have_no_mass_by_direction(tmp_path):
    """Ones on all rows would add up to three times the mass of a solid, and call it that along x."""
    stiffness, mass = np.diag([2e6, 3e6, 4e6]), np.diag([2.0, 2.0, 2.0])
    for name, matrix in (("k", stiffness), ("m", mass)):
        matrix_market.write(tmp_path / f"{name}.mtx", LabelledMatrix(name, csc_array(matrix)))
    found = solve_matrix_modes(read_matrices(tmp_path / "k.mtx", tmp_path / "m.mtx"), 2)
    assert "their mass is not known" in found.table() and found.to_dict()["mass_kg"] is None
    assert found.modes.frequency == pytest.approx(np.sqrt([1e6, 1.5e6]) / (2 * np.pi))
    assert not found.notes or not any("exchanged" in note for note in found.notes)


def test_stiffness_and_mass_exchanged_are_doubted(tmp_path):
    for name, matrix in (("k", np.diag([2e6, 3e6, 4e6])), ("m", np.diag([2.0, 2.0, 2.0]))):
        matrix_market.write(tmp_path / f"{name}.mtx", LabelledMatrix(name, csc_array(matrix)))
    with pytest.warns(ToolpointWarning, match="are they exchanged"):
        found = read_matrices(tmp_path / "m.mtx", tmp_path / "k.mtx")
    assert any("0.00016 Hz" in note for note in found.notes)


def write_v73(path, matrices):
    """Write sparse matrices as MATLAB 7.3 lays them out: a group a matrix, columns compressed, in a user block of 512 bytes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, matrix in matrices.items():
            group = file.create_group(name)
            group.attrs["MATLAB_sparse"] = np.uint64(matrix.shape[0])
            group.attrs["MATLAB_class"] = np.bytes_(b"double")
            for part, values in (("data", matrix.data), ("ir", matrix.indices), ("jc", matrix.indptr)):
                group[part] = values
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))


@pytest.mark.parametrize("kind", ["sparse.mat", "full.mat", "73.mat", "full.npz"])
def test_matrices_of_arrays_give_the_modes_of_a_chain(tmp_path, kind):
    """Two masses of 1 kg between walls, three springs of 1e6 N/m: w = sqrt(k/m), sqrt(3 k/m); C is named and not used."""
    k, m = csc_array([[2e6, -1e6], [-1e6, 2e6]]), csc_array(np.eye(2))
    named = {"K": k, "M": m, "C": csc_array(20 * np.eye(2))}
    full = {name: matrix.toarray() for name, matrix in named.items()}
    path = tmp_path / kind
    if kind == "full.npz":
        np.savez(path, **full, note=np.array("text"), rate=np.array(1.0))
    elif kind == "73.mat":
        write_v73(path, named)
    else:
        scipy.io.savemat(path, {**(named if kind == "sparse.mat" else full), "fs": 1.0, "text": "abc"})
    read = read_matrices(path)
    assert any(note.startswith("C of the file is not used") for note in read.notes)
    np.testing.assert_allclose(solve_matrix_modes(read, 2).modes.frequency, np.sqrt([1e6, 3e6]) / (2 * np.pi), rtol=1e-12)


def test_a_sparse_archive_holds_one_matrix_by_the_name_of_the_file(tmp_path):
    for name, matrix in (("K", csc_array([[2e6, -1e6], [-1e6, 2e6]])), ("M", csc_array(np.eye(2)))):
        save_npz(tmp_path / f"{name}.npz", matrix)
    assert read_matrices(tmp_path / "K.npz", tmp_path / "M.npz").stiffness.toarray()[0, 1] == -1e6
    np.savez(tmp_path / "responses.npz", values=np.ones((3, 4)))
    with pytest.raises(ToolpointError, match="no square matrix"):
        read_matrices(tmp_path / "responses.npz")
