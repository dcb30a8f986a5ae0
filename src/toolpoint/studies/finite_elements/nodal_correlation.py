"""Correlation of a machine of finite elements with a test: nodes and modes paired, mixtures and places of wrong shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from toolpoint._check import Array, FloatArray
from toolpoint._doubt import Doubt, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.spatial import transform as tf
from toolpoint.studies.finite_elements.hammer_test import FiniteElementTest, reachable_nodes
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.studies.measured.model_correlation import ModelCorrelation, correlate_modes
from toolpoint.studies.measured.point_pairing import PointPairing, pair_points, register_points
from toolpoint.studies.text_table import text_table
from toolpoint.vibration.correlation import combine_shapes, mac_without
from toolpoint.vibration.sparse import EigenPairs

# Least gain of MAC by a mix of neighbouring modes that is worth a sentence.
_MIN_MAC_GAIN = 0.05


@dataclass(frozen=True, eq=False)
class FiniteElementCorrelation(NotebookText):
    """Correlation of a test with a machine of finite elements.

    correlation : points, pairs, MAC, the coefficients, COMAC; without : node to (n_pairs,) gain of MAC where it is left out;
    factors : (n_measured, n_predicted) coefficients of the mix of neighbouring model shapes that is nearest to each measured
    shape; mix : (n_measured,) MAC with that mix; node_parts : node to its part; neighbour_range : largest relative difference
    of frequency of a neighbour; doubts : about points and modes.
    """

    correlation: ModelCorrelation
    without: Mapping[str | int, FloatArray]
    factors: Array
    mix: FloatArray
    node_parts: Mapping[str | int, str]
    neighbour_range: float
    doubts: tuple[Doubt, ...] = ()

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Measured and predicted mode of every pair, from 0."""
        return [(int(i), int(j)) for i, j in self.correlation.pairs.pairs]

    def rows(self) -> list[list[str]]:
        """Return a row for every pair: frequencies, difference, MAC, MAC with the mix of neighbours, the coefficients."""
        c, now = self.correlation.coefficients, self.correlation
        rows = []
        for r, (i, j) in enumerate(self.pairs):
            assert c is not None
            f, g = float(now.measured.frequency[i]), float(now.predicted.frequency[j])
            rows.append([str(i + 1), f"{f:.2f}", str(j + 1), f"{g:.2f}", f"{100 * (g / f - 1):+.2f}", f"{now.mac[i, j]:.3f}",
                         f"{self.mix[i]:.3f}", f"{c.frequency[r]:.3f}", f"{c.displacement[r]:.3f}", f"{c.weight[r]:.3f}"])
        return rows

    def worst_points(self, number: int = 5) -> list[tuple[str, int, float]]:
        """Return the `number` points whose omission raises a MAC most: part and node as text, pair from 0, gain."""
        gains = [(f"{self.node_parts[point]} {point}", int(np.nanargmax(g)), float(np.nanmax(g)))
                 for point, g in self.without.items() if not np.isnan(g).all()]
        return sorted(gains, key=lambda entry: -entry[2])[:number]

    def mixed_modes(self) -> list[str]:
        """Return a line on every paired mode whose MAC with a mix of neighbours is higher by more than 0.05 than alone."""
        lines = []
        for i, j in self.pairs:
            if self.mix[i] - self.correlation.mac[i, j] > _MIN_MAC_GAIN:
                parts = [f"{abs(self.factors[i, k]):.2f} of mode {k + 1}" for k in np.argsort(-np.abs(self.factors[i]))[:3]
                         if abs(self.factors[i, k]) > 0.1]
                lines.append(f"measured mode {i + 1} is a mix: {', '.join(parts)} (MAC {self.correlation.mac[i, j]:.2f} with "
                             f"mode {j + 1} alone, {self.mix[i]:.2f} with the mix)")
        return lines

    def table(self) -> str:
        """Return doubts, pairs, coefficients, mixes and the points that cost most as text."""
        return "\n".join(with_notes(self.result_lines(), self.doubts))

    def result_lines(self) -> list[str]:
        """Return the lines of `table` without the doubts."""
        c = self.correlation.coefficients
        lines = [f"{len(self.correlation.points.pairs)} points: {self.correlation.points.status}",
                 text_table("Test beside model", HEADER, self.rows()), *self.mixed_modes()]
        if c is not None:
            moved, mac = float(c.weight @ c.displacement), float(c.weight @ c.mac)
            lines.append(f"over all pairs: mean {c.mean:.4f}, mass {c.mass:.4f}, displacement {moved:.4f}, MAC {mac:.4f}, "
                         f"total {c.total:.4f}")
        lines += [f"without {name} the MAC of pair {pair + 1} rises by {gain:.3f}" for name, pair, gain in self.worst_points(3)
                  if gain > 1e-3]
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {**self.correlation.to_dict(), "mac_with_mix": self.mix.tolist(),
                "gain_without": {str(p): g.tolist() for p, g in self.without.items()}, "doubts": list(self.doubts)}

    def __repr__(self) -> str:
        return f"FiniteElementCorrelation({self.correlation!r})"


HEADER = ("measured", "Hz", "model", "Hz ", "%", "MAC", "MAC of mix", "frequency", "displacement", "mass share")


def correlate_finite_elements(
    machine: FiniteElementMachine, pairs: EigenPairs, test: FiniteElementTest, *, furthest: float = 0.02,
    known_pairs: Mapping[str | int, str | int] | None = None, lowest_mac: float = 0.5, neighbour_range: float = 0.15,
) -> FiniteElementCorrelation:
    """Return the agreement of a model with a test: points to nodes, modes to modes, coefficients, shape filters.

    Parameters
    ----------
    machine, pairs
        The model and its modes.
    test : FiniteElementTest
        Its truth is not looked at.
    furthest : float
        Distance in m: points farther from every node after registration are not paired.
    known_pairs : mapping of point to node number, optional
        Three pairs fix the frame; else it is searched for by `register_points`.
    lowest_mac : float
        First shape filter: modes with a lower MAC are not paired.
    neighbour_range : float
        Second shape filter: model shapes within this relative difference of frequency may be mixed.
    """
    # Only nodes on the outside can carry a sensor.
    outside: dict[str | int, FloatArray] = {int(node): machine.nodes[node - 1] for node in reachable_nodes(machine)[0]}
    start, doubt = register_points(test.coordinates, outside) if known_pairs is None else (None, None)
    points = pair_points(test.coordinates, outside, furthest, known_pairs=known_pairs, start=start)
    measured = points.renamed(test.modes)
    nodes = list(dict.fromkeys(int(dof.point) for dof in measured.dofs))
    # Shapes of undamped modes: the damping does not enter the comparison.
    predicted = machine.modes_at(pairs, measured.dofs, 0.0)
    result = correlate_modes(points, measured, predicted, mass=lambda: machine.effective_mass(pairs),
                             lowest_mac=lowest_mac)
    ratio = result.predicted.frequency[None, :] / result.measured.frequency[:, None]
    factors, mix = combine_shapes(result.measured.shape, result.predicted.shape, np.abs(ratio - 1) <= neighbour_range)
    doubts = tuple(line for line in (doubt, question_close_nodes(points, test, outside), *result.doubts) if line)
    return FiniteElementCorrelation(result, _gains(result), factors, mix, {n: machine.part_of_node[n - 1] for n in nodes},
                                    neighbour_range,
                                    doubts)


def question_close_nodes(points: PointPairing, test: FiniteElementTest, nodes: Mapping[str | int, FloatArray]
                         ) -> Doubt | None:
    """Return a doubt about points that have another node nearly as near as their own, None where there is none.

    nodes : node to its place (3,), m. Nearly is within the root mean square of the distances to the nearest nodes.
    """
    names = list(points.pairs)
    distances, _ = cKDTree(np.array(list(nodes.values()))).query(
        tf.move(points.transform, np.array([test.coordinates[name] for name in names])), k=2)
    # The distance to the nearest nodes shows how well places were measured.
    spread = float(np.sqrt((distances[:, 0] ** 2).mean()))
    unsure = [str(name) for name, (first, second) in zip(names, distances, strict=True) if second - first < spread]
    if not unsure:
        return None
    return Doubt(f"points {', '.join(unsure)}", "lie between two nodes, within the error of places: either may be meant")


def _gains(result: ModelCorrelation) -> dict[str | int, FloatArray]:
    """Return point to the gain of MAC of every pair, (n_pairs,), where the point is left out."""
    if not len(result.pairs.pairs):
        return {}
    first, second = result.measured.shape[:, result.pairs.pairs[:, 0]], result.predicted.shape[:, result.pairs.pairs[:, 1]]
    rows: dict[str | int, list[int]] = {}
    for k, dof in enumerate(result.measured.dofs):
        rows.setdefault(dof.point, []).append(k)
    return dict(zip(rows, mac_without(first, second, list(rows.values())) - result.pairs.values, strict=True))
