"""Files of one format to another: convert."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.naming import naming_options
from toolpoint.app.options import FILE, PATH, QUANTITY

PICTURES, TABLES = ("png", "svg"), ("csv", "tex")


@click.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--to", "target", required=True, type=PATH, metavar="FILE|FOLDER",
              help="What to write: .uff, .csv, .mat, .npz or .h5; of a page a folder, with --pictures or --tables.")
@click.option("--pictures", type=click.Choice(PICTURES), help="Of a page: its charts, one file each, into the folder --to.")
@click.option("--tables", type=click.Choice(TABLES), help="Of a page: its tables, one file each, into the folder --to.")
@click.option("--replace", is_flag=True, help="Write over an existing file.")
@QUANTITY
@naming_options
def convert(files: Sequence[Path], target: Path, pictures: str | None, tables: str | None, replace: bool, quantity: str | None,
            naming: dict[str, Any]) -> None:
    """Responses, modes or time records from any format to another; charts and tables of a page.

    FILES of responses are joined: several points, set-ups, or bands of one response. A page is the index.html (or folder) that
    other commands write.
    """
    from toolpoint.app import console

    if files[0].suffix.lower() in (".html", ".htm") or files[0].is_dir():
        written = _of_page(files, target, pictures, tables)
    elif pictures or tables:
        raise ToolpointError(f"--{'pictures' if pictures else 'tables'}: of a page (.html); {files[0]} is none")
    else:
        if target.exists() and not replace:
            raise ToolpointError(f"{target}: exists already; nothing was written; choose another name, or add --replace")
        if not target.parent.is_dir():
            raise ToolpointError(f"{target}: the folder {target.parent} does not exist; create it first")
        with console.collect_warnings() as warnings:
            written = [_of_data(files, target, quantity, naming)]
        for text in warnings:
            console.warning(text)
    for line in written:
        console.text(f"Written: {line}")


def _of_page(files: Sequence[Path], folder: Path, pictures: str | None, tables: str | None) -> list[str]:
    from toolpoint.io import page_pictures, page_tables

    if len(files) > 1 or (pictures is None) == (tables is None):
        raise ToolpointError(f"{files[0]}: a page is converted alone, with --pictures png (or svg) or --tables csv (or tex)")
    if pictures is not None:
        return [str(file) for file in page_pictures.write_pictures(files[0], folder, pictures)]
    return [str(file) for file in page_tables.write_tables(files[0], folder, tables or "csv")]


def _of_data(files: Sequence[Path], target: Path, quantity: str | None, naming: dict[str, Any]) -> str:
    """Convert data; return what was written, in words."""
    from toolpoint.io.measured import frf_files, frf_writing, mode_files, noun_writing, record_files
    from toolpoint.io.measured.record_signs import holds_records

    if target.suffix.lower() not in noun_writing.KINDS:
        raise ToolpointError(f"--to {target}: the name must end in {', '.join(noun_writing.KINDS)}")
    if len(files) == 1 and mode_files.holds_modes(files[0]):
        modes = mode_files.read(files[0])
        noun_writing.write_modes(modes, target)
        return f"{target} ({modes!r})"
    if all(holds_records(file) for file in files):
        if len(files) > 1:
            raise ToolpointError(f"{files[1]}: a file of time records is converted alone; call once for each")
        record = record_files.read(files[0])
        noun_writing.write_record(record, target)
        return f"{target} ({record!r})"
    frf = frf_files.read(files, quantity=quantity, **naming)
    frf_writing.write(frf, target)
    return f"{target} ({frf!r})"
