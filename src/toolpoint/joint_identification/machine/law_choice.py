r"""Law of damping that the measured modes obey, by the evidence of the fits of a whole machine.

Joints that dissipate unequally make shapes complex; shapes that are real, although joints dissipate unequally, speak for modes
that are damped one by one. The laws, each with its numbers (:math:`U_{jr}` the strain energy of joint j in mode r):

- ``coupled``: a loss factor a joint, :math:`K_j (1 + i \eta_j)`, complex shapes; with viscous damping :math:`\tau_j K_j` beside
  it where the data ask for it;
- ``energy``: real shapes, :math:`\zeta_r = \sum_j \eta_j U_{jr} / 2 \sum_j U_{jr}` (Ewins, Modal Testing, 2nd ed., section
  2.5);
- ``measured``: real shapes, :math:`\zeta_r` as measured, a number for every mode.

Laws are compared by twice the logarithm of their Bayes factor in Laplace's approximation (Kass, Raftery, J. Am. Stat. Assoc. 90
(1995) 773): :math:`\chi^2 - \ln \det (C S^{-2})`, C the covariance of the numbers and S their prior widths, those of damping by
the measured ratios. A law with a number for every mode pays for each by how sharply the data know it. Where even the best law
leaves more than noise, differences count in units of what it leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.joint_identification.machine.machine_fit import MIN_NOISE_PVALUE, MachineFit, MachineNumbers, fit_machine
from toolpoint.joint_identification.machine.rigid_machine import COUPLED, ENERGY, MEASURED_RATIOS
from toolpoint.joint_identification.modes.modal_data import ModalData

# Difference of the evidence up to which the data do not distinguish two laws (Kass, Raftery: 10 is very strong evidence).
DECISIVE_EVIDENCE = 10.0
MIN_MODAL_DAMPING = 1e-9  # of all modes: computed shapes without damping have a law too
# Rounds after which a fit is judged, and its misfit over that of a good fit from which it is given up.
_FIRST_ROUNDS, _HOPELESS_RATIO = 10, 10.0
_MIN_DAMPING_DEVIATIONS = 3.0  # standard deviations: below, a damping number does not differ from zero
LAW_NAMES = {
    (COUPLED, False): "a loss factor a joint, complex shapes", (COUPLED, True): "loss factors and viscous damping of joints, "
    "complex shapes", (ENERGY, False): "loss factors of joints by their share of every mode's strain energy, real shapes",
    (ENERGY, True): "loss factors and viscous damping of joints by their share of every mode's strain energy, real shapes",
    (MEASURED_RATIOS, False): "measured damping ratio of every mode, real shapes"}


@dataclass(frozen=True, eq=False)
class LawChoice:
    """Law of damping of a machine, with the evidence for it.

    evidence : twice the logarithm of the Bayes factor by which every law that was tried is behind the chosen one; rivals : fits
    of the laws that the data do not distinguish from it.
    """

    law: str
    is_viscous: bool
    evidence: Mapping[str, float]
    rivals: Sequence[MachineFit] = field(default=())

    @property
    def name(self) -> str:
        """The law in words."""
        return LAW_NAMES[self.law, self.is_viscous]

    @property
    def note(self) -> str:
        """The chosen law, with the evidence for it."""
        others = [f"{name} ({value:+.3g})" for name, value in self.evidence.items() if name != self.name]
        text = f"damping: {self.name}"
        if not others:
            return text
        rivals = [name_of(fit.model) for fit in self.rivals]
        ending = f"; the data do not tell it from {' or '.join(rivals)}: intervals of damping cover both" if rivals else ""
        return f"{text}, chosen against {', '.join(others)}; 10 is very strong{ending}"

    def to_dict(self) -> dict[str, object]:
        """Return it as plain data."""
        return {"law": self.law, "viscous": self.is_viscous, "name": self.name, "evidence": dict(self.evidence),
                "alike": [name_of(fit.model) for fit in self.rivals]}


def name_of(model: MachineNumbers) -> str:
    """Return the law of a model in words."""
    return LAW_NAMES[model.law, _is_viscous(model)]


def choose_law(fit: MachineFit, data: ModalData, typical: float, *, richer: Callable[[MachineFit], MachineFit]
               ) -> tuple[MachineFit, LawChoice]:
    """Return the fit by the law that the data speak for, and the choice.

    Parameters
    ----------
    fit : MachineFit
        By the coupled law.
    data : ModalData
    typical : float
        Relaxation time (s) of a common viscous joint, the prior width where viscous damping is asked.
    richer : function
        The coupled fit with more numbers (dampers, full stiffness matrices) where the data ask for them.
    """
    energy = _fit_energy_law(fit, data)
    if max(fit.probability, energy.probability) < MIN_NOISE_PVALUE:
        enriched = _drop_idle_numbers(richer(fit), data)
        energy, fit = (energy if enriched is fit else _fit_energy_law(enriched, data)), enriched
    tried = [fit, energy]
    if energy.probability < MIN_NOISE_PVALUE and not _is_hopeless(energy, fit):
        forms = tuple(replace(form, viscous=typical) for form in energy.model.forms)
        tried.append(_drop_idle_numbers(fit_machine(replace(energy.model, forms=forms), data, after=energy), data))
    if not _is_hopeless(energy, fit):
        tried.append(fit_machine(_with_law(energy.model, MEASURED_RATIOS, data), _free_ratios(data), after=energy))
    return _choose(tried, data)


def _fit_energy_law(fit: MachineFit, data: ModalData) -> MachineFit:
    """Return the fit by the energy law that begins at a coupled one; given up early where it stays far behind a good one."""
    model = _with_law(fit.model, ENERGY, data)
    first = fit_machine(model, data, _FIRST_ROUNDS, after=fit)
    return first if first.converged or _is_hopeless(first, fit) else fit_machine(first.model, data, after=first)


def _is_hopeless(fit: MachineFit, good: MachineFit) -> bool:
    """Whether a fit is so far behind one that leaves no more than noise that no further number brings it near."""
    return good.probability >= MIN_NOISE_PVALUE and fit.chi2 > _HOPELESS_RATIO * good.chi2


def _drop_idle_numbers(fit: MachineFit, data: ModalData) -> MachineFit:
    """Return the fit without those loss factors and dampers that the data do not tell from none, where it is as good.

    A joint that has both numbers seldom needs both, and with twice as many numbers any modal ratios can be explained.
    """
    if not _is_viscous(fit.model):
        return fit
    forms = []
    for form, part in zip(fit.model.forms, fit.model.slices, strict=False):
        deviation = np.sqrt(np.diag(fit.covariance)[part])[sum(form.sizes[:2]):]
        if form.viscous and form.lossy and form.start.twists.shape[1]:
            if form.start.relaxation < _MIN_DAMPING_DEVIATIONS * deviation[1]:
                form = replace(form, viscous=0.0, start=replace(form.start, relaxation=0.0))
            elif form.start.loss_factor < _MIN_DAMPING_DEVIATIONS * deviation[0]:
                form = replace(form, lossy=False, start=replace(form.start, loss_factor=0.0))
        forms.append(form)
    reduced = fit_machine(replace(fit.model, forms=tuple(forms)), data, after=fit)
    unexplained = max(reduced.widened, 1.0)
    evidence_lost = (reduced.chi2 - fit.chi2) / unexplained + _numbers_paid(reduced, data) - _numbers_paid(fit, data)
    return reduced if evidence_lost < 0 else fit


def _choose(tried: Sequence[MachineFit], data: ModalData) -> tuple[MachineFit, LawChoice]:
    """Return the law of the best evidence; one without any joint only where it is better beyond doubt."""
    unexplained = max(min(fit.widened for fit in tried), 1.0)
    scores = np.array([fit.chi2 / unexplained + _numbers_paid(fit, data) for fit in tried])
    handicap = np.array([DECISIVE_EVIDENCE * (fit.model.law == MEASURED_RATIOS) for fit in tried])
    best = int(np.argmin(scores + handicap))
    chosen = tried[best]
    evidence = {name_of(fit.model): float(score - scores[best]) for fit, score in zip(tried, scores, strict=True)}
    rivals = tuple(fit for i, fit in enumerate(tried) if i != best and abs(scores[i] - scores[best]) < DECISIVE_EVIDENCE)
    return chosen, LawChoice(chosen.model.law, _is_viscous(chosen.model), evidence, rivals)


def _numbers_paid(fit: MachineFit, data: ModalData) -> float:
    """Return the cost of the numbers of a fit: -ln det of their covariance in units of their prior widths."""
    ratio = max(float(np.median(data.ratio)), MIN_MODAL_DAMPING)
    width = fit.model.deviations
    for form, part in zip(fit.model.forms, fit.model.slices, strict=False):
        if form.lossy and form.start.twists.shape[1]:
            width[part.start + sum(form.sizes[:2])] = 2 * ratio
    eigenvalues = np.linalg.eigvalsh(fit.covariance / fit.widened / np.outer(width, width))
    cost = -float(np.log(np.clip(eigenvalues, 1e-300, 1.0)).sum())
    if fit.model.law == MEASURED_RATIOS:
        cost += float(2 * np.log(ratio * data.spread[:, 1, 1]).clip(0.0).sum())
    return cost


def _is_viscous(model: MachineNumbers) -> bool:
    """Whether any joint has viscous damping."""
    return any(form.viscous for form in model.forms)


def _with_law(model: MachineNumbers, law: str, data: ModalData) -> MachineNumbers:
    """Return the numbers by another law, damping at its start: what the coupled law made of real shapes is no beginning."""
    loss = float(np.clip(2 * np.median(data.ratio), 0.0, 0.5)) if law == ENERGY else 0.0
    forms = tuple(replace(form, lossy=law == ENERGY, viscous=0.0, start=replace(form.start, loss_factor=loss, relaxation=0.0))
                  for form in model.forms)
    return replace(model, forms=forms, law=law)


def _free_ratios(data: ModalData) -> ModalData:
    """Return the data with damping ratios left free: of (ln frequency, ratio) the first row of the inverse factor alone."""
    spread: FloatArray = data.spread.copy()
    spread[:, 1] = 0.0
    return replace(data, spread=spread)
