r"""Condense the elastic bodies of a machine to as few coordinates as a stated error of its frequencies asks for.

A body's reduction answers any wrench on its places. In one machine few of these answers are used: its modes at a number of
poses are taken apart by body, and the combinations kept that store most energy in them (proper orthogonal decomposition,
Sirovich, Quart. Appl. Math. 45 (1987), in the norm of the stiffness). All free modes that a body is known to have stay, so that
no mode can be missing. The size follows from the bound of `reduction_estimate` at other poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.stats import qmc

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.bodies import Body
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.assembly.shapes import RIGID_FREQUENCY_FRACTION, body_shapes
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.parts.model import KeptBody, Machine

DEFAULT_CONDENSATION_ERROR = 1e-3  # relative, of frequencies
FOLLOWED_MODE_RATIO = 1.5  # modes that are taken apart, over those in the band: the last ones are answered by those above
_TAKEN_POSES, _ASKED_POSES = 12, 6  # poses an axis at which modes are taken apart, and others at which the error is stated
_MAX_AXIS_SPAN = 1e3  # m or rad: an axis without limits stays at its reference
_MIN_SHAPE_RATIO = 1e-9  # of the largest: smaller combinations are rounding


@dataclass(frozen=True, eq=False)
class Condensation(NotebookText):
    """A machine with condensed bodies.

    Parameters
    ----------
    machine : Machine
    error : float
        Largest bound of the relative error of a frequency to `band` at the poses at which it was asked for; what stands between
        these is not bounded.
    band : float
        Hz.
    sizes : mapping of body to its elastic coordinates before and after
    poses : tuple of mappings
        At which the error was asked for.
    mixes : mapping of body to (before, after) floats
        Combinations of its elastic coordinates that were kept.
    """

    machine: Machine
    error: float
    band: float
    sizes: Mapping[str, tuple[int, int]]
    poses: tuple[Mapping[str, float], ...]
    mixes: Mapping[str, FloatArray]

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {full_size} -> {size}" for name, (full_size, size) in self.sizes.items())
        return (f"Condensation({sizes}; frequencies to {self.band:.4g} Hz within {100 * self.error:.2g} % at {len(self.poses)} "
                "poses)")


def condense_bodies(machine: Machine, *, error: float = DEFAULT_CONDENSATION_ERROR, band: float | None = None) -> Condensation:
    """Return a machine whose castings and solids have as few coordinates as the error of its frequencies allows.

    Parameters
    ----------
    machine : Machine
    error : float
        Relative, of every frequency up to the band, by reduction: as `estimate_reduction` bounds it.
    band : float, optional
        Hz; the smallest band of the bodies where left out.

    Raises
    ------
    ToolpointError
        Where no body is a casting or a solid whose reduction states its error, or all its shapes together err by more.
    """
    positive("error", error)
    condensable = _condensable(machine)
    highest = min(_band(kept) for kept in condensable.values()) if band is None else positive("band", band)
    sampled_poses, bounded_poses = _poses(machine)
    snapshots = _snapshots(machine, condensable, sampled_poses, highest)
    bases = {name: _ShapeBasis.of(machine.bodies[machine.link(name)], answers) for name, answers in snapshots.items()}
    levels = np.unique(np.concatenate([basis.energies for basis in bases.values()]))[::-1]

    search = _SizeSearch(machine, condensable, bases, levels, bounded_poses, highest)
    if (stated := search.bound(len(levels), np.inf)) > error:
        fail("error", f"{error:g}", f"all shapes give {stated:.2g}", remedy="give the bodies a wider band, or allow more")
    first, last = 0, len(levels)
    while first < last:
        middle = (first + last) // 2
        if (bound := search.bound(middle, error)) <= error:
            stated, last = bound, middle
        else:
            first = middle + 1
    mixes = {name: basis.mix(search.level(last)) for name, basis in bases.items()}
    sizes = {name: (mix.shape[0], mix.shape[1]) for name, mix in mixes.items()}
    words = {name: f"condensed from {full_size} to {size} of these: frequencies to {highest:.4g} Hz within {100 * stated:.2g} "
             f"% at {len(bounded_poses)} poses, by reduction" for name, (full_size, size) in sizes.items()}
    return Condensation(combine_shapes(machine, mixes, words), stated, highest, sizes, tuple(bounded_poses), mixes)


@dataclass
class _SizeSearch:
    """Bounds of the error by how many levels of energy are kept."""

    machine: Machine
    condensable: Mapping[str, KeptBody]
    bases: Mapping[str, _ShapeBasis]
    levels: FloatArray
    poses: list[dict[str, float]]
    band: float

    def level(self, count: int) -> float:
        """Return the energy from which combinations are kept."""
        return float(self.levels[count - 1]) if count else np.inf

    def bound(self, count: int, limit: float) -> float:
        """Return the largest bound of a frequency's error over the poses; only that of the first pose that is above a limit."""
        condensed = combine_shapes(self.machine, {name: basis.mix(self.level(count)) for name, basis in self.bases.items()}, {})
        largest = 0.0
        for pose in list(self.poses):
            largest = max(largest, _largest_error(condensed, pose, self.band))
            if largest > limit:
                # The pose that refused one size is the first that is asked about the next.
                self.poses.insert(0, self.poses.pop(self.poses.index(pose)))
                break
        return largest


def combine_shapes(machine: Machine, mixes: Mapping[str, FloatArray], notes: Mapping[str, str]) -> Machine:
    """Return a machine whose bodies have combinations of their modal coordinates, with a note each."""
    kept = dict(machine.reduced)
    for name, mix in mixes.items():
        reduced = kept[name].reduced.combined(mix)
        note = (notes[name],) if name in notes else ()
        kept[name] = replace(kept[name], reduced=replace(reduced, nominal=replace(
            reduced.nominal, notes=(*reduced.nominal.notes, *note))))
    return machine.rebuild(machine.description, kept=kept)


def _condensable(machine: Machine) -> dict[str, KeptBody]:
    """Return the castings and solids whose reduction states its error."""
    result = {name: kept for name, kept in machine.reduced.items()
              if not isinstance(kept.part, BeamDescription) and machine.bodies[machine.link(name)].residual is not None}
    if not result:
        fail("machine", "no casting or solid that states its error", "must have one",
             remedy="write the machine anew where the numbers of sets were changed apart")
    return result


def _band(kept: KeptBody) -> float:
    assert not isinstance(kept.part, BeamDescription)
    return kept.part.band


def _poses(machine: Machine) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Return the poses at which modes are taken apart, and those at which the error is asked for: ends, and places between."""
    axes = [axis for axis in machine.chain.axes if axis.upper - axis.lower < _MAX_AXIS_SPAN]
    if not axes:
        return [{}], [{}]
    names, lower, upper = [axis.name for axis in axes], [axis.lower for axis in axes], [axis.upper for axis in axes]
    count = _TAKEN_POSES * len(axes)
    shares = qmc.Halton(len(axes), scramble=False).random(count + _ASKED_POSES * len(axes) + 1)[1:]
    ends = [np.zeros(len(axes)), np.ones(len(axes))]
    groups = ([*ends, *shares[:count]], [*ends, *shares[count:]])
    first, second = ([dict(zip(names, qmc.scale(row[None], lower, upper)[0].tolist(), strict=True)) for row in group]
                     for group in groups)
    return first, second


def _snapshots(machine: Machine, condensable: Mapping[str, KeptBody], poses: list[dict[str, float]], band: float
               ) -> dict[str, FloatArray]:
    """Return the amplitudes (r, k) of every body in the modes at poses, each over the mode's circular frequency."""
    parts: dict[str, list[FloatArray]] = {name: [] for name in condensable}
    for pose in poses:
        shapes = body_shapes(machine, pose)
        number = int(np.ceil(FOLLOWED_MODE_RATIO * (shapes.frequency <= band).sum())) + 1
        moving = np.flatnonzero(shapes.frequency > RIGID_FREQUENCY_FRACTION * shapes.frequency.max())[:number]
        for name, amplitudes in parts.items():
            # A mode of unit modal mass stores w^2/2: over w all count by the error of their own frequency.
            amplitudes.append(shapes.bending(machine.link(name))[:, moving] / (2 * np.pi * shapes.frequency[moving]))
    return {name: np.hstack(amplitudes) for name, amplitudes in parts.items()}


@dataclass(frozen=True, eq=False)
class _ShapeBasis:
    """Free modes (r, f) of a body that always stay, and further combinations (r, k) with their energies (k,), descending."""

    kept: FloatArray
    further: FloatArray
    energies: FloatArray

    @classmethod
    def of(cls, body: Body, answers: FloatArray) -> _ShapeBasis:
        """Return the basis of a body from its amplitudes in modes, in the norm of its stiffness."""
        squares, vectors = eigh(body.stiffness, body.mass[6:, 6:])
        reach = 0.0 if body.residual is None else body.residual.reach
        kept = vectors[:, squares <= (2 * np.pi * reach) ** 2]
        lower = np.linalg.cholesky(body.stiffness)
        held = np.linalg.qr(lower.T @ kept)[0]
        remaining = lower.T @ answers
        remaining = remaining - held @ (held.T @ remaining)
        left, singular, _ = np.linalg.svd(remaining, full_matrices=False)
        usable = singular > _MIN_SHAPE_RATIO * singular.max(initial=0.0)
        return cls(kept, solve_triangular(lower.T, left[:, usable]), singular[usable])

    def mix(self, level: float) -> FloatArray:
        """Return the free modes and the combinations of at least an energy, (r, n)."""
        return np.hstack([self.kept, self.further[:, self.energies >= level]])


def _largest_error(machine: Machine, pose: Mapping[str, float], band: float) -> float:
    """Return the largest bound of a frequency's error up to a band at a pose; infinite where one is not to be believed."""
    estimate = estimate_reduction(machine, pose, machine.size)
    if estimate is None:
        return np.inf
    below = estimate.frequency <= band
    return float(np.where(estimate.is_sure, estimate.error, np.inf)[below].max(initial=0.0))
