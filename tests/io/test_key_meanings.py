"""Every key of every file says what it means, and nothing is explained that no file has."""

import importlib

import pytest

from toolpoint._check import ToolpointError
from toolpoint.io.yaml.file_kinds import SCHEMAS, json_schema
from toolpoint.io.yaml.key_meanings import FILES, meaning_of, meanings

MODULES = ("machine_schema", "drive_file", "robot_file", "shaft_file", "testing.test_file", "component_file", "plan_file",
           "testing.choice_file", "project_file")


def schema(module):
    return importlib.import_module(f"toolpoint.io.yaml.{module}").json_schema()


def keys(found):
    """Every part of a schema with its keys; the file's own keys have no name of a part."""
    yield "", found["properties"]
    for name, part in found.get("$defs", {}).items():
        yield name.removesuffix("Model"), part.get("properties", {})


@pytest.mark.parametrize("module", MODULES)
def test_every_key_says_what_it_means(module):
    files = [part for part in meanings() if part.endswith("File")]
    silent = [f"{part}.{key}" for part, entries in keys(schema(module)) for key in entries
              if not (meaning_of(part, key) if part else any(meaning_of(file, key) for file in files))]
    assert silent == []
    assert all(entry["description"] for _, entries in keys(schema(module)) for entry in entries.values())


def test_nothing_is_explained_that_no_file_has():
    known = {}
    for module in MODULES:
        for part, entries in keys(schema(module)):
            known.setdefault(part, set()).update(entries)
    strangers = [f"{part}.{key}" for part, entries in meanings().items() if part not in (*FILES.values(), "any")
                 for key in entries or {} if key not in known.get(part, set())]
    assert strangers == []
    assert {key for file in FILES.values() for key in meanings()[file]} <= known[""]


def test_units_and_limits_stand_beside_the_meaning():
    mass = schema("machine_schema")["$defs"]["BodyModel"]["properties"]["mass"]["description"]
    assert mass == "mass of the body; mass; a bare number is in kg; above 0"


def test_every_kind_of_file_has_its_schema():
    """`toolpoint schema KIND` knows every kind that has a meaning for its keys, and refuses another with the known ones."""
    titles = {kind: json_schema(kind)["title"] for kind in SCHEMAS}
    assert len(set(titles.values())) == len(FILES) == len(SCHEMAS) and titles["choice"] == "toolpoint choice file"
    with pytest.raises(ToolpointError, match="choice"):
        json_schema("choices")
