"""A finite-element model -> a body of a machine: reduced, with interfaces that stand or slide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, hstack

from toolpoint._check import FloatArray, fail, floats
from toolpoint.bodies import Body, Interface
from toolpoint.bodies.solid import Patch, SolidModel
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import SURE, ActingLoads
from toolpoint.substructuring.reduction import Reduction, ReductionMethod, reduce
from toolpoint.substructuring.sliding import tabulate


@dataclass(frozen=True, eq=False)
class SlidingPatch:
    """A patch that slides along a direction of the body from `low` to `high` (m, 0 where the patch is drawn).

    stations : distance of the places whose responses are kept, m; the patch's length where left out.
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
        spacing = self.patch.length if self.stations is None else self.stations
        count = max(int(np.ceil((self.high - self.low) / spacing - 1e-9)), 1) + 1
        return np.linspace(self.low, self.high, count)


def reduce_solid(model: SolidModel, interfaces: Mapping[str, Patch | SlidingPatch], *, band: float, size: int | None = None,
                 method: ReductionMethod | None = None) -> Body:
    """Return a free solid as a body of a machine, in the frame of its model.

    Parameters
    ----------
    model : SolidModel
    interfaces : mapping of name to Patch or SlidingPatch
        Places where joints, loads and points hold on; every place that carries force must be there.
    band : float
        Hz, up to which the machine is asked for.
    size : int, optional
        Elastic coordinates; all shapes of the method where left out.
    method : ReductionMethod, optional
        ActingLoads of this band where left out.
    """
    if not interfaces:
        fail("interfaces", "none", "must be at least one", "a body is held by its interfaces")
    columns, repeats = [], []
    for place in interfaces.values():
        loads = [place.weights(model, float(z)) for z in place.positions()] if isinstance(place, SlidingPatch) else [
            place.averages(model)]
        columns += loads
        repeats += [float(len(loads))] * (6 * len(loads))
    rigid = model.rigid_motion()
    body = LargeBody(model.stiffness(), model.mass(), csc_array(hstack(columns)), rigid, repeats=np.array(repeats),
                     coordinates=model.dof_places)
    reduction = reduce(body, method or ActingLoads(band), size)
    mass = np.zeros((6 + reduction.size,) * 2)
    mass[:6, :6] = rigid.T @ (body.mass @ rigid)
    mass[6:, 6:] = np.eye(reduction.size)
    return Body((mass + mass.T) / 2, np.diag(reduction.squares), notes=(_note(reduction, model.size),),
                interfaces={name: _interface(place, model, reduction, name) for name, place in interfaces.items()})


def _interface(place: Patch | SlidingPatch, model: SolidModel, reduction: Reduction, name: str) -> Interface:
    if isinstance(place, Patch):
        return Interface(place.centre, place.averages(model).T @ reduction.vectors)
    table: MotionTable = tabulate(reduction.vectors, lambda z: place.weights(model, z), place.low, place.high, step=place.step,
                                  name=name)
    return Interface(place.patch.centre, None, table, place.along)


def _note(reduction: Reduction, size: int) -> str:
    sure = f"natural frequencies to {reduction.reach / SURE:.4g} Hz can be relied on" if reduction.reach else (
        "which free modes are among the shapes is not known")
    return f"elastic, reduced from {size} to {reduction.size} coordinates by {reduction.method}; {sure}"
