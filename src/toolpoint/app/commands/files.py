"""Commands about files and the program itself: new, samples, check, convert, schema, doctor, completion."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import click

from toolpoint import io, project, studies
from toolpoint import samples as sample_kinds
from toolpoint._check import ToolpointError
from toolpoint._doubt import mark_notes
from toolpoint.app.declare import Argument, Help, command, list_given
from toolpoint.app.frame import Frame
from toolpoint.app.options import Files, Naming, Quantity
from toolpoint.app.values import AnyPath, SourceFile

# What a person does with a new file, in order; {0} stands for its name.
NEXT_COMMANDS = {"machine": ("check {0}", "report {0}", "map {0} --axis ..."),
                 "servo": ("check {0}", "drive {0} --circle 50,4000"),
                 "components": ("check {0}", "joints test.uff --geometry test.uff --components {0}"),
                 "cut": ("lobes --materials",), "test": ("check {0}", "frf {0}"),
                 "shaft": ("check {0}", "rcsa {0} --frf gauge.uff --gauge GAUGE.yaml"), "plan": ("check {0}", "screen {0}"),
                 "project": ("run {0}",)}


@command(page=False, json=False)
def new(run: Frame, kind: Annotated[Literal["machine", "servo", "components", "cut", "test", "shaft", "plan", "project"],
                              Argument()],
        file: Annotated[AnyPath | None, Argument()] = None, *,
        template: Annotated[str, Help("Which machine: three-axis-vertical, three-axis-horizontal, boring-mill, trunnion, "
                                      "gantry, lathe, grinder, parallel-head, robot.", metavar="NAME")] = "",
        listed: Annotated[bool, Help("Show the templates of KIND.", name="--list")] = False) -> None:
    """A commented file to begin with: a machine, a hammer test, its components, a servo, a cut, a tool from its drawing
    (shaft), a plan of changes; or the folder of a project.

    FILE is KIND.yaml where left out, of a project the folder (my_project); what is there is never overwritten.
    """
    names = io.list_templates(kind)
    if listed or (not template and len(names) > 1):
        run.show_text(*(f"{name}: {words}" for name, words in names.items()))
        if listed:
            return
        # A machine of no kind in particular would be edited into nonsense: the list is shown, and the choice left to the
        # person.
        raise ToolpointError(f"--template: missing; must be one of {', '.join(names)}")
    if kind == "project":
        place = file or Path("my_project")
        path = project.write_folder(place)
    else:
        place = path = io.write_template(file or Path(f"{kind}.yaml"), kind, template)
    run.show_text(f"Written: {path}")
    run.suggest(*(words.format(place) for words in NEXT_COMMANDS[kind]))


@command(page=False)
def samples(run: Frame, kind: Annotated[str, Argument()] = "", folder: Annotated[AnyPath | None, Argument()] = None, *,
            listed: Annotated[bool, Help("Show the kinds.", name="--list")] = False) -> None:
    """Small virtual measurements to try everything on, with the faults of real ones, and the commands that run on them.

    FOLDER is samples-KIND where left out; nothing is overwritten.
    """
    if listed or not kind:
        width = max(map(len, sample_kinds.KINDS))
        run.show_text(*(f"{name:{width}}  {words}" for name, words in sample_kinds.KINDS.items()))
        run.suggest("samples KIND")
        return
    result = sample_kinds.write_samples(kind, folder)
    if run.as_json:
        run.show_json(result.to_dict())
    run.show_text(f"Written: {result.folder} ({len(result.files)} files)", *result.truth)
    run.show_text("Next, there:", *(f"  {command}" for command in result.commands))


@command(page=False)
def check(run: Frame, file: Annotated[SourceFile, Argument()], *,
          mass: Annotated[float | None, Help("Mass of a robot (URDF) by its catalogue, kg.", above=0)] = None) -> None:
    """Check a file: all its faults at once, or what was understood of it, what it assumes and what looks odd.

    FILE is a machine (YAML), a robot (URDF), or another YAML file of toolpoint: servo, components, cut, shaft, plan, datasheet.
    """
    if (kind := io.kind_of(file)) != "machine":
        words, part = io.read_kind(file, kind)
        odd = studies.question_part(part)
        if run.as_json:
            run.show_json({"ok": True, "kind": kind, "words": words, "doubts": list(odd)})
        run.show_text(*mark_notes(odd), f"{file}: {words}; no faults")
        return
    inertias = io.read_robot(file, mass).doubts if file.suffix.lower() == ".urdf" else ()
    machine = io.read_machine(file)
    result = studies.check_machine(machine, inertias)
    if run.as_json:
        run.show_json(result.to_dict())
    run.show_text(result.table())
    run.suggest(f"report {file}")


@command(page=False, json=False)
def convert(run: Frame, files: Files, *, target: Annotated[AnyPath, Help(
        "What to write: .uff, .csv, .mat, .npz or .h5; of a page a folder, with --pictures or --tables.", name="--to",
        metavar="FILE|FOLDER")],
            pictures: Annotated[Literal["png", "svg"] | None, Help("Of a page: its charts, one file each, into --to.")] = None,
            tables: Annotated[Literal["csv", "tex"] | None, Help("Of a page: its tables, one file each, into --to.")] = None,
            replace: Annotated[bool, Help("Write over an existing file.")] = False, quantity: Quantity = None,
            naming: Naming) -> None:
    """Responses, modes or time records from any format to another; charts and tables of a page.

    FILES of responses are joined: several points, set-ups, or bands of one response. A page is the index.html (or folder) that
    other commands write.
    """
    if files[0].suffix.lower() in (".html", ".htm") or files[0].is_dir():
        run.show_text(*(f"Written: {file}" for file in _convert_page(files, target, pictures, tables)))
    elif of_page := list_given("pictures", "tables"):
        raise ToolpointError(f"{of_page[0]}: of a page (.html); {files[0]} is none")
    else:
        io.check_noun_name(target, replace=replace)
        noun = io.read_measured(files, quantity=quantity, **naming.keywords)
        io.write_noun(noun, target)
        run.show_text(f"Written: {target} ({noun!r})")
    run.show_rest()


def _convert_page(files: Sequence[Path], folder: Path, pictures: str | None, tables: str | None) -> list[Path]:
    """Return the files written of a page: its charts as pictures, or its tables."""
    if len(files) > 1 or (pictures is None) == (tables is None):
        raise ToolpointError(f"{files[0]}: a page is converted alone, with --pictures png (or svg) or --tables csv (or tex)")
    return io.write_pictures(files[0], folder, pictures) if pictures else io.write_tables(files[0], folder, tables or "csv")


@command()
def schema(kind: Annotated[str, Argument()] = "machine") -> None:
    """The JSON schema of a KIND of file, for editors that check YAML while it is typed.

    KIND is machine (the default), servo, choice (of `identify --choice`), components, test, shaft, plan, datasheet or project.
    """
    click.echo(json.dumps(io.json_schema(kind), indent=2))


@command(page=False)
def doctor(run: Frame, *, compile: Annotated[bool, Help("Compile all kernels now, on all cores.")] = False,
           cite: Annotated[bool, Help("What to cite in a paper, as a sentence and as BibTeX.")] = False) -> None:
    """Versions, threads, caches, extras and the browser: what is there, what is missing, and what to do about it."""
    if cite:
        run.show(studies.cite_package())
        return
    if compile:
        from toolpoint.kernel_compilation import compile_kernels

        result: Any = compile_kernels(studies.core_count(), progress=run.progress_of_parts())
    else:
        result = studies.examine_environment()
    run.show(result)
    # Scripts ask the exit code: what is missing must not look like success.
    if not result.is_whole:
        raise SystemExit(1)


@command()
def completion(shell: Annotated[Literal["bash", "zsh", "fish"], Argument()]) -> None:
    """Print what makes SHELL complete commands, options and files: eval "$(toolpoint completion bash)" in its start-up file."""
    from click.shell_completion import get_completion_class

    from toolpoint.app.main import cli

    complete = get_completion_class(shell)
    assert complete is not None
    click.echo(complete(cli, {}, "toolpoint", "_TOOLPOINT_COMPLETE").source())
