"""Whole periods at once against the same steps one by one."""

import numpy as np
import pytest

from toolpoint._check import frozen
from toolpoint.vibration.simulation.varying import CourseArrays, CutArrays, NodeArrays, RunArrays, VaryingSystem, step_nodes
from toolpoint.vibration.simulation.varying_kernel import advance
from toolpoint.vibration.simulation.varying_periods import advance_periods

STEP, PERIOD, STEPS = 2e-5, 50, 60_000


def nodes_of(change, count):
    """A random structure whose stiffness changes by a share along the path, at so many nodes."""
    rng, n = np.random.default_rng(3), 4
    root = rng.normal(size=(n, n))
    stiffness, mass = root @ root.T * 1e6 + 2e5 * np.eye(n), np.eye(n)
    at = np.linspace(0, 1, count)
    along = stiffness * (1 + change * np.sin(2 * at))[:, None, None] + 3e5 * change * (at**2)[:, None, None] * mass

    def same(values):
        return np.repeat(values[None], count, 0)

    system = VaryingSystem(at, same(mass), same(3e-5 * stiffness + 5 * mass), along, same(rng.normal(size=(n, 4))),
                           same(rng.normal(size=(6, n))), np.zeros((count, 6, n)))
    step = step_nodes(system, STEP)
    return NodeArrays(step.transition, step.deflection, step.reading, step.moving, step.dissipation,
                      *map(frozen, (step.load_map, same(mass), along)))


def both(change, feed, *, count=5, keep=1, first=0, load=0.3, mean=1.0):
    """Run both ways; return the motion one by one, by periods, and the two last states."""
    angle = 2 * np.pi * np.arange(PERIOD) / PERIOD
    force = np.stack([mean + np.cos(angle), mean + np.sin(2 * angle), mean * np.ones(PERIOD)], axis=1)
    cut = CutArrays(np.stack([0.1 * force, force + 0.2 * force[::-1]]), np.zeros((PERIOD, 3, 3)), 0.0)
    at = (np.arange(STEPS) + 0.5) / STEPS * 0.99 * (count - 1)
    course = CourseArrays(at.astype(int), at - at.astype(int), np.linspace(*feed, STEPS),
                          np.full((STEPS, 1), load) * np.linspace(1, 2, STEPS)[:, None])
    results = []
    for whole in (False, True):
        run, out = RunArrays(np.full(8, 1e-7), np.zeros((PERIOD, 3)), np.zeros(0)), np.empty((STEPS // keep + 1, 6))
        nodes = nodes_of(change, count)
        kept = (advance_periods(nodes, cut, course, motion=run, keep=keep, first=first, out=out, maps={}) if whole else
                advance(nodes, cut, course, run, keep, first, out, np.empty((0, 9))))
        results += [out[:kept], run.state]
    return results


@pytest.mark.slow
@pytest.mark.parametrize(("keep", "first"), [(1, 0), (5, 0), (3, 17)])
def test_a_structure_that_stays_gives_the_same(keep, first):
    single, state, periods, end = both(0.0, (0.6, 0.6), keep=keep, first=first, load=0.0)
    assert single.shape == periods.shape
    assert np.abs(periods - single).max() < 1e-12 * np.abs(single).max()
    assert np.abs(end - state).max() < 1e-12 * np.abs(state).max()


def test_a_growing_feed_and_load_push_nothing_more():
    single, _, periods, _ = both(0.0, (0.1, 0.9))
    assert np.abs(periods - single).max() < 1e-10 * np.abs(single).max()


def test_the_difference_falls_with_the_square_of_the_nodes_distance():
    largest = []
    for count in (5, 9, 17):
        single, _, periods, _ = both(0.2, (0.3, 0.8), count=count, mean=0.2)
        largest.append(np.sqrt(np.mean((periods - single)[5000:] ** 2)))
    assert largest[0] / largest[1] > 2.5 and largest[1] / largest[2] > 2.5
    assert largest[2] < 2e-4 * np.abs(single).max()
