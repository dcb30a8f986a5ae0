"""A described beam -> a body of a machine: elements as fine as its band asks for, reduced, with what its spin does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail
from toolpoint.bodies import Body, Interface, MassProperties
from toolpoint.bodies.beam import BeamMatrices, BeamSection, join_elements
from toolpoint.bodies.reduced import ReducedBody, ReducedPart
from toolpoint.bodies.residual_form import ResidualForm
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.parts.beam_surface import beam_surface
from toolpoint.machine.parts.content_key import ContentKey
from toolpoint.machine.parts.residual_places import PlaceLoads, residual_form
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO
from toolpoint.substructuring.reduction import Reduction, reduce

# Bending wave number times element length at the highest free mode that is kept: frequencies there are 3e-6 too high.
MAX_PHASE_PER_ELEMENT = 0.25
EMPTY_BODY = ReducedBody(Body(np.zeros((6, 6))), {})
_STEP_TOLERANCE = 1e-9  # m: an interface so near to a step of the section is at it


def beam_mass(description: BeamDescription) -> MassProperties:
    """Return the mass properties of a described beam in the body's frame."""
    places, owners = _elements(description, fine=False)
    beam = join_elements(places, [description.segments[name].section for name in owners])
    turned = beam.rigid @ _from_frame(description.axis)
    return MassProperties.of_matrix(turned.T @ beam.mass @ turned)


def beam_direction(description: BeamDescription) -> FloatArray:
    """Return the direction of the beam in the body's frame, (3,)."""
    return np.eye(3)["xyz".index(description.axis)]


@dataclass(frozen=True, eq=False)
class BeamBasis:
    """A reduced beam with the places of its nodes (m), the segment of each element, its shapes and their squares, and the nodes
    of its interfaces."""

    places: FloatArray
    owners: tuple[str, ...]
    reduction: Reduction
    nodes: Mapping[str, int]
    reduced: ReducedBody


def beam_basis(description: BeamDescription) -> BeamBasis:
    """Return shapes and elements of a described beam."""
    return _reduce_beam(ContentKey.of(description))


@lru_cache(maxsize=64)
def _reduce_beam(key: ContentKey[BeamDescription]) -> BeamBasis:
    description = key.description
    places, owners = _elements(description, fine=True)
    beam = join_elements(places, [description.segments[name].section for name in owners])
    nodes = {name: int(np.argmin(np.abs(places - distance))) for name, distance in description.interfaces.items()}
    columns = np.concatenate([np.arange(6 * node, 6 * node + 6) for node in sorted(set(nodes.values()))])
    loads = csc_array((np.ones(columns.size), (columns, np.arange(columns.size))), (len(beam.mass), columns.size))
    where = np.zeros((len(beam.mass), 3))
    where[:, 0] = beam.centres
    body = LargeBody(csc_array(beam.stiffness), csc_array(beam.mass), loads, beam.rigid, coordinates=where)
    basis = BeamBasis(places, owners, reduce(body, ActingLoads(description.band)), nodes, EMPTY_BODY)
    note = (f"beam of {len(places) - 1} Timoshenko elements, reduced from {len(beam.mass)} to {basis.reduction.size} "
            f"coordinates; natural frequencies to {description.band:.4g} Hz can be relied on")
    nominal = _body_in_frame(description, basis, notes=(note,))
    return replace(basis, reduced=ReducedBody(nominal, _parts(description, basis)))


def _body_in_frame(description: BeamDescription, basis: BeamBasis, notes: tuple[str, ...]) -> Body:
    """Return the body with these shapes, its twists in the axes of the body's frame, without loss factors."""
    beam = join_elements(basis.places, [description.segments[name].section for name in basis.owners])
    mass, stiffness, gyroscopic = _projected(beam, basis, description.axis)
    along, turn, vectors = beam_direction(description), _from_frame(description.axis), basis.reduction.vectors
    places = {name: Interface(beam.places[node] * along, turn.T @ vectors[6 * node:6 * node + 6])
              for name, node in basis.nodes.items()}
    frequency = np.sqrt(np.maximum(basis.reduction.squares, 0.0))
    return Body(mass, stiffness, 2 * description.damping_ratio * np.diag(frequency), places, notes, gyroscopic, along,
                surface=beam_surface(description, basis.places, basis.owners, motion=vectors),
                residual=_residual(beam, basis, turn))


def _residual(beam: BeamMatrices, basis: BeamBasis, turn: FloatArray) -> ResidualForm:
    """Return the residual form of the reduction: its loads are those of the nodes of all interfaces, in order."""
    size, nodes = len(beam.mass), sorted(set(basis.nodes.values()))
    unit = {node: csc_array((np.ones(6), (np.arange(6 * node, 6 * node + 6), np.arange(6))), (size, 6)) for node in nodes}
    loads = {str(node): PlaceLoads(unit[node], csc_array((size, 0)), turn.T) for node in nodes}
    lower = np.linalg.cholesky(beam.rigid.T @ beam.mass @ beam.rigid)
    form = residual_form(basis.reduction, lower.T @ turn, loads)
    return replace(form, places={name: form.places[str(node)] for name, node in basis.nodes.items()})


def _projected(beam: BeamMatrices, basis: BeamBasis, axis: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mass (6 + r, 6 + r), stiffness (r, r) and gyroscopic matrix (6 + r, 6 + r) over rigid motions and shapes."""
    vectors = basis.reduction.vectors
    motion = np.hstack([beam.rigid @ _from_frame(axis), vectors])
    mass, stiffness = motion.T @ beam.mass @ motion, vectors.T @ beam.stiffness @ vectors
    gyroscopic = motion.T @ beam.gyroscopic @ motion
    return (mass + mass.T) / 2, (stiffness + stiffness.T) / 2, (gyroscopic - gyroscopic.T) / 2


def _parts(description: BeamDescription, basis: BeamBasis) -> dict[str, ReducedPart]:
    """Return the reduced parts of all segments and sleeves."""
    return {part: beam_part(description, basis, part) for part in description.numbers}


def beam_part(description: BeamDescription, basis: BeamBasis, part: str) -> ReducedPart:
    """Return what a segment or sleeve (``segment.sleeve``) brings with these shapes; its section may differ from theirs."""
    name, _, sleeve = part.partition(".")
    segment = description.segments[name]
    section = segment.sleeve.ring(segment.diameter) if sleeve and segment.sleeve and segment.diameter else segment.core
    segment_beam = join_elements(basis.places, [section if owner == name else None for owner in basis.owners])
    mass, stiffness, gyroscopic = _projected(segment_beam, basis, description.axis)
    return ReducedPart(description.numbers[part], stiffness, mass, gyroscopic)


def _from_frame(axis: str) -> FloatArray:
    """Return the map (6, 6) from a twist in the body's axes to one in the beam's, whose x is the beam's direction."""
    axis_number = "xyz".index(axis)
    turn = np.roll(np.eye(3), -axis_number, axis=0)
    return np.kron(np.eye(2), turn)


def _elements(description: BeamDescription, *, fine: bool) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the places of the nodes (m) and the segment of each element; nodes at steps and interfaces only unless `fine`."""
    if not description.segments:
        fail("segments", "none", "must be at least one")
    if not description.interfaces:
        fail("interfaces", "none", "must be at least one",
             remedy="a body is held by its interfaces: name: distance from the origin")
    ends = np.cumsum([0.0, *(segment.length for segment in description.segments.values())])
    for name, distance in description.interfaces.items():
        if distance > ends[-1] + _STEP_TOLERANCE:
            fail(f"interfaces.{name}", f"{distance:g} m", f"must be on the beam, which is {ends[-1]:g} m long")
    sections = []
    for name, segment in description.segments.items():
        try:
            sections.append(segment.section)
        except Exception as error:
            raise type(error)(f"segments.{name}.{error}") from None
    stops = [*ends, *(distance for distance in description.interfaces.values()
                      if np.abs(ends - distance).min() > _STEP_TOLERANCE)]
    names, owners = list(description.segments), list[str]()
    places = [0.0]
    for a, b in pairwise(np.sort(stops)):
        segment_number = int(np.searchsorted(ends, (a + b) / 2)) - 1
        count = max(2, int(np.ceil((b - a) * _wave_number(sections[segment_number],
                                                          DEFAULT_REACH_RATIO * description.band)
                                   / MAX_PHASE_PER_ELEMENT))) if fine else 1
        places += np.linspace(a, b, count + 1)[1:].tolist()
        owners += [names[segment_number]] * count
    return np.array(places), tuple(owners)


def _wave_number(section: BeamSection, frequency: float) -> float:
    """Return the larger wave number of slender bending at a frequency (Hz), rad/m; shear and rotary inertia raise it."""
    omega = 2 * np.pi * frequency
    softest, heaviest = min(section.bending_y, section.bending_z), section.mass
    bending = (omega**2 * heaviest / softest) ** 0.25
    shear = omega * np.sqrt(heaviest / min(section.shear_y, section.shear_z))
    return float(np.hypot(bending, shear))
