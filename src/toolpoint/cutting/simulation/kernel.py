r"""Compiled kernel of the milling simulation: exact modal steps, forces linear over a step, memory of several flutes.

Between two steps the force is a straight line in time, so the modal equation :math:`\dot z = s z + R^T F` has an exact step,
:math:`z' = e^{s h} z + W_0 F + W_1 F'`. The force F' at the end depends on the displacement there, which depends on F' in turn:
two rounds of :math:`r' = r_0 + C F'` (C the compliance of the end's own force) solve that, since C is of second order in h.
A chip is as thick as the least of the distances to the surfaces that the remembered passages left; a delay that is no whole
number of steps is interpolated between two steps. Entry and exit fall between steps too: an element's force counts with the
share of the hat function about the step that lies within its arc, which is the weight of a force that is linear over a step.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.cutting.simulation.records import EdgeElements, ElementForces, ModalSteps, Rotation, Trace


@nb.njit(cache=True, nogil=True)
def engagement_share(angle: float, step: float, entry: float, leave: float) -> float:
    """Return the share of the hat function about `angle` (half width `step`) that lies between entry and exit."""
    total = 0.0
    # Angles wrap at a turn, and the hat may reach over the wrap.
    for turn in (-1, 0, 1):
        centre = angle + 2 * math.pi * turn
        lower, upper = max(entry, centre - step), min(leave, centre + step)
        if upper > lower:
            total += _hat((upper - centre) / step) - _hat((lower - centre) / step)
    return total


@nb.njit(cache=True, nogil=True)
def _hat(u: float) -> float:
    """Return the integral of the unit hat function from -1 to u."""
    u = min(1.0, max(-1.0, u))
    return 0.5 * (1 + u) ** 2 if u < 0 else 1.0 - 0.5 * (1 - u) ** 2


@nb.njit(cache=True, nogil=True)
def contact_table(rotation: Rotation, edges: EdgeElements) -> FloatArray:
    """Return the engaged share of every element at every step of a revolution, shape (repeat, elements)."""
    contact = np.empty((rotation.repeat, edges.lag.size))
    for k in range(rotation.repeat):
        for e in range(edges.lag.size):
            phi = (rotation.start + k * rotation.step - edges.lag[e]) % (2 * math.pi)
            contact[k, e] = engagement_share(phi, rotation.step, edges.entry[e], edges.leave[e])
    return contact


@nb.njit(cache=True, nogil=True, fastmath=True)
def simulate(rotation: Rotation, structure: ModalSteps, state: ComplexArray, edges: EdgeElements, law: ElementForces,
             trace: Trace) -> int:
    """March the steps after the first from modal states `state`, which go on with them, and fill the trace; returns the last
    step, earlier where the tool passes 1 m.

    rotation, structure, edges, law, trace : `Rotation`, `ModalSteps`, `EdgeElements`, `ElementForces`, `Trace`. Their arrays
    are taken out once: a field read within the loop costs a reference count, which is dear at ten million steps a second.
    """
    kinds, ways, modes = structure.first.shape
    spatial = ways == 3
    # Real and imaginary parts apart: loops over modes vectorise.
    decay_re, decay_im = structure.decay.real.copy(), structure.decay.imag.copy()
    left_re, left_im = structure.left.real.copy(), structure.left.imag.copy()
    first_re, first_im = structure.first.real.copy(), structure.first.imag.copy()
    last_re, last_im = structure.last.real.copy(), structure.last.imag.copy()
    compliance, length = structure.compliance, structure.length
    lag, share, outward, upward, radius = edges.lag, edges.share, edges.outward, edges.upward, edges.radius
    delay, extra = edges.delay, edges.extra
    elements, memory = delay.shape
    tangential, normal, axial = law.cutting
    edge_tangential, edge_normal, edge_axial = law.edge
    damping, friction, linear, exponent = law.damping, law.friction, law.linear, law.exponent
    displacement, force, torque, chip_max = trace.displacement, trace.force, trace.torque, trace.chip
    start, angle_step, feed_step, fed = rotation.start, rotation.step, rotation.feed, rotation.fed
    lead_steps = fed.size - rotation.steps - 1
    zre, zim = state.real.copy(), state.imag.copy()
    contact = contact_table(rotation, edges)
    engaged, sine = np.empty(elements, np.int64), np.empty(elements)
    cosine, surfaces = np.empty(elements), np.empty(elements)
    first_step = rotation.first
    fx, fy, fz = force[first_step, 0], force[first_step, 1], force[first_step, 2]
    for k in range(first_step + 1, rotation.steps + 1):
        kind, row = (k - 1) % kinds, k % rotation.repeat
        rx, ry, rz = 0.0, 0.0, 0.0  # displacement at the step's end without the force there
        for m in range(modes):
            re = decay_re[kind, m] * zre[m] - decay_im[kind, m] * zim[m] + first_re[kind, 0, m] * fx + first_re[kind, 1, m] * fy
            im = decay_re[kind, m] * zim[m] + decay_im[kind, m] * zre[m] + first_im[kind, 0, m] * fx + first_im[kind, 1, m] * fy
            if spatial:
                re += first_re[kind, 2, m] * fz
                im += first_im[kind, 2, m] * fz
                rz += left_re[2, m] * re - left_im[2, m] * im
            zre[m], zim[m] = re, im
            rx += left_re[0, m] * re - left_im[0, m] * im
            ry += left_re[1, m] * re - left_im[1, m] * im
        rx, ry, rz = 2 * rx, 2 * ry, 2 * rz
        px, py, pz = rx, ry, rz
        fx, fy, fz, moment, thick = 0.0, 0.0, 0.0, 0.0, 0.0
        # What earlier passages left does not depend on the displacement sought: it is taken once for both rounds.
        engaged_count = 0
        for e in range(elements):
            if contact[row, e] <= 0.0:
                continue
            # Outward normal n = (out sin phi, out cos phi, -up), tangent t = (cos phi, -sin phi, 0).
            phi = start + row * angle_step - lag[e]
            s, c = math.sin(phi), math.cos(phi)
            out, up = outward[e], upward[e]
            surface = 1e300
            for i in range(memory):  # what the i-th passage before left, at a time between two steps
                delay_steps = delay[e, i]
                past_step = k - delay_steps
                past_index = math.floor(past_step)
                part = past_step - past_index
                was = 0.0
                # Before the first step nothing vibrated.
                if past_index >= 0:
                    was = along(displacement, past_index, out * s, out * c, up, spatial)
                    if part > 0.0:
                        was += part * (along(displacement, past_index + 1, out * s, out * c, up, spatial) - was)
                advance = feed_step * delay_steps
                if lead_steps > 0:
                    from_start = past_index + lead_steps
                    advance = fed[k + lead_steps] - fed[from_start] - part * (fed[from_start + 1] - fed[from_start])
                surface = min(surface, (advance * s + extra[e, i]) * out - was)
            engaged[engaged_count], sine[engaged_count], cosine[engaged_count] = e, s, c
            surfaces[engaged_count] = surface
            engaged_count += 1
        for _ in range(2):
            fx, fy, fz, moment, thick = 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(engaged_count):
                e, s, c = engaged[j], sine[j], cosine[j]
                g, out, up = contact[row, e], outward[e], upward[e]
                present = out * (s * px + c * py) - up * pz
                h = surfaces[j] + present
                # A tooth that has left the surface cuts nothing; the linear law lets it pull, which is what theories of
                # stability assume.
                if h <= 0.0 and not linear:
                    continue
                # Power laws hold their coefficient at a chip of one millimetre.
                chip = h if exponent == 0.0 else h * (h / 1e-3) ** -exponent
                ft, fn, fa = tangential * chip + edge_tangential, normal * chip + edge_normal, axial * chip + edge_axial
                if damping[kind] > 0.0:
                    drag = damping[kind] * (present - along(displacement, k - 1, out * s, out * c, up, spatial)) / length[kind]
                    fn += drag
                    ft += friction * drag
                a = share[e] * g
                radial = fn * out - fa * up
                fx -= a * (ft * c + radial * s)
                fy -= a * (-ft * s + radial * c)
                fz += a * (fn * up + fa * out)
                moment += a * ft * radius[e]
                thick = max(thick, h)
            px = rx + compliance[kind, 0, 0] * fx + compliance[kind, 0, 1] * fy
            py = ry + compliance[kind, 1, 0] * fx + compliance[kind, 1, 1] * fy
            if spatial:
                px += compliance[kind, 0, 2] * fz
                py += compliance[kind, 1, 2] * fz
                pz = rz + compliance[kind, 2, 0] * fx + compliance[kind, 2, 1] * fy + compliance[kind, 2, 2] * fz
        for direction in range(displacement.shape[1]):
            displacement[k, direction] = (px, py, pz)[direction]
        for direction, value in enumerate((fx, fy, fz)):
            force[k, direction] = value
        for m in range(modes):
            zre[m] += last_re[kind, 0, m] * fx + last_re[kind, 1, m] * fy
            zim[m] += last_im[kind, 0, m] * fx + last_im[kind, 1, m] * fy
            if spatial:
                zre[m] += last_re[kind, 2, m] * fz
                zim[m] += last_im[kind, 2, m] * fz
        torque[k], chip_max[k] = moment, thick
        # Far beyond any machine; a linear law would grow until numbers overflow.
        if abs(px) > 1.0:
            return k
    for m in range(modes):
        state[m] = complex(zre[m], zim[m])
    return rotation.steps


@nb.njit(cache=True, nogil=True, fastmath=True, inline="always")
def along(displacement: FloatArray, k: int, x: float, y: float, z: float, spatial: bool) -> float:
    """Return the displacement of step k along the outward normal [x, y, -z]."""
    total = x * displacement[k, 0] + y * displacement[k, 1]
    if spatial:
        total -= z * displacement[k, -1]
    return total
