"""Commands about tools that are joined to a spindle on paper: rcsa."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import coefficient_options, in_si, tool_options
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, POSE, QUANTITY, REPLACE, lines_of
from toolpoint.app.speeds import SPEEDS

if TYPE_CHECKING:
    import numpy as np

    from toolpoint.substructuring import PlaneReceptance

CHARTED = 60


def _schema(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        import json

        from toolpoint.io.yaml.shaft_file import json_schema

        click.echo(json.dumps(json_schema(), indent=2))
        ctx.exit()


@click.command()
@click.argument("tool", type=FILE)
@click.option("--schema", is_flag=True, is_eager=True, expose_value=False, callback=_schema,
              help="Print the JSON schema of shaft files, for editors, and end.")
@click.option("--frf", multiple=True, type=FILE, help="Measured responses: of a gauge's stations (with --gauge), or of the "
                                                      "spindle with its rotations (with --at).")
@click.option("--gauge", type=FILE, help="Shaft file of the gauge that was in the spindle, with its stations.")
@click.option("--machine", type=FILE, help="Machine file: the spindle is computed, at the point --at.")
@click.option("--at", "point", metavar="POINT", help="Point where the tool begins.")
@POSE
@click.option("--lines", callback=lines_of, metavar="LOW:HIGH:NUMBER", help="Lines (Hz) of a computed spindle; 20:6000:5981 "
              "where left out.")
@click.option("--noise", type=float, metavar="PERCENT", help="Standard deviation of measured responses, percent of each, where "
                                                             "the files state none.")
@click.option("--stick-out", metavar="SEGMENT=30mm:80mm:6", help="Also at other lengths of a segment: first, last, number.")
@click.option("--lobes", is_flag=True, help="Also stability lobes; the cut is given by the options below.")
@SPEEDS
@click.option("--draws", type=click.IntRange(20), default=200, show_default=True, help="Equally likely spindles and tools.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of the random draws.")
@QUANTITY
@tool_options
@coefficient_options
@click.option("--save", type=NEW_FILE, help="Save the tool-point responses here: universal (.uff) or HDF5 (.h5) file.")
@REPLACE
@OUTPUT
@JSON
def rcsa(tool: Path, stick_out: str | None, lobes: bool, speeds: Any, save: Path | None, output: Path, as_json: bool,
         **values: Any) -> None:
    """Receptance coupling: the tool-point response of a tool that was never measured, with its 95 % interval.

    TOOL is a shaft file: segments from the spindle to the tip. The spindle comes from a gauge that was struck in it, from
    responses with rotations, or from a machine file.
    """
    from toolpoint.io import read_shaft

    cut = {name: values.pop(name) for name in list(values) if name not in SPINDLE}
    given = [name for name, value in cut.items() if value is not None]
    if given and not lobes:
        raise click.UsageError(f"--{given[0].strip('_').replace('_', '-')} is of a cut: add --lobes")
    shaft = read_shaft(tool)

    import numpy as np

    from toolpoint.pages.cuts.tool_coupling import tool_coupling_page
    from toolpoint.studies import study_tool

    generator = np.random.default_rng(values.pop("seed"))
    lengths = None if stick_out is None else _stick_out(stick_out)
    charted = np.linspace(3000, 20000, CHARTED) if speeds is None else speeds
    with frame(output, as_json) as run, run.progress_of_parts() as progress:
        result = study_tool(_bases(values, generator), shaft, cut=in_si(cut) if lobes else None, stick_out=lengths,
                            speeds=charted, generator=generator, progress=progress)
        run.save(tool_coupling_page(result, run.warnings))
    if save is not None:
        from toolpoint.io.measured import frf_writing

        frf_writing.write(result.frf, save)
    run.show(result, result.notes, {"Responses": save})


SPINDLE = ("frf", "gauge", "machine", "point", "pose", "lines", "noise", "draws", "seed", "quantity")


def _bases(given: dict[str, Any], generator: np.random.Generator) -> list[PlaneReceptance]:
    """Read the spindle that the options name."""
    import numpy as np

    from toolpoint.app.dynamics import read_responses
    from toolpoint.app.poses import machine_at
    from toolpoint.io import read_shaft
    from toolpoint.studies import bases_from_gauge, bases_of_machine, bases_of_responses

    frf, gauge, machine, point = given["frf"], given["gauge"], given["machine"], given["point"]
    if bool(frf) == (machine is not None):
        raise ToolpointError("spindle: neither or both of --frf and --machine given; give --frf FILES --gauge GAUGE.yaml, "
                             "--frf FILES --at POINT, or --machine FILE --at POINT")
    if (gauge is None) == (point is None):
        raise ToolpointError("--gauge, --at: one of them must be there: a gauge whose stations were struck, or the point where "
                             "rotations are known")
    if machine is not None:
        if point is None:
            raise ToolpointError("--at: missing; a computed spindle needs the point where the tool begins")
        lines = np.linspace(20, 6000, 5981) if given["lines"] is None else given["lines"]
        return bases_of_machine(machine_at(machine, given["pose"]), point, lines, pose=given["pose"])
    measured = read_responses(frf, given["quantity"])
    if gauge is None:
        return bases_of_responses(measured, point, draws=given["draws"], generator=generator)
    noise = None if given["noise"] is None else given["noise"] / 100
    return bases_from_gauge(measured, read_shaft(gauge), noise=noise, draws=given["draws"], generator=generator)


def _stick_out(text: str) -> tuple[str, np.ndarray]:
    import numpy as np

    from toolpoint.io.quantities import units

    name, _, rest = text.partition("=")
    parts = rest.split(":")
    try:
        first, last, number = units.quantity(parts[0], units.LENGTH), units.quantity(parts[1], units.LENGTH), int(parts[2])
        if len(parts) != 3 or not 0 < first <= last or not 1 <= number <= 50:
            raise ValueError
    except (units.UnitError, ValueError, IndexError):
        raise ToolpointError(f"--stick-out: {text!r}; write SEGMENT=FIRST:LAST:NUMBER, for example shank=30mm:80mm:6") from None
    return name.strip(), np.linspace(first, last, number)
