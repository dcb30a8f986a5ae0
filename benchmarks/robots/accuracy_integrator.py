"""Milling accuracy beside an integrator of another kind, on random straight lines of the shipped robot and its rigid twin.

The integrator shares nothing with the study but the structure's matrices, which it takes eight times as near to each other:
Newmark's average acceleration in the machine's own coordinates, forces from the closed form of 2000 strips of the helix at the
instant (not means over a step), its start from the harmonics of the first revolution. Stated is what `toolpoint accuracy`
prints. With `--refined short` (or `all`) both integrate with ever smaller steps, too: what is apart then must go to
zero. Usage: python benchmarks/robots/accuracy_integrator.py [--cases 12] [--seed 1]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numba
import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint.io.yaml import machine_file, robot_file
from toolpoint.machine import build
from toolpoint.machine.robot.model import rigid_members, robot_machine
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_side
from toolpoint.studies.accuracy.moving_structure import ToolStance, structure_along
from toolpoint.studies.accuracy.tool_paths import line

STRIPS, STEPS = 2000, 500  # of the helix; in a tooth period
SPACING = 2.5e-4  # m between nodes of the structure
REFINEMENTS = (1, 2, 4, 8)  # parts that steps of both are cut in


def tooth_forces(cut: Any, depth: float, angles: Any, *, strips: int = STRIPS) -> tuple[Any, Any]:
    """Force of all teeth along feed and normal per metre of chip, and that of the edges, (n, 2), N/m and N."""
    k, lead = cut.coefficients, np.tan(cut.tool.helix) / (cut.tool.diameter / 2)
    chip, edge = np.zeros((len(angles), 2)), np.zeros((len(angles), 2))
    for tooth in range(cut.tool.teeth):
        for height in (np.arange(strips) + 0.5) * depth / strips:
            phi = (angles - 2 * np.pi * tooth / cut.tool.teeth - lead * height) % (2 * np.pi)
            inside, sine, cosine = phi < np.pi, np.sin(phi), np.cos(phi)
            for force, tangential, normal in ((chip, k.tangential * sine, k.normal * sine),
                                              (edge, k.edge_tangential, k.edge_normal)):
                force[:, 0] -= inside * (tangential * cosine + normal * sine)
                force[:, 1] += inside * (tangential * sine - normal * cosine)
    return chip * depth / strips, edge * depth / strips


@numba.njit
def newmark(matrices: Any, node: Any, share: Any, feed: Any, forces: Any, state: Any, h: float) -> Any:
    """Average acceleration: motion of the tip at every instant, (n, 6)."""
    mass, damping, stiffness, inputs, outputs = matrices
    chip, edge = forces
    u, v = state
    a, out = np.zeros(u.size), np.zeros((node.size, 6))
    for k in range(node.size):
        i, t = node[k], share[k]
        m, c, s = mass[i] + t * (mass[i + 1] - mass[i]), damping[i] + t * (damping[i + 1] - damping[i]), stiffness[i] + t * (
            stiffness[i + 1] - stiffness[i])
        way = inputs[i] + t * (inputs[i + 1] - inputs[i])
        row = feed[k] * chip[k % chip.shape[0]] + edge[k % chip.shape[0]]
        f = way[:, 0] * row[0] + way[:, 1] * row[1]
        if k == 0:
            a = np.linalg.solve(m, f - c @ v - s @ u)
        else:
            speed, place = v + h / 2 * a, u + h * v + h * h / 4 * a
            a = np.linalg.solve(m + h / 2 * c + h * h / 4 * s, f - c @ speed - s @ place)
            v, u = speed + h / 2 * a, place + h * h / 4 * a
        out[k] = (outputs[i] + t * (outputs[i + 1] - outputs[i])) @ u
    return out


def integrated_errors(machine: Any, side: Any, setup: MillingSetup, span: tuple[float, float], *, parts: int = 1
                      ) -> tuple[float, float]:
    """Mean radii (m, rad) of the position and the rotation sphere along a side between two times, s; steps cut in parts."""
    cut, system = machine.description.cutting, structure_along(machine, side, ToolStance(), spacing=SPACING / parts).system
    turn, steps = 60 / setup.speed, STEPS * parts * machine.description.cutting.tool.teeth
    h = turn / steps
    motion = side.law.sample(span[0] + np.arange(int((span[1] - span[0]) / h + 1e-6) + 1) * h)
    forces = tooth_forces(cut, setup.depth, np.arange(steps) * 2 * np.pi / steps, strips=STRIPS * parts)
    node = np.clip(np.searchsorted(system.length, motion[:, 0], side="right") - 1, 0, system.length.size - 2)
    share = (motion[:, 0] - system.length[node]) / (system.length[node + 1] - system.length[node])
    constant = np.full(len(motion), cut.feed_per_tooth)
    feed = constant if setup.chip == "constant" else motion[:, 1] * turn / cut.tool.teeth
    matrices = tuple(np.ascontiguousarray(v) for v in (system.mass, system.damping, system.stiffness, system.input_map,
                                                       system.output_map))
    first = [m[node[0]] + share[0] * (m[node[0] + 1] - m[node[0]]) for m in matrices]
    lines = np.fft.rfft(feed[0] * forces[0] + forces[1], axis=0) / len(forces[0])
    state = np.zeros((2, len(first[0])))
    for k, row in enumerate(lines[:-1]):
        w = 2 * np.pi / turn * k
        x = np.linalg.solve(first[2] - w**2 * first[0] + 1j * w * first[1], first[3][:, :2] @ row) * (1 if k == 0 else 2)
        state += np.real([x, 1j * w * x])
    tip = newmark(matrices, node, share, feed, forces, (state[0], state[1]), h)
    error = tip - tip.mean(axis=0)
    return float(np.linalg.norm(error[:, :3], axis=1).mean()), float(np.linalg.norm(error[:, 3:], axis=1).mean())


def random_line(machines: tuple[Any, Any], rng: np.random.Generator) -> tuple[Any, Any, MillingSetup, str]:
    """Machine (elastic or rigid), side, setup and words of one random line of all kinds."""
    elastic, rigid = machines
    machine = elastic if rng.random() < 0.35 else rigid
    start = np.array([rng.uniform(0.6, 0.7), rng.uniform(-0.1, 0.0), rng.uniform(0.0, 0.15)])
    way = np.array([0.0, rng.normal(), rng.normal()])
    feed, law = float(10 ** rng.uniform(2.5, 4.2)) / 60e3, str(rng.choice(["quintic", "jerk-limited"]))
    side = line(start, start + rng.uniform(0.01, 0.05) * way / np.linalg.norm(way), feed=feed, law=law)[0]
    setup = MillingSetup(float(rng.uniform(6000, 20000)), float(rng.uniform(1e-4, 8e-4)),
                         window=None if side.law.duration < 2 else 0.3, chip=str(rng.choice(["path", "constant"])))
    kind = "elastic" if machine is elastic else "rigid"
    return machine, side, setup, (f"{kind}, {1e3 * side.length:.0f} mm at {60e3 * feed:.0f} mm/min, {setup.speed:.0f} rev/min, "
                                  f"chip {setup.chip}, {law}")


def short_line(rigid: Any, rng: np.random.Generator) -> tuple[Any, Any, MillingSetup, str]:
    """A line of 10 mm of the rigid robot, the path's chip."""
    start = np.array([rng.uniform(0.6, 0.7), rng.uniform(-0.1, 0.0), rng.uniform(0.0, 0.15)])
    way = np.array([0.0, rng.normal(), rng.normal()])
    side = line(start, start + 0.01 * way / np.linalg.norm(way), feed=0.03, law="quintic")[0]
    setup = MillingSetup(float(rng.uniform(8000, 12000)), float(rng.uniform(1e-4, 4e-4)), window=None, chip="path")
    return rigid, side, setup, "short"


def compare_refined(draw: Callable[[], tuple[Any, Any, MillingSetup, str]], count: int) -> None:
    """Print how far the two are apart on random lines with their own steps, with halves, quarters and eighths."""
    worst = np.zeros(len(REFINEMENTS))
    for case in range(count):
        machine, side, setup, words = draw()
        for level, parts in enumerate(REFINEMENTS):
            finer = replace(setup, steps=setup.steps * parts, spacing=setup.spacing / parts, halved=False)
            result = mill_side(machine, side, finer, judged=False)
            truth = integrated_errors(machine, side, finer, result.span, parts=parts)
            apart = max(abs(a / b - 1) for a, b in zip((result.position_error, result.rotation_error), truth, strict=True))
            worst[level] = max(worst[level], apart)
            print(f"{case + 1}: {words}: steps cut in {parts}: {1e6 * result.position_error:.5g} um, apart {apart:.2g}",
                  flush=True)
    levels = ", ".join(f"{value:.2g} ({parts})" for parts, value in zip(REFINEMENTS, worst, strict=True))
    print(f"apart at most (steps cut in): {levels}")


def main() -> None:
    """Print every case, and how many differ by less than is stated."""
    options = CommandLine(__doc__)
    options.cases("cases", 12)
    options.seed(1)
    options.add_argument("--refined", choices=("short", "all"),
                         help="both with ever smaller steps, on short lines or on all kinds")
    asked = options.parse_args()
    elastic = machine_file.read(MACHINE_TEMPLATES / "milling_robot.yaml")
    rigid = build(robot_machine(rigid_members(robot_file.read(MACHINE_TEMPLATES / "milling_robot_datasheet.yaml")),
                                cutting=elastic.description.cutting))
    rng, held, worst = np.random.default_rng(asked.seed), 0, 0.0
    if asked.refined:
        draw = (lambda: short_line(rigid, rng)) if asked.refined == "short" else (lambda: random_line((elastic, rigid), rng))
        return compare_refined(draw, asked.cases)
    for case in range(asked.cases):
        machine, side, setup, words = random_line((elastic, rigid), rng)
        result = mill_side(machine, side, setup, judged=False)
        truth = integrated_errors(machine, side, setup, result.span)
        apart = max(abs(a / b - 1) for a, b in zip((result.position_error, result.rotation_error), truth, strict=True))
        stated = result.halving
        held += apart <= stated
        worst = max(worst, apart / stated)
        print(f"{case + 1}: {words}: {1e6 * result.position_error:.4g} um, apart {100 * apart:.2g} %, "
              f"stated {100 * stated:.2g} %; {held} of {case + 1} within", flush=True)
    print(f"within what is stated: {held} of {asked.cases}, at most {worst:.2g} times")


if __name__ == "__main__":
    main()
