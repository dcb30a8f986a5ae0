"""The chain of components: its reading, its relative motions, and another order with fewer freedoms."""

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
_GIVEN_LINK_BONUS = 0.01  # freedoms: less than one, so that it only decides between trees that need equally many


def parents(chain: Sequence[str] | Mapping[str, str], components: Sequence[str]) -> dict[str, str]:
    """Return the parent of every child.

    `chain` is a sequence from the ground (or from the first component) outwards, or a map from child to parent.
    """
    parent_of = dict(chain) if isinstance(chain, Mapping) else dict(zip(chain[1:], chain[:-1], strict=True))
    names = list(dict.fromkeys([*parent_of.values(), *parent_of])) if isinstance(chain, Mapping) else list(chain)
    if GROUND in components:
        fail("components", f"a component named {GROUND!r}", "that name is kept for what stands still")
    unknown = [name for name in names if name not in components and name != GROUND]
    if unknown:
        fail("chain", f"{unknown}", f"must be {GROUND!r} or one of {', '.join(components)}")
    if len(set(names)) != len(names):
        fail("chain", "a component appears twice", "each must appear once")
    left_out = [name for name in components if name not in names]
    if left_out:
        fail("chain", f"without {left_out}", "must hold every component", remedy="leave its points out or give its place")
    if GROUND in parent_of or not parent_of:
        fail("chain", f"{chain!r}", f"must start at {GROUND!r} or a component and name at least one joint")
    _check_tree(parent_of)
    return parent_of


def _check_tree(parent_of: Mapping[str, str]) -> None:
    """Refuse several roots, and loops."""
    roots = {name for name in parent_of.values() if name not in parent_of}
    if len(roots) != 1:
        fail("chain", f"{len(roots)} starting points {sorted(roots)}", "must have exactly one",
             remedy="closed chains cannot be told")
    for child in parent_of:
        visited, ancestor = {child}, parent_of[child]
        while ancestor in parent_of:
            if ancestor in visited:
                fail("chain", f"a loop through {ancestor!r}", "must be a tree")
            visited.add(ancestor)
            ancestor = parent_of[ancestor]


def relative_motion_of(parent: str, child: str, parts: Mapping[str, Component], *,
                       motions: Mapping[str, RigidMotion]) -> RelativeMotion:
    """Return the motion of a component relative to another, or to the ground."""
    component = parts[child]
    if parent == GROUND:
        return relative(None, motions[child], parent, scale=(component.motion, component.centre, component.size))
    other = parts[parent]
    scale = (np.maximum(component.motion, other.motion), (component.centre + other.centre) / 2, max(component.size, other.size))
    return relative(motions[parent], motions[child], parent, scale=scale)


def better_order(
    parent_of: Mapping[str, str], parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], *, criterion: Criterion,
) -> tuple[int, int, list[tuple[str, str]]]:
    """Return (freedoms of the given tree, fewest freedoms of any tree, (child, parent) of the joints of that tree).

    The tree with the fewest freedoms in all is the minimum spanning tree of the freedoms between all pairs.
    """
    names = [*([GROUND] if GROUND in parent_of.values() else []), *parts]
    cost = np.zeros((len(names), len(names)))
    for i, j in combinations(range(len(names)), 2):
        motion = relative_motion_of(names[i], names[j], parts, motions=motions)
        # One is added because the tree search reads zero as no link.
        cost[i, j] = freedoms(stack_twists(motion, criterion), criterion) + 1
    index = {name: i for i, name in enumerate(names)}
    total = sum(cost[tuple(sorted((index[a], index[b])))] - 1 for a, b in parent_of.items())
    # Of trees with equally few freedoms the one that shares most joints with the given one.
    for child, parent in parent_of.items():
        link = tuple(sorted((index[child], index[parent])))
        cost[link] -= _GIVEN_LINK_BONUS
    best = minimum_spanning_tree(cost).tocoo()
    links = [(names[i], names[j]) for i, j in zip(best.row, best.col, strict=True)]
    min_freedoms = sum(round(float(value) + _GIVEN_LINK_BONUS / 2) - 1 for value in best.data)
    return int(total), int(min_freedoms), _root_tree(links, names[0])


def _root_tree(links: Sequence[tuple[str, str]], root: str) -> list[tuple[str, str]]:
    """Return (child, parent) pairs of a tree of undirected links, from its root outwards."""
    links_left, placed, result = list(links), [root], []
    while links_left:
        a, b = next((a, b) for a, b in links_left if (a in placed) != (b in placed))
        links_left.remove((a, b))
        child, parent = (b, a) if a in placed else (a, b)
        placed.append(child)
        result.append((child, parent))
    return result
