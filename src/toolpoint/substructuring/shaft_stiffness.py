"""Dynamic stiffness of a stepped shaft over its ends, contacts and stations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.substructuring.shaft import SegmentDescription, ShaftDescription

SECTION_TOLERANCE = 1e-9  # m: sections nearer to each other are one


@dataclass(frozen=True, eq=False)
class StationStiffness:
    """Dynamic stiffness (n_f, 2 n, 2 n) of a free shaft over (deflection, slope) of its sections, the base first.

    sections : of every station by name, its place among the sections; the tip is the last section.
    """

    frequency: FloatArray
    matrix: ComplexArray
    sections: Mapping[str, int]

    @property
    def count(self) -> int:
        """Number of sections."""
        return self.matrix.shape[-1] // 2


def station_stiffness(shaft: ShaftDescription, frequency: FloatArray, stations: Mapping[str, float] | None = None
                      ) -> StationStiffness:
    """Assemble the dynamic stiffness of a shaft over its ends, contacts and stations (those of the shaft where left out).

    frequency : Hz; stations : name -> distance from the base plane, m.

    Raises ToolpointError for a station beyond the shaft.
    """
    from toolpoint.substructuring import segment_kernel

    places = dict(shaft.stations if stations is None else stations)
    cuts = sorted(places.values())
    omega = 2 * np.pi * np.asarray(frequency, float)
    elements, position, section = [], 0.0, 0
    positions = [0.0]
    for segment in shaft.segments.values():
        if segment.contact is not None:
            elements.append((section, _contact_stiffness(segment, omega.size)))
            section += 1
            positions.append(position)
        for piece in _pieces(segment, position, cuts):
            block = np.empty((omega.size, 4, 4), complex)
            row = segment.row
            row[5] = piece
            segment_kernel.segment_stiffness(omega, row, block)
            elements.append((section, block))
            section, position = section + 1, position + piece
            positions.append(position)
    matrix = np.zeros((omega.size, 2 * section + 2, 2 * section + 2), complex)
    # Assembly as of finite elements: a section adds the blocks of the segments on both sides of it.
    for start, block in elements:
        matrix[:, 2 * start:2 * start + 4, 2 * start:2 * start + 4] += block
    return StationStiffness(np.asarray(frequency, float), matrix, _sections(places, positions))


def _sections(places: Mapping[str, float], positions: list[float]) -> dict[str, int]:
    result = {}
    for name, position in places.items():
        distance = np.abs(np.array(positions) - position)
        if distance.min() > SECTION_TOLERANCE:
            fail(f"stations.{name}", f"{position:g} m", f"must be within the shaft, 0 .. {positions[-1]:g} m")
        result[name] = int(np.flatnonzero(distance <= SECTION_TOLERANCE)[-1])  # beyond a contact at the same place
    return result


def _pieces(segment: SegmentDescription, start: float, cuts: list[float]) -> list[float]:
    inside = [cut for cut in cuts if start + SECTION_TOLERANCE < cut < start + segment.length - SECTION_TOLERANCE]
    edges = [start, *sorted(set(inside)), start + segment.length]
    return [float(piece) for piece in np.diff(edges) if piece > SECTION_TOLERANCE]


def _contact_stiffness(segment: SegmentDescription, lines: int) -> ComplexArray:
    contact = segment.contact
    assert contact is not None
    k = np.diag([contact.stiffness, contact.rotational_stiffness]) * (1 + 1j * contact.loss_factor)
    return np.broadcast_to(np.block([[k, -k], [-k, k]]), (lines, 4, 4)).copy()
