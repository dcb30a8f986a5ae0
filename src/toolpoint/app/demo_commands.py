"""The command demo: published systems by name, each with its page; `DEMOS` is the only list of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click

from toolpoint._check import one_of
from toolpoint.app.frame import frame
from toolpoint.app.options import OUTPUT

DEFAULT = "machining-centre"
CASTING, DRIVES = "three_axis_vertical.yaml", "three_axis_vertical_drives.yaml"


@dataclass(frozen=True)
class Demo:
    """A published system: one line of what it shows, and what runs it and writes its page into a folder."""

    summary: str
    run: Callable[[Path], None]


@click.command()
@click.argument("name", default=DEFAULT)
@click.option("--list", "listed", is_flag=True, help="Print the names and what they show.")
@OUTPUT
def demo(name: str, listed: bool, output: Path) -> None:
    """A published system by name (see --list): by default a machining centre with modes, tool-point responses and lobes."""
    if listed:
        width = max(map(len, DEMOS))
        click.echo("\n".join(f"{key:{width}}  {entry.summary}" for key, entry in DEMOS.items()))
        return
    DEMOS[one_of("demo", name, DEMOS)].run(output)


def run_machining_centre(output: Path) -> None:
    """Show the published three-axis machining centre, without and with its feed drives."""
    from importlib import resources

    from toolpoint.app import console
    from toolpoint.cutting import ZeroOrder
    from toolpoint.io.yaml import machine_file
    from toolpoint.pages.demo import demo_page
    from toolpoint.studies.machines.machine_report import study_machine, study_modes

    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder, frame(output, False, steps=6) as run:
        run.step("machine")
        casting = study_modes(machine_file.read(folder / CASTING))
        run.step("machine with feed drives")
        # The quickest method: nobody wants to wait for a compiler on the first page.
        drives = study_machine(machine_file.read(folder / DRIVES), step=run.step, method=ZeroOrder())
        run.step("page")
        files = [(name, (folder / name).read_text(encoding="utf-8")) for name in (CASTING, DRIVES)]
        run.save(demo_page(casting, drives, files, warnings=run.warnings))
    size, frequency = drives.machine.size, drives.frequency
    console.text(casting.table())
    console.text(f"With feed drives: {size} degrees of freedom, {frequency[0]:.2f} .. {frequency[-1]:.1f} Hz")
    console.text("\n".join(drives.limit_lines()))
    run.show_rest()


DEMOS: dict[str, Demo] = {
    DEFAULT: Demo("three-axis machining centre: modes, tool-point responses, stability lobes", run_machining_centre),
}
