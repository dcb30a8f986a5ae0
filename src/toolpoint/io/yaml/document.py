"""YAML documents with the place of every key: parsed, checked against a schema, all faults collected."""

from __future__ import annotations

import difflib
import io
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from toolpoint._check import ToolpointError, suggestion
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults

Key = tuple[str | int, ...]
FILE_VERSION = 1  # of all YAML files of toolpoint
# Machine files are some kilobytes; line and column of every node are kept for messages, many times the text itself.
LARGEST_FILE = 2_000_000
KEPT_TEXT = 100_000  # longer texts are parsed each time: their trees are not worth the memory
MOST_PARTS = 50_000  # keys, values and list entries, each counted as often as aliases repeat it
MAX_NESTING_DEPTH = 100  # brackets in brackets
_TOO_DEEP = "lists or mappings nested too deeply to be read; a machine file needs five levels"
MAX_NAMED_PARTS = 3  # that have an unknown key; a key of more says nothing
MERGE = "<<"
# Names of files that hold numbers in other formats: their contents are never YAML, whatever their first lines look like.
MEASURED_SUFFIXES = frozenset({".h5", ".hdf5", ".uff", ".unv", ".mat", ".npz", ".npy", ".wav", ".tdms", ".lvm", ".csv", ".mp4"})
LARGEST_INTEGER = 10**15  # no count or quantity of a machine is larger, and floats hold whole numbers up to here exactly


@dataclass
class Document:
    """A parsed file: plain data, where every key and value stands, and the faults found so far."""

    file: Path
    text: str
    data: dict[str, Any]
    places: dict[Key, tuple[int, int]]
    faults: list[Fault]
    parts: int = 0

    def fault(self, key: Key, message: str) -> None:
        """Add a fault at the nearest known place of a key."""
        place_key = key
        while place_key and place_key not in self.places:
            place_key = place_key[:-1]
        line, column = self.places.get(place_key, (1, 1))
        self.faults.append(Fault(line, column, ".".join(str(k) for k in key), message))

    def check_version(self, version: int) -> None:
        """Add a fault where the file's version is not the one that is read; one fault only where it states none."""
        stated = self.data.get("toolpoint")
        if stated is None:
            self.fault(("toolpoint",), f"missing; write 'toolpoint: {version}' as the first line")
            self.data["toolpoint"] = version
        elif stated != version:
            self.fault(("toolpoint",), f"file version {stated!r}; this program reads version {version}")


@door("YAML file")
def parse(path: Path) -> Document:
    """Return a file as a document; raise where it cannot be read or is no YAML mapping."""
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise ToolpointError(f"{path}: {size} bytes; a machine file has at most {LARGEST_FILE}")
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if path.suffix.lower() in MEASURED_SUFFIXES:
        raise ToolpointError(f"{path}: {path.suffix} files hold measurements, responses or modes; expected here is YAML, "
                             "which begins with 'toolpoint: 1' (responses are given with --frf, modes with --modes; `toolpoint "
                             "identify` reads responses, `toolpoint frf` records)")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ToolpointError(f"{path}: not a text file in UTF-8 (byte {error.start}); save it as UTF-8") from None
    document = Document(path, text, {}, {}, [])
    _check_depth(path, text)
    try:
        node = _composed(text) if len(text) < KEPT_TEXT else _composed.__wrapped__(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        hint = "; use spaces, not tabs" if "\t" in text.splitlines()[min(line, len(text.splitlines())) - 1:][:1] else ""
        raise FileFaults(str(path), text, [Fault(line, column, "", f"not valid YAML: {error.problem}{hint}; check "
                                                 "indentation, colons and quotes near here")]) from None
    except YAMLError as error:
        raise ToolpointError(f"{path}: not valid YAML ({error})") from None
    except RecursionError:
        raise ToolpointError(f"{path}: {_TOO_DEEP}") from None
    if not isinstance(node, MappingNode):
        raise FileFaults(str(path), text, [Fault(1, 1, "", "not a machine file; it begins with 'toolpoint: 1'")])
    document.data = _plain(node, (), document, set())
    return document


@lru_cache(maxsize=8)
def _composed(text: str) -> Node | None:
    """Return the tree of a text, which nobody changes: one file is read for its machine, its cut, its tool in turn."""
    return cast("Node | None", YAML(typ="safe", pure=True).compose(io.StringIO(text)))


def _check_depth(path: Path, text: str) -> None:
    """Refuse brackets in brackets without end before the parser sees them: its time grows with the square of the depth."""
    depth = 0
    for bracket in re.findall(r"[\[\]{}]", text):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        if depth > MAX_NESTING_DEPTH:
            raise ToolpointError(f"{path}: {_TOO_DEEP}")


def _plain(node: Node, key: Key, document: Document, above: set[int]) -> Any:
    document.parts += 1
    if document.parts > MOST_PARTS:
        raise ToolpointError(f"{document.file}: more than {MOST_PARTS} keys and values, aliases (*name) written out; "
                             "write parts once, without aliases inside aliases")
    document.places.setdefault(key, (node.start_mark.line + 1, node.start_mark.column + 1))
    if id(node) in above:
        document.fault(key, "an alias that contains itself; write the part out")
        return None
    if isinstance(node, MappingNode):
        return _mapping(node, key, document, above | {id(node)})
    if isinstance(node, SequenceNode):
        return [_plain(child, (*key, i), document, above | {id(node)}) for i, child in enumerate(node.value)]
    assert isinstance(node, ScalarNode)
    return _scalar(node, key, document)


def _mapping(node: MappingNode, key: Key, document: Document, above: set[int]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    merged: dict[str, Any] = {}
    for name_node, value_node in node.value:
        if isinstance(name_node, ScalarNode) and name_node.value == MERGE:
            merged = {**_merged(value_node, key, document, above), **merged}
    for name_node, value_node in node.value:
        name = str(name_node.value) if isinstance(name_node, ScalarNode) else "?"
        value_key = (*key, name)
        place = (name_node.start_mark.line + 1, name_node.start_mark.column + 1)
        if name == MERGE:
            continue
        if name in values:
            first = document.places[value_key][0]
            document.faults.append(Fault(*place, ".".join(map(str, value_key)),
                                         f"key {name!r} is already given in line {first}; keep one of the two"))
            continue
        document.places[value_key] = place
        values[name] = _plain(value_node, value_key, document, above)
        if isinstance(value_node, ScalarNode):
            document.places[value_key] = (value_node.start_mark.line + 1, value_node.start_mark.column + 1)
    return {**merged, **values}


def _merged(node: Node, key: Key, document: Document, above: set[int]) -> dict[str, Any]:
    """Return the keys that a merge key (``<<: *anchor``) brings; of several mappings the first that has a key counts."""
    result: dict[str, Any] = {}
    for part in node.value if isinstance(node, SequenceNode) else [node]:
        brought = _plain(part, key, document, above) if isinstance(part, MappingNode) else None
        if isinstance(brought, dict):
            result = {**brought, **result}
        elif not isinstance(part, MappingNode):
            document.fault((*key, MERGE), f"{MERGE}: must be an alias of a mapping (*name), or a list of them")
    return result


def _scalar(node: ScalarNode, key: Key, document: Document) -> Any:
    tag = str(node.ctag if hasattr(node, "ctag") else node.tag).rsplit(":", 1)[-1]
    text = node.value
    try:
        if tag == "int":
            number = int(text.replace("_", ""), 10 if text.lstrip("+-").startswith("0") and len(text) > 1 else 0)
            if abs(number) <= LARGEST_INTEGER:
                return number
            document.fault(key, f"a whole number of {len(text)} digits; must be at most {LARGEST_INTEGER:.0e}; write "
                                "1.5e20 for a large quantity")
            return None
        if tag == "float":
            return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))
        if tag == "bool":
            return text.lower() == "true"
    except ValueError:
        document.fault(key, f"{text!r} is not a number that can be read")
        return None
    return None if tag == "null" else text


def validate(model: type[BaseModel], entry: Any, key: Key, *, document: Document) -> Any:
    """Return an entry as its model, or None after its faults were added to the document."""
    if key and not isinstance(entry, dict):
        document.fault(key, f"{entry!r}; must hold keys such as {', '.join(list(model.model_fields)[:4])}")
        return None
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        for failure in error.errors(include_url=False):
            _add_fault(model, failure, key, document)
        return None


def _add_fault(model: type[BaseModel], error: Any, key: Key, document: Document) -> None:
    place = tuple(p for p in error["loc"] if not (isinstance(p, str) and ("[" in p or p.endswith("Model"))))
    where = (*key, *place)
    kind, name = error["type"], place[-1] if place else ""
    if kind == "extra_forbidden":
        document.fault(where, f"unknown key {str(name)!r}{_unknown_key_hint(model, place)}")
    elif kind == "missing":
        document.fault(where, f"{str(name)!r} is missing")
    elif kind == "quantity":
        document.fault(where, error["ctx"]["message"])
    else:
        words = re.findall(r"'([^']*)'", str(error["ctx"]["expected"])) if kind == "literal_error" else []
        meant = suggestion(str(error["input"]), words)
        text = f"{error['input']!r}: {error['msg'][0].lower()}{error['msg'][1:]}"
        document.fault(where, f"{text} ({meant})" if meant else text)


def _unknown_key_hint(model: type[BaseModel], place: Key) -> str:
    """Return what may be meant by an unknown key: a key spelled like it, or the parts beside this one that have it."""
    name, allowed_keys = str(place[-1]), list(_model_at(model, place[:-1]).model_fields)
    if name[:1].isdigit():
        return "; is there a decimal comma before it? write a decimal point"
    around = _model_at(model, place[:-2]) if len(place) > 1 else model
    parts = [part for part, field in around.model_fields.items() for held in _models_in(field)
             if name in held.model_fields and part not in place[-2:-1]]
    close_matches = difflib.get_close_matches(name, allowed_keys, n=1, cutoff=0.5)
    if close_matches and not parts:
        return f"; did you mean {close_matches[0]!r}?"
    meant = f" ({name} is a key of {' and of '.join(parts)})" if 0 < len(parts) <= MAX_NAMED_PARTS else ""
    return f"; known: {', '.join(allowed_keys)}{meant}"


def _model_at(model: type[BaseModel], place: Key) -> Any:
    """Return the model of the part at a place in a file."""
    current: Any = model
    for step in place:
        if step not in current.model_fields:
            continue  # a user's own name, or the place in a list: the model is already that of the entries
        held = _models_in(current.model_fields[step])
        if not held:
            break
        current = held[0]
    return current


def _models_in(field: FieldInfo) -> list[Any]:
    """Return the models that a field holds, one or by name."""
    return [a for a in [field.annotation, *getattr(field.annotation, "__args__", ())]
            if isinstance(a, type) and issubclass(a, BaseModel)]
