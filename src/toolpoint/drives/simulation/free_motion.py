"""Motion of a plant without controllers under given forces: friction experiments, impact and backlash."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, frozen, positive
from toolpoint.drives.axis.plant import OUTPUTS, Plant
from toolpoint.drives.controller.settings import PARAMETERS
from toolpoint.drives.simulation.exact_step import step_matrices
from toolpoint.drives.simulation.simulate import SIGNALS, ServoResult


def simulate_free_motion(plant: Plant, load: FloatArray, step: float, *, start: FloatArray | None = None, every: int = 1,
                bristles: FloatArray | None = None) -> ServoResult:
    """Return the motion of a plant under forces on its tables, motors without current.

    Parameters
    ----------
    load : (n_steps, n_axes) floats
        N, held over each step.
    step : float
        s.
    start : (n_states,) floats, optional
        At rest where left out.
    bristles : (n_laws,) floats, optional
        Bristle deflection (LuGre) of every law at the start.
    """
    from toolpoint.drives.controller.kernel import STATE
    from toolpoint.drives.friction.kernel import SLOTS
    from toolpoint.drives.simulation.kernel import run

    axes = len(plant.axes)
    forces = floats("load", load, (None, axes))
    m = step_matrices(plant, positive("step", step))
    steps, laws = forces.shape[0], plant.b_scalar.shape[1]
    lines = (steps + count("every", every) - 1) // every
    x = np.zeros(plant.a.shape[0]) if start is None else floats("start", start, (plant.a.shape[0],))
    z = m.inward(x)
    states = np.zeros((max(plant.rows.shape[0], 1), SLOTS))
    if bristles is not None:
        states[:plant.rows.shape[0], 0] = floats("bristles", bristles, (plant.rows.shape[0],))
    outputs = np.zeros((lines, len(OUTPUTS) * axes))
    signals, values = np.zeros((lines, axes, len(SIGNALS))), np.zeros((lines, laws))
    nothing = np.zeros((1, axes, 3))
    failed = run(0, steps, step, m.core, m.pairs, m.inputs, m.shift, m.jump, m.scalars, m.gain, np.array(plant.rows),
                 np.array(plant.viscous), plant.products, m.reading, m.direct, np.zeros((0, PARAMETERS)), np.zeros((0, STATE)),
                 np.ones(3, np.int64), nothing,
                 np.zeros((1, axes)), 0, np.array(forces), z, states, np.zeros((2, laws)), every, outputs, signals, values)
    if failed < 0:
        fail("free_motion", f"motion not finite after {-failed} steps", "the step is too long", "take a shorter step")
    return ServoResult(frozen(np.arange(lines) * step * every), tuple(a.name for a in plant.axes),
                       frozen(outputs.reshape(lines, axes, -1)), signals, frozen(values),
                       np.zeros((lines, axes)), frozen(m.outward(z)), failed)
