"""Outlook on a project: it says of every step what the run then does, and runs nothing."""

from pathlib import Path

import pytest

from project_steps import chain, results
from toolpoint.project.engine.outlook import BY_HAND, FRESH, NEVER_RUN, STALE, foresee_steps, open_cache
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
