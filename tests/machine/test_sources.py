"""What is marked as published names its publication, in every file that is shipped."""

from pathlib import Path

import pytest
from ruamel.yaml import YAML

import toolpoint

SHIPPED = sorted(path for path in Path(toolpoint.__file__).parent.rglob("*.yaml") if path.name != "key_meanings.yaml")


def sources(node, key=()):
    """Yield place and text of every source of a document."""
    if isinstance(node, dict):
        for name, value in node.items():
            if name == "source" and isinstance(value, str):
                yield (*key, name), value
            yield from sources(value, (*key, name))
    elif isinstance(node, list):
        for number, value in enumerate(node):
            yield from sources(value, (*key, number))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_a_published_source_names_its_publication(path):
    data = YAML(typ="safe", pure=True).load(path)
    for key, text in sources(data):
        if "published" in text:
            after = text.split("published", 1)[1]
            assert after.startswith(": ") and len(after.split()) >= 4, (key, text)
