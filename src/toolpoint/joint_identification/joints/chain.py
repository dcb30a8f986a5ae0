"""The chain of components: its reading, its relative motions, and whether another order would need fewer freedoms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from toolpoint._check import fail
from toolpoint.joint_identification.joints.joint_fit import Criterion, freedoms, stack_twists
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion, relative
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion

GROUND = "ground"
# Less than one freedom, so that it only decides between trees that need equally many.
_PREFERRED = 0.01


def parents(chain: Sequence[str] | Mapping[str, str], components: Sequence[str]) -> dict[str, str]:
    """Return the parent of every child.

    `chain` is a sequence from the ground (or from the first component) outwards, or a map from child to parent.
    """
    given = dict(chain) if isinstance(chain, Mapping) else dict(zip(chain[1:], chain[:-1], strict=True))
    names = list(dict.fromkeys([*given.values(), *given])) if isinstance(chain, Mapping) else list(chain)
    if GROUND in components:
        fail("components", f"a component named {GROUND!r}", "that name is kept for what stands still")
    unknown = [name for name in names if name not in components and name != GROUND]
    if unknown:
        fail("chain", f"{unknown}", f"must be {GROUND!r} or one of {', '.join(components)}")
    if len(set(names)) != len(names):
        fail("chain", "a component appears twice", "each must appear once")
    left = [name for name in components if name not in names]
    if left:
        fail("chain", f"without {left}", "must hold every component", remedy="leave its points out or give its place")
    if GROUND in given or not given:
        fail("chain", f"{chain!r}", f"must start at {GROUND!r} or a component and name at least one joint")
    _check_tree(given)
    return given


def _check_tree(given: Mapping[str, str]) -> None:
    roots = {name for name in given.values() if name not in given}
    if len(roots) != 1:
        fail("chain", f"{len(roots)} starting points {sorted(roots)}", "must have exactly one",
             remedy="closed chains cannot be told")
    for child in given:
        seen, at = {child}, given[child]
        while at in given:
            if at in seen:
                fail("chain", f"a loop through {at!r}", "must be a tree")
            seen.add(at)
            at = given[at]


def pair(parent: str, child: str, parts: Mapping[str, Component], *, motions: Mapping[str, RigidMotion]) -> RelativeMotion:
    """Return the motion of a component relative to another, or to the ground."""
    component = parts[child]
    if parent == GROUND:
        return relative(None, motions[child], parent, scale=(component.motion, component.centre, component.size))
    other = parts[parent]
    scale = (np.maximum(component.motion, other.motion), (component.centre + other.centre) / 2, max(component.size, other.size))
    return relative(motions[parent], motions[child], parent, scale=scale)


def better_order(
    given: Mapping[str, str], parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], *, criterion: Criterion,
) -> tuple[int, int, list[tuple[str, str]]]:
    """Return (freedoms of the given tree, fewest freedoms of any tree, (child, parent) of the joints of that tree).

    The tree with the fewest freedoms in all is the minimum spanning tree of the freedoms between all pairs.
    """
    names = [*([GROUND] if GROUND in given.values() else []), *parts]
    cost = np.zeros((len(names), len(names)))
    for i, j in combinations(range(len(names)), 2):
        motion = pair(names[i], names[j], parts, motions=motions)
        # One is added because the tree search reads zero as no link.
        cost[i, j] = freedoms(stack_twists(motion, criterion), criterion) + 1
    places = {name: i for i, name in enumerate(names)}
    total = sum(cost[tuple(sorted((places[a], places[b])))] - 1 for a, b in given.items())
    # Of trees with equally few freedoms the one that shares most joints with the given one.
    for child, parent in given.items():
        at = tuple(sorted((places[child], places[parent])))
        cost[at] -= _PREFERRED
    best = minimum_spanning_tree(cost).tocoo()
    links = [(names[i], names[j]) for i, j in zip(best.row, best.col, strict=True)]
    fewest = sum(round(float(value) + _PREFERRED / 2) - 1 for value in best.data)
    return int(total), int(fewest), _rooted(links, names[0])


def _rooted(links: Sequence[tuple[str, str]], root: str) -> list[tuple[str, str]]:
    """Return (child, parent) pairs of a tree of undirected links, from its root outwards."""
    left, placed, result = list(links), [root], []
    while left:
        a, b = next((a, b) for a, b in left if (a in placed) != (b in placed))
        left.remove((a, b))
        child, parent = (b, a) if a in placed else (a, b)
        placed.append(child)
        result.append((child, parent))
    return result
