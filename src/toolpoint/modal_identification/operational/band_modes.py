"""Modes of one band of operational records: correlations, poles of all orders, selection, shapes, and a second method
beside."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.operational.bands import SearchBand, decimate
from toolpoint.modal_identification.operational.correlations import Correlations, correlate_blocks
from toolpoint.modal_identification.operational.drift import question_drift
from toolpoint.modal_identification.operational.mode_selection import SelectedModes, select_modes
from toolpoint.modal_identification.operational.shapes import fit_shapes
from toolpoint.modal_identification.operational.spectra import SingularSpectra, half_spectra, singular_spectra
from toolpoint.modal_identification.operational.subspace import subspace_poles
from toolpoint.modal_identification.poles.plscf import poles_of_orders
from toolpoint.modal_identification.poles.selection import select_poles
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.vibration.dof import Dof


@dataclass(frozen=True)
class Subspace:
    """Stochastic subspace identification.

    Parameters
    ----------
    order : int
        Highest model order: two for each mode, and room for what colours the loads.
    rows : int
        Block rows: the correlations reach over twice as many samples, four periods of the lowest frequency of a band.
    blocks : int
        Blocks of the record whose scatter gives the covariance; fewer where the record is short.
    weight_past : bool
        False: from correlations (SSI-cov). True: weighted as the projection of the data on their past (SSI-data).
    """

    order: int = 60
    rows: int = 40
    blocks: int = 40
    weight_past: bool = False

    @property
    def name(self) -> str:
        """Name in messages."""
        return "data-driven subspace identification" if self.weight_past else "covariance-driven subspace identification"


OPERATIONAL_METHODS: dict[str, Subspace] = {"ssi-cov": Subspace(), "ssi-data": Subspace(weight_past=True)}
HALF_SPECTRA_ORDER = 40
MAX_CONFIRMED_DEVIATION = 0.3  # of frequency or damping, in half widths (ratios), of a mode that pLSCF finds too
MIN_POWER_SHARE = 1e-5  # of the power of all channels
MAX_UNCONFIRMED_DEVIATION = 0.1  # of a mode that it does not
SCATTER_SHARE = 0.5  # of the variance across orders that goes into the covariance
SPECTRUM_LINES = 512


@dataclass(frozen=True, eq=False)
class BandModes:
    """Modes of one band with what was found beside them; arrays by mode.

    `poles` rad/s; `frequency` Hz; `covariance` (n_modes, 2, 2) of frequency and damping ratio; `shape` (n_channels, n_modes)
    in units of the channels; `shape_variance` likewise; `support`, `power_share`, `confirmed` as in OperationalIdentification.
    """

    poles: ComplexArray
    covariance: FloatArray
    shape: ComplexArray
    shape_variance: FloatArray
    support: FloatArray
    power_share: FloatArray
    confirmed: BoolArray
    diagram: Diagram
    spectra: SingularSpectra
    doubts: tuple[Doubt, ...] = field(default=())

    @property
    def frequency(self) -> FloatArray:
        """Natural frequency of every mode, Hz."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> FloatArray:
        """Damping ratio of every mode."""
        return -self.poles.real / np.abs(self.poles)


def identify_band(samples: list[FloatArray], channels: tuple[Dof, ...], references: list[int], *, settings: Subspace,
                  rate: float,
                  band: SearchBand) -> BandModes:
    """Return the modes of records (n_samples, n_channels) within a band; `rate` samples per second, `references` columns."""
    slower = [decimate(part, band.decimation) for part in samples]
    interval = band.decimation / rate
    # Channels of unlike levels count alike, and white noise of a channel stays white: one factor a channel.
    # It is that of the whole record, so that the spectra of all bands meet.
    level = np.sqrt(sum((part**2).sum(axis=0) for part in samples) / sum(part.shape[0] for part in samples))
    scaled = [part / level for part in slower]
    correlations = correlate_blocks(scaled, interval, references, lags=2 * settings.rows - 1, blocks=band.blocks)
    # All modes below the top are sought, as the shapes of those within the band are fitted beside them.
    omega_range = (0.0, 2 * np.pi * band.frequency_max)
    all_poles = subspace_poles(correlations, settings.order, omega_range=omega_range, weight_past=settings.weight_past)
    candidates = select_modes(all_poles)
    confirmed = _confirm(correlations, channels, candidates, omega_range)
    kept = _believable(candidates, confirmed)
    selected, confirmed = candidates.chosen(kept), confirmed[kept]
    fitted = fit_shapes(correlations, selected.poles, selected.deviations, rows=settings.rows)
    blocks = correlations.blocks.shape[0]
    # The motion of a mode has positive power in every channel. Where the fit needs a negative one, a pole that is not known
    # well # describes something else; the power of a weak mode beside a strong one can come out negative too.
    has_power = (fitted.power_share > MIN_POWER_SHARE) | (_relative_deviation(selected) < MAX_UNCONFIRMED_DEVIATION)
    is_inside = (np.abs(selected.poles) >= 2 * np.pi * band.frequency_min) & has_power
    selected, confirmed, fitted = selected.chosen(is_inside), confirmed[is_inside], fitted.chosen(is_inside)
    spread = (np.abs(fitted.deviations) ** 2).sum(axis=0) / (blocks * (blocks - 1))
    lines = min(SPECTRUM_LINES, min(part.shape[0] for part in scaled) // 16)
    return BandModes(
        selected.poles, pole_covariance(selected), fitted.shape * level[:, None], spread * level[:,
                                                                                                 None] ** 2, selected.support,
        fitted.power_share, confirmed, all_poles.diagram, singular_spectra(scaled, 1 / interval, lines),
        question_drift(selected, blocks))


def pole_covariance(selected: SelectedModes) -> FloatArray:
    r"""Return the covariance of frequency (Hz) and damping ratio of every mode, shape (n_modes, 2, 2).

    With s the pole, :math:`\delta f = \Re(s^* \delta s) / 2 \pi |s|` and
    :math:`\delta \zeta = -(\Re \delta s + \zeta\, \delta |s|) / |s|`. The scatter across the orders comes beside that of the
    blocks.
    """
    poles, blocks = selected.poles, selected.deviations.shape[0]
    size, ratio = np.abs(poles), -poles.real / np.abs(poles)

    def changes(deviation: ComplexArray) -> FloatArray:
        """Return the changes of frequency and damping, shape (..., n_modes, 2)."""
        radial = (deviation * poles.conj()).real / size
        return np.stack([radial / (2 * np.pi), -(deviation.real + ratio * radial) / size], axis=-1)

    moved = changes(selected.deviations)
    covariance = np.einsum("bmi,bmj->mij", moved, moved) / (blocks * (blocks - 1))
    # Part of the scatter is noise that the blocks hold already: intervals with all of it held 98 % where 95 % are stated.
    for part in (np.sqrt(SCATTER_SHARE * selected.scatter.real), 1j * np.sqrt(SCATTER_SHARE * selected.scatter.imag)):
        change = changes(part[None])[0]
        covariance += change[:, :, None] * change[:, None, :]
    return covariance


def _believable(candidates: SelectedModes, confirmed: BoolArray) -> BoolArray:
    """Return whether each candidate is a mode: its pole is known within a part of its half width, a smaller one where pLSCF
    lacks it.

    Bands in which nothing resonates give poles that return with the order, and whose blocks even agree: the mean correlations
    have them, by chance. Another method does not.
    """
    deviation = _relative_deviation(candidates)
    return np.asarray(deviation < np.where(confirmed, MAX_CONFIRMED_DEVIATION, MAX_UNCONFIRMED_DEVIATION))


def _relative_deviation(modes: SelectedModes) -> FloatArray:
    """Return the larger standard deviation of frequency, in half widths, and of the damping ratio, over it, (n_modes,)."""
    covariance = pole_covariance(modes)
    frequency, ratio = np.abs(modes.poles) / (2 * np.pi), -modes.poles.real / np.abs(modes.poles)
    return np.asarray(np.sqrt(np.maximum(covariance[:, 0, 0] / frequency**2, covariance[:, 1, 1])) / ratio)


def _confirm(correlations: Correlations, channels: tuple[Dof, ...], selected: SelectedModes,
             omega_range: tuple[float, float]) -> BoolArray:
    """Return whether pLSCF on half spectra has a pole within the half width of each mode."""
    frf = half_spectra(correlations, channels)
    is_inside = frf.between(max(omega_range[0] / (2 * np.pi), float(frf.frequency[0])), omega_range[1] / (2 * np.pi))
    order = min(HALF_SPECTRA_ORDER, is_inside.frequency.size // 3)
    if order < 4 or selected.poles.size == 0:
        return np.zeros(selected.poles.size, bool)
    choice = select_poles(poles_of_orders(is_inside, order))
    # What the references participate with depends on the loads and is no shape: poles alone are compared.
    distance = np.abs(selected.poles[:, None] - (choice.poles + frf.decay))
    return np.asarray((distance < np.maximum(np.abs(selected.poles.real), 1e-3 * np.abs(selected.poles))[:, None]).any(axis=1))
