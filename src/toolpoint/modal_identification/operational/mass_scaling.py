r"""Mass scaling of operational modes: shapes of unit modal mass by an added mass, a driving-point response, or a model.

A mass added at some degrees of freedom lowers the frequency of a mode; with its shape :math:`\phi` and :math:`\Delta M`
diagonal,

.. math:: \alpha^2 = \frac{\omega_0^2 - \omega_1^2}{\omega_1^2\, \phi^T \Delta M\, \phi},

and :math:`\alpha \phi` has unit modal mass (Parloo, Verboven, Guillaume, Van Overmeire, MSSP 16 (2002) 757; Brincker, Andersen,
IMAC 21 (2003)). It is of first order in the mass: shapes are taken as unchanged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, fail, nonnegative
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.judgement.complexity import real_modes
from toolpoint.modal_identification.residues import residues
from toolpoint.vibration.correlation import mac, modal_scale_factor
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MIN_PAIRED_MAC = 0.9  # of a mode with and without the added mass, or of a test and a model
MIN_SHIFT_DEVIATIONS = 4.0  # of the frequency shift by an added mass
MAX_FIRST_ORDER_SHIFT = 0.05  # relative: beyond, the shapes change too


def scale_by_added_mass(modes: Modes, loaded: Modes, masses: Mapping[str, float]) -> tuple[Modes, tuple[Doubt, ...]]:
    """Return the modes with unit modal mass, from a second test with known masses added, and doubts about the scale.

    Parameters
    ----------
    modes, loaded : Modes
        Without and with the masses; shapes at the same channels, with covariance of the frequencies.
    masses : mapping of degree of freedom to kg
        A mass at a point counts in every measured direction of that point: name each of them.

    Returns
    -------
    Modes, doubts
        Modes whose shift cannot be told from its deviation are left out and named.

    Raises
    ------
    ToolpointError
        For a mass at a degree of freedom that was not measured, a negative one, or no mode that can be scaled.
    """
    real, other = _as_real(modes), _as_real(loaded)
    weight = np.zeros(len(real.dofs))
    for label, mass in masses.items():
        nonnegative(f"masses[{label!r}]", np.array(mass))
        rows = [i for i, dof in enumerate(real.dofs) if str(dof) == str(Dof.parse(label))]
        if not rows:
            fail("masses", label, "must be a measured degree of freedom", remedy=f"there are {', '.join(map(str, real.dofs))}")
        weight[rows[0]] = mass
    likeness = mac(real.shape, other.shape_at(real.dofs))
    kept, scales, relative, doubts = [], [], [], []
    for i in range(real.count):
        j = int(np.argmax(likeness[i]))
        name = f"mode at {real.frequency[i]:.4g} Hz"
        power = float(weight @ real.shape[:, i] ** 2)
        shift = float(real.omega[i] ** 2 / other.omega[j] ** 2 - 1)
        deviation = 2 * np.hypot(_relative_deviation(modes, i), _relative_deviation(loaded, j))
        if likeness[i, j] < MIN_PAIRED_MAC or power <= 0 or shift < MIN_SHIFT_DEVIATIONS * deviation:
            doubts.append(Doubt(name,
                                f"the added mass shifts it by {50 * shift:.2g} % +- {98 * deviation:.2g} % (MAC "
                                f"{likeness[i, j]:.2f} with its pair): it cannot be scaled",
                                "add more mass, where the mode moves more, or record longer"))
            continue
        if shift > 2 * MAX_FIRST_ORDER_SHIFT:
            doubts.append(Doubt(name,
                                f"the added mass shifts it by {50 * shift:.2g} %: the shape changes too, and the scale is of "
                                "first order", "add less mass", figure=shift / 2))
        kept.append(i)
        scales.append(np.sqrt(shift / power))
        relative.append(0.5 * deviation / shift)
    if not kept:
        fail("loaded", "no mode shifted beyond its interval", "must hold at least one",
             remedy="add more mass, or record longer")
    return _scaled(real.selected(kept), np.array(scales), np.array(relative)), tuple(doubts)


def scale_by_driving_point(modes: Modes, frf: Frf) -> Modes:
    """Return the modes with unit modal mass, from one driving-point response of a hammer blow.

    frf : Frf
        One output and one input at the same measured degree of freedom. Its residues at the poles of the modes give the scale:
        the residue of a real mode is :math:`(\\alpha \\phi_p)^2 / 2 i \\omega_d`.

    Raises ToolpointError where the response is no driving point, or its point was not measured.
    """
    if len(frf.inputs) != 1 or frf.outputs != frf.inputs:
        fail("frf", repr(frf), "must be one driving-point response: seen where it is struck")
    if frf.inputs[0] not in modes.dofs:
        fail("frf", str(frf.inputs[0]), "must be a degree of freedom of the modes")
    real = _as_real(modes)
    inside = np.flatnonzero((real.frequency > frf.frequency[0]) & (real.frequency < frf.frequency[-1])).tolist()
    poles = modes.poles[inside]
    size = (residues(frf, poles).values[0, 0] * 2j * poles.imag).real
    at_point = real.selected(inside).shape_at(frf.inputs)[0]
    good = size > 0
    if not good.any():
        fail("frf", "no mode moves its point in phase with the force", "must show at least one",
             remedy="check the sign of the force and of the sensor")
    picks = [i for i, ok in zip(inside, good, strict=True) if ok]
    return _scaled(real.selected(picks), np.sqrt(size[good]) / np.abs(at_point[good]), None)


def scale_by_model(modes: Modes, model: Modes) -> Modes:
    """Return the modes with unit modal mass, each scaled to the mode of a model (unit modal mass) that is most alike.

    Raises ToolpointError where the model is not of unit modal mass or no mode is alike (MAC 0.9).
    """
    if model.scaling != "unit modal mass":
        fail("model", f"scaling {model.scaling!r}", "must be 'unit modal mass'")
    real = _as_real(modes)
    shapes = model.shape_at(real.dofs)
    likeness = mac(real.shape, shapes)
    pairs = [(i, int(np.argmax(row))) for i, row in enumerate(likeness) if row.max() >= MIN_PAIRED_MAC]
    if not pairs:
        fail("model", f"largest MAC {likeness.max():.2f}", f"must be at least {MIN_PAIRED_MAC} with a mode")
    factors = modal_scale_factor(real.shape, shapes)
    return _scaled(real.selected([i for i, _ in pairs]), np.abs(np.array([factors[i, j] for i, j in pairs])), None)


def _as_real(modes: Modes) -> Modes:
    """Return the modes with real shapes: operational shapes of small structures at work are nearly so."""
    return real_modes(modes) if np.iscomplexobj(modes.shape) else modes


def _relative_deviation(modes: Modes, i: int) -> float:
    return 0.0 if modes.covariance is None else float(np.sqrt(modes.covariance[i, 0, 0]) / modes.frequency[i])


def _scaled(modes: Modes, scale: FloatArray, relative: FloatArray | None) -> Modes:
    """Return the modes times a scale each, of unit modal mass; `relative` deviations of the scale go into the shape
    variance."""
    variance = None if modes.shape_variance is None else modes.shape_variance * scale**2
    if variance is not None and relative is not None:
        variance = variance + np.abs(modes.shape * scale * relative) ** 2
    return replace(modes, shape=modes.shape * scale, scaling="unit modal mass", shape_variance=variance)
