"""Frequency maps and tool-point studies."""

import numpy as np
import pytest

from toolpoint.machine import assemble
from toolpoint.studies.machines.pose_map import pose_map
from toolpoint.studies.machines.tool_point import lobes, tool_point
from toolpoint.vibration import eigen
from toolpoint.vibration import frequency_response as fr


def test_map_equals_single_poses(vertical):
    found = pose_map(vertical, {"X": [-0.3, 0.0, 0.3], "Z": [-0.2, 0.4]}, modes=4)
    assert found.frequency.shape == (3, 2, 4)
    single = eigen.solve_undamped(assemble(vertical, {"X": 0.3, "Z": -0.2}), 4).frequency
    np.testing.assert_allclose(found.frequency[2, 0], single, rtol=1e-10)
    assert (found.spread() > 0).all()


def test_poses_beyond_the_limits_are_kept_as_failures(vertical):
    found = pose_map(vertical, {"X": [0.0, 0.29, 0.9]}, modes=2)
    assert list(found.failures) == [(2,)]
    assert "within -0.3 .. 0.3" in found.failures[(2,)]
    assert np.isnan(found.frequency[2]).all()
    assert np.isfinite(found.frequency[:2]).all()


def test_map_resumes_from_disk(vertical, tmp_path):
    first = pose_map(vertical, {"Y": np.linspace(-0.2, 0.2, 9)}, folder=tmp_path)
    second = pose_map(vertical, {"Y": np.linspace(-0.2, 0.2, 9)}, folder=tmp_path)
    np.testing.assert_array_equal(first.frequency, second.frequency)
    with pytest.raises(ValueError, match="another study"):
        pose_map(vertical.with_values({"joints.foundation.stiffness.rx": 1e9}), {"Y": np.linspace(-0.2, 0.2, 9)},
                 folder=tmp_path)


@pytest.mark.slow
def test_tool_point_study_is_the_assembled_machine(vertical_drives):
    study = tool_point(vertical_drives)
    k = 2
    pose = vertical_drives.description.poses[k]
    system = assemble(vertical_drives, pose, [f"tool-table:+{w}" for w in "xyz"])
    direct = fr.direct(system, study.frf.frequency).values
    np.testing.assert_allclose(study.frf.values[k], direct, atol=1e-6 * np.abs(direct).max())
    charts = lobes(study)
    assert len(charts) == len(study.poses)
    assert all(np.isfinite(chart.limit).any() for chart in charts)


def test_what_a_machine_lacks_is_named(vertical):
    from dataclasses import replace

    from toolpoint.machine import build
    bare = build(replace(vertical.description, damping_ratio=None))
    with pytest.raises(ValueError, match="damping_ratio"):
        tool_point(bare)
    with pytest.raises(ValueError, match="tool: NAME"):
        tool_point(build(replace(vertical.description, tool=None)))
    with pytest.raises(ValueError, match="'cutting'"):
        lobes(tool_point(build(replace(vertical.description, cutting=None))))
