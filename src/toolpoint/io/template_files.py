"""Files to begin with: machines of the common kinds, servos, components, cuts; written where nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

from toolpoint._check import ToolpointError, one_of

FOLDER = Path(__file__).parent / "templates"


def list_templates(kind: str = "machine") -> dict[str, str]:
    """Return the templates of a kind of file (machine, servo, components, cut) by name, each with its first sentence.

    Raises ToolpointError for a kind that has none.

    >>> "lathe" in list_templates("machine")
    True
    """
    kinds = sorted({path.stem for path in FOLDER.glob("*.yaml")} | {path.name for path in FOLDER.iterdir() if path.is_dir()})
    one_of("kind", kind, kinds)
    files = sorted((FOLDER / kind).glob("*.yaml")) or [FOLDER / f"{kind}.yaml"]
    return {path.stem: path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ") for path in files}


def read_template(kind: str = "machine", name: str = "") -> str:
    """Return the text of a template; of a kind that has only one, the name may be left out.

    Raises ToolpointError for a name that is not there, with the names that are.
    """
    names = list_templates(kind)
    chosen = one_of("template", name or (next(iter(names)) if len(names) == 1 else ""), names)
    folder = FOLDER / kind if (FOLDER / kind).is_dir() else FOLDER
    return (folder / f"{chosen}.yaml").read_text(encoding="utf-8")


def write_template(path: str | Path, kind: str = "machine", name: str = "") -> Path:
    """Write a template to a file that is not there yet, and return its path.

    Raises ToolpointError for a file that exists (nothing is overwritten), a folder that does not, and an unknown template.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_template(Path(folder, "mill.yaml"), "machine", "lathe").name
    'mill.yaml'
    """
    text, target = read_template(kind, name), Path(path)
    if not target.parent.is_dir():
        raise ToolpointError(f"{target}: the folder {target.parent} does not exist; create it first")
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ToolpointError(f"{target}: is there already; nothing is overwritten: name another file, or move this one away"
                             ) from None
    return target
