"""Parts entered into a project: told by content, put in their place, no line of the file lost, nothing overwritten."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint import ToolpointError, io
from toolpoint.machine.description.project_plan import ProjectTest
from toolpoint.project import Project, add_files, add_part, guess_kind, write_folder
from toolpoint.project.components_text import draft_components, write_components

CUT = "{diameter: 16 mm, teeth: 4, direction: slot, material: al7075, coefficient_deviation: 10 %, speeds: 2000 12000 rpm}"


def test_a_part_is_entered_and_every_other_line_stays(tmp_path):
    file = write_folder(tmp_path / "p")
    before = file.read_text().splitlines()
    add_part(tmp_path / "p", "cuts.slot", CUT)
    add_part(tmp_path / "p", "goals.my rough: cut", "{speed: 8000 rpm, depth: 3 mm}")
    after = file.read_text().splitlines()
    assert [line for line in after if line in before] == before and len(after) == len(before) + 2
    project = io.read_project(file)
    assert project.goals["my rough: cut"].depth == 0.003 and project.cuts["slot"].cut.tool.teeth == 4
    add_part(tmp_path / "p", "goals.my rough: cut", "{speed: 8000 rpm, depth: 4 mm}")
    assert len(file.read_text().splitlines()) == len(after) and io.read_project(file).goals["my rough: cut"].depth == 0.004


def test_beside_a_second_cut_goals_and_programs_that_named_none_get_the_name_of_the_first(tmp_path):
    """With one cut the key may be left out; a second one would leave its meaning open: what was meant is written."""
    file = write_folder(tmp_path / "p")
    add_part(tmp_path / "p", "cuts.slot", CUT)
    add_part(tmp_path / "p", "goals.rough", "{speed: 8000 rpm, depth: 3 mm}  # as on Monday")
    add_part(tmp_path / "p", "programs.pocket", '{program: a.nc, stock: "box=0,0,-1,1,1,0"}')
    named = add_part(tmp_path / "p", "cuts.finish", CUT.replace("16 mm", "8 mm"))
    assert named == ("goals.rough: cut: slot", "programs.pocket: cut: slot")
    described = io.read_project(file)
    assert described.goals["rough"].cut == "slot" and described.programs["pocket"].cut == "slot" and len(described.cuts) == 2
    assert "{cut: slot, speed: 8000 rpm, depth: 3 mm}  # as on Monday" in file.read_text()
    assert add_part(tmp_path / "p", "cuts.third", CUT) == ()


@pytest.mark.parametrize(("place", "value", "words"), [
    ("goals.x", "{speed: 8000 rpm}", "depth"), ("goals.x", "{speed: 8000 rpm, depth: 3}", "no unit"),
    ("goals.x", "a\nb: 1", "one line"), ("goalz.x", "{}", "goalz"), ("goals.", "{}", "name"), ("draws", "5", "part"),
    ("goals.x", "{speed: 1 rpm, depth: 1 mm, cut: none}", "cut"), ("geometry", "", "one line"), ("goals.x", "&a [*a]", "goals"),
])
def test_a_part_with_a_fault_changes_nothing(tmp_path, place, value, words):
    file = write_folder(tmp_path / "p")
    text = file.read_text()
    with pytest.raises(ToolpointError, match=words):
        add_part(tmp_path / "p", place, value)
    assert file.read_text() == text and not list((tmp_path / "p").glob(".*draft"))


@given(st.text(min_size=1, max_size=40), st.text(max_size=60))
def test_no_name_and_no_value_writes_anything_but_its_own_entry(name, value):
    text = "toolpoint: 1\nname: x\ngoals:\n  a: {speed: 1 rpm, depth: 1 mm}\ndraws: 40\n"
    try:
        lines = io.enter_part(text, f"goals.{name}", value).split("\n")
    except ToolpointError:
        return
    kept = [line for line in lines if line in text.split("\n")]
    assert len(lines) - len(text.split("\n")) in (0, 1) and {"toolpoint: 1", "draws: 40"} <= set(kept)


# A set of data as measuring programs write it: title and units come first, record 6 says what it is.
UNIVERSAL = ("    -1\n   151\ntitle\n    -1\n    -1\n   164\n         1  SI\n    -1\n    -1\n    58\n" + "NONE\n" * 5
             + "{function:5d}         1    0         0 NONE               1   1\n         4        64         1\n")


@pytest.mark.parametrize(("name", "text", "kind"), [
    ("points.csv", "point,x,y,z\n1,0,0,0\n", "geometry"), ("a.csv", "time [s],ch1 [V]\n0,1\n", "records"),
    ("b.txt", "# Frequency Hz, real, imag\n1 2 3\n", "responses"), ("c.txt", "1 2 3\n", "responses"),
    ("d.nc", "G1 X1\n", "program"), ("t.yaml", "toolpoint: 1\nrecords:\n  - {files: [a.csv]}\n", "test"),
    ("e.yaml", "toolpoint: 1\ncomponents: {}\n", "components"),
    ("m.yaml", "toolpoint: 1\nbodies: {}\n", "machine"), ("x.bin", "\x00\x01", "other"), ("bad.yaml", "a: [", "other"),
    ("k.csv", "Punkt;X [mm];Y [mm];Z [mm]\n1;580,5;1302,6;-293,2\n", "geometry"),
    ("s.uff", UNIVERSAL.format(function=1), "records"), ("f.unv", UNIVERSAL.format(function=4), "responses"),
    ("w.wav", "RIFF", "records"), ("g.unv", "    -1\n  2411\n", "geometry"), ("h.unv", "    -1\n    55\n", "modes"),
])
def test_a_file_is_told_by_its_content(tmp_path, name, text, kind):
    (tmp_path / name).write_text(text)
    assert guess_kind(tmp_path / name).kind == kind


def test_files_go_where_they_belong_and_nothing_is_overwritten(tmp_path):
    root = tmp_path / "p"
    write_folder(root)
    (tmp_path / "points.csv").write_text("point,x,y,z\n1,0,0,0\n")
    (tmp_path / "r.csv").write_text("time,a\n0,1\n")
    entered = add_files(root, [tmp_path / "points.csv", tmp_path / "r.csv"])
    assert entered.places == ("points.csv", "records/r.csv") and entered.parts == (("geometry", "points.csv"),)
    assert Project.open(root).description.geometry == "points.csv"
    add_files(root, [tmp_path / "r.csv"])  # the same once more
    (tmp_path / "r.csv").write_text("time,a\n0,2\n")
    with pytest.raises(ToolpointError, match="another content"):
        add_files(root, [tmp_path / "r.csv"])
    assert (root / "records/r.csv").read_text() == "time,a\n0,1\n"


def test_files_that_cannot_be_read_and_entries_that_give_way_are_told(tmp_path):
    root = write_folder(tmp_path / "mill").parent
    (tmp_path / "torn.yaml").write_text("toolpoint: 1\nname: torn\nbodies:\n  bed: {mass: -3 kg}\n")
    (tmp_path / "notes.yaml").write_text("a: [1, 2\n")
    io.write_template(tmp_path / "whole.yaml", "machine", "lathe")
    torn = add_files(root, [tmp_path / "torn.yaml", tmp_path / "notes.yaml"])
    assert [doubt.what for doubt in torn.doubts] == ["torn.yaml", "notes.yaml"]
    assert "joints: missing" in torn.doubts[0] and "no step takes it" in torn.doubts[1]
    whole = add_files(root, [tmp_path / "whole.yaml"])
    assert [doubt.what for doubt in whole.doubts] == ["machine"] and "torn.yaml was entered before" in whole.doubts[0]
    assert not add_files(root, [tmp_path / "whole.yaml"]).doubts  # the same once more
    assert (root / "torn.yaml").is_file()


def test_records_of_universal_files_are_a_test_without_a_test_file(tmp_path):
    """They say what each channel is; beside a test file, which names records, they enter nothing by themselves."""
    root = write_folder(tmp_path / "mill").parent
    for name in ("a 1.unv", "a 2.unv"):
        (tmp_path / name).write_text(UNIVERSAL.format(function=1) + name)
    entered = add_files(root, [tmp_path / "a 1.unv", tmp_path / "a 2.unv"])
    assert entered.parts == (("tests.structure", "{records: [records/a 1.unv, records/a 2.unv]}"),)
    assert Project.open(root).description.tests["structure"].records == ("records/a 1.unv", "records/a 2.unv")
    other = write_folder(tmp_path / "lathe").parent
    (tmp_path / "t.yaml").write_text("toolpoint: 1\nrecords:\n  - {files: ['*.unv']}\n")
    assert add_files(other, [tmp_path / "a 1.unv", tmp_path / "t.yaml"]).parts == (("tests.t", "{test: records/t.yaml}"),)


def test_records_and_the_test_file_that_names_them_are_one_test_in_either_order(tmp_path):
    for name in ("a 1.unv", "a 2.unv"):
        (tmp_path / name).write_text(UNIVERSAL.format(function=1) + name)
    (tmp_path / "t.yaml").write_text("toolpoint: 1\ntest: blows\nrecords:\n  - {files: ['*.unv']}\n")
    records = [tmp_path / "a 1.unv", tmp_path / "a 2.unv"]
    root = write_folder(tmp_path / "mill").parent
    assert not add_files(root, records).doubts
    entered = add_files(root, [tmp_path / "t.yaml"])
    assert entered.parts == (("tests.structure", "{test: records/t.yaml}"),) and "they are one test" in entered.doubts[0]
    assert Project.open(root).description.tests == {"structure": ProjectTest(test="records/t.yaml")}
    assert add_files(root, records).parts == ()  # the test file names them
    root = write_folder(tmp_path / "lathe").parent
    add_files(root, [tmp_path / "t.yaml"])
    assert add_files(root, records).parts == () and list(Project.open(root).description.tests) == ["t"]
    # What a person has written into the entry stays: then the two are refused, by name.
    add_part(root, "tests.own", "{records: [records/a 1.unv], date: 2026-01-01}")
    with pytest.raises(ToolpointError, match=r"tests\.own: records/a 1\.unv is also in tests\.t; must be in one test"):
        _ = Project.open(root).chain


def test_components_are_drafted_from_the_points_and_kept_only_without_a_fault(tmp_path):
    root = write_folder(tmp_path / "mill").parent
    (tmp_path / "points.csv").write_text("point,x,y,z\n" + "".join(f"{k},{0.1 * k},{(-1) ** k},0.5\n" for k in range(1, 23)))
    add_files(root, [tmp_path / "points.csv"])
    draft = draft_components(root)
    assert draft.startswith("# 22 points of points.csv: 1, 2, 3") and "x 0.1 to 2.2 m" in draft
    with pytest.raises(ToolpointError, match=r"components\.yaml:.*bodyy"):
        write_components(root, draft.replace("body:", "bodyy:", 1))
    with pytest.raises(ToolpointError, match=r"points\.csv has no point 99"):
        write_components(root, draft.replace('"17-22"', '"17-22", 99'))
    assert not (root / "components.yaml").exists() and Project.open(root).description.components is None
    assert write_components(root, draft) == Project.open(root).description.components == "components.yaml"
    assert draft_components(root) == draft  # the next time it is that of the file
