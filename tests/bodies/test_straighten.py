"""Curved elements that fold: at points of the rule, and at a corner alone."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.bodies.solid.element_kinds import TETRAHEDRON
from toolpoint.bodies.solid.straighten import straighten


def test_an_element_that_folds_at_a_corner_alone_is_straightened() -> None:
    nodes = TETRAHEDRON.nodes.copy()
    # A mid-side node in the outer quarter of its straight side turns the Jacobian at the near corner, and nowhere inside.
    first, second = TETRAHEDRON.sides[0]
    nodes[4] = nodes[first] + 0.245 * (nodes[second] - nodes[first])
    inside = np.linalg.det(np.einsum("pna,nb->pab", TETRAHEDRON.slopes(TETRAHEDRON.points), nodes))
    corners = np.linalg.det(np.einsum("pna,nb->pab", TETRAHEDRON.slopes(TETRAHEDRON.nodes), nodes))
    assert inside.min() > 0.15 * inside.max()
    assert corners.min() < 0
    straight, count = straighten(nodes, np.arange(10)[None])
    assert count == 1
    assert straight == pytest.approx(TETRAHEDRON.nodes)


def test_a_curved_element_that_is_whole_stays_as_it_is() -> None:
    nodes = TETRAHEDRON.nodes.copy()
    nodes[4] = nodes[4] - [0.0, 0.1, 0.1]
    kept, count = straighten(nodes, np.arange(10)[None])
    assert count == 0
    assert (kept == nodes).all()
