"""Freedoms that one mode alone speaks for, rivals that the machine's fit may prefer, and joints that ran away."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from toolpoint.joint_identification.joints.joint_fit import Criterion, Stack, candidates, rival_of
from toolpoint.joint_identification.machine.rival_joints import fit_with_rivals, question_runaways

MODES, NOISE = 10, 0.01


def stack_of(twists: np.ndarray) -> Stack:
    """Return relative twists (k, 6) with independent noise."""
    k = len(twists)
    return Stack(twists, np.eye(6 * k) / NOISE, np.stack([NOISE**2 * np.eye(6)] * k), 500)


def hinge_twists(seed: int) -> np.ndarray:
    """Return the motions of a hinge about x near the reference point, with noise."""
    rng = np.random.default_rng(seed)
    way = np.concatenate([np.cross([0.1, 0.2, -0.3], [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]])
    return rng.standard_normal((MODES, 1)) * way + NOISE * rng.standard_normal((MODES, 6))


def test_a_mode_with_more_noise_than_stated_brings_no_freedom_but_a_rival():
    criterion = Criterion()
    for seed in range(2):
        twists = hinge_twists(seed)
        twists[2, [0, 1, 2, 4, 5]] += 5 * NOISE * np.random.default_rng(seed + 50).choice([-1.0, 1.0], 5)
        stack = stack_of(twists)
        fits = candidates(stack, criterion)
        assert fits[0].kind == "hinge" and fits[0].probability < criterion.significance and fits[0].misfit_mode == 2
        assert rival_of(stack, fits, criterion).chart.freedoms == 2


def test_a_freedom_that_several_modes_show_is_kept():
    criterion = Criterion()
    for seed in range(2):
        twists = hinge_twists(seed)
        twists[:, 1] += 6 * NOISE * np.random.default_rng(seed + 70).choice([-1.0, 1.0], MODES)
        fits = candidates(stack_of(twists), criterion)
        assert fits[0].chart.freedoms == 2 and rival_of(stack_of(hinge_twists(seed)), candidates(
            stack_of(hinge_twists(seed)), criterion), criterion) is None


def joint(child: str, stiffness: float, at=(0.0, 0.0, 0.0), undetermined=()) -> SimpleNamespace:
    """Return a hinge about x as far as `question_runaways` asks."""
    return SimpleNamespace(child=child, position=np.array(at), undetermined=np.array(undetermined).reshape(-1, 3),
                           stiffness=np.array([stiffness]), stiffness_matrix=None, screws=np.eye(6)[:, 3:4])


@pytest.mark.parametrize(("joints", "what"), [
    ((joint("a", 1e6), joint("b", 3e14)), {"b": "stiffness"}),
    ((joint("a", 1e6, (0.0, 504.0, 0.0)), joint("b", 1e7)), {"a": "place"}),
    ((joint("a", 1e6, (504.0, 0.1, 0.0), ((1.0, 0.0, 0.0),)), joint("b", 1e8)), {})])
def test_places_and_stiffnesses_that_ran_away_are_grave_doubts(joints, what):
    motions = [SimpleNamespace(centre=np.zeros(3), size=0.5)] * len(joints)
    doubts = question_runaways(joints, motions)
    assert {part.child: doubt.what for part, several in zip(joints, doubts, strict=True) for doubt in several} == what
    assert all(doubt.grave for several in doubts for doubt in several)


def test_the_machine_takes_the_rival_only_where_it_explains_more():
    def machine(chi2: float) -> SimpleNamespace:
        return SimpleNamespace(lonely=(), fit=SimpleNamespace(converged=True, widened=chi2, information=chi2))

    first, rival = SimpleNamespace(child="a", size=9.0), SimpleNamespace(child="a", size=1.0)
    tried = []

    def fit(joints):
        tried.append(joints)
        return machine(joints[0].size)

    assert fit_with_rivals(fit, [first], {"a": rival})[1] == [rival]
    assert fit_with_rivals(fit, [first], {})[1] == [first]
    tried.clear()
    assert fit_with_rivals(fit, [rival], {"a": first})[1] == [rival] and len(tried) == 1  # good: nothing else is tried
