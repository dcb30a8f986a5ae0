"""A carriage on a ribbed column: ten modes at positions off every station, reduced against full; derivative; time.

The model follows a study of formulations for moving interfaces: hollow ribbed cast column 0.40 x 0.44 x 1.3 m, steel rails
bonded on, clamped foot; carriage of 320 kg on four blocks (6e8 and 5e8 N/m, with rotations), ball screw 1.6e8 N/m to the top.
Run: python benchmarks/machine/sliding_column.py [--positions 20] [--sizes 75 100 125]
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.signal import savgol_filter
from scipy.sparse import block_array, csc_array
from scipy.sparse import block_diag as sparse_diagonal

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import CAST_IRON, STEEL, Casting, Cuboid, Patch, SolidModel
from toolpoint.substructuring.estimate import Surroundings
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reduction import span
from toolpoint.substructuring.sliding import SlidingBody, fit_to_surroundings, station_loads, tabulate
from toolpoint.vibration.sparse import modes

X, Y, Z, WALL, RAIL = 0.40, 0.44, 1.3, 0.02, 0.03
BLOCK, APART = 0.07, 0.26  # length of a block, distance of the upper from the lower blocks, m
CARRIAGE, SCREW = 320.0, 1.6e8
LOW, HIGH = 0.28, 1.07  # way of the carriage's centre, m
COUNT = 10


def column(size: float = 0.1) -> SolidModel:
    """The column with ribs and two rails on its front, y = Y."""
    parts = [Cuboid([0, 0, 0], [X, Y, Z]), Cuboid([WALL, WALL, WALL], [X - WALL, Y - WALL, Z - WALL], is_window=True)]
    parts += [Cuboid([WALL, WALL, z], [X - WALL, Y - WALL, z + WALL]) for z in (0.33, 0.64, 0.95)]
    parts += [Cuboid([0.1, 0.1, z], [X - 0.1, Y - 0.1, z + WALL], is_window=True) for z in (0.33, 0.64, 0.95)]
    parts += [Cuboid([x, Y, 0.02], [x + RAIL, Y + RAIL, Z - 0.02], "rail") for x in (0.03, X - 0.03 - RAIL)]
    return Casting(tuple(parts), {"body": CAST_IRON, "rail": STEEL}).meshed(size)


def block(model: SolidModel, x: float, above: float, z: float) -> csc_array:
    """Weights of a block on its rail, the carriage's centre at z."""
    return Patch([x, Y + RAIL, z + above], [0, 0, 1], [1, 0, 0], BLOCK, RAIL).averages(model)


def carriage() -> Surroundings:
    """Blocks (four patches), the screw's bearing, and the carriage's six coordinates about its centre."""
    k = np.diag([6e8, 5e8, 0.0, 2e6, 2e6, 1e6])  # x across, y away from the rail, z free; rotations
    stiffness, mass = np.zeros((36, 36)), np.zeros((36, 36))
    for i, (x, above) in enumerate([(x, a) for x in (-X / 2 + 0.045, X / 2 - 0.045) for a in (-APART / 2, APART / 2)]):
        arm = np.array([x, -0.09, above])  # from the carriage's centre
        cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        motion = np.block([[np.eye(3), -cross], [np.zeros((3, 3)), np.eye(3)]])
        rows = np.zeros((6, 36))
        rows[:, 6 * i:6 * i + 6], rows[:, 30:] = -np.eye(6), motion
        stiffness += rows.T @ k @ rows
    rows = np.zeros((1, 36))
    rows[0, 26], rows[0, 32], rows[0, 33] = -1, 1, -0.05  # the nut is 50 mm behind the centre: v_z = z - 0.05 rx
    stiffness += SCREW * rows.T @ rows
    mass[30:, 30:] = np.diag([CARRIAGE] * 3 + [9.0, 8.0, 11.0])
    return Surroundings(stiffness, mass)


def places(model: SolidModel) -> list:
    """Weights of the four blocks as functions of the carriage's position."""
    return [partial(block, model, x, above) for x in (0.045, X - 0.045) for above in (-APART / 2, APART / 2)]


def full(parts: tuple, around: Surroundings, weights: csc_array) -> np.ndarray:
    """Coupled frequencies of the whole, not counted (the count is made once, by the reduction)."""
    stiffness, mass, free = parts
    w, k, n = csc_array(weights[free]), csc_array(around.stiffness), weights.shape[1]
    whole = block_array([[stiffness + w @ k[:n, :n] @ w.T, w @ k[:n, n:]], [k[n:, :n] @ w.T, k[n:, n:]]]).tocsc()
    inertia = sparse_diagonal([mass, csc_array(around.mass[n:, n:])]).tocsc()
    return modes(csc_array(whole), csc_array(inertia), COUNT, is_counted=False).frequency[:COUNT]


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("positions", 20)
    parser.add_argument("--sizes", type=int, nargs="*", default=[75, 99, 129])
    given = parser.parse_args()
    model, around = column(), carriage()
    free = model.free_coordinates(np.flatnonzero(model.nodes[:, 2] < 1e-9))
    stiffness, mass = (csc_array(a[free][:, free]) for a in (model.stiffness(), model.mass()))
    top = Patch([X / 2, Y / 2, Z], [1, 0, 0], [0, 1, 0], 0.12, 0.12).averages(model)
    start = time.perf_counter()
    stations = station_loads(places(model), LOW, HIGH, step=BLOCK / 3.5)
    joint = np.sqrt(np.array([6e8, 5e8, 1e6, 2e6, 2e6, 1e6]))
    loads = csc_array(np.hstack([stations.toarray()[free], top.toarray()[free][:, 2:3]]))
    weights = np.r_[np.tile(joint, stations.shape[1] // 6), np.sqrt(SCREW)]
    repeats = np.r_[np.full(stations.shape[1], stations.shape[1] / 24), 1.0]
    body = LargeBody(stiffness, mass, loads, None, weights, repeats, model.dof_places[free])
    positions = np.random.default_rng(4).uniform(LOW + 0.02, HIGH - 0.02, given.positions)
    frequencies = []
    for z in positions:
        w = csc_array(np.hstack([*(place(z).toarray() for place in places(model)), top.toarray()]))
        frequencies.append(full((stiffness, mass, free), around, w))
    truth = np.array(frequencies)
    print(f"{free.size} DOF, {loads.shape[1]} loads; ten modes {truth.min():.0f}..{truth.max():.0f} Hz, full solutions "
          f"{(time.perf_counter() - start) / given.positions:.1f} s a position", flush=True)
    start = time.perf_counter()
    band = float(truth.max())
    shapes = span(body, ActingLoads(band, 2.2, 1))
    print(f"span {time.perf_counter() - start:.0f} s, {shapes.kept} modes, up to {shapes.largest} shapes", flush=True)
    start = time.perf_counter()
    whole = tabulated(shapes.reduced(), model, free, top)
    print(f"tables {time.perf_counter() - start:.0f} s", flush=True)
    kept = int((whole.reduction.frequency < 1.45 * band).sum())
    for size in given.sizes:
        fitted = fit_to_surroundings(whole, around, np.linspace(LOW, HIGH, 41), modes=COUNT, size=size, kept=kept)
        report(fitted, around, positions=positions, truth=truth)


def tabulated(reduction, model, free, top) -> SlidingBody:
    """The reduced column with tables of its four blocks."""
    tables = {}
    for k, place in enumerate(places(model)):
        tables[f"block {k + 1}"] = tabulate(reduction.vectors, lambda z, place=place: place(z)[free], LOW, position_max=HIGH,
                                            name=f"block {k + 1}")
    return SlidingBody(reduction, tables, top.toarray()[free].T @ reduction.vectors)


def report(body, around, *, positions, truth) -> None:
    """Print worst error, ripple, derivative and time of one size."""
    solved = np.array([body.frequencies(z, around, COUNT)[0] for z in positions])
    step = 1e-5
    slopes = np.array([body.frequencies(z, around, COUNT)[1] for z in positions])
    ahead, back = (np.array([body.frequencies(z + s, around, COUNT)[0] for z in positions]) for s in (step, -step))
    slope_error = np.max(np.abs((ahead - back) / (2 * step) - slopes)) / np.abs(slopes).max()
    start = time.process_time()
    for z in positions:
        body.frequencies(z, around, COUNT)
    each = 1e3 * (time.process_time() - start) / len(positions)
    way = np.linspace(LOW, HIGH, 373)
    track = np.array([body.frequencies(z, around, COUNT)[0] for z in way])
    apart = np.min(np.diff(track, axis=1) / track[:, :-1], axis=0)  # modes that come near another one are left out
    smooth = [k for k in range(COUNT - 1) if apart[k] > 0.03 and (k == 0 or apart[k - 1] > 0.03)]
    fit = [savgol_filter(track[:, k], 21, 3) for k in smooth]  # cubics over 44 mm: what is finer is ripple
    ripple = max((float(np.max(np.abs(f / track[:, k] - 1))) for f, k in zip(fit, smooth, strict=True)), default=np.nan)
    print(f"{body.reduction.size + 6} coordinates: worst {100 * np.max(np.abs(solved / truth - 1)):.4f} %, ripple of modes "
          f"{[k + 1 for k in smooth]} {100 * ripple:.4f} %, slope against differences {slope_error:.1e}, "
          f"{each:.2f} CPU ms a position", flush=True)


if __name__ == "__main__":
    main()
