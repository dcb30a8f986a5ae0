"""Update of a machine to measurements at one pose or several, with the posterior of its parameters where requested."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.description import parameters
from toolpoint.modal_identification import identify, real_modes
from toolpoint.signals.doubts import question
from toolpoint.studies.measured.channel_doubts import question_responses, question_shapes, question_unit
from toolpoint.studies.measured.machine_update import MachineUpdate, default_targets, update
from toolpoint.studies.measured.model_correlation import correlate
from toolpoint.updating import ParameterFit
from toolpoint.updating.fits.left_alone import name_effects
from toolpoint.updating.fits.misfit import question_misfit
from toolpoint.updating.fits.sampler import Samples, require_emcee, sample
from toolpoint.updating.models.system_model import DAMPING_RATIO
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.correlation import mac

MIN_UPDATED_MAC = 0.95  # MAC below which an updated machine does not have a measured mode
SCALE_REMARK = ("modes tell stiffnesses over masses: where all masses are 1 % off, all stiffnesses are 1 % off too, and no "
                "interval "
                "holds that; measured responses tell both")


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurement at one pose: modes, responses or both; `pose` None is the reference pose.

    Examples
    --------
    >>> Measurement(pose={"X": 0.2}).label
    'X = 0.2'
    """

    modes: Modes | None = None
    frf: Frf | None = None
    pose: Mapping[str, float] | None = None

    @property
    def label(self) -> str:
        """The pose in words, empty at the reference pose."""
        return ", ".join(f"{axis} = {value:g}" for axis, value in (self.pose or {}).items())


@dataclass(frozen=True, eq=False)
class MeasuredUpdate(NotebookText):
    """Update of a machine to measurements, with the machine before it.

    samples : of the posterior, None where none were requested; doubts : about channels of the test, beside the updated machine;
    notes : what the intervals do not cover.
    """

    start_machine: Machine
    update: MachineUpdate
    measured: tuple[Measurement, ...]
    samples: Samples | None = None
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def machine(self) -> Machine:
        """The updated machine."""
        return self.update.machine

    def table(self) -> str:
        """Return the doubts first, identifiability, fit report, agreement, and the samples, as text."""
        lines = [*mark_notes(self.doubts), self.update.report(),
                 *(f"note: {line}" for line in self.notes)]
        return "\n".join(lines) + ("" if self.samples is None else "\n\n" + self.samples.table())

    def to_dict(self) -> dict[str, Any]:
        """Return the fitted values (SI) as plain data, with the intervals of the samples where there are any."""
        fit, drawn = self.update.fit, self.samples
        return {"values": fit.values, "status": fit.status, "doubts": list(self.doubts),
                "notes": list(self.notes)} | ({} if drawn is None else {
            "samples": drawn.status, "intervals": {name: drawn.interval(name) for name in drawn.names}})


def pair_measurements(modes: Sequence[Modes], responses: Sequence[Frf], poses: Sequence[Mapping[str, float]] = ()
                      ) -> list[Measurement]:
    """Return the measurements of modes, responses and poses in their order.

    Parameters
    ----------
    modes, responses : sequences of Modes and of Frf
        With several poses one of each kind for every pose, or none. At one pose (or none: the reference pose) responses are
        joined by the modes where there is one measurement of them; more modes are repeated measurements.
    poses : sequence of poses

    Raises
    ------
    ToolpointError
        Without any measurement, and where modes or responses are not as many as the poses.

    Examples
    --------
    >>> modes = Modes([80.0], [0.02], [[0.1]], ["tool:+x"])
    >>> [part.label for part in pair_measurements([modes, modes], [], [{"X": 0.0}, {"X": 0.2}])]
    ['X = 0', 'X = 0.2']
    """
    if not modes and not responses:
        raise ToolpointError("update: neither `modes` nor `frf` given; needs at least one measurement")
    several = len(poses) > 1
    for name, parts in (("modes", modes), ("frf", responses)):
        if several and parts and len(parts) != len(poses):
            raise ToolpointError(f"`{name}`: {len(parts)} files for {len(poses)} poses; must be one for each, in their order, "
                                 f"or none (`{name}` a.h5 `pose` X=0 `{name}` b.h5 `pose` X=0.2)")
    # Several poses: one measurement for each, of modes, responses or both.
    if several:
        return [Measurement(*parts) for parts in itertools.zip_longest(modes, responses, poses)]
    pose = poses[0] if poses else None
    # One of each belongs together, as two views of one test.
    if len(modes) == len(responses) == 1:
        return [Measurement(modes[0], responses[0], pose)]
    return [*(Measurement(part, None, pose) for part in modes), *(Measurement(None, part, pose) for part in responses)]


def update_machine(machine: Machine, measured: Sequence[Measurement], paths: Sequence[str] = (), *, samples: int = 0,
                    seed: int = 1, what: str = "measurement") -> MeasuredUpdate:
    """Update a machine to measurements; parameters that the data do not determine stay as they are.

    Parameters
    ----------
    machine : Machine
        With the measured points among its own.
    measured : sequence of Measurement
    paths : sequence of str
        Parameters to update, ``joints.NAME.stiffness.rx``; where none is named all stiffnesses of the joints, and by
        responses their dampers and loss factors too (or the machine's damping ratio): with a guessed damping no stiffness
        makes the peaks as high as measured.
    samples : int
        Steps of every walker in the posterior, 0 for none (extra 'bayes').
    seed : int
        Of the samples.
    what : str
        What to call the measurements in messages.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.machine import assemble
    >>> from toolpoint.studies import Measurement
    >>> from toolpoint.vibration import eigen
    >>> truth = machine.with_values({"joints.slide.stiffness.x": 1.2e7})
    >>> modes = eigen.solve_undamped(assemble(truth)).with_damping(0.03)
    >>> result = update_machine(machine, [Measurement(modes)], ["joints.slide.stiffness.x"])
    >>> round(result.machine.value("joints.slide.stiffness.x") / 1.2e7, 4)
    1.0
    """
    if samples:
        require_emcee()
    _check_points(machine, measured, what)
    paired = tuple(_drop_lonely_modes(machine, part) for part in measured)
    names = list(paths) or default_paths(machine, responses=any(part.frf is not None for part in measured))
    targets = [default_targets(names, part.modes, part.frf) for part in paired]
    result = update(machine, names, targets=targets, pose=[part.pose for part in paired],
                    lead=[_leading_modes(machine, part) for part in paired])
    notes = name_effects(result.problem, result.fit)
    if result.fit.free and not any(part.frf is not None for part in paired):
        notes += (SCALE_REMARK,)
    return MeasuredUpdate(machine, result, paired, _samples(result, samples, seed) if samples else None,
                          _doubts(result, paired),
                         notes)


def default_paths(machine: Machine, *, responses: bool) -> list[str]:
    """Return the parameters updated where none is named.

    Stiffnesses of the joints; by responses also every damper that is there and every loss factor, also of joints that have
    none yet, or the damping ratio that stands in their place for all modes.
    """
    paths = list(parameters(machine.description))
    joints = [path for path in paths if path.startswith("joints.")]
    damping = [path for path in joints if ".loss_factor" in path or (".damping." in path and machine.value(path) > 0)]
    if machine.description.damping_ratio is not None:
        damping = [DAMPING_RATIO]
    return [path for path in paths if ".stiffness." in path] + (damping if responses else [])


def _doubts(result: MachineUpdate, measured: Sequence[Measurement]) -> tuple[Doubt, ...]:
    """Return the doubts about the channels, each once: responses by themselves, all beside the updated machine.

    The machine before its update is no reference: its errors are what the update removes.
    """
    lines: list[Doubt] = []
    for part, start_agreement in zip(measured, result.all_before, strict=True):
        if part.frf is not None and start_agreement.frf is not None:
            lines += question_unit(part.frf, start_agreement.frf)
    for part, agreement, targets in zip(measured, result.all_after, result.problem.targets, strict=True):
        if part.modes is not None and agreement.partners is not None:
            # Only the measured directions of the predicted shapes can be compared.
            partners = replace(agreement.partners, shape=agreement.partners.shape_at(part.modes.dofs), dofs=part.modes.dofs)
            lines += question_shapes(part.modes, partners)
            lines += _question_likeness(part.modes, partners)
        if part.frf is not None and agreement.frf is not None:
            missed, ratio = question_misfit(targets, agreement.frf), result.machine.description.damping_ratio
            # One ratio for all modes is the likely reason of a misfit, and joints with loss factors the remedy.
            if missed and ratio:
                missed += (Doubt("damping_ratio", f"one ratio, {100 * ratio:.3g} %, stands for the damping of all modes",
                                 f"give the joints a loss_factor ({2 * ratio:.2g} to begin with) in its place: it is updated "
                                 "with the stiffnesses, each joint's for itself"),)
            lines += (*missed, *question(part.frf), *question_responses(part.frf, agreement.frf))
    return tuple(dict.fromkeys(lines))


def _question_likeness(measured: Modes, partners: Modes) -> list[Doubt]:
    """Return doubts about measured modes that the updated machine does not have: a fit may have ended in another minimum."""
    if len(measured.dofs) < 3:
        return []
    likeness = np.diagonal(mac(measured.shape, partners.shape))
    # Noise alone lowers a MAC by about its share of the shape's power.
    noise = np.zeros(measured.count) if measured.shape_variance is None else (
        measured.shape_variance.sum(axis=0) / np.maximum((np.abs(measured.shape) ** 2).sum(axis=0), 1e-300))
    return [Doubt(f"mode at {frequency:.4g} Hz", f"its shape is not that of the updated machine (MAC {value:.2f}): the fit may "
                  "have ended in another minimum, or the machine lacks what moves there", "look at both shapes (correlate), "
                  "and start from other values", figure=float(1 - value))
            for frequency, value in zip(measured.frequency, likeness + 2 * noise, strict=True) if value < MIN_UPDATED_MAC]


def _leading_modes(machine: Machine, part: Measurement) -> Modes | None:
    """Return the modes of responses that came without any: narrow peaks alone have many local minima, modes lead past them."""
    if part.modes is not None or part.frf is None:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ToolpointWarning)  # they lead only; what they are worth shows in the fit
            modes = identify(part.frf).modes
            return _drop_lonely_modes(machine, replace(part, modes=modes)).modes
    except ToolpointError:
        return None  # without modes the responses find their own way, with restarts


def unscale_covariance(fit: ParameterFit) -> ParameterFit:
    """Return a fit with the covariance that the assumed deviations give, as samples see it, not scaled by the misfit."""
    if not fit.scaled or not fit.reduced_chi_square > 0:
        return fit
    return replace(fit, covariance=fit.covariance / fit.reduced_chi_square, scaled=False)


def _check_points(machine: Machine, measured: Sequence[Measurement], what: str) -> None:
    """Refuse measured points that the machine does not have, with the place where they can be written."""
    labels = [dof for part in measured for noun in (part.modes, part.frf) if noun is not None
              for dof in (noun.dofs if isinstance(noun, Modes) else (*noun.outputs, *noun.inputs))]
    machine_points = set(machine.description.points)
    missing_points = list(dict.fromkeys(str(dof.point) for dof in labels if str(dof.point) not in machine_points))
    if missing_points:
        names = ", ".join(missing_points[:6]) + (f" and {len(missing_points) - 6} more" if len(missing_points) > 6 else "")
        raise ToolpointError(
            f"{what}: measured at {names}; {machine.name} has no such points in its "
            f"section 'points:' (it has {', '.join(machine.description.points) or 'none'}). Write them there, each with its "
            f"body and place, for example  {missing_points[0]}: {{body: {next(iter(machine.description.bodies))}, at: [0, 0, "
            f"0]}}, or "
            "start from the machine file of 'toolpoint joints --machine', which holds all measured points; "
            "'toolpoint correlate --geometry' tells which measured point is which of the machine's")


def _drop_lonely_modes(machine: Machine, measured: Measurement) -> Measurement:
    """Leave out, with a warning, the measured modes that a machine of fewer modes has no partner for."""
    if measured.modes is None or measured.modes.count <= machine.size:
        return measured
    # Every measured mode is paired with its likeliest, however unlike: those left over are the ones to leave out.
    pairs = correlate(machine, real_modes(measured.modes), pose=measured.pose, lowest_mac=0.0, frequency_shift=np.inf).pairs
    kept = sorted(int(i) for i, _ in pairs.pairs)
    left_out = ", ".join(f"{measured.modes.frequency[i]:.5g}" for i in range(measured.modes.count) if i not in kept)
    warnings.warn(f"{measured.modes.count} measured modes for a machine of {machine.size}: the measured modes at {left_out} Hz "
                  "look least like any of the machine's and are left out", ToolpointWarning, stacklevel=2)
    return replace(measured, modes=measured.modes.selected(kept))


def _samples(result: MachineUpdate, steps: int, seed: int) -> Samples:
    if not result.fit.free:
        raise ToolpointError("--samples: no parameter was moved; a posterior needs at least one that the data can tell "
                             "(measure more, or name other parameters)")
    return sample(result.problem, unscale_covariance(result.fit), np.random.default_rng(seed), steps=steps)
