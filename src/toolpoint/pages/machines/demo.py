"""Pages of published machines: the demo without and with feed drives, a workspace study, and a head beside its source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from toolpoint._doubt import doubts_among
from toolpoint.pages.machines.frequency_map import map_page
from toolpoint.pages.machines.machine import answer, machine_page, with_responses
from toolpoint.plot import Listing, Notes, Report, ShapeView
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.machines.check.machine_words import describe_motion
from toolpoint.studies.machines.machine_report import MachineReport
from toolpoint.studies.machines.pose_map import PoseMap
from toolpoint.studies.machines.response_map import ResponseMap
from toolpoint.studies.robots.published_head import PLANE_HEIGHTS, PublishedHead
from toolpoint.studies.robots.workspace import WorkspaceStudy


def workspace_page(result: WorkspaceStudy, *, source: str, file_name: str, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a machine with maps of its frequencies and of its tool's stiffness over the workspace.

    source, file_name : text and name of the machine file.

    Examples
    --------
    Runs in ``examples/map_a_machine_over_its_workspace.py``.
    """
    page = machine_page(result.report, source, file_name, problems=warnings)
    # The inputs are the last section of a machine page, and stay the last.
    inputs, page = page.sections[-1], replace(page, sections=page.sections[:-1])
    page = page.with_section("How it moves", Notes(describe_motion(result.report.machine), "note", "Axes, loops and the tool"))
    for title, part in (("Frequencies over the workspace", result.frequencies),
                        ("Static stiffness over the workspace", result.stiffness)):
        maps = map_page(part, file_name)
        page = page.with_section(title, *(map_part for section in maps.sections for map_part in section.parts))
    return page.with_section(inputs.title, *inputs.parts)


def head_source_page(result: PublishedHead, *, source: str, file_name: str, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the published parallel head: its numbers beside the source, then maps over planes and over tilt.

    source, file_name : text and name of the machine file. The source meant in the page is the publication.
    """
    page = machine_page(result.report, source, file_name, problems=warnings)
    inputs, page = page.sections[-1], replace(page, sections=page.sections[:-1])
    page = page.with_section("Beside the source", Notes(result.source_lines(), "note", "Numbers of both"))
    parts: list[tuple[str, PoseMap | ResponseMap]] = [
        (f"Frequencies over the plane p_z {-1e3 * z:.0f} mm", plane)
        for z, plane in zip(PLANE_HEIGHTS, result.planes, strict=True)]
    parts += [(f"Responses over {name} at p_z 750 mm", part) for name, part in result.responses.items()]
    for title, part in parts:
        maps = map_page(part, file_name)
        page = page.with_section(title, *(map_part for section in maps.sections for map_part in section.parts))
    return page.with_section(inputs.title, *inputs.parts)


def demo_page(casting: MachineReport, drives: MachineReport, files: Sequence[tuple[str, str]], *, warnings: Sequence[str] = ()
              ) -> Report:
    """Return the page of the published machine, without and with its feed drives.

    files : (name, text) of the machine file without drives, then of that with drives.

    Examples
    --------
    Runs in ``examples/show_the_published_machine.py``.
    """
    (casting_name, casting_text), (drives_name, drives_text) = files
    page = machine_page(casting, casting_text, casting_name)
    first_sentence, drives_words = answer(casting).partition(". ")[0], answer(drives)
    summary = (f"{first_sentence} as a casting alone. With its feed drives {drives_words[0].lower()}{drives_words[1:]}\n\n"
               f"{casting.machine.description.description}")
    page = replace(page.with_doubts(*doubts_among(drives.notes)), summary=summary)
    inputs, page = page.sections[-1], replace(page, sections=page.sections[:-1])
    scene, shapes = machine_shapes(drives.machine, {}, 18)
    page = page.with_section(
        "With feed drives", f"The same casting with its feed drives has {drives.machine.size} degrees of freedom, as table 2 "
        "of the paper counts them. The stiffnesses of the drives are chosen, not published. Tool-point responses and stability "
        "below are those of this machine.", ShapeView(scene, shapes, "drives", drives.machine.name))
    page = with_responses(page, drives)
    further_assumptions = [note for note in drives.machine.description.assumptions
                           if note not in casting.machine.description.assumptions]
    parts = [Notes(warnings, "warning")] if warnings else []
    return page.with_section(inputs.title, *parts, *inputs.parts,
                             Notes(further_assumptions, "assumed", "Also assumed for the feed drives"),
                             Listing(f"Machine file {drives_name}", drives_text))
