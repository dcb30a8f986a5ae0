r"""Dynamics of a tapped tip: the modes of both directions as one model, their uncertainty, and their missing cross response.

Limits are computed on modes, not on lines: noise of integrated accelerations grows without limit towards low frequencies, lines
of short records are wider than light modes, and the damping that a window adds is removed from the poles. Modes are drawn
within their uncertainty: poles from their covariance, sizes from the scatter of the hits. A mode that x and y share may be one
that is turned, with a cross response :math:`\pm\sqrt{R_x R_y}` that was not measured: the draws take either sign, and none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import BoolArray, FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.modal_identification import Identification
from toolpoint.studies.cuts.tip_doubts import OUTSIDE_DAMPING_RATIO
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.frequency_response import modal

# relative standard deviations where hits show no scatter
ASSUMED_SIZE_DEVIATION, ASSUMED_FREQUENCY_DEVIATION, ASSUMED_DAMPING_DEVIATION = 0.05, 0.01, 0.1
# relative distance of two modes that may be one, beside their intervals
SHARED_FREQUENCY_TOLERANCE, SHARED_DAMPING_TOLERANCE = 2e-3, 0.15
MAX_SHARED_DEVIATIONS = 3.0  # standard deviations between two modes that may be one
MIN_COMPLIANCE_RATIO = 0.1  # of the largest compliance: a smaller one moves no limit by more
# Draws of wide intervals end here: a mode without size or damping is none that was identified.
MIN_SIZE_FACTOR, MIN_DAMPING_RATIO = 0.05, 1e-4
LABELS = (Dof("tool", "+x"), Dof("tool", "+y"))


@dataclass(frozen=True, eq=False)
class TappedModes:
    """Modes of one direction of the tip.

    frequency : Hz; damping : ratios; residue : complex, modal A; size : relative deviation of each size; covariance : of the
    poles, (n, 2, 2); upper : static part of modes above, m/N; lower : mass-like part of modes below, m/N s^2; vibrates : which
    of the identified modes these are, those that vibrate and decay.
    """

    frequency: FloatArray
    damping: FloatArray
    residue: np.ndarray
    size: FloatArray
    covariance: FloatArray
    upper: float
    lower: float
    has_scatter: bool
    vibrates: BoolArray

    @property
    def compliance(self) -> FloatArray:
        """Height of every mode's peak, m/N."""
        return np.abs(self.residue) / (2 * np.pi * self.frequency * np.maximum(np.abs(self.damping), MIN_DAMPING_RATIO))

    @property
    def stiffness(self) -> float:
        """Static stiffness of all modes together, N/m."""
        # A pole s of residue R has the static part -2 Re(R/s).
        s = 2 * np.pi * self.frequency * (-self.damping + 1j * np.sqrt(1 - self.damping**2))
        return 1 / max(float(-2 * (self.residue / s).real.sum()) + self.upper, 1e-300)

    def drawn(self, rng: np.random.Generator) -> TappedModes:
        """Return the modes with errors as large as they may have, the sizes by one number for all (the widest case)."""
        errors = np.array([rng.multivariate_normal(np.zeros(2), part) for part in self.covariance]).reshape(-1, 2)
        factor = np.maximum(1 + self.size * rng.standard_normal(), MIN_SIZE_FACTOR)
        return replace(self, frequency=np.maximum(self.frequency + errors[:, 0], 0.5 * self.frequency),
                       # A wide interval reaches below zero: such a draw would be a machine that chatters by itself.
                       damping=np.clip(self.damping + errors[:, 1], 0.2 * self.damping, 0.99),
                       residue=self.residue * factor, upper=self.upper * float(np.median(factor)))


def take_modes(identified: Identification, tip: Frf, label: Dof | str) -> TappedModes:
    """Return the modes of a direction from its identification and the response at the tip.

    Raises ToolpointError where the modes have no scale (no driving point).
    """
    modes = identified.modes
    if modes.scaling == "unscaled":
        raise ToolpointError(f"{label}: modes without scale; strike and measure at one point")
    row = np.asarray(modes.shape_at([label])[0] * modes.participation_at([label])[0], complex)
    has_scatter = tip.variance is not None and modes.covariance is not None
    covariance = modes.covariance
    if covariance is None or not has_scatter:
        covariance = np.einsum("ij,jk->ijk", np.stack([ASSUMED_FREQUENCY_DEVIATION * modes.frequency,
                                                       ASSUMED_DAMPING_DEVIATION * modes.damping_ratio], axis=1) ** 2,
                               np.eye(2))
    upper = 0.0 if modes.upper_residual is None else float(_residual_entry(modes.upper_residual, modes, label).real)
    lower = 0.0 if modes.lower_residual is None else float(_residual_entry(modes.lower_residual, modes, label).real)
    vibrates = (modes.damping_ratio > 0) & (modes.damping_ratio < 1)
    if not vibrates.any():
        raise ToolpointError(f"{label}: none of {modes.count} modes vibrates and dies away; look at the records, and strike "
                             "again")
    return TappedModes(modes.frequency[vibrates], modes.damping_ratio[vibrates], row[vibrates], _sizes(tip, modes)[vibrates],
                       np.nan_to_num(covariance)[vibrates], upper, lower, has_scatter, vibrates)


def _residual_entry(residual: np.ndarray, modes: Modes, label: Dof | str) -> complex:
    dof = Dof.parse(str(label))
    return complex(residual[modes.dofs.index(dof), (modes.input_dofs or modes.dofs).index(dof)])


def _sizes(tip: Frf, modes: Modes) -> FloatArray:
    """Return the relative standard deviation of every mode's size: the scatter of hits within its width."""
    if tip.variance is None:
        return np.full(modes.count, ASSUMED_SIZE_DEVIATION)
    share = np.sqrt(tip.variance[:, 0, 0]) / np.maximum(np.abs(tip.values[:, 0, 0]), 1e-300)
    step = float(np.median(np.diff(tip.frequency)))
    sizes = []
    for frequency, ratio in zip(modes.frequency, np.abs(modes.damping_ratio), strict=True):
        is_near = np.abs(tip.frequency - frequency) <= max(ratio * frequency, 1.5 * step)
        sizes.append(float(np.median(share[is_near])) if is_near.any() else ASSUMED_SIZE_DEVIATION)
    return np.array(sizes)


@dataclass(frozen=True, eq=False)
class TappedTip:
    """Modes along x and, where it was struck, along y; pairs of modes that may be one."""

    x: TappedModes
    y: TappedModes | None
    shared: tuple[tuple[int, int], ...]
    notes: tuple[str, ...] = ()

    @property
    def compliance(self) -> float:
        """Largest peak of all modes, m/N."""
        return max(float(part.compliance.max(initial=0.0)) for part in (self.x, self.y) if part is not None)

    @property
    def is_known(self) -> bool:
        """Whether hits show the scatter of every direction."""
        return all(part.has_scatter for part in (self.x, self.y) if part is not None)

    @property
    def turned(self) -> tuple[float, ...]:
        """Frequencies (Hz) of shared modes whose cross response would matter."""
        if self.y is None:
            return ()
        cross = [np.sqrt(self.x.compliance[i] * self.y.compliance[j]) for i, j in self.shared]
        return tuple(float(self.x.frequency[i]) for (i, _), size in zip(self.shared, cross, strict=True)
                     if size > MIN_COMPLIANCE_RATIO * self.compliance)

    def dynamics(self, signs: dict[tuple[int, int], int] | None = None) -> ToolDynamics:
        """Return the dynamics with the shared modes as one (sign of the cross response +1 or -1) or two (0, or not there)."""
        if self.y is None:
            return ToolDynamics(_modes(self.x, self.x.residue[None] ** 0.5, self.x.upper), "tool:+x", "same", None, self.notes,
                                "the tap")
        x, y = self.x, self.y
        first, second = x.residue**0.5, y.residue**0.5
        rows_x = np.concatenate([first, np.zeros(second.size)]).astype(complex)
        rows_y = np.concatenate([np.zeros(first.size), second]).astype(complex)
        kept = np.ones(rows_x.size, bool)
        for (i, j), sign in (signs or {}).items():
            if sign:
                like = 1.0 if (first[i] * second[j].conj()).real >= 0 else -1.0
                rows_y[i], kept[first.size + j] = sign * like * second[j], False
        both = replace(x, frequency=np.append(x.frequency, y.frequency)[kept], damping=np.append(x.damping, y.damping)[kept])
        return ToolDynamics(_modes(both, np.stack([rows_x, rows_y])[:, kept], x.upper, y.upper), "tool:+x", "tool:+y", None,
                            self.notes, "the tap")

    def drawn(self, rng: np.random.Generator) -> ToolDynamics:
        """Return the dynamics of a tip that the test may have been of."""
        signs = {pair: int(sign) for pair, sign in zip(self.shared, rng.integers(-1, 2, len(self.shared)), strict=True)}
        y = None if self.y is None else self.y.drawn(rng)
        return replace(self, x=self.x.drawn(rng), y=y).dynamics(signs)


def join_directions(x: TappedModes, y: TappedModes | None, notes: tuple[str, ...] = ()) -> TappedTip:
    """Return both directions with the modes that they may share."""
    return TappedTip(x, y, () if y is None else _pair_shared_modes(x, y), notes)


def _pair_shared_modes(x: TappedModes, y: TappedModes) -> tuple[tuple[int, int], ...]:
    pairs: list[tuple[int, int]] = []
    for i in range(x.frequency.size):
        gap = np.abs(y.frequency - x.frequency[i])
        frequency_tolerance = (MAX_SHARED_DEVIATIONS * np.sqrt(x.covariance[i, 0, 0] + y.covariance[:, 0, 0])
                               + SHARED_FREQUENCY_TOLERANCE * x.frequency[i])
        damping = np.abs(y.damping - x.damping[i])
        damping_tolerance = MAX_SHARED_DEVIATIONS * np.sqrt(x.covariance[i, 1, 1] +
                                                            y.covariance[:, 1, 1]) + SHARED_DAMPING_TOLERANCE * x.damping[i]
        free = np.array([j not in {k for _, k in pairs} for j in range(y.frequency.size)], bool)
        fits = np.flatnonzero((gap <= frequency_tolerance) & (damping <= damping_tolerance) & free)
        if fits.size:
            pairs.append((i, int(fits[np.argmin(gap[fits])])))
    return tuple(pairs)


def _modes(part: TappedModes, shape: np.ndarray, *upper: float) -> Modes:
    labels: Any = LABELS[:shape.shape[0]]
    return Modes(part.frequency, part.damping, shape, labels, "modal A", participation=shape, input_dofs=labels,
                 upper_residual=np.diag(upper).astype(complex))


def measure_misfit(identified: Identification, tip: Frf, band: tuple[float, float]) -> float:
    """Return the share of the tip's receptance (energy in the band) that its modes do not explain."""
    inside = tip.between(*band).converted_to("receptance")
    bare = replace(inside, quantity="receptance")
    label = str(inside.outputs[0])
    synthesis = identified.synthesis.selected([label], [label]).converted_to("receptance")
    lines = np.interp(bare.frequency, synthesis.frequency, np.arange(synthesis.frequency.size)).round().astype(int)
    residual = np.abs(bare.values[:, 0, 0] - synthesis.values[lines, 0, 0]) ** 2
    return float(residual.sum() / max(float((np.abs(bare.values[:, 0, 0]) ** 2).sum()), 1e-300))


def question_ends(name: str, part: TappedModes, band: tuple[float, float]) -> list[Doubt]:
    """Return doubts about modes above and below the band: soft enough to chatter by themselves, or to be felt."""
    line = np.linspace(*band, 4000)
    response = modal(_modes(part, part.residue[None] ** 0.5, 0.0), line).values[:, 0, 0]
    deepest = float(np.maximum(-response.real, 0.0).max())
    doubts = []
    if part.upper / (4 * OUTSIDE_DAMPING_RATIO) > deepest:
        doubts.append(Doubt(f"modes along {name}", f"what vibrates above {band[1]:.4g} Hz is as soft as "
                            f"{part.upper * 1e6:.2g} µm/N: damped as lightly as {100 * OUTSIDE_DAMPING_RATIO:g} % it chatters "
                            f"before any mode "
                            "that was seen", "strike with a harder tip and sample faster",
                            figure=part.upper / (4 * OUTSIDE_DAMPING_RATIO) / max(deepest, 1e-300)))
    soft = part.compliance > MIN_COMPLIANCE_RATIO * part.compliance.max(initial=0.0)
    lowest = float(part.frequency[soft].min())
    below = abs(part.lower) / (2 * np.pi * lowest) ** 2 / float(part.compliance.max())
    if below > MIN_COMPLIANCE_RATIO:
        doubts.append(Doubt(f"modes along {name}", f"what vibrates below {band[0]:.4g} Hz is felt at {lowest:.4g} Hz "
                            f"({100 * below:.0f} % of the highest peak) and is left out",
                            "strike harder with a softer tip, and take longer records", figure=below))
    return doubts
