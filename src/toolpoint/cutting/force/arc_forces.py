r"""Forces of a rigid cutter over arcs that differ from slice to slice: means and peaks over a revolution, compiled.

The chip at the axial immersion angle kappa and angle phi is :math:`h = f (\sin\kappa \sin\phi \, u_l - \cos\kappa \, u_z)`
for the unit feed with the share u_l across the axis and u_z along it; forces act as in `laws.rigid_forces`.

Source: Engin, Altintas, Int. J. Machine Tools Manufacture 41 (2001) 2195, in the convention of this package.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from toolpoint._check import FloatArray
from toolpoint._kernel_options import BORROWS
from toolpoint.cutting.cut.coefficients import CuttingCoefficients
from toolpoint.cutting.cut.tool import Tool

_ANGLES_PER_TOOTH = 30  # of the rotation, of a tool whose teeth are alike
_ANGLES_PER_TURN = 180  # of one whose teeth differ
_PEAK_PARTS = 6  # of a step, beside the largest force
_MEAN_NODES, _MEAN_WEIGHTS = np.polynomial.legendre.leggauss(8)  # over each arc: exact to rounding for arcs up to a turn


@dataclass(frozen=True, eq=False)
class ArcForces:
    """Loads of many places, in the frame of the feed (x the feed's way across the axis, z the axis).

    mean : (n, 3) N; lateral : (n,) largest force across the axis, N; axial : (n,) force along the axis of largest size, N,
    positive away from the work; torque, peak_torque : (n,) mean and largest, N m; bending : (n,) largest moment about a
    point of the axis, N m; chip : (n,) largest chip thickness, m.
    """

    mean: FloatArray
    lateral: FloatArray
    axial: FloatArray
    torque: FloatArray
    peak_torque: FloatArray
    bending: FloatArray
    chip: FloatArray


def arc_forces(tool: Tool, coefficients: CuttingCoefficients, arcs: FloatArray, *, edges: FloatArray, feed: FloatArray,
               direction: FloatArray, lever: float = 0.0) -> ArcForces:
    """Return the loads at many places.

    Parameters
    ----------
    tool : Tool
        Teeth, pitch and helix; run-out is left out.
    coefficients : CuttingCoefficients
    arcs : (n, slices, m, 2) floats
        Entry and exit of the arcs, rad; not a number where there is none.
    edges : (n, slices, 4) floats
        Height above the tip, kappa, radius, length along the meridian of each slice: m, rad, m, m.
    feed : (n,) floats
        Feed per tooth, m.
    direction : (n, 2) floats
        Shares of the unit feed across the axis and along it.
    lever : float
        Height above the tip about which the bending moment is taken, m.
    """
    n = len(arcs)
    out = np.zeros((n, 9))
    number = _ANGLES_PER_TOOTH if tool.is_regular else _ANGLES_PER_TURN
    turn = 2 * np.pi / tool.teeth if tool.is_regular else 2 * np.pi
    teeth = np.stack([tool.angles(0.0), 2 * np.tan(tool.helix) / tool.diameter,
                      np.roll(tool.pitch, 1) * tool.teeth / (2 * np.pi)])
    force = np.concatenate([coefficients.cutting, coefficients.edge])
    _loads(np.ascontiguousarray(arcs), np.ascontiguousarray(edges, float), teeth, force, np.asarray(feed, float),
           np.asarray(direction, float), (turn, number, lever), out)
    return ArcForces(out[:, 0:3], out[:, 3], out[:, 4], out[:, 5], out[:, 6], out[:, 7], out[:, 8])


def force_history(tool: Tool, coefficients: CuttingCoefficients, arcs: FloatArray, *, edges: FloatArray, feed: float,
                  direction: tuple[float, float], steps: int) -> FloatArray:
    """Return the force on the tool over one passing of its teeth, (steps, 3), N, in the frame of the feed.

    tool : regular; arcs, edges : (slices, m, 2) and (slices, 4) of one place, direction : as in `arc_forces`. The rotation of
    step k is k/steps of the angle between two teeth.
    """
    teeth = np.stack([tool.angles(0.0), 2 * np.tan(tool.helix) / tool.diameter, np.ones(tool.teeth)])
    force, scratch, chip = np.concatenate([coefficients.cutting, coefficients.edge]), np.zeros(9), (feed, *direction)
    slices, edges = np.ascontiguousarray(arcs, float), np.ascontiguousarray(edges, float)
    rotations = np.arange(steps) / steps * 2 * np.pi / tool.teeth
    return np.array([_at_angle(slices, edges, teeth, force, chip, float(angle), 0.0, scratch)[:3] for angle in rotations])


@njit(cache=True, nogil=True)
def _loads(arcs, edges, teeth, law, feed, direction, turn, out):  # type: ignore[no-untyped-def]
    """Write mean x y z, peak lateral, peak axial, mean and peak torque, peak bending, largest chip of every place."""
    angle, number, lever = turn
    for i in range(arcs.shape[0]):
        if feed[i] <= 0.0 or math.isnan(np.nanmin(arcs[i, :, 0, 0])):
            continue
        largest = 0
        for step in range(number):
            x, y, z, torque, mx, my = _at_angle(arcs[i], edges[i], teeth, law, (feed[i], direction[i, 0], direction[i, 1]),
                                                angle * step / number, lever, out[i])
            if math.hypot(x, y) > out[i, 3]:
                largest = step
            _keep_peaks((x, y, z, torque, mx, my), out[i])
        out[i, 0], out[i, 1], out[i, 2], out[i, 5] = _means(arcs[i], edges[i], law, (feed[i], direction[i, 0], direction[i, 1]),
                                                            teeth.shape[1])
        # In a short arc the force falls from its peak within a step: the steps on both sides are looked at once more.
        for part in range(1, 2 * _PEAK_PARTS):
            turned = angle * (largest + part / _PEAK_PARTS - 1.0) / number
            _keep_peaks(_at_angle(arcs[i], edges[i], teeth, law, (feed[i], direction[i, 0], direction[i, 1]), turned, lever,
                                  out[i]), out[i])


@njit(cache=True, nogil=True, **BORROWS)
def _means(arcs, edges, law, chip, teeth_number):  # type: ignore[no-untyped-def]
    """Return mean force x y z and torque of all teeth, by integrals over each arc.

    Teeth that differ share the feed of a revolution, so that their means are those of equal teeth.
    """
    fx, fy, fz, torque = 0.0, 0.0, 0.0, 0.0
    for k in range(arcs.shape[0]):
        kappa, radius, width = edges[k, 1], edges[k, 2], edges[k, 3]
        sk, ck = math.sin(kappa), math.cos(kappa)
        for m in range(arcs.shape[1]):
            if math.isnan(arcs[k, m, 0]):
                break
            middle, half = 0.5 * (arcs[k, m, 0] + arcs[k, m, 1]), 0.5 * (arcs[k, m, 1] - arcs[k, m, 0])
            for n in range(_MEAN_NODES.size):
                phi = middle + half * _MEAN_NODES[n]
                s, c = math.sin(phi), math.cos(phi)
                h = chip[0] * (sk * s * chip[1] - ck * chip[2])
                if h <= 0.0:
                    continue
                share = width * half * _MEAN_WEIGHTS[n]
                t, q, a = (law[0] * h + law[3]) * share, (law[1] * h + law[4]) * share, (law[2] * h + law[5]) * share
                fx, fy = fx - (t * c + q * s * sk - a * s * ck), fy + t * s - q * c * sk + a * c * ck
                fz, torque = fz + q * ck + a * sk, torque + t * radius
    factor = teeth_number / (2.0 * math.pi)
    return fx * factor, fy * factor, fz * factor, torque * factor


@njit(cache=True, nogil=True, inline="always")
def _keep_peaks(loads, out):  # type: ignore[no-untyped-def]
    """Keep the largest lateral and axial force, torque and bending moment of a place."""
    out[3] = max(out[3], math.hypot(loads[0], loads[1]))
    if abs(loads[2]) > abs(out[4]):
        out[4] = loads[2]
    out[6] = max(out[6], loads[3])
    out[7] = max(out[7], math.hypot(loads[4], loads[5]))


@njit(cache=True, nogil=True, **BORROWS)
def _at_angle(arcs, edges, teeth, law, chip, rotation, lever, out):  # type: ignore[no-untyped-def]
    """Return force, torque and bending moment (about x and y) at one rotation."""
    fx, fy, fz, torque, mx, my = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(arcs.shape[0]):
        if math.isnan(arcs[k, 0, 0]):
            continue
        height, kappa, radius, width = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        sk, ck = math.sin(kappa), math.cos(kappa)
        for j in range(teeth.shape[1]):
            phi = (rotation - teeth[0, j] - teeth[1, j] * height) % (2.0 * math.pi)
            if not _inside(arcs[k], phi):
                continue
            s, c = math.sin(phi), math.cos(phi)
            h = chip[0] * teeth[2, j] * (sk * s * chip[1] - ck * chip[2])
            if h <= 0.0:
                continue
            out[8] = max(out[8], h)
            t, n, a = (law[0] * h + law[3]) * width, (law[1] * h + law[4]) * width, (law[2] * h + law[5]) * width
            x, y = -(t * c + n * s * sk - a * s * ck), t * s - n * c * sk + a * c * ck
            fx, fy, fz, torque = fx + x, fy + y, fz + n * ck + a * sk, torque + t * radius
            mx, my = mx + x * (lever - height), my + y * (lever - height)
    return fx, fy, fz, torque, mx, my


@njit(cache=True, nogil=True, inline="always")
def _inside(arcs, phi):  # type: ignore[no-untyped-def]
    """Whether an angle of 0 .. 2 pi lies in one of the arcs of a slice, which may begin below zero."""
    for m in range(arcs.shape[0]):
        if math.isnan(arcs[m, 0]):
            return False
        if arcs[m, 0] < phi < arcs[m, 1] or arcs[m, 0] < phi - 2.0 * math.pi < arcs[m, 1]:
            return True
    return False

# Code of other modules in these kernels: 814697192537
