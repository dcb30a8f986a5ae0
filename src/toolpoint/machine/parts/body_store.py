"""Reduced bodies on disk, by the content of what describes them and of the program that reduces them."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint.bodies import Body, Interface
from toolpoint.bodies.reduced import ElasticNumbers, ReducedBody, ReducedPart
from toolpoint.bodies.residual_form import ResidualForm
from toolpoint.bodies.surface import BodySurface
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody
from toolpoint.machine.parts.content_key import ContentKey
from toolpoint.machine.parts.elastic_body import reduce_described
from toolpoint.spatial.motion_table import MotionTable


def reduce_once(description: ElasticDescription | SolidBody) -> ReducedBody:
    """Return the reduced body of a description; it is kept in memory and on disk.

    The folder is ``$TOOLPOINT_CACHE``, else ``toolpoint`` in the user's cache folder; a folder that cannot be written is left.
    """
    return _load_or_reduce(ContentKey.of(description))


@lru_cache(maxsize=64)
def _load_or_reduce(key: ContentKey[ElasticDescription | SolidBody]) -> ReducedBody:
    name = hashlib.sha256(f"{program_digest()} {key.text}".encode()).hexdigest()[:32]
    path = cache_folder() / f"body-{name}.npz"
    if path.is_file():
        try:
            return read_body(path)
        except (OSError, ValueError, KeyError):
            path.unlink(missing_ok=True)  # a file that a full disk cut off
    body = reduce_described(key.description)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_body(body, path)
    except OSError:
        pass
    return body


@lru_cache(maxsize=1)
def program_digest() -> str:
    """Return a digest of all sources that make a body: a body that another version reduced is not taken."""
    root = Path(__file__).resolve().parents[2]
    rooms = ("bodies", "substructuring", "vibration/sparse", "machine")
    files = [path for room in rooms for path in (root / room).rglob("*.py")]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()


def cache_folder() -> Path:
    """Return the folder of reduced bodies."""
    folder = os.environ.get("TOOLPOINT_CACHE")
    return Path(folder) if folder else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "toolpoint"


def write_body(reduced: ReducedBody, path: Path) -> None:
    """Write a reduced body as plain arrays (.npz); the file appears whole or not at all."""
    body = reduced.nominal
    data: dict[str, Any] = {"mass": body.mass, "stiffness": body.stiffness, "damping": body.damping}
    data |= {"names": np.array(list(body.interfaces)), "notes": np.array(list(body.notes))}
    data["sets"] = np.array(list(reduced.parts))
    for i, place in enumerate(body.interfaces.values()):
        data[f"position{i}"] = place.position
        if place.slide is not None and place.along is not None:
            data |= {f"along{i}": place.along, f"way{i}": place.slide.positions, f"values{i}": place.slide.values}
        elif place.participation is not None:
            data[f"participation{i}"] = place.participation
    for i, part in enumerate(reduced.parts.values()):
        data[f"numbers{i}"] = np.array([part.numbers.modulus, part.numbers.density, part.numbers.loss_factor])
        data |= {f"stiffness{i}": part.stiffness, f"mass{i}": part.mass}
        if part.mesh_energy is not None:
            data[f"mesh{i}"] = part.mesh_energy
    if body.mesh_energy is not None:
        data["mesh"] = body.mesh_energy
    if body.residual is not None:
        data |= {"residual": body.residual.gram, "reach": np.array([body.residual.shift, body.residual.reach])}
        for i, loads in enumerate(body.residual.places[name] for name in body.interfaces):
            data[f"loads{i}"] = loads.values if isinstance(loads, MotionTable) else loads
    if body.surface is not None:
        data |= {"nodes": body.surface.nodes, "triangles": body.surface.triangles,
                 "motion": body.surface.motion.astype(np.float32)}
    unfinished = path.with_suffix(f".{os.getpid()}.tmp.npz")
    np.savez(unfinished, **data)
    unfinished.replace(path)


def read_body(path: Path) -> ReducedBody:
    """Read a body that `write_body` wrote."""
    with np.load(path, allow_pickle=False) as data:
        places = {}
        for i, name in enumerate(data["names"].tolist()):
            table = MotionTable(data[f"way{i}"], data[f"values{i}"], name) if f"way{i}" in data else None
            part = data.get(f"participation{i}")
            places[name] = Interface(data[f"position{i}"], part, table, data[f"along{i}"] if table is not None else None)
        surface = BodySurface(data["nodes"], data["triangles"], data["motion"]) if "nodes" in data else None
        parts = {name: ReducedPart(ElasticNumbers(*data[f"numbers{i}"].tolist()), data[f"stiffness{i}"], data[f"mass{i}"],
                                   mesh_energy=data.get(f"mesh{i}"))
                 for i, name in enumerate(data["sets"].tolist())}
        residual = None
        if "residual" in data:
            loads = {name: MotionTable(data[f"way{i}"], data[f"loads{i}"], name) if f"way{i}" in data else data[f"loads{i}"]
                     for i, name in enumerate(places)}
            shift, reach = data["reach"].tolist()
            residual = ResidualForm(data["residual"], shift, reach, loads)
        return ReducedBody(Body(data["mass"], data["stiffness"], data["damping"], places, tuple(data["notes"].tolist()),
                                surface=surface, residual=residual, mesh_energy=data.get("mesh")), parts)
