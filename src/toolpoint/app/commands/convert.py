"""Files of one format to another: convert."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Help, command, list_given
from toolpoint.app.frame import Frame
from toolpoint.app.options import Files, Naming, Quantity
from toolpoint.app.values import AnyPath


@command(page=False, json=False)
def convert(run: Frame, files: Files, *, target: Annotated[AnyPath, Help("What to write: .uff, .csv, .mat, .npz or .h5; of a "
                                                                         "page a folder, with --pictures or --tables.",
                                                                         name="--to", metavar="FILE|FOLDER")],
            pictures: Annotated[Literal["png", "svg"] | None, Help("Of a page: its charts, one file each, into the folder "
                                                                   "--to.")] = None,
            tables: Annotated[Literal["csv", "tex"] | None, Help("Of a page: its tables, one file each, into the folder "
                                                                 "--to.")] = None,
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
    if len(files) > 1 or (pictures is None) == (tables is None):
        raise ToolpointError(f"{files[0]}: a page is converted alone, with --pictures png (or svg) or --tables csv (or tex)")
    if pictures is not None:
        return io.write_pictures(files[0], folder, pictures)
    return io.write_tables(files[0], folder, tables or "csv")
