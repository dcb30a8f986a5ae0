r"""Rational fraction polynomials (RFP), for each response or global, in orthogonal polynomials.

:math:`H_k(p) = N_k(p) / D(p)` with polynomials that are orthogonal over the measured lines (made by the Arnoldi process,
real coefficients for responses of real systems), so that orders of forty and more stay well conditioned. The
denominator is linear once the numerators are projected away. Source: Richardson, Formenti, IMAC 1 (1982) and IMAC 3
(1985) (global); Brubeck, Nakatsukasa, Trefethen, SIAM Review 63 (2021) 405 (Arnoldi).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, fail
from toolpoint.modal_identification.basis import real_rows
from toolpoint.modal_identification.poles.lscf import as_one_reference
from toolpoint.modal_identification.poles.selection import drop_repeated, select_poles
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.modal_identification.poles.start import Start
from toolpoint.modal_identification.residues import fit_participation
from toolpoint.vibration.frf import Frf

EXTRA_NUMERATOR_TERMS = 4  # for modes outside the band
MAX_PRINCIPAL_RESPONSES = 24


@dataclass(frozen=True)
class RationalFraction:
    """RFP with one denominator for all responses (`local` False), or one for each response with `modes` modes.

    Parameters
    ----------
    order : int
        Highest number of poles of the global method; selection across orders.
    modes : int, optional
        How many modes to fit; no selection then. Needed for `local`.
    local : bool
        Each response on its own; the median over the responses is kept.
    """

    order: int = 60
    step: int = 2
    share: float = 0.35
    modes: int | None = None
    local: bool = False
    refine: bool = False

    @property
    def name(self) -> str:
        """Name in messages."""
        return "rational fraction polynomials" if self.local else "global rational fraction polynomials"

    def start(self, frf: Frf) -> Start:
        """Return the poles."""
        values = as_one_reference(frf).values[:, :, 0]
        rms = np.sqrt((np.abs(values) ** 2).mean(axis=0))
        values = values[:, rms > 0] / rms[rms > 0]
        if self.modes is not None or self.local:
            return self._fixed(frf, values)
        values = _principal_responses(values)
        highest = min(self.order, frf.frequency.size // 4)
        basis, upper = orthogonal(frf.omega / frf.omega[-1], highest + EXTRA_NUMERATOR_TERMS)
        orders = [(n, poles_of_order(values, basis, upper, n=n) * frf.omega[-1]) for n in range(2, highest + 1, self.step)]
        diagram = Diagram.collected([(n, s, np.ones((1, s.size), complex)) for n, s in orders], (frf.omega[0], frf.omega[-1]))
        choice = drop_repeated(select_poles(diagram, self.share))
        return Start(choice.poles, _participation(frf, choice.poles), diagram, choice.support)

    def _fixed(self, frf: Frf, values: ComplexArray) -> Start:
        if self.modes is None:
            fail("modes", "none", "must be given for the local method",
                 remedy="for example RationalFraction(local=True, modes=3)")
        modes = count("modes", self.modes)
        basis, upper = orthogonal(frf.omega / frf.omega[-1], 2 * modes + EXTRA_NUMERATOR_TERMS)
        parts = [values[:, [k]] for k in range(values.shape[1])] if self.local else [values]
        orders = []
        for part in parts:
            s = poles_of_order(part, basis, upper, n=2 * modes) * frf.omega[-1]
            s = s[(s.imag > 0) & (np.abs(s) >= frf.omega[0]) & (np.abs(s) <= frf.omega[-1])]
            if s.size == modes:
                orders.append(s[np.argsort(np.abs(s))])
        if not orders:
            fail("modes", f"{modes} modes in no response", "must all lie within the band",
                 remedy="narrow the band or ask for fewer")
        table = np.array(orders)
        poles = np.median(table.real, axis=0) + 1j * np.median(table.imag, axis=0)
        notes = () if len(orders) == len(parts) else (f"{len(parts) - len(orders)} of {len(parts)} responses did not show "
                                                     f"{modes} modes",)
        return Start(poles, _participation(frf, poles), notes=notes)


def _principal_responses(values: ComplexArray) -> ComplexArray:
    """Return the real combinations of the responses that hold nearly all of their energy: fewer, with the same poles."""
    left, size, _ = np.linalg.svd(real_rows(values), full_matrices=False)
    keep = min(int((size > 1e-6 * size[0]).sum()), MAX_PRINCIPAL_RESPONSES)
    rows = left[:, :keep] * size[:keep]
    return rows[:values.shape[0]] + 1j * rows[values.shape[0]:]


def _participation(frf: Frf, poles: ComplexArray) -> ComplexArray:
    return fit_participation(frf, poles) if poles.size else np.zeros((len(frf.inputs), 0), complex)


def orthogonal(x: FloatArray, degree: int) -> tuple[ComplexArray, FloatArray]:
    """Return polynomials in i x orthonormal over the lines and their mirror images, (n_f, degree + 1), and Hessenberg."""
    basis = np.zeros((x.size, degree + 1), complex)
    upper = np.zeros((degree + 1, degree))
    basis[:, 0] = 1 / np.sqrt(x.size)
    for j in range(degree):
        new = 1j * x * basis[:, j]
        for _ in range(2):  # twice is enough to be orthogonal to rounding
            part = (basis[:, :j + 1].conj().T @ new).real
            upper[:j + 1, j] += part
            new = new - basis[:, :j + 1] @ part
        upper[j + 1, j] = np.linalg.norm(new)
        basis[:, j + 1] = new / upper[j + 1, j]
    return basis, upper


def poles_of_order(values: ComplexArray, basis: ComplexArray, upper: FloatArray, *, n: int) -> ComplexArray:
    """Return the n roots of the common denominator of the responses (n_f, n_responses), over the top frequency."""
    numerator = np.linalg.qr(real_rows(basis[:, :n + EXTRA_NUMERATOR_TERMS - 1]))[0]
    normal = np.zeros((n + 1, n + 1))
    for k in range(values.shape[1]):
        rows = real_rows(values[:, [k]] * basis[:, :n + 1])
        rows = rows - numerator @ (numerator.T @ rows)
        normal += rows.T @ rows
    d = np.linalg.lstsq(normal[:n, :n], -normal[:n, n], rcond=1e-14)[0]
    comrade = upper[:n, :n].copy()
    comrade[:, n - 1] -= upper[n, n - 1] * d
    return np.linalg.eigvals(comrade).astype(complex)
