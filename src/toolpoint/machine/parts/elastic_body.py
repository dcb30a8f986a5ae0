"""A finite-element model -> a body of a machine: reduced, with interfaces that stand or slide; kept on disk by content."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, hstack

from toolpoint._check import FloatArray, fail, floats
from toolpoint.bodies import Body, Interface
from toolpoint.bodies.solid import Patch, SolidModel
from toolpoint.machine.description.elastic import ElasticDescription
from toolpoint.machine.parts.content_key import ContentKey
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import REACH, SURE, ActingLoads
from toolpoint.substructuring.reduction import Reduction, ReductionMethod, reduce
from toolpoint.substructuring.sliding import tabulate


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
    return free_body(reduction, rigid.T @ (body.mass @ rigid), (),
                     interfaces={name: _interface(place, model, reduction, name) for name, place in interfaces.items()})


def free_body(reduction: Reduction, rigid_mass: FloatArray, notes: tuple[str, ...], *, interfaces: Mapping[str, Interface]
              ) -> Body:
    """Return the body of a reduction: six rigid motions with their mass (6, 6) about the frame, unit elastic coordinates."""
    mass = np.zeros((6 + reduction.size,) * 2)
    mass[:6, :6] = rigid_mass
    mass[6:, 6:] = np.eye(reduction.size)
    return Body((mass + mass.T) / 2, np.diag(reduction.squares), notes=(*notes, _note(reduction, len(reduction.vectors))),
                interfaces=interfaces)


def _interface(place: Patch | SlidingPatch, model: SolidModel, reduction: Reduction, name: str) -> Interface:
    if isinstance(place, Patch):
        return Interface(place.centre, place.averages(model).T @ reduction.vectors)
    table: MotionTable = tabulate(reduction.vectors, lambda z: place.weights(model, z), place.low, high=place.high,
                                  step=place.step, name=name)
    return Interface(place.patch.centre, None, table, place.along)


def _note(reduction: Reduction, size: int) -> str:
    sure = f"natural frequencies to {reduction.reach / SURE:.4g} Hz can be relied on" if reduction.reach else (
        "which free modes are among the shapes is not known")
    return f"elastic, reduced from {size} to {reduction.size} coordinates by {reduction.method}; {sure}"


def build_elastic(description: ElasticDescription) -> Body:
    """Return the reduced body of a description; it is kept in memory and on disk, by the content of description and program.

    The folder is ``$TOOLPOINT_CACHE``, else ``toolpoint`` in the user's cache folder; a folder that cannot be written is left.
    """
    return _kept(ContentKey.of(description))


def reliable_to(description: ElasticDescription) -> float:
    """Return the frequency (Hz) up to which no free mode of a described body can be missing."""
    return description.band * REACH / SURE


@lru_cache(maxsize=64)
def _kept(key: ContentKey[ElasticDescription]) -> Body:
    name = hashlib.sha256(f"{_program()} {key.text}".encode()).hexdigest()[:32]
    path = cache_folder() / f"body-{name}.npz"
    if path.is_file():
        try:
            return read_body(path)
        except (OSError, ValueError, KeyError):
            path.unlink(missing_ok=True)  # a file that a full disk cut off
    places = {name: SlidingPatch(part.patch, np.array(part.along), part.slide[0], part.slide[1], part.stations) if part.slide
              else part.patch for name, part in key.description.interfaces.items()}
    body = reduce_solid(key.description.model, places, band=key.description.band, size=key.description.size)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_body(body, path)
    except OSError:
        pass
    return body


@lru_cache(maxsize=1)
def _program() -> str:
    """Return a digest of all sources that make a body: what another program kept is not taken."""
    root = Path(__file__).resolve().parents[2]
    rooms = ("bodies", "substructuring", "vibration/sparse", "machine")
    files = [path for room in rooms for path in (root / room).rglob("*.py")]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()


def cache_folder() -> Path:
    """Return where reduced bodies are kept."""
    given = os.environ.get("TOOLPOINT_CACHE")
    return Path(given) if given else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "toolpoint"


def write_body(body: Body, path: Path) -> None:
    """Write a body as plain arrays (.npz); the file appears whole or not at all."""
    data: dict[str, FloatArray] = {"mass": body.mass, "stiffness": body.stiffness, "damping": body.damping}
    data |= {"names": np.array(list(body.interfaces)), "notes": np.array(list(body.notes))}
    for i, place in enumerate(body.interfaces.values()):
        data[f"position{i}"] = place.position
        if place.slide is not None and place.along is not None:
            data |= {f"along{i}": place.along, f"way{i}": place.slide.positions, f"values{i}": place.slide.values}
        elif place.participation is not None:
            data[f"participation{i}"] = place.participation
    part = path.with_suffix(f".{os.getpid()}.tmp.npz")
    np.savez(part, **data)  # type: ignore[arg-type]
    part.replace(path)


def read_body(path: Path) -> Body:
    """Read a body that `write_body` wrote."""
    with np.load(path, allow_pickle=False) as data:
        places = {}
        for i, name in enumerate(data["names"].tolist()):
            table = MotionTable(data[f"way{i}"], data[f"values{i}"], name) if f"way{i}" in data else None
            part = data.get(f"participation{i}")
            places[name] = Interface(data[f"position{i}"], part, table, data[f"along{i}"] if table is not None else None)
        return Body(data["mass"], data["stiffness"], data["damping"], places, tuple(data["notes"].tolist()))
