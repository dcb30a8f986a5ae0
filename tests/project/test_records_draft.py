"""Draft of a test from records without labels: names of files, columns, what is taken already; checked before it is entered."""

import numpy as np
import pytest
import scipy.io

from toolpoint import ToolpointError
from toolpoint.io import read_project
from toolpoint.project import RecordsDraft, add_files, draft_test, enter_test, guess_kind, write_folder
from toolpoint.project.records_draft import _pattern_of

POINTS = frozenset({"1", "2", "12", "27", "tip"})
ROVING = ("1=force", "2=acceleration *:+x", "3=acceleration *:+y", "4=acceleration *:+z")


@pytest.fixture
def records(tmp_path):
    """Return MATLAB records of two points and two references: a pulse and its ring, without a name or unit."""
    time = np.arange(400) / 400.0
    force = np.where((time > 0.1) & (time < 0.11), 100.0, 0.0)
    ring = np.where(time > 0.1, np.sin(60 * time) * np.exp(-8 * time), 0.0)
    folder = tmp_path / "incoming"
    folder.mkdir()
    for point in (1, 2):
        for reference in ("27x", "12y"):
            scipy.io.savemat(folder / f"P{point}_ref{reference}.mat", {
                "fs": 400.0, "data": np.column_stack([force, ring, 2 * ring, 3 * ring])})
    (folder / "points.csv").write_text("point,x,y,z\n1,0,0,0\n2,1,0,0\n12,0,1,0\n27,0,0,1\n")
    return sorted(folder.iterdir())


def test_records_of_two_references_become_a_test(records, tmp_path):
    """A MATLAB file with a sample rate is a record; the draft that the doubt proposes is what is entered."""
    root = write_folder(tmp_path / "mill").parent
    assert guess_kind(records[0]).kind == "records"
    entered = add_files(root, records)
    draft = draft_test(root)
    assert draft == RecordsDraft("structure", ("records/*.mat",), "P{output}_ref{input}", channels=ROVING)
    assert any(f"--part 'tests.structure: {draft.value}'" in doubt for doubt in entered.doubts)
    assert enter_test(root, draft) == f"tests.structure: {draft.value}"
    test = read_project(root / "project.yaml").tests["structure"]
    assert (test.records, test.pattern, test.channels) == (draft.records, draft.pattern, draft.channels)
    assert draft_test(root) is None  # its records belong to a test now


def test_what_lies_beside_records_is_none(tmp_path):
    """A test file that the project names, a table of settings and words about records are no records."""
    root = write_folder(tmp_path / "mill").parent
    for name in ("structure.yaml", "README.txt", "notes.pdf", "hits.uff"):
        (root / "records" / name).write_text("toolpoint: 1\n")
    assert draft_test(root) is None


@pytest.mark.parametrize(("change", "words"), [
    ({"channels": ("1=pressure",)}, "no quantity"), ({"channels": ("9=force", *ROVING[1:])}, "no channel '9'"),
    ({"pattern": "Q{output}_*"}, "does not fit"), ({"records": ("../incoming/*.mat",)}, "in the project's folder"),
    ({"records": ()}, "in the project's folder"), ({"channels": ("1=force 5:+x 2.25mV/X", *ROVING[1:])}, "2.25mV/X")])
def test_a_test_with_a_fault_is_not_entered(records, tmp_path, change, words):
    root = write_folder(tmp_path / "mill").parent
    add_files(root, records)
    text = (root / "project.yaml").read_text(encoding="utf-8")
    given = {"records": ("records/*.mat",), "pattern": "P{output}_ref{input}", "channels": ROVING} | change
    with pytest.raises(ToolpointError, match=words):
        enter_test(root, RecordsDraft("structure", **given))
    assert (root / "project.yaml").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(("stems", "pattern"), [
    (["P1_ref27x", "P2_ref27x", "P12_ref12y"], "P{output}_ref{input}"), (["hit_1", "hit_2"], "hit_{output}"),
    (["a_1_run7", "a_2_run8"], "a_{output}_run*"), (["x_99", "x_98"], ""), (["P1"], ""), (["P1_a", "P2"], ""),
    (["tip_1", "tip_2"], "tip_{output}")])
def test_names_say_places_where_their_ends_are_points(stems, pattern):
    assert _pattern_of(stems, POINTS) == pattern
