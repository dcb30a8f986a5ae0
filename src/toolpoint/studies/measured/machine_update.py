"""Updating of a machine: its parameters, by path, fitted to measured modes and frequency responses."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import BoolArray, FloatArray, ToolpointWarning, fail
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine, assemble
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.studies.machines.energy_law import warn_of_energy_law
from toolpoint.studies.measured.update_stages import fit_from_afar, fit_in_stages, fit_on_all_lines
from toolpoint.updating import (
    AffineSystem,
    LeastSquares,
    Parameter,
    ParameterFit,
    Prediction,
    Problem,
    SystemModel,
    Targets,
)
from toolpoint.updating.fits.second_look import look_again
from toolpoint.updating.measured.line_choice import on_chosen_lines
from toolpoint.updating.models.low_rank import factor_matrices
from toolpoint.updating.models.system_model import DAMPING_RATIO, Factors, Systems
from toolpoint.updating.residuals import silent_responses, track_modes
from toolpoint.vibration import Dof, Frf, Modes, SecondOrderSystem, correlation
from toolpoint.vibration.sensitivity import MatrixDerivatives

_VALUE_RANGE_FACTOR = 1e3  # from the start of a parameter to either bound
# Deviation of a shape over its root mean square that rigid bodies and points as drawn leave at least: points 10 mm off leave
# about this much.
MIN_SHAPE_DEVIATION_RATIO = 0.02
_MAX_LOSS_FACTOR = 2.0  # as `JointDescription.loss_factor`
_MAX_DAMPING_RATIO = 0.99  # below critical damping, as `MachineDescription.damping_ratio`
_SPARE_MODE_COUNT = 6  # modes predicted beyond the measured ones, from which partners are taken
_AFFINE_TOLERANCE = 1e-9  # of a matrix, between an affine machine and one that is assembled

# Mean power of a response over that of its noise above which the structure moves there.
_MIN_POWER_TO_NOISE = 2.0
MIN_FRAC_OF_A_NEAR_FIT = 0.9  # mean over the responses; peaks at other frequencies leave less


@dataclass(frozen=True, eq=False)
class MachineSystems:
    """A machine's equations of motion at one pose as a function of its parameters, assembled anew at every call."""

    machine: Machine
    pose: Pose | None
    outputs: tuple[Dof, ...]
    inputs: tuple[Dof, ...]

    def system(self, values: Mapping[str, float]) -> SecondOrderSystem:
        """Return the system with these values by path."""
        return assemble(self.machine.with_values(values), self.pose, self.outputs, inputs=self.inputs, modal_damping=False,
                        joint_damping=True)

    def derivatives(self, values: Mapping[str, float], names: Sequence[str]) -> MatrixDerivatives:
        """Return the exact derivatives of the matrices at these values."""
        return matrix_derivatives(self.machine.with_values(values), names, self.pose)

    def factors(self, values: Mapping[str, float], names: tuple[str, ...], owner: tuple[int, ...]) -> Factors:
        """Return the low-rank factors of these derivatives."""
        return factor_matrices(self.derivatives(values, names), owner)


def systems(
    machine: Machine, names: Sequence[str], pose: Pose | None, *, outputs: tuple[Dof, ...], inputs: tuple[Dof, ...]
) -> Systems:
    """Return the equations of a machine as a function of parameters: affine where they are, else assembled."""
    general = MachineSystems(machine, pose, outputs, inputs)
    values = {name: machine.value(name) for name in names}
    slopes = matrix_derivatives(machine, names, pose)
    if slopes.damping is not None and np.abs(slopes.damping + np.swapaxes(slopes.damping, -1, -2)).max() < np.abs(
            slopes.damping).max():
        fail("parameters", "the density or a section of an elastic body that spins", "must be of a machine at standstill",
             remedy="take spin from the body while it is updated: its gyroscopic matrix has no place in a fit")
    affine = AffineSystem(general.system(values), slopes, tuple(values.values()))
    # Values apart from the start, by other factors for neighbours: an affine machine must agree there too.
    other = {n: v * (1.1 + 0.4 * (k % 3)) if v else 1e-3 for k, (n, v) in enumerate(values.items())}
    return affine if _are_equal(affine.system(other), general.system(other)) else general


def _are_equal(first: SecondOrderSystem, second: SecondOrderSystem) -> bool:
    for term in ("mass", "damping", "stiffness", "structural_damping"):
        a, b = getattr(first, term), getattr(second, term)
        a, b = (0.0 if m is None else m for m in (a, b))
        if np.abs(a - b).max() > _AFFINE_TOLERANCE * max(float(np.abs(b).max()), 1e-300):
            return False
    return True


@dataclass(frozen=True, eq=False)
class Agreement(NotebookText):
    """Agreement of a machine with a measurement: frequencies (Hz), MAC and damping of the paired modes, FRAC.

    candidates : all predicted modes, or None; modes : (n_measured,) which of them are paired with the measured ones;
    frac : (n_outputs, n_inputs) or None; nan where neither holds more than the measurement's noise: nothing to compare.
    """

    measured: FloatArray
    predicted: FloatArray
    candidates: Modes | None
    modes: np.ndarray
    mac: FloatArray
    measured_damping: FloatArray
    predicted_damping: FloatArray
    frac: FloatArray | None = None
    frf: Frf | None = None

    @property
    def partners(self) -> Modes | None:
        """The predicted modes paired with the measured ones, or None."""
        return None if self.candidates is None else self.candidates.selected(self.modes.tolist())

    @property
    def frequency_error(self) -> FloatArray:
        """Relative difference of frequency, (n_measured,)."""
        return np.asarray(self.predicted / self.measured - 1.0)

    @property
    def frac_words(self) -> tuple[str, str]:
        """Lowest and mean FRAC of the responses that hold more than noise."""
        if self.frac is None or np.isnan(self.frac).all():
            return "-", "-"
        return f"{np.nanmin(self.frac):.4f}", f"{np.nanmean(self.frac):.4f}"

    @property
    def silent(self) -> int:
        """Number of responses that hold no more than noise."""
        return 0 if self.frac is None else int(np.isnan(self.frac).sum())

    def __repr__(self) -> str:
        words = []
        if self.measured.size:
            words.append(f"{self.measured.size} modes, frequencies within {100 * np.abs(self.frequency_error).max():.3g} %, "
                         f"MAC >= {self.mac.min():.3f}")
        if self.frac is not None:
            words.append(f"FRAC >= {self.frac_words[0]}")
        return f"Agreement({', '.join(words)})"


@dataclass(frozen=True, eq=False)
class MachineUpdate(NotebookText):
    """Result: the updated `machine`, the `fit`, its `problem`, and the agreement of every set of targets before and after."""

    machine: Machine
    fit: ParameterFit
    problem: Problem
    all_before: tuple[Agreement, ...]
    all_after: tuple[Agreement, ...]

    @property
    def before(self) -> Agreement:
        """Agreement of the first set of targets at the start."""
        return self.all_before[0]

    @property
    def after(self) -> Agreement:
        """Agreement of the first set of targets at the result."""
        return self.all_after[0]

    def table(self) -> str:
        """Return frequencies and MAC before and after, FRAC, as text, one table for every set of targets."""
        several = len(self.all_before) > 1
        return "\n".join(line for k, pair in enumerate(zip(self.all_before, self.all_after, strict=True))
                         for line in ([f"set {k + 1}"] if several else []) + _comparison_lines(*pair))

    def report(self) -> str:
        """Return identifiability, fit report and agreement as text."""
        verdict = self.fit.identifiability
        return "\n\n".join([*([] if verdict is None else [verdict.table()]), self.fit.report(), self.table()])

    def __repr__(self) -> str:
        return f"MachineUpdate({self.machine.name!r}, {self.fit.status}, {self.after!r})"


def _comparison_lines(b: Agreement, a: Agreement) -> list[str]:
    lines = [" mode  measured Hz    before      %    MAC     after      %    MAC"] if b.measured.size else []
    for r in range(b.measured.size):
        lines.append(f"{r + 1:5d} {b.measured[r]:12.4f} {b.predicted[r]:9.4f} {100 * b.frequency_error[r]:6.2f} "
                     f"{b.mac[r]:6.3f} {a.predicted[r]:9.4f} {100 * a.frequency_error[r]:6.2f} {a.mac[r]:6.3f}")
    if b.frac is not None and a.frac is not None:
        lines.append(f"FRAC, lowest and mean: before {' '.join(b.frac_words)}, after {' '.join(a.frac_words)}"
                     + (f" ({a.silent} of {a.frac.size} responses hold no more than noise)" if a.silent else ""))
    return lines


def parameter(machine: Machine, path: str, **options: Any) -> Parameter:
    """Return the parameter of a path at the machine's value, on a logarithmic scale, within a factor 1000.

    A loss factor of zero moves on a linear scale, from zero to the largest that a file may hold, and so does a damping ratio.
    """
    value = machine.value(path)
    log = bool(options.pop("log", value > 0))
    bounds = {"low": value / _VALUE_RANGE_FACTOR, "high": value * _VALUE_RANGE_FACTOR} if log else {}
    if not log and ".loss_factor" in path:
        bounds = {"low": 0.0, "high": _MAX_LOSS_FACTOR}
    elif path == DAMPING_RATIO:
        bounds = {"low": bounds.get("low", 0.0), "high": min(bounds.get("high", _MAX_DAMPING_RATIO), _MAX_DAMPING_RATIO)}
    return Parameter(path, value, log=log, **{**bounds, **options})


def problem(
    machine: Machine, parameters: Sequence[Parameter | str], targets: Targets | Sequence[Targets],
    *, pose: Pose | Sequence[Pose | None] | None = None, sensitivities: str = "exact",
) -> Problem:
    """Return the updating problem of a machine; parameters as paths start at the machine's values.

    Several targets are measured at several poses, one for each, or all at one.

    Raises
    ------
    ToolpointError
        For unknown paths or points, a parameter whose value is not the machine's, and gravity or loads.
    """
    chosen = [parameter(machine, p) if isinstance(p, str) else p for p in parameters]
    if not chosen:
        fail("parameters", "none", "must be at least one path")
    for p in chosen:
        for name, factor in (("", 1.0), *p.links.items()):
            # A link that does not fit the machine would move its parameter at the first step.
            have, want = machine.value(name or p.name), factor * p.value
            if abs(have - want) > 1e-6 * max(abs(have), abs(want)):
                fail("parameters", f"{name or p.name} is {have:.8g} in the machine, {want:.8g} by the parameter",
                     "must agree at the start",
                     remedy="start from machine.with_values, or correct the value or the link's factor")
    names = [n for p in chosen for n in (p.name, *p.links)]
    sets = (targets,) if isinstance(targets, Targets) else tuple(targets)
    poses = (pose,) * len(sets) if pose is None or isinstance(pose, Mapping) else tuple(pose)
    if len(poses) != len(sets):
        fail("pose", f"{len(poses)} poses for {len(sets)} sets of targets", "must be one for all, or one for each")
    names = [n for p in chosen for n in (p.name, *p.links)]
    models = [_model(machine, names, part, pose_of_set) for part, pose_of_set in zip(sets, poses, strict=True)]
    return Problem(models, chosen, sets, sensitivities)


def _model(machine: Machine, names: Sequence[str], targets: Targets, pose: Pose | None) -> SystemModel:
    frf = targets.frf
    outputs = tuple(dict.fromkeys((*targets.dofs, *(frf.outputs if frf else ()))))
    # Modes alone need no input; the assembly needs one.
    driven = frf.inputs if frf else outputs[:1]
    held = systems(machine, names, pose, outputs=outputs, inputs=driven)
    count = 0 if targets.modes is None else targets.modes.count + _SPARE_MODE_COUNT
    return SystemModel(held, count, None if frf is None else frf.frequency, frf.outputs if frf else (),
                       driven if frf else (), machine.description.damping_ratio)


def default_targets(names: Sequence[str], modes: Modes | None, frf: Frf | None) -> Targets:
    """Return the targets where none are given: frequencies and shapes, and damping where `names` hold a damper.

    Shapes count point by point, not by MAC: one number a mode leaves as many unknowns as modes free to follow the frequencies
    alone, into whatever minimum is near.
    """
    damped = any(n == DAMPING_RATIO or ".damping." in f"{n}." or ".loss_factor." in f"{n}." for n in names)
    return Targets(None if modes is None else _with_idealisation(modes), frf, damping=damped and modes is not None,
                   shape=modes is not None and len(modes.dofs) > 2)


def _with_idealisation(modes: Modes) -> Modes:
    """Return modes whose shapes are known no better than a machine of rigid bodies and drawn points can have them."""
    if modes.shape_variance is None:
        return modes
    size = np.sqrt((np.abs(modes.shape) ** 2).mean(axis=-2, keepdims=True))
    return replace(modes, shape_variance=np.maximum(modes.shape_variance, (MIN_SHAPE_DEVIATION_RATIO * size) ** 2))


def update(
    machine: Machine, parameters: Sequence[Parameter | str], modes: Modes | None = None, *, frf: Frf | None = None,
    pose: Pose | Sequence[Pose | None] | None = None, targets: Targets | Sequence[Targets] | None = None,
    method: LeastSquares | None = None,
    limit: float | None = 0.5, least_influence: float = 0.02, restarts: int = 24, lead: Sequence[Modes | None] = (),
) -> MachineUpdate:
    """Return the machine updated to measured modes and frequency responses.

    Where both are given, the modes are fitted first: they lead from far away, while responses with narrow peaks have many
    local minima; then both with the logarithms of the responses, then as the targets say. Parameters that the data
    cannot determine stay where they are and are named; the rule is applied at the start and at the results: what
    shows only there is freed, and what does not show there goes back to where it was. Responses that this does not explain are
    fitted once more from starts over decades of stiffness.

    Parameters
    ----------
    machine : Machine
        Without gravity and loads.
    parameters : paths or Parameters
        For example ``joints.foundation.stiffness.rx``.
    modes, frf : Modes, Frf, optional
        Measured, with Dofs whose points the machine has.
    pose : mapping, or a sequence of them, optional
        Axis to position; one for all targets or one for each.
    targets : Targets, or a sequence of them, optional
        How well things are measured and what counts; given instead of `modes` and `frf`. Otherwise frequencies and shapes
        count, and damping where a damping parameter is among them. Several sets (poses, measurements) are fitted at once.
    method, limit, least_influence : see `updating.fit`
    restarts : int
        See `updating.fit_with_restarts`.
    lead : sequence of Modes or None, optional
        One for each set of targets: modes that lead to the start of the fit and do not count in its end, as those identified
        from the same responses.
    """
    if targets is None:
        targets = default_targets([p if isinstance(p, str) else p.name for p in parameters], modes, frf)
    elif modes is not None or frf is not None:
        fail("targets", "given beside modes or frf", "must hold them itself", remedy="Targets(modes, frf, ...)")
    task = problem(machine, parameters, targets, pose=pose)
    warn_of_energy_law(machine, None if not isinstance(pose, Mapping) else pose)
    _warn_of_silent_responses(task)
    start = _fit_leading_modes(machine, parameters, lead, pose, method, limit=limit, least_influence=least_influence,
                               restarts=restarts)
    thinned = _thin_lines(machine, parameters, task, pose)
    result = fit_on_all_lines(task, thinned, method, limit=limit, least_influence=least_influence, restarts=restarts,
                              start=start)
    if _is_unlike(task, result):
        result = fit_from_afar(task, thinned, result, method=method, limit=limit, least_influence=least_influence)
    result = look_again(task, result, method, sparse_problem=thinned)
    updated = machine.with_values(result.values)
    return MachineUpdate(updated, result, task, agreements(task, task.start), agreements(task, result.x))


def _is_unlike(task: Problem, result: ParameterFit) -> bool:
    """Whether a fit gives other responses, peaks elsewhere: what masses or places that are off do not; True for modes alone."""
    fracs = [agreement.frac for agreement in agreements(task, result.x) if agreement.frac is not None]
    return not fracs or any(np.nanmean(frac) < MIN_FRAC_OF_A_NEAR_FIT for frac in fracs if np.isfinite(frac).any())


def _warn_of_silent_responses(task: Problem) -> None:
    """Warn of measured responses that the model makes zero: they are left out of the fit.

    Where the measurement holds no more than its noise there, model and measurement agree, and nothing is said.
    """
    names = []
    for prediction, targets in zip(task.predictions(task.start), task.targets, strict=True):
        if prediction.frf is None or targets.frf is None:
            continue
        silent = silent_responses(prediction.frf) & _exceeds_noise(targets.frf, targets)
        names += [f"{targets.frf.outputs[o]} to {targets.frf.inputs[i]}" for o, i in np.argwhere(silent)]
    if names:
        warnings.warn(f"responses of {', '.join(names[:6])}{' and others' if len(names) > 6 else ''}: the model does not move "
                      "there at all, so they are left out of the fit; a direction or a joint may be missing in the model",
                      ToolpointWarning, stacklevel=3)


def _exceeds_noise(frf: Frf, targets: Targets) -> BoolArray:
    """Return the mask of responses (n_outputs, n_inputs), measured or predicted, above the noise of the measured ones."""
    return np.asarray((np.abs(frf.values) ** 2 / (2 * targets.frf_deviation() ** 2)).mean(axis=0) > _MIN_POWER_TO_NOISE)


def _thin_lines(machine: Machine, parameters: Sequence[Parameter | str], task: Problem,
                pose: Pose | Sequence[Pose | None] | None) -> Problem:
    """Return the problem with many lines of responses thinned where nothing resonates; itself where they are few."""
    thinned = [on_chosen_lines(targets) for targets in task.targets]
    if all(a is b for a, b in zip(thinned, task.targets, strict=True)):
        return task
    return problem(machine, parameters, thinned, pose=pose)


def _fit_leading_modes(machine: Machine, parameters: Sequence[Parameter | str], lead: Sequence[Modes | None],
                       pose: Pose | Sequence[Pose | None] | None, method: LeastSquares | None, *, limit: float | None,
                       least_influence: float,
                       restarts: int) -> FloatArray | None:
    """Return the coordinates of a fit to the leading modes, None where there are none."""
    leading = [k for k, modes in enumerate(lead) if modes is not None and modes.count]
    if not leading:
        return None
    targets = [Targets(modes, mac=len(modes.dofs) > 2) for modes in lead if modes is not None and modes.count]
    poses = [pose[k] for k in leading] if isinstance(pose, Sequence) else pose
    result = fit_in_stages(problem(machine, parameters, targets, pose=poses), method, limit, least_influence=least_influence,
                           restarts=restarts)
    return result.x if result.free else None


def agreements(task: Problem, x: FloatArray) -> tuple[Agreement, ...]:
    """Return the agreement of the model at coordinates x with every set of targets of a problem."""
    return tuple(_agreement(t, p) for t, p in zip(task.targets, task.predictions(x), strict=True))


def _agreement(targets: Targets, predicted: Prediction) -> Agreement:
    frac = None
    if targets.frf is not None and predicted.frf is not None:
        # In the quantity that was measured: noise of accelerometers would fill the lowest lines of the receptance.
        both = targets.frf, predicted.frf
        frac = correlation.frac(*(frf.converted_to(targets.frf_quantity) for frf in both))
        frac = np.where(np.any([_exceeds_noise(frf, targets) for frf in both], axis=0), frac, np.nan)
    if targets.modes is None or predicted.modes is None:
        none = np.zeros(0)
        return Agreement(none, none, None, np.zeros(0, int), none, none, none, frac, predicted.frf)
    pairs = track_modes(targets.modes, predicted.modes)
    partners = predicted.modes.selected(pairs.model.tolist())
    return Agreement(targets.modes.frequency, partners.frequency, predicted.modes, pairs.model, pairs.mac,
                     targets.modes.damping_ratio, partners.damping_ratio, frac, predicted.frf)
