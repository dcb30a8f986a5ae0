"""Functions that tests of execution send to workers; importable there."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint.cutting import ZeroOrder


def square(point):
    """The square of a number, and a small array."""
    return {"square": np.array(point["x"] ** 2), "row": np.arange(3) * point["x"]}


def failing(point):
    """Fails for one point."""
    if point["x"] == 3:
        raise ValueError("three is not wanted")
    return square(point)


def slow(point):
    """Takes a moment, and notes that it ran."""
    time.sleep(0.05)
    with Path(point["log"]).open("a") as file:
        file.write(f"{point['x']}\n")
    return {"square": np.array(point["x"] ** 2)}


def deadly_once(point):
    """Kills its worker the first time that point 5 runs; the second time it succeeds."""
    marker = Path(point["marker"])
    if point["x"] == 5 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array(point["x"] ** 2)}


def poisoned(point):
    """Kills its worker whenever point 7 runs."""
    if point["x"] == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array(point["x"] ** 2)}


def static(plane):
    """Largest compliance of a cutting plane at 1 Hz."""
    return float(np.abs(plane.response(np.array([1.0]))).max())


@dataclass(frozen=True)
class Deadly:
    """A stability method that kills its process where the compliance is this one."""

    at: float

    def solve(self, problem, speeds, depth_max, *, warm=None):
        """As ZeroOrder elsewhere."""
        if abs(static(problem.plane) - self.at) < 1e-12 * self.at:
            os.kill(os.getpid(), signal.SIGKILL)
        return ZeroOrder().solve(problem, speeds, depth_max)


@dataclass(frozen=True)
class DeadlyMetric:
    """A metric of machines that kills its worker once, at the machine as it is, and then answers: two spring rates."""

    marker: str

    def __call__(self, machine):
        rates = [machine.value(f"joints.joint_q{i}.stiffness.rz") for i in (1, 2)]
        if self.marker and rates == [1.2e5, 1e5] and not Path(self.marker).exists():
            Path(self.marker).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return {"sum": sum(rates), "product": rates[0] * rates[1]}
