"""Stability charts: the default engine against a naive NumPy semi-discretization in the same run.

Cases: 200 x 100 chart of the 2-DOF benchmark (a/D 0.05), 20 cross-coupled modes, many poses, a probability chart; 18 modes
from 1000 to 24 000 rev/min; tools without a single delay (milliseconds a speed beside the multiplier of collocation there).
Accuracy stands beside time: wrong pixels against a run of the engine with tolerance 1e-11 outside the stated error.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.linalg import expm

from benchmarks.frame import CommandLine
from toolpoint import Modes
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    StabilityChart,
    Tool,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.advice.probability import coefficient_parameters, modal_parameters, probability
from toolpoint.cutting.stability.chain import ChartRow, Poses, chart_poses, poses_of


def two_dof() -> MillingProblem:
    """The usual benchmark: 0.03993 kg, 922 Hz, 1.1 %, the same in x and y; K_t 6e8, K_n 2e8 N/m^2, N = 2."""
    modes = Modes([922.0, 922.0], [0.011, 0.011], np.eye(2) / np.sqrt(0.03993), ("tool:+x", "tool:+y"))
    return MillingProblem(Tool(0.02, 2), Engagement.down(0.05), CuttingCoefficients(6e8, 2e8), modes)


def many_modes(rng: np.random.Generator, poses: int = 0, n: int = 20) -> tuple[MillingProblem, Modes]:
    """A cut with n cross-coupled modes, and as many poses of it as asked for."""
    lead = (poses,) if poses else ()
    f = np.sort(rng.uniform(200, 3000, (n,))) * (1 + 0.05 * rng.standard_normal((*lead, n)))
    zeta, k = np.broadcast_to(rng.uniform(0.01, 0.05, n), f.shape), 5e6 * rng.uniform(1, 20, n)
    angle = rng.uniform(0, np.pi, n) + 0.1 * rng.standard_normal((*lead, n))
    shape = (2 * np.pi * f / np.sqrt(k))[..., None, :] * np.stack([np.cos(angle), np.sin(angle)], axis=-2)
    modes = Modes(f, zeta, shape, ("tool:+x", "tool:+y"))
    first = modes.at_pose(0) if poses else modes
    return MillingProblem(Tool(0.016, 4), Engagement.down(0.05), CuttingCoefficients(8e8, 3e8), first), modes


def naive(problem: MillingProblem, speeds: np.ndarray, depths: np.ndarray, intervals: int = 40) -> np.ndarray:
    """Textbook zeroth-order semi-discretization, one matrix product an interval, dense eigenvalues."""
    m, zeta, w = 0.03993, 0.011, 2 * np.pi * 922.0
    out = np.empty((speeds.size, depths.size), bool)
    entry, leave = problem.engagement.entry, problem.engagement.exit
    for i, n in enumerate(speeds):
        step = 60 / n / problem.tool.teeth / intervals
        phi = (np.arange(intervals)[:, None] + (np.arange(20) + 0.5) / 20) * np.pi / intervals
        total = np.zeros((intervals, 2, 2))
        for j in range(2):
            p = phi + j * np.pi
            g = (p > entry) & (p < leave)
            k = np.stack([6e8 * np.cos(p) + 2e8 * np.sin(p), -6e8 * np.sin(p) + 2e8 * np.cos(p)])
            total += np.einsum("ts,ats,bts->tab", g / 20, k, np.stack([np.sin(p), np.cos(p)]))
        for d, depth in enumerate(depths):
            phi_all = np.eye(4 + 2 * intervals)
            for h in total:
                a = np.zeros((4, 4))
                a[:2, 2:], a[2:, :2], a[2:, 2:] = np.eye(2), -(w**2) * np.eye(2) - depth * h / m, -2 * zeta * w * np.eye(2)
                p = expm(a * step)
                r = np.zeros((4, 2))
                r[2:] = depth * h / m
                r = (p - np.eye(4)) @ np.linalg.solve(a, r)
                one = np.zeros_like(phi_all)
                one[:4, :4], one[:4, -2:], one[:4, -4:-2] = p, r / 2, r / 2
                one[4:6, :2] = np.eye(2)
                one[6:, 4:-2] = np.eye(2 * intervals - 2)
                phi_all = one @ phi_all
            out[i, d] = np.abs(np.linalg.eigvals(phi_all)).max() < 1
    return out


def general_tools() -> dict[str, MillingProblem]:
    """Half immersion with four flexible directions (two modes each in x and y) and tools that have no single delay."""
    modes = Modes([456.8, 1448.9, 516.5, 1408.4], [0.1117, 0.01704, 0.02458, 0.03136], 2 * np.pi * np.array(
        [[456.8 / 7.933e6**0.5, 1448.9 / 1.469e7**0.5, 0, 0], [0, 0, 516.5 / 9.375e6**0.5, 1408.4 / 1.241e7**0.5]]),
        ("tool:+x", "tool:+y"))
    cut = MillingProblem(Tool(0.0254, 4), Engagement.down(0.5), CuttingCoefficients(1319.4e6, 788.8e6), modes)
    pitch = np.radians([80, 100, 75, 105])
    return {"unequal pitch": cut.changed(tool=Tool(0.0254, 4, pitch=pitch)),
            "helix 30 deg": cut.changed(tool=Tool(0.0254, 4, helix=np.radians(30))),
            "helix 30/35 deg": cut.changed(tool=Tool(0.0254, 4, helix=np.radians([30, 35, 30, 35]))),
            "process damping": cut.changed(process_damping=2e4),
            "ball": cut.changed(tool=Tool(0.0254, 4, corner_radius=0.0127))}


def general_rows(rows: dict[str, object]) -> None:
    """Milliseconds a speed over 20 speeds, and how far the multiplier of collocation is from 1 on one boundary."""
    for name, problem in general_tools().items():
        speeds = np.linspace(4000, 16000, 20)
        chart, seconds = timed(lambda p=problem, s=speeds: stability.chart(p, s), 2)  # type: ignore[misc]
        rows[f"{name}, ms a speed"] = 1e3 * seconds / speeds.size
        i = int(np.argmin(chart.limit))
        general = Collocation(nodes=8, slices=8)
        rows[f"{name}, | |mu| of collocation - 1 |"] = abs(abs(general.multipliers(problem, speeds[i], chart.limit[i])[0]) - 1)


def low_speed_rows(rows: dict[str, object]) -> None:
    """18 modes from 1000 to 24 000 rev/min, 100 speeds, the default; PanelArnoldi alone beside it, pixels that differ."""
    big, _ = many_modes(np.random.default_rng(7), n=18)
    modes = big.dynamics.selected(range(18))  # type: ignore[union-attr]
    low = Modes(np.asarray(modes.frequency) / 2, modes.damping_ratio, np.asarray(modes.shape) / 2, modes.dofs)
    speeds = np.linspace(1000, 24000, 100)
    for name, cut in (("a/D 0.05", Engagement.down(0.05)), ("a/D 0.5", Engagement.down(0.5)), ("slot", Engagement.slot())):
        problem = big.changed(dynamics=low, engagement=cut)
        chart, seconds = timed(lambda p=problem: stability.chart(p, speeds), 2)  # type: ignore[misc]
        rows[f"18 modes to 1500 Hz, 1000..24000 rev/min, 100 speeds, {name}, s "] = seconds
        panel, seconds = timed(lambda p=problem: stability.chart(p, speeds, PanelArnoldi()), 1)  # type: ignore[misc]
        depths = np.linspace(1e-4, 0.01, 100)
        wrong = (chart.stable(depths) != panel.stable(depths)) & ~chart.uncertain(depths) & ~panel.uncertain(depths)
        rows[f"   {name}: PanelArnoldi alone, s; pixels that differ: {int(wrong.sum())}"] = seconds


def path_of(cut: MillingProblem, poses: int, step: float) -> Modes:
    """Poses along a path: frequencies and directions of every mode move by about `step` (relative, rad) each time."""
    modes: Modes = cut.dynamics  # type: ignore[assignment]
    rng = np.random.default_rng(3)
    at = 0.1 * np.sin(10 * step * np.arange(poses))[:, None]
    f = np.asarray(modes.frequency) * (1 + at * rng.standard_normal(modes.count))
    turn = at * rng.standard_normal(modes.count)
    x, y = np.asarray(modes.shape)
    shape = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y], axis=-2)
    return Modes(f, np.broadcast_to(modes.damping_ratio, f.shape), shape, modes.dofs)


def warm_rows(rows: dict[str, object]) -> None:
    """Cold over warm time (CPU) along paths of 20 poses in three feed directions, 20 modes, and for a helical tool."""
    big, _ = many_modes(np.random.default_rng(0))
    small = general_tools()["helix 30 deg"]
    depths = np.linspace(1e-4, 0.01, 100)
    cases = [(f"20 modes, steps of {100 * step:g} %", big, step, np.linspace(4000, 15000, 200)) for step in (0.001, 0.01, 0.03)]
    cases.append(("helix, steps of 1 %", small, 0.01, np.linspace(4000, 16000, 20)))
    for name, cut, step, speeds in cases:
        poses = [path_of(cut, 20, step).at_pose(i) for i in range(20)]
        charts, seconds = [], []
        for warm in (False, True):
            start = time.process_time()
            charts.append(chart_chains(cut, poses, speeds, (0.0, 0.5, 1.0), warm=warm))
            seconds.append(time.process_time() - start)
        wrong = sum(int(((a.stable(depths) != b.stable(depths)) & ~a.uncertain(depths) & ~b.uncertain(depths)).sum())
                    for one, other in zip(*charts) for a, b in zip(one, other))
        rows[f"warm starts, {name}: cold/warm time; pixels that differ: {wrong}"] = seconds[0] / seconds[1]


def chart_chains(cut: MillingProblem, dynamics: Poses, speeds: np.ndarray, angles: tuple[float, ...] = (0.0,),
                 warm: bool = True, workers: int = 1) -> list[ChartRow]:
    """Charts of all poses in chains of ten, each warm from the one before; the kernels run without the interpreter's lock."""
    poses = list(poses_of(dynamics))
    chains = [poses[i:i + 10] for i in range(0, len(poses), 10)]
    with ThreadPoolExecutor(workers) as pool:
        parts = pool.map(lambda chain: chart_poses(cut, chain, speeds, feed_angles=angles, warm=warm), chains)
        return [row for part in parts for row in part]


def timed(work: Callable[[], StabilityChart], repeat: int = 3) -> tuple[StabilityChart, float]:
    """Result and best time of some runs, the first (which may compile) left out."""
    work()
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return result, min(times)


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.json()
    parser.cases("poses", 100)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--naive-speeds", type=int, default=4, help="speeds of the naive run; its time is scaled to 200")
    options = parser.parse_args()
    speeds, depths = np.linspace(5000, 25000, 200), np.linspace(4e-5, 4e-3, 100)
    problem = two_dof()
    chart, seconds = timed(lambda: stability.chart(problem, speeds, depth_max=4e-3))
    truth = stability.chart(problem, speeds, FloquetDeterminant(tolerance=1e-11, nodes=14, base=48), depth_max=4e-3)
    wrong = (chart.stable(depths) != truth.stable(depths)) & ~chart.uncertain(depths)
    zero, zero_seconds = timed(lambda: stability.chart(problem, speeds, ZeroOrder(), depth_max=4e-3))
    pick = np.linspace(0, 199, options.naive_speeds).astype(int)
    start = time.perf_counter()
    naive_pixels = naive(problem, speeds[pick], depths)
    naive_seconds = (time.perf_counter() - start) * 200 / pick.size
    rows: dict[str, object] = {
        "200 x 100 chart, 2 DOF, s": seconds, "wrong pixels outside the error": int(wrong.sum()),
        "naive semi-discretization (40), s": naive_seconds,
        "its wrong pixels, scaled": int((naive_pixels != truth.stable(depths)[pick]).sum() * 200 / pick.size),
        "zero-order, s": zero_seconds,
        "its wrong pixels": int((zero.stable(depths) != truth.stable(depths)).sum()),
        "ratio naive / default": naive_seconds / seconds}
    rng = np.random.default_rng(0)
    big, _ = many_modes(rng)
    big_speeds = np.linspace(4000, 15000, 200)
    found, rows["20 modes, 200 speeds, all depths, s"] = timed(lambda: stability.chart(big, big_speeds, depth_max=0.01), 2)
    rows["20 modes: status"] = found.status
    cut, modes = many_modes(rng, options.poses)
    start = time.perf_counter()
    charts = chart_chains(cut, modes, big_speeds, workers=2)
    rows[f"{options.poses} poses x 200 speeds, 20 modes, two threads, s"] = time.perf_counter() - start
    rows["failed poses"] = sum(isinstance(row[0], str) for row in charts)
    start = time.perf_counter()
    parameters = [*modal_parameters(problem), *coefficient_parameters()]
    probability(problem, parameters, speeds, depths=depths, rng=np.random.default_rng(0), samples=options.samples)
    rows[f"probability chart, {options.samples} samples, s"] = time.perf_counter() - start
    warm_rows(rows)
    general_rows(rows)
    low_speed_rows(rows)
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<82}{value:.5g}" if isinstance(value, float) else f"{name:<82}{value}")
    print(f"200 x 100 chart, 2 DOF, in {seconds:.3f} s on one core, {int(wrong.sum())} wrong pixels (target 0.1 s)")


if __name__ == "__main__":
    main()
