"""Doubts of a machine file as they enter: those that it states, and those that its own measured reference raises."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from toolpoint._check import FileDoubt
from toolpoint._doubt import doubts_among

if TYPE_CHECKING:
    from toolpoint.machine.parts.model import Machine


def warn_of_doubts(machine: Machine) -> Machine:
    """Return the machine of a file; warn (`FileDoubt`) of what the file states against it, of what the matrices of its bodies
    leave out, and of what its reference says.

    A command collects these warnings and puts them before all else in table, page and JSON.
    """
    doubts = list(machine.description.doubts)
    doubts += [doubt.within(name) for name, body in machine.description.bodies.items() if body.matrices is not None
               for doubt in doubts_among(body.matrices.content.notes)]
    if any(reference.is_measured for reference in machine.description.reference):
        from toolpoint.machine.frequencies.measured_reference import question_reference  # solves for modes: where there is one

        doubts += question_reference(machine)
    for doubt in dict.fromkeys(doubts):
        warnings.warn(FileDoubt(doubt), stacklevel=4)
    return machine
