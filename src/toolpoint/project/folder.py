"""Project: a folder with its project file, run and asked."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import toolpoint
from toolpoint import io
from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.cutting.description import flat_values
from toolpoint.machine.description.project_plan import ProjectDescription, TriedCut
from toolpoint.project.chain import TRIED_FILE, ProjectChain, build_chain, choice_place
from toolpoint.project.engine.content import ContentCache
from toolpoint.project.engine.drafts import write_whole
from toolpoint.project.engine.outlook import StepOutlook, foresee_steps, open_cache
from toolpoint.project.engine.plan import plan_steps
from toolpoint.project.engine.run import STATE_FOLDER, Listener, RunResult, run_steps
from toolpoint.project.kept_states import KeptState, find_state, keep_state, read_states
from toolpoint.project.results import ProjectResults, gather_results
from toolpoint.project.steps.plain_files import read_json

if TYPE_CHECKING:
    from toolpoint.project.limits.attached_tool_draws import AttachedToolDraws
    from toolpoint.project.limits.coupled_tool import CoupledDraws
    from toolpoint.project.limits.drawn_limits import DrawnLimits
    from toolpoint.project.programs.run_files import ProgramRun
    from toolpoint.project.state_difference import StateDifference

PROJECT_FILE, RESULT_FILE = "project.yaml", "results/project.json"
LISTED_LOBES = 8  # engagements of a program whose lobes its page shows
TRIED_HEAD = ("# Cuts that were tried, as `toolpoint tried` reports them; a line may be mended or removed by hand.\n"
              "toolpoint: 1\ntried:\n")


@dataclass(frozen=True)
class Project:
    """A folder that holds ``project.yaml``: `run` brings its results up to date, `results` are those of the last run.

    >>> import tempfile
    >>> text = "toolpoint: 1\\nname: mill\\ncuts: {face: {diameter: 50 mm, teeth: 5, immersion: 0.6, material: al7075}}\\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "project.yaml").write_text(text, encoding="utf-8")
    ...     project = Project.open(folder)
    ...     project.description.name, list(project.description.cuts), project.states
    ('mill', ['face'], ())
    """

    folder: Path

    @classmethod
    def open(cls, folder: str | Path) -> Project:
        """Return the project of a folder; raises ToolpointError for a folder without project.yaml."""
        place = Path(folder)
        if not (place / PROJECT_FILE).is_file():
            raise ToolpointError(f"{place}: holds no {PROJECT_FILE}; make a project with `toolpoint new project {place}`")
        return cls(place)

    @cached_property
    def description(self) -> ProjectDescription:
        """Content of the project file; raises FileFaults with every fault of it."""
        return io.read_project(self.folder / PROJECT_FILE)

    @cached_property
    def chain(self) -> ProjectChain:
        """Steps that the parts of the project allow, and what one part more would give."""
        return build_chain(self.description, self.folder)

    def run(self, steps: Sequence[str] = (), *, workers: int = 1, overwrite: bool = False,
            listen: Listener = lambda event: None) -> ProjectResults:
        """Run the steps whose results are not of today's files and options, and all that they rest on.

        Parameters
        ----------
        steps : names; all where none is named
        workers : int
            Steps that run side by side.
        overwrite : bool
            Whether results that somebody changed by hand are computed again.
        listen : function of a StepEvent
        """
        result = self._run_steps(steps, workers, overwrite, listen)
        results = gather_results(self.description.name, self.folder, self.chain.steps, run=result,
                                 absent_parts=self.chain.absent_parts, version=toolpoint.__version__)
        if not steps:  # of some steps alone it would lose the answers of the others
            write_whole(self.folder / RESULT_FILE, json.dumps(results.to_dict(), indent=1) + "\n")
            keep_state(self.folder, self.chain.steps, results.data["goals"])
        return results

    @property
    def states(self) -> tuple[KeptState, ...]:
        """Answers of the last runs of the whole project, the oldest first; a run that changes nothing adds none."""
        return read_states(self.folder)

    def compare_states(self, older: str, newer: str = "") -> StateDifference:
        """Return how the answers of two kept states differ.

        older, newer : the beginning of a date or a key of `states`; the last one where `newer` is left out, and for `older` the
        last before it that fits. Raises ToolpointError, with the list of the states, for one that is not kept.
        """
        from toolpoint.project.state_difference import StateDifference

        states = self.states
        last = find_state(states, newer) if newer or not states else states[-1]
        return StateDifference(find_state([state for state in states if state != last], older), last)

    def _run_steps(self, steps: Sequence[str], workers: int, overwrite: bool, listen: Listener) -> RunResult:
        plan = plan_steps(self.chain.steps, self.folder).chosen(steps)
        return run_steps(plan, self.folder, workers=workers, overwrite=overwrite, versions=_versions(), listen=listen)

    def outlook(self, cache: ContentCache | None = None) -> tuple[StepOutlook, ...]:
        """Return the state of every step's results today: which a run would run, and why; nothing is run or written.

        cache : digests of files from an earlier look, so that only what has changed is read again.
        """
        new_cache, store = open_cache(self.folder, STATE_FOLDER)
        return foresee_steps(plan_steps(self.chain.steps, self.folder), cache or new_cache, store)

    @property
    def results(self) -> ProjectResults:
        """Results of the last run."""
        place = self.folder / RESULT_FILE
        if not place.is_file():
            raise ToolpointError(f"{self.folder}: has no results yet; run it (toolpoint run {self.folder})")
        return ProjectResults(read_json(place))

    @property
    def machine_file(self) -> Path:
        """The machine file that limits rest on; raises ToolpointError where the project has none (yet)."""
        step = next((step for step in self.chain.steps if step.name == "machine"), None)
        place = None if step is None else self.folder / str(step.inputs["machine"])
        if place is None or not place.is_file():
            raise ToolpointError(f"{self.folder}: has no machine file; run the project, or see what is missing in its results")
        return place

    @property
    def machine_doubt(self) -> str:
        """Reason why the machine file is not of today: the step that would run again; empty where nothing has changed."""
        step = next((entry for entry in self.outlook() if entry.step.name == "machine"), None)
        return "" if step is None or step.is_of_today else f"{self.folder}: its machine file is not of today: {step.reason}"

    def limits(self, pose: Mapping[str, float] | None = None, *, cut: str = "", speeds: Sequence[float] | FloatArray = (),
               draws: int | None = None, stick_out: float | None = None) -> DrawnLimits:
        """Return the limits of a cut of the project at a pose, with draws of the machine and of the coefficients.

        Parameters
        ----------
        pose : mapping of axis name to m or rad, optional
        cut : name, optional
            The first of the project where left out.
        speeds : rev/min; 12 over the range of the cut where left out
        draws : int; those of the project where left out
        stick_out : float, optional
            m, of the project's coupled tool in place of that of its machine; its spindle comes from a gauge or the machine.
        """
        from toolpoint.project.limits.drawn_limits import draw_limits
        from toolpoint.project.limits.systems import MachineDraws
        from toolpoint.project.steps.answering import question_of

        project = self.description
        name = cut or next(iter(project.cuts), "")
        if name not in project.cuts:
            fail("cut", repr(name), f"must be one of {', '.join(project.cuts) or 'the cuts of project.yaml, which has none'}")
        described = project.cuts[name]
        asked_speeds = speeds if len(speeds) else np.linspace(*described.cut.speeds, 12)
        options = {"values": flat_values(described.cut), "deviation": described.coefficient_deviation}
        question = question_of(name, options, [float(speed) for speed in asked_speeds], pose=dict(pose or {}))
        count = draws or project.draws
        if stick_out is not None:
            return draw_limits(self.coupled_tool(stick_out, draws=count), question)
        return draw_limits(MachineDraws(io.read_machine(self.machine_file), count, project.seed), question)

    def coupled_tool(self, stick_out: float, *, draws: int) -> CoupledDraws | AttachedToolDraws:
        """Return the draws of the project's coupled tool at a stick-out (m); raises ToolpointError where it has none."""
        from toolpoint.project.limits.coupled_tool import couple_at

        project = self.description
        if project.coupling is None:
            fail("stick_out", f"{stick_out:g}", "needs a coupled tool: its shaft file, and the spindle (coupling: in "
                 "project.yaml)")
        machine = io.read_machine(self.machine_file) if project.coupling.point is not None else None
        return couple_at(project.coupling, self.folder, stick_out, machine=machine, draws=draws, seed=project.seed)

    def program(self, name: str, *, lobes: int = LISTED_LOBES, with_advice: bool = False) -> ProgramRun:
        """Return the study of an NC program of the project on the likeliest machine or tip, from the files on the disk.

        lobes : of how many engagements, those nearest to their limit, the lobes are computed too; with_advice : whether also
        which speeds and feeds to change, which takes longer.
        """
        from toolpoint.project.programs.run_files import run_step

        steps = {step.name.partition("/")[2]: step for step in self.chain.steps if step.name.startswith("program/")}
        if name not in steps:
            fail("program", repr(name), f"must be one of {', '.join(steps) or 'the programs of project.yaml, which has none'}")
        return run_step(steps[name].arguments(self.folder), lobes=lobes, with_advice=with_advice)

    def report_cut(self, cut: TriedCut) -> None:
        """Add a cut that was tried to the project's file of them; the next run weighs its draws by it."""
        place = self.folder / TRIED_FILE
        if place.is_file():
            io.read_tried(place)
        text = place.read_text(encoding="utf-8") if place.is_file() else TRIED_HEAD
        write_whole(place, text + ("" if text.endswith("\n") else "\n") + io.line_of_tried(cut))

    def choose_poles(self, test: str, text: str) -> str:
        """Write the poles that a person chose for a test, the text of a choice file; return its place.

        The next run identifies the test with it. An empty text takes the choice back. Raises ToolpointError for a test that the
        project lacks or that is given as modes, and for a text that is no choice file; nothing is written then.
        """
        tests = [name for name, entry in self.description.tests.items() if not entry.modes and entry.of == "structure"]
        if test not in tests:
            fail("test", repr(test), f"must be one whose modes are identified here: {', '.join(tests) or 'none'}")
        place = choice_place(test)
        target = self.folder / place
        if not text.strip():
            target.unlink(missing_ok=True)
            return place
        target.parent.mkdir(exist_ok=True)
        draft = target.with_name(f".{target.name}.draft")
        try:
            draft.write_text(text, encoding="utf-8")
            io.read_choice(draft)
        except ToolpointError as error:
            raise ToolpointError(f"{place}: not kept\n{str(error).replace(str(draft), place)}") from None
        finally:
            draft.unlink(missing_ok=True)
        write_whole(target, text.rstrip("\n") + "\n")
        return place


def _versions() -> dict[str, str]:
    """Return the versions of what computes, for the records."""
    return {"toolpoint": toolpoint.__version__, "python": platform.python_version(), "numpy": np.__version__,
            "scipy": importlib.metadata.version("scipy")}
