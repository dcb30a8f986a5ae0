"""Parts entered into a project: files told by their content and put in their place, parts written into project.yaml."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint import io
from toolpoint._check import ToolpointError, fail, one_of
from toolpoint._doubt import Doubt
from toolpoint.io.suffixes import YAML
from toolpoint.machine.description.project_plan import ProjectTest
from toolpoint.project.engine.content import file_digest
from toolpoint.project.engine.drafts import write_whole
from toolpoint.project.folder import PROJECT_FILE
from toolpoint.project.recorded_tests import find_records
from toolpoint.project.records_draft import RECORDS_FOLDER, RecordsDraft, draft_test, files_of

# Kind of a file, the folder where it belongs, and what it is in words.
FILE_KINDS = {
    "test": ("records", "test file of a hammer test: what its channels measure"),
    "records": (RECORDS_FOLDER, "records in time; those that are no universal files need their channels said"),
    "responses": ("responses", "frequency responses"),
    "modes": ("responses", "modes"),
    "geometry": ("", "places of the measured points"),
    "components": ("", "components: which point is on which part, masses"),
    "machine": ("", "machine file"),
    "servo": ("", "servo: drives and controller"),
    "program": ("programs", "NC program"),
    "other": ("", "a file that no step takes"),
}
SNIFFED_BYTES = 8192  # of the beginning of a file, by which its kind is guessed
_SINGLE_FILES = ("machine", "components", "geometry", "servo")  # of which project.yaml names one
_YAML_KINDS = {"test", "components", "servo", "machine"}
_RECORD_SUFFIXES = (".wav", ".tdms", ".lvm")
_PROGRAM_SUFFIXES = (".nc", ".ngc", ".mpf", ".h", ".gcode", ".tap")
_UNIVERSAL_HEADERS = ("151", "164")  # sets of a universal file that hold no data: its title, its units
_UNIVERSAL_SUFFIXES = (".uff", ".unv", ".ufb", ".58")


@dataclass(frozen=True)
class FileGuess:
    """Guess of what a file is: a kind of `FILE_KINDS`, in words, and whether its content says so beyond doubt."""

    file: Path
    kind: str
    words: str
    is_sure: bool


@dataclass(frozen=True)
class EnteredFiles:
    """Files that were put in a project: their places, and the parts that were written into project.yaml (place, value).

    doubts : files that cannot be read as what they are taken for, or that no step takes; entries that stood there before.
    """

    places: tuple[str, ...]
    parts: tuple[tuple[str, str], ...]
    doubts: tuple[Doubt, ...] = ()


def guess_kind(file: Path) -> FileGuess:
    r"""Return what a file seems to be, by its ending and the beginning of its content.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "part.nc")
    ...     _ = file.write_text("G0 X0 Y0\nG1 X30 F600\n")
    ...     guess_kind(file).kind
    'program'
    """
    kind, is_sure = _kind_of(file)
    return FileGuess(file, kind, FILE_KINDS[kind][1], is_sure)


def _kind_of(file: Path) -> tuple[str, bool]:
    suffix = file.suffix.lower()
    if suffix in (".yaml", ".yml"):
        try:
            kind = io.kind_of(file)
        except (ToolpointError, OSError):
            return "other", False
        return (kind, True) if kind in _YAML_KINDS else ("other", False)
    if suffix == ".urdf":
        return "machine", True
    if suffix in _RECORD_SUFFIXES:
        return "records", True
    if suffix in _PROGRAM_SUFFIXES:
        return "program", True
    try:
        with file.open("rb") as handle:
            beginning = handle.read(SNIFFED_BYTES)
    except OSError:
        return "other", False
    if suffix in _UNIVERSAL_SUFFIXES:
        return _universal_kind(beginning)
    if suffix in (".h5", ".hdf5", ".mat", ".npz", ".npy"):
        return _arrays_kind(file)
    return _table_kind(beginning.decode("utf-8", "replace"))


def _arrays_kind(file: Path) -> tuple[str, bool]:
    """Return what a file of arrays holds: records where it has a time or a sample rate, else modes or responses by its name."""
    try:
        if io.hold_records([file]):
            return "records", True
    except (ToolpointError, OSError):
        pass  # what cannot be read is told by the step that reads it
    return ("modes" if "mode" in file.stem.lower() else "responses"), False


def _universal_kind(beginning: bytes) -> tuple[str, bool]:
    """Return what a universal file holds by its first set of data: 2411 and 15 points, 55 modes, 58 records or responses."""
    text = beginning.decode("latin-1")
    sets = [entry for entry in re.finditer(r"^ +-1\s*\n +(\d+)", text, re.MULTILINE) if entry[1] not in _UNIVERSAL_HEADERS]
    first = sets[0][1] if sets else ""
    if first in ("2411", "15", "781", "2412"):
        return "geometry", True
    if first == "55":
        return "modes", True
    # Five lines of text follow the number of set 58; then field 1 says what it is: 1 a time response, 4 a response function.
    kinds = [line[:5].strip() for line in text[sets[0].end():].splitlines()[6:7]] if first == "58" else []
    return ("records", True) if kinds == ["1"] else ("responses", kinds == ["4"])


def _table_kind(text: str) -> tuple[str, bool]:
    """Return what a text table holds by its head: points, a time in its first column, else responses."""
    head = text.lower().splitlines()[:30]
    if any(re.match(r'[^,;\t]*[,;\t]\s*"?x\b[^,;\t]*[,;\t]\s*"?y\b[^,;\t]*[,;\t]\s*"?z\b', line) for line in head):
        return "geometry", True
    if any(re.match(r'\s*"?(time|t\b|seconds|zeit)', line) for line in head):
        return "records", True
    if any(re.match(r'[#%\s"]*(freq|f\b|hz)', line) for line in head):
        return "responses", True
    return ("responses", False) if any(re.match(r"\s*[-+\d.]", line) for line in head) else ("other", False)


def add_files(folder: str | Path, files: Sequence[str | Path], kinds: Mapping[str, str] | None = None, *, move: bool = False
              ) -> EnteredFiles:
    r"""Put files into a project where they belong, and enter them in project.yaml.

    Parameters
    ----------
    folder : of the project
    files : to be copied; those that lie in the project's own folder of their kind stay there
    kinds : of files by name (`FILE_KINDS`), in place of those that their content says
    move : bool
        Whether the files are moved, not copied.

    Raises ToolpointError where a file of the name is there with another content: nothing is overwritten.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     project, file = write_folder(Path(folder, "mill")), Path(folder, "part.nc")
    ...     _ = file.write_text("G0 X0 Y0\nG1 X30 F600\n")
    ...     add_files(project.parent, [file]).places
    ('programs/part.nc',)
    """
    root, placed = Path(folder), list[tuple[str, str]]()
    _check_project(root)
    chosen = dict(kinds or {})
    planned = []
    for file in map(Path, files):
        kind = one_of("kind", chosen.get(file.name) or guess_kind(file).kind, FILE_KINDS)
        target = root / FILE_KINDS[kind][0] / file.name
        if target.exists() and target.resolve() != file.resolve() and file_digest(target) != file_digest(file):
            raise ToolpointError(f"{target.relative_to(root)}: is there already with another content; nothing was written: "
                                 "rename one of the two")
        planned.append((file, kind, target))
    doubts = [doubt for file, kind, _ in planned for doubt in _question_file(file, kind)]
    for file, kind, target in planned:
        _place(file, target, move=move)
        placed.append((kind, target.relative_to(root).as_posix()))
    parts = _parts_of(placed)
    parts, merged = _merge_tests(root, parts)
    doubts += [*_question_entries(root, parts), *merged]
    for place, value in parts:
        add_part(root, place, value)
    doubts += _question_records(root, placed)
    return EnteredFiles(tuple(place for _, place in placed), tuple(parts), tuple(doubts))


def _question_file(file: Path, kind: str) -> list[Doubt]:
    """Return a doubt about a file that cannot be read as its kind, or that no step takes; it is entered all the same."""
    if kind == "other":
        return [Doubt(file.name, "no step takes it: its content does not say what it is", "say it by `kind`, or take it away")]
    if kind not in _YAML_KINDS or file.suffix.lower() not in YAML:
        return []
    try:
        if kind == "machine":
            io.read_machine(file)
        else:
            io.read_kind(file, kind)
    except (ToolpointError, OSError) as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        # Of several faults the first line says their number alone.
        fault = lines[1] if len(lines) > 1 and lines[0].endswith("faults") else lines[0]
        return [Doubt(file.name, f"cannot be read as a {kind} file: {fault.removeprefix(str(file)).lstrip(': ')}",
                      "toolpoint check says all its faults; a run stops at it")]
    return []


def _question_records(root: Path, placed: Sequence[tuple[str, str]]) -> list[Doubt]:
    """Return a doubt about records that no test names, with the entry that their names and columns propose."""
    draft = draft_test(root) if any(kind == "records" for kind, _ in placed) else None
    if draft is None:
        return []
    return [Doubt(", ".join(draft.records), "belong to no test yet: they do not say what their channels measure",
                  f"say it: toolpoint add {root} --part 'tests.{draft.name}: {draft.value}'")]


def _question_entries(root: Path, parts: Sequence[tuple[str, str]]) -> list[Doubt]:
    """Return a doubt about every file that project.yaml named so far in the place of a new one."""
    described = io.read_project(root / PROJECT_FILE)
    doubts = []
    for place, value in parts:
        named = getattr(described, place, None) if place in _SINGLE_FILES else None
        if named and Path(named).name != Path(value).name:
            doubts.append(Doubt(place, f"{named} was entered before, {value} takes its place",
                                f"enter {place}: {named} again to go back, its file stays"))
    return doubts


def _merge_tests(root: Path, parts: Sequence[tuple[str, str]]) -> tuple[list[tuple[str, str]], list[Doubt]]:
    """Return the parts without a second test of the same records: a test file takes the place of records entered before it."""
    tests = io.read_project(root / PROJECT_FILE).tests
    named = set().union(*(_records_of(root, test) for test in tests.values() if test.test))
    earlier = {name: records for name, test in tests.items() if test == ProjectTest(records=test.records)
               and (records := _records_of(root, test))}
    kept, doubts = list[tuple[str, str]](), list[Doubt]()
    for place, value in parts:
        is_records = value.startswith("{records: ")
        if is_records and set(value.removeprefix("{records: [").removesuffix("]}").split(", ")) <= named:
            continue
        file = value.removeprefix("{test: ").removesuffix("}") if value.startswith("{test: ") else ""
        files = _records_of(root, ProjectTest(test=file)) if file else set[str]()
        name = next((name for name, records in earlier.items() if records <= files), "")
        if name:
            doubts.append(Doubt(f"tests.{name}", f"its records were entered before {file}, which names them: the test file "
                                "takes their place, they are one test", "look at what it says of their channels"))
        kept.append((f"tests.{name}" if name else place, value))
    return kept, doubts


def _records_of(root: Path, test: ProjectTest) -> set[str]:
    """Return the records of a test; none where its file or pattern cannot be read, which its run says."""
    try:
        return set(find_records(root, "", test))
    except (ToolpointError, OSError):
        return set()


def _place(file: Path, target: Path, *, move: bool) -> None:
    """Copy or move a file to its place, whole at any moment."""
    if target.exists() and target.resolve() == file.resolve():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    if move:
        os.replace(file, target)
        return
    draft = target.with_name(f".{target.name}.draft")
    shutil.copyfile(file, draft)
    os.replace(draft, target)


def _parts_of(placed: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the parts of project.yaml that placed files make.

    Records belong to their test file; those of universal files, which say what each channel is, make a test without one.
    """
    parts = [(kind, place) for kind, place in placed if kind in _SINGLE_FILES]
    for kind in ("test", "modes"):
        parts += [(f"tests.{_stem(place)}", f"{{{kind}: {place}}}") for file_kind, place in placed if file_kind == kind]
    has_test_file = any(kind == "test" for kind, _ in placed)
    for source in ("responses", "records"):
        places = [place for kind, place in placed if kind == source
                  and (source == "responses" or (not has_test_file and Path(place).suffix.lower() in _UNIVERSAL_SUFFIXES))]
        if places:
            name = _stem(places[0]) if len(places) == 1 else "structure"
            parts.append((f"tests.{name}", f"{{{source}: [{', '.join(places)}]}}"))
    return parts


def _stem(place: str) -> str:
    return re.sub(r"[^\w -]+", " ", Path(place).stem).strip() or "structure"


def enter_test(folder: str | Path, draft: RecordsDraft) -> str:
    """Enter a test of records in project.yaml, and return its entry; all its records are read before.

    Raises ToolpointError, and writes nothing, where a record, a channel or the pattern has a fault.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     root = write_folder(Path(folder, "mill")).parent
    ...     _ = (root / "records/blows.csv").write_text("time [s],hammer [N],acc [m/s^2]\\n0,0,0\\n0.001,5,2\\n")
    ...     enter_test(root, draft_test(root))
    'tests.structure: {records: ["records/blows.csv"], channels: ["1=force 1:+x", "2=acceleration 1:+x"]}'
    """
    root = Path(folder)
    files = [file for text in draft.records for file in files_of(root, text)]
    outside = [file for file in files if not file.resolve().is_relative_to(root.resolve())]
    if outside or not files:
        fail("records", ", ".join(draft.records) or "none", "must be files in the project's folder",
             remedy="hand them over first")
    io.read_described_records(files, draft.channels, struck=draft.struck or None, pattern=draft.pattern or None)
    add_part(root, f"tests.{draft.name}", draft.value)
    return f"tests.{draft.name}: {draft.value}"


def add_part(folder: str | Path, place: str, value: str) -> tuple[str, ...]:
    """Write a part into project.yaml: ``goals.rough`` and ``{speed: 8000 rpm, depth: 3 mm}``; the whole file is checked first.

    Beside a second cut, goals and programs that name none get the name of the first, which is theirs so far; what was so
    named is returned.

    Raises ToolpointError, and writes nothing, where the project file would have a fault with it.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     project = write_folder(Path(folder, "mill"))
    ...     cut = "{diameter: 12 mm, teeth: 2, direction: slot, tangential: 2 GPa, normal: 1 GPa}"
    ...     _ = add_part(project.parent, "cuts.steel", cut)
    ...     _ = add_part(project.parent, "goals.rough", "{speed: 8000 rpm, depth: 3 mm}")
    ...     "rough: {speed: 8000 rpm, depth: 3 mm}" in project.read_text()
    True
    """
    root = Path(folder)
    _check_project(root)
    file = root / PROJECT_FILE
    text = io.enter_part(file.read_text(encoding="utf-8"), place, value)
    named_parts = _parts_without_cut(file, place)
    for part, cut in named_parts.items():
        text = io.name_cut(text, part, cut)
    draft = root / f".{PROJECT_FILE}.draft"
    try:
        draft.write_text(text, encoding="utf-8")
        io.read_project(draft)
    except ToolpointError as error:
        raise ToolpointError(f"{place}: not entered\n{str(error).replace(str(draft), str(file))}") from None
    finally:
        draft.unlink(missing_ok=True)
    write_whole(file, text)
    return tuple(f"{part}: cut: {cut}" for part, cut in named_parts.items())


def _parts_without_cut(file: Path, place: str) -> dict[str, str]:
    """Return the goals and programs that a second cut would leave without one, with the name of the first cut."""
    section, _, name = place.partition(".")
    if section != "cuts":
        return {}
    described = io.read_project(file)
    if len(described.cuts) != 1 or name.strip() in described.cuts:
        return {}
    return dict.fromkeys(io.find_parts_without_cut(file), next(iter(described.cuts)))


def _check_project(root: Path) -> None:
    if not (root / PROJECT_FILE).is_file():
        fail("project", str(root), f"holds no {PROJECT_FILE}", remedy=f"make a project with `toolpoint new project {root}`")
