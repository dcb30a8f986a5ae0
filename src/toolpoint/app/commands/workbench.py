"""Commands of the workbench: serve; and what its pages do by a click: change, add."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from toolpoint import io, project, workbench
from toolpoint._check import ToolpointError
from toolpoint._doubt import mark_notes
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import AnyPath, NewFile


@command(page=False, json=False)
def serve(run: Frame, folder: Annotated[AnyPath, Argument()] = Path("."), *,
          port: Annotated[int, Help("Port to listen on; that of the last time, or a free one, where left out.", minimum=0,
                                    maximum=65535)] = 0,
          host: Annotated[str, Help("Another name or address lets other machines in; nothing is encrypted.")] = "127.0.0.1",
          records: Annotated[tuple[AnyPath, ...], Help("Folder of a measuring program, beside the project, from which blows "
                                                       "may be recorded; several times.", metavar="FOLDER")] = (),
          export: Annotated[AnyPath | None, Help("Write the workbench to this new folder instead, to be opened without a "
                                                 "server.")] = None) -> None:
    """Open a project in the browser: its chain, machine and limits, with sliders; the same calls as the commands.

    FOLDER holds project.yaml, or is where a project is to be begun. The server answers this machine alone; Ctrl-C ends it.
    """
    if export is not None:
        run.show_text(f"Workbench written: {workbench.export_workbench(folder, export)}")
        return
    workbench.serve(folder, port=port, host=host, records=records,
                    ready=lambda address: print(f"Workbench: {address}", flush=True))


@command("add", page=False, json=False)
def add_parts(run: Frame, folder: Annotated[AnyPath, Argument()], files: Annotated[tuple[Path, ...], Argument()] = (), *,
              kind: Annotated[tuple[str, ...], Help("What a file is, where its content does not say it; several times.",
                                                    metavar="FILE=KIND")] = (),
              part: Annotated[tuple[str, ...], Help("A part of project.yaml; several times.",
                                                    metavar="'goals.rough: {speed: 8000 rpm, depth: 3 mm}'")] = (),
              choice: Annotated[tuple[str, ...], Help("Poles chosen by hand for a test, as the page of its modes writes "
                                                      "them; it replaces another.", metavar="TEST=FILE")] = ()) -> None:
    """Add files to a project, each where it belongs and entered in project.yaml, and parts: cuts, goals, changes.

    Files are copied; what each is, is told by its content. Nothing is overwritten.
    """
    kinds = dict(_pair(text, "=", "--kind") for text in kind)
    entered = project.add_files(folder, files, kinds) if files else None
    named = [line for text in part for line in project.add_part(folder, *_pair(text, ":", "--part"))]
    chosen = [project.Project.open(folder).choose_poles(test, Path(file).read_text(encoding="utf-8"))
              for test, file in (_pair(text, "=", "--choice") for text in choice)]
    lines = [f"Added: {place}" for place in (() if entered is None else entered.places)]
    lines += [f"Entered: {place}: {value}" for place, value in (() if entered is None else entered.parts)]
    doubts = () if entered is None else entered.doubts
    lines += [f"Poles chosen by hand: {place}" for place in chosen]
    run.show_text(*mark_notes(doubts), *lines, *(f"Entered: {text}" for text in part),
                  *(f"Entered, as it meant the only cut so far: {line}" for line in named))
    run.suggest(f"run {folder}")


@command("change", page=False, json=False, replace=True)
def change_numbers(run: Frame, machine: Annotated[Path, Argument()], numbers: Annotated[tuple[str, ...], Argument()], *,
                   written: Annotated[NewFile, Help("Machine file to write.", name="-o --output")]) -> None:
    """Change numbers of a machine file by hand, NUMBERS like joints.guide.stiffness.x=4e8 in SI, and write another file.

    The joints are marked as chosen, the numbers leave the covariance of the identified ones, and the file carries a doubt that
    names them.
    """
    built = io.read_machine(machine)
    values = {}
    for text in numbers:
        path, value = _pair(text, "=", "NUMBERS")
        try:
            values[path] = float(value)
        except ValueError:
            raise ToolpointError(f"{path}: {value!r} is not a number; write it in SI, without its unit") from None
    changed = project.change_machine(built, values)
    if run.write("Machine", written, io.write_machine, changed.description):
        run.suggest(f"modes {written}", f"compare {machine} {written}")
    run.show_rest()


def _pair(text: str, sign: str, option: str) -> tuple[str, str]:
    """Return what stands before and behind a sign; a text without it is refused."""
    name, separator, value = text.partition(sign)
    if not separator:
        raise ToolpointError(f"{option}: {text!r}; must be a name, {sign!r} and a value")
    return name.strip(), value.strip()
