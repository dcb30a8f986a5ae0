"""Kinds of samples by name, and how they are written: into a folder of their own, never over anything."""

from __future__ import annotations

import importlib
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError, one_of
from toolpoint._notebook import NotebookText

# Name of every kind with what it is for; each is written by the module of its name.
KINDS = {
    "tap": "six blows on a tool tip along x and six along y, two of them bad: to depth limits",
    "hammer-test": "blows on a machine at 30 points, with geometry and components: to modes, joints and a machine file",
    "rcsa": "a gauge struck in a spindle, and a tool that was never measured: to its response by receptance coupling",
    "cut": "the sound of a cut that chatters, with a pump beside it: to its frequency and a better speed",
    "work": "ten minutes of a machine at work, no force measured, a motor's line among the modes: to modes",
    "drift": "a baseline, two later tests and the machine file: to the joint that loosened",
    "servo": "a controller's record of an axis: to friction and the gain of its position loop",
    "video": "a film of a head on a column after a blow, the camera shaking: to modes without a sensor",
    "program": "an NC program, a servo and a machine: to contour errors, and to the load and stability of every block",
    "robot": "the datasheet of a milling robot: to its machine file",
}
READ_ME = "README.txt"


@dataclass(frozen=True)
class SampleSet(NotebookText):
    """Files of a kind in a folder.

    kind; folder; files : names in the folder; truth : what was put in, in sentences; commands : that run on the files as they
    stand, in the folder.

    >>> import tempfile
    >>> from toolpoint.samples import write_samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     servo = write_samples("servo", Path(folder, "servo"))
    >>> servo.kind, "trace.csv" in servo.files
    ('servo', True)
    """

    kind: str
    folder: Path
    files: tuple[str, ...]
    truth: tuple[str, ...]
    commands: tuple[str, ...]

    def table(self) -> str:
        """Return the text of the read-me file: what was put in, the files, and the commands to type."""
        return "\n".join([
            f"Sample files of toolpoint: {KINDS[self.kind]}.", "Virtual: nothing here was measured. What was put in:",
            *(f"- {sentence}" for sentence in self.truth), "", "Files:", *(f"- {name}" for name in self.files), "",
            "To type in this folder:", *(f"  {command}" for command in self.commands)])

    def to_dict(self) -> dict[str, Any]:
        """Return kind, folder, files, what was put in, and the commands as plain data."""
        return {"kind": self.kind, "folder": str(self.folder), "files": list(self.files), "truth": list(self.truth),
                "commands": list(self.commands)}

    def __repr__(self) -> str:
        return f"SampleSet({self.kind}, {len(self.files)} files in {self.folder})"


def write_samples(kind: str, folder: str | Path | None = None) -> SampleSet:
    """Write the files of a kind into a new folder, and return what they are.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    folder : path, optional
        Must not exist, or be empty; ``samples-KIND`` where left out.

    Raises
    ------
    ToolpointError
        For an unknown kind, and a folder with something in it: nothing is overwritten.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_samples("program", folder).files
    ('mill.yaml', 'part.nc', 'project.yaml', 'servo.yaml', 'README.txt')
    """
    one_of("samples", kind, KINDS)
    target = Path(folder if folder is not None else f"samples-{kind}")
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise ToolpointError(f"{target}: is there already and not empty; nothing is overwritten: name another folder")
    module = importlib.import_module(f"toolpoint.samples.{kind.replace('-', '_')}")
    with tempfile.TemporaryDirectory() as draft:
        truth, commands = module.write(Path(draft))
        names = (*sorted(str(path.relative_to(draft)) for path in Path(draft).rglob("*") if path.is_file()), READ_ME)
        result = SampleSet(kind, target, names, tuple(truth), tuple(commands))
        (Path(draft) / READ_ME).write_text(result.table() + "\n", encoding="utf-8")
        # The folder appears whole: an interrupt leaves none behind that looks finished.
        shutil.copytree(draft, target, dirs_exist_ok=True)
    return result
