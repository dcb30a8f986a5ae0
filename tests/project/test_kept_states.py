"""Kept states of a project and what differs between two: rows, verdicts, doubts, and how many are kept."""

from __future__ import annotations

import json
import os

import pytest

from toolpoint._check import ToolpointError
from toolpoint.project import KeptState, StateDifference
from toolpoint.project.kept_states import (
    MAX_KEPT_STATES,
    STATES_PLACE,
    drop_oldest_states,
    find_state,
    read_states,
)


def state(date="2026-05-04T10:00:00", limit=3e-3, *, half=0.1, speed=1200.0, modes=(50.0, 80.0), spring=1e8, version="0.2"):
    goal = {"cut": "face", "speed_rpm": speed, "limit_m": limit, "depth_max_m": 0.01,
            "interval_m": None if limit is None else [limit * (1 - half), limit * (1 + half)]}
    return KeptState(date[5:10].replace("-", ""), date, {
        "goals": {"rough": goal}, "modes": {"may": {"frequency_hz": list(modes), "damping_ratio": [0.02] * len(modes)}},
        "springs": {"joints.a.stiffness.x": {"value": spring, "deviation": 0.05 * spring}}, "sources": {"a.csv": "1"},
        "options": {"limits/rough": {"draws": 20}}, "version": version})


def test_a_state_beside_itself_differs_in_nothing():
    difference = StateDifference(state(), state("2026-06-01T10:00:00"))
    assert difference.limit_rows[0][5:] == ("0 %", "the same")
    assert difference.mode_rows == difference.spring_rows == difference.changed_inputs == ()
    assert "nothing was changed" in difference.summary and len(difference.doubts) == 1


@pytest.mark.parametrize(("limit", "verdict"), [(3.5e-3, "intervals overlap"), (4e-3, "intervals are apart"),
                                                 (2e-3, "intervals are apart"), (None, "no interval")])
def test_a_limit_is_apart_where_its_interval_is(limit, verdict):
    """Intervals of 10 % about 3 mm end at 2.7 and 3.3 mm: those about 3.5 begin at 3.15, those about 4 at 3.6 mm."""
    row = StateDifference(state(), state("2026-06-01T10:00:00", limit)).limit_rows[0]
    assert row[6] == verdict and (limit is not None or row[3] == "above 10 mm")


def test_modes_are_paired_by_frequency_and_springs_judged_by_their_intervals():
    difference = StateDifference(state(), state("2026-06-01T10:00:00", modes=(82.0, 200.0), spring=1.3e8))
    assert difference.mode_rows == (("may", "50", "", "", "2", ""), ("may", "80", "82", "+2.5 %", "2", "2"),
                                    ("may", "", "200", "", "", "2"))
    (path, older, newer, change, verdict), = difference.spring_rows
    assert (path, change, verdict) == ("joints.a.stiffness.x", "+30 %", "intervals are apart")
    assert older.startswith("(100") and newer.startswith("(130") and older.count("±") == newer.count("±") == 1
    assert older.endswith("×10⁶ N/m")
    assert any("by the nearest frequency" in doubt for doubt in difference.doubts)


def test_a_step_that_is_computed_in_another_way_is_doubted():
    older, newer = (KeptState(str(version), "", {"step_versions": {"joints": version, "machine": 1}}) for version in (1, 2))
    (doubt,) = [doubt for doubt in StateDifference(older, newer).doubts if "another way" in doubt]
    assert doubt.what == "steps joints" and "nothing was changed" in StateDifference(older, newer).summary


def test_a_coefficient_that_five_steps_take_is_listed_once_by_its_place_in_the_project_file():
    def options(tangential, deviation):
        cut = {"values": {"tangential": tangential, "teeth": 4}, "deviation": deviation}
        return {"options": {"limits/rough": {"cut": cut, "cut_name": "face", "draws": 20}, "changes": {"cuts": {"face": cut}},
                            "tried/tip": {"cuts": {"face": cut}, "has_poses": not deviation},
                            "tip/face": {"values": cut["values"]},
                            "program/part": {"settings": {"cut": cut, "cut_name": "face", "speed": 1200.0}}}}

    states = [KeptState(key, key, options(*numbers)) for key, numbers in (("1", (8e8, None)), ("2", (9e8, 0.05)))]
    assert StateDifference(*states).changed_inputs == ("cuts.face.tangential: 800000000 -> 900000000",
                                                       "cuts.face.coefficient_deviation: none -> 0.05")


def test_a_step_kept_by_hand_with_another_coefficient_is_not_hidden():
    older, newer = ({"limits/rough": {"draws": 20}, "limits/fine": {"draws": draws}} for draws in (20, 40))
    (line,) = StateDifference(KeptState("1", "1", {"options": older}), KeptState("2", "2", {"options": newer})).changed_inputs
    assert line == "draws: 20 -> 20 and 40"


def test_another_question_and_another_program_are_doubted():
    doubts = StateDifference(state(), state("2026-06-01T10:00:00", speed=900.0, version="0.3")).doubts
    assert any("goal rough" in doubt for doubt in doubts) and any("toolpoint 0.2" in doubt for doubt in doubts)


def test_states_are_read_by_date_a_damaged_one_is_left_out_and_a_wrong_name_lists_them(tmp_path):
    place = tmp_path / STATES_PLACE
    place.mkdir(parents=True)
    for kept in (state("2026-06-01T10:00:00"), state()):
        (place / f"{kept.date.replace(':', '-')}_{kept.key}.json").write_text(json.dumps(kept.to_dict()))
    (place / "2026-07-01_damaged.json").write_text("{")
    states = read_states(tmp_path)
    assert [kept.date[:7] for kept in states] == ["2026-05", "2026-06"]
    assert find_state(states, "2026-05-04 10:00") == states[0] and find_state(states, "2026") == states[1]
    assert find_state(states, "0601") == states[1]
    with pytest.raises(ToolpointError, match="2026-05-04 10:00:00"):
        find_state(states, "2025")


def test_the_newest_states_stay(tmp_path):
    place = tmp_path / STATES_PLACE
    place.mkdir(parents=True)
    dates = [f"2026-05-04T10:00:{second:02d}" for second in range(MAX_KEPT_STATES + 5)]
    for date in dates:
        (place / f"{date.replace(':', '-')}_key.json").write_text(json.dumps(state(date).to_dict()))
    drop_oldest_states(tmp_path)
    assert [kept.date for kept in read_states(tmp_path)] == dates[5:]


def test_states_of_one_second_are_in_the_order_of_their_files(tmp_path):
    place = tmp_path / STATES_PLACE
    place.mkdir(parents=True)
    for time, key in ((2, "0b"), (1, "ff"), (3, "0a")):
        path = place / f"2026-05-04T10-00-00_{key}.json"
        path.write_text(json.dumps({**state().to_dict(), "key": key}))
        os.utime(path, ns=(time, time))
    assert [kept.key for kept in read_states(tmp_path)] == ["ff", "0b", "0a"]
