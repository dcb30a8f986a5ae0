"""Places and poses: reached exactly, branches, maps, the most even segment, the redundant turn; and what cannot be."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from serial_arms import arm_forward
from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.cutting import ZeroOrder
from toolpoint.io.yaml import machine_file
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.machine.robot.model import arm_rows
from toolpoint.studies.cuts.chatter_limits import ChatterMap
from toolpoint.studies.machines.reach import branch_names, path_faults, reach_places
from toolpoint.studies.machines.tool_point import lobes, tool_point
from toolpoint.studies.robots import place_map
from toolpoint.studies.robots.place_map import PlaceQuantity, map_places, place_grid
from toolpoint.studies.robots.reach_study import study_reach
from toolpoint.studies.robots.regions import plane_directions, search_regions, study_region
from toolpoint.studies.robots.turns import choose_turns, compare_branches
from toolpoint.studies.screening.robot_demo import straight_wrist

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"


@pytest.fixture(scope="module")
def robot():
    return machine_file.read(MACHINES / "milling_robot.yaml")


def test_places_are_reached_with_tip_direction_and_turn(robot):
    rng = np.random.default_rng(5)
    places = rng.uniform([0.45, -0.2, 0.0], [0.65, 0.2, 0.3], (20, 3))
    direction = np.array([-1.0, 0.2, 0.3])
    reach = reach_places(robot, places, direction, turn=0.4)
    assert reach.reached.sum() >= 15
    tip, axis = tool_place(robot, reach.batch())
    np.testing.assert_allclose(tip, places[reach.reached], atol=1e-12)
    np.testing.assert_allclose(axis, np.broadcast_to(direction / np.linalg.norm(direction), axis.shape), atol=1e-12)


def test_forward_kinematics_of_the_published_table(robot):
    # The last link's frame straight from the table, against the tip that the machine's poses give (200 mm before the flange).
    from toolpoint.io.yaml import robot_file

    rows = arm_rows(robot_file.read(MACHINES / "milling_robot_datasheet.yaml"))
    reach = reach_places(robot, [[0.6, 0.1, 0.2]], turn=0.3)
    place = arm_forward(rows, np.array([reach.poses[0][row.axis] for row in rows]))
    np.testing.assert_allclose(place[:3, 3] + 0.2 * place[:3, 2], [0.6, 0.1, 0.2], atol=1e-12)


def test_branches_give_one_place(robot):
    names = branch_names(robot, [0.69, 0.02, 0.1])
    assert set(names) == {"front up no flip", "front up flip", "front down no flip", "front down flip"}
    poses = [reach_places(robot, [[0.69, 0.02, 0.1]], branch=name).poses[0] for name in names]
    tips = np.array([tool_place(robot, pose)[0][0] for pose in poses])
    np.testing.assert_allclose(tips, np.broadcast_to([0.69, 0.02, 0.1], tips.shape), atol=1e-12)
    rows = compare_branches(robot, [[0.69, 0.02, 0.1]], quantity=PlaceQuantity(modes=2)).rows
    assert [row[2][0] for row in rows] == sorted((row[2][0] for row in rows), reverse=True)


def test_branches_are_compared_over_the_places_that_all_reach(robot):
    """A branch that loses the weak places must not lead for it."""
    places = [[0.69, 0.02, 0.1], [0.8, 0.02, 0.0], [0.69, 0.02, -0.2]]
    found = compare_branches(robot, places, quantity=PlaceQuantity(modes=1))
    assert found.shared == 2 and {row[1] for row in found.rows} == {2, 3}
    for name, _, mean, _ in found.rows:
        both = [reach_places(robot, [place], branch=name).poses[0] for place in places[:found.shared]]
        assert mean[0] == pytest.approx(np.mean([natural_frequencies(robot, pose, 1)[0, 0] for pose in both]), rel=1e-9)
    assert f"{found.shared} of 3 places" in found.table()


def test_a_failed_chart_is_no_depth_and_a_bound_is_no_limit(robot, monkeypatch):
    """Of three places one has a limit, one failed, one has none within the charted depth."""
    limit = np.array([[[1e-3, 2e-3]], [[np.nan, np.nan]], [[np.inf, np.inf]]])
    poses = ({"q1": 0.0}, {"q1": 0.1}, {"q1": 0.2})
    charted = ChatterMap({}, np.zeros(1), np.array([3000.0, 4000.0]), limit, limit, np.full(3, 5e-3), robot.description.cutting,
                         {(1, 0): "this chart failed"}, (), poses)
    monkeypatch.setattr(place_map, "chatter_map", lambda *args, **options: charted)
    grid = place_grid({"x": [0.4, 0.45, 0.5]}, [0, 0, 0.2])
    result = map_places(robot, grid, PlaceQuantity("depth"), point="wrist")
    np.testing.assert_allclose(result.values[:, 0], [1.0, np.nan, 5.0])
    assert "this chart failed" in result.table() and result.failures() == {(1,): "this chart failed"}
    assert "no limit within the charted depth" in result.table() and "2 speeds" in result.table()
    with pytest.raises(ToolpointError, match="reached whole and judged: this chart failed"):
        search_regions(robot, [[0.4, 0, 0.2]], [[1.0, 0, 0]], length=0.1, samples=3, quantity=PlaceQuantity("depth"),
                       point="wrist")


def test_a_segment_over_a_place_without_a_limit_is_not_called_even(robot, monkeypatch):
    """A bound from below would stand there as a depth."""
    limit = np.array([[[1e-3, 2e-3]], [[1e-3, 2e-3]], [[np.inf, np.inf]]])
    poses = ({"q1": 0.0}, {"q1": 0.1}, {"q1": 0.2})
    charted = ChatterMap({}, np.zeros(1), np.array([3000.0, 4000.0]), limit, limit, np.full(3, 5e-3), robot.description.cutting,
                         {}, (), poses)
    monkeypatch.setattr(place_map, "chatter_map", lambda *args, **options: charted)
    with pytest.raises(ToolpointError, match="speeds that have a limit"):
        search_regions(robot, [[0.4, 0, 0.2]], [[1.0, 0, 0]], length=0.1, samples=3, quantity=PlaceQuantity("depth"),
                       point="wrist")


def test_first_mode_is_higher_folded_than_stretched(robot):
    # The source's figure 25.
    result = map_places(robot, place_grid({"x": [0.3, 0.6]}, [0, 0, 0.2]), point="wrist")
    assert result.values[0, 0] > result.values[1, 0]


def test_map_holds_the_frequencies_of_its_poses(robot):
    result = map_places(robot, place_grid({"x": [0.4, 0.5], "z": [0.1, 0.2]}), point="wrist")
    for pose, row in zip(result.reach.poses, result.values.reshape(-1, 4), strict=True):
        np.testing.assert_allclose(row, natural_frequencies(robot, pose, 4)[0], rtol=1e-12)


def test_most_even_segment_is_the_least_of_all(robot):
    starts = place_grid({"x": [0.35, 0.45], "z": [-0.1, 0.1]}).places.reshape(-1, 3)
    search = search_regions(robot, starts, plane_directions([1, 0, 0], [0, 0, 1]), length=0.1, samples=3, point="wrist")
    again = []
    for start in starts:
        for way in plane_directions([1, 0, 0], [0, 0, 1]):
            reach = reach_places(robot, start + np.array([[0.0], [0.05], [0.1]]) * way, point="wrist")
            if reach.reached.all():
                again.append(np.ptp(natural_frequencies(robot, reach.batch(), 4), axis=0).sum())
    assert search.best.total == pytest.approx(min(again), rel=1e-9)
    assert np.linalg.norm(search.best.end - search.best.start) == pytest.approx(0.1)
    assert search.worst.total == pytest.approx(max(again), rel=1e-9)
    ways = search.by_direction()
    assert sum(number for _, _, number in ways) == len(search.regions) == len(again)
    assert [median for _, median, _ in ways] == sorted(median for _, median, _ in ways)
    best = (search.best.end - search.best.start) / 0.1
    assert search.direction_words()[0].startswith("most even: along ") and any(np.allclose(way, best) for way, _, _ in ways)


def test_four_directions_are_horizontal_vertical_and_both_diagonals():
    ways = plane_directions([2, 0, 0], [0, 0, 3])
    np.testing.assert_allclose(ways, [[1, 0, 0], [0.5**0.5, 0, 0.5**0.5], [0, 0, 1], [-(0.5**0.5), 0, 0.5**0.5]], atol=1e-15)


@pytest.mark.slow
def test_turns_are_the_best_and_the_followed_path_has_no_jump(robot):
    path = np.stack([np.full(5, 0.65), np.linspace(-0.1, 0.1, 5), np.full(5, 0.1)], axis=1)
    choice = choose_turns(robot, path, turns=np.radians(np.arange(-60, 61, 30)), largest_step=0.6)
    np.testing.assert_allclose(choice.merit[np.arange(5), [list(choice.turns).index(t) for t in choice.best]],
                               np.nanmax(choice.merit, axis=1))
    positions = np.array([list(pose.values()) for pose in choice.poses])
    assert np.abs(np.diff(positions, axis=0)).max() <= 0.6


@pytest.mark.slow
def test_study_of_a_place_says_where_the_next_singular_pose_is(robot):
    study = study_reach(robot, [0.69, 0.02, 0.1])
    assert max(each.miss for each in study.poses) < 1e-12
    each = study.poses[0]
    # Axis 5 straight: the wrist's singular pose is as far as axis 5 is bent.
    assert each.singular[0] == "q5"
    assert each.singular[1] == pytest.approx(abs(each.pose["q5"]), abs=1e-5)
    assert study_reach(robot, [1.7, 0, 0]).reason == "out of reach"


def test_machines_that_are_no_arms_are_posed_too():
    gantry = machine_file.read(MACHINES / "gantry.yaml")
    reach = reach_places(gantry, [[0.1, 0.02, 0.4]])
    np.testing.assert_allclose(tool_place(gantry, reach.poses[0])[0][0], [0.1, 0.02, 0.4], atol=1e-8)


def test_paths_out_of_reach_and_through_a_singular_pose_are_named(robot):
    far = reach_places(robot, [[0.6, 0, 0.1], [1.2, 0, 0.1]], follow=True)
    assert "at 600 mm of the path" in path_faults(robot, far, [0.0, 0.6])[0] and "out of reach" in path_faults(robot, far,
                                                                                                               [0.0, 0.6])[0]
    # With the forearm along the tool the wrist is straight: the way from one side of it to the other turns axes 4 and 6 about.
    through = np.stack([np.full(9, 0.72), np.linspace(-0.002, 0.0022, 9), np.full(9, 0.325)], axis=1)
    up = reach_places(robot, through, branch="front up no flip", follow=True)
    faults = path_faults(robot, up, np.linspace(0, 0.004, 9))
    assert any("singular" in fault for fault in faults)


def test_a_map_stays_where_no_segment_can_be_judged(robot):
    grid = place_grid({"x": [0.4, 0.5], "z": [0.1, 0.2]})
    result = study_region(robot, grid, length=3.0, point="wrist")
    assert result.search is None and np.isfinite(result.map.values).any()
    assert "doubt: segments" in result.table() and "reached whole" in result.table()
    assert "shorter length" in result.map.to_dict()["notes"][0]


@pytest.mark.slow
def test_commands(tmp_path, capsys):
    main(["reach", str(MACHINES / "milling_robot.yaml"), "--tip", "690mm,20mm,100mm", "--direction", "-x"])
    assert "front up no flip" in capsys.readouterr().out
    main(["region", str(MACHINES / "milling_robot.yaml"), "--along", "x=300mm:500mm:3", "--along", "z=0:200mm:3", "--point",
          "wrist",
          "--length", "100mm", "-o", str(tmp_path)])
    assert "segments of 100 mm" in capsys.readouterr().out
    assert "Most even segments" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize(("call", "words"), [
    (lambda robot: reach_places(robot, [[0, 0, 0]], branch="left"), "must be of front up no flip, front up flip"),
    (lambda robot: place_grid({"a": [0.0]}), "must be one of x, y, z"),
    (lambda robot: place_grid({"x": [0.0], "b": [0.0]}, directions={"b": [1, 0, 0]}), "independent"),
    (lambda robot: search_regions(robot, [[2, 0, 0]], [[1, 0, 0]]), "none can be reached whole"),
])
def test_bad_input(robot, call, words):
    if words is None:
        assert "not on branch" in call(robot).reasons[0] or "out of reach" in call(robot).reasons[0]
        return
    with pytest.raises(ToolpointError, match=words):
        call(robot)


def test_lobes_of_overdamped_joints_say_their_method(robot):
    study = tool_point(robot, [{"q2": 0.3, "q3": -0.2, "q5": 0.3}])
    assert (study.modes.damping_ratio >= 1).any()
    chart = lobes(study, speeds=np.array([6000.0]))[0]
    assert chart.method == "PanelArnoldi" and chart.status.startswith("complete up to the first loss of stability")
    notes = lobes(study, speeds=np.array([6000.0]), method=ZeroOrder())[0].notes
    assert any("usual error" in note for note in notes)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_stiffness_over_places_where_the_number_of_poles_changes(robot, kind):
    """Dampers of joints make some modes real at some poses only; each pose alone gives the same."""
    grid = place_grid({"x": np.linspace(0.35, 0.55, 3), "z": np.linspace(0.1, 0.4, 2)})
    result = map_places(robot, grid, PlaceQuantity(kind), point="wrist")
    values = result.values.reshape(-1, result.values.shape[-1])[result.reach.reached]
    assert np.isfinite(values).all() and (values > 0).all()
    alone = PlaceQuantity(kind).at_poses(robot, [pose for pose in result.reach.poses if pose is not None][3:4])
    assert np.allclose(values[3], alone[0], rtol=1e-12)


def test_a_straight_wrist_stays_at_its_place(robot):
    """The wrist's centre does not move with axes 4 to 6; a place out of reach is refused."""
    places = np.array([[0.34, 0, 0.16], [0.34, 0, 0.36]])
    frequency = straight_wrist(robot, places)
    for pose, expected in zip(reach_places(robot, places, point="wrist").poses, frequency, strict=True):
        straight = {**pose, "q4": 0.0, "q5": 0.0, "q6": 0.0}
        at = place_machine(robot, straight).position(robot.description.points["wrist"])[0]
        before = place_machine(robot, dict(pose)).position(robot.description.points["wrist"])[0]
        assert np.allclose(at, before, atol=1e-12)
        assert np.allclose(natural_frequencies(robot, straight, 4)[0], expected, rtol=1e-12)
    with pytest.raises(ToolpointError, match="places: 1 of 2; must be reached"):
        straight_wrist(robot, np.array([[0.34, 0, 0.16], [2.0, 0, 0.16]]))


@pytest.mark.slow
def test_what_is_not_computed_of_a_pose_is_said(robot):
    """Bodies of finite elements have no rigid dynamics along the axes here: two empty columns said nothing."""
    study = study_reach(robot, [0.69, 0.02, 0.1], modes=1)
    assert "not computed" not in study.table()
    bare = replace(study, poses=tuple(replace(each, holding=np.zeros(0), inertia=np.zeros(0)) for each in study.poses))
    assert "not computed with bodies of finite elements" in bare.table()
