r"""Time responses by the exact step of a linear system: no step-size error for inputs linear over each sample."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail, floats, one_of, positive
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record
from toolpoint.vibration.state_space import StateSpace, hold_matrices, modal


def exact(
    system: StateSpace, inputs: FloatArray, sample_rate: float, hold: str = "first", start: FloatArray | None = None
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
    states = np.empty((u.shape[0], system.size))
    states[0] = 0.0 if start is None else floats("start", start, (system.size,))
    for k in range(u.shape[0] - 1):
        states[k + 1] = phi @ states[k] + drive[k]
    return states @ system.c.T + u @ system.d.T


def modal_superposition(modes: Modes, forces: Record, outputs: tuple[Dof | str, ...], kind: str = "displacement") -> Record:
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
    system = modal(modes, forces.channels, outputs, kind)
    values = exact(system, forces.samples, forces.sample_rate)
    labels = tuple(label if isinstance(label, Dof) else Dof.parse(label) for label in outputs)
    return Record(values, forces.sample_rate, labels, (kind,) * len(labels), start=forces.start)
