r"""Time responses by the exact step of a linear system: no step-size error for inputs linear over each sample."""

from __future__ import annotations

import numpy as np
import scipy

from toolpoint._check import FloatArray, count, fail, floats, one_of, positive
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record
from toolpoint.vibration.state_space import StateSpace, hold_matrices, modal

_MAX_FILTER_CONDITION = 1e6  # of the eigenvectors of the step: beyond, its states are stepped one by one


def exact(
    system: StateSpace, inputs: FloatArray, sample_rate: float, *, hold: str = "first", start: FloatArray | None = None,
    stride: int = 1,
) -> FloatArray:
    r"""Return the outputs, shape (n_samples, n_outputs), to inputs of shape (n_samples, n_inputs).

    Between samples the input is held constant (``zero``) or linear (``initial``); the step
    :math:`x_{k+1} = \Phi x_k + \Gamma_1 u_k + \Gamma_2 (u_{k+1} - u_k)` is then exact.

    Parameters
    ----------
    system : StateSpace
        Continuous; a discrete one is refused.
    inputs : (n_samples, n_inputs) floats
    sample_rate : float
        Hz.
    hold : str
        ``zero`` or ``initial``.
    start : (n_states,) floats, optional
        State at the first sample; at rest where left out.
    stride : int
        Outputs at every n-th sample only, from the first; as exact, for less work.

    Raises
    ------
    ToolpointError
        For a discrete system, or inputs that do not fit it.
    """
    if system.sample_time is not None:
        fail("system", "a discrete system", "must be continuous")
    one_of("hold", hold, ("zero", "first"))
    u = floats("inputs", inputs, (None, len(system.inputs)))
    phi, gamma1, gamma2 = hold_matrices(system.a, system.b, 1 / positive("sample_rate", sample_rate))
    initial = np.zeros(system.size) if start is None else floats("start", start, (system.size,))
    # x_{k+1} = phi x_k + gamma (u_k, u_{k+1} - u_k)
    gamma, drive = (np.hstack([gamma1, gamma2]), np.hstack([u[:-1], np.diff(u, axis=0)])) if hold == "first" else (
        gamma1, u[:-1])
    step = count("stride", stride)
    return _filter_outputs(phi, gamma, drive, initial, output=system.c, stride=step) + u[::step] @ system.d.T


def _filter_outputs(phi: FloatArray, gamma: FloatArray, drive: FloatArray, initial: FloatArray, *, output: FloatArray,
                    stride: int
             ) -> FloatArray:
    """Return C x at every n-th state of x_{k+1} = phi x_k + gamma drive_k, shape (n_kept, n_outputs)."""
    multipliers, vectors = np.linalg.eig(phi)
    if np.linalg.cond(vectors) > _MAX_FILTER_CONDITION:
        # Nearly defective: step through, as the eigenvectors would lose digits.
        states = np.empty((len(drive) + 1, len(initial)))
        states[0] = initial
        for k in range(len(drive)):
            states[k + 1] = phi @ states[k] + gamma @ drive[k]
        return states[::stride] @ output.T
    # In eigenvector coordinates every state is a scalar recursion, which a compiled filter runs through.
    # Conjugate ones run once and count twice. Several steps are one: z_{k+p} = m^p z_k + sum m^(p-1-i) e_{k+i}.
    is_upper = multipliers.imag >= 0
    m, left_rows = multipliers[is_upper], np.linalg.inv(vectors)[is_upper]
    n_blocks = len(drive) // stride
    blocks = drive[:n_blocks * stride].reshape(n_blocks, stride * drive.shape[1])
    powers = m[:, None] ** np.arange(stride - 1, -1, -1)
    weights = (powers[:, :, None] * (left_rows @ gamma)[:, None, :]).reshape(len(m), -1)
    real, imaginary = np.split(np.concatenate([weights.real, weights.imag]) @ blocks.T, 2)  # half the work of complex weights
    entries = np.concatenate([(left_rows @ initial)[:, None], real + 1j * imaginary], axis=1)
    modal = np.array([scipy.signal.lfilter([1.0], [1.0, -k**stride], x) for k, x in zip(m, entries, strict=True)])
    return ((output @ (vectors[:, is_upper] * np.where(m.imag > 0, 2.0, 1.0))) @ modal).real.T


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
