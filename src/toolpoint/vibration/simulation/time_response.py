r"""Time responses by the exact step of a linear system: no step-size error for inputs linear over each sample."""

from __future__ import annotations

import numpy as np
import scipy

from toolpoint._check import FloatArray, fail, floats, one_of, positive
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record
from toolpoint.vibration.state_space import StateSpace, hold_matrices, modal

_CONDITION = 1e6


def exact(
    system: StateSpace, inputs: FloatArray, sample_rate: float, *, hold: str = "first", start: FloatArray | None = None
) -> FloatArray:
    r"""Return the outputs, shape (n_samples, n_outputs), to inputs of shape (n_samples, n_inputs).

    Between samples the input is held constant (``zero``) or linear (``first``); the step
    :math:`x_{k+1} = \Phi x_k + \Gamma_1 u_k + \Gamma_2 (u_{k+1} - u_k)` is then exact.

    Parameters
    ----------
    system : StateSpace
        Continuous; a discrete one is refused.
    inputs : (n_samples, n_inputs) floats
    sample_rate : float
        Hz.
    hold : str
        ``zero`` or ``first``.
    start : (n_states,) floats, optional
        State at the first sample; at rest where left out.
    """
    if system.sample_time is not None:
        fail("system", "a discrete system", "must be continuous")
    one_of("hold", hold, ("zero", "first"))
    u = floats("inputs", inputs, (None, len(system.inputs)))
    phi, gamma1, gamma2 = hold_matrices(system.a, system.b, 1 / positive("sample_rate", sample_rate))
    drive = u[:-1] @ gamma1.T
    if hold == "first":
        drive = drive + np.diff(u, axis=0) @ gamma2.T
    first = np.zeros(system.size) if start is None else floats("start", start, (system.size,))
    return _states(phi, drive, first) @ system.c.T + u @ system.d.T


def _states(phi: FloatArray, drive: FloatArray, first: FloatArray) -> FloatArray:
    """Return all states of x_{k+1} = phi x_k + drive_k, shape (n_samples, n_states)."""
    multipliers, vectors = np.linalg.eig(phi)
    if np.linalg.cond(vectors) > _CONDITION:
        # Nearly defective: step through, as the eigenvectors would lose digits.
        states = np.empty((len(drive) + 1, len(first)))
        states[0] = first
        for k in range(len(drive)):
            states[k + 1] = phi @ states[k] + drive[k]
        return states
    # In eigenvector coordinates every state is a scalar recursion, which a compiled filter runs through.
    # Conjugate ones run once and count twice.
    upper = multipliers.imag >= 0
    inputs = np.linalg.inv(vectors)[upper] @ np.concatenate([first[None], drive]).T
    modal = np.array([scipy.signal.lfilter([1.0], [1.0, -m], x) for m, x in zip(multipliers[upper], inputs, strict=True)])
    return ((vectors[:, upper] * np.where(multipliers[upper].imag > 0, 2.0, 1.0)) @ modal).real.T


def modal_superposition(modes: Modes, forces: Record, outputs: tuple[Dof | str, ...], *, kind: str = "displacement") -> Record:
    """Return the response of real modes to recorded forces, forces linear between samples.

    Parameters
    ----------
    modes : Modes
        Real, unit modal mass, viscous.
    forces : Record
        Channels labelled with the driven Dofs, N.
    outputs : labels
        Where the response is wanted.
    kind : str
        ``displacement`` or ``velocity``.
    """
    one_of("kind", kind, ("displacement", "velocity"))
    system = modal(modes, forces.channels, outputs, kind=kind)
    values = exact(system, forces.samples, forces.sample_rate)
    labels = tuple(label if isinstance(label, Dof) else Dof.parse(label) for label in outputs)
    return Record(values, forces.sample_rate, labels, (kind,) * len(labels), start=forces.start)
