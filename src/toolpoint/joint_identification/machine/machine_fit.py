r"""The machine that explains poles and shapes of all modes at once: places and stiffnesses of all joints, their damping, and
the masses as far as the data tell.

With the components' measured motions t (columns of all modes, covariance C), poles p with their covariance and knowledge of
the masses with standard deviations s,

.. math:: \chi^2 = \min_{x, \alpha} |C^{-1/2} (t - \alpha_r \phi_r(x))|^2 + |C_p^{-1/2} (p - p(x))|^2 + |x / s|^2

over the numbers x of all joints (`joint_forms`) and masses; the scale of every mode is free (variable projection: Golub,
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), but for its size where driving points and their calibration tell it
(`modal_scale`). The covariance of x is :math:`(J^T J)^{-1}`, times the misfit where noise does
not explain it. An undetermined number keeps its prior width, so its interval is that of no information.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import optimize, stats

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint._notebook import NotebookText
from toolpoint._threads import on_one_thread
from toolpoint.joint_identification.joints.stiffness import ComponentMass
from toolpoint.joint_identification.machine.joint_forms import JointForm
from toolpoint.joint_identification.machine.mode_pairs import exchange_crossings, match_modes, modes_of
from toolpoint.joint_identification.machine.rigid_machine import (
    COUPLED,
    MEASURED_RATIOS,
    ElasticJoint,
    RigidMachine,
    modal_constants,
    pole_slopes,
    solve_undamped,
)
from toolpoint.joint_identification.modes.modal_data import ModalData, mac_noise
from toolpoint.joint_identification.modes.modal_scale import MassScale, mean_scale, scale_root

NUMBER_STEP = 1e-6  # of differences, in every number
MIN_NOISE_PVALUE = 1e-3  # below, noise does not explain a misfit and intervals are widened
_MAX_REPAIRINGS = 3  # of modes, each with a new fit
_BOUND_MARGIN = 1e-3  # of its prior width, by which a bounded fit begins above the bound of a number


@dataclass(frozen=True, eq=False)
class MachineNumbers:
    """The numbers of a whole machine: forms of its joints and masses of its components, in the order of the tree, and the `law`
    of its damping."""

    parents: tuple[int, ...]
    forms: tuple[JointForm, ...]
    masses: tuple[ComponentMass, ...]
    law: str = COUPLED

    @property
    def slices(self) -> list[slice]:
        """Places of the numbers: one slice a joint, then one a component (empty where its mass is exact)."""
        sizes = [*(form.count for form in self.forms), *(int((m.deviations > 0).sum()) for m in self.masses)]
        ends = np.cumsum([0, *sizes])
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]

    @property
    def deviations(self) -> FloatArray:
        """Prior standard deviations of all numbers."""
        return np.concatenate([*(form.deviations for form in self.forms),
                               *(m.deviations[m.deviations > 0] for m in self.masses)])

    @property
    def lower(self) -> FloatArray:
        """Lower bounds of all numbers: those of damping; -inf elsewhere."""
        free = np.full(sum(int((m.deviations > 0).sum()) for m in self.masses), -np.inf)
        return np.concatenate([*(form.lower for form in self.forms), free])

    def joints(self, x: FloatArray) -> tuple[ElasticJoint, ...]:
        """Return the joints of these numbers."""
        return tuple(form.joint(x[part]) for form, part in zip(self.forms, self.slices, strict=False))

    def changed_masses(self, x: FloatArray) -> tuple[ComponentMass, ...]:
        """Return the masses of these numbers."""
        result = []
        for mass, part in zip(self.masses, self.slices[len(self.forms):], strict=True):
            by = np.zeros(7)
            by[mass.deviations > 0] = x[part]
            result.append(mass.changed(by) if by.any() else mass)
        return tuple(result)

    def machine(self, x: FloatArray) -> RigidMachine:
        """Return the machine of these numbers."""
        return RigidMachine(self.parents, self.joints(x), np.stack([mass.matrix for mass in self.changed_masses(x)]), self.law)


@dataclass(frozen=True, eq=False)
class MachineFit(NotebookText):
    """The fit: `model` centred on its result, `x` (zero but for masses), `covariance` of the numbers, misfit, `partner` (k,) of
    every measured mode among those of the machine, `mac` (k,), and what the machine says of the poles of the partners;
    `ratio_deviation` (k,): standard deviations of the measured damping ratios; `pole_gain` (n, k): change of the numbers per
    change of the logarithm of a measured frequency; `mac_noise` (k,): what noise alone takes from a MAC (`modal_data`)."""

    model: MachineNumbers
    x: FloatArray
    covariance: FloatArray
    chi2: float
    freedom: int
    partner: IndexArray
    mac: FloatArray
    frequency: FloatArray
    ratio: FloatArray
    widened: float
    converged: bool
    damping_excess: float
    ratio_deviation: FloatArray
    pole_gain: FloatArray
    mac_noise: FloatArray
    mass_scale: MassScale | None = None

    @property
    def probability(self) -> float:
        """p-value of the chi-squared misfit."""
        return float(stats.chi2.sf(self.chi2, max(self.freedom, 1)))

    @property
    def information(self) -> float:
        """Bayesian information criterion."""
        count = len(self.x) + (len(self.ratio) if self.model.law == MEASURED_RATIOS else 0)
        return float(self.chi2 + count * np.log(max(self.freedom + count, 2)))

    def __repr__(self) -> str:
        return f"MachineFit({len(self.x)} numbers, chi2 {self.chi2:.4g} on {self.freedom}, MAC {self.mac.min():.4f})"


@on_one_thread
def fit_machine(model: MachineNumbers, data: ModalData, rounds: int = 40, *, after: MachineFit | None = None,
                partner: IndexArray | None = None) -> MachineFit:
    """Return the fit of a machine to modal data, from the start of its forms, the masses of an earlier fit, and `partner` of
    every measured mode (the likest where left out).

    A fit centres the forms on its result but not the masses, whose priors stay where they were stated: to go on from it
    without naming it `after` would throw its masses away. A poor start may pair the modes wrongly: as long as the result
    looks more like other pairs, it is the next start.
    """
    start = np.zeros(len(model.deviations))
    if after is not None:
        masses = slice(model.slices[len(model.forms)].start, None)
        start[masses] = after.x[after.model.slices[len(model.forms)].start:]
    best = _fit_pairs(model, data, rounds, start, match_modes(model.machine(start), data)[0] if partner is None else partner)
    for _ in range(_MAX_REPAIRINGS):
        likest = exchange_crossings(match_modes(best.model.machine(best.x), data)[0], best.frequency, data.frequency)
        if (likest == best.partner).all():
            break
        repaired = _fit_pairs(best.model, data, rounds, best.x, likest)
        if repaired.chi2 >= best.chi2:
            break
        best = repaired
    return best


def _fit_pairs(model: MachineNumbers, data: ModalData, rounds: int, start: FloatArray, partner: IndexArray) -> MachineFit:
    """Return the fit with these pairs of modes."""
    prior = model.deviations
    rows = len(misfit(model.machine(start), data, partner)) + len(prior)

    def residual(x: FloatArray) -> FloatArray:
        try:
            return np.concatenate([misfit(model.machine(x), data, partner), x / prior])
        except np.linalg.LinAlgError:
            return np.full(rows, 1e6)

    def slopes(x: FloatArray) -> FloatArray:
        if data.is_complex:
            return np.concatenate([misfit_slopes(model, x, data, partner=partner), np.diag(1 / prior)])
        residuals_at_x = residual(x)
        return np.stack([(residual(x + step) - residuals_at_x) / NUMBER_STEP for step in NUMBER_STEP * np.eye(len(x))], axis=1)

    settings: dict[str, Any] = {"jac": slopes, "method": "trf", "x_scale": "jac", "xtol": 1e-8, "ftol": 1e-8, "gtol": 1e-8,
                                "max_nfev": rounds}
    solution = optimize.least_squares(residual, start, **settings)
    lower = model.lower
    if (solution.x < lower).any():
        # No joint gives energy off: only where the free fit says so is the bounded one asked, from just inside.
        inside = np.maximum(solution.x, lower + _BOUND_MARGIN * prior)
        solution = optimize.least_squares(residual, inside, bounds=(lower, np.inf), **settings)
    return _conclude(model, data, partner, solution)


def _conclude(model: MachineNumbers, data: ModalData, partner: IndexArray, solution: optimize.OptimizeResult) -> MachineFit:
    """Return the fit of a solution: covariance, misfit, pairs and poles."""
    x, jacobian = np.asarray(solution.x), np.asarray(solution.jac)
    machine = model.machine(x)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    covariance = np.linalg.pinv((jacobian / size).T @ (jacobian / size), rcond=1e-14, hermitian=True) / np.outer(size, size)
    count = len(x)
    inside = solution.fun[:-count]
    chi2 = float((solution.fun**2).sum())
    # Each number is also told by its prior, so rows less numbers are those of the data less the free scales.
    freedom = len(inside) - len(data.frequency) * (2 if data.is_complex else 1) - data.shares.shape[1]
    freedom -= _count_determined(jacobian, model.deviations)
    freedom -= len(data.frequency) if model.law == MEASURED_RATIOS else 0
    widened = 1.0
    if freedom > 0 and stats.chi2.sf(chi2, freedom) < MIN_NOISE_PVALUE:
        widened = chi2 / freedom
    matched, correlation = match_modes(machine, data)
    poles = _keep_measured_ratios(machine, modes_of(machine, data)[0][partner], data)
    pole_covariance = np.linalg.inv(np.einsum("kji,kjl->kil", data.spread, data.spread) + np.diag([0.0, 1e-12]))
    slices = model.slices
    centred = replace(model, forms=tuple(form.centred(x[part]) for form, part in zip(model.forms, slices, strict=False)))
    mass_numbers = x.copy()
    mass_numbers[:slices[len(model.forms) - 1].stop] = 0.0
    gain = covariance @ _frequency_rows(jacobian, data, count).T
    return MachineFit(centred, mass_numbers, covariance * widened, chi2, freedom, partner,
                      correlation[np.arange(len(partner)), partner],
                      np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles), widened,
                      bool(solution.status > 0) and bool((matched == partner).all()),
                      _damping_excess(inside, model, data), np.sqrt(pole_covariance[:, 1, 1]), gain, mac_noise(data),
                      mass_scale(machine, data, partner))


def _frequency_rows(jacobian: FloatArray, data: ModalData, count: int) -> FloatArray:
    """Return (k, n): the slopes of the misfit's poles, weighed by what a change of a logarithm of a frequency does to them."""
    k = len(data.frequency)
    end = len(jacobian) - count - (k if data.tells_masses else 0)
    rows = jacobian[end - 2 * k:end].reshape(k, 2, -1)
    return np.asarray(np.einsum("ki,kin->kn", data.spread[:, :, 0], rows))


def mass_scale(machine: RigidMachine, data: ModalData, partner: IndexArray) -> MassScale | None:
    """Return what the driving points say of all masses of a machine, None where the shapes have no scale."""
    if data.scale is None:
        return None
    constants, motions = _constants(machine, data)
    y = _whiten_motions(data, data.motions)
    scale = _scales(data, y, *np.linalg.qr(_columns(data, motions[:, :, partner])))
    return mean_scale(np.log(np.abs(scale) ** 2 * np.abs(constants[partner])), data.scale, data.calibration)


def _constants(machine: RigidMachine, data: ModalData) -> tuple[Array, Array]:
    """Return the modal constants (n,) and the motions that they belong to; undamped modes have unit modal mass."""
    if data.is_complex:
        poles, motions, vectors = machine.solve()
        return modal_constants(machine, poles, vectors), motions
    poles, real = solve_undamped(machine)
    return np.ones(len(poles)), real


def _scales(data: ModalData, y: FloatArray, q: FloatArray, r: FloatArray) -> Array:
    """Return the scale (k,) of every mode: what its motion is multiplied by to be the measured one."""
    scale = np.linalg.lstsq(r, q.T @ y, rcond=1e-12)[0]
    k = len(data.frequency)
    return np.asarray(scale[:k] + 1j * scale[k:2 * k] if data.is_complex else scale[:k])


def _damping_excess(residual: FloatArray, model: MachineNumbers, data: ModalData) -> float:
    """Return the misfit of the damping ratios over its degrees of freedom, 1 where chance explains it or nothing tells."""
    count = len(data.frequency)
    free = count - sum(form.sizes[2] for form in model.forms if form.start.twists.shape[1])
    end = len(residual) - (count if data.tells_masses else 0)
    total = float((residual[end - 2 * count:end].reshape(-1, 2)[:, 1] ** 2).sum())
    return total / free if free > 0 and stats.chi2.sf(total, free) < MIN_NOISE_PVALUE else 1.0


def _count_determined(jacobian: FloatArray, prior: FloatArray) -> int:
    """Return the number of numbers that the data determine better than their priors."""
    scaled = jacobian[:-len(prior)] * prior
    return int((np.linalg.svd(scaled, compute_uv=False) > 1.0).sum())


def misfit(machine: RigidMachine, data: ModalData, partner: IndexArray) -> FloatArray:
    """Return the whitened residuals of shapes (scales eliminated), poles and, where told, scales of the measured modes and
    their partners."""
    poles, motions = modes_of(machine, data)
    poles, motions = _keep_measured_ratios(machine, poles[partner], data), motions[:, :, partner]
    y = _whiten_motions(data, data.unmixed(poles))
    q, r = np.linalg.qr(_columns(data, motions))
    error = np.stack([np.log(np.abs(poles) / (2 * np.pi * data.frequency)), -poles.real / np.abs(poles) - data.ratio], axis=1)
    rows = [y - q @ (q.T @ y), np.einsum("kij,kj->ki", data.spread, error).ravel()]
    if data.tells_masses:
        constants = _constants(machine, data)[0][partner]
        rows.append(_scale_root(data) @ np.log(np.abs(_scales(data, y, q, r)) ** 2 * np.abs(constants)))
    return np.concatenate(rows)


def _keep_measured_ratios(machine: RigidMachine, poles: ComplexArray, data: ModalData) -> ComplexArray:
    """Return poles (k,) of the measured modes; where no joint explains their damping ratios, with those that were measured."""
    if machine.law != MEASURED_RATIOS:
        return poles
    return np.asarray(np.abs(poles) * (-data.ratio + 1j * np.sqrt(np.maximum(1 - data.ratio**2, 0.0))))


def _scale_root(data: ModalData) -> FloatArray:
    """Return the inverse Cholesky factor of the scales' covariance."""
    assert data.scale is not None and data.calibration is not None
    return scale_root(data.scale, data.calibration)


def misfit_slopes(model: MachineNumbers, x: FloatArray, data: ModalData, *, partner: IndexArray) -> FloatArray:
    """Return the slopes (rows, n) of `misfit` to the numbers of a model (shapes: Kaufman, BIT 15 (1975) 49)."""
    machine = model.machine(x)
    poles, motions, _ = machine.solve()
    q, r = np.linalg.qr(_columns(data, motions[:, :, partner]))
    d_poles, d_motions, d_constants = pole_slopes(machine, _neighbours(model, x, machine), NUMBER_STEP)
    p, d = _keep_measured_ratios(machine, poles[partner], data), d_poles[:, partner]
    if machine.law == MEASURED_RATIOS:
        d = p * (poles[partner].conj() * d).real / np.abs(p) ** 2
    k, scale = len(data.frequency), _scales(data, _whiten_motions(data, data.unmixed(p)), q, r)
    moved = d_motions[..., partner] * scale
    moved = moved if data.mixing is None else moved + data.mixed_by(d)
    flat = np.concatenate([moved.real, moved.imag], axis=3) if data.is_complex else moved.real
    shapes = np.concatenate([-root @ flat[:, c].transpose(2, 1, 0).reshape(len(root), -1) for c, root in enumerate(data.roots)])
    size = (p.conj() * d).real / np.abs(p) ** 2
    error = np.stack([size, (-d.real + p.real * size) / np.abs(p)], axis=2)
    shapes = np.concatenate([shapes, np.zeros((data.shares.shape[1], shapes.shape[1]))])
    rows = [shapes - q @ (q.T @ shapes), np.einsum("kij,nkj->kin", data.spread, error).reshape(2 * k, -1)]
    if data.tells_masses:
        d_scale = np.linalg.lstsq(r, q.T @ shapes, rcond=1e-12)[0]
        d_scale = d_scale[:k] + 1j * d_scale[k:2 * k] if data.is_complex else d_scale[:k]
        d_log = 2 * (d_scale / scale[:, None]).real + d_constants[:, partner].real.T
        rows.append(_scale_root(data) @ d_log)
    return np.concatenate(rows)


def _neighbours(model: MachineNumbers, x: FloatArray, machine: RigidMachine) -> list[RigidMachine]:
    """Return the machines a step further in every number; only what the number touches is made anew."""
    result = []
    for i, part in enumerate(model.slices):
        for number in range(part.start, part.stop):
            y = x.copy()
            y[number] += NUMBER_STEP
            if i < len(model.forms):
                joints = list(machine.joints)
                joints[i] = model.forms[i].joint(y[part])
                result.append(replace(machine, joints=tuple(joints)))
            else:
                masses = np.stack([mass.matrix for mass in model.changed_masses(y)])
                result.append(replace(machine, masses=masses))
    return result


def _whiten_motions(data: ModalData, motions: Array) -> FloatArray:
    """Return whitened motions, and the zeros that shares of other shapes are expected to be."""
    return np.concatenate([data.whitened(motions), np.zeros(data.shares.shape[1])])


def _columns(data: ModalData, motions: Array) -> FloatArray:
    """Return the columns of what is linear: scales of the modes, and shares of other shapes with their expectation."""
    scales, shares = _scale_columns(data, motions), data.shares
    count = shares.shape[1]
    return np.block([[scales, shares], [np.zeros((count, scales.shape[1])), np.eye(count)]]) if count else scales


def _scale_columns(data: ModalData, motions: Array) -> FloatArray:
    """Return the whitened columns that the scales of the modes stand before: real parts, then imaginary parts of the scales."""
    k, result = motions.shape[2], []
    for motion, root in zip(motions, data.roots, strict=True):
        rows = root.reshape(len(root), -1, 6)
        real = np.einsum("mri,ir->mr", rows[:, :k], motion.real)
        if data.is_complex:
            turned = np.einsum("mri,ir->mr", rows[:, k:], motion.real) - np.einsum("mri,ir->mr", rows[:, :k], motion.imag)
            real = np.concatenate([real + np.einsum("mri,ir->mr", rows[:, k:], motion.imag), turned], axis=1)
        result.append(real)
    return np.concatenate(result)
