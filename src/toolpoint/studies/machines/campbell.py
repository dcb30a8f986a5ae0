"""Campbell diagram: natural frequencies of a machine with spinning bodies over the spindle speed, whirl and critical speeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, FloatArray, count, fail, floats, increasing
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine, assemble
from toolpoint.machine.assembly.gyroscopics import fastest_spin, run_at_speed
from toolpoint.machine.assembly.system import loop_basis
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf
from toolpoint.studies.text_table import text_table
from toolpoint.vibration.gyroscopic import gyroscopic_pencil

SENSES = ("backward", "plain", "forward")
MIN_ORBIT_CIRCULARITY = 0.05  # of a circle's area: below, an orbit is a line, neither forward nor backward


@dataclass(frozen=True, eq=False)
class Campbell(NotebookText):
    """Frequencies over the spindle speed.

    speeds : (n,), rev/min; frequency : (n, n_modes), Hz; whirl : the same shape, +1 forward, -1 backward, 0 neither;
    orders : excitations per revolution; critical : rows (order, speed in rev/min, frequency in Hz, whirl).
    """

    machine: Machine
    pose: Mapping[str, float]
    speeds: FloatArray
    frequency: FloatArray
    whirl: FloatArray
    orders: tuple[float, ...]
    critical: tuple[tuple[float, float, float, int], ...]

    def table(self) -> str:
        """Return frequencies at the ends of the range and the critical speeds as text."""
        first, last = self.speeds[0], self.speeds[-1]
        rows = [[str(k + 1), f"{a:.3f}", f"{b:.3f}", SENSES[int(w) + 1]]
                for k, (a, b, w) in enumerate(zip(self.frequency[0], self.frequency[-1], self.whirl[-1], strict=True))]
        header = ["mode", f"Hz at {first:g} rev/min", f"Hz at {last:g} rev/min", "whirl"]
        lines = [[f"{order:g}", f"{speed:.1f}", f"{f:.3f}", SENSES[w + 1]] for order, speed, f, w in self.critical]
        text = text_table("Critical speeds", ["per revolution", "rev/min", "Hz", "whirl"], lines)
        return text_table(self.machine.name, header, rows) + "\n" + (text if lines else "No critical speed in the range.")

    def to_dict(self) -> dict[str, Any]:
        """Return the diagram as plain numbers."""
        return {"speed_rpm": self.speeds.tolist(), "frequency_hz": self.frequency.tolist(), "whirl": self.whirl.tolist(),
                "orders": list(self.orders), "critical": [
                    {"order": o, "speed_rpm": s, "frequency_hz": f, "whirl": SENSES[w + 1]} for o, s, f, w in self.critical]}


def map_speeds(machine: Machine, speeds: ArrayLike, modes: int = 8, *, pose: Mapping[str, float] | None = None,
               orders: ArrayLike = (1.0, 2.0)) -> Campbell:
    """Return the Campbell diagram of a machine with spinning bodies.

    Parameters
    ----------
    machine : Machine
        The fastest of its spinning bodies turns with the spindle, the others in proportion.
    speeds : (n,) floats
        rev/min, increasing, two or more.
    modes : int
    pose : mapping of axis name to m or rad, optional
    orders : floats
        Excitations per revolution whose crossings are critical speeds: 1 for unbalance, the number of teeth for a cut.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription, SpinDescription
    >>> rotor = BodyDescription(4.0, inertia=InertiaDescription(0.03, 0.03, 0.02), spin=SpinDescription(2000.0))
    >>> bearings = JointDescription("ground", "rotor", stiffness={"rx": 4e5, "ry": 4e5})
    >>> spindle = build(MachineDescription("rotor", {"rotor": rotor}, {"bearings": bearings},
    ...                                    points={"nose": PointDescription("rotor")}, tool="nose"))
    >>> frequency, whirl = map_speeds(spindle, [0.0, 30000.0], 2).frequency, 30000 / 60
    >>> float(frequency[1].max() - frequency[1].min()).__round__(1)  # the whirls of tilt part by I_p W / (2 pi I_d)
    333.3
    """
    speed_grid = increasing("speeds", floats("speeds", speeds))
    if speed_grid.size < 2:
        fail("speeds", f"{speed_grid.size}", "must be two or more")
    if not fastest_spin(machine.description):
        fail("machine", "no body that spins", "must have one",
             remedy="give the spindle's body spin: {speed: 12000 rpm, axis: z}")
    mode_count = count("modes", modes)
    parts = [_modes_at_speed(machine, float(speed), dict(pose or {}), mode_count) for speed in speed_grid]
    frequency, whirl = (np.array([part[k] for part in parts]) for k in (0, 1))
    multiples = tuple(map(float, np.atleast_1d(floats("orders", orders))))
    critical = tuple(_crossings(speed_grid, frequency, whirl, multiples))
    return Campbell(machine, dict(pose or {}), speed_grid, frequency, whirl, multiples, critical)


def _modes_at_speed(machine: Machine, speed: float, pose: Mapping[str, float], mode_count: int) -> tuple[FloatArray,
                                                                                                         FloatArray]:
    spinning = run_at_speed(machine, speed * np.pi / 30)
    system = assemble(spinning, pose, _any_label(machine), modal_damping=False)
    # The antisymmetric part of the damping is gyroscopic: it shifts frequencies and stays; dissipation goes.
    undamped = system.with_damping(None if system.damping is None else (system.damping - system.damping.T) / 2)
    poles, right, _ = gyroscopic_pencil(undamped)
    sense = _whirl(machine, pose, right[:, :mode_count]) if speed else np.zeros(min(mode_count, poles.size))
    return np.abs(poles[:mode_count]) / (2 * np.pi), sense


def _any_label(machine: Machine) -> list[str]:
    """Return the label of any point of the machine: its motion is not read."""
    if not machine.description.points:
        fail("machine", "no points", "must have one", remedy="give the machine a point")
    return [f"{next(iter(machine.description.points))}:+x"]


def _whirl(machine: Machine, pose: Mapping[str, float], right: ComplexArray) -> FloatArray:
    """Return the sense in which the fastest body circles about its axis in each mode: +1 with its spin, -1 against it, else
    0."""
    name, spin = max(((name, body.spin) for name, body in machine.description.bodies.items() if body.spin is not None),
                     key=lambda item: abs(item[1].speed))
    link = machine.link(name)
    place = place_machine(machine, pose)
    axis = place.displacements[0, link, :3, :3] @ np.array(spin.axis) * np.sign(spin.speed)
    body = machine.bodies[link].mass
    first = body[3:6, :3] / body[0, 0]
    # The mass matrix holds m times the cross-product matrix of the centre of mass.
    centre = tf.move(place.frames[0, link], np.array([[first[2, 1], first[0, 2], first[1, 0]]]))[0]
    if machine.loops:
        basis = loop_basis(place)
        right = right if basis is None else basis[0] @ right
    twist = place.jacobians[0, link] @ right
    slide = tf.point_velocity(centre) @ twist
    radius = np.sqrt(np.trace(body[3:, 3:]) / body[0, 0])
    area, size = np.zeros(right.shape[1]), np.full(right.shape[1], 1e-300)
    for motion in (slide, radius * twist[3:]):
        across = np.linalg.svd(axis[None])[2][1:]
        across[1] = np.cross(axis, across[0])
        a, b = across @ motion
        area += 2 * np.imag(np.conj(b) * a)
        # Motion along or about the axis belongs to no orbit: a mode of it alone whirls neither way.
        size += np.abs(a) ** 2 + np.abs(b) ** 2 + np.abs(axis @ motion) ** 2
    share = area / size
    return np.where(share > MIN_ORBIT_CIRCULARITY, 1.0, np.where(share < -MIN_ORBIT_CIRCULARITY, -1.0, 0.0))


def _crossings(speeds: FloatArray, frequency: FloatArray, whirl: FloatArray, orders: tuple[float, ...]
               ) -> list[tuple[float, float, float, int]]:
    """Return the critical speeds: crossings of mode and excitation line, linear between the charted speeds."""
    rows = []
    for order in orders:
        gap = frequency - order * speeds[:, None] / 60
        for k in range(frequency.shape[1]):
            for i in np.flatnonzero((gap[:-1, k] > 0) != (gap[1:, k] > 0)):
                fraction = gap[i, k] / (gap[i, k] - gap[i + 1, k])
                speed = float(speeds[i] + fraction * (speeds[i + 1] - speeds[i]))
                rows.append((order, speed, order * speed / 60, int(whirl[i + 1, k])))
    return sorted(rows)
