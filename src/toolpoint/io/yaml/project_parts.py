"""Parts entered into the text of a project file, a line each; comments and all other lines stay as they are."""

from __future__ import annotations

import json
import re

from toolpoint._check import ToolpointError, fail, one_of

SECTIONS = ("tests", "cuts", "goals", "programs", "contours", "changes")  # keys that hold named parts
FILE_KEYS = ("machine", "components", "geometry", "servo")  # keys that hold the name of a file
MAX_PROJECT_PART_LENGTH = 2000  # characters of a part's line
# Names that YAML reads back as they stand; all others are quoted (yes, 1e5 and ~ would become something else).
_PLAIN_NAME = re.compile(r"[A-Za-z_][\w .()+/-]*")
_TOP_KEY = re.compile(r"[A-Za-z_]\w*\s*:")


def enter_part(text: str, place: str, value: str) -> str:
    r"""Return the text of a project file with one part more, or another value of it.

    Parameters
    ----------
    text : str
    place : str
        ``SECTION.NAME`` of a named part (``goals.rough``), or a key that holds a file's name (``geometry``).
    value : str
        What stands behind the colon, on one line: ``{speed: 8000 rpm, depth: 3 mm}``, or the name of a file.

    Raises
    ------
    ToolpointError
        For a place that a project file lacks, a value of several lines, and an entry that is written over several lines.

    >>> print(enter_part("toolpoint: 1\nname: mill\n", "goals.rough", "{speed: 8000 rpm, depth: 3 mm}").strip())
    toolpoint: 1
    name: mill
    goals:
      rough: {speed: 8000 rpm, depth: 3 mm}
    """
    if "\n" in value or "\r" in value or not value.strip() or len(value) > MAX_PROJECT_PART_LENGTH:
        fail(place, f"{len(value)} characters", f"must be one line of at most {MAX_PROJECT_PART_LENGTH} characters")
    section, dot, name = place.partition(".")
    lines = text.split("\n")
    if not dot:
        return "\n".join(_with_key(lines, one_of("part", section, FILE_KEYS), value))
    one_of("part", section, SECTIONS)
    if not name.strip() or len(name) > 80 or any(ord(letter) < 32 for letter in name):
        fail(section, repr(name), "must have a name of 1 to 80 plain characters")
    return "\n".join(_with_entry(lines, section, _spelled(name.strip()), value))


def name_cut(text: str, place: str, cut: str) -> str:
    r"""Return the text of a project file whose part ``SECTION.NAME`` names its cut; the rest of its line stays.

    Raises ToolpointError for a part that is not written on one line between braces.

    >>> text = "goals:\n  rough: {speed: 8000 rpm, depth: 3 mm}\n"
    >>> print(name_cut(text, "goals.rough", "steel").strip())
    goals:
      rough: {cut: steel, speed: 8000 rpm, depth: 3 mm}
    """
    section, _, name = place.partition(".")
    lines, is_inside = text.split("\n"), False
    for number, line in enumerate(lines):
        if _TOP_KEY.match(line):
            is_inside = line.startswith(f"{section}:")
        parts = re.match(r"(\s+)(.+?)(\s*:\s*\{)(.*)", line) if is_inside else None
        if parts and parts[2].strip("\"'") == name:
            lines[number] = f"{parts[1]}{parts[2]}{parts[3]}cut: {_spelled(cut)}, {parts[4]}"
            return "\n".join(lines)
    raise ToolpointError(f"{place}: is not written on one line in project.yaml; write its cut there")


def _spelled(name: str) -> str:
    """Return a name as a key of YAML: as it is, or in quotes."""
    words = ("true", "false", "yes", "no", "null", "on", "off")
    return name if _PLAIN_NAME.fullmatch(name) and name.lower() not in words and name == name.strip() else json.dumps(name)


def _with_key(lines: list[str], key: str, value: str) -> list[str]:
    """Return lines with a key of the top level set; it is added before the first section where it is not there."""
    entry = f"{key}: {_file_text(value)}"
    for number, line in enumerate(lines):
        if re.match(rf"{key}\s*:", line):
            return [*lines[:number], entry, *lines[number + 1:]]
    end = _end_of_text(lines)
    return [*lines[:end], entry, *lines[end:]]


def _file_text(value: str) -> str:
    return value if re.fullmatch(r"[\w./ -]+", value) and value == value.strip() else json.dumps(value)


def _with_entry(lines: list[str], section: str, name: str, value: str) -> list[str]:
    """Return lines with an entry of a section, behind those that are there or in place of that of its name."""
    start = next((number for number, line in enumerate(lines) if re.match(rf"{section}\s*:", line)), None)
    entry = f"  {name}: {value}"
    if start is None:
        end = _end_of_text(lines)
        return [*lines[:end], f"{section}:", entry, *lines[end:]]
    if re.sub(r"#.*", "", lines[start].partition(":")[2]).strip():
        raise ToolpointError(f"{section}: is written on one line in project.yaml; write its parts below it, one a line")
    end = next((number for number in range(start + 1, len(lines)) if _TOP_KEY.match(lines[number])), _end_of_text(lines))
    own = [number for number in range(start + 1, end) if re.match(rf"\s+{re.escape(name)}\s*:", lines[number])]
    if own:
        return _replaced(lines, own[0], end, entry)
    while end > start + 1 and not lines[end - 1].strip():
        end -= 1
    return [*lines[:end], entry, *lines[end:]]


def _replaced(lines: list[str], number: int, end: int, entry: str) -> list[str]:
    """Return lines with an entry in place of another; one over several lines is a person's, and stays."""
    depth = len(lines[number]) - len(lines[number].lstrip())
    following = lines[number + 1] if number + 1 < end else ""
    opened, closed = lines[number].count("{"), lines[number].count("}")
    if opened != closed or (following.strip() and len(following) - len(following.lstrip()) > depth
                            and not following.lstrip().startswith("#")):
        name = entry.strip().partition(":")[0]
        raise ToolpointError(f"{name}: is written over several lines in project.yaml; change it there")
    return [*lines[:number], " " * depth + entry.strip(), *lines[number + 1:]]


def _end_of_text(lines: list[str]) -> int:
    """Return the line before trailing empty ones."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return end
