"""Commands at the beginning: new files from templates, and what was understood of a file."""

from __future__ import annotations

import json
from pathlib import Path

import click

from toolpoint._check import ToolpointError
from toolpoint.app.options import FILE, JSON, PATH

NEXT = {"machine": ("check {0}", "report {0}", "map {0} --axis ..."), "servo": ("check {0}", "drive {0} --circle 50,4000"),
        "components": ("check {0}", "joints test.uff --geometry test.uff --components {0}"),
        "cut": ("lobes --materials",), "test": ("check {0}", "frf {0}")}


@click.command()
@click.argument("kind", type=click.Choice(list(NEXT)))
@click.argument("file", required=False, type=PATH)
@click.option("--template", default="", metavar="NAME",
              help="Which machine: three-axis-vertical, three-axis-horizontal, boring-mill, trunnion, gantry, lathe, grinder, "
                   "parallel-head, robot.")
@click.option("--list", "listed", is_flag=True, help="Show the templates of KIND.")
def new(kind: str, file: Path | None, template: str, listed: bool) -> None:
    """A commented file to begin with: a machine, a hammer test, its components, a servo, or a cut.

    FILE is KIND.yaml where left out; a file that is there is never overwritten.
    """
    from toolpoint.app import console
    from toolpoint.io.template_files import list_templates, write_template

    names = list_templates(kind)
    if listed or (not template and len(names) > 1):
        console.text("\n".join(f"{name}: {words}" for name, words in names.items()))
        if listed:
            return
        raise ToolpointError(f"--template: missing; must be one of {', '.join(names)}")
    path = write_template(file or Path(f"{kind}.yaml"), kind, template)
    console.text(f"Written: {path}")
    console.suggest(*(words.format(path) for words in NEXT[kind]))


@click.command()
@click.argument("file", type=FILE)
@click.option("--mass", type=click.FloatRange(0, min_open=True), help="Mass of a robot (URDF) by its catalogue, kg.")
@JSON
def check(file: Path, mass: float | None, as_json: bool) -> None:
    """Check a file: all its faults at once, or what was understood of it, what it assumes and what looks odd.

    FILE is a machine (YAML), a robot (URDF), or another YAML file of toolpoint: servo, components, shaft, plan, datasheet.
    """
    from toolpoint.io.yaml.file_kinds import kind_of

    kind = kind_of(file)
    if kind == "machine":
        _check_machine(file, mass, as_json)
        return
    from toolpoint.app import console
    from toolpoint.io.yaml.file_kinds import read_kind

    words = read_kind(file, kind)
    if as_json:
        click.echo(json.dumps({"ok": True, "kind": kind, "words": words}))
    else:
        console.text(f"{file}: {words}; no faults")


def _check_machine(path: Path, mass: float | None, as_json: bool) -> None:
    from toolpoint.app import console
    from toolpoint.io.yaml import machine_file

    inertias: tuple[str, ...] = ()
    if path.suffix.lower() == ".urdf":
        from toolpoint.io import urdf

        inertias = urdf.read_robot(path, mass).doubts
    built = machine_file.read(path)

    from toolpoint.studies.machines.check.machine_check import check_machine

    checked = check_machine(built, inertias)
    if as_json:
        click.echo(json.dumps(checked.to_dict()))
        return
    console.text(checked.table())
    console.suggest(f"report {path}")
