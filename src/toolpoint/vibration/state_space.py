"""StateSpace: first-order equations of a SecondOrderSystem or of Modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from toolpoint._check import ComplexArray, FloatArray, fail, floats, one_of, positive
from toolpoint._notebook import NotebookText
from toolpoint.vibration import eigen
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.system import SecondOrderSystem

ROUNDING_COUPLING = 1e-9  # largest modal damping off the diagonal over that on it: below, it is rounding


@dataclass(frozen=True, eq=False)
class StateSpace(NotebookText):
    r"""Linear system :math:`\dot x = A x + B u`, :math:`y = C x + D u`, or :math:`x_{k+1} = A x_k + B u_k`.

    Parameters
    ----------
    a : (n, n), b : (n, n_inputs), c : (n_outputs, n), d : (n_outputs, n_inputs) floats
    inputs, outputs, states : sequences of str, optional
        Names; u1.., y1.., x1.. where left out.
    sample_time : float, optional
        Step in s of a discrete system; None for a continuous one.
    hold : str
        Hold that a discrete system was made with: ``zero``, ``first`` or ``none``.

    Raises
    ------
    ToolpointError
        For matrices or names that do not fit each other.

    Examples
    --------
    >>> from toolpoint.vibration import StateSpace
    >>> integrator = StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]])
    >>> integrator.discretised(0.01)
    StateSpace(1 states, 1 inputs, 1 outputs, step 0.01 s, zero-order hold)
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    sample_time: float | None = None
    hold: str = "none"

    def __post_init__(self) -> None:
        put = object.__setattr__
        a = floats("StateSpace.a", self.a, (None, None))
        n = a.shape[-1]
        if a.shape != (n, n):
            fail("StateSpace.a", f"shape {a.shape}", "must be square")
        b, c = floats("StateSpace.b", self.b, (n, None)), floats("StateSpace.c", self.c, (None, n))
        d = floats("StateSpace.d", self.d, (c.shape[0], b.shape[1]))
        for name, value in (("a", a), ("b", b), ("c", c), ("d", d)):
            put(self, name, value)
        for name, length, letter in (("inputs", b.shape[1], "u"), ("outputs", c.shape[0], "y"), ("states", n, "x")):
            names = tuple(str(x) for x in getattr(self, name)) or tuple(f"{letter}{i + 1}" for i in range(length))
            if len(names) != length:
                fail(f"StateSpace.{name}", f"{len(names)} names", f"must be {length}")
            put(self, name, names)
        if self.sample_time is not None:
            put(self, "sample_time", positive("StateSpace.sample_time", self.sample_time))
        one_of("StateSpace.hold", self.hold, ("none", "zero", "first"))

    @property
    def size(self) -> int:
        """Number of states."""
        return int(self.a.shape[0])

    @property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A: rad/s for a continuous system, multipliers per step for a discrete one."""
        return np.linalg.eigvals(self.a).astype(complex)

    def discretised(self, sample_time: float, hold: str = "zero") -> StateSpace:
        """Return the exact discrete system for inputs held constant (``zero``) or linear (``first``) over each step.

        One matrix exponential of the system augmented by the input and its slope; with the first-order hold the state
        is shifted by the input (x - G2 u), so that the step stays causal and D is not zero: the outputs are exact.
        Source: Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., section 6.
        """
        if self.sample_time is not None:
            fail("discretised", f"a system already discrete with {self.sample_time:g} s", "must be continuous")
        step = positive("sample_time", sample_time)
        one_of("hold", hold, ("zero", "first"))
        phi, gamma1, gamma2 = hold_matrices(self.a, self.b, step)
        if hold == "zero":
            return replace(self, a=phi, b=gamma1, sample_time=step, hold=hold)
        return replace(self, a=phi, b=gamma1 + phi @ gamma2 - gamma2, d=self.d + self.c @ gamma2,
                       sample_time=step, hold=hold)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Return C (s I - A)^-1 B + D at s = i w (z = exp(i w T) if discrete), shape (n_f, n_outputs, n_inputs).

        Raises ToolpointError where a line lies on an undamped pole: the response is infinite there.
        """
        w = 2 * np.pi * floats("frequency", np.atleast_1d(frequency))
        s = 1j * w if self.sample_time is None else np.exp(1j * w * self.sample_time)
        resolvent = s[:, None, None] * np.eye(self.size) - self.a
        try:
            states = np.linalg.solve(resolvent, np.broadcast_to(self.b + 0j, (w.size, *self.b.shape)))
        except np.linalg.LinAlgError:
            fail("frequency", "a line on an undamped pole", "must lie beside the poles: the response is infinite there",
                 remedy="leave 0 Hz out where a system is free to move")
        return np.asarray(self.c @ states + self.d, complex)

    def frf(self, frequency: FloatArray, quantity: str = "receptance") -> Frf:
        """Return the frequency response as an Frf; names that read as Dofs become its labels."""
        return Frf(frequency, self.response(frequency), _labels(self.outputs), _labels(self.inputs), quantity)

    def to_control(self) -> object:
        """Return the system g as python-control's StateSpace (needs the extra ``control``); the way back is
        ``StateSpace(g.A, g.B, g.C, g.D, tuple(g.input_labels), tuple(g.output_labels))``."""
        try:
            import control
        except ImportError:
            fail("to_control", "python-control is not installed", "needs it", remedy="pip install 'toolpoint[control]'")
        return control.ss(self.a, self.b, self.c, self.d, self.sample_time or 0, inputs=list(self.inputs),
                          outputs=list(self.outputs), states=list(self.states))

    def __repr__(self) -> str:
        kind = "continuous" if self.sample_time is None else f"step {self.sample_time:g} s, {self.hold}-order hold"
        return f"StateSpace({self.size} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs, {kind})"


def hold_matrices(a: FloatArray, b: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return phi = e^{A T}, G1 and G2 of x(T) = phi x + G1 u_0 + G2 (u_1 - u_0), u linear over the step."""
    n, m = b.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n:n + m] = a * step, b * step
    # The input is a state whose rate is its slope: the last columns of the exponential integrate a ramp.
    block[n:n + m, n + m:] = np.eye(m)
    e = scipy.linalg.expm(block)
    return e[:n, :n], e[:n, n:n + m], e[:n, n + m:]


def physical(system: SecondOrderSystem, outputs: str = "displacement") -> StateSpace:
    """Return the system with states (q, q'), exactly.

    `outputs` is ``displacement``, ``velocity`` or ``displacement and velocity`` of the system's outputs.
    Structural damping has no time-domain form: convert it first with `damping.equivalent_viscous`.
    """
    _check_time_domain(system)
    n = system.size
    c = np.zeros((n, n)) if system.damping is None else system.damping
    # One factorisation of M for stiffness, damping and inputs.
    inverse = np.linalg.solve(system.mass, np.concatenate([system.stiffness, c, system.input_map], axis=1))
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse[:, :n], -inverse[:, n:2 * n]]])
    b = np.concatenate([np.zeros((n, len(system.inputs))), inverse[:, 2 * n:]])
    rows, names = _output_rows(system.output_map, system.outputs, outputs)
    states = (*system.coordinates, *(f"d{name}" for name in system.coordinates))
    return StateSpace(a, b, rows, np.zeros((rows.shape[0], b.shape[1])), _names(system.inputs), names, states)


def modal_coordinates(system: SecondOrderSystem, outputs: str = "displacement") -> StateSpace:
    r"""Return the system with amplitudes and rates of its undamped modes as states, two for each mode, exactly.

    Damping couples them, :math:`\ddot q + \Phi^T C \Phi\, \dot q + \Lambda q = \Phi^T f`: no mode is left out and no
    coupling. `outputs` as in `physical`; structural damping has no time-domain form.
    """
    _check_time_domain(system)
    squares, vectors = eigen.mass_normalised(system.mass, system.stiffness)
    n = system.size
    rate = np.zeros((n, n)) if system.damping is None else vectors.T @ system.damping @ vectors
    off_diagonal = np.abs(rate - np.diag(np.diagonal(rate)))
    if off_diagonal.max(initial=0.0) <= ROUNDING_COUPLING * max(float(np.abs(np.diagonal(rate)).max(initial=0.0)), 1e-300):
        rate = np.diag(np.diagonal(rate))  # rounding of an inverse does not couple modes
    omega = eigen.natural_omega(squares, system.mass, system.stiffness)
    a = np.zeros((2 * n, 2 * n))
    a[0::2, 1::2], a[1::2, 0::2], a[1::2, 1::2] = np.eye(n), -np.diag(omega**2), -rate
    b = np.zeros((2 * n, len(system.inputs)))
    b[1::2] = vectors.T @ system.input_map
    rows, names = _output_rows(system.output_map @ vectors, system.outputs, outputs)
    c = np.empty_like(rows)
    c[:, 0::2], c[:, 1::2] = rows[:, :n], rows[:, n:]
    states = tuple(f"{kind}{k + 1}" for k in range(n) for kind in ("q", "dq"))
    return StateSpace(a, b, c, np.zeros((len(c), b.shape[1])), _names(system.inputs), names, states)


def modal(modes: Modes, inputs: Sequence[Dof | str] | None = None, outputs: Sequence[Dof | str] | None = None,
          *, kind: str = "displacement") -> StateSpace:
    """Return real, mass-normalised viscous modes as states (amplitude, rate), two for each mode.

    The upper residual enters as feed-through D of the displacement; a lower residual cannot be represented and is refused.
    """
    if modes.scaling != "unit modal mass" or modes.damping != "viscous" or np.iscomplexobj(modes.shape):
        fail("modal", repr(modes), "must be real modes of unit modal mass with viscous damping",
             remedy="use state_space.physical, or damping.equivalent_viscous")
    if modes.lower_residual is not None:
        fail("modal", "a lower residual", "has no state-space form", remedy="identify the modes below the band")
    if modes.frequency.ndim > 1:
        fail("modal", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i)")
    rows = modes.shape if outputs is None else modes.shape_at(outputs)
    columns = modes.participation_at(modes.input_dofs or modes.dofs) if inputs is None else modes.participation_at(inputs)
    n, w = modes.count, modes.omega
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(w**2), -np.diag(2 * modes.damping_ratio * w)]])
    b = np.concatenate([np.zeros((n, columns.shape[0])), columns.T])
    c, names = _output_rows(rows, modes.dofs if outputs is None else outputs, kind)
    d: FloatArray = np.zeros((c.shape[0], b.shape[1]))
    if modes.upper_residual is not None:
        d = _feed_through(modes, inputs, outputs, kind)
    states = (*(f"mode{i + 1}" for i in range(n)), *(f"dmode{i + 1}" for i in range(n)))
    return StateSpace(a, b, c, d, _names(inputs or modes.input_dofs or modes.dofs), names, states)


def _feed_through(modes: Modes, inputs: object, outputs: object, kind: str) -> FloatArray:
    """Return the upper residual as feed-through matrix D."""
    if inputs is not None or outputs is not None or kind != "displacement":
        fail("modal", "an upper residual with chosen inputs, outputs or velocities", "enters all displacements only",
             remedy="cut the modes first with at_dofs")
    assert modes.upper_residual is not None
    return modes.upper_residual.real


def _output_rows(rows: FloatArray, labels: Sequence[Dof | str], kind: str) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the output matrix over (q, q') and its names for displacements, velocities or both."""
    one_of("outputs", kind, ("displacement", "velocity", "displacement and velocity"))
    zero, names = np.zeros_like(rows), _names(labels)
    if kind == "displacement":
        return np.concatenate([rows, zero], axis=1), names
    if kind == "velocity":
        return np.concatenate([zero, rows], axis=1), tuple("d" + name for name in names)
    return np.block([[rows, zero], [zero, rows]]), (*names, *("d" + name for name in names))


def _names(labels: Sequence[Dof | str]) -> tuple[str, ...]:
    return tuple(str(label) for label in labels)


def _labels(names: Sequence[str]) -> tuple[Dof, ...]:
    """Return names as Dofs; all are x directions of points of these names where one does not read as a Dof."""
    try:
        return tuple(Dof.parse(name) for name in names)
    except ValueError:
        return tuple(Dof(name, "+x") for name in names)


def _check_time_domain(system: SecondOrderSystem) -> None:
    """Refuse several poses, and structural damping, which has no time-domain form."""
    if system.poses:
        fail("state_space", f"{system.poses} poses", "must be one pose", remedy="use system.at_pose(i)")
    if system.structural_damping is not None and np.any(system.structural_damping):
        fail("state_space", "structural damping", "has no time-domain form",
             remedy="convert it with damping.equivalent_viscous(system)")
