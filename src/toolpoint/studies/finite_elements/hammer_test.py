"""Virtual hammer test of a machine of finite elements: points chosen by its model, noisy records, identified modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray, count, fail, nonnegative, positive
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.modal_identification import identify
from toolpoint.modal_identification.judgement.identification import Identification
from toolpoint.signals.hammer import hammer_test
from toolpoint.signals.setups import join_setups
from toolpoint.spatial import transform as tf
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.studies.machines.virtual_test import Hammer, Imperfections, hammer_records
from toolpoint.studies.testing.modal_test_plan import PULSE_CONTACT_CYCLES, RING_DOWN_FRACTION
from toolpoint.studies.testing.point_choice import choose_points, choose_struck
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.sparse import EigenPairs

_MAX_CANDIDATE_NODES = 120  # spread over the outside
# Blocks from blow to blow: what still rings in a weak direction would be refused.
_BLOW_DISTANCE_BLOCKS = 1.6
# Samples a second over the highest line: the filter of a coarser acquisition rings before the pulse.
_SAMPLE_RATE_RATIO = 5.12


@dataclass(frozen=True, eq=False)
class PlannedNodes(NotebookText):
    """Nodes to measure at (numbers from 1, over all parts) and Dofs to strike, each along a normal of the part's box."""

    nodes: tuple[int, ...]
    struck: tuple[Dof, ...]

    def __repr__(self) -> str:
        return f"PlannedNodes({len(self.nodes)} nodes, strike {', '.join(map(str, self.struck))})"


@dataclass(frozen=True, eq=False)
class FiniteElementTest(NotebookText):
    """A virtual test, as a person would have it: points by numbers and places of the test's own frame, responses, modes.

    coordinates : point to (3,), m, in the test's frame; struck : Dofs; frf : Frf with coherence; identification; truth : Modes
    of the tested machine at the same Dofs, which no real test has.
    """

    coordinates: Mapping[str | int, FloatArray]
    struck: tuple[Dof, ...]
    frf: Frf
    identification: Identification
    truth: Modes

    @property
    def modes(self) -> Modes:
        """The identified modes."""
        return self.identification.modes

    @property
    def coherence(self) -> FloatArray:
        """Median coherence of all responses at every line, (n_f,)."""
        return np.asarray(np.median(np.asarray(self.frf.coherence), axis=(1, 2)))

    def __repr__(self) -> str:
        return (f"FiniteElementTest({len(self.coordinates)} points, {len(self.struck)} struck, {self.modes.count} modes to "
                f"{self.modes.frequency.max():.4g} Hz)")


def plan_nodes(machine: FiniteElementMachine, pairs: EigenPairs, number: int = 24, *, struck: int = 3) -> PlannedNodes:
    """Return the nodes to measure and to strike that separate the modes of the model best (effective independence).

    Nodes on the boxes of the parts are taken that no other part covers and that are not on the floor.
    """
    nodes, normals = reachable_nodes(machine)
    chosen = _choose_distant(machine.nodes[nodes - 1], min(_MAX_CANDIDATE_NODES, len(nodes)))
    nodes, normals = nodes[chosen], [normals[i] for i in chosen]
    modes = machine.node_modes(pairs, nodes.tolist(), 0.0)
    along = [Dof(int(node), way) for node, ways in zip(nodes, normals, strict=True) for way in ways]
    hit = choose_struck(modes, along, count("struck", struck))
    points = choose_points(modes, count("number", number), list(dict.fromkeys(dof.point for dof in hit)))
    return PlannedNodes(tuple(int(p) for p in points), tuple(hit))


def run_hammer_test(
    machine: FiniteElementMachine, pairs: EigenPairs, planned: PlannedNodes, *, rng: np.random.Generator,
    damping_ratio: float | FloatArray = 0.02, noise: float = 0.01, frame: FloatArray | None = None, misplaced: float = 0.0,
    highest: float | None = None, hits: int = 3,
) -> FiniteElementTest:
    """Return the responses and modes of a hammer test of the machine.

    Parameters
    ----------
    machine : FiniteElementMachine
        The machine that is tested: the truth, not the model.
    pairs : EigenPairs
        Its modes; those above `highest` act on the responses too, so there should be some.
    planned : PlannedNodes
        Of the same mesh.
    rng : numpy.random.Generator
    damping_ratio : float or (n_modes,)
    noise : float
        On every channel, as share of its rms.
    frame : (4, 4) floats, optional
        From the machine's frame to that in which the test was written down: its x, y, z and origin.
    misplaced : float
        Standard deviation with which places were measured, m.
    highest : float, optional
        Last line, Hz; a tenth above the tenth mode, or above the last.
    hits : int
        Blows at every struck Dof.
    """
    move = np.eye(4) if frame is None else frame
    modes = _modes_in_frame(machine.node_modes(pairs, planned.nodes, damping_ratio), planned, move)
    spread = float(nonnegative("misplaced", np.array(misplaced)))
    drawn = tf.move(move, machine.nodes[np.array(planned.nodes) - 1])
    place: dict[str | int, FloatArray] = {i + 1: position + spread * rng.normal(size=3) for i, position in enumerate(drawn)}
    struck = tuple(replace(dof, point=planned.nodes.index(int(dof.point)) + 1) for dof in _struck_along_axes(planned, move))
    line_max = 1.1 * float(modes.frequency[min(9, modes.count - 1)]) if highest is None else positive("highest", highest)
    decay = float((modes.damping_ratio * modes.omega).min())
    if decay <= 0:
        fail("damping_ratio", "0", "must be above 0 for every mode", remedy="a ring-down without end fits no block")
    block = float(np.log(1 / RING_DOWN_FRACTION) / decay)
    hammer = Hammer(contact=PULSE_CONTACT_CYCLES / line_max, hits=hits, block=_BLOW_DISTANCE_BLOCKS * block,
                    sample_rate=float(np.ceil(_SAMPLE_RATE_RATIO * line_max)))
    parts = []
    for dof in struck:
        record = hammer_records(modes, dof, list(modes.dofs), rng=rng, hammer=hammer, imperfections=Imperfections(noise=noise))
        parts.append(hammer_test(record, block, highest=line_max).frf)
    frf = join_setups(parts)
    result = identify(frf, band=(0.5 * float(modes.frequency[0]), line_max))
    return FiniteElementTest(place, struck, frf, result, modes)


def _modes_in_frame(modes: Modes, planned: PlannedNodes, frame: FloatArray) -> Modes:
    """Return modes with the test's numbers of points, along the axes of the test's frame."""
    shape = modes.shape.reshape(len(planned.nodes), 3, modes.count)
    turned = np.einsum("ab,nbm->nam", frame[:3, :3], shape).reshape(-1, modes.count)
    labels = tuple(Dof(i + 1, way) for i in range(len(planned.nodes)) for way in ("+x", "+y", "+z"))
    return replace(modes, shape=turned, dofs=labels)


def _struck_along_axes(planned: PlannedNodes, frame: FloatArray) -> list[Dof]:
    """Return the struck Dofs along the nearest axis of the test's frame: a person strikes along the axes of the sketch."""
    result = []
    for dof in planned.struck:
        way = frame[:3, :3] @ dof.unit[:3]
        result.append(Dof(dof.point, "+" + "xyz"[int(np.argmax(np.abs(way)))]))
    return result


def reachable_nodes(machine: FiniteElementMachine) -> tuple[IndexArray, list[list[str]]]:
    """Return numbers (from 1) of nodes on the outside of the parts' boxes, and the directions in which each can be struck."""
    floor = float(machine.nodes[:, 2].min()) + 1e-6
    boxes = {name: (m.nodes.min(axis=0) - 1e-6, m.nodes.max(axis=0) + 1e-6) for name, m in machine.parts.items()}
    numbers, normals = [], []
    for name, model in machine.parts.items():
        lower, upper = model.nodes.min(axis=0), model.nodes.max(axis=0)
        for i in np.unique(np.concatenate([faces.ravel() for faces in outer_faces(model)])).tolist():
            position = model.nodes[i]
            ways = ["+" + "xyz"[k] for k in range(3) if min(abs(position[k] - lower[k]), abs(position[k] - upper[k])) < 1e-9]
            covered = any(((position >= a) & (position <= b)).all() for other, (a, b) in boxes.items() if other != name)
            if ways and not covered and position[2] > floor:
                numbers.append(machine.starts[name] // 3 + i + 1)
                normals.append(ways)
    if not numbers:
        fail("machine", "no node on the outside of its parts' boxes", "must have some", remedy="give nodes by hand")
    return np.array(numbers), normals


def _choose_distant(places: FloatArray, number: int) -> list[int]:
    """Return places far from each other: each next one is the farthest from all before it."""
    chosen = [int(np.argmax(np.linalg.norm(places - places.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < number:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return chosen
