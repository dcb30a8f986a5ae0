"""State on the server: events are never lost unseen, jobs end, stop and go on, what is old is said to be old."""

import asyncio
import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.project import Project, TriedCut, change_machine
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

    def outcome(last_id, count):
        # In a thread of its own: a browser test before may have left its loop running in this one.
        with ThreadPoolExecutor(1) as pool:
            return pool.submit(lambda: asyncio.run(read(last_id, count))).result()

    lines = outcome(f"{log.start}-3", 3)
    assert [line.splitlines()[0] for line in lines] == ["retry: 1000", f"id: {log.start}-4", f"id: {log.start}-5"]
    for other in ("", "other-3"):
        assert "event: reset" in outcome(other, 2)[1]


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


@pytest.mark.slow
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


def test_the_page_gives_the_numbers_of_the_studies(folder):
    """The limit, the modes and the interval that the page shows are those of the calls that it names."""
    import numpy as np

    from toolpoint import io, studies
    from toolpoint.workbench.state.machine_request import MachineRequest
    from toolpoint.workbench.views.catalogue import machine_deed

    desk, machine = Desk(folder), io.read_machine(folder / "machine.yaml")
    path, pose = "joints.column_head.stiffness.rx", {"X": 0.1}
    request = MachineRequest.of({"values": {path: 4e7}, "pose": pose, "speed": 1200, "count": 20})
    look = machine_deed(desk, "look", request)
    changed = change_machine(machine, {path: 4e7})
    modes = studies.solve_modes(changed, pose)
    np.testing.assert_allclose(look["frequency_hz"], modes.frequency[:len(look["frequency_hz"])], rtol=1e-12)
    cut = Project.open(folder).description.cuts["face"].cut
    chart = studies.chart_lobes(studies.machine_dynamics(changed, pose), cut.flat(), speeds=np.array([1200.0])).chart
    assert look["limit"]["limit_m"] == pytest.approx(chart.limit[0], rel=1e-6)
    assert any("changed by hand" in text for text in look["doubts"])
    project = Project.open(folder)
    limits = project.limits(cut="face", speeds=[1200.0])
    interval = machine_deed(desk, "interval", MachineRequest.of({"speed": 1200, "cut": "face", "cut_values": {"depth": 0.004}}))
    ends = limits.interval(np.full(20, 1 / 20))[:, 0]
    assert [interval["lower_m"], interval["upper_m"]] == pytest.approx(list(ends), rel=1e-12)
    uncounted = "the interval: does not count the cuts that were tried"
    assert not any(text.startswith(uncounted) for text in interval["doubts"])
    Project.open(folder).report_cut(TriedCut(1200.0, 5e-3, True))  # and not run since
    interval = machine_deed(desk, "interval", MachineRequest.of({"speed": 1200, "cut": "face"}))
    assert any(text.startswith(uncounted) for text in interval["doubts"]) and not interval["is_weighed"]


def test_the_map_of_limits_is_that_of_the_study_and_teeth_are_whole(folder, monkeypatch):
    import base64

    import numpy as np

    from toolpoint import io, studies
    from toolpoint.workbench.state.machine_request import MachineRequest
    from toolpoint.workbench.views import workspace_map
    from toolpoint.workbench.views.catalogue import machine_deed

    monkeypatch.setattr(workspace_map, "LIMIT_MAP_SIDE", 2)
    desk, machine = Desk(folder), io.read_machine(folder / "machine.yaml")
    cut = Project.open(folder).description.cuts["face"].cut
    answer = machine_deed(desk, "limit_map", MachineRequest.of({"speed": 1200, "cut": "face"}))
    grid = {axis["name"]: axis["positions"] for axis in answer["axes"]}
    expected = studies.map_chatter(machine, grid, cut, speeds=[1200.0]).limit.reshape(2, 2)
    shown = np.frombuffer(base64.b64decode(answer["limit_m"]), "<f4").reshape(2, 2).T  # first axis across
    np.testing.assert_allclose(shown, expected, rtol=1e-6)
    assert answer["commands"][0].startswith("toolpoint map-chatter machine.yaml --axis=X=")
    (slider,) = (one for one in view_of(desk, "lobes").data["cuts"][0]["sliders"] if one["key"] == "teeth")
    assert (slider["value"], slider["lower"], slider["upper"], slider["step"]) == (5, 1, 10, 1)
    fewer = machine_deed(desk, "limit", MachineRequest.of({"speed": 1200, "cut": "face", "cut_values": {"teeth": 3}}))
    dynamics = studies.machine_dynamics(machine, {})
    chart = studies.chart_lobes(dynamics, {**cut.flat(), "teeth": 3}, speeds=np.array([1200.0])).chart
    assert fewer["limit"]["limit_m"] == pytest.approx(chart.limit[0], rel=1e-6)
    assert "--teeth 3" in fewer["commands"][0]
    with pytest.raises(ToolpointError, match="whole"):
        machine_deed(desk, "limit", MachineRequest.of({"cut": "face", "cut_values": {"teeth": 3.5}}))


def test_two_kept_states_stand_beside_each_other(folder):
    from toolpoint.project.kept_states import STATES_PLACE

    place = folder / STATES_PLACE
    place.mkdir(parents=True)
    for key, date, limit in (("aaaa", "2026-05-04T10:00:00", 3e-3), ("bbbb", "2026-06-01T10:00:00", 2e-3)):
        (place / f"{key}.json").write_text(json.dumps({"key": key, "date": date, "goals": {"roughing": {
            "limit_m": limit, "interval_m": [0.9 * limit, 1.1 * limit]}}}))
    view = view_of(Desk(folder), "compare")  # one machine file alone: the last two states
    assert (view.data["first"], view.data["second"]) == ("state aaaa", "state bbbb")
    assert "3 mm" in view.answer and "intervals are apart" in view.answer and view.doubts
    assert view.commands == ("toolpoint run . --since aaaa --until bbbb",)
    mixed = view_of(Desk(folder), "compare", {"first": "machine.yaml", "second": "state bbbb"})
    assert "two kinds" in mixed.answer


def test_a_full_disk_loses_no_file_and_says_so(running, monkeypatch):
    import os

    from toolpoint.workbench.serving import intake_routes

    def full(*places):
        raise OSError(28, "No space left on device")

    folder = running.bench.desk.folder
    monkeypatch.setattr(intake_routes.os, "replace", full)
    status, _, content = running.client.ask("PUT", "/api/file/a.csv", b"1,2\n")
    assert status == 507 and b"No space left" in content and not list((folder / "incoming").iterdir())
    before = (folder / "project.yaml").read_bytes()
    status, _, content = running.client.ask("POST", "/api/part", {"place": "goals.x", "value": "{speed: 900 rpm, depth: 1 mm}"})
    assert status == 507 and (folder / "project.yaml").read_bytes() == before
    assert os.replace is full  # of the module, so of the drafts too


def test_without_the_extra_the_message_names_it(folder, monkeypatch):
    import sys

    from toolpoint.workbench import serve

    monkeypatch.setitem(sys.modules, "uvicorn", None)
    with pytest.raises(ToolpointError, match=r"toolpoint\[app\]"):
        serve(folder)


def test_one_workbench_a_project(folder):
    from toolpoint.project.engine.lock import hold_lock
    from toolpoint.workbench import serve

    with hold_lock(folder / ".toolpoint/workbench/lock", "mill"), pytest.raises(ToolpointError, match="open already"):
        serve(folder)
    with pytest.raises(ToolpointError, match="no folder"):
        serve(folder / "none")
    with pytest.raises(ToolpointError, match="every address"):
        serve(folder, host="0.0.0.0")


def test_words_have_the_same_keys_and_every_key_of_the_page():
    import re

    from toolpoint.workbench.web.assets import LANGUAGES, SCRIPTS, web_file

    words = {language: set(json.loads(web_file(f"words_{language}.json"))) for language in LANGUAGES}
    assert words["de"] == words["en"]
    used = {key for name in SCRIPTS for key in re.findall(r'W\.word\("([\w.]+)"[,)]', web_file(name).decode())}
    assert used - words["en"] == set() and len(used) > 80


def test_add_and_change_are_commands_too(folder, monkeypatch, capsys):
    from toolpoint import io
    from toolpoint.app.main import main

    monkeypatch.chdir(folder)
    (folder / "points.csv").write_text("point,x,y,z\n1,0,0,0\n")
    main(["add", ".", "points.csv", "--part", "goals.second: {speed: 900 rpm, depth: 1 mm}"])
    assert "Entered: geometry: points.csv" in capsys.readouterr().out
    assert list(Project.open(folder).description.goals) == ["roughing", "second"]
    main(["change", "machine.yaml", "joints.bed_table.stiffness.x=1e8", "-o", "softer.yaml"])
    with pytest.warns(ToolpointWarning, match="changed by hand"):  # every result that rests on the file says so
        assert io.read_machine(folder / "softer.yaml").value("joints.bed_table.stiffness.x") == 1e8
    for wrong in (["change", "machine.yaml", "joints.bed_table.stiffness.x", "-o", "b.yaml"],
                  ["change", "machine.yaml", "joints.bed_table.stiffness.x=1 N", "-o", "b.yaml"],
                  ["add", ".", "--part", "goals"]):
        with pytest.raises(SystemExit):
            main(wrong)
    assert not (folder / "b.yaml").exists()


def test_a_slow_client_costs_the_others_nothing_and_begins_anew(running):
    """A tab that does not read holds no answer up; what it has missed is not kept for it without end."""
    import socket

    access, log = running.client.access, running.bench.log
    with socket.create_connection(("127.0.0.1", access.port), timeout=30) as slow:
        slow.sendall((f"GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:{access.port}\r\n"
                      f"Last-Event-ID: {log.start}-0\r\nCookie: {access.cookie_name}={access.cookie_value}\r\n\r\n").encode())
        assert b"text/event-stream" in slow.recv(4096)
        for number in range(4 * KEPT_EVENTS):
            log.publish("step", number=number, words="x" * 4000)
        start = time.monotonic()
        running.client.json("GET", "/api/view/list")
        assert time.monotonic() - start < 5 and len(log._events) == KEPT_EVENTS
        content = b""
        while b"event: reset" not in content:
            content = content[-200:] + slow.recv(1 << 20)


@pytest.mark.parametrize("data", [{"count": -5}, {"count": 0}, {"mode": -50}, {"speed": float("nan")}, {"values": [1]}])
def test_numbers_that_no_page_sends_are_refused(data):
    from toolpoint.workbench.state.machine_request import MachineRequest

    with pytest.raises(ToolpointError):
        MachineRequest.of(data)
