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
from toolpoint.bodies.solid import Patch, SolidModel, SolidPlace
from toolpoint.bodies.solid.faces import outer_triangles, thin_triangles
from toolpoint.bodies.solid.mesh_energy import mesh_energy
from toolpoint.bodies.surface import BodySurface
from toolpoint.machine.description.elastic import ElasticDescription, PatchDescription, SolidBody
from toolpoint.machine.parts.residual_places import PlaceLoads, residual_form, split_sliding
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO, MIN_TRUSTED_REACH_RATIO
from toolpoint.substructuring.reduction import Reduction, ReductionMethod, reduce
from toolpoint.substructuring.sliding import table_positions, tabulate

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
                    size: int | None = None, method: ReductionMethod | None = None, notes: tuple[str, ...] = ()) -> ReducedBody:
    """Return a free solid reduced as by `reduce_solid`, in parts that scale with modulus and density of its sets."""
    if not interfaces:
        fail("interfaces", "none", "must be at least one", remedy="a body is held by its interfaces")
    places = {name: within(f"interfaces.{name}", partial(_loads_of, model), place) for name, place in interfaces.items()}
    repeats = [np.full(columns, columns / 6) for columns in (place.columns.shape[1] for place in places.values())]
    rigid = model.rigid_motion()
    body = LargeBody(*model.node_matrices(), csc_array(hstack([place.columns for place in places.values()])), rigid,
                     repeats=np.concatenate(repeats), coordinates=model.dof_places,
                     estimate_loads=csc_array(hstack([place.further_columns for place in places.values()])))
    reduction = reduce(body, method or ActingLoads(band), size)
    held = {name: _sliding(place, model, reduction, name) if isinstance(place, SlidingPatch)
            else Interface(place.centre_on(model), places[name].columns.T @ reduction.vectors)
            for name, place in interfaces.items()}
    notes += tuple(f"interface {name}: {note}" for name, place in interfaces.items()
                   if not isinstance(place, SlidingPatch) and (note := place.note(model)))
    nominal = free_body(reduction, rigid.T @ (body.mass @ rigid), notes, interfaces=held, places=places,
                        surface=_surface(model, reduction))
    energies = mesh_energy(model, reduction.vectors)
    nominal = replace(nominal, mesh_energy=_symmetric_part(np.sum(list(energies.values()), axis=0)))
    return ReducedBody(nominal, _parts(model, nominal, np.hstack([rigid, reduction.vectors]), energies))


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


def _surface(model: SolidModel, reduction: Reduction) -> BodySurface:
    used, triangles = outer_triangles(model)
    chosen, triangles = thin_triangles(model.nodes[used], triangles, MAX_SURFACE_NODES)
    nodes = used[chosen]
    return BodySurface(model.nodes[nodes], triangles, reduction.vectors[model.coordinates_of(nodes)].reshape(len(nodes), 3, -1))


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


def _sliding(place: SlidingPatch, model: SolidModel, reduction: Reduction, name: str) -> Interface:
    table: MotionTable = tabulate(reduction.vectors, lambda z: place.weights(model, z), place.low, position_max=place.high,
                                  step=place.step, name=name)
    return Interface(place.patch.centre, None, table, place.along)


def _note(reduction: Reduction, size: int) -> str:
    reach_words = (f"natural frequencies to {reduction.reach / MIN_TRUSTED_REACH_RATIO:.4g} Hz can be relied on"
                   if reduction.reach else "which free modes are among the shapes is not known")
    return f"elastic, reduced from {size} to {reduction.size} coordinates by {reduction.method}; {reach_words}"


def reduce_described(description: ElasticDescription | SolidBody) -> ReducedBody:
    """Return the reduced body of a described casting or solid."""
    notes = description.content.notes if isinstance(description, SolidBody) and description.content is not None else ()
    places = {name: within(f"interfaces.{name}", _described_place, part) for name, part in description.interfaces.items()}
    return reduce_in_parts(description.model, places, band=description.band, size=description.size, notes=notes)


def _described_place(part: PatchDescription) -> SolidPlace | SlidingPatch:
    place = part.place
    if not isinstance(place, Patch) or not part.slide:
        return place
    return SlidingPatch(place, np.array(part.along), part.slide[0], part.slide[1], part.stations)


def reliable_to(description: ElasticDescription | SolidBody) -> float:
    """Return the frequency (Hz) up to which no free mode of a described body can be missing."""
    return description.band * DEFAULT_REACH_RATIO / MIN_TRUSTED_REACH_RATIO
