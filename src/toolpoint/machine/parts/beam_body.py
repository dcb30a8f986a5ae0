"""A described beam -> a body of a machine: elements as fine as its band asks for, reduced, with what its spin does."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail
from toolpoint.bodies import Body, Interface, MassProperties
from toolpoint.bodies.beam import BeamMatrices, BeamSection, join_elements
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.parts.content_key import ContentKey
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import REACH, ActingLoads
from toolpoint.substructuring.reduction import Reduction, reduce

# Bending wave number times element length at the highest free mode that is kept: frequencies there are 3e-6 too high.
FINE = 0.25
_CLOSE = 1e-9  # m: an interface so near to a step of the section is at it


def build_beam(description: BeamDescription) -> Body:
    """Return the reduced body of a description, in the frame of the body: the beam along `axis`, from the origin on."""
    return _kept(ContentKey.of(description))


def beam_mass(description: BeamDescription) -> MassProperties:
    """Return the mass properties of a described beam in the body's frame."""
    beam = join_elements(*_elements(description, fine=False))
    turned = beam.rigid @ _from_frame(description.axis)
    return MassProperties.of_matrix(turned.T @ beam.mass @ turned)


def beam_direction(description: BeamDescription) -> FloatArray:
    """Return the direction of the beam in the body's frame, (3,)."""
    return np.eye(3)["xyz".index(description.axis)]


@lru_cache(maxsize=64)
def _kept(key: ContentKey[BeamDescription]) -> Body:
    description = key.description
    places, sections = _elements(description, fine=True)
    beam = join_elements(places, sections)
    nodes = {name: int(np.argmin(np.abs(places - at))) for name, at in description.interfaces.items()}
    columns = np.concatenate([np.arange(6 * node, 6 * node + 6) for node in sorted(set(nodes.values()))])
    loads = csc_array((np.ones(columns.size), (columns, np.arange(columns.size))), (len(beam.mass), columns.size))
    where = np.zeros((len(beam.mass), 3))
    where[:, 0] = beam.centres
    body = LargeBody(csc_array(beam.stiffness), csc_array(beam.mass), loads, beam.rigid, coordinates=where)
    return _in_frame(description, beam, reduce(body, ActingLoads(description.band)), nodes)


def _in_frame(description: BeamDescription, beam: BeamMatrices, reduction: Reduction, nodes: Mapping[str, int]) -> Body:
    """Return the body with twists turned from the beam's axes to those of the body's frame."""
    turn = _from_frame(description.axis)
    along = beam_direction(description)
    motion = np.hstack([beam.rigid @ turn, reduction.vectors])
    mass = np.zeros((6 + reduction.size,) * 2)
    rigid = beam.rigid @ turn
    mass[:6, :6] = rigid.T @ beam.mass @ rigid
    mass[6:, 6:] = np.eye(reduction.size)
    gyroscopic = motion.T @ beam.gyroscopic @ motion
    places = {name: Interface(beam.places[node] * along, turn.T @ reduction.vectors[6 * node:6 * node + 6])
              for name, node in nodes.items()}
    frequency = np.sqrt(np.maximum(reduction.squares, 0.0))
    note = (f"beam of {len(beam.places) - 1} Timoshenko elements, reduced from {len(beam.mass)} to {reduction.size} "
            "coordinates; "
            f"natural frequencies to {description.band:.4g} Hz can be relied on")
    return Body((mass + mass.T) / 2, np.diag(reduction.squares), 2 * description.damping_ratio * np.diag(frequency), places,
                (note,), (gyroscopic - gyroscopic.T) / 2, along)


def _from_frame(axis: str) -> FloatArray:
    """Return the map (6, 6) from a twist in the body's axes to one in the beam's, whose x is the beam's direction."""
    at = "xyz".index(axis)
    turn = np.roll(np.eye(3), -at, axis=0)
    return np.kron(np.eye(2), turn)


def _elements(description: BeamDescription, *, fine: bool) -> tuple[FloatArray, list[BeamSection]]:
    """Return the places of the nodes (m) and the section between each and the next; only steps and interfaces unless `fine`."""
    if not description.segments:
        fail("segments", "none", "must be at least one")
    if not description.interfaces:
        fail("interfaces", "none", "must be at least one", "a body is held by its interfaces: name: distance from the origin")
    ends = np.cumsum([0.0, *(segment.length for segment in description.segments.values())])
    for name, at in description.interfaces.items():
        if at > ends[-1] + _CLOSE:
            fail(f"interfaces.{name}", f"{at:g} m", f"must be on the beam, which is {ends[-1]:g} m long")
    sections = []
    for name, segment in description.segments.items():
        try:
            sections.append(segment.section)
        except Exception as error:
            raise type(error)(f"segments.{name}.{error}") from None
    stops = [*ends, *(at for at in description.interfaces.values() if np.abs(ends - at).min() > _CLOSE)]
    places, kinds = [0.0], []
    for a, b in pairwise(np.sort(stops)):
        section = sections[int(np.searchsorted(ends, (a + b) / 2)) - 1]
        count = max(2, int(np.ceil((b - a) * _wave_number(section, REACH * description.band) / FINE))) if fine else 1
        places += np.linspace(a, b, count + 1)[1:].tolist()
        kinds += [section] * count
    return np.array(places), kinds


def _wave_number(section: BeamSection, frequency: float) -> float:
    """Return the larger wave number of slender bending at a frequency (Hz), rad/m; shear and rotary inertia raise it."""
    omega = 2 * np.pi * frequency
    softest, heaviest = min(section.bending_y, section.bending_z), section.mass
    bending = (omega**2 * heaviest / softest) ** 0.25
    shear = omega * np.sqrt(heaviest / min(section.shear_y, section.shear_z))
    return float(np.hypot(bending, shear))
