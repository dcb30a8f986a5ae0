"""The page of commands: what each says of itself, with all its options."""

from __future__ import annotations

from pathlib import Path

import click

from toolpoint.app.main import MODULE_OF_COMMAND, cli


def write_commands(folder: Path) -> None:
    """Write the help of every command."""
    lines = ["# Commands", "",
             "`toolpoint COMMAND --help` says the same. Lengths and angles of options carry units: `200mm`, `30deg`.", ""]
    for name in sorted(MODULE_OF_COMMAND):
        context = click.Context(cli, info_name="toolpoint")
        command = cli.get_command(context, name)
        assert command is not None
        inner = click.Context(command, info_name=name, parent=context, max_content_width=110, terminal_width=110)
        text = command.get_help(inner)
        lines += [f"## {name}", "", "```text", text, "```", ""]
    (folder / "commands.md").write_text("\n".join(lines), encoding="utf-8")
