"""HDF5: save and load all nouns, versioned; arrays as they are, labels as text."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.binary import reader_process
from toolpoint.io.door import door
from toolpoint.vibration import Dof, Frf, Modes, Record, SecondOrderSystem, StateSpace
from toolpoint.vibration.geometry import Geometry

if TYPE_CHECKING:
    import h5py  # loaded where something is written; a process of its own reads

FORMAT, FORMAT_VERSION = "toolpoint", 1
NOUNS: dict[str, type] = {c.__name__: c for c in (Record, Frf, Modes, SecondOrderSystem, StateSpace, Geometry)}
Noun = Record | Frf | Modes | SecondOrderSystem | StateSpace | Geometry
FOLDER = "nouns/"
# Path of every group and dataset: its attributes and its value.
Tree = dict[str, tuple[dict[str, Any], Any]]
T = TypeVar("T", Record, Frf, Modes, SecondOrderSystem, StateSpace, Geometry)


def write(nouns: Noun | Mapping[str, Noun], path: str | Path) -> None:
    """Write one noun, or several by name, to a file; an old file is replaced only when the new one is whole.

    >>> import tempfile
    >>> from toolpoint.vibration import Modes
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "test.h5")
    ...     write({"modes": Modes([80.0], [0.02], [[1.0]], ["tip:+x"])}, file)
    ...     file.exists()
    True
    """
    import h5py

    path = Path(path)
    if not path.parent.is_dir():
        raise ToolpointError(f"{path}: the folder {path.parent} does not exist; create it first")
    items: dict[str, Any] = dict(nouns) if isinstance(nouns, Mapping) else {"": nouns}
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    os.close(handle)
    try:
        with h5py.File(part, "w") as file:
            file.attrs["format"], file.attrs["version"] = FORMAT, FORMAT_VERSION
            file.attrs["single"] = not isinstance(nouns, Mapping)
            for name, noun in items.items():
                _put(file.create_group(f"nouns/{name}" if name else "nouns/noun"), noun)
        os.replace(part, path)
    except BaseException:
        Path(part).unlink(missing_ok=True)
        raise


def _put(group: h5py.Group, noun: Any) -> None:
    import h5py

    kind = type(noun).__name__
    if kind not in NOUNS:
        raise ToolpointError(f"nouns: {kind} cannot be saved; must be one of {', '.join(NOUNS)}")
    group.attrs["noun"] = kind
    for field in fields(noun):
        value = getattr(noun, field.name)
        if isinstance(noun, Geometry) and field.name == "points":
            value = [[name, *map(float, place)] for name, place in noun.points.items()]
        if value is None:
            continue
        if isinstance(noun, Frf) and field.name == "draws":
            # Single precision and no zeros: a hundred draws of a long response are then some megabytes.
            group.create_dataset(field.name, data=value.astype(np.complex64), compression="gzip", shuffle=True)
        elif isinstance(value, np.ndarray):
            group.create_dataset(field.name, data=value)
        else:
            group.create_dataset(field.name, data=json.dumps(value, default=_label), dtype=h5py.string_dtype())


def _label(value: Any) -> Any:
    if isinstance(value, Dof):
        return {"dof": [value.point, value.direction, value.vector]}
    raise TypeError(f"{type(value).__name__} cannot be saved")


def read(path: str | Path, kind: type[T]) -> T:
    """Return the one noun of this kind that a file holds, as it was written: ``read(path, Modes)``.

    Raises ToolpointError for a file that is missing, cut off, foreign, or written by a newer program, and for one that holds
    none or several of the kind.
    """
    nouns = read_all(path)
    fitting = [noun for noun in nouns.values() if isinstance(noun, kind)]
    if len(fitting) != 1:
        held = ", ".join(type(noun).__name__ for noun in nouns.values())
        raise ToolpointError(f"{path}: holds {held or 'nothing'}; needs one {kind.__name__}")
    return fitting[0]


@door("HDF5 file of toolpoint")
def read_all(path: str | Path) -> dict[str, Noun]:
    """Return all nouns of a file by name, as they were written; a noun that was saved alone is named ``noun``."""
    path = Path(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: no such file; check the name and the folder")
    tree: Tree = reader_process.load(path, "hdf5")
    _check(tree, path)
    return {name.removeprefix(FOLDER): _get(name, tree, path) for name in tree
            if name.startswith(FOLDER) and "noun" in tree[name][0]}


def _check(tree: Tree, path: Path) -> None:
    attributes = tree[""][0]
    if attributes.get("format") != FORMAT or "nouns" not in tree:
        held = ", ".join([name for name in tree if name and "/" not in name][:5]) or "nothing"
        raise ToolpointError(f"{path}: an HDF5 file, but not one of toolpoint (it holds {held})")
    if int(attributes["version"]) > FORMAT_VERSION:
        raise ToolpointError(f"{path}: file version {attributes['version']}; this program reads up to {FORMAT_VERSION}; update "
                             "it")


def _get(group: str, tree: Tree, path: Path) -> Any:
    kind = str(tree[group][0]["noun"])
    if kind not in NOUNS:
        raise ToolpointError(f"{path}: unknown noun {kind!r}; known: {', '.join(NOUNS)}")
    field_names = {field.name for field in fields(NOUNS[kind])}
    values = {}
    for entry, (_, value) in tree.items():
        if entry.startswith(f"{group}/") and "/" not in entry[len(group) + 1:]:
            name = entry[len(group) + 1:]
            if name not in field_names:
                raise ToolpointError(f"{path}: {kind} has no {name!r}; the file was written by another version")
            values[name] = json.loads(value, object_hook=_dof) if isinstance(value, str) else value
    if kind == "Geometry":
        return Geometry({name: np.array(place, float) for name, *place in values["points"]}, list(map(tuple, values["lines"])))
    return NOUNS[kind](**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})


def _dof(value: dict[str, Any]) -> Any:
    point, direction, vector = value["dof"]
    return Dof(point, direction, None if vector is None else tuple(vector))
