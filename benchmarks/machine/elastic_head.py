"""The 3-RPS head with elastic limbs: reduced against all finite elements at six poses, symmetry, FRF map, compliance.

Run: python benchmarks/machine/elastic_head.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.sparse import block_diag, csc_array

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf
from toolpoint.vibration import frequency_response
from toolpoint.vibration.eigen import solve_undamped
from toolpoint.vibration.sparse import modes

COUNT = 6
POSES = ((-0.9, 0.0, 0.0), (-0.9, 0.3, 0.0), (-0.9, 0.5, 1.0), (-0.75, 0.2, 2.5), (-1.0, 0.15, 4.0), (-0.95, 0.4, 0.7))


def head() -> Machine:
    """The machine of the demo."""
    return machine_file.read(MACHINE_TEMPLATES / "three_rps_elastic_head.yaml")


def full(machine: Machine, pose: dict[str, float]) -> np.ndarray:
    """Natural frequencies with every finite element of the limbs, assembled apart from the machine's own equations.

    Unknowns: all coordinates of three limbs in their frames, a turn of each frame about its hinge, the platform's twist.
    """
    description, place = machine.description, place_machine(machine, pose)
    mass, stiffness, rows, springs = [], [], [], []
    limb = description.bodies["limb1"].elastic
    model = limb.model
    for _ in range(3):
        mass.append(model.mass())
        stiffness.append(model.stiffness())
    n = model.size
    size = 3 * n + 3 + 6
    guide = limb.interfaces["guide"]
    ball = limb.interfaces["ball"].place.averages(model).toarray()
    turning = []
    for i in range(3):
        frame_of = place.frames[0, machine.link(f"limb{i + 1}")]
        hinge = place.joint_frames[0, machine.joint_names.index(f"slide{i + 1}")]
        axis = tf.adjoint(tf.transform(None, hinge[:3, 3])) @ np.r_[np.zeros(3), place_axis(machine, place, i)]
        at = tf.move(tf.inverse(frame_of), hinge[None, :3, 3])[0]
        way = float(at[2] - guide.centre[2])
        held = guide.place.moved(np.array([0, 0, way])).averages(model).toarray()
        here = np.array(guide.centre) + np.array([0, 0, way])
        to_hinge = tf.adjoint(tf.inverse(hinge))
        limb_part = to_hinge @ tf.adjoint(frame_of @ tf.transform(None, here)) @ held.T
        joint = np.zeros((6, size))
        joint[:, i * n:(i + 1) * n] = limb_part
        joint[:, 3 * n + i] = -(to_hinge @ axis)
        rows.append(joint)
        springs.append(machine.joints[machine.joint_names.index(f"slide{i + 1}")].stiffness)
        place_of = frame_of @ tf.transform(None, np.zeros(3))
        ball_at = tf.transform(np.eye(3), place_of[:3, 3])
        inverse = tf.adjoint(tf.inverse(ball_at @ tf.transform(ball_frame(machine, place, i), None)))
        link = np.zeros((6, size))
        link[:, i * n:(i + 1) * n] = -inverse @ tf.adjoint(place_of) @ ball.T
        link[:, 3 * n + 3:] = inverse
        rows.append(link)
        springs.append(np.diag([2.5e8, 2.5e8, 3e8, 0, 0, 0]))
        body = machine.bodies[machine.link(f"frame{i + 1}")]
        turn = tf.adjoint(tf.inverse(place.frames[0, machine.link(f"frame{i + 1}")])) @ axis
        turning.append(turn @ body.mass @ turn)
    platform = machine.link("platform")
    back = tf.adjoint(tf.inverse(place.frames[0, platform]))
    whole_m = block_diag([*mass, csc_array(np.diag(turning)), csc_array(back.T @ machine.bodies[platform].mass @ back)]).tocsc()
    whole_k = block_diag([*stiffness, csc_array((9, 9))]).tocsc()
    for part, spring in zip(rows, springs, strict=True):
        whole_k = whole_k + csc_array(csc_array(part).T @ csc_array(spring) @ csc_array(part))
    return modes(csc_array(whole_k), csc_array(whole_m), COUNT).frequency[:COUNT]


def place_axis(machine: Machine, place, i: int) -> np.ndarray:
    """Direction of a hinge in the machine frame: x of its frame, which does not move."""
    return place.joint_frames[0, machine.joint_names.index(f"hinge{i + 1}"), :3, 0]


def ball_frame(machine: Machine, place, i: int) -> np.ndarray:
    """Orientation of a ball's springs: they ride on the limb."""
    return place.frames[0, machine.link(f"limb{i + 1}"), :3, :3]


def main() -> None:
    CommandLine(__doc__).parse_args()
    start = time.perf_counter()
    machine = head()
    print(f"{machine!r}\nread and reduced in {time.perf_counter() - start:.1f} s (kept on disk by content)")
    worst = 0.0
    for z, tilt, azimuth in POSES:
        pose = {"Z": z, "tilt": tilt, "azimuth": azimuth}
        reduced = solve_undamped(assemble(machine, pose), COUNT).frequency
        exact = full(machine, pose)
        error = np.max(np.abs(reduced / exact - 1))
        worst = max(worst, error)
        print(f"Z {z} tilt {tilt} azimuth {azimuth}: {np.round(exact, 2)} Hz, reduced within {100 * error:.4f} %", flush=True)
    home = solve_undamped(assemble(machine, {"Z": -0.9, "tilt": 0.0, "azimuth": 0.0}), COUNT).frequency
    turned = [solve_undamped(assemble(machine, {"Z": -0.9, "tilt": 0.3, "azimuth": a + 0.2}), COUNT).frequency
              for a in 2 * np.pi / 3 * np.arange(3)]
    print(f"modes 1 and 2 at home apart by {home[1] / home[0] - 1:.1e}; three-fold symmetry to "
          f"{np.ptp(turned, axis=0).max():.1e} Hz")
    lines = np.linspace(5, 405, 400)
    tilts = np.radians(np.linspace(-30, 30, 61))
    way = {"Z": np.full(61, -0.75), "tilt": tilts, "azimuth": np.zeros(61)}
    start = time.perf_counter()
    system = assemble(machine, way, ["tip:+x", "tip:+y", "tip:+z"])
    frf = frequency_response.modal(solve_undamped(system, 40), lines)
    spent = time.perf_counter() - start
    peak = np.abs(frf.values[:, :, 0, 0]).max(axis=1)
    peak_y = np.abs(frf.values[:, :, 1, 1]).max(axis=1)
    print(f"FRF map of 61 orientations x 400 lines: {spent:.2f} s")
    for name, values in (("x", peak), ("y", peak_y)):
        k = int(values.argmax())
        print(f"largest compliance along {name} at tilt {np.degrees(tilts[k]):.0f} deg ({values[k]:.3e} m/N; at home "
              f"{values[30]:.3e}, at 30 deg {values[60]:.3e}, at -30 deg {values[0]:.3e})")
    print(f"six modes at six poses: worst {100 * worst:.4f} %")


if __name__ == "__main__":
    main()
