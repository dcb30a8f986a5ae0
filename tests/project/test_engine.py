"""Engine of a project: content decides what runs, reasons are said, kills and copies cost nothing, faults come first."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import project_steps
from project_steps import chain, ignore_sources, join_files, results
from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint._doubt import Doubt
from toolpoint.io.quantities import units
from toolpoint.project.engine.decision import KEEP, REPEAT, RUN, SKIP, STOP
from toolpoint.project.engine.lock import hold_lock
from toolpoint.project.engine.plan import plan_steps
from toolpoint.project.engine.run import run_steps
from toolpoint.project.engine.step import ProjectStep, StepOutcome
from toolpoint.project.engine.work import do_work

TEXTS = ("joined.txt", "length.txt")


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / "mill"
    folder.mkdir()
    (folder / "a.txt").write_text("alpha\n")
    (folder / "b.txt").write_text("beta\n")
    return folder


def actions(result):
    return {event.decision.step: event.decision.action for event in result.events}


def reason(result, step):
    return result.of(step).decision.reason


def test_second_run_has_nothing_to_do(root):
    first = run_steps(chain(root), root)
    assert set(actions(first).values()) == {RUN} and reason(first, "first") == "it was never run"
    before = results(root)
    assert set(actions(run_steps(chain(root), root)).values()) == {SKIP}
    assert results(root) == before


def test_touch_runs_nothing_and_change_runs_what_rests_on_it(root):
    run_steps(chain(root), root)
    os.utime(root / "a.txt", (1.0, 1.0))  # a clock that was set back
    assert set(actions(run_steps(chain(root), root)).values()) == {SKIP}
    (root / "a.txt").write_text("gamma\n")
    after = run_steps(chain(root), root)
    assert reason(after, "first") == "a.txt has changed" and actions(after)["other"] == SKIP
    assert reason(after, "next 0") == "results/first/joined.txt has changed"


def test_content_changed_within_one_tick_of_the_clock_is_seen(root):
    run_steps(chain(root), root)
    status = (root / "a.txt").stat()
    (root / "a.txt").write_text("omega\n")  # of the same size
    os.utime(root / "a.txt", ns=(status.st_atime_ns, status.st_mtime_ns))
    assert actions(run_steps(chain(root), root))["first"] == RUN


@given(st.floats(0.001, 1000.0))
@settings(max_examples=20, deadline=None)
def test_unit_of_an_option_is_no_change(tmp_path_factory, number):
    folder = tmp_path_factory.mktemp("units")
    (folder / "a.txt").write_text("alpha\n")
    for text in (f"{number!r} mm", f"{number / 1000!r} m", f"{number * 1000!r} um"):
        step = ProjectStep("only", join_files, {"sources": "a.txt"}, {"factor": units.quantity(text, units.LENGTH)}, TEXTS)
        result = run_steps(plan_steps([step], folder), folder)
    assert actions(result) == {"only": SKIP}


def test_changed_option_is_named_with_both_values(root):
    run_steps(chain(root, factor=0.002), root)
    after = run_steps(chain(root, factor=0.003), root)
    assert reason(after, "first") == "option factor: 0.002 -> 0.003"


def test_raised_version_runs_and_says_so(root):
    step = ProjectStep("only", join_files, {"sources": "a.txt"}, outputs=TEXTS)
    run_steps(plan_steps([step], root), root)
    after = run_steps(plan_steps([replace(step, version=2)], root), root)
    assert reason(after, "only") == "its computation has changed (version 1 -> 2)"


def test_unchanged_output_stops_the_followers(root):
    steps = [ProjectStep("same", ignore_sources, {"sources": "a.txt"}, outputs=("fixed.txt",)),
             ProjectStep("after", join_files, {"sources": "results/same/fixed.txt"}, outputs=TEXTS)]
    run_steps(plan_steps(steps, root), root)
    (root / "a.txt").write_text("gamma\n")
    assert actions(run_steps(plan_steps(steps, root), root)) == {"same": RUN, "after": SKIP}


def test_moved_and_copied_folders_run_nothing(root, tmp_path):
    run_steps(chain(root), root)
    shutil.copytree(root, tmp_path / "copy")
    root.rename(tmp_path / "moved")
    for folder in (tmp_path / "copy", tmp_path / "moved"):
        assert set(actions(run_steps(chain(folder), folder)).values()) == {SKIP}


def test_result_changed_by_hand_is_named_kept_and_doubted_in_what_follows(root):
    run_steps(chain(root), root)
    place = root / "results/first/joined.txt"
    place.write_text("by hand\n")
    after = run_steps(chain(root, factor=5.0), root)
    assert actions(after)["first"] == KEEP and place.read_text() == "by hand\n"
    assert "results/first/joined.txt" in reason(after, "first") and "option factor" in reason(after, "first")
    assert "by hand" in (root / "results/next 3/joined.txt").read_text()
    assert [entry.step for entry in after.doubts["next 3"]] == ["first"] and "by hand" in after.doubts["next 3"][0].doubt
    assert actions(run_steps(chain(root, factor=5.0), root, overwrite=True))["first"] == RUN
    assert not run_steps(chain(root, factor=5.0), root).doubts["next 3"]


def test_missing_result_is_made_again(root):
    run_steps(chain(root), root)
    (root / "results/other/length.txt").unlink()
    after = run_steps(chain(root), root)
    assert reason(after, "other") == "its result length.txt is not there" and actions(after)["next 0"] == SKIP


def test_failure_stops_only_what_rests_on_it_and_is_remembered(root):
    steps = [ProjectStep("bad", join_files, {"sources": "a.txt"}, {"fails": "no hit"}, TEXTS),
             ProjectStep("good", join_files, {"sources": "b.txt"}, outputs=TEXTS),
             ProjectStep("after bad", join_files, {"sources": "results/bad/joined.txt"}, outputs=TEXTS),
             ProjectStep("after good", join_files, {"sources": "results/good/joined.txt"}, outputs=TEXTS)]
    first = run_steps(plan_steps(steps, root), root)
    assert actions(first) == {"bad": RUN, "good": RUN, "after bad": STOP, "after good": RUN}
    assert [event.decision.step for event in first.failed] == ["bad"] and first.of("bad").words == "no hit"
    assert actions(run_steps(plan_steps(steps, root), root))["bad"] == REPEAT
    steps[0] = ProjectStep("bad", join_files, {"sources": "a.txt"}, outputs=TEXTS)
    assert actions(run_steps(plan_steps(steps, root), root))["after bad"] == RUN


def test_doubts_travel_with_the_step_that_can_mend_them_and_grave_ones_stop(root):
    def steps(grave):
        return [ProjectStep("tap", join_files, {"sources": "a.txt"}, {"doubt": "sensor turned", "grave": grave}, TEXTS),
                ProjectStep("modes", join_files, {"sources": "results/tap/joined.txt"}, outputs=TEXTS),
                ProjectStep("limits", join_files, {"sources": "results/modes/joined.txt"}, outputs=TEXTS)]
    after = run_steps(plan_steps(steps(False), root), root)
    assert [(entry.step, str(entry.doubt)) for entry in after.doubts["limits"]] == [("tap", "joined: sensor turned")]
    # Read back from the records, they are the same.
    assert run_steps(plan_steps(steps(False), root), root).doubts == after.doubts
    stopped = run_steps(plan_steps(steps(True), root), root)
    assert actions(stopped)["modes"] == STOP and "mend it in tap" in reason(stopped, "modes")


def _warn_of(folder, text):
    (folder / "joined.txt").write_text("")
    warnings.warn(text, ToolpointWarning, stacklevel=2)
    return StepOutcome("", (Doubt("channel 3", "is turned"),))


@pytest.mark.parametrize(("text", "count"), [("doubtful at bed; channel 3: is turned", 1),
                                             ("doubtful at bed; too few points", 2), ("channel 3: is turned and late", 2)])
def test_a_status_that_repeats_the_doubts_of_a_step_is_no_further_doubt(root, text, count):
    step = ProjectStep("joints", _warn_of, {}, {"text": text}, ("joined.txt",))
    assert len(do_work(step, root, root / "draft").outcome.doubts) == count


def test_all_faults_of_a_plan_come_before_anything_runs(root):
    steps = [ProjectStep("one", join_files, {"sources": "results/two/joined.txt"}, outputs=TEXTS),
             ProjectStep("two", join_files, {"sources": "results/one/joined.txt"}, outputs=TEXTS),
             ProjectStep("three", join_files, {"sources": "c.txt"}, outputs=TEXTS),
             ProjectStep("three", join_files, {"sources": "a.txt"}, outputs=TEXTS)]
    with pytest.raises(ToolpointError) as error:
        plan_steps(steps, root)
    for words in ("in a circle: one -> two -> one", "c.txt is not there", "two steps of this name", "an output of three"):
        assert words in str(error.value)
    assert not (root / "results").exists()


def test_one_process_at_a_time_and_the_lock_of_a_dead_one_is_taken_over(root):
    here = f"process {os.getpid()} runs in it"
    with hold_lock(root / ".toolpoint/lock", "mill"), pytest.raises(ToolpointError, match=here):
        run_steps(chain(root), root)
    process = subprocess.Popen([sys.executable, project_steps.__file__, str(root), "5", "1"])
    while not (root / ".toolpoint/drafts").exists():
        time.sleep(0.02)
    with pytest.raises(ToolpointError, match=f"process {process.pid} runs in it"):
        run_steps(chain(root), root)
    process.kill()
    process.wait()
    assert set(actions(run_steps(chain(root), root)).values()) == {RUN}


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_kills_at_random_moments_end_in_the_same_bytes(root, tmp_path, workers):
    clean = tmp_path / "clean"
    shutil.copytree(root, clean)
    run_steps(chain(clean), clean)
    rng = np.random.default_rng(0)
    for _ in range(4):
        process = subprocess.Popen([sys.executable, project_steps.__file__, str(root), "0.03", str(workers)],
                                   start_new_session=True)
        time.sleep(rng.uniform(0.2, 0.9))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    run_steps(chain(root, pause=0.03), root, workers=1)
    assert results(root) == results(clean)
    assert not any((root / ".toolpoint").rglob("*.draft"))


def test_kill_between_two_moves_is_no_change_by_hand(root, monkeypatch):
    run_steps(chain(root), root)
    moved = []

    def replace_once(source, target):
        if Path(target).parent.parent.name == "results" and moved:
            raise KeyboardInterrupt
        moved.append(target) if Path(target).parent.parent.name == "results" else None
        os.rename(source, target)

    monkeypatch.setattr("toolpoint.project.engine.publish.os.replace", replace_once)
    with pytest.raises(KeyboardInterrupt):
        run_steps(chain(root, factor=7.0), root)
    monkeypatch.undo()
    after = run_steps(chain(root, factor=0.02), root)
    assert reason(after, "first") == "its last run was cut off" and actions(after)["next 0"] == RUN


def test_full_disk_is_said_costs_no_result_and_is_tried_again(root, monkeypatch):
    run_steps(chain(root), root)
    before = results(root)

    def full(*names):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("toolpoint.project.engine.publish.os.replace", full)
    failed = run_steps(chain(root, factor=9.0), root)
    assert "No space left" in failed.of("first").words and results(root) == before
    monkeypatch.undo()
    assert actions(run_steps(chain(root, factor=9.0), root))["first"] == RUN


def test_record_of_a_newer_version_is_refused_and_a_damaged_one_runs_again(root):
    run_steps(chain(root), root)
    record = next((root / ".toolpoint/steps").glob("first-*.json"))
    text = record.read_text()
    record.write_text(text.replace('"record": 1', '"record": 2'))
    with pytest.raises(ToolpointError, match="newer toolpoint"):
        run_steps(chain(root), root)
    record.write_text(text[:40])
    after = run_steps(chain(root), root, overwrite=True)
    assert actions(after)["first"] == RUN


def test_steps_side_by_side_give_the_bytes_of_one_after_the_other(root, tmp_path):
    clean = tmp_path / "clean"
    shutil.copytree(root, clean)
    run_steps(chain(clean), clean)
    run_steps(chain(root), root, workers=2)
    assert results(root) == results(clean)


def test_thousand_steps_are_looked_at_within_a_second(root):
    steps = [ProjectStep(f"step {number}", join_files, {"sources": "a.txt"}, outputs=TEXTS) for number in range(100)]
    run_steps(plan_steps(steps, root), root)
    start = time.process_time()
    run_steps(plan_steps(steps, root), root)
    assert (time.process_time() - start) * 10 < 1.0
