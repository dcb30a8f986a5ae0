"""A page for every kind of file: every key with its meaning, unit, default, limits and an example, from the schemas."""

from __future__ import annotations

import importlib
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from generate.sites import SOURCE

FILES = {"machine": ("machine_schema", "Machine files"), "test": ("testing.test_file", "Test files"),
         "components": ("component_file", "Component files"), "servo": ("drive_file", "Servo files"),
         "shaft": ("shaft_file", "Shaft files"), "datasheet": ("robot_file", "Robot datasheets"),
         "plan": ("plan_file", "Screening plans"), "project": ("project_file", "Project files"),
         "choice": ("testing.choice_file", "Choice files")}
HEAD = ["| key | meaning, unit and limits | default | example |", "|---|---|---|---|"]


@cache
def _documents() -> list[Any]:
    files = [*SOURCE.joinpath("app", "machines").glob("*.yaml"), *SOURCE.joinpath("io", "templates").rglob("*.yaml")]
    reader = YAML(typ="safe", pure=True)
    return [reader.load(path.read_text(encoding="utf-8")) for path in sorted(files)]


def _gather(schema: dict[str, Any], node: dict[str, Any], value: Any, part: str, seen: dict[tuple[str, str], str]) -> None:
    """Walk a document beside its schema and keep the first value of every key of every part."""
    for choice in node.get("anyOf", [node]):
        if "$ref" in choice:
            name = choice["$ref"].rsplit("/", 1)[-1]
            _gather(schema, schema["$defs"][name], value, name, seen)
        elif isinstance(value, dict) and "properties" in choice:
            for key, inner in value.items():
                if key in choice["properties"]:
                    seen.setdefault((part, key), _shown(inner))
                    _gather(schema, choice["properties"][key], inner, "", seen)
        elif isinstance(value, dict) and isinstance(choice.get("additionalProperties"), dict):
            for inner in value.values():
                _gather(schema, choice["additionalProperties"], inner, "", seen)
        elif isinstance(value, list) and isinstance(choice.get("items"), dict):
            for inner in value:
                _gather(schema, choice["items"], inner, "", seen)


def _is_of(document: dict[str, Any], schema: dict[str, Any]) -> bool:
    """Whether a document is of the kind that a schema describes: nearly all of its first keys, and all that are needed."""
    known = set(schema["properties"])
    return set(schema.get("required", ())) <= set(document) and len(set(document) & known) >= 0.8 * len(document)


def _shown(value: Any) -> str:
    text = re.sub(r'"([^",:{}\[\]]*)"', r"\1", json.dumps(value)) if isinstance(value, dict | list | bool) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


@cache
def _written() -> dict[str, dict[str, Any]]:
    """Return the examples of keys that no shipped file uses."""
    text = Path(__file__).with_name("key_examples.yaml").read_text(encoding="utf-8")
    return YAML(typ="safe", pure=True).load(text)


def example_of(part: str, key: str, entry: dict[str, Any]) -> str:
    """Return an example of a key that no shipped file uses: a written one, its first choice, or a usual value of its unit."""
    written = _written()
    for place in (part, "any"):
        if key in written.get(place, {}):
            return str(written[place][key])
    for choice in [entry, *entry.get("anyOf", ())]:
        if choice.get("enum"):
            return str(choice["enum"][0])
        if choice.get("type") == "boolean":
            return "true"
    unit = entry.get("description", "").partition("a bare number is in ")[2].partition(";")[0]
    return f"1 {unit}".removesuffix(" 1") if unit else ""


def _limits(entry: dict[str, Any]) -> str:
    choices = [str(word) for choice in [entry, *entry.get("anyOf", ())] for word in choice.get("enum", ())]
    words = [f"one of {', '.join(choices)}"] if choices else []
    names = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
    return "; ".join([*words, *(f"{word} {entry[key]:g}" for key, word in names.items() if key in entry)])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ").replace("*", "\\*").replace("<", "&lt;")


def _table(name: str, part: dict[str, Any], seen: dict[tuple[str, str], str]) -> list[str]:
    required, lines = part.get("required", []), [*HEAD]
    for key, entry in part.get("properties", {}).items():
        meaning = "; ".join(word for word in (entry.get("description", ""), _limits(entry)) if word)
        stated = entry.get("default")
        default = "needed" if key in required else "none" if stated in (None, "") else _shown(stated)
        example = seen.get((name, key)) or example_of(name.removesuffix("Model"), key, entry)
        lines.append(f"| `{key}` | {_cell(meaning)} | {_cell(default)} | `{example.replace('|', ' ')}` |")
    return [*lines, ""]


def _examples() -> dict[tuple[str, str], str]:
    """Return the first value of every key of every part in the shipped files; keys of a file itself by the kind of file."""
    seen: dict[tuple[str, str], str] = {}
    for name, (module, _) in FILES.items():
        schema = importlib.import_module(f"toolpoint.io.yaml.{module}").json_schema()
        for document in _documents():
            if isinstance(document, dict) and _is_of(document, schema):
                _gather(schema, schema, document, name, seen)
    return seen


def write_keys(folder: Path) -> None:
    """Write the page of every kind of file and the page that lists them."""
    seen = _examples()
    for name, (module, title) in FILES.items():
        schema = importlib.import_module(f"toolpoint.io.yaml.{module}").json_schema()
        lines = [f"# {title}", "",
                 "Every key, its meaning, unit, limits, default and an example. A number without a unit is in SI.", "",
                 *_table(name, schema, seen)]
        for part, entry in sorted(schema.get("$defs", {}).items()):
            if entry.get("properties"):
                lines += [f"## {part.removesuffix('Model').removesuffix('Part')}", "", *_table(part, entry, seen)]
        (folder / f"keys_{name}.md").write_text("\n".join(lines), encoding="utf-8")
    pages = "\n".join(f"keys_{name}" for name in FILES)
    (folder / "keys.md").write_text(f"# Keys of files\n\n```{{toctree}}\n:maxdepth: 1\n\n{pages}\n```\n", encoding="utf-8")
