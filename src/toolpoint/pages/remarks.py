"""Remarks of a page: assumptions at its end, doubts under its answer."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint._doubt import doubts_among
from toolpoint.plot import Report


def with_remarks(report: Report, remarks: Sequence[str], warnings: Sequence[str] = ()) -> Report:
    """Return the report with its remarks as assumptions, each once; doubts and `warnings` among them stand at the top."""
    doubts = list(dict.fromkeys([*warnings, *doubts_among(remarks)]))
    return report.with_doubts(*doubts).with_assumptions(*(line for line in dict.fromkeys(remarks) if line not in doubts))
