"""Choice files in YAML: poles that a person adds to an identification and modes that go; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION
from toolpoint.modal_identification import PoleChoice


@door("choice file")
def read(path: str | Path) -> PoleChoice:
    r"""Return the choice of a YAML file; raises FileFaults with every fault of the file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "choice.yaml")
    ...     _ = file.write_text("toolpoint: 1\nremove: [87.5 Hz]\n")
    ...     read(file).remove
    (87.5,)
    """
    return read_described(Path(path), PoleChoice, FILE_VERSION, find_faults=_find_faults,
                          place_error=lambda error: ((error.argument,), str(error)))


def _find_faults(choice: PoleChoice) -> list[tuple[tuple[str, ...], str]]:
    return [((), "neither 'add' nor 'remove': the file changes nothing")] if choice.is_empty else []


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of choice files, for editors that check YAML while it is typed."""
    return file_schema(model_of(PoleChoice, version=True), "toolpoint choice file")


def text_of(choice: PoleChoice) -> str:
    """Return a choice as the text of its file."""
    lines = [f"toolpoint: {FILE_VERSION}"]
    if choice.add:
        lines += ["add:"] + [f"  - {{frequency: {pole.frequency:.6g} Hz, damping_ratio: {pole.damping_ratio:.6g}}}"
                             for pole in choice.add]
    if choice.remove:
        lines += ["remove:", *(f"  - {f:.6g} Hz" for f in choice.remove)]
    return "\n".join(lines) + "\n"
