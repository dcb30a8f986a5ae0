"""A sparse model of parts that scale: its derivatives, and a fit that ends at the truth."""

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from toolpoint import ToolpointError
from toolpoint.updating import Parameter, Problem, Targets, fit
from toolpoint.updating.models.sparse_model import SparseModel
from toolpoint.vibration import Dof

N = 60


def chain(number=5):
    """A chain of masses on a wall, three groups of springs and two of masses."""
    parts = {}
    for k, (a, b) in enumerate(((0, 20), (20, 40), (40, 60))):
        rows = np.zeros((N, N))
        for i in range(a, b):
            rows[i, i] += 1e6
            if i:
                rows[i - 1, i - 1] += 1e6
                rows[i, i - 1] -= 1e6
                rows[i - 1, i] -= 1e6
        parts[f"k{k}"] = csc_array(rows)
    heavy = np.arange(N) < 30
    masses = {"m0": csc_array(diags_array(1.0 * heavy)), "m1": csc_array(diags_array(1.5 * ~heavy))}
    at = [5, 14, 23, 33, 41, 50, 58]
    motion = csc_array((np.ones(len(at)), (at, range(len(at)))), shape=(N, len(at)))
    return SparseModel(csc_array((N, N)), csc_array((N, N)), motion, tuple(Dof(i + 1, "+x") for i in at), number, parts, masses)


VALUES = {"k0": 1.0, "k1": 1.3, "k2": 0.7, "m0": 1.0, "m1": 0.9}


def test_against_a_dense_solution():
    model = chain()
    k = sum(model.stiffness_parts[n].toarray() * VALUES[n] for n in ("k0", "k1", "k2"))
    m = sum(model.mass_parts[n].toarray() * VALUES[n] for n in ("m0", "m1"))
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(m, k)).real)[:5]
    assert np.allclose(model(VALUES).modes.frequency, np.sqrt(squares) / (2 * np.pi), rtol=1e-10)


@pytest.mark.parametrize("name", list(VALUES))
def test_derivatives_against_differences(name):
    model, h = chain(), 1e-4
    result = model(VALUES, (name,))
    there, back = (model(VALUES | {name: VALUES[name] + s}).modes for s in (h, -h))
    assert np.allclose(result.frequency_slopes[0], (there.frequency - back.frequency) / (2 * h), rtol=1e-6, atol=1e-8)
    signs = np.sign((there.shape * result.modes.shape).sum(axis=0)), np.sign((back.shape * result.modes.shape).sum(axis=0))
    slope = (there.shape * signs[0] - back.shape * signs[1]) / (2 * h)
    assert np.allclose(result.shape_slopes[0], slope, atol=1e-6 * np.abs(slope).max())


def test_a_fit_ends_at_the_truth_with_a_covariance():
    model = chain()
    measured = model(VALUES).modes.selected([0, 1, 2])
    free = [Parameter(n, s, 0.1, 10.0) for n, s in (("k0", 1.6), ("k1", 0.7), ("k2", 1.2))]
    fixed = chain()
    fixed = SparseModel(fixed.stiffness, fixed.mass_parts["m0"] + fixed.mass_parts["m1"] * 0.9, fixed.motion, fixed.dofs, 5,
                        fixed.stiffness_parts)
    result = fit(Problem(fixed, free, Targets(measured, shape=True)), limit=None)
    assert result.converged and result.values == pytest.approx({n: VALUES[n] for n in ("k0", "k1", "k2")}, rel=1e-6)
    assert (np.diag(result.covariance) > 0).all()


def test_what_is_refused():
    with pytest.raises(ToolpointError, match="no 'k2'; must hold every number"):
        chain()({"k0": 1.0, "k1": 1.0, "m0": 1.0, "m1": 1.0})
    with pytest.raises(ToolpointError, match="'k9'; must be of k0, k1, k2, m0, m1"):
        chain()(VALUES, ("k9",))
    model = chain()
    with pytest.raises(ToolpointError, match=r"SparseModel.motion: shape \(60, 7\); must be \(60, 1\)"):
        SparseModel(model.stiffness, model.mass, model.motion, model.dofs[:1], 2)
