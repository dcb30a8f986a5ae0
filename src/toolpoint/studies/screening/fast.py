"""Frequencies of very many variants from matrices affine in stiffness, mass and density, which are summed, not rebuilt.

Exact where every changed parameter enters affinely, which is checked at random points against the full model; refused
elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from toolpoint._check import FloatArray, IndexArray, count, fail
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description.variation import Factor, resting_shares, vary
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.screening.designs import ScreeningDesign

_BLOCK_POINTS = 2048  # points solved at once
_CHECKED_POINTS = 5  # of a design, solved by the full model too
_MAX_MODEL_DIFFERENCE = 1e-8  # relative, of frequencies by affine and full model


def screen_frequencies(machine: Machine, design: ScreeningDesign, modes: int = 4, *, pose: Mapping[str, float] | None = None,
                       rng: np.random.Generator | None = None, threads: int = 2) -> FloatArray:
    """Return the lowest natural frequencies (Hz) of all points of a design at one pose, shape (n_points, modes).

    rng : of the check against the full model; seed 0 where left out. Raises ToolpointError where a change is a swap, or where
    the model is not affine in the changes (inertia of a shape in its size, gravity, loops).
    """
    number = count("modes", modes)
    base, slopes = _affine_parts(machine, design, pose)
    points = design.points - np.array(resting_shares(design.changes))
    starts = range(0, len(points), _BLOCK_POINTS)

    def block(start: int) -> FloatArray:
        return _lowest(base, slopes, points[start:start + _BLOCK_POINTS], number)

    generator = rng or np.random.default_rng(0)
    checked = generator.choice(len(points), min(_CHECKED_POINTS, len(points)), replace=False)
    _check(machine, design, pose, checked, _lowest(base, slopes, points[checked], number))
    with ThreadPoolExecutor(max_workers=threads) as pool:
        return np.concatenate(list(pool.map(block, starts)))


def _matrices(machine: Machine, pose: Mapping[str, float] | None) -> tuple[FloatArray, FloatArray]:
    labels = [f"{next(iter(machine.description.points))}:+x"] if machine.description.points else None
    system = assemble(machine, pose, labels, modal_damping=False)
    return system.mass, system.stiffness


def _affine_parts(machine: Machine, design: ScreeningDesign, pose: Mapping[str, float] | None
                  ) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return mass and stiffness at rest, and their slopes per share of every factor, (n_changes, n, n) each."""
    resting = np.array(resting_shares(design.changes))
    base = _matrices(machine, pose)
    mass, stiffness = [], []
    for k, change in enumerate(design.changes):
        if not isinstance(change, Factor):
            fail(f"swap {change.name}", "a swap", "only factors are fast here", remedy="use screen")
        end = resting.copy()
        end[k] = 1.0 if resting[k] < 0.5 else 0.0
        other = _matrices(machine.rebuild(vary(machine.description, design.changes, list(map(float, end)))), pose)
        mass.append((other[0] - base[0]) / (end[k] - resting[k]))
        stiffness.append((other[1] - base[1]) / (end[k] - resting[k]))
    return base, (np.array(mass), np.array(stiffness))


def _lowest(base: tuple[FloatArray, FloatArray], slopes: tuple[FloatArray, FloatArray], shares: FloatArray,
            modes: int) -> FloatArray:
    size = base[0].shape[0]
    mass, stiffness = ((b.reshape(-1) + shares @ s.reshape(len(s), -1)).reshape(-1, size, size) for b,
                       s in zip(base, slopes, strict=True))
    diagonal = np.diagonal(stiffness, axis1=1, axis2=2)
    if np.count_nonzero(stiffness - diagonal[..., None] * np.eye(size)) == 0:
        scale = 1 / np.sqrt(diagonal)
        scaled = scale[:, :, None] * mass * scale[:, None, :]
    else:
        inverse = np.linalg.inv(np.linalg.cholesky(stiffness))
        scaled = inverse @ mass @ np.swapaxes(inverse, -1, -2)
    values = np.linalg.eigvalsh(scaled)[:, ::-1][:, :modes]
    return 1 / (2 * np.pi * np.sqrt(values))


def _check(machine: Machine, design: ScreeningDesign, pose: Mapping[str, float] | None, checked: IndexArray,
           fast: FloatArray) -> None:
    for i, row in zip(checked, fast, strict=True):
        changed = vary(machine.description, design.changes, list(map(float, design.points[int(i)])))
        mass, stiffness = _matrices(machine.rebuild(changed), pose)
        full = _lowest((mass, stiffness), (np.zeros((1, *mass.shape)), np.zeros((1, *mass.shape))), np.zeros((1, 1)),
                       row.size)[0]
        if np.abs(row / full - 1).max() > _MAX_MODEL_DIFFERENCE:
            fail("design", f"differs from the full model by {np.abs(row / full - 1).max():.2g} at point {int(i)}",
                 "the matrices must be affine in the changes", remedy="use screen")
