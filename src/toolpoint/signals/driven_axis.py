r"""Responses of a structure that its own axis shakes: set-point noise in, motor force and motion out, in closed loop.

The motor's force answers the motion it causes, through the controller. The plain estimate :math:`S_{yu} / S_{uu}` mixes the
structure with the inverse of the controller, the more the louder the loads that are not the set point's. What correlates with
the set point r alone is free of them: :math:`H = S_{yr} / S_{ur}` (the set point as an instrument). Source: Söderström, Stoica,
System Identification, section 10.5; Wellstead, Automatica 17 (1981) 89.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import ComplexArray, FloatArray, fail, floats, positive
from toolpoint.signals.hammer import RESPONSE_QUANTITIES
from toolpoint.signals.windows import hann, independent_blocks
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

MIN_AXIS_BLOCKS = 8  # blocks, below which variance and coherence say little
MIN_REACH = 0.3  # coherence of set point and motor force, below which a line is not shaken


@dataclass(frozen=True, eq=False)
class DrivenAxisTest:
    """Responses of a driven axis.

    Examples
    --------
    >>> from toolpoint.signals import DrivenAxisTest, driven_axis_test
    >>> driven_axis_test.__annotations__["return"]
    'DrivenAxisTest'

    frf : to the motor's force, coherence that of motion and set point; reach : (n_f,), coherence of motor's force and set
    point: where it is low the set point shakes nothing; direct_values : (n_f, n_outputs), S_yu / S_uu, for comparison.
    """

    frf: Frf
    reach: FloatArray
    direct_values: ComplexArray

    @property
    def shaken(self) -> tuple[float, float]:
        """Band (Hz) from the lowest to the highest line that the set point shakes; equal ends where there is none."""
        lines = self.frf.frequency[self.reach >= MIN_REACH]
        return (float(lines[0]), float(lines[-1])) if lines.size else (0.0, 0.0)


def driven_axis_test(set_point: FloatArray, record: Record, resolution: float, *, band: tuple[float, float] | None = None
                     ) -> DrivenAxisTest:
    """Return the responses to the motor's force of an axis whose set point carried noise or a chirp.

    Parameters
    ----------
    set_point : (n_samples,) floats
        What was added to (or is) the set point, any unit.
    record : Record
        One channel of quantity ``force`` (motor torque or current in N at the axis), the others motions of one quantity.
    resolution : float
        Line spacing, Hz.
    band : (low, high) in Hz, optional
        Up to the sample rate over 2.56 where left out.

    Raises
    ------
    ToolpointError
        For several forces, fewer than eight blocks, a set point that shakes no line.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import driven_axis_test
    >>> from toolpoint.vibration import Record
    >>> r = np.random.default_rng(0).standard_normal(20_000)
    >>> record = Record(np.column_stack([2.0 * r, 0.5 * r]), 1000.0, ["motor:+y", "table:+y"], ["force", "acceleration"])
    >>> test = driven_axis_test(r, record, 2.0)  # a mass of 4 kg
    >>> bool(np.allclose(test.frf.values, 0.25)), round(float(test.reach.min()), 6)
    (True, 1.0)
    """
    forces = [k for k, quantity in enumerate(record.quantities) if quantity == "force"]
    outputs = [k for k in range(len(record.quantities)) if k not in forces]
    kinds = {record.quantities[k] for k in outputs}
    if len(forces) != 1 or len(kinds) != 1 or not kinds <= RESPONSE_QUANTITIES.keys():
        fail("record", f"{len(forces)} forces and responses of {', '.join(sorted(kinds)) or 'nothing'}",
             "must have one force (of the motor) and motions of one quantity")
    reference = floats("set_point", set_point, (record.samples.shape[0],))
    frequency, spectra, effective = _spectra(reference, record, resolution, band)
    r, u, y = spectra[:, :, 0], spectra[:, :, 1 + forces[0]], spectra[:, :, [1 + k for k in outputs]]
    s_rr, s_uu = (np.abs(r) ** 2).mean(axis=0), (np.abs(u) ** 2).mean(axis=0)
    s_ur, s_yr = (u * r.conj()).mean(axis=0), (y * r.conj()[:, :, None]).mean(axis=0)
    reach = np.abs(s_ur) ** 2 / np.maximum(s_rr * s_uu, 1e-300)
    if not (reach >= MIN_REACH).any():
        fail("set_point", f"coherence with the motor's force is at most {reach.max():.2g}", f"must reach {MIN_REACH:g}",
             remedy="take a louder set point, or check which signal it is")
    values = s_yr / s_ur[:, None]
    # What the motion does besides H u scatters the estimate: loads, noise, other axes.
    unexplained = (np.abs(y - values * u[:, :, None]) ** 2).mean(axis=0)
    variance = unexplained * (s_rr / np.maximum(np.abs(s_ur) ** 2, 1e-300))[:, None] / effective
    coherence = np.abs(s_yr) ** 2 / np.maximum(s_rr[:, None] * (np.abs(y) ** 2).mean(axis=0), 1e-300)
    frf = Frf(frequency, values[:, :, None], tuple(record.channels[k] for k in outputs), (record.channels[forces[0]],),
              RESPONSE_QUANTITIES[kinds.pop()], coherence=np.minimum(coherence, 1.0)[:, :, None], variance=variance[:, :, None],
              notes=("the set point is the instrument: loads and the controller do not bias the responses",))
    direct_values = (y * u.conj()[:, :, None]).mean(axis=0) / s_uu[:, None]
    return DrivenAxisTest(frf, reach, direct_values)


def _spectra(reference: FloatArray, record: Record, resolution: float, band: tuple[float, float] | None
             ) -> tuple[FloatArray, ComplexArray, float]:
    """Return frequency, the spectra (n_blocks, n_f, 1 + n_channels) of set point and channels, and the independent blocks."""
    rate = record.sample_rate
    block = round(rate / positive("resolution", resolution))
    window, step = hann(block), block // 2
    starts = np.arange(0, reference.size - block + 1, step)
    if starts.size < MIN_AXIS_BLOCKS:
        fail("resolution", f"{resolution:g} Hz leaves {starts.size} blocks", f"must leave {MIN_AXIS_BLOCKS} at least",
             remedy="record longer, or take wider lines")
    frequency = np.arange(block // 2 + 1) * (rate / block)
    low_end, high_end = band or (frequency[1], rate / 2.56)
    inside = (frequency >= low_end - 1e-9) & (frequency <= high_end + 1e-9)
    columns = np.column_stack([reference, record.samples])
    # The travel of a moving axis is a ramp in its position: it is taken off block by block.
    parts = [np.fft.rfft(scipy.signal.detrend(columns[start:start + block], axis=0) * window[:, None], axis=0)[inside]
             for start in starts.tolist()]
    return frequency[inside], np.stack(parts), independent_blocks(starts.size, window, step)
