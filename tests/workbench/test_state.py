"""State on the server: events are never lost unseen, jobs end, stop and go on, what is old is said to be old."""

import asyncio
import json
import os
import signal
import time

import pytest

from toolpoint import ToolpointError
from toolpoint.project import Project, change_machine
from toolpoint.project.engine.outlook import FRESH, NEVER_RUN, STALE
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.events import KEPT_EVENTS, EventLog
from toolpoint.workbench.state.jobs import ENDED, FAILED_JOB, RUNNING, STOPPED, Jobs
from toolpoint.workbench.views.catalogue import list_views, view_of


def test_events_are_numbered_and_a_reader_goes_on_where_it_was():
    log = EventLog()
    for number in range(5):
        log.publish("step", number=number)
    events, is_lost = log.since(2)
    assert [event.data["number"] for event in events] == [2, 3, 4] and not is_lost

    async def read(last_id, count):
        lines = []
        async for text in log.stream(last_id):
            lines.append(text)
            if len(lines) == count:
                return lines

    lines = asyncio.run(read(f"{log.start}-3", 3))
    assert [line.splitlines()[0] for line in lines] == ["retry: 1000", f"id: {log.start}-4", f"id: {log.start}-5"]
    for other in ("", "other-3"):
        assert "event: reset" in asyncio.run(read(other, 2))[1]


def test_a_reader_that_is_too_late_begins_anew():
    log = EventLog()
    for number in range(KEPT_EVENTS + 10):
        log.publish("step", number=number)
    assert log.since(3)[1] and not log.since(10)[1]


def wait(jobs, states, seconds=60.0):
    end = time.monotonic() + seconds
    while jobs.job.state not in states:
        assert time.monotonic() < end, jobs.job
        time.sleep(0.02)


@pytest.fixture
def jobs(folder):
    made = Jobs(folder, folder / ".toolpoint/workbench/job.json", EventLog())
    yield made
    made.stop()


def test_a_job_runs_the_project_as_the_command_does(jobs, folder):
    jobs.start(["machine"])
    with pytest.raises(ToolpointError, match="under way"):
        jobs.start()
    wait(jobs, (ENDED, FAILED_JOB))
    assert jobs.job.state == ENDED and jobs.job.ended == ["machine"]
    assert json.loads((folder / ".toolpoint/workbench/job.json").read_text())["state"] == ENDED
    assert not jobs.resume()
    end = time.monotonic() + 5
    while (names := [event.name for event in jobs.log.since(0)[0]])[-1] != "job":  # said after the state is written
        assert time.monotonic() < end
    assert names[0] == "job" and "step" in names


def test_a_job_that_is_stopped_or_killed_says_so_and_goes_on_later(jobs, folder):
    jobs.start()
    assert jobs.stop()
    wait(jobs, (STOPPED,))
    jobs.start(["machine"])
    os.kill(jobs._process.pid, signal.SIGKILL)
    wait(jobs, (FAILED_JOB,))
    assert "from outside" in jobs.job.words
    # The server was killed while a job ran: its file says so.
    cut_off = {"steps": ["machine"], "overwrite": False, "state": RUNNING}
    (folder / ".toolpoint/workbench/job.json").write_text(json.dumps(cut_off))
    later = Jobs(folder, folder / ".toolpoint/workbench/job.json", EventLog())
    assert later.resume() and later.job.is_resumed
    wait(later, (ENDED,))
    (folder / ".toolpoint/workbench/job.json").write_text("{damaged")
    assert not later.resume()


def test_a_fault_of_the_project_file_is_the_words_of_the_job(jobs, folder):
    (folder / "project.yaml").write_text("toolpoint: 1\nname: x\ngoalz: {}\n")
    jobs.start()
    wait(jobs, (FAILED_JOB,))
    assert "goalz" in jobs.job.words


def test_the_outlook_says_what_a_run_then_does(folder):
    project = Project.open(folder)
    assert {entry.state for entry in project.outlook()} == {NEVER_RUN}
    project.run(["machine"])
    assert [entry.state for entry in project.outlook() if entry.step.name == "machine"] == [FRESH]
    machine = folder / "machine.yaml"
    machine.write_text(machine.read_text().replace("mass: 420 kg", "mass: 421 kg"))
    states = {entry.step.name: entry for entry in Project.open(folder).outlook()}
    assert states["machine"].state == STALE and "machine.yaml has changed" in states["machine"].reason
    actions = []
    Project.open(folder).run(["machine"], listen=lambda event: actions.append((event.decision.step, event.decision.action)))
    assert ("machine", "run") in actions


def test_a_view_never_shows_an_old_number_as_one_of_today(folder):
    from toolpoint.project.steps.plain_files import write_json

    desk = Desk(folder)
    (folder / "results").mkdir()
    kept = {"answers": ["roughing: yes; 4 mm"], "doubts": [], "goals": {}, "next_steps": []}
    write_json(folder / "results/project.json", kept)
    view = view_of(desk, "project")
    assert view.is_stale and view.answer.startswith("Of an earlier state") and "earlier state" in str(view.doubts[0])


def test_an_empty_folder_offers_to_begin_a_project(tmp_path):
    desk = Desk(tmp_path)
    assert list_views(desk)["views"] == ["project"] and view_of(desk, "project").data["is_empty"]


def test_a_changed_machine_says_what_was_changed_and_knows_no_more_of_it(folder):
    from dataclasses import replace

    from toolpoint import io
    from toolpoint.machine.description import IdentifiedDescription

    machine = io.read_machine(folder / "machine.yaml")
    paths = ("joints.bed_table.stiffness.x", "joints.column_head.stiffness.z")
    identified = IdentifiedDescription(paths, ((4.0,), (1.0, 9.0)), "test")
    machine = machine.rebuild(replace(machine.description, identified=identified))
    changed = change_machine(machine, {paths[0]: 1e8})
    assert changed.value(paths[0]) == 1e8 and changed.description.identified.parameters == paths[1:]
    assert changed.description.identified.matrix.tolist() == [[9.0]]
    assert changed.description.joints["bed_table"].source == "chosen" != changed.description.joints["column_head"].source
    assert any(paths[0] in doubt for doubt in changed.description.doubts)
    assert change_machine(machine, {paths[0]: machine.value(paths[0])}) is machine
    with pytest.raises(ToolpointError):
        change_machine(machine, {"joints.none.stiffness.x": 1.0})
