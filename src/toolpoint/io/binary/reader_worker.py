"""The process that opens binary files with C libraries: HDF5 and MATLAB (5 to 7); run as a script by `reader_process`.

One request a line on standard input (JSON: format, path, bytes of memory, seconds), one answer on standard output: eight bytes
of length and a pickle, ``("ok", tree)`` or ``("error", words)``. It may crash or hang: its parent lives on. It imports
nothing of the package, so that it starts within a fraction of a second.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import sys
from typing import Any, BinaryIO

import h5py
import numpy as np

MAX_COMPRESSION_RATIO = 1100  # no compression of these formats makes an array smaller by more
ARRAY_BYTES_MARGIN = 1 << 20  # bytes, for arrays of files that hold next to nothing
# Links in HDF5 may lead in a circle: measurements are a few groups deep.
MAX_GROUP_DEPTH = 50


def read_hdf5(path: str) -> dict[str, tuple[dict[str, Any], Any]]:
    """Return every dataset and group by its path: attributes and value (None for a group, texts as str, cells as lists)."""
    tree: dict[str, tuple[dict[str, Any], Any]] = {}
    budget = [MAX_COMPRESSION_RATIO * os.path.getsize(path) + ARRAY_BYTES_MARGIN]
    with h5py.File(path, "r") as file:
        _collect(file, "", tree, budget, 0)
        tree[""] = (_attributes(file), None)
    return tree


def _collect(group: Any, prefix: str, tree: dict[str, tuple[dict[str, Any], Any]], budget: list[int], depth: int) -> None:
    if depth > MAX_GROUP_DEPTH or len(tree) > 1_000_000:
        raise ValueError(f"groups nested deeper than {MAX_GROUP_DEPTH}, or more than a million of them")
    for name in group:
        kind = group.get(name, getlink=True)
        if not isinstance(kind, h5py.HardLink):
            raise ValueError(f"{prefix}{name} is a link to elsewhere")
        item = group[name]
        if isinstance(item, h5py.Dataset):
            tree[prefix + name] = (_attributes(item), _value(item, budget))
        else:
            tree[prefix + name] = (_attributes(item), None)
            if not name.startswith("#"):
                _collect(item, f"{prefix}{name}/", tree, budget, depth + 1)


def _attributes(item: Any) -> dict[str, Any]:
    values = {name: item.attrs[name] for name in item.attrs}
    return {name: value.decode("latin-1") if isinstance(value, bytes) else value.item() if np.ndim(value) == 0 and
            hasattr(value, "item") else value for name, value in values.items() if isinstance(value, (bytes, str, int, float,
                                                                                                      np.generic))}


def _value(item: Any, budget: list[int]) -> Any:
    budget[0] -= item.size * item.dtype.itemsize
    if budget[0] < 0:
        raise ValueError(f"{item.name} of shape {item.shape} is larger than the file can hold")
    if h5py.check_string_dtype(item.dtype) is not None and item.dtype.kind == "O":
        return item.asstr()[()] if item.ndim == 0 else [str(text) for text in item.asstr()[()].reshape(-1)]
    if item.dtype.kind == "O":  # cells of MATLAB: references to datasets
        cells = [item.file[reference] for reference in item[()].reshape(-1)]
        return [(_attributes(cell), _value(cell, budget)) for cell in cells
                if isinstance(cell, h5py.Dataset) and cell.dtype.kind != "O"]
    return item[()]


def read_mat(path: str) -> dict[str, Any]:
    """Return the variables of a MATLAB file of version 5 to 7, structures as object arrays with names."""
    from scipy.io import loadmat

    table = loadmat(path, squeeze_me=False, struct_as_record=True)
    return {name: value for name, value in table.items() if not name.startswith("__")}


READERS = {"hdf5": read_hdf5, "mat": read_mat}


def answer(request: dict[str, Any]) -> bytes:
    """Return the pickled answer to one request, read within its bounds of memory and time."""
    _bound(request)
    try:
        return pickle.dumps(("ok", READERS[request["format"]](request["path"])), protocol=5)
    except Exception as error:
        lines = str(error).splitlines()
        return pickle.dumps(("error", f"{type(error).__name__}: {lines[0][:200] if lines else ''}"), protocol=5)
    finally:
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)


def _bound(request: dict[str, Any]) -> None:
    if hasattr(signal, "setitimer"):  # ends a library that hangs even where the parent is gone
        signal.setitimer(signal.ITIMER_REAL, request["seconds"] + 1)
    try:
        import resource
    except ImportError:  # not on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (request["memory"] + _base_memory(), resource.RLIM_INFINITY))


def _base_memory() -> int:
    """Return the address space before any file was read, bytes."""
    global _base
    if not _base:
        try:
            with open("/proc/self/statm", encoding="ascii") as file:
                _base = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        except OSError:
            _base = 8 << 30
    return _base


_base = 0


def serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until the parent closes the pipe."""
    import scipy.io  # noqa: F401  (its address space belongs to the base)

    answers.write((0).to_bytes(8, "little"))
    answers.flush()
    for line in requests:
        packed = answer(json.loads(line))
        answers.write(len(packed).to_bytes(8, "little"))
        answers.write(packed)
        answers.flush()


if __name__ == "__main__":
    serve(sys.stdin.buffer, sys.stdout.buffer)
