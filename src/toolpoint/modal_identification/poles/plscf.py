r"""Poly-reference least-squares complex frequency-domain poles (pLSCF) of all model orders at once.

Right matrix fraction :math:`H_o(\omega) D(\omega) = N_o(\omega)` for every output o, with
:math:`D = \sum_j \alpha_j z^j`, :math:`N_o = \sum_j \beta_{oj} z^j`, :math:`z = e^{-i \omega \Delta t}`. Eliminating
the numerators leaves the normal matrix of the denominators,

.. math:: M = \sum_o (T_o - S_o^T R^{-1} S_o), \qquad M \alpha = 0, \quad \alpha_m = I,

whose blocks are Toeplitz in the sums :math:`\sum_f H e^{-i \omega_f \Delta t\, l}`. With the highest coefficient set to
one, the solution of order m is :math:`-L_m^{-T} L_{m,:m}^T` with the one Cholesky factor L of M: all orders share it;
in this basis the poles of the noise come out unstable and drop away.

Source: Guillaume, Verboven, Vanlanduit, Van der Auweraer, Peeters, IMAC 21 (2003); Peeters et al., Shock and Vibration
11 (2004) 395; Cauberghe, Guillaume, Verboven, Vanlanduit, Parloo, MSSP 19 (2005) 1 (the choice of the constraint).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig, solve_triangular

from toolpoint._check import Array, ComplexArray, FloatArray, count, fail
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.vibration.frf import Frf

NYQUIST_RATIO = 1.05  # frequency of z = -1 over the top of the band
OUTPUT_CHUNK = 64  # outputs whose normal matrices are summed at once


def poles_of_orders(frf: Frf, order: int = 60, step: int = 2, *, weight: FloatArray | None = None) -> Diagram:
    """Return the poles and participation vectors of the model orders `step`, 2 `step`, .. `order`.

    Parameters
    ----------
    frf : Frf
        One pose, cut to the band; any line spacing, any quantity.
    order : int
        Highest order of the denominator; order times the number of references poles are computed.
    step : int
        Between the orders.
    weight : (n_outputs, n_inputs) floats, optional
        Inverse standard deviation of each response; one over its rms where left out.
    """
    order = count("order", order, 2)
    if frf.frequency.size < order + 2:
        fail("order", f"{order} with {frf.frequency.size} lines", "must be smaller than the number of lines less two",
             remedy="lower the order or widen the band")
    values, reference_scale = _apply_weights(frf.values, weight)
    # Coefficients are real and frequencies are never shifted: a shift makes poles near the start of the band wrong. The
    # small gap keeps the top of the band clear of z = -1, where a pole and its mirror image fall together.
    interval = np.pi / (NYQUIST_RATIO * frf.omega[-1])
    normal = _normal_matrix(values, frf.omega * interval, order)
    inputs = len(frf.inputs)
    factor = cholesky(normal, float(np.abs(np.diagonal(normal)).mean()))
    orders: list[tuple[int, Array, Array]] = []
    for m in range(step, order + 1, step):
        roots, vectors = roots_of_order(factor, m, inputs)
        orders.append((m, -np.log(roots) / interval, vectors / reference_scale[:, None]))
    return Diagram.collected(orders, (frf.omega[0], frf.omega[-1]))


def _apply_weights(values: ComplexArray, weight: FloatArray | None) -> tuple[ComplexArray, FloatArray]:
    """Return the responses with separable weights (row times column), and the column weights."""
    rms = np.sqrt((np.abs(values) ** 2).mean(axis=0)) if weight is None else 1 / weight
    columns = 1 / np.maximum(np.sqrt((rms**2).mean(axis=0)), np.finfo(float).tiny)
    # Row times column is all that is allowed: a weight of each response alone would break the one denominator that all
    # share.
    rows = np.sqrt(((rms * columns) ** 2).mean(axis=1))
    rows = np.where(rows > 0, 1 / np.where(rows > 0, rows, 1.0), 0.0)
    return values * (rows[:, None] * columns), columns


def _normal_matrix(values: ComplexArray, angle: FloatArray, order: int) -> FloatArray:
    """Return M, shape ((order+1) n_inputs, (order+1) n_inputs), blocks by power then input."""
    lines, outputs, inputs = values.shape
    lag = np.arange(order + 1)[None, :] - np.arange(order + 1)[:, None] + order
    phase = np.arange(order + 1)[:, None] * angle
    waves = np.cos(phase), np.sin(phase)
    whiten = _whitening(_sums(np.ones((lines, 1), complex), waves)[lag, 0])
    # In parts: the conjugate of all responses at once would double the memory of the largest array.
    power = np.concatenate([np.swapaxes(part.conj(), -1, -2) @ part for part in np.array_split(values, 16)])
    toeplitz = _sums(power.reshape(lines, -1), waves)[lag].reshape(order + 1, order + 1, inputs, inputs)
    normal = toeplitz.transpose(0, 2, 1, 3).reshape((order + 1) * inputs, -1)
    for start in range(0, outputs, OUTPUT_CHUNK):
        part = values[:, start:start + OUTPUT_CHUNK, :]
        sums = _sums(part.reshape(lines, -1), waves)
        block = sums.reshape(-1, part.shape[1], inputs)[lag]  # (row power, column power, output, input)
        flat = block.transpose(0, 2, 1, 3).reshape(order + 1, -1)
        whitened = (whiten @ flat).reshape(-1, (order + 1) * inputs)
        normal = normal - whitened.T @ whitened
    return (normal + normal.T) / 2


def _sums(values: ComplexArray, waves: tuple[FloatArray, FloatArray]) -> FloatArray:
    r"""Return :math:`\sum_f v_f e^{-i \theta_f l}`, l = -order .. order, shape (2 order + 1, n), its real part.

    A matrix product over the few lags that are needed is as fast as a transform here and takes any line spacing.
    """
    cosine_sums, sine_sums = waves[0] @ np.ascontiguousarray(values.real), waves[1] @ np.ascontiguousarray(values.imag)
    return np.concatenate([(cosine_sums - sine_sums)[:0:-1], cosine_sums + sine_sums])


def _whitening(gram: FloatArray) -> FloatArray:
    """Return W with W^T W = R^-1 on the part of R that is not singular."""
    size, vectors = np.linalg.eigh(gram)
    keep = size > 1e-12 * size[-1]
    return (vectors[:, keep] / np.sqrt(size[keep])).T


def cholesky(normal: FloatArray, scale: float) -> FloatArray:
    """Return the lower factor; data without noise make M singular, so a trace of the identity is added where needed."""
    ridge = 1e-14
    identity = scale * np.eye(normal.shape[0])
    while ridge < 1e-3:
        try:
            return np.asarray(np.linalg.cholesky(normal + ridge * identity), float)
        except np.linalg.LinAlgError:
            ridge *= 10
    fail("frf", "the normal matrix of the poles is not positive", "must be", remedy="check the responses for corrupt values")


def roots_of_order(factor: FloatArray, order: int, inputs: int) -> tuple[ComplexArray, ComplexArray]:
    """Return the roots of det D of one order and their participation vectors, (n_inputs, n_roots)."""
    size = order * inputs
    right = factor[size:size + inputs, :size].T
    # M = L L^T: the leading block of every order has the leading block of L as its factor, so each order costs one
    # triangular solve.
    alpha = -solve_triangular(factor[:size, :size], right, lower=True, trans="T", check_finite=False)
    companion = np.zeros((size, size), alpha.dtype)
    # D^T w = 0 gives the participation w: the companion matrix of the transposed coefficients.
    blocks = alpha.reshape(order, inputs, inputs).transpose(2, 0, 1)  # [column j, power, row i] = alpha_power[i, j]
    companion[:-inputs, inputs:] = np.eye(size - inputs)
    companion[-inputs:, :] = -blocks.reshape(inputs, size)
    roots, vectors = eig(companion, check_finite=False)
    # A root at zero is the lost leading coefficient of a smaller order: its logarithm is no pole.
    keep = np.abs(roots) > 1e-8
    return roots[keep], vectors[:inputs, keep]
