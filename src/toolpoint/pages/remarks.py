"""The last section of most pages: warnings apart, above what was assumed."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.plot import Notes, Report


def with_remarks(report: Report, remarks: Sequence[str], warnings: Sequence[str] = ()) -> Report:
    """Return the report with its remarks, each once; those that are `warnings` stand apart, above the others."""
    doubts = list(dict.fromkeys(warnings))
    lines = [line for line in dict.fromkeys(remarks) if line not in doubts]
    parts = ([Notes(doubts, "warning")] if doubts else []) + ([Notes(lines, "assumed")] if lines else [])
    return report.with_section("Remarks", *parts) if parts else report


def with_warnings(report: Report, warnings: Sequence[str], title: str = "Warnings") -> Report:
    """Return the report with a section of warnings, each once, where there are any."""
    return report.with_section(title, Notes(list(dict.fromkeys(warnings)), "warning")) if warnings else report
