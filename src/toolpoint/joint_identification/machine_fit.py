r"""The machine that explains poles and shapes of all modes at once: places and stiffnesses of all joints, their damping, and
the masses as far as the data tell.

With the components' measured motions t (columns of all modes, covariance C), poles p with their covariance and knowledge of
the masses with standard deviations s,

.. math:: \chi^2 = \min_{x, \alpha} |C^{-1/2} (t - \alpha_r \phi_r(x))|^2 + |C_p^{-1/2} (p - p(x))|^2 + |x / s|^2

over the numbers x of all joints (`joint_forms`) and masses; the scale of every mode is free (variable projection: Golub,
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). The covariance of x is :math:`(J^T J)^{-1}`, times the misfit where noise does
not explain it. An undetermined number keeps its prior width, so its interval says that nothing is known of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import optimize, stats

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.joint_forms import JointForm
from toolpoint.joint_identification.rigid_machine import ElasticJoint, RigidMachine, pole_slopes, solve_undamped
from toolpoint.joint_identification.stiffness import ComponentMass

STEP = 1e-6
# Poles of measured responses follow a model of viscous modes: no better than this, whatever their noise.
FREQUENCY_FLOOR, DAMPING_FLOOR, SHAPE_FLOOR = 1e-5, 6e-4, 1e-5
_IMPROBABLE = 1e-3
_PAIRINGS = 3


@dataclass(frozen=True, eq=False)
class ModalData:
    """What was measured.

    motions : (c, 6, k), real or complex, of the components; roots : one (6 m, 6 m) a component, inverse Cholesky factors of
    the covariance of its columns (m = k, or 2 k: real parts, then imaginary parts), column by column; grams : (c, 6, 6), sums
    over the points, by which shapes are compared; frequency (k,) Hz, ratio (k,); spread : (k, 2, 2), inverse Cholesky factors
    of the covariance of (ln frequency, ratio).
    """

    motions: Array
    roots: tuple[FloatArray, ...]
    grams: FloatArray
    frequency: FloatArray
    ratio: FloatArray
    spread: FloatArray

    @property
    def is_complex(self) -> bool:
        """Whether the shapes are complex."""
        return bool(np.iscomplexobj(self.motions))


@dataclass(frozen=True, eq=False)
class MachineNumbers:
    """The numbers of a whole machine: forms of its joints and masses of its components, in the order of the tree."""

    parents: tuple[int, ...]
    forms: tuple[JointForm, ...]
    masses: tuple[ComponentMass, ...]

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
        return RigidMachine(self.parents, self.joints(x), np.stack([mass.matrix for mass in self.changed_masses(x)]))


@dataclass(frozen=True, eq=False)
class MachineFit(NotebookText):
    """The fit: `model` centred on its result, `x` (zero but for masses), `covariance` of the numbers, misfit, `partner` (k,) of
    every measured mode among those of the machine, `mac` (k,), and what the machine says of the poles of the partners."""

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

    @property
    def probability(self) -> float:
        """Of a misfit so large by noise alone."""
        return float(stats.chi2.sf(self.chi2, max(self.freedom, 1)))

    @property
    def information(self) -> float:
        """Bayesian information criterion."""
        return float(self.chi2 + len(self.x) * np.log(max(self.freedom + len(self.x), 2)))

    def __repr__(self) -> str:
        return f"MachineFit({len(self.x)} numbers, chi2 {self.chi2:.4g} on {self.freedom}, MAC {self.mac.min():.4f})"


def fit_machine(model: MachineNumbers, data: ModalData, rounds: int = 40) -> MachineFit:
    """Return the fit of a machine to modal data, from the start of its forms.

    A poor start may pair the modes wrongly: as long as the result looks more like other pairs, it is the next start.
    """
    best = _fit_pairs(model, data, rounds)
    for _ in range(_PAIRINGS):
        if (match_modes(best.model.machine(best.x), data)[0] == best.partner).all():
            break
        again = _fit_pairs(best.model, data, rounds)
        if again.chi2 >= best.chi2:
            break
        best = again
    return best


def _fit_pairs(model: MachineNumbers, data: ModalData, rounds: int) -> MachineFit:
    """Return the fit with the pairs of modes as they are at the start."""
    prior = model.deviations
    partner = match_modes(model.machine(np.zeros(len(prior))), data)[0]
    rows = len(misfit(model.machine(np.zeros(len(prior))), data, partner)) + len(prior)

    def residual(x: FloatArray) -> FloatArray:
        try:
            return np.concatenate([misfit(model.machine(x), data, partner), x / prior])
        except np.linalg.LinAlgError:
            return np.full(rows, 1e6)

    def slopes(x: FloatArray) -> FloatArray:
        if data.is_complex:
            return np.concatenate([misfit_slopes(model, x, data, partner=partner), np.diag(1 / prior)])
        start = residual(x)
        return np.stack([(residual(x + step) - start) / STEP for step in STEP * np.eye(len(x))], axis=1)

    solution = optimize.least_squares(residual, np.zeros(len(prior)), jac=slopes, method="trf", x_scale="jac",
                                      xtol=1e-8, ftol=1e-8, gtol=1e-8, max_nfev=rounds)
    return _judged(model, data, partner, solution)


def _judged(model: MachineNumbers, data: ModalData, partner: IndexArray, solution: optimize.OptimizeResult) -> MachineFit:
    x, jacobian = np.asarray(solution.x), np.asarray(solution.jac)
    machine = model.machine(x)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    covariance = np.linalg.pinv((jacobian / size).T @ (jacobian / size), rcond=1e-14, hermitian=True) / np.outer(size, size)
    count = len(x)
    inside = solution.fun[:-count]
    chi2 = float((solution.fun**2).sum())
    # Each number is also told by its prior, so rows less numbers are those of the data less the free scales.
    freedom = len(inside) - len(data.frequency) * (2 if data.is_complex else 1)
    freedom -= _told(jacobian, model.deviations)
    widened = 1.0
    if freedom > 0 and stats.chi2.sf(chi2, freedom) < _IMPROBABLE:
        widened = chi2 / freedom
    matched, alike = match_modes(machine, data)
    poles = modes_of(machine, data)[0][partner]
    slices = model.slices
    centred = replace(model, forms=tuple(form.centred(x[part]) for form, part in zip(model.forms, slices, strict=False)))
    rest = x.copy()
    rest[:slices[len(model.forms) - 1].stop] = 0.0
    return MachineFit(centred, rest, covariance * widened, chi2, freedom, partner, alike[np.arange(len(partner)), partner],
                      np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles), widened,
                      bool(solution.status > 0) and bool((matched == partner).all()),
                      _damping_excess(inside, model, len(partner)))


def _damping_excess(residual: FloatArray, model: MachineNumbers, count: int) -> float:
    """Return the misfit of the damping ratios over its degrees of freedom, 1 where chance explains it or nothing tells."""
    free = count - sum(form.sizes[2] for form in model.forms if form.start.twists.shape[1])
    total = float((residual[-2 * count:].reshape(-1, 2)[:, 1] ** 2).sum())
    return total / free if free > 0 and stats.chi2.sf(total, free) < _IMPROBABLE else 1.0


def modes_of(machine: RigidMachine, data: ModalData) -> tuple[ComplexArray, Array]:
    """Return poles and motions to compare with measured ones: complex modes, or undamped ones where those are real."""
    if data.is_complex:
        poles, motions, _ = machine.solve()
        return poles, motions
    return solve_undamped(machine)


def _told(jacobian: FloatArray, prior: FloatArray) -> int:
    """Return how many numbers the data tell better than their priors."""
    scaled = jacobian[:-len(prior)] * prior
    return int((np.linalg.svd(scaled, compute_uv=False) > 1.0).sum())


def misfit(machine: RigidMachine, data: ModalData, partner: IndexArray) -> FloatArray:
    """Return the whitened residuals of shapes (scales eliminated) and poles of the measured modes and their partners."""
    poles, motions = modes_of(machine, data)
    poles, motions = poles[partner], motions[:, :, partner]
    y = _measured(data)
    q = np.linalg.qr(_scale_columns(data, motions))[0]
    error = np.stack([np.log(np.abs(poles) / (2 * np.pi * data.frequency)), -poles.real / np.abs(poles) - data.ratio], axis=1)
    return np.concatenate([y - q @ (q.T @ y), np.einsum("kij,kj->ki", data.spread, error).ravel()])


def misfit_slopes(model: MachineNumbers, x: FloatArray, data: ModalData, *, partner: IndexArray) -> FloatArray:
    """Return the slopes (rows, n) of `misfit` to the numbers of a model (shapes: Kaufman, BIT 15 (1975) 49)."""
    machine = model.machine(x)
    poles, motions, _ = machine.solve()
    q, r = np.linalg.qr(_scale_columns(data, motions[:, :, partner]))
    scale = np.linalg.lstsq(r, q.T @ _measured(data), rcond=1e-12)[0]
    k = len(data.frequency)
    scale = scale[:k] + 1j * scale[k:] if data.is_complex else scale
    d_poles, d_motions = pole_slopes(machine, _neighbours(model, x, machine), STEP)
    moved = d_motions[..., partner] * scale
    flat = np.concatenate([moved.real, moved.imag], axis=3) if data.is_complex else moved.real
    shapes = np.concatenate([-root @ flat[:, c].transpose(2, 1, 0).reshape(len(root), -1) for c, root in enumerate(data.roots)])
    p, d = poles[partner], d_poles[:, partner]
    size = (p.conj() * d).real / np.abs(p) ** 2
    error = np.stack([size, (-d.real + p.real * size) / np.abs(p)], axis=2)
    return np.concatenate([shapes - q @ (q.T @ shapes), np.einsum("kij,nkj->kin", data.spread, error).reshape(2 * k, -1)])


def _neighbours(model: MachineNumbers, x: FloatArray, machine: RigidMachine) -> list[RigidMachine]:
    """Return the machines a step further in every number; only what the number touches is made anew."""
    result = []
    for i, part in enumerate(model.slices):
        for at in range(part.start, part.stop):
            y = x.copy()
            y[at] += STEP
            if i < len(model.forms):
                joints = list(machine.joints)
                joints[i] = model.forms[i].joint(y[part])
                result.append(replace(machine, joints=tuple(joints)))
            else:
                masses = np.stack([mass.matrix for mass in model.changed_masses(y)])
                result.append(replace(machine, masses=masses))
    return result


def _measured(data: ModalData) -> FloatArray:
    """Return the whitened motions of all components, column by column."""
    parts = []
    for motion, root in zip(data.motions, data.roots, strict=True):
        columns = np.concatenate([motion.real, motion.imag], axis=1) if data.is_complex else motion
        parts.append(root @ columns.T.ravel())
    return np.concatenate(parts)


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


def match_modes(machine: RigidMachine, data: ModalData) -> tuple[IndexArray, FloatArray]:
    """Return (partner (k,) of every measured mode among the machine's, MAC (k, n) by the motion of the points)."""
    poles, motions = modes_of(machine, data)
    cross = np.einsum("cik,cij,cjn->kn", data.motions.conj(), data.grams, motions, optimize=True)
    first = np.einsum("cik,cij,cjk->k", data.motions.conj(), data.grams, data.motions, optimize=True).real
    second = np.einsum("cin,cij,cjn->n", motions.conj(), data.grams, motions, optimize=True).real
    alike = np.abs(cross) ** 2 / np.outer(first, second)
    away = np.abs(np.log(np.outer(2 * np.pi * data.frequency, 1 / np.abs(poles))))
    rows, columns = optimize.linear_sum_assignment(-alike + 0.2 * np.minimum(away, 2.0))
    partner = np.full(len(data.frequency), -1)
    partner[rows] = columns
    return partner, alike


def pole_spread(frequency: FloatArray, ratio: FloatArray, covariance: FloatArray | None) -> FloatArray:
    """Return inverse Cholesky factors (k, 2, 2) of the covariance of (ln frequency, damping ratio), with the floors."""
    result = np.zeros((len(frequency), 2, 2))
    for r, f in enumerate(frequency):
        known = np.diag([1e-6, 1e-4]) ** 2 if covariance is None else covariance[r] / np.array([[f * f, f], [f, 1.0]])
        if np.linalg.eigvalsh(known)[0] < 0:
            known = np.diag(np.maximum(np.diag(known), 1e-12))
        floor = np.array([FREQUENCY_FLOOR, DAMPING_FLOOR * max(abs(float(ratio[r])), 1e-3)])
        result[r] = np.linalg.inv(np.linalg.cholesky(known + np.diag(floor) ** 2))
    return result


def covariance_roots(wholes: Sequence[FloatArray], grams: FloatArray, motions: Array) -> tuple[FloatArray, ...]:
    """Return the inverse Cholesky factors of covariances (m, 6, m, 6), with the floor of the shapes.

    No casting is perfectly rigid: a motion of every component of its own, by a share of the largest motion of a mode.
    """
    result = []
    power = np.einsum("cik,cij,cjk->ck", motions.conj(), grams, motions, optimize=True).real
    size = power.max(axis=0)
    for whole, gram in zip(wholes, grams, strict=True):
        flat = whole.reshape(6 * len(whole), -1)
        floor = SHAPE_FLOOR**2 * np.kron(np.diag(np.tile(size, len(whole) // len(size))), np.linalg.inv(gram))
        flat = (flat + flat.T) / 2 + (floor + floor.T) / 2
        # Columns and units of very different size: scaled to ones before the factor is taken.
        scale = np.sqrt(np.maximum(np.diag(flat), 1e-300))
        unit = flat / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
        result.append(np.linalg.inv(np.linalg.cholesky(unit)) / scale)
    return tuple(result)
