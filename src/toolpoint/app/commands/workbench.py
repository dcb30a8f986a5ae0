"""Commands of the workbench: serve; and what its pages do by a click: change, add."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from toolpoint import io, project, workbench
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import AnyPath, NewFile


@command(page=False, json=False)
def serve(run: Frame, folder: Annotated[AnyPath, Argument()] = Path("."), *,
          port: Annotated[int, Help("Port to listen on; that of the last time, or a free one, where left out.", minimum=0,
                                    maximum=65535)] = 0,
          host: Annotated[str, Help("Another name or address lets other machines in; nothing is encrypted.")] = "127.0.0.1",
          export: Annotated[AnyPath | None, Help("Write the workbench to this new folder instead, to be opened without a "
                                                 "server.")] = None) -> None:
    """Open a project in the browser: its chain, machine and limits, with sliders; the same calls as the commands.

    FOLDER holds project.yaml, or is where a project is to be begun. The server answers this machine alone; Ctrl-C ends it.
    """
    if export is not None:
        run.show_text(f"Workbench written: {workbench.export_workbench(folder, export)}")
        return
    workbench.serve(folder, port=port, host=host, ready=lambda address: print(f"Workbench: {address}", flush=True))
