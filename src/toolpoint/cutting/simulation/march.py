"""Time marching of a simulated cut in blocks of whole revolutions, of which only the last are kept."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.simulation.records import EdgeElements, ElementForces, ModalSteps, Rotation, Trace

BLOCK_STEPS = 50_000  # of a block, about
KEPT_STEPS = 150_000  # of a cut that runs on, about: 10 MB


@dataclass(frozen=True, eq=False)
class March:
    """Compiled records of a cut, and the number of steps after which they repeat.

    repeat : steps after which rotation and speed repeat; history : steps before a block that its edges look back to, a whole
    number of repeats; period : steps from one period of the cut to the next, a part of the repeat.
    """

    rotation: Rotation
    structure: ModalSteps
    edges: EdgeElements
    law: ElementForces
    repeat: int
    history: int
    period: int
    ways: int


@dataclass(eq=False)
class MarchState:
    """Progress of a cut: modal states, the past that its edges look back to, kept blocks, changes between periods.

    steps : taken so far; blocks : the last ones, the newest last; dropped : steps whose samples are gone; changes : root mean
    square of the change from each period of the cut to the next, m; stopped : whether the vibration passed 1 m.
    """

    modal: ComplexArray
    past: Trace
    steps: int = 0
    blocks: deque[Trace] = field(default_factory=deque)
    dropped: int = 0
    changes: list[float] = field(default_factory=list)
    stopped: bool = False


def begin(march: March, start: ComplexArray) -> MarchState:
    """Return the state of a cut at rest, its modes displaced by `start`."""
    return MarchState(start.copy(), _empty(march, march.history + 1))


def advance(march: March, state: MarchState, steps: int, *, kept: int | None) -> None:
    """March on; keep about the last `kept` steps (all where None). Only the last of several calls may end within a repeat."""
    if state.steps % march.repeat:
        fail("steps", str(state.steps), f"a cut goes on from a whole number of {march.repeat} steps alone")
    block_max = max(BLOCK_STEPS // march.repeat, 1) * march.repeat
    while steps > 0 and not state.stopped:
        block = min(steps, block_max)
        _take(march, state, block)
        steps -= block
        while kept is not None and len(state.blocks) > 1 and sum(_size(part) for part in list(state.blocks)[1:]) >= kept:
            state.dropped += _size(state.blocks.popleft())


def kept_trace(state: MarchState) -> Trace:
    """Return the samples that are kept, from the end of the step before the first of them on."""
    first = state.blocks[0]
    parts = [first, *(Trace(*(values[1:] for values in part)) for part in list(state.blocks)[1:])]
    return Trace(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _size(part: Trace) -> int:
    return part.torque.size - 1


def _empty(march: March, size: int) -> Trace:
    return Trace(np.zeros((size, march.ways)), np.zeros((size, 3)), np.zeros(size), np.zeros(size))


def _take(march: March, state: MarchState, block: int) -> None:
    from toolpoint.cutting.simulation.kernel import simulate as kernel  # brings the compiler

    history = march.history
    trace = _empty(march, history + block + 1)
    for values, past in zip(trace, state.past, strict=True):
        values[:history + 1] = past
    turning, steps = march.rotation, history + block
    rotation = turning._replace(first=history, steps=steps, fed=turning.fed[:turning.fed.size - turning.steps + steps])
    last_step = int(kernel(rotation, march.structure, state.modal, march.edges, march.law, trace))
    state.stopped = last_step < history + block
    _note_changes(march, state, trace.displacement[:last_step + 1])
    state.blocks.append(Trace(*(values[history:last_step + 1].copy() for values in trace)))
    state.steps += last_step - history
    state.past = Trace(*(values[last_step - history:last_step + 1].copy() for values in trace))


def _note_changes(march: March, state: MarchState, displacement: FloatArray) -> None:
    """Note the change of every whole period of the block from the one before it."""
    period, history = march.period, march.history
    period_count = (displacement.shape[0] - 1 - history) // period
    if period_count < 1:
        return
    moved = displacement[history - period + 1:history + period_count * period + 1].reshape(period_count + 1, -1)
    change = np.sqrt(np.mean(np.diff(moved, axis=0) ** 2, axis=1))
    # The first period of a cut has none before it.
    state.changes += change[1 if state.steps == 0 else 0:].tolist()


def steps_of_repeat(problem: MillingProblem, steps_per_period: int) -> int:
    """Return the steps after which a stable cut repeats: a tooth period, a revolution of an irregular tool, or the
    variation."""
    per_turn, variation, tool = steps_per_period * problem.tool.teeth, problem.speed_variation, problem.tool
    if variation is not None:
        return per_turn * variation.revolutions
    return steps_per_period if tool.is_regular and tool.runout == 0 and tool.tilt == 0 else per_turn
