"""View that records blows: from a device or a watched folder, each with its verdict at once; and the sound of a blow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from toolpoint import io, studies
from toolpoint._check import ToolpointError, one_of
from toolpoint._doubt import Doubt
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.workbench.state.access import check_file_name, path_beneath
from toolpoint.workbench.state.blow_responses import drawn_responses
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.recording_settings import RECORDS_FOLDER, RecordingSettings
from toolpoint.workbench.state.recordings import Recordings
from toolpoint.workbench.views.machine_look import pack
from toolpoint.workbench.views.view import WorkbenchView, command_line

EXAMPLE_CHANNELS = ("1=force tip:+x 2.25mV/N", "2=acceleration tip:+x 10.2mV/g")
EXAMPLE_FOLDER = "incoming_records"  # of the project, into which another program may write


def view_record(desk: Desk) -> WorkbenchView:
    """Return the view of recordings: those that are there, and settings to begin with."""
    names = sorted(path.parent.name for path in (desk.folder / RECORDS_FOLDER).glob("*/test.yaml")
                   if any(path.parent.glob("blow_*.npz")) or (path.parent / "set_aside").is_dir())
    tests = desk.project().description.tests.values()
    entered = [name for name in names if any(test.test == test_file_place(name) for test in tests)]
    answer = (f"Recorded here so far: {', '.join(names)}." if names else "Nothing was recorded here yet.")
    example = RecordingSettings("tip_x", f"folder:{EXAMPLE_FOLDER}", "", EXAMPLE_CHANNELS)
    return WorkbenchView("record", answer, (), (record_command(example), command_line("devices")), tuple(record_calls(example)),
                         {"recordings": names, "entered": entered, "example": example.to_dict()})


def test_file_place(name: str) -> str:
    """Return the place of the test file of a recording, relative to the project."""
    return f"{RECORDS_FOLDER}/{check_file_name(name)}/test.yaml"


def recording_state(recordings: Recordings) -> dict[str, Any]:
    """Return the state of the recording, with the command and the Python calls that record the same."""
    settings = recordings.recording.settings
    commands, calls = ([], []) if settings is None else ([record_command(settings)], record_calls(settings))
    if settings is not None:
        commands += [command_line("frf", test_file_place(settings.name))]
    return {**recordings.recording.to_dict(), "commands": commands, "calls": calls}


def record_command(settings: RecordingSettings) -> str:
    """Return the command that records the same, from the project's folder."""
    options = [] if settings.is_watched else ["--block", f"{settings.block:g}"]
    options += ["--rate", f"{settings.rate:g}"] if settings.rate else []
    options += ["--trigger", f"{settings.trigger:g}"] if settings.trigger else []
    channels = [word for text in settings.channels for word in ("--channel", text)]
    return command_line("tap", "--live", "--device", settings.device, "--folder", settings.folder, *channels, "--blows",
                        settings.blows, *options)


def record_calls(settings: RecordingSettings) -> list[str]:
    """Return the Python calls that record the same."""
    block = None if settings.is_watched else settings.block
    return [f"live = io.open_input({settings.device!r}, {list(settings.channels)!r}, {settings.rate!r})",
            f"store = io.BlowFolder({settings.folder!r}, live, {block!r})",
            f"tap = studies.LiveTap(live.inputs, live.device.rate, duration={block!r}, goal={settings.blows}, kept=store.kept,",
            "                      decisions=store.decisions)",
            f"for event in studies.follow_blows(live.device, tap, store, trigger={settings.trigger!r}):",
            "    print(getattr(event, 'words', event))"]


def decide_blow(desk: Desk, recordings: Recordings, blow: str, *, accept: bool | None) -> dict[str, Any]:
    """Write a decision about a blow of the last recording; where that has ended, the responses follow from its files."""
    state = recordings.recording
    if state.settings is None:
        raise ToolpointError("no recording: begin one, or decide in the view of the test's blows")
    file = test_file_place(state.settings.name)
    one_of("blow", blow, [entry["name"] for entry in state.blows if entry["is_counted"]])
    recordings.decide(desk.folder / file, blow, accept)
    if not state.is_running:
        state.study = _study_files(desk.folder / file)
        recordings.log.publish("recording")
    if accept is None:
        return {"command": f"{file}: the line {blow} under hits was removed"}
    return {"command": command_line("frf", file, "--accept" if accept else "--refuse", blow, "--test", file, "--replace")}


def _study_files(file: Path) -> dict[str, Any] | None:
    """Return the drawn responses of a test file, None where no blow is good."""
    records, description = io.read_hammer_test(file)
    try:
        study = studies.study_described_records(records, description)
    except ToolpointError:
        return None
    drawn: dict[str, Any] | None = drawn_responses(study)["study"] if isinstance(study, HammerStudy) else None
    return drawn


def sound_of(desk: Desk, test: str, blow: str, *, is_recording: bool) -> dict[str, Any]:
    """Return the sound of a blow and the pulse of its force, packed, with what is heard in words.

    test : name of a test of the project, or of a recording. Raises ToolpointError for a test without a test file, and for a
    blow that it lacks.
    """
    if is_recording:
        file: str | None = test_file_place(test)
    else:
        tests = desk.project().description.tests
        file = tests[one_of("test", test, tests)].test
    if file is None:
        raise ToolpointError(f"tests.{test}: has no test file that says where its blows are; write one by toolpoint frf --test")
    place = path_beneath(desk.folder, file)
    records, description = io.read_hammer_test(place)
    tone = studies.sound_blow(records, blow, description.block)
    doubts = [str(Doubt("sound", f"resampled from {tone.pulse_rate:g} Hz, as browsers play no such rate"))] if (
        tone.is_resampled) else []
    return {"sound": pack(tone.tone), "rate": tone.rate, "pulse": pack(tone.pulse), "pulse_rate": tone.pulse_rate,
            "words": tone.table(), "doubts": doubts, "calls": [
                f"records, description = io.read_hammer_test({file!r})",
                f"print(studies.sound_blow(records, {blow!r}, description.block).table())"]}
