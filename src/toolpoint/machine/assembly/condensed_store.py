"""Condensed bodies of a machine on disk, by the content of its description and of the program."""

from __future__ import annotations

import hashlib
import os
from typing import Any

import numpy as np

from toolpoint.machine.assembly.condense import combine_shapes, condense_bodies
from toolpoint.machine.parts.body_store import cache_folder, program_digest
from toolpoint.machine.parts.model import Machine


def condense_once(machine: Machine, error: float) -> Machine:
    """Return a machine condensed as by `condense_bodies`; the combinations are kept on disk beside the reduced bodies.

    The key is the description: the same file is condensed once.
    """
    text = f"{program_digest()} {error!r} {machine.description!r} {[kept.text for kept in machine.reduced.values()]}"
    path = cache_folder() / f"condensed-{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            names = [name for name in machine.reduced if f"mix-{name}" in data]
            return combine_shapes(machine, {name: data[f"mix-{name}"] for name in names},
                               {name: str(data[f"note-{name}"]) for name in names})
    except (OSError, ValueError, KeyError):
        pass
    result = condense_bodies(machine, error=error)
    parts: dict[str, Any] = {f"mix-{name}": mix for name, mix in result.mixes.items()}
    parts |= {f"note-{name}": np.array(result.machine.reduced[name].reduced.nominal.notes[-1]) for name in result.mixes}
    unfinished = path.with_suffix(f".{os.getpid()}.tmp.npz")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(unfinished, **parts)
        unfinished.replace(path)
    except OSError:
        pass
    return result.machine
