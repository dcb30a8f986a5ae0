"""Coupling laws: joined parts are the whole, primal is dual, coupling then decoupling is the identity, virtual points exact."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.spatial.rotation import skew
from toolpoint.substructuring.coupling import couple, couple_dual, join_elastically
from toolpoint.substructuring.frequency_coupling import couple_responses, decouple_responses
from toolpoint.substructuring.receptance import complex_noise
from toolpoint.substructuring.virtual_point import DIRECTIONS, VirtualPoint, reduce_to_points
from toolpoint.vibration import Dof, Frf, SecondOrderSystem, frequency_response
from toolpoint.vibration.eigen import solve_undamped


def chain(masses, springs, first):
    """Masses on a line, springs between neighbours and from the first to the ground; points numbered from `first`."""
    n = len(masses)
    k = np.zeros((n, n))
    for i, stiffness in enumerate(springs):
        k[i, i] += stiffness
        if i:
            k[i - 1, i - 1] += stiffness
            k[i - 1, i] -= stiffness
            k[i, i - 1] -= stiffness
    points = [Dof(first + i, "+x") for i in range(n)]
    return SecondOrderSystem(np.diag(masses), k, structural_damping=0.03 * k, outputs=points)


LINES = np.linspace(1.0, 40.0, 60)
MASSES, SPRINGS = np.arange(8.0, 16.0), np.full(8, 1e5)


def halves(cut=4, share=0.5):
    """The chain of eight cut at a mass, which both parts have a share of."""
    left = MASSES[:cut + 1].copy()
    left[-1] *= share
    right = MASSES[cut:].copy()
    right[0] *= 1 - share
    return chain(left, SPRINGS[:cut + 1], 1), chain(right, [0.0, *SPRINGS[cut + 1:]], cut + 1)


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 6), st.floats(0.1, 0.9))
def test_joined_halves_are_the_whole(cut, share):
    whole = chain(MASSES, SPRINGS, 1)
    left, right = halves(cut, share)
    joined = couple({"a": left, "b": right}, [(f"a.{cut + 1}:+x", f"b.{cut + 1}:+x")])
    assert solve_undamped(joined).frequency == pytest.approx(solve_undamped(whole).frequency, rel=1e-11)


def test_primal_dual_and_frequency_based_coupling_agree():
    left, right = halves()
    links = [("a.5:+x", "b.5:+x")]
    primal = frequency_response.direct(couple({"a": left, "b": right}, links), LINES)
    dual, force = couple_dual({"a": left, "b": right}, links).respond(LINES)
    frfs = {"a": frequency_response.direct(left, LINES), "b": frequency_response.direct(right, LINES)}
    coupled = couple_responses(frfs, links)
    size = np.abs(primal.values).max()
    assert np.abs(dual.values - primal.values).max() < 1e-11 * size
    assert np.abs(coupled.values - primal.values).max() < 1e-11 * size
    # The force of the link moves the free right part exactly as it is seen to move.
    alone = frfs["b"].values[:, :, :1] @ -force[:, :, :1]
    assert np.abs(alone - dual.values[:, 5:, :1]).max() < 1e-10 * np.abs(dual.values[:, 5:, :1]).max()


def test_compliance_of_links_is_a_spring_between_the_parts():
    left, right = halves()
    links = [("a.5:+x", "b.5:+x")]
    spring = frequency_response.direct(join_elastically({"a": left, "b": right}, links, np.array([3e5])), LINES).values
    frfs = {"a": frequency_response.direct(left, LINES), "b": frequency_response.direct(right, LINES)}
    assert np.abs(couple_responses(frfs, links, compliance=1 / 3e5).values - spring).max() < 1e-11 * np.abs(spring).max()
    dual, _ = couple_dual({"a": left, "b": right}, links, 1 / 3e5).respond(LINES)
    assert np.abs(dual.values - spring).max() < 1e-11 * np.abs(spring).max()


def test_coupling_then_decoupling_is_the_identity():
    left, right = (frequency_response.direct(part, LINES) for part in halves())
    whole = couple_responses({"a": left, "b": right}, [("a.5:+x", "b.5:+x")])
    # Labels of the whole, with the joined place once: 1 .. 5 of the left part, 6 .. 9 of the right.
    keep = [k for k, dof in enumerate(whole.outputs) if dof.point != "b.5"]
    labels = [Dof(k + 1, "+x") for k in range(len(keep))]
    measured = Frf(LINES, whole.values[:, keep][:, :, keep], labels, labels)
    rest = decouple_responses(measured, right, ["5:+x"])
    back = rest.values[:, :5, :5]
    assert np.abs(back - left.values).max() < 1e-12 * np.abs(left.values).max()


def network(random, *, loss, first, grounded):
    """Six masses on random springs to each other, and to the ground or not."""
    k = np.zeros((6, 6))
    for i in range(6):
        for j in range(i):
            if j == i - 1 or random.random() < 0.6:
                spring = np.zeros(6)
                spring[[i, j]] = 1.0, -1.0
                k += 10 ** random.uniform(4, 5.5) * np.outer(spring, spring)
    if grounded:
        k += np.diag(10 ** random.uniform(3, 5, 6))
    return SecondOrderSystem(np.diag(random.uniform(3, 20, 6)), k, structural_damping=loss * k,
                             outputs=[Dof(first + i, "+x") for i in range(6)])


@pytest.mark.skipif(np.finfo(np.longdouble).eps >= np.finfo(float).eps, reason="no numbers longer than double here")
@pytest.mark.parametrize("links", [1, 2, 3])
@pytest.mark.parametrize("loss", [0.001, pytest.param(0.01, marks=pytest.mark.slow), 0.03])
@pytest.mark.default_cases(3)
def test_coupling_then_decoupling_is_the_identity_of_any_system(links, loss):
    """Within 1e-12 of the peak, or what rounding the whole to double numbers alone does to the rest, dR = T dW T^T."""
    beyond = 0
    for seed in range(20):
        random = np.random.default_rng(seed)
        left, right = (frequency_response.direct(network(random, loss=loss, first=first, grounded=grounded), LINES)
                       for first, grounded in ((1, True), (7 - links, seed % 2 == 0)))
        shared = [f"{7 - links + i}:+x" for i in range(links)]
        whole = couple_responses({"a": left, "b": right}, [(f"a.{label}", f"b.{label}") for label in shared])
        keep = [*range(6), *range(6 + links, 12)]
        labels = [Dof(k + 1, "+x") for k in range(len(keep))]
        measured = Frf(LINES, whole.values[:, keep][:, :, keep], labels, labels)
        back = decouple_responses(measured, right, shared).values[:, :6, :6]
        joint = list(range(6 - links, 6))
        gap = measured.values[:, joint][:, :, joint] - right.values[:, :links, :links]
        carried = np.abs(np.eye(len(keep))[:6] - measured.values[:, :6][:, :, joint] @ np.linalg.solve(
            gap, np.broadcast_to(np.eye(len(keep))[joint], (len(LINES), links, len(keep)))))
        rounding = 2.0**-53 * (carried @ np.abs(measured.values) @ np.swapaxes(carried, -1, -2)).max()
        error, peak = np.abs(back - left.values).max(), np.abs(left.values).max()
        assert error < max(1e-12 * peak, 2 * rounding), seed
        beyond += error > 1e-12 * peak
    assert beyond <= (2 if loss == 0.001 else 0)


def test_variance_of_the_whole_is_that_of_its_parts():
    left, right = (frequency_response.direct(part, LINES) for part in halves())
    noisy = {name: Frf(LINES, frf.values, frf.outputs, frf.inputs, variance=(1e-3 * np.abs(frf.values)) ** 2)
             for name, frf in (("a", left), ("b", right))}
    generator = np.random.default_rng(3)
    whole = couple_responses(noisy, [("a.5:+x", "b.5:+x")], generator=generator, draws=200)
    exact = whole.values
    errors = []
    for _ in range(100):
        drawn = {name: Frf(LINES, frf.values + complex_noise(frf.variance, 1, generator)[0], frf.outputs, frf.inputs)
                 for name, frf in noisy.items()}
        errors.append(np.abs(couple_responses(drawn, [("a.5:+x", "b.5:+x")]).values - exact) ** 2)
    assert np.median(np.mean(errors, axis=0) / whole.variance) == pytest.approx(1, abs=0.15)


def test_links_that_make_no_sense_are_refused():
    left, right = halves()
    parts = {"a": left, "b": right}
    for links, words in (([], "none"), ([("a.5:+x", "b.9:+x")], "no b.9"), ([("a.5:+x", "a.5:+x")], "itself"),
                         ([("a.5:+x", "b.5:+x")] * 2, "rank 1")):
        with pytest.raises(ToolpointError, match=words):
            couple(parts, links)
    two = frequency_response.direct(left, LINES), frequency_response.direct(right, LINES[:-1])
    with pytest.raises(ToolpointError, match="other frequency lines"):
        couple_responses({"a": two[0], "b": two[1]}, [("a.5:+x", "b.5:+x")])


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_virtual_point_of_a_rigid_patch_is_exact(seed):
    generator = np.random.default_rng(seed)
    places = {k: generator.normal(size=3) * 0.1 for k in range(1, 5)}
    ways = ("+x", "+y", "+z")
    labels = [Dof(k, way) for k in places for way in ways]
    point = VirtualPoint("p", np.array([0.02, 0.01, 0.0]), labels, labels, places)
    carry = np.concatenate([np.block([[np.eye(3), -skew(at - point.position)]]) for at in places.values()])
    inner = generator.normal(size=(5, 6, 6)) + 1j * generator.normal(size=(5, 6, 6))
    measured = Frf(np.arange(1.0, 6.0), carry @ inner @ carry.T, labels, labels)
    result = reduce_to_points(measured, [point])
    assert [str(d) for d in result.outputs] == [f"p:{way}" for way in DIRECTIONS]
    assert np.abs(result.values - inner).max() < 1e-8 * np.abs(inner).max()
    assert "1.0000" in result.notes[0]


def test_virtual_point_tells_a_turned_sensor_and_refuses_a_line():
    generator = np.random.default_rng(2)
    places = {k: generator.normal(size=3) * 0.1 for k in range(1, 5)}
    labels = [Dof(k, way) for k in places for way in ("+x", "+y", "+z")]
    carry = np.concatenate([np.block([[np.eye(3), -skew(at)]]) for at in places.values()])
    values = carry @ (np.eye(6) * (1 + 1j))[None] @ carry.T
    values[:, 4] *= -1
    point = VirtualPoint("p", np.zeros(3), labels, labels, places)
    with pytest.warns(ToolpointWarning, match="sensor 2:\\+y"):
        reduce_to_points(Frf(np.array([1.0]), values, labels, labels), [point])
    line = {k: np.array([0.1 * k, 0, 0]) for k in range(1, 5)}
    with pytest.raises(ToolpointError, match="off the line"):
        reduce_to_points(Frf(np.array([1.0]), values, labels, labels), [VirtualPoint("p", np.zeros(3), labels, labels, line)])
