"""Commands at the beginning: new files from templates, and what was understood of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import AnyPath, SourceFile

NEXT = {"machine": ("check {0}", "report {0}", "map {0} --axis ..."), "servo": ("check {0}", "drive {0} --circle 50,4000"),
        "components": ("check {0}", "joints test.uff --geometry test.uff --components {0}"),
        "cut": ("lobes --materials",), "test": ("check {0}", "frf {0}")}


@command(page=False, json=False)
def new(run: Frame, kind: Annotated[Literal["machine", "servo", "components", "cut", "test"], Argument()],
        file: Annotated[AnyPath | None, Argument()] = None, *,
        template: Annotated[str, Help("Which machine: three-axis-vertical, three-axis-horizontal, boring-mill, trunnion, "
                                      "gantry, lathe, grinder, parallel-head, robot.", metavar="NAME")] = "",
        listed: Annotated[bool, Help("Show the templates of KIND.", name="--list")] = False) -> None:
    """A commented file to begin with: a machine, a hammer test, its components, a servo, or a cut.

    FILE is KIND.yaml where left out; a file that is there is never overwritten.
    """
    names = io.list_templates(kind)
    if listed or (not template and len(names) > 1):
        run.show_text(*(f"{name}: {words}" for name, words in names.items()))
        if listed:
            return
        raise ToolpointError(f"--template: missing; must be one of {', '.join(names)}")
    path = io.write_template(file or Path(f"{kind}.yaml"), kind, template)
    run.show_text(f"Written: {path}")
    run.suggest(*(words.format(path) for words in NEXT[kind]))


@command(page=False)
def check(run: Frame, file: Annotated[SourceFile, Argument()], *,
          mass: Annotated[float | None, Help("Mass of a robot (URDF) by its catalogue, kg.", above=0)] = None) -> None:
    """Check a file: all its faults at once, or what was understood of it, what it assumes and what looks odd.

    FILE is a machine (YAML), a robot (URDF), or another YAML file of toolpoint: servo, components, shaft, plan, datasheet.
    """
    if (kind := io.kind_of(file)) != "machine":
        words = io.read_kind(file, kind)
        if run.as_json:
            run.show_json({"ok": True, "kind": kind, "words": words})
        run.show_text(f"{file}: {words}; no faults")
        return
    inertias = io.read_robot(file, mass).doubts if file.suffix.lower() == ".urdf" else ()
    machine = io.read_machine(file)
    result = studies.check_machine(machine, inertias)
    if run.as_json:
        run.show_json(result.to_dict())
    run.show_text(result.table())
    run.suggest(f"report {file}")
