"""Parts of pages about an NC program of a project: the places nearest to their limit over all draws, the advised speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from toolpoint.pages.machining.program import machining_page, stages_page
from toolpoint.plot import Cell, Report, Table
from toolpoint.project.programs.run_files import ProgramRun
from toolpoint.studies.machining.tilted_stages import StagedStudy

LIKELY_STABLE, LIKELY_CHATTER = 0.95, 0.05  # probabilities from which a place is marked
PLACE_HEADER = ("line", "tool", "rev/min", "depth mm", "limit mm", "95 % interval mm", "stable %", "chatter Hz")


def program_parts(data: Mapping[str, Any]) -> list[Table | str]:
    """Return the parts of a section about a program: how sure its blocks are stable, the advice, the record."""
    parts: list[Table | str] = [tool["words"] for tool in data["advice"]]
    if data["stable_probability"] is not None:
        caption = (f"The engagements nearest to their limit, over {data['draws']} draws of machine and coefficients. All of "
                   f"them are stable together with {100 * data['stable_probability']:.0f} %")
        if data["stable_probability_advised"] is not None:
            caption += f", at the advised speeds with {100 * data['stable_probability_advised']:.0f} %"
        parts.insert(0, Table(list(PLACE_HEADER), [_row(place) for place in data["places"]], f"{caption}."))
    return [*parts, *([data["record"]] if data["record"] else [])] or ["Stability is not known: no machine, no tap of the tip."]


def _row(place: Mapping[str, Any]) -> list[object]:
    chance, searched = place["stable_probability"], f"above {4e3 * place['depth_m']:.3g}"
    lower, upper = place["interval_m"]
    ends = searched if lower is None else f"{1e3 * lower:.3g} .. " + (searched if upper is None else f"{1e3 * upper:.3g}")
    limit = searched if place["limit_m"] is None else f"{1e3 * place['limit_m']:.3g}"
    frequency = "" if place["chatter_frequency_hz"] is None else f"{place['chatter_frequency_hz']:.0f}"
    mark = "good" if chance >= LIKELY_STABLE else "doubtful" if chance <= LIKELY_CHATTER else "assumed"
    return [str(place["line"]), str(place["tool"]), f"{place['speed_rpm']:.0f}", f"{1e3 * place['depth_m']:.3g}", limit, ends,
            Cell(f"{100 * chance:.0f}", mark), frequency]


def project_program_page(run: ProgramRun, data: Mapping[str, Any] | None = None, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a program of a project: as `toolpoint machining` shows it, with what the draws say in front.

    data : the numbers of the project's step, None where it has not run.
    """
    study = run.study
    report = stages_page(study, warnings) if isinstance(study, StagedStudy) else machining_page(study, warnings)
    if data is None:
        return report.with_doubts(*run.doubts)
    first = Report(report.title).with_section("How sure", *program_parts(data)).sections
    return replace(report, sections=(*first, *report.sections)).with_doubts(*run.doubts)
