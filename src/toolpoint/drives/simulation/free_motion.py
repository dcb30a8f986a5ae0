"""Motion of a plant without controllers under given forces: friction experiments, impact and backlash."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, frozen, positive
from toolpoint.drives.axis.plant import Plant
from toolpoint.drives.controller.records import CONTROL_STATE, PARAMETERS, SET_POINT, SampleCounts
from toolpoint.drives.simulation.arrays import ControlArrays
from toolpoint.drives.simulation.exact_step import step_matrices
from toolpoint.drives.simulation.simulate import ServoResult, empty_histories, law_arrays, motion_arrays


def simulate_free_motion(plant: Plant, load: FloatArray, step: float, *, start: FloatArray | None = None,
                         record_interval: int = 1,
                bristles: FloatArray | None = None) -> ServoResult:
    """Return the motion of a plant under forces on its tables without controllers: no voltage, so synchronous motors brake.

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
    from toolpoint.drives.simulation.kernel import run

    axes = len(plant.axes)
    forces = floats("load", load, (None, axes))
    m = step_matrices(plant, positive("step", step))
    motion = motion_arrays(plant, m, start)
    if bristles is not None:
        motion.laws["bristle"] = floats("bristles", bristles, (plant.laws.size,))
    histories = empty_histories(plant, forces.shape[0], count("record_interval", record_interval))
    failed = run(0, forces.shape[0], m.arrays, law_arrays(plant), _without_controllers(forces), motion, histories)
    if failed < 0:
        fail("simulate_free_motion", f"motion not finite after {-failed} steps", "the step is too long",
             remedy="take a shorter step")
    time = np.arange(histories.outputs.shape[0]) * step * record_interval
    return ServoResult(frozen(time), tuple(a.name for a in plant.axes), frozen(histories.outputs.reshape(time.size, axes, -1)),
                       histories.signals, frozen(histories.forces), np.zeros((time.size, axes)),
                       frozen(m.outward(motion.coordinates)), failed)


def _without_controllers(load: FloatArray) -> ControlArrays:
    return ControlArrays(SampleCounts(1, 1, 1), np.zeros(0, PARAMETERS), np.zeros(0, CONTROL_STATE),
                         np.zeros((1, load.shape[1]), SET_POINT), np.zeros((1, load.shape[1])), 0, np.array(load))
