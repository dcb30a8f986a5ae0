"""Commands about projects: run, tried."""

from __future__ import annotations

from typing import Annotated

from toolpoint import pages, project
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, command, list_given
from toolpoint.app.frame import Frame
from toolpoint.app.values import AnyPath, AxisPositions

PROJECT_PAGE = "report.html"  # in the project's folder, where no --output is given


@command("run")
def run_project(run: Frame, folder: Annotated[AnyPath, Argument()], steps: Annotated[tuple[str, ...], Argument()] = (), *,
                explain: Annotated[bool, Help("Say of every step why it runs, or why it need not.")] = False,
                workers: Annotated[int, Help("Steps that run side by side, each in a process of its own.", minimum=1)] = 1,
                overwrite: Annotated[bool, Help("Compute results again that somebody changed by hand.")] = False,
                since: Annotated[str, Help("Also what differs from the answers of an earlier run: its date or key, or their "
                                           "beginnings; a wrong one lists those that are kept.", metavar="DATE")] = "",
                until: Annotated[str, Help("Of a run that is not the last one.", metavar="DATE", needs="--since")] = ""
                ) -> None:
    """Bring a project up to date: from records over modes, joints and machine to limits, changes and the next test.

    FOLDER holds project.yaml (`toolpoint new project`). STEPs are run with all that they rest on; all where none is named. Only
    what rests on something changed is computed.
    """
    opened = project.Project.open(folder)
    if not list_given("output") and run.output is not None:
        run.output = folder / PROJECT_PAGE
    lines: list[str] = []
    count = run.progress_of_parts()
    total = len(opened.chain.steps)

    def listen(event: project.StepEvent) -> None:
        if not event.ended:
            count(event.decision.step, len(lines), total)
            return
        lines.append(f"{event.decision.step}: {event.decision.action}, {event.decision.reason}")

    results = opened.run(steps, workers=workers, overwrite=overwrite, listen=listen)
    if since:
        results = results.beside(opened.compare_states(since, until))
    if explain:
        run.show_text(*lines)
    run.present(pages.project_page, results, run.warnings)


@command("tried", page=False, json=False)
def report_cut(run: Frame, folder: Annotated[AnyPath, Argument()], *,
          speed: Annotated[float, Help("Spindle speed, rev/min.", above=0)],
          depth: Annotated[float, Help("Axial depth, mm.", above=0, scale=1e-3)],
          chatter: Annotated[float | None, Help("It chattered, at this frequency, Hz; 0 where that was not heard.", minimum=0,
                                                excludes="--stable, a cut is one or the other")] = None,
          stable: Annotated[bool, Help("It was stable.")] = False,
          cut: Annotated[str, Help("Name of the cut, where the project has several.")] = "",
          pose: Annotated[AxisPositions | None, Help("Positions of the axes.", metavar="X=200mm")] = None) -> None:
    """Report a cut that was tried to a project: the next run weighs all its draws by it."""
    if stable == (chatter is not None):
        raise ToolpointError("--stable, --chatter: none given; must be one of them (--chatter 640, or --chatter 0 without a "
                             "frequency)")
    opened = project.Project.open(folder)
    opened.report_cut(project.TriedCut(speed, depth, stable, chatter or None, cut, pose or {}))
    outcome = "stable" if stable else "chatter" + (f" at {chatter:g} Hz" if chatter else "")
    run.show_text(f"Reported: {speed:g} rev/min, {1e3 * depth:g} mm, {outcome}")
    run.suggest(f"run {folder}")
