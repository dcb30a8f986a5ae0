r"""Condense the elastic bodies of a machine to as few coordinates as a stated error of its frequencies asks for.

A body's reduction answers any wrench on its places. In one machine few of these answers are used: its modes at a number of
poses are taken apart by body, and the combinations kept that store most energy in them and in the static deflections under
forces on its points (proper orthogonal decomposition, Sirovich, Quart. Appl. Math. 45 (1987), in the norm of the stiffness).
All free modes that a body is known to have stay, so that no mode can be missing. The size follows from the bound of
`reduction_estimate` at other poses, and from the static flexibility there beside that of the machine as it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.machine.assembly.condensed_shapes import ShapeBasis, static_answers, take_snapshots
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.parts.model import KeptBody, Machine

DEFAULT_CONDENSATION_ERROR = 1e-3  # relative, of frequencies
_MIN_SAMPLE_COUNT, _MAX_SAMPLE_COUNT = 12, 48  # poses an axis at which modes are taken apart
_BOUNDED_POSE_COUNT = 6  # other poses an axis, at which the error is stated
_MAX_AXIS_SPAN = 1e3  # m or rad: an axis without limits stays at its reference


@dataclass(frozen=True, eq=False)
class Condensation(NotebookText):
    """A machine with condensed bodies.

    Parameters
    ----------
    machine : Machine
    error : float
        Largest bound of the relative error of a frequency to `band`, and largest relative difference of the static flexibility
        at a point, at the poses at which they were asked for; what stands between these is not bounded.
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
        Relative, of every frequency up to the band, by reduction: as `estimate_reduction` bounds it; and of the static
        flexibility at the machine's points, against that before.
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
    search, stated = _rich_search(machine, condensable, band=highest, error=error)
    bases, bounded_poses = search.bases, tuple(search.poses)
    first, last = 0, len(search.levels)
    while first < last:
        middle = (first + last) // 2
        if (bound := search.bound(middle, error)) <= error:
            stated, last = bound, middle
        else:
            first = middle + 1
    mixes = {name: basis.mix(search.level(last)) for name, basis in bases.items()}
    sizes = {name: (mix.shape[0], mix.shape[1]) for name, mix in mixes.items()}
    reach = (f"frequencies to {highest:.4g} Hz and static flexibility within {100 * stated:.2g} % at "
             f"{len(bounded_poses)} poses, by reduction")
    words = {name: f"condensed from {full_size} to {size} of these: {reach}" for name, (full_size, size) in sizes.items()}
    return Condensation(combine_shapes(machine, mixes, words), stated, highest, sizes, bounded_poses, mixes)


@dataclass
class _SizeSearch:
    """Bounds of the error by how many levels of energy are kept."""

    machine: Machine
    condensable: Mapping[str, KeptBody]
    bases: Mapping[str, ShapeBasis]
    levels: FloatArray
    poses: list[dict[str, float]]
    band: float
    flexibility: dict[tuple[tuple[str, float], ...], FloatArray] = field(default_factory=dict)

    def level(self, count: int) -> float:
        """Return the energy from which combinations are kept."""
        return float(self.levels[count - 1]) if count else np.inf

    def bound(self, count: int, limit: float) -> float:
        """Return the largest bound of a frequency's error over the poses; only that of the first pose that is above a limit."""
        condensed = combine_shapes(self.machine, {name: basis.mix(self.level(count)) for name, basis in self.bases.items()}, {})
        largest = 0.0
        for pose in list(self.poses):
            largest = max(largest, _largest_error(condensed, pose, self.band), self._static_error(condensed, pose))
            if largest > limit:
                # The pose that refused one size is the first that is asked about the next.
                self.poses.insert(0, self.poses.pop(self.poses.index(pose)))
                break
        return largest


    def _static_error(self, condensed: Machine, pose: dict[str, float]) -> float:
        """Return the largest relative difference of the static flexibility at a point; 0 where forces have nothing to push."""
        key = tuple(pose.items())
        if key not in self.flexibility:
            self.flexibility[key] = static_answers(self.machine, pose)[1]
        flexibility = static_answers(condensed, pose)[1]
        return float(np.abs(flexibility / self.flexibility[key] - 1).max(initial=0.0))


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


def _rich_search(machine: Machine, condensable: Mapping[str, KeptBody], *, band: float, error: float
                 ) -> tuple[_SizeSearch, float]:
    """Return a search whose combinations all together are within the error, and their bound: at as many poses as that takes."""
    stated = np.inf
    for sample_count in _sample_counts(condensable):
        sampled_poses, bounded_poses = _poses(machine, sample_count)
        snapshots = take_snapshots(machine, condensable, sampled_poses, band=band)
        bases = {name: ShapeBasis.of(machine.bodies[machine.link(name)], answers) for name, answers in snapshots.items()}
        levels = np.unique(np.concatenate([basis.energies for basis in bases.values()]))[::-1]
        search = _SizeSearch(machine, condensable, bases, levels, bounded_poses, band)
        if (stated := search.bound(len(levels), error)) <= error:
            return search, stated
        if len(sampled_poses) == 1:
            break
    fail("error", f"{error:g}", f"all shapes give {stated:.2g}", remedy="give the bodies a wider band, or allow more")


def _sample_counts(condensable: Mapping[str, KeptBody]) -> list[int]:
    """Return numbers of poses an axis at which modes are taken apart, tried in turn: the way of sliding places over their
    length, and more where meshes answer more finely."""
    places = [place for kept in condensable.values() if not isinstance(kept.part, BeamDescription)
              for place in kept.part.interfaces.values() if place.slide and place.length]
    lengths = [(place.slide[1] - place.slide[0]) / place.length for place in places if place.length]
    first_count = min(max(_MIN_SAMPLE_COUNT, int(np.ceil(max(lengths, default=0.0)))), _MAX_SAMPLE_COUNT)
    return list(dict.fromkeys(min(factor * first_count, _MAX_SAMPLE_COUNT) for factor in (1, 2, 4)))


def _poses(machine: Machine, sample_count: int) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Return the poses at which modes are taken apart, and those at which the error is asked for: ends, and places between."""
    axes = [axis for axis in machine.chain.axes if axis.upper - axis.lower < _MAX_AXIS_SPAN]
    if not axes:
        return [{}], [{}]
    from scipy.stats import qmc  # loaded where a machine is condensed: half a second

    names, lower, upper = [axis.name for axis in axes], [axis.lower for axis in axes], [axis.upper for axis in axes]
    count = sample_count * len(axes)
    shares = qmc.Halton(len(axes), scramble=False).random(count + _BOUNDED_POSE_COUNT * len(axes) + 1)[1:]
    ends = [np.zeros(len(axes)), np.ones(len(axes))]
    bounded_count = len(shares) - count
    groups = ([*ends, *shares[bounded_count:]], [*ends, *shares[:bounded_count]])
    first, second = ([dict(zip(names, qmc.scale(row[None], lower, upper)[0].tolist(), strict=True)) for row in group]
                     for group in groups)
    return first, second


def _largest_error(machine: Machine, pose: Mapping[str, float], band: float) -> float:
    """Return the largest bound of a frequency's error up to a band at a pose; infinite where one is not to be believed."""
    estimate = estimate_reduction(machine, pose, machine.size)
    if estimate is None:
        return np.inf
    below = estimate.frequency <= band
    return float(np.where(estimate.is_sure, estimate.error, np.inf)[below].max(initial=0.0))
