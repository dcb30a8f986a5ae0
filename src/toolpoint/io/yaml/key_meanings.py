"""Meanings of the keys of all files: the words of `key_meanings.yaml`, put into JSON schemas for editors and the manual."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

FILES = {"MachineModel": "MachineFile", "Drive": "ServoFile", "RobotDatasheet": "RobotFile", "Shaft": "ShaftFile",
         "HammerTest": "TestFile", "ComponentFile": "ComponentsFile", "ScreeningPlan": "PlanFile",
         "PoleChoice": "ChoiceFile", "ProjectFile": "ProjectFile"}


@cache
def meanings() -> dict[str, dict[str, str]]:
    """Return the meaning of every key by part and key; part ``any`` holds those that mean the same everywhere."""
    text = Path(__file__).with_name("key_meanings.yaml").read_text(encoding="utf-8")
    parts: dict[str, dict[str, str]] = YAML(typ="safe", pure=True).load(text)
    return parts


def meaning_of(part: str, key: str) -> str:
    """Return what a key of a part means, empty where it is not written down."""
    return meanings().get(part, {}).get(key, "") or meanings()["any"].get(key, "")


def add_meanings(schema: dict[str, Any], model: str) -> None:
    """Put the meanings before the descriptions of a JSON schema's keys, in place; `model` is the name of the file's model."""
    parts = {FILES.get(model, model): schema, **{name.removesuffix("Model"): part for name, part in
                                                 schema.get("$defs", {}).items()}}
    for name, part in parts.items():
        for key, entry in part.get("properties", {}).items():
            choices_text = [choice.get("description", "") for choice in entry.get("anyOf", ())]
            words = [meaning_of(name, key), entry.get("description", ""), *choices_text]
            entry["description"] = "; ".join(word for word in words if word)
