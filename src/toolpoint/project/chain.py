"""Chain of a project: which steps its parts allow, and what one part more would give."""

from __future__ import annotations

import posixpath
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path, PurePosixPath
from typing import Any

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.cutting.description import flat_values
from toolpoint.io.yaml.named_files import list_named_files
from toolpoint.machine.description.project_plan import (
    STRUCTURE,
    TIP_X,
    TIP_Y,
    ProjectCut,
    ProjectDescription,
    ProjectTest,
)
from toolpoint.project.engine.step import LateWork, ProjectStep, result_path
from toolpoint.project.programs.settings import circle_command, program_command, program_inputs, program_settings
from toolpoint.project.recorded_tests import find_files, find_records, refuse_repeated_files

TRIED_FILE = "tried.yaml"
CHOICES_FOLDER = "choices"  # of poles that a person chose: a file a test, of its name
# Versions of what the steps compute: raised where results change.
STEP_VERSIONS = {"responses": 5, "modes": 7, "joints": 8, "drift": 2, "update": 4, "machine": 2, "tip": 3, "tried": 8,
                 "limits": 14, "changes": 5, "next": 2, "contour": 3, "program": 7}


@dataclass(frozen=True)
class ProjectChain:
    """Steps of a project, and what parts that are not there would give."""

    steps: tuple[ProjectStep, ...]
    absent_parts: tuple[str, ...]


def build_chain(project: ProjectDescription, root: Path) -> ProjectChain:
    """Return the steps that the parts of a project allow, and what one part more would give."""
    builder = _ChainBuilder(project, root)
    return ProjectChain(tuple(builder.steps()), tuple(builder.absent_parts))


class _ChainBuilder:
    """Builder of a chain: from tests over the machine to the answers."""

    def __init__(self, project: ProjectDescription, root: Path) -> None:
        self.project, self.root = project, root
        self.absent_parts: list[str] = []
        self._steps: list[ProjectStep] = []

    def steps(self) -> list[ProjectStep]:
        """Return the steps in the order of their making."""
        refuse_repeated_files(self.root, self.project.tests)
        modes = {name: path for name, test in self.project.tests.items() if (path := self._modes_of(name, test))}
        machine = self._machine(modes)
        tip = self._tip()
        sources = ({"tip": tip} if tip else {}) | ({} if machine is None else {"machine": {"machine": machine}})
        sources |= self._coupled(machine)
        weights = self._answers(sources, machine)
        self._programs(sources, weights)
        self._contours(machine)
        self._say_missing(sources)
        return self._steps

    def _add(self, kind: str, name: str, work: Any, inputs: Mapping[str, Any], *, options: Mapping[str, Any],
             outputs: tuple[str, ...], words: str, command: Sequence[str] = ()) -> str:
        """Add a step; return the place of its first output."""
        command_text = shlex.join(["toolpoint", *command]) if command else ""
        step = ProjectStep(name, work, inputs, options, outputs, STEP_VERSIONS[kind], words, command_text)
        self._steps.append(replace(step, named_files=self._named_files(step)))
        return result_path(name, outputs[0])

    def _named_files(self, step: ProjectStep) -> tuple[str, ...]:
        """Return the files that the inputs of a step name (a mesh, matrices), and those of the steps that made its inputs."""
        names: list[str] = []
        for path in step.input_paths:
            makers = [earlier.named_files for earlier in self._steps if path in earlier.output_paths]
            folder = PurePosixPath(path).parent
            # A machine file names meshes: a step that reads what was made from it must run again when one of them changes.
            names += makers[0] if makers else [posixpath.normpath(str(folder / name.replace("\\", "/")))
                                               for name in list_named_files(self.root / path)]
        return tuple(dict.fromkeys(names))

    def _modes_of(self, name: str, test: ProjectTest) -> str | None:
        """Add the steps from a test to its modes; return their place, None for a test of a tip."""
        if test.modes:
            return test.modes
        responses = self._responses(name, test)
        # Responses of a tip are answered by lobes: its modes are fitted there, in the directions of the cut.
        if test.of != STRUCTURE:
            return None
        options = {"band": test.band, "sensor_mass": self._sensor_mass(test), "whole_band": bool(test.responses)}
        choice = choice_place(name)
        inputs = {"responses": responses, **({"choice": choice} if (self.root / choice).is_file() else {})}
        command = ["identify", responses, *(["--choice", choice] if "choice" in inputs else [])]
        return self._add("modes", f"modes/{name}", _late("measuring", "find_modes"), inputs, options=options,
                         outputs=("modes.h5", "modes.json"), words=f"modes of {name}", command=command)

    def _sensor_mass(self, test: ProjectTest) -> float | None:
        """Return the mass of the moved sensor (kg): that of the project, else of the channels of the test file."""
        if test.sensor_mass is not None or test.test is None:
            return test.sensor_mass
        return io.read_kind(self.root / test.test, "test")[1].moved_sensor_mass

    def _responses(self, name: str, test: ProjectTest) -> str:
        settings = {"struck": test.struck, "pattern": test.pattern}
        if test.responses:
            files = self._files(f"tests.{name}.responses", test.responses)
            return self._add("responses", f"responses/{name}", _late("measuring", "gather_responses"), {"responses": files},
                             options=settings, outputs=("responses.h5",), words=f"responses of {name}")
        return self._add("responses", f"responses/{name}", _late("measuring", "make_responses"),
                         self._record_inputs(name, test), options={} if test.test else {**settings, "channels": test.channels},
                         outputs=("responses.h5", "hits.json"), words=f"hits and responses of {name}",
                         command=("frf", test.test) if test.test else ())

    def _record_inputs(self, name: str, test: ProjectTest) -> dict[str, Any]:
        """Return the inputs of a hammer test: its records, and the test file that names them."""
        return {**({"test": test.test} if test.test else {}), "records": find_records(self.root, name, test)}

    def _files(self, key: str, patterns: tuple[str, ...]) -> tuple[str, ...]:
        """Return the files of names and patterns, relative to the project, sorted within each."""
        return find_files(self.root, key, patterns)

    def _machine(self, modes: Mapping[str, str]) -> str | None:
        """Add the steps to a machine file; return its place, None where the parts give none."""
        project, machine, left = self.project, self.project.machine, dict(modes)
        # Tests stand in the order of their dates: the file is refused otherwise.
        structural = [name for name in left if project.tests[name].of == STRUCTURE]
        drift: dict[str, str] = {}
        if machine is None and structural and project.components and project.geometry:
            first = structural[0]
            machine = self._add("joints", "joints", _late("modelling", "find_joints"), {
                "modes": left[first], "geometry": project.geometry, "components": project.components},
                options={"pose": dict(project.tests[first].pose)},
                outputs=("machine.yaml", "joints.json"), words=f"joints and machine from {first}", command=(
                    "joints", left.pop(first), "--geometry", project.geometry, "--components", project.components))
            structural.remove(first)
            drift = self._drift(first, structural, modes, machine)
        if machine is not None and structural and project.machine is not None:
            drift = self._drift(structural[0], structural[1:], modes, machine)
            inputs = {"machine": machine, "modes": tuple(left[name] for name in structural), **drift}
            poses = [dict(project.tests[name].pose) for name in structural]
            machine = self._add("update", "update", _late("modelling", "update_model"), inputs, options={"poses": poses},
                                outputs=("machine.yaml", "update.json"), words=f"machine updated to {', '.join(structural)}")
        elif machine is not None and structural and not drift:
            self.absent_parts.append(f"tests {', '.join(structural)} are at other poses than that of the machine: the chain "
                                     f"does "
                                f"not "
                                "use them yet; toolpoint update does")
        if machine is not None:
            self._add("machine", "machine", _late("modelling", "look_at_machine"), {"machine": machine, **drift}, options={},
                      outputs=("machine.json",), words="machine in words", command=("report", machine))
        return machine

    def _drift(self, first: str, others: Sequence[str], modes: Mapping[str, str], machine: str) -> dict[str, str]:
        """Add the comparison of later tests at the pose of the first one; return its place as an input, nothing without any."""
        tests = self.project.tests
        # At another pose every frequency differs without any change of the machine.
        later_tests = [name for name in others if dict(tests[name].pose) == dict(tests[first].pose)]
        if not later_tests:
            return {}
        command = ["drift", *(modes[name] for name in later_tests), "--baseline", modes[first], "--machine", machine]
        return {"drift": self._add("drift", "drift", _late("comparing", "judge_drift"), {
            "baseline": modes[first], "tests": tuple(modes[name] for name in later_tests), "machine": machine}, options={
                "names": [first, *later_tests], "pose": dict(tests[first].pose)}, outputs=("drift.json",),
            words=f"whether the machine changed after {first}", command=command)}

    def _tip(self) -> dict[str, str]:
        """Add the verdict on the tests of a tip; return the responses of the tip that limits rest on."""
        tests = {test.of: name for name, test in self.project.tests.items() if test.of in (TIP_X, TIP_Y)}
        if TIP_X not in tests:
            if TIP_Y in tests:
                self.absent_parts.append(f"test {tests[TIP_Y]} alone is that of a tip along y: one along x (of: tip x) gives "
                                         f"limits")
            return {}
        inputs: dict[str, Any] = {}
        settings: dict[str, Any] = {}
        for kind, name in tests.items():
            way, test = kind[-1], self.project.tests[name]
            settings[way] = {"struck": test.struck, "pattern": test.pattern, "channels": list(test.channels)}
            if test.responses:
                inputs[f"responses_{way}"] = self._files(f"tests.{name}.responses", test.responses)
            else:
                inputs |= {f"{key}_{way}": entry for key, entry in self._record_inputs(name, test).items()}
        for cut_name, cut in self.project.cuts.items():
            self._add("tip", f"tip/{cut_name}", _late("measuring", "judge_tip"), inputs,
                      options={"values": flat_values(cut.cut), "tests": settings}, outputs=("tap.json",),
                      words=f"verdict on the tap, and speeds for the cut {cut_name}")
        return {f"tip_{kind[-1]}": result_path(f"responses/{name}", "responses.h5") for kind, name in tests.items()}

    def _coupled(self, machine: str | None) -> dict[str, dict[str, Any]]:
        """Return the inputs of the coupled tool where a goal asks for it, nothing where its spindle is not known."""
        plan = self.project.coupling
        if plan is None or all(goal.stick_out is None for goal in self.project.goals.values()):
            return {}
        if plan.point is None:
            return {"coupled": {"tool": plan.tool, "gauge": str(plan.gauge), "gauge_responses": self._files(
                "coupling.responses", plan.responses)}}
        if machine is None:
            self.absent_parts.append("coupling: a machine (machine, or a test with components and geometry) carries the tool")
            return {}
        return {"coupled": {"tool": plan.tool, "machine": machine}}

    def _answers(self, sources: Mapping[str, Mapping[str, str]], machine: str | None) -> dict[str, dict[str, str]]:
        """Add the steps from the machine and the tip to the answers of the goals; return the weights of the draws."""
        project = self.project
        cuts = {name: _cut_options(cut) for name, cut in project.cuts.items()}
        goals = {name: _plain(goal) for name, goal in project.goals.items()}
        if not sources or not cuts:
            return {}
        kinds = {name: self._source_of(goal, sources) for name, goal in goals.items()}
        on_machine = project.coupling is not None and project.coupling.point is not None
        # The draws of a tool on the machine are those of the machine: cuts that were tried weigh both.
        weighed = {name: "machine" if kind == "coupled" and on_machine else kind for name, kind in kinds.items()}
        used_kinds = [*weighed.values(), *([_program_source(sources)] if project.programs else [])]
        weights = self._tried({kind: sources[kind] for kind in dict.fromkeys(used_kinds) if kind in ("machine", "tip")}, cuts)
        coupling = None if project.coupling is None else _plain(project.coupling)
        for name, goal in goals.items():
            kind = kinds[name]
            if kind not in sources:
                continue
            tool_options = {"coupling": coupling} if kind == "coupled" else {}
            self._add("limits", f"limits/{name}", _late("answering", "limit_goal"), {
                **sources[kind], **weights.get(weighed[name], {}), **self._look(weighed[name], goal["cut"])},
                      options={"name": name, "cut": cuts[goal["cut"]], "cut_name": goal["cut"], "goal": goal,
                               "struck_pose": self._struck_pose, **tool_options, **self._draws}, outputs=("limits.json",),
                      words=f"limit and probability of the goal {name}")
        # Changes and measurements are ranked on the machine with its own tool: the coupled one is not part of its file.
        own_tool = {name: goal for name, goal in goals.items() if kinds[name] != "coupled"}
        if machine is not None and own_tool:
            self._advice(machine, cuts, own_tool)
        return weights

    @staticmethod
    def _look(kind: str, cut: str) -> dict[str, str]:
        """Return the look at what a limit is computed from: its doubts are those of the limit, its grave ones stop it."""
        if kind == "machine":
            return {"checked": result_path("machine", "machine.json")}
        return {"verdict": result_path(f"tip/{cut}", "tap.json")} if kind == "tip" else {}

    def _programs(self, sources: Mapping[str, Mapping[str, str]], weights: Mapping[str, Mapping[str, str]]) -> None:
        """Add the steps of the NC programs, on the machine where there is one, else on the tip, else without dynamics."""
        project, kind = self.project, _program_source(sources)
        for name, program in project.programs.items():
            inputs = {**program_inputs(program, project.servo), **sources.get(kind, {}), **weights.get(kind, {})}
            if kind == "machine":
                inputs["checked"] = result_path("machine", "machine.json")
            elif kind == "tip" and program.cut:
                inputs["verdict"] = result_path(f"tip/{program.cut}", "tap.json")
            self._add("program", f"program/{name}", _late("machining", "judge_program"), inputs,
                      options={"settings": program_settings(program, project), **self._draws}, outputs=("program.json",),
                      words=f"blocks of the program {name} on the {kind or 'machine, which is not known'}",
                      command=program_command(program, project, sources.get(kind, {})))
            if not kind:
                self.absent_parts.append(f"program {name}: a machine or a tap of the tip says which of its blocks chatter")

    @property
    def _draws(self) -> dict[str, Any]:
        return {"draws": self.project.draws, "seed": self.project.seed}

    @property
    def _struck_pose(self) -> dict[str, float]:
        """Pose at which the tip was struck."""
        return next((dict(test.pose) for test in self.project.tests.values() if test.of == TIP_X), {})

    def _source_of(self, goal: Mapping[str, Any], sources: Mapping[str, Any]) -> str:
        """Return what the limits of a goal are computed from: its coupled tool, the tip where it was struck at its pose,
        otherwise the machine."""
        pose = goal["pose"]
        if goal["stick_out"] is not None:
            return "coupled"
        # What was measured at a pose counts there before what is computed for it.
        if "machine" not in sources or ("tip" in sources and (not pose or dict(pose) == self._struck_pose)):
            return "tip"
        return "machine"

    def _tried(self, sources: Mapping[str, Mapping[str, str]], cuts: Mapping[str, Any]) -> dict[str, dict[str, str]]:
        """Add the steps that weigh the draws of every source by the tried cuts; return the places of the weights."""
        if not (self.root / TRIED_FILE).is_file():
            return {kind: {} for kind in sources}
        has_poses = any(goal.pose for goal in self.project.goals.values())
        return {kind: {"weights": self._add(
            "tried", f"tried/{kind}", _late("answering", "weigh_tried"), {**source, "tried": TRIED_FILE},
            options={"cuts": cuts, "has_poses": has_poses, **self._draws}, outputs=("weights.json",),
            words=f"weights of the draws of the {kind} by the cuts that were tried")} for kind, source in sources.items()}

    def _advice(self, machine: str, cuts: Mapping[str, Any], goals: Mapping[str, Any]) -> None:
        """Add the steps that rank changes and measurements."""
        changes = {name: _plain(change) for name, change in self.project.changes.items()}
        inputs = {"machine": machine, "checked": result_path("machine", "machine.json")}
        self._add("changes", "changes", _late("answering", "rank_changes"), inputs, options={
            "cuts": cuts, "goals": goals, "changes": changes, **self._draws}, outputs=("changes.json",),
            words="changes, ranked")
        if machine.startswith("results/"):  # its numbers were identified or updated, and have a covariance
            poses = list(dict.fromkeys(tuple(sorted(pose.items())) for pose in self.project.workspace))
            self._add("next", "next", _late("answering", "choose_test"), inputs, options={
                "pose": next(iter(goals.values()))["pose"], "poses": [dict(pose) for pose in poses]},
                outputs=("next.json",), words="the test that would narrow the answer most")

    def _contours(self, machine: str | None) -> None:
        servo = self.project.servo
        structure = machine if machine is not None and servo is not None and self._ends_on_machine(servo) else None
        for name, goal in self.project.contours.items():
            if servo is None:
                self.absent_parts.append(f"goal {name}: a servo file (servo: drives.yaml) gives the circle's deviation")
                continue
            inputs = {"servo": servo} | ({} if structure is None else {"machine": structure})
            self._add("contour", f"contour/{name}", _late("modelling", "follow_circle"), inputs,
                      options={"goal": _plain(goal), "is_structure_known": machine is not None}, outputs=("contour.json",),
                      words=f"circle of the goal {name}", command=circle_command(servo, goal, structure))

    def _ends_on_machine(self, servo: str) -> bool:
        """Whether the structure of the machine is in the loops; a file that cannot be read fails in its own step."""
        from toolpoint.studies.servos.circle_study import ends_on_machine

        try:
            return ends_on_machine(io.read_drives(self.root / servo))
        except (ToolpointError, OSError):
            return False

    def _say_missing(self, sources: Mapping[str, Any]) -> None:
        """Say what one part more would give."""
        project = self.project
        if not sources:
            absent = [key for key in ("components", "geometry") if getattr(project, key) is None]
            if any(test.of == STRUCTURE for test in project.tests.values()) and absent:
                self.absent_parts.append(f"{' and '.join(absent)}: with them the test gives joints, a machine file and limits "
                                         "at any pose")
            else:
                self.absent_parts.append("a test (tests) or a machine file (machine) is where the chain begins; a tap of the "
                                         "tip (of: tip x) and a cut give limits at once")
        if not project.cuts:
            self.absent_parts.append("a cut (cuts: tool and material) gives depth limits")
        elif not project.goals:
            self.absent_parts.append("a goal (goals: a cut at a speed and depth) gives its limit, and the chance that it is "
                                     "stable")
        if "tip" in sources and "machine" not in sources:
            self.absent_parts.append("a test of the structure with components and geometry gives limits at other poses, and "
                                     "which "
                                "joint to stiffen")
        if sources and not (self.root / TRIED_FILE).is_file():
            self.absent_parts.append("a cut that was tried (toolpoint tried) narrows the intervals")


def choice_place(test: str) -> str:
    """Return the place of the poles that a person chose for a test, relative to the project."""
    return f"{CHOICES_FOLDER}/{test.replace('/', ' ')}.yaml"


def _program_source(sources: Mapping[str, Any]) -> str:
    """Return what programs run on: the machine, posed along them, else the tip; empty where neither is known."""
    return next((kind for kind in ("machine", "tip") if kind in sources), "")


def _late(module: str, name: str) -> LateWork:
    return LateWork(f"toolpoint.project.steps.{module}", name)


def _cut_options(cut: ProjectCut) -> dict[str, Any]:
    return {"values": flat_values(cut.cut), "deviation": cut.coefficient_deviation}


def _plain(part: Any) -> dict[str, Any]:
    """Return the fields of a description as plain data."""
    return {field.name: dict(value) if isinstance(value := getattr(part, field.name), Mapping) else value
            for field in fields(part)}
