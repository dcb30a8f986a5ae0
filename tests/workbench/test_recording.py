"""Blows recorded in the workbench: what the page gets, who may ask for it, and that it is what the files of the blows give."""

import base64
import json
import time

import numpy as np
import pytest
import tapping

from toolpoint import ToolpointError, io, studies
from toolpoint.workbench.state.recording_settings import RecordingSettings

FORCES = (200.0, 180.0, 190.0)
PATIENCE = 90.0  # s for a state that stays


def settings(**values):
    return {"name": "tip_x", "device": "folder:in", "channels": tapping.DESCRIBED, "blows": 3, **values}


def wait_for(client, condition):
    end = time.monotonic() + PATIENCE
    while not condition(state := client.json("GET", "/api/recording")):
        assert time.monotonic() < end, state
        time.sleep(0.05)
    return state


def test_records_of_a_watched_folder_are_judged_and_the_responses_are_those_of_the_files(running):
    client, place = running.client, running.bench.desk.folder
    (place / "in").mkdir()
    begun = client.json("POST", "/api/recording", settings())
    assert begun["is_running"]
    assert begun["commands"][0].startswith("toolpoint tap --live --device folder:in --folder records/tip_x --channel")
    assert client.ask("POST", "/api/recording", settings(name="other"))[0] == 422  # one at a time
    wait_for(client, lambda state: state["state"] == "waiting")
    tapping.write_records(place / "in", FORCES)
    state = wait_for(client, lambda state: not state["is_running"])
    assert state["state"] == "ended" and state["remaining"] == 0, state["words"]
    assert [(blow["name"], blow["accepted"]) for blow in state["blows"]] == [(f"blow_000{k}.npz", True) for k in (1, 2, 3)]
    records, description = io.read_hammer_test(place / "records/tip_x/test.yaml")
    study = studies.study_described_records(records, description)
    assert state["study"]["status"] == study.status and max(state["study"]["coherence"]) <= 1
    peak = state["study"]["frequency_hz"][int(np.argmax(state["study"]["size"]))]
    assert peak == pytest.approx(study.frf.frequency[np.argmax(np.abs(study.frf.values[:, 0, 0]) * (
        (study.frf.frequency >= study.band.low) & (study.frf.frequency <= study.band.high)))], rel=1e-6)
    answer = client.json("POST", "/api/recording/decision", {"blow": "blow_0002.npz", "accept": False})
    file = "records/tip_x/test.yaml"
    assert answer["command"] == f"toolpoint frf {file} --refuse blow_0002.npz --test {file} --replace"
    hits = {hit["name"]: hit["accepted"] for hit in client.json("GET", "/api/recording")["study"]["hits"]}
    assert hits == {"blow_0001.npz": True, "blow_0002.npz": False, "blow_0003.npz": True}
    pulse = client.json("POST", "/api/pulse", {"test": "tip_x", "blow": "blow_0001.npz", "is_recording": True})
    record = records.records[0].samples
    assert pulse["pulse_rate"] == tapping.RATE and "acceleration at tip:+x" in pulse["words"]
    force = np.frombuffer(base64.b64decode(pulse["pulse"]), "<f4")
    assert force.max() == pytest.approx(record[:, 0].max(), rel=1e-5)
    view = client.json("GET", "/api/view/record")
    assert view["data"]["recordings"] == ["tip_x"] and view["data"]["entered"] == []


def test_a_recording_that_waits_is_ended_and_a_device_that_is_not_there_says_so(running):
    client, place = running.client, running.bench.desk.folder
    (place / "in").mkdir()
    client.json("POST", "/api/recording", settings())
    wait_for(client, lambda state: state["state"] == "waiting")
    assert client.json("DELETE", "/api/recording") == {"stopped": True}
    assert wait_for(client, lambda state: not state["is_running"])["state"] == "ended"
    assert client.json("DELETE", "/api/recording") == {"stopped": False}
    client.json("POST", "/api/recording", settings(device="folder:gone"))
    state = wait_for(client, lambda state: not state["is_running"])
    assert state["state"] == "failed" and "no such folder" in state["words"][-1]


@pytest.mark.parametrize("values", [
    {"device": "folder:.."}, {"device": "folder:/etc"}, {"device": "play:/etc/passwd"}, {"device": "play:a.csv,../b.csv@10"},
    {"device": "folder:a\0b"}, {"device": ""}, {"device": 3}, {"device": "x" * 300}, {"name": "../up"}, {"name": "a/b"},
    {"name": ".x"}, {"name": ""}, {"channels": []}, {"channels": "1=force"}, {"channels": ["x" * 300]},
    {"channels": ["1"] * 40}, {"blows": 0}, {"blows": 1e9}, {"blows": True}, {"block": -1}, {"rate": "fast"}, {"block": 1e400}])
def test_settings_that_lead_out_or_are_no_numbers_are_refused_and_nothing_starts(running, values):
    status, _, content = running.client.ask("POST", "/api/recording", json.dumps(settings(**values)).encode())
    assert status == 422 and b"error" in content and not running.bench.recordings.recording.is_running
    assert not (running.bench.desk.folder / "records").exists()


def test_a_link_in_the_project_leads_no_recording_out(running, tmp_path):
    (tmp_path / "outside").mkdir()
    (running.bench.desk.folder / "link").symlink_to(tmp_path / "outside")
    (running.bench.desk.folder / "records").symlink_to(tmp_path / "outside")
    for values in ({"device": "folder:link"}, {"device": "sound"}):
        assert running.client.ask("POST", "/api/recording", settings(**values))[0] == 422
    assert not list((tmp_path / "outside").iterdir())


def test_a_folder_that_the_command_opens_may_be_read(tmp_path):
    root, outside = tmp_path / "project", tmp_path / "analyser"
    root.mkdir(), outside.mkdir()
    assert RecordingSettings.of(settings(device=f"folder:{outside}"), root, (outside,)).address == f"folder:{outside}"
    with pytest.raises(ToolpointError, match="serve --records"):
        RecordingSettings.of(settings(device=f"folder:{outside}"), root)


@pytest.mark.parametrize(("path", "body"), [("/api/recording", settings()), ("/api/pulse", {"test": "x", "blow": "y"}),
                                            ("/api/recording/decision", {"blow": "x", "accept": True})])
def test_other_sites_hosts_and_programs_are_refused(running, path, body):
    ask = running.client.ask
    assert ask("POST", path, body, Origin="http://evil.example")[0] == 403
    assert ask("POST", path, body, Origin=None)[0] == 403
    assert ask("POST", path, body, Host="evil.example")[0] == 403
    assert ask("POST", path, body, Cookie=None)[0] == 401
    assert ask("POST", path, body, Content_Type="text/plain")[0] == 415
    assert ask("DELETE", "/api/recording", Cookie=None)[0] == 401
    assert ask("GET", "/api/recording", Host="evil.example")[0] == 403
    assert not running.bench.recordings.recording.is_running


@pytest.mark.parametrize("body", [{}, {"test": "../..", "blow": "x", "is_recording": True}, {"test": "none", "blow": "x"},
                                  {"test": 1, "blow": "x"}, {"test": "tip_x", "blow": "x" * 400, "is_recording": True}])
def test_hostile_questions_for_a_sound_are_answered_by_a_sentence(running, body):
    assert running.client.ask("POST", "/api/pulse", body)[0] == 422
    assert running.client.ask("POST", "/api/recording/decision", {"blow": "x", "accept": True})[0] == 422
