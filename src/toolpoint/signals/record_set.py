"""Records of a hammer test, labelled and in SI, with their names and the assumptions made of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from toolpoint._check import fail
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.vibration.record import Record


@dataclass(frozen=True, eq=False)
class RecordSet(NotebookText):
    """Records with their names, notes (assumptions of labels and units), and doubts.

    `decisions` : name of a hit to whether a person accepts it.
    """

    records: tuple[Record, ...]
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    decisions: Mapping[str, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.records) != len(self.names) or not self.records:
            fail("RecordSet.names", f"{len(self.names)} names for {len(self.records)} records", "must be one for each")

    def __repr__(self) -> str:
        return f"RecordSet({len(self.records)} records, the first {self.records[0]!r})"
