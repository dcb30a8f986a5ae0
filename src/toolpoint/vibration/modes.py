"""Modes: poles and shapes, from a model or from a measurement."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import (
    Array,
    BoolArray,
    ComplexArray,
    FloatArray,
    ToolpointWarning,
    fail,
    floats,
    nonnegative,
    one_of,
    real_or_complex,
)
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.vibration.dof import Dof, check_labels, positions
from toolpoint.vibration.frf import Frf

SCALINGS = ("unit modal mass", "modal A", "unscaled")
DAMPING_KINDS = ("viscous", "structural")
_OVERDAMPED_REMARK = "Modes.damping_ratio:"


@dataclass(frozen=True, eq=False)
class Modes(NotebookText):
    r"""Natural frequencies, damping and shapes.

    The receptance of a mode with shape :math:`\phi` and participation :math:`\psi` (:math:`\psi` is the shape at the
    inputs where none is given) is, with :math:`\omega_r = 2 \pi f_r`,

    - ``unit modal mass``, viscous: :math:`\phi \psi^T / (\omega_r^2 - \omega^2 + 2 i \zeta_r \omega_r \omega)`;
    - ``unit modal mass``, structural: :math:`\phi \psi^T / (\omega_r^2 (1 + 2 i \zeta_r) - \omega^2)`, loss factor
      :math:`\eta = 2 \zeta`;
    - ``modal A``: :math:`\phi \psi^T / (i \omega - s_r) + \phi^* \psi^{*T} / (i \omega - s_r^*)`, a real pole
      (damping ratio 1 or -1) without the second term;
    - ``unscaled``: as ``modal A`` where `participation` is given, otherwise no response can be formed.

    A mode with frequency 0 and damping 0 is a rigid-body mode: in every scaling it has unit modal mass.
    Scalings after Ewins, Modal Testing, 2nd ed., section 2.

    Parameters
    ----------
    frequency : (..., n_modes) floats
        Undamped natural frequency ``|s|/2 pi``, Hz.
    damping_ratio : (..., n_modes) floats
        Ratio to critical; half the loss factor for structural damping. Above 1 only with unit modal mass, and marked.
    shape : (..., n_dofs, n_modes), real or complex
    dofs : sequence of Dof
        Labels of the rows of `shape`.
    scaling : str
        ``unit modal mass``, ``modal A`` or ``unscaled``.
    damping : str
        ``viscous`` or ``structural``.
    participation : (..., n_inputs, n_modes), optional
        Shape at the inputs where it is not a part of `shape`, with its labels `input_dofs`.
    lower_residual, upper_residual : (n_dofs, n_inputs) complex, optional
        Receptance added as lower/s^2 (modes below the band) and upper (modes above the band).
    covariance : (..., n_modes, 2, 2), optional
        Covariance of (frequency in Hz, damping ratio) of each mode.
    shape_variance : like `shape`, real, optional
        Variance ``E|e|^2`` of each shape entry.
    direct : Frf, optional
        Response solved directly on some lines, where the modes are only its equivalent between resonances: uses of the modes
        state their error by it.
    notes : sequence of str
        Doubts and remarks.

    Raises
    ------
    ToolpointError
        For wrong shapes, an unknown scaling, or a damping ratio beyond 1 of a modal A.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.vibration import Modes
    >>> modes = Modes([25.0, 80.0], [0.02, 0.01], np.array([[0.1, 0.05]]), ["tool:+x"])
    >>> modes.between(50, 100)
    Modes(1 real modes, 80..80 Hz, 1 dofs, unit modal mass, viscous)
    """

    frequency: FloatArray
    damping_ratio: FloatArray
    shape: Array
    dofs: tuple[Dof, ...]
    scaling: str = "unit modal mass"
    damping: str = "viscous"
    participation: Array | None = None
    input_dofs: tuple[Dof, ...] = ()
    lower_residual: ComplexArray | None = None
    upper_residual: ComplexArray | None = None
    covariance: FloatArray | None = None
    shape_variance: FloatArray | None = None
    notes: tuple[str, ...] = field(default=())
    direct: Frf | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        frequency = nonnegative("Modes.frequency", floats("Modes.frequency", np.atleast_1d(self.frequency)))
        count = frequency.shape[-1]
        put(self, "frequency", frequency)
        put(self, "damping_ratio", floats("Modes.damping_ratio", np.broadcast_to(self.damping_ratio, frequency.shape)))
        put(self, "shape", real_or_complex("Modes.shape", self.shape, (None, count)))
        put(self, "dofs", check_labels("Modes.dofs", self.dofs, self.shape.shape[-2]))
        one_of("Modes.scaling", self.scaling, SCALINGS)
        one_of("Modes.damping", self.damping, DAMPING_KINDS)
        if self.participation is not None:
            put(self, "participation", real_or_complex("Modes.participation", self.participation, (None, count)))
            put(self, "input_dofs",
                check_labels("Modes.input_dofs", self.input_dofs, self.participation.shape[-2]))
        elif self.input_dofs:
            fail("Modes.input_dofs", "given without participation", "must come with it")
        if self.covariance is not None:
            put(self, "covariance", floats("Modes.covariance", self.covariance, (count, 2, 2)))
        if self.shape_variance is not None:
            put(self, "shape_variance", floats("Modes.shape_variance", self.shape_variance, self.shape.shape[-2:]))
        self._check_residuals()
        put(self, "notes", tuple(self.notes))
        self._check_damping()

    def _check_damping(self) -> None:
        """Refuse a damping ratio that no pole pair has; mark a mode that does not vibrate (mostly a ratio in per cent).

        A modal A belongs to one pole: an overdamped pair has two, each a mode with ratio 1. With unit modal mass the response
        of an overdamped mode is right, that of two real poles.
        """
        ratio = np.abs(self.damping_ratio)
        if self.scaling == "unit modal mass":
            for note in remark_overdamped(ratio):
                if not any(text.startswith(_OVERDAMPED_REMARK) for text in self.notes):
                    # Four frames up: at the line of the caller, past the constructor that a dataclass writes.
                    warnings.warn(note, ToolpointWarning, stacklevel=4)
                    object.__setattr__(self, "notes", (*self.notes, note))
        elif ratio.max(initial=0.0) > 1 + 1e-9:
            peak = float(ratio.max())
            fail("Modes.damping_ratio", f"{peak:g}", "must be within -1 .. 1: such a pair of poles is no vibration mode",
                 remedy=f"{peak:g} % is written {peak / 100:g}; an overdamped pair is two modes of ratio 1, a real pole each")

    def _check_residuals(self) -> None:
        inputs = len(self.input_dofs) or len(self.dofs)
        for name in ("lower_residual", "upper_residual"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(
                    self, name, real_or_complex(f"Modes.{name}", value, (len(self.dofs), inputs)).astype(complex))

    @property
    def count(self) -> int:
        """Number of modes."""
        return int(self.frequency.shape[-1])

    @property
    def omega(self) -> FloatArray:
        """Undamped natural angular frequency, rad/s, shape (..., n_modes)."""
        return 2 * np.pi * self.frequency

    @property
    def poles(self) -> ComplexArray:
        """Upper pole s = -zeta w + i w sqrt(1 - zeta^2), rad/s, shape (..., n_modes)."""
        zeta = self.damping_ratio
        return self.omega * (-zeta + 1j * np.sqrt((1 - zeta**2).astype(complex)))

    @property
    def loss_factor(self) -> FloatArray:
        """Loss factor 2 zeta of every mode, shape (..., n_modes)."""
        return 2 * self.damping_ratio

    @property
    def is_rigid(self) -> BoolArray:
        """Whether each mode is a rigid-body mode (frequency and damping zero), shape (..., n_modes)."""
        return (self.frequency == 0) & (self.damping_ratio == 0)

    @property
    def frequency_interval(self) -> FloatArray:
        """Half width of the 95 % interval of each frequency, Hz, shape (..., n_modes); needs `covariance`.

        NaN where the variance is negative: nearly equal modes that cancel each other have no certainty of their own.
        """
        return self._half_width(0)

    @property
    def damping_interval(self) -> FloatArray:
        """Half width of the 95 % interval of each damping ratio, NaN as for the frequency, shape (..., n_modes)."""
        return self._half_width(1)

    def _half_width(self, quantity: int) -> FloatArray:
        if self.covariance is None:
            fail("Modes.covariance", "none", "must be given for an interval",
                 remedy="identify with a method that estimates it")
        variance = self.covariance[..., quantity, quantity]
        # A variance below zero marks a mode whose interval is not known: no number is better than one that looks exact.
        return NORMAL_QUANTILE_95 * np.sqrt(np.where(variance >= 0, variance, np.nan))

    def shape_at(self, dofs: Iterable[Dof | str | int]) -> Array:
        """Return the rows of the shapes at these Dofs, shape (..., n_wanted, n_modes)."""
        return self.shape[..., positions("dofs", dofs, self.dofs), :]

    def participation_at(self, dofs: Iterable[Dof | str | int]) -> Array:
        """Return the shapes at these inputs, from the participation where one is given."""
        if self.participation is None:
            return self.shape_at(dofs)
        return self.participation[..., positions("inputs", dofs, self.input_dofs), :]

    def selected(self, modes: Iterable[int]) -> Modes:
        """Return these modes, in the order asked for."""
        picks = list(modes)
        if any(not -self.count <= i < self.count for i in picks):
            fail("selected", f"modes {picks}", f"must be within 0 .. {self.count - 1}")
        select = (lambda a: None if a is None else a[..., picks])
        covariance = None if self.covariance is None else self.covariance[..., picks, :, :]
        return replace(
            self, frequency=self.frequency[..., picks], damping_ratio=self.damping_ratio[..., picks],
            shape=self.shape[..., picks],
            participation=select(self.participation), covariance=covariance, shape_variance=select(self.shape_variance))

    def between(self, frequency_min: float, frequency_max: float) -> Modes:
        """Return the modes with low <= frequency <= high (Hz); one pose only."""
        if self.frequency.ndim > 1:
            fail("between", f"{self.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i) first")
        return self.selected(np.flatnonzero((self.frequency >= frequency_min) & (self.frequency <= frequency_max)).tolist())

    def at_dofs(self, dofs: Iterable[Dof | str | int]) -> Modes:
        """Return the modes seen at these Dofs only."""
        rows = positions("dofs", dofs, self.dofs)
        select = (lambda r: None if r is None else r[rows] if self.input_dofs else r[np.ix_(rows, rows)])
        variance = None if self.shape_variance is None else self.shape_variance[..., rows, :]
        return replace(
            self, shape=self.shape[..., rows, :], dofs=tuple(self.dofs[i] for i in rows), shape_variance=variance,
            lower_residual=select(self.lower_residual), upper_residual=select(self.upper_residual),
            direct=self._direct_at([self.dofs[i] for i in rows]))

    def _direct_at(self, dofs: list[Dof]) -> Frf | None:
        if self.direct is None:
            return None
        return self.direct.selected(dofs) if self.input_dofs else self.direct.selected(dofs, dofs)

    def at_pose(self, index: int) -> Modes:
        """Return the modes of one pose of a batch."""
        if self.frequency.ndim == 1:
            fail("at_pose", "a single pose", "must be a batch")
        select = (lambda a: a[index] if a is not None and a.ndim > 2 else a)
        covariance = self.covariance
        if covariance is not None and covariance.ndim > 3:
            covariance = covariance[index]
        return replace(
            self, frequency=self.frequency[index], damping_ratio=self.damping_ratio[index], shape=select(self.shape),
            participation=select(self.participation), shape_variance=select(self.shape_variance), covariance=covariance,
            direct=None if self.direct is None else self.direct.at_pose(index))

    def with_damping(self, ratio: float | FloatArray, kind: str = "viscous") -> Modes:
        """Return real, mass-normalised modes with these damping ratios in place of their own."""
        if self.scaling != "unit modal mass":
            fail("with_damping", f"scaling {self.scaling!r}", "must be 'unit modal mass'")
        ratio = floats("ratio", np.broadcast_to(ratio, self.frequency.shape))
        # A rigid-body mode has no frequency to which a ratio could belong.
        return replace(self, damping_ratio=np.where(self.frequency > 0, ratio, 0.0), damping=kind, covariance=None)

    def noted(self, note: str) -> Modes:
        """Return the same modes with one more remark."""
        return replace(self, notes=(*self.notes, note))

    def table(self) -> str:
        """Return frequency, damping and their 95 % intervals as text, one line a mode (one pose)."""
        if self.frequency.ndim > 1:
            fail("table", f"{self.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i) first")
        lines = [" mode   frequency Hz   damping %" + ("       ± Hz       ± %" if self.covariance is not None else "")]
        for i in range(self.count):
            line = f"{i + 1:5d} {self.frequency[i]:14.4f} {100 * self.damping_ratio[i]:11.4f}"
            if self.covariance is not None:
                line += f" {self.frequency_interval[i]:10.2g} {100 * self.damping_interval[i]:9.2g}"
            lines.append(line)
        return "\n".join(lines)

    def __repr__(self) -> str:
        poses = "" if self.frequency.ndim == 1 else f"{'x'.join(map(str, self.frequency.shape[:-1]))} poses, "
        kind = "complex" if np.iscomplexobj(self.shape) else "real"
        span = f"{self.frequency.min():.4g}..{self.frequency.max():.4g} Hz" if self.frequency.size else "none"
        return f"Modes({poses}{self.count} {kind} modes, {span}, {len(self.dofs)} dofs, {self.scaling}, {self.damping})"


def remark_overdamped(ratio: FloatArray) -> tuple[str, ...]:
    """Return the remark on modes (last axis) with a damping ratio of 1 or more, for the notes of Modes; none where all vibrate.

    A model whose dampers are strong has such modes rightly; Modes made without this remark are warned of.
    """
    size = np.abs(ratio)
    largest = float(size.max(initial=0.0))
    if largest < 1:
        return ()
    mode = int(np.argmax(size.reshape(-1, size.shape[-1]).max(axis=0))) + 1
    return (f"{_OVERDAMPED_REMARK} {largest:g} in mode {mode}, {100 * largest:g} % of critical: no vibration mode; "
            f"{largest:g} % is written {largest / 100:g}",)
