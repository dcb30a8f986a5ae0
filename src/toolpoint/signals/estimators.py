r"""Frequency responses from spectra: H1, H2, Hv for one and several inputs, coherences, variance.

Spectra are averaged over blocks: :math:`G_{FF} = \overline{F F^H}`, :math:`G_{XF} = \overline{X F^H}`. Sources: Bendat,
Piersol, Random Data, 4th ed., chapters 7 and 9; Rocklin, Crowley, Vold, IMAC 3 (1985) (Hv); Heylen, Lammens, Sas, Modal
Analysis Theory and Testing, section A.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail, one_of

ESTIMATORS = ("H1", "H2", "Hv")


@dataclass(frozen=True, eq=False)
class Spectra:
    """Averaged spectra on the lines `frequency` (Hz) from `blocks` independent blocks.

    `force` (n_f, n_inputs, n_inputs), `cross` (n_f, n_outputs, n_inputs), `response` (n_f, n_outputs) the auto spectra
    and, where several inputs need it for H2, `responses` (n_f, n_outputs, n_outputs).
    """

    frequency: FloatArray
    force: ComplexArray
    cross: ComplexArray
    response: FloatArray
    blocks: float
    responses: ComplexArray | None = None


def average(frequency: FloatArray, force: ComplexArray, response: ComplexArray, *, blocks: float | None = None,
             full: bool = False) -> Spectra:
    """Return the spectra of blocks; `force` (n_blocks, n_f, n_inputs), `response` (n_blocks, n_f, n_outputs)."""
    count = force.shape[0]
    f, x = force.transpose(1, 2, 0), response.transpose(1, 2, 0)
    conjugate_transpose = np.swapaxes(f.conj(), -1, -2)
    return Spectra(frequency, f @ conjugate_transpose / count, x @ conjugate_transpose / count, (np.abs(x) ** 2).mean(axis=-1),
                   float(count if blocks is None else blocks),
                   x @ np.swapaxes(x.conj(), -1, -2) / count if full else None)


def responses(spectra: Spectra, estimator: str = "H1") -> ComplexArray:
    """Return the frequency responses (n_f, n_outputs, n_inputs).

    ``H1`` assumes noise on the responses, ``H2`` on the forces, ``Hv`` on both in proportion to each channel's level.
    H2 with several inputs uses all outputs together and needs at least as many outputs as inputs.
    """
    one_of("estimator", estimator, ESTIMATORS)
    _check_forces(spectra)
    if estimator == "H1":
        return spectra.cross @ np.linalg.inv(spectra.force)
    return _h2(spectra) if estimator == "H2" else _hv(spectra)


def _check_forces(spectra: Spectra) -> None:
    """Refuse fewer blocks than inputs, an input without power, and inputs that are correlated on most lines."""
    inputs = spectra.force.shape[-1]
    if spectra.blocks < inputs:
        fail("blocks", f"{spectra.blocks:g} for {inputs} inputs", "must be at least one for each input", remedy="average more")
    power = np.einsum("fii->fi", spectra.force).real
    if (power.max(axis=0) <= 0).any():
        fail("force", f"input {int(np.argmin(power.max(axis=0)))} is zero", "must excite",
             remedy="check the channel assignment")
    if inputs > 1:
        # Scaled to coherences between inputs: a weak input beside a strong one is not a correlated one.
        eigenvalues = np.linalg.eigvalsh(spectra.force / np.sqrt(power[:, :, None] * power[:, None, :] + 1e-300))
        # The median over lines: shakers on one structure move together at its resonances, which is no fault of the signals.
        smallest_median = float(np.median(eigenvalues[:, 0]))
        if smallest_median < 1e-6:
            fail("force", "the inputs are correlated (they move together on most lines)", "must be independent",
                 remedy="use independent random signals, or more blocks than inputs")


def _h2(spectra: Spectra) -> ComplexArray:
    """Return H2 = G_XX G_FX^+; G_XX / G_FX for one input."""
    if spectra.force.shape[-1] == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = spectra.response[..., None] / spectra.cross.conj()
        return np.where(np.abs(spectra.cross) > 0, ratio, 0.0)
    if spectra.responses is None or spectra.cross.shape[-2] < spectra.cross.shape[-1]:
        fail("estimator", f"H2 with {spectra.cross.shape[-2]} outputs and {spectra.cross.shape[-1]} inputs",
             "must have at least as many outputs as inputs", remedy="use H1 or Hv")
    cross = spectra.cross  # G_FX = cross^H
    return spectra.responses @ cross @ np.linalg.inv(np.swapaxes(cross.conj(), -1, -2) @ cross)


def _hv(spectra: Spectra) -> ComplexArray:
    """Return the total least squares of each output: the smallest eigenvector of the scaled joint spectrum."""
    lines, outputs, inputs = spectra.cross.shape
    # Total least squares weighs all channels alike: each is divided by its own level first, or newtons would outweigh
    # micrometres.
    level = np.sqrt(np.maximum(np.einsum("fii->fi", spectra.force).real, 1e-300))
    result = np.empty((lines, outputs, inputs), complex)
    for o in range(outputs):
        amplitude = np.sqrt(np.maximum(spectra.response[:, o], 1e-300))
        joint = np.empty((lines, inputs + 1, inputs + 1), complex)
        joint[:, :inputs, :inputs] = spectra.force / (level[:, :, None] * level[:, None, :])
        joint[:, inputs, :inputs] = spectra.cross[:, o] / (amplitude[:, None] * level)
        joint[:, :inputs, inputs] = joint[:, inputs, :inputs].conj()
        joint[:, inputs, inputs] = 1.0
        smallest = np.linalg.eigh(joint)[1][:, :, 0].conj()
        last = smallest[:, inputs:]
        # A line whose response is all noise has its smallest direction among the forces: no response follows from them.
        safe = np.where(np.abs(last) > 1e-12, last, 1.0)
        result[:, o] = np.where(np.abs(last) > 1e-12, -smallest[:, :inputs] / safe, 0.0) * amplitude[:, None] / level
    return result


def multiple_coherence(spectra: Spectra) -> FloatArray:
    """Return the fraction of each response that all forces together explain, (n_f, n_outputs); 1 with one block."""
    _check_forces(spectra)
    explained = (spectra.cross @ np.linalg.inv(spectra.force) * spectra.cross.conj()).sum(axis=-1).real
    return np.clip(explained / np.maximum(spectra.response, 1e-300), 0.0, 1.0)


def ordinary_coherence(spectra: Spectra) -> FloatArray:
    """Return the coherence |G_XF|^2 / (G_FF G_XX) of every pair, (n_f, n_outputs, n_inputs)."""
    power = np.einsum("fii->fi", spectra.force).real[:, None, :] * spectra.response[:, :, None]
    return np.clip(np.abs(spectra.cross) ** 2 / np.maximum(power, 1e-300), 0.0, 1.0)


def variance(spectra: Spectra) -> FloatArray | None:
    r"""Return the variance E|e|^2 of H1 on every line, (n_f, n_outputs, n_inputs); None for no more blocks than inputs.

    :math:`\frac{G_{XX} (1 - \gamma^2)}{n - n_i} [G_{FF}^{-1}]_{ii}` with the multiple coherence; for one input this is
    :math:`|H|^2 (1 - \gamma^2) / (\gamma^2 (n - 1))` (Bendat, Piersol, section 9.2, whose n - 1 is n for many blocks).
    """
    inputs = spectra.force.shape[-1]
    if spectra.blocks <= inputs:
        return None
    unexplained = spectra.response * (1 - multiple_coherence(spectra))
    inverse = np.einsum("fii->fi", np.linalg.inv(spectra.force)).real
    return np.maximum(unexplained[:, :, None] * inverse[:, None, :] / (spectra.blocks - inputs), 0.0)


def with_choice(values: ComplexArray, h1: ComplexArray, h1_variance: FloatArray | None) -> FloatArray | None:
    """Return the variance of responses by an estimator from that of H1: the square of what lies between both is added.

    On which side the noise is, the data do not tell. All of it on the responses makes H1 right, and the other estimator off by
    the whole difference; scatter alone says nothing of that.
    """
    return None if h1_variance is None else h1_variance + np.abs(values - h1) ** 2


def scatter_of_hits(spectra: Sequence[tuple[ComplexArray, ComplexArray]]) -> tuple[FloatArray | None, FloatArray | None]:
    r"""Return E|e|^2 of H1 (n_f, n_outputs, 1) from the scatter of hits, and the degrees of freedom of e; None with one hit.

    `spectra` : of every hit the force (n_f,) and the responses (n_f, n_outputs).

    With residuals r and leverages :math:`h_i = |F_i|^2 / \sum |F|^2` the terms :math:`e_i = r_i \bar F_i / \sum |F|^2` give
    :math:`\sum |e_i|^2 / (1 - h_i)`: without bias for noise that does not depend on the force, and right for errors that grow
    with it, as a missed spot does (MacKinnon, White, J. Econometrics 29 (1985) 305, HC2). Real and imaginary part turned to
    their main axes have variances :math:`\lambda_1, \lambda_2` whose freedom is
    :math:`(\lambda_1 + \lambda_2)^2 / (\lambda_1^2 + \lambda_2^2)` (Satterthwaite, Biometrics Bulletin 2 (1946) 110).
    """
    if len(spectra) < 2:
        return None, None
    force, response = (np.array([pair[k] for pair in spectra]) for k in (0, 1))
    power = np.abs(force) ** 2
    total = np.maximum(power.sum(axis=0), 1e-300)
    mean = (response * force.conj()[:, :, None]).sum(axis=0) / total[:, None]
    error = (response - mean * force[:, :, None]) * (force.conj() / total)[:, :, None]
    # One blow that is all of the power fits itself: its residual is nought and says nothing, so the factor is bounded.
    leverage_factor = 1 / np.maximum(1 - power / total, 1e-9)[:, :, None]
    total_variance = (np.abs(error) ** 2 * leverage_factor).sum(axis=0)
    pseudo_variance = np.abs((error**2 * leverage_factor).sum(axis=0))
    degrees = 2 * total_variance**2 / np.maximum(total_variance**2 + pseudo_variance**2, 1e-300)
    return total_variance[:, :, None], np.clip(degrees, 1.0, 2.0)[:, :, None]
