"""Poses per second of an 18-freedom machine, by every path, with peers where they are installed, accuracy beside.

Run with one BLAS thread: OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/machine/pose_rates.py [--json]
Peers (optional): pinocchio (package `pin`) and exudyn. The last line is the compiled path's poses per second.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np  # noqa: E402

from benchmarks.frame import CommandLine, import_peer  # noqa: E402
from elastic_robot import CENTRES, INERTIAS, LINKS, MASSES, REFERENCE, SPRINGS, link, robot  # noqa: E402
from toolpoint.machine import assemble  # noqa: E402
from toolpoint.machine.derivatives import matrix_derivatives  # noqa: E402
from toolpoint.machine.frequencies import natural_frequencies  # noqa: E402
from toolpoint.spatial import rotation  # noqa: E402
from toolpoint.spatial import transform as tf  # noqa: E402
from toolpoint.vibration import eigen, frequency_response, sensitivity  # noqa: E402

POSES = 8192


def best(function, repeats: int = 5) -> float:
    """Return the shortest CPU time of several runs, s; on a shared machine the shortest is the least disturbed."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def pinocchio_rate(poses: np.ndarray) -> tuple[float, float] | None:
    """Return poses per second and the relative error at zero of Pinocchio in a Python loop, or None if not installed."""
    pin = import_peer("pinocchio")
    if pin is None:
        return None
    model = pin.Model()
    parent, before = 0, np.eye(4)
    for i in range(6):
        # Axis (moved by the pose), then three elastic rotations in the parent-side frame before it.
        place = pin.SE3(before)
        for k, joint in enumerate((pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ())):
            parent = model.addJoint(parent, joint, place if k == 0 else pin.SE3.Identity(), f"e{i}{k}")
        turn = model.addJoint(parent, pin.JointModelRZ(), pin.SE3.Identity(), f"q{i}")
        step = link(*LINKS[i])
        frame = pin.SE3(step)
        inertia = pin.Inertia(MASSES[i], np.array(CENTRES[i]), np.diag(INERTIAS[i]))
        model.appendBodyToJoint(turn, inertia, frame)
        parent, before = turn, step
    data = model.createData()
    elastic = [4 * i + k for i in range(6) for k in range(3)]
    driven = [4 * i + 3 for i in range(6)]
    scale = 1 / np.sqrt(np.array([s for k, kz in SPRINGS for s in (k, k, kz)]))

    def one(q: np.ndarray) -> np.ndarray:
        full = np.zeros(24)
        full[driven] = q
        mass = pin.crba(model, data, full)
        mass = np.triu(mass) + np.triu(mass, 1).T
        reduced = mass[np.ix_(elastic, elastic)] * scale[:, None] * scale
        return 1 / (2 * np.pi * np.sqrt(np.linalg.eigvalsh(reduced)[::-1][:6]))
    error = float(np.abs(one(np.zeros(6))[:4] / REFERENCE - 1).max())
    seconds = best(lambda: [one(q) for q in poses[:1000]], 3)
    return 1000 / seconds, error


def exudyn_rate(poses: np.ndarray) -> tuple[float, float] | None:
    """Return poses per second and the relative error at zero of Exudyn's kinematic tree, or None if not installed.

    The tree is built anew for every pose, as its joint transformations are fixed when it is made.
    """
    exu = import_peer("exudyn")
    if exu is None:
        return None
    from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
    from exudyn.solver import ComputeODE2Eigenvalues

    kinds = [exu.JointType.RevoluteX, exu.JointType.RevoluteY, exu.JointType.RevoluteZ] * 6
    springs = [s for k, kz in SPRINGS for s in (k, k, kz)]

    def one(q: np.ndarray) -> np.ndarray:
        rotations, offsets, masses, centres, inertias = [], [], [], [], []
        before = np.eye(4)
        for i in range(6):
            after = tf.transform(rotation.about("z", q[i])) @ link(*LINKS[i])
            r = after[:3, :3]
            for k in range(3):
                rotations.append(before[:3, :3] if k == 0 else np.eye(3))
                offsets.append(before[:3, 3] if k == 0 else np.zeros(3))
                last = k == 2
                masses.append(MASSES[i] if last else 0.0)
                centres.append(r @ CENTRES[i] + after[:3, 3] if last else np.zeros(3))
                inertias.append(r @ np.diag(INERTIAS[i]) @ r.T if last else np.zeros((3, 3)))
            before = after
        container = exu.SystemContainer()
        system = container.AddSystem()
        node = system.AddNode(NodeGenericODE2(referenceCoordinates=[0.0] * 18, initialCoordinates=[0.0] * 18,
                                              initialCoordinates_t=[0.0] * 18, numberOfODE2Coordinates=18))
        system.AddObject(ObjectKinematicTree(
            nodeNumber=node, jointTypes=kinds, linkParents=list(range(-1, 17)),
            jointTransformations=exu.Matrix3DList(rotations), jointOffsets=exu.Vector3DList(offsets),
            linkInertiasCOM=exu.Matrix3DList(inertias), linkCOMs=exu.Vector3DList(centres), linkMasses=masses,
            jointPControlVector=springs, jointDControlVector=[0.0] * 18, jointPositionOffsetVector=[0.0] * 18,
            jointVelocityOffsetVector=[0.0] * 18))
        system.Assemble()
        return np.sort(np.asarray(ComputeODE2Eigenvalues(system, convert2Frequencies=True)[0]))[:6]
    error = float(np.abs(one(np.zeros(6))[:4] / REFERENCE - 1).max())
    seconds = best(lambda: [one(q) for q in poses[:100]], 3)
    return 100 / seconds, error


def main() -> None:
    """Measure, print a table, and the compiled path's rate as the last line."""
    parser = CommandLine(__doc__)
    parser.json()
    options = parser.parse_args()
    machine = robot()
    rng = np.random.default_rng(0)
    table = rng.uniform(-2, 2, (POSES, 6))
    poses = {f"q{i + 1}": table[:, i] for i in range(6)}
    zero = {f"q{i + 1}": np.zeros(1) for i in range(6)}
    rows: dict[str, dict[str, float]] = {}
    exact = eigen.solve_undamped(assemble(machine, poses, modal_damping=False), 6).frequency
    for path in ("numpy", "compiled"):
        natural_frequencies(machine, zero, 6, path=path)
        seconds = best(lambda path=path: natural_frequencies(machine, poses, 6, path=path))
        rows[f"toolpoint, {path}"] = {
            "poses_per_second": POSES / seconds,
            "error_at_zero": float(np.abs(natural_frequencies(machine, zero, 6, path=path)[0, :4] / REFERENCE - 1).max()),
            "error_against_general": float(np.abs(natural_frequencies(machine, poses, 6, path=path) / exact - 1).max())}
    for name, peer in (("Pinocchio in a Python loop", pinocchio_rate(table)), ("Exudyn kinematic tree", exudyn_rate(table))):
        if peer is not None:
            rows[name] = {"poses_per_second": peer[0], "error_at_zero": peer[1]}
    thousand = {name: v[:1000] for name, v in poses.items()}
    lines = np.linspace(1, 200, 400)

    def modes_and_responses() -> None:
        system = assemble(machine, thousand, ["flange:+x", "flange:+y", "flange:+z"], modal_damping=False)
        frequency_response.modal(eigen.solve_undamped(system).with_damping(0.02), lines)

    def modes_only() -> None:
        eigen.solve_undamped(assemble(machine, thousand, ["flange:+x"], modal_damping=False))
    derivatives = matrix_derivatives(machine, [p for i in range(6) for p in (f"joints.joint{i + 1}.stiffness.{d}"
                                                                            for d in ("rx", "ry", "rz"))])
    system = assemble(machine, thousand, ["flange:+x"], modal_damping=False)
    responses = best(modes_and_responses)
    slopes = best(lambda: sensitivity.frequencies(system, derivatives, 6))
    plain = best(lambda: eigen.solve_undamped(system, 6))
    figures = {"rows": rows, "modes_and_frf_1000_poses_s": responses, "modes_1000_poses_s": best(modes_only),
               "sensitivities_over_modes": slopes / plain}
    if options.json:
        print(json.dumps(figures, indent=1))
        return
    reference = rows["toolpoint, compiled"]["poses_per_second"]
    print(f"{'path':34s} {'poses/s':>12s} {'ratio':>8s} {'error at zero':>14s}")
    for name, row in rows.items():
        print(f"{name:34s} {row['poses_per_second']:12.0f} {row['poses_per_second'] / reference:8.3f} "
              f"{row['error_at_zero']:14.1e}")
    print(f"1000 poses, modes and 3x3 FRF of 400 lines: {responses:.3f} s (bar 0.3 s)")
    print(f"18 frequency-to-stiffness sensitivities: {slopes / plain:.2f} x the cost of the modes (bar 2)")
    print(f"{reference:.0f} poses/s")


if __name__ == "__main__":
    main()
