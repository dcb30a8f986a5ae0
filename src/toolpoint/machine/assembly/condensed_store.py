"""Condensed bodies of a machine on disk, by the content of its description and of the program."""

from __future__ import annotations

import hashlib
import os
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.machine.assembly.condense import DEFAULT_CONDENSATION_ERROR, combine_shapes, condense_bodies
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.parts.body_store import cache_folder, program_digest
from toolpoint.machine.parts.model import Machine


def condense_described(machine: Machine) -> Machine:
    """Return a machine as its `reduction_error` asks for it.

    Where that is left out, a machine in which two castings or solids slide on each other is condensed to
    `DEFAULT_CONDENSATION_ERROR`: every place of a way answers six loads, and few of these answers are used. It stays as it is
    where its reduction errs by more, or states no error; any other does too.
    """
    error = machine.description.reduction_error
    if error is not None:
        return condense_once(machine, error) if error else machine
    if not _has_sliding_pair(machine):
        return machine
    try:
        return condense_once(machine, DEFAULT_CONDENSATION_ERROR)
    except ToolpointError:
        return machine


def _has_sliding_pair(machine: Machine) -> bool:
    """Whether a joint slides between two castings or solids whose sizes are not stated."""
    parts = {name: kept.part for name, kept in machine.reduced.items()
             if not isinstance(kept.part, BeamDescription) and kept.part.size is None}
    return any(joint.parent in parts and joint.child in parts and any(
        name is not None and name in parts[body].interfaces and parts[body].interfaces[name].slide
        for body, name in ((joint.parent, joint.parent_interface), (joint.child, joint.child_interface)))
        for joint in machine.description.joints.values())


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
