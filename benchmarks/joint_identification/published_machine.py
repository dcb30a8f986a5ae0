"""Joints of the published vertical machining centre from noisy virtual tests, 50 seeds, beside the method of the source.

131 points x 3 directions, one reference, accelerances to 150 Hz with noise of 2 % and 5 % of each FRF's rms, and hammer
records with 2 % noise on every channel; modes identified, joints identified, nobody choosing. Beside it the source's own
way (Machines 2022, 10(11), 1102) on the same responses: imaginary parts at the natural frequencies as shapes, registration
of rest and displaced points, perpendicular bisectors, plain averages over the modes.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/joint_identification/published_machine.py [--seeds 50] [--blows 5] [--json]
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "joint_identification"))

import numpy as np
import p1_case as p1

from benchmarks.frame import CommandLine
from toolpoint.joint_identification import identify_joints
from toolpoint.joint_identification.motion.finite_motion import meeting_point, relative_bisector_axes
from toolpoint.joint_identification.motion.grouping import group_points
from toolpoint.joint_identification.motion.measured import component
from toolpoint.vibration import Modes, frequency_response

PAIRS = (("ground", "base"), ("base", "column"), ("column", "magazine"))


def away(joint, truth) -> float:
    """Distance of the estimate from the true point along the determined directions, mm."""
    error = joint.position - np.array(truth)
    for direction in joint.undetermined:
        error = error - direction * (direction @ error)
    return 1e3 * float(np.linalg.norm(error))


def judged(result) -> dict:
    """Return what one result is worth: right joints, worst errors, intervals that hold."""
    right = result.certain and all(
        joint.kind == p1.KINDS[joint.child] and joint.freedoms == p1.FREEDOMS[joint.child] for joint in result.joints)
    if not right:
        return {"right": False, "status": result.status}
    inside = {"position": [], "axis": [], "stiffness": []}
    angle, stiff = [], []
    for joint in result.joints:
        error = np.abs(joint.position - p1.AT[joint.child])
        inside["position"] += list((error <= joint.position_interval)[1 if joint.kind == "hinge" else 0:])
        if joint.child != "base":
            angle.append(np.degrees(np.arccos(min(1.0, joint.axis[0]))))
            spread = 1.959964 * np.sqrt(np.diag(joint.axis_covariance))
            inside["axis"] += list(np.abs(joint.axis[1:]) <= spread[1:])
        miss = np.abs(joint.stiffness - p1.STIFFNESS[joint.child])
        inside["stiffness"] += list(miss <= joint.stiffness_interval)
        stiff += list(100 * miss / p1.STIFFNESS[joint.child])
    return {"right": True, "angle": max(angle), "place": max(away(j, p1.AT[j.child]) for j in result.joints),
            "stiffness": max(stiff), "inside": {name: [bool(v) for v in one] for name, one in inside.items()}}


def naive(modes, case) -> dict:
    """Return the errors of the source's way: per joint the meeting point or mean axis, and the freedoms it would claim."""
    parts = {name: component(name, modes, case.points, labels=wanted) for name, wanted in case.components.items()}
    place, freedoms, angle = [], 0, 0.0
    for parent, child in PAIRS:
        axes = relative_bisector_axes(parts.get(parent), parts[child])
        nearest = np.array([int(np.argmax(np.abs(axis.direction))) for axis in axes])
        freedoms += sum(int((nearest == i).sum() >= 2) for i in range(3))
        if child == "column":
            chosen = [axis for axis, i in zip(axes, nearest, strict=True) if i == 0] or list(axes)
            mean = sum(axis.direction * np.sign(axis.direction[0]) for axis in chosen)
            angle = float(np.degrees(np.arccos(min(1.0, mean[0] / np.linalg.norm(mean)))))
            error = (np.mean([axis.point for axis in chosen], axis=0) - p1.AT[child])[1:]
        else:
            error = meeting_point(axes) - p1.AT[child]
        place.append(1e3 * float(np.linalg.norm(error)))
    return {"place": max(place), "angle": angle, "freedoms": freedoms}


def quadrature_shapes(frf, modes) -> Modes:
    """Return the imaginary parts of the responses at the natural frequencies as shapes, as the source takes them."""
    lines = [int(np.argmin(np.abs(frf.frequency - f))) for f in modes.frequency]
    return Modes(modes.frequency, modes.damping_ratio, frf.values[lines, :, 0].imag.T, frf.outputs, "unscaled")


def noisy_frf(truth, share, rng):
    """Return accelerances with noise of `share` of every FRF's rms."""
    lines = np.arange(5.0, 150.01, 0.25)
    frf = frequency_response.modal(truth, lines, truth.dofs, inputs=[p1.striking_point(truth)], quantity="accelerance")
    size = share * np.sqrt((np.abs(frf.values) ** 2).mean(axis=0) / 2)
    return replace(frf, values=frf.values + size * (rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)))


def run(model, share, seeds) -> dict:
    """Return the summary over the seeds at one noise."""
    rows, plain, taken, groups, cpu = [], [], [], 0, 0.0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        case = p1.case(model, rng)
        frf = noisy_frf(case.truth, share, rng)
        modes = p1.identified(frf)
        start = time.process_time()
        result = identify_joints(modes, case.points, case.components, chain=p1.CHAIN, masses=case.masses)
        cpu += time.process_time() - start
        rows.append(judged(result))
        plain.append(naive(quadrature_shapes(frf, modes), case))
        taken.append(naive(modes, case))
        found = {frozenset(points) for points in group_points(modes, case.points).components.values()}
        groups += found == {frozenset(points) for points in case.components.values()}
    return {**summary(rows), "grouped alone": groups / seeds, "cpu s": cpu / seeds,
            "source": naive_summary(plain), "source on our shapes": naive_summary(taken)}


def summary(rows) -> dict:
    """Return the worst errors and the share of intervals that hold."""
    good = [row for row in rows if row["right"]]
    result = {"right": len(good) / len(rows)}
    for name in ("angle", "place", "stiffness"):
        result[name] = max(row[name] for row in good) if good else float("nan")
    for name in ("position", "axis", "stiffness"):
        result[f"{name} inside"] = float(np.mean([v for row in good for v in row["inside"][name]]))
    result["wrong"] = [row["status"] for row in rows if not row["right"]]
    return result


def naive_summary(rows) -> dict:
    """Return medians and worst of the source's way, and how often it claims six freedoms."""
    place = [row["place"] for row in rows]
    return {"place median": float(np.median(place)), "place worst": max(place),
            "angle worst": max(row["angle"] for row in rows),
            "six freedoms": float(np.mean([row["freedoms"] == 6 for row in rows]))}


def blows(model, seeds) -> dict:
    """Return the summary over hammer tests with 2 % noise on every channel."""
    rows = []
    for seed in range(seeds):
        rng = np.random.default_rng(1000 + seed)
        case = p1.case(model, rng)
        modes = p1.from_blows(case.truth, 0.02, rng)
        rows.append(judged(identify_joints(modes, case.points, case.components, chain=p1.CHAIN, masses=case.masses)))
    return summary(rows)


def main() -> None:
    """Run, print a table, then the figure."""
    parser = CommandLine(__doc__)
    parser.cases("seeds", 50)
    parser.add_argument("--blows", type=int, default=5)
    parser.json()
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    model = p1.machine()
    results = {f"{100 * share:.0f} %": run(model, share, given.seeds) for share in (0.02, 0.05)}
    results["blows"] = blows(model, given.blows)
    if given.json:
        print(json.dumps(results))
        return
    for name, one in results.items():
        print(f"noise {name}")
        for key, value in one.items():
            print(f"    {key:22s}{value if isinstance(value, (list, dict)) else format(value, '.4g')}")
    low, high = results["2 %"], results["5 %"]
    print(f"three joints, six freedoms right in {100 * low['right']:.0f} % / {100 * high['right']:.0f} % of "
          f"{given.seeds} seeds (2 % / 5 % noise); worst position {low['place']:.2f} / {high['place']:.2f} mm, "
          f"direction {low['angle']:.3f} / {high['angle']:.3f} deg, stiffness {low['stiffness']:.3f} / "
          f"{high['stiffness']:.3f} %")


if __name__ == "__main__":
    main()
