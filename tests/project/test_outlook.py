"""Outlook on a project: it says of every step what the run then does, and runs nothing."""

from dataclasses import replace
from pathlib import Path

import pytest

from project_steps import chain, results
from toolpoint.machine.description.project_plan import ProgramWork, ProjectDescription, ProjectProgram
from toolpoint.project.chain import build_chain
from toolpoint.project.engine.outlook import BY_HAND, FRESH, NEVER_RUN, STALE, foresee_steps, open_cache
from toolpoint.project.engine.plan import plan_steps
from toolpoint.project.engine.run import STATE_FOLDER, run_steps


def outlook(root: Path, **options):
    return {entry.step.name: entry for entry in foresee_steps(chain(root, **options), *open_cache(root, STATE_FOLDER))}


@pytest.fixture
def root(tmp_path):
    (tmp_path / "a.txt").write_text("a\n")
    (tmp_path / "b.txt").write_text("b\n")
    return tmp_path


def test_before_and_after_a_run(root):
    assert {entry.state for entry in outlook(root).values()} == {NEVER_RUN} and not (root / "results").exists()
    run_steps(chain(root), root)
    assert {entry.state for entry in outlook(root).values()} == {FRESH}


def test_a_changed_file_makes_all_stale_that_rest_on_it_and_nothing_else(root):
    run_steps(chain(root), root)
    before = results(root)
    (root / "b.txt").write_text("c\n")
    states = {name: entry.state for name, entry in outlook(root).items()}
    assert states == {"first": FRESH, "other": STALE, **{f"next {number}": STALE for number in range(4)}}
    assert "b.txt has changed" in outlook(root)["other"].reason and "rests on other" in outlook(root)["next 0"].reason
    assert results(root) == before  # looking writes nothing
    ran = [event.decision.step for event in run_steps(chain(root), root).events if event.decision.action == "run"]
    assert set(ran) <= {name for name, state in states.items() if state == STALE}


def test_a_changed_option_and_a_result_changed_by_hand(root):
    run_steps(chain(root), root)
    assert outlook(root, factor=0.02)["first"].state == STALE and "factor" in outlook(root, factor=0.02)["first"].reason
    (root / "results/other/joined.txt").write_text("by hand\n")
    entries = outlook(root)
    assert entries["other"].state == BY_HAND and entries["other"].is_of_today
    assert entries["next 0"].state == STALE  # its input has changed


@pytest.mark.parametrize("entry", [
    "solid: {file: part.msh, unit: mm}", "file: 'part.msh'", 'file: "meshes/../part.msh"  # of the casting',
    "files: [other.txt, part.msh]", "- part.msh"])
def test_a_mesh_that_a_machine_file_names_is_an_input_of_all_that_rests_on_it(tmp_path, entry):
    (tmp_path / "parts/meshes").mkdir(parents=True)
    (tmp_path / "parts/part.msh").write_text("1")
    (tmp_path / "parts/machine.yaml").write_text(f"name: none.msh\nbodies:\n  {entry}\n")
    program = ProjectProgram("part.nc", "box=0,0,0,1,1,1", work=ProgramWork("parts/machine.yaml", ("held",)))
    project = ProjectDescription("mill", machine="parts/machine.yaml", programs={"part": program})
    steps = build_chain(project, tmp_path).steps
    assert {"machine", "program/part"} == {
        step.name for step in steps if "parts/part.msh" in step.input_paths}
    assert all("parts/part.msh" not in step.arguments(tmp_path).values() for step in steps)


def test_a_result_that_rests_on_a_named_mesh_is_stale_when_the_mesh_changes(root):
    (root / "mesh.msh").write_text("1\n")
    steps = plan_steps([replace(step, named_files=("mesh.msh",)) if step.name == "other" else step
                        for step in chain(root).steps], root)
    run_steps(steps, root)
    (root / "mesh.msh").write_text("2\n")
    entries = {entry.step.name: entry for entry in foresee_steps(steps, *open_cache(root, STATE_FOLDER))}
    assert entries["first"].state == FRESH and entries["other"].state == STALE
    assert "mesh.msh has changed" in entries["other"].reason
