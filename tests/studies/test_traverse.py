"""Modes over a traverse: the course of a moving pole, the joint that changes, and what is doubted."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.machine import Machine, assemble, build
from toolpoint.machine import description as d
from toolpoint.studies import TraverseWindow, cut_windows, study_traverse
from toolpoint.studies.moving.pole_course import fit_course
from toolpoint.vibration import Record, eigen

RATE, SECONDS, DOFS = 120.0, 480.0, ("bed:+x", "bed:+y", "head:+x", "head:+y")
STEPS = 21


def slides() -> Machine:
    """Return a machine of two bodies, one over the other, each on two springs."""
    inertia = d.InertiaDescription(1.0, 1.0, 1.0)
    bodies = {"bed": d.BodyDescription(600.0, inertia=inertia), "head": d.BodyDescription(200.0, inertia=inertia)}
    joints = {"lower": d.JointDescription("ground", "bed", stiffness={"x": 1e7, "y": 1.5e7}),
              "upper": d.JointDescription("bed", "head", stiffness={"x": 5e6, "y": 8e6})}
    points = {name: d.PointDescription(name) for name in bodies}
    return build(d.MachineDescription("two slides", bodies, joints, points=points))


def record_of(change: float, seed: int = 0) -> tuple[Record, np.ndarray]:
    """Return accelerations while the upper joint's stiffness goes by the factor exp(change), and the true frequencies."""
    machine, rng, count = slides(), np.random.default_rng(seed), round(SECONDS * RATE)
    course, places, frequencies, shapes = np.linspace(0, STEPS - 1, count), np.arange(STEPS), [], []
    for k in range(STEPS):
        factor = np.exp(change * (k / (STEPS - 1) - 0.5))
        softer = machine.with_values({"joints.upper.stiffness.x": 5e6 * factor, "joints.upper.stiffness.y": 8e6 * factor})
        modes = eigen.solve_undamped(assemble(softer, outputs=DOFS)).selected(range(4))
        shape = modes.shape if not shapes else modes.shape * np.sign((modes.shape * shapes[-1]).sum(axis=0))
        frequencies.append(modes.frequency)
        shapes.append(shape)
    samples = np.zeros((count, 4))
    for k in range(4):
        f = np.interp(course, places, np.array(frequencies)[:, k])
        pole = np.exp(2 * np.pi * f * (-0.015 + 1j) / RATE)
        state, motion = 0j, np.empty(count)
        for n, (z, force) in enumerate(zip(pole.tolist(), rng.standard_normal(count).tolist(), strict=True)):
            state = z * state + force
            motion[n] = state.imag
        shape = np.array([np.interp(course, places, np.array(shapes)[:, i, k]) for i in range(4)]).T
        samples += motion[:, None] * shape / np.abs(shape).max()
    samples += 0.03 * samples.std(axis=0) * rng.standard_normal(samples.shape)
    return Record(samples, RATE, DOFS, "acceleration"), np.array(frequencies)


@pytest.fixture(scope="module")
def softening():
    return record_of(np.log(0.8))


@pytest.mark.slow
def test_the_joint_that_softens_is_named_with_its_factor(softening):
    record, frequencies = softening
    windows = cut_windows(record, (-0.2, 0.2), 8)
    study = study_traverse(windows, quantity="Y, m", machine=slides(), poses=[{}] * 8)
    assert study.joints[0].joint == "joint upper" and study.joints[0].probability > 0.9 and study.joints[0].fits
    low, high = study.joints[0].interval
    assert low < 0.8 ** (7 / 8) < high  # from the middle of the first window to that of the last
    assert "best explained by joint upper" in study.status and len(study.tracks) == 4
    truth = np.array([np.interp(study.values, np.linspace(-0.2, 0.2, STEPS), frequencies[:, k]) for k in range(4)])
    inside = [np.abs(course.at_values(study.values)[0] - truth[k]) < 1.3 * course.at_values(study.values)[1]
              for k, course in enumerate(study.frequency)]
    assert np.mean(inside) > 0.85


@pytest.mark.slow
def test_a_machine_that_does_not_change_is_not_called_changed():
    record, _ = record_of(0.0, seed=1)
    study = study_traverse(cut_windows(record, (-0.2, 0.2), 8), machine=slides(), poses=[{}] * 8)
    assert study.changed == [] and study.unchanged > 0.5
    assert "None of 4 modes changes" in study.status and "no joint need change" in study.status


@pytest.mark.slow
def test_the_command_tells_the_same_and_writes_its_page(softening, tmp_path, capsys):
    record, _ = softening
    names = ",".join(f"acceleration {dof} [m/s^2]" for dof in DOFS)
    np.savetxt(tmp_path / "travel.csv", np.column_stack([record.time, record.samples]), delimiter=",", comments="",
               header=f"time [s],{names}", fmt="%.7g")
    main(["traverse", str(tmp_path / "travel.csv"), "--travel", "Y=-200mm:200mm:8", "-o", str(tmp_path / "page")])
    assert "modes change over Y, m" in capsys.readouterr().out
    page = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert "The machine while it moves" in page and "common course" in page


def test_the_course_of_a_straight_line_has_the_intervals_of_least_squares():
    rng, values = np.random.default_rng(0), np.linspace(-1.0, 1.0, 12)
    inside = 0
    for _ in range(200):
        course = fit_course(values, 20.0 + 0.5 * values + 0.1 * rng.standard_normal(12), np.full(12, 0.1))
        value, half_width = course.at_values(np.array([1.0]))
        inside += abs(value[0] - 20.5) < half_width[0]
    assert 0.88 < inside / 200 <= 1.0


def test_noise_alone_is_rarely_a_change():
    rng, values = np.random.default_rng(1), np.linspace(0.0, 1.0, 8)
    courses = [fit_course(values, 20.0 + 0.1 * rng.standard_normal(8), np.full(8, 0.1)) for _ in range(400)]
    assert np.mean([course.change_probability < 0.05 for course in courses]) < 0.09


@pytest.mark.slow
def test_a_fast_traverse_is_doubted():
    record, _ = record_of(np.log(0.5), seed=2)
    study = study_traverse(cut_windows(record, (0.0, 1.0), 4))
    assert any(doubt.what.startswith("damping of mode") and "travel slower" in doubt.remedy for doubt in study.doubts)


def test_what_cannot_be_is_refused(softening, tmp_path, capsys):
    windows = cut_windows(softening[0], (0.0, 1.0), 4)
    with pytest.raises(ToolpointError, match="at least 4"):
        study_traverse(windows[:3])
    with pytest.raises(ToolpointError, match="must be both or none"):
        study_traverse(windows, machine=slides())
    with pytest.raises(ToolpointError, match="record longer"):
        study_traverse([TraverseWindow(Record(np.random.default_rng(k).standard_normal((3000, 2)), RATE, DOFS[:2],
                                              "acceleration"), float(k)) for k in range(4)])
