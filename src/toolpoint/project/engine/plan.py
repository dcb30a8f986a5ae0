"""Order of the steps of a project, with all faults before anything runs: cycles, missing inputs, outputs claimed twice."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import ToolpointError, suggestion
from toolpoint.project.engine.content import exists
from toolpoint.project.engine.step import ProjectStep


@dataclass(frozen=True)
class StepPlan:
    """Steps in an order in which each stands after all that it rests on.

    sources : of every step, the steps whose outputs it takes.
    """

    steps: tuple[ProjectStep, ...]
    sources: dict[str, tuple[str, ...]]

    def chosen(self, names: Sequence[str]) -> StepPlan:
        """Return the plan of these steps and all that they rest on; of all steps without names."""
        step_names = {step.name for step in self.steps}
        for name in names:
            if name not in step_names:
                raise ToolpointError(f"step {name}: not in this project; {suggestion(name, step_names) or 'its steps'}: "
                                     + ", ".join(step.name for step in self.steps))
        needed, waiting = set[str](), list(names or step_names)
        while waiting:
            name = waiting.pop()
            if name not in needed:
                needed.add(name)
                waiting += self.sources[name]
        return StepPlan(tuple(step for step in self.steps if step.name in needed), self.sources)

    def upstream(self, name: str) -> set[str]:
        """Return all steps that a step rests on."""
        direct = self.sources[name]
        return set(direct).union(*(self.upstream(source) for source in direct))


def plan_steps(steps: Iterable[ProjectStep], root: Path) -> StepPlan:
    """Return the steps of a project in order.

    Raises ToolpointError with all faults at once: two steps of one name or one output, inputs that nobody makes and that are
    not there, steps that wait for each other in a circle.
    """
    listed = list(steps)
    makers, faults = _makers(listed)
    sources = {step.name: tuple(dict.fromkeys(makers[path] for path in step.input_paths if path in makers)) for step in listed}
    for step in listed:
        faults += [f"{step.name}: its input {path} is not there; check the name and the folder"
                   for path in step.input_paths if path not in makers and not exists(root, path)]
    ordered = _order(listed, sources)
    left = [step.name for step in listed if step not in ordered]
    if left:
        faults.append(f"steps wait for each other in a circle: {' -> '.join(_circle(left, sources))}")
    if faults:
        raise ToolpointError(f"{root.name}: {len(faults)} fault{'s' if len(faults) > 1 else ''} before the first step\n"
                             + "\n".join(f"  {fault}" for fault in faults))
    return StepPlan(tuple(ordered), sources)


def _makers(steps: Sequence[ProjectStep]) -> tuple[dict[str, str], list[str]]:
    """Return the step of every output, and the faults of names and outputs that are claimed twice."""
    makers, faults, names = dict[str, str](), list[str](), set[str]()
    for step in steps:
        if step.name in names:
            faults.append(f"{step.name}: two steps of this name")
        names.add(step.name)
        for path in step.output_paths:
            if path in makers:
                faults.append(f"{path}: an output of {makers[path]} and of {step.name}; must be of one step")
            makers[path] = step.name
    return makers, faults


def _order(steps: Sequence[ProjectStep], sources: dict[str, tuple[str, ...]]) -> list[ProjectStep]:
    """Return the steps that can be ordered, each after its sources, otherwise as listed."""
    ordered, waiting = list[ProjectStep](), list(steps)
    placed = set[str]()
    while ready := [step for step in waiting if placed.issuperset(sources[step.name])]:
        ordered.append(ready[0])
        placed.add(ready[0].name)
        waiting.remove(ready[0])
    return ordered


def _circle(names: Sequence[str], sources: dict[str, tuple[str, ...]]) -> list[str]:
    """Return a circle among steps of which each waits for another one of them."""
    way = [names[0]]
    while True:
        name = next(source for source in sources[way[-1]] if source in names)
        if name in way:
            return [*way[way.index(name):], name]
        way.append(name)
