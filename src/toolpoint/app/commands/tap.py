"""One shot for the shop floor: tap."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import coefficient_options, in_si, tool_options
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, OUTPUT, QUANTITY
from toolpoint.app.speeds import speeds_of


@click.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--y", "across", multiple=True, type=FILE, help="Records or responses along y; several times. As x where left "
                                                              "out.")
@click.option("--tip", metavar="POINT:DIRECTION", help="The tip along x where the files hold several driving points.")
@click.option("--channel", multiple=True, metavar="'1=force tip:+x 2.25mV/N'",
              help="What a channel of the records measures, where, its sensitivity; several times.")
@click.option("--name", metavar="PATTERN", help="Where names of files say points: Point_{input}_*.")
@click.option("--struck", metavar="POINT:DIRECTION", help="Where was struck (or measured), where the names do not say it.")
@QUANTITY
@tool_options
@coefficient_options
@click.option("--speeds", callback=speeds_of, metavar="3000:20000:200", help="Spindle speeds that the machine has, rev/min.")
@OUTPUT
@JSON
def tap(files: tuple[Path, ...], across: tuple[Path, ...], tip: str | None, channel: tuple[str, ...], name: str | None,
        struck: str | None, quantity: str | None, speeds: Any, output: Path, as_json: bool, **cut: Any) -> None:
    """From hammer blows on a tool's tip to spindle speeds to use, with a light for each step.

    FILES are the records of blows along x, the feed (any format of `toolpoint frf`), or responses of the tip (any format of
    `toolpoint identify`); --y those along y. Give the cutter (--diameter, --teeth ...) and the material (--material, or --kt
    and
    --kn).
    """
    values = in_si(cut)
    labels = {"channel": channel, "name": name, "struck": struck, "quantity": quantity}
    with frame(output, as_json) as run, run.progress_of_parts() as progress:
        x = _measured(files, labels, progress)
        y = _measured(across, labels, progress) if across else None

        import numpy as np

        from toolpoint.pages.testing.tap import tap_page
        from toolpoint.studies.testing.tap_study import study_tap

        ends = None if speeds is None else (float(speeds[0]), float(speeds[-1]))
        result = study_tap(x, y, values, tip=tip, speeds=ends, rng=np.random.default_rng(0), progress=progress)
        run.save(tap_page(result, run.warnings))
    run.show(result, result.limits.notes)


def _measured(files: Sequence[Path], labels: dict[str, Any], progress: Any) -> Any:
    """Return the hammer study of records, or the responses that files hold."""
    from toolpoint.io.measured import frf_files, record_files
    from toolpoint.io.measured.record_signs import holds_records
    from toolpoint.studies.measured.hammer_study import study_hammer_records

    kinds = {holds_records(file) for file in files}
    if len(kinds) > 1:
        raise ToolpointError(f"{', '.join(file.name for file in files[:4])}: some hold time records and some responses; must "
                             "be one "
                             "kind")
    progress("reading", 0, 1)
    if kinds == {True}:
        records = record_files.read_all(files, labels["channel"], struck=labels["struck"], pattern=labels["name"])
        return study_hammer_records(records)
    return frf_files.read(files, quantity=labels["quantity"], pattern=labels["name"], struck=labels["struck"])
