"""Start: the poles and participation that a method returns, and the protocol of all methods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True, eq=False)
class Start:
    """Poles (rad/s, of the data as windowed), participation (n_inputs, n_modes), and their diagram."""

    poles: ComplexArray
    participation: ComplexArray
    diagram: Diagram | None = None
    support: FloatArray | None = None
    notes: tuple[str, ...] = ()


class PoleMethod(Protocol):
    """A way to find poles; `refine` says whether they are refined afterwards."""

    @property
    def name(self) -> str:
        """Name in messages."""
        ...

    @property
    def refine(self) -> bool:
        """Whether the poles are refined by variable projection."""
        ...

    def start(self, frf: Frf) -> Start:
        """Return the poles of responses that are cut to the band."""
        ...
