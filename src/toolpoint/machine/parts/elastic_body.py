"""A finite-element model -> a body of a machine: reduced, with interfaces that stand or slide, in parts that scale."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.sparse import csc_array, hstack

from toolpoint._check import FloatArray, fail, floats, within
from toolpoint.bodies import Body, Interface
from toolpoint.bodies.reduced import ElasticNumbers, ReducedBody, ReducedPart
from toolpoint.bodies.solid import NamedNodes, Patch, SolidModel
from toolpoint.bodies.solid.faces import outer_triangles, thin_triangles
from toolpoint.bodies.solid.mesh_energy import mesh_energy
from toolpoint.bodies.solid.region import SolidPlace
from toolpoint.bodies.surface import BodySurface
from toolpoint.machine.description.elastic import HELD_INTERFACE, ElasticDescription, PatchDescription, SolidBody
from toolpoint.machine.parts.residual_places import PlaceLoads, held_residual_form, residual_form, split_sliding
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO, MIN_TRUSTED_REACH_RATIO
from toolpoint.substructuring.reduction import Reduction, ReductionMethod, reduce
from toolpoint.substructuring.sliding import table_positions, tabulate

HELD_SHIFT_RATIO = 0.1  # of the band: frequency of the shift of a body with held nodes
MAX_SURFACE_NODES = 2500  # nodes of a body's drawn surface at most, about


@dataclass(frozen=True, eq=False)
class SlidingPatch:
    """A patch that slides along a direction of the body from `low` to `high` (m, 0 where the patch is drawn).

    stations : distance of the places whose responses are kept, m; half the patch's length where left out.
    """

    patch: Patch
    along: FloatArray
    low: float
    high: float
    stations: float | None = None
    step: float = 5e-3

    def weights(self, model: SolidModel, position: float) -> csc_array:
        """Return the weights of the patch at a position, (n, 6)."""
        way = floats("along", self.along, (3,))
        return self.patch.moved(position * way / np.linalg.norm(way)).averages(model)

    def positions(self) -> FloatArray:
        """Return the stations, m."""
        spacing = self.patch.length / 2 if self.stations is None else self.stations
        # A travel of just n spacings has n + 1 stations, whatever rounding makes of the quotient.
        count = max(int(np.ceil((self.high - self.low) / spacing - 1e-9)), 1) + 1
        return np.linspace(self.low, self.high, count)


def reduce_solid(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch], *, band: float,
                 size: int | None = None, method: ReductionMethod | None = None) -> Body:
    """Return a free solid as a body of a machine, in the frame of its model, with the loss factors of its materials.

    Parameters
    ----------
    model : SolidModel
    interfaces : mapping of name to a place (Patch, NamedSurface, CylinderFaces ...) or SlidingPatch
        Places where joints, loads and points hold on; every place that carries force must be there.
    band : float
        Hz, up to which the machine is asked for.
    size : int, optional
        Elastic coordinates; all shapes of the method where left out.
    method : ReductionMethod, optional
        ActingLoads of this band where left out.
    """
    reduced = reduce_in_parts(model, interfaces, band=band, size=size, method=method)
    return reduced.at({name: _numbers(model, name) for name in model.set_names})


def reduce_in_parts(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch], *, band: float,
                    size: int | None = None, method: ReductionMethod | None = None, notes: tuple[str, ...] = (),
                    held: NamedNodes | None = None) -> ReducedBody:
    """Return a free solid reduced as by `reduce_solid`, in parts that scale with modulus and density of its sets.

    held : nodes that move as one rigid piece with the body's frame, an interface of the name `HELD_INTERFACE`.
    """
    if held is not None:
        return _reduce_held(model, interfaces, held, method=method or ActingLoads(band), size=size, notes=notes)
    if not interfaces:
        fail("interfaces", "none", "must be at least one", remedy="a body is held by its interfaces")
    places, rigid = _places(model, interfaces), model.rigid_motion()
    body = LargeBody(*model.node_matrices(), csc_array(hstack([place.columns for place in places.values()])), rigid,
                     repeats=np.concatenate(_repeats(places)), coordinates=model.dof_places,
                     estimate_loads=csc_array(hstack([place.further_columns for place in places.values()])))
    reduction = reduce(body, method or ActingLoads(band), size)
    nominal = free_body(reduction, rigid.T @ (body.mass @ rigid), (*notes, *_place_notes(model, interfaces)), places=places,
                        interfaces=_interfaces(model, interfaces, places, vectors=reduction.vectors),
                        surface=_surface(model, reduction.vectors))
    return _in_parts(model, nominal, reduction.vectors)


def _reduce_held(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch], held: NamedNodes, *,
                 method: ReductionMethod, size: int | None, notes: tuple[str, ...]) -> ReducedBody:
    """Return a solid whose held nodes move with the body's frame: shapes are relative to it, and zero at these nodes.

    What the frame's acceleration does to the body acts as six loads more.
    """
    nodes = np.unique(held.nodes(model))
    if len(nodes) < 3:
        fail("held", f"{len(nodes)} nodes of {held.name}", "must be three at least", remedy="a point or a line holds no body")
    free, rigid, places = model.free_coordinates(nodes), model.rigid_motion(), _places(model, interfaces)
    stiffness, mass = model.assembled()
    inertia = mass @ rigid
    columns = csc_array(hstack([*(place.columns for place in places.values()), csc_array(inertia)]))
    further_columns = csc_array(hstack([csc_array((model.size, 0)), *(place.further_columns for place in places.values())]))
    body = LargeBody(csc_array(stiffness[free][:, free]), csc_array(mass[free][:, free]), csc_array(columns[free]),
                     repeats=np.concatenate([*_repeats(places), np.ones(6)]), coordinates=model.dof_places[free],
                     estimate_loads=csc_array(further_columns[free]))
    # Shifted as a free body is: the error is stated in the flexibility of the body with its frame free.
    reduction = reduce(body, method, size, shift=(2 * np.pi * HELD_SHIFT_RATIO * method.band) ** 2)
    vectors = np.zeros((model.size, reduction.size))
    vectors[free] = reduction.vectors
    moving = np.hstack([rigid, vectors])
    coupled = _symmetric_part(moving.T @ (mass @ moving))
    held_on = _interfaces(model, interfaces, places, vectors=vectors) | {
        HELD_INTERFACE: Interface(held.centre_on(model), np.zeros((6, reduction.size)))}
    notes = (*notes, *_place_notes(model, interfaces), f"{len(nodes)} nodes of {held.name} are held as one rigid piece",
             _note(reduction, model.size))
    form = held_residual_form(reduction, _symmetric_part(rigid.T @ inertia), places, held=HELD_INTERFACE)
    nominal = Body(coupled, np.diag(reduction.squares), notes=notes, interfaces=held_on, surface=_surface(model, vectors),
                   residual=form)
    return _in_parts(model, nominal, vectors)


def _places(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch]) -> dict[str, PlaceLoads]:
    """Return the loads of every interface; an error begins with its name."""
    return {name: within(f"interfaces.{name}", partial(_loads_of, model), place) for name, place in interfaces.items()}


def _repeats(places: Mapping[str, PlaceLoads]) -> list[FloatArray]:
    """Return how many columns of every place stand for the same motion."""
    return [np.full(columns, columns / 6) for columns in (place.columns.shape[1] for place in places.values())]


def _interfaces(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch], places: Mapping[str, PlaceLoads], *,
                vectors: FloatArray) -> dict[str, Interface]:
    """Return the interfaces with the motion that the shapes (size, m) give them."""
    return {name: _sliding(place, model, vectors, name) if isinstance(place, SlidingPatch)
            else Interface(place.centre_on(model), places[name].columns.T @ vectors) for name, place in interfaces.items()}


def _place_notes(model: SolidModel, interfaces: Mapping[str, SolidPlace | SlidingPatch]) -> tuple[str, ...]:
    return tuple(f"interface {name}: {note}" for name, place in interfaces.items()
                 if not isinstance(place, SlidingPatch) and (note := place.note(model)))


def _in_parts(model: SolidModel, nominal: Body, vectors: FloatArray) -> ReducedBody:
    """Return a body with the energy of its mesh's error and its parts by sets."""
    energies = mesh_energy(model, vectors)
    nominal = replace(nominal, mesh_energy=_symmetric_part(np.sum(list(energies.values()), axis=0)))
    return ReducedBody(nominal, _parts(model, nominal, np.hstack([model.rigid_motion(), vectors]), energies))


def _parts(model: SolidModel, nominal: Body, motion: FloatArray, energies: Mapping[str, FloatArray]) -> dict[str, ReducedPart]:
    if len(model.set_names) == 1:
        return {name: ReducedPart(_numbers(model, name), nominal.stiffness, nominal.mass,
                                  mesh_energy=_symmetric_part(energies[name]))
                for name in model.set_names}
    result = {}
    for name in model.set_names:
        stiffness, mass = model.projected(name, motion)
        result[name] = ReducedPart(_numbers(model, name), _symmetric_part(stiffness[6:, 6:]), _symmetric_part(mass),
                                   mesh_energy=_symmetric_part(energies[name]))
    return result


def _symmetric_part(matrix: FloatArray) -> FloatArray:
    return (matrix + matrix.T) / 2


def _numbers(model: SolidModel, name: str) -> ElasticNumbers:
    material = model.materials[name]
    return ElasticNumbers(material.modulus, material.density, material.loss_factor)


def _surface(model: SolidModel, vectors: FloatArray) -> BodySurface:
    used, triangles = outer_triangles(model)
    chosen, triangles = thin_triangles(model.nodes[used], triangles, MAX_SURFACE_NODES)
    nodes = used[chosen]
    return BodySurface(model.nodes[nodes], triangles, vectors[model.coordinates_of(nodes)].reshape(len(nodes), 3, -1))


def free_body(reduction: Reduction, rigid_mass: FloatArray, notes: tuple[str, ...], *, interfaces: Mapping[str, Interface],
              places: Mapping[str, PlaceLoads], surface: BodySurface | None = None) -> Body:
    """Return the body of a reduction: six rigid motions with their mass (6, 6) about the frame, unit elastic coordinates."""
    form = residual_form(reduction, np.linalg.cholesky(rigid_mass).T, places)
    mass = np.zeros((6 + reduction.size,) * 2)
    mass[:6, :6] = rigid_mass
    mass[6:, 6:] = np.eye(reduction.size)
    return Body((mass + mass.T) / 2, np.diag(reduction.squares), notes=(*notes, _note(reduction, len(reduction.vectors))),
                interfaces=interfaces, surface=surface, residual=form)


def _loads_of(model: SolidModel, place: SolidPlace | SlidingPatch) -> PlaceLoads:
    return _sliding_loads(place, model) if isinstance(place, SlidingPatch) else PlaceLoads.fixed(place.averages(model))


def _sliding_loads(place: SlidingPatch, model: SolidModel) -> PlaceLoads:
    """Return a sliding place as loads, at the entries of its table."""
    entries = table_positions(place.low, place.high, place.step)
    return split_sliding([place.weights(model, float(z)) for z in place.positions()],
                         [place.weights(model, float(z)) for z in entries], entries)


def _sliding(place: SlidingPatch, model: SolidModel, vectors: FloatArray, name: str) -> Interface:
    table: MotionTable = tabulate(vectors, lambda z: place.weights(model, z), place.low, position_max=place.high,
                                  step=place.step, name=name)
    return Interface(place.patch.centre, None, table, place.along)


def _note(reduction: Reduction, size: int) -> str:
    reach_words = (f"natural frequencies to {reduction.reach / MIN_TRUSTED_REACH_RATIO:.4g} Hz can be relied on"
                   if reduction.reach else "which free modes are among the shapes is not known")
    return f"elastic, reduced from {size} to {reduction.size} coordinates by {reduction.method}; {reach_words}"


def reduce_described(description: ElasticDescription | SolidBody) -> ReducedBody:
    """Return the reduced body of a described casting or solid."""
    notes = description.content.notes if isinstance(description, SolidBody) and description.content is not None else ()
    places = {name: within(f"interfaces.{name}", place_of, part) for name, part in description.interfaces.items()}
    held = NamedNodes(description.held) if isinstance(description, SolidBody) and description.held else None
    if held is not None and HELD_INTERFACE in places:
        fail(f"interfaces.{HELD_INTERFACE}", "given", "must have another name: it is that of the held nodes")
    return reduce_in_parts(description.model, places, band=description.band, size=description.size, notes=notes, held=held)


def place_of(part: PatchDescription) -> SolidPlace | SlidingPatch:
    """Return the place that an interface describes, on a body's model."""
    place = part.place
    if not isinstance(place, Patch) or not part.slide:
        return place
    return SlidingPatch(place, np.array(part.along), part.slide[0], part.slide[1], part.stations)


def reliable_to(description: ElasticDescription | SolidBody) -> float:
    """Return the frequency (Hz) up to which no free mode of a described body can be missing."""
    return description.band * DEFAULT_REACH_RATIO / MIN_TRUSTED_REACH_RATIO
