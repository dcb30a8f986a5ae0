"""Nouns and results show themselves in a notebook: their table or their repr, escaped, nothing that runs."""

import ast
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from toolpoint._notebook import NotebookText
from toolpoint.studies.machines.pose_map import PoseMap
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Frf, Modes

SOURCE = Path(__file__).resolve().parents[2] / "src" / "toolpoint"


class Cells(HTMLParser):
    """Cells of the tables of an HTML text."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.inside = [], False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "tr":
            self.rows.append([])
        self.inside = tag in ("td", "th")
        if self.inside:
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        self.inside = False

    def handle_data(self, data):
        if self.inside:
            self.rows[-1][-1] += data


def test_a_ruled_table_becomes_a_table_and_the_lines_around_it_stay():
    class Result(NotebookText):
        def table(self):
            words = "a long reason that takes more than one line of the cell because it has many words in it"
            return "first <b>\n" + text_table("title", ["", "Hz", "why"], [["mode 1", "20.5", words], ["2", "", ""]]) + "\nlast"

    shown = Result()._repr_html_()
    rows = Cells(shown).rows
    assert rows[0] == ["", "Hz", "why"] and rows[1][:2] == ["mode 1", "20.5"] and rows[1][2].endswith("many words in it")
    assert rows[2] == ["2", "", ""] and len(rows) == 3
    assert "first &lt;b&gt;\ntitle" in shown and "last</pre>" in shown


@pytest.mark.parametrize("noun", [
    Dof("1", "+x"), Frf(np.arange(1.0, 4.0), np.ones((3, 1, 1)), ["1:+x"], ["1:+x"]),
    Modes([20.0, 30.0], 0.02, np.ones((1, 2)), ["1:+x"]), PoseMap({"X": np.array([0.0, 0.1])}, np.array([[20.0], [21.0]]))])
def test_nouns_and_results_have_one(noun):
    shown = noun._repr_html_()
    assert "<script" not in shown and ("<pre" in shown or "<table" in shown)
    words = repr(noun) if not hasattr(noun, "table") else noun.table().split("\n")[0].split()[0]
    assert words.split("(")[0] in shown


def test_every_class_with_a_table_is_shown_by_it():
    lacking = []
    for path in SOURCE.rglob("*.py"):
        if path.relative_to(SOURCE).parts[0] in ("app", "plot", "pages"):
            continue
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body if "def table(" in text else ():
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                methods = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
                bases = {ast.unparse(base) for base in node.bases}
                if "table" in methods and not bases & {"NotebookText", "Protocol"}:
                    lacking.append(f"{path.name}: {node.name}")
    assert lacking == []
