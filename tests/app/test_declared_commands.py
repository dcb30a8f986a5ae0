"""Commands declared by their signatures: annotations become options, records become groups, contradictions are refused."""

from __future__ import annotations

import json
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import pytest
from click.testing import CliRunner

from toolpoint._doubt import Doubt
from toolpoint.app.declare import Argument, Help, Reading, command, list_given
from toolpoint.app.frame import Frame
from toolpoint.io.quantities.written import read_numbers

Numbers = Annotated[tuple[float, ...], Reading(read_numbers, "numbers, for example 1,2")]


@dataclass(frozen=True)
class Pair:
    """Two numbers that a command receives as one."""

    first: Annotated[float, Help("First.", above=0)]
    second: Annotated[float | None, Help("Second.", name="--other", needs="--word, as the test wants it")] = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {"first": self.first, "second": self.second}


class Shown:
    """A result of a command."""

    def __init__(self, **values: Any) -> None:
        self.values = values

    def table(self) -> str:
        """As text."""
        return "table"

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return self.values


@command(page=False)
def try_options(run: Frame, name: Annotated[str, Argument()], pair: Pair, *,
                word: Annotated[Literal["a", "b"], Help("W.")] = "a",
                numbers: Annotated[Numbers | None, Help("N.")] = None,
                many: Annotated[tuple[int, ...], Help("M.", minimum=2, excludes="--flag, which is one too")] = (),
                flag: Annotated[bool, Help("F.")] = False,
                size: Annotated[float, Reading(float), Help("S.", default="2.5")]) -> None:
    """Show what was received."""
    run.show(Shown(name=name, pair=pair.to_dict(), word=word, numbers=numbers, many=many, flag=flag, size=size,
                   given=list_given("word", "flag")))


def received(*words):
    done = CliRunner().invoke(try_options, [*words, "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


def test_annotations_say_what_is_received():
    assert received("n", "--first", "2") == {"name": "n", "pair": {"first": 2.0, "second": None}, "word": "a", "numbers": None,
                                             "many": [], "flag": False, "size": 2.5, "given": []}
    full = received("n", "--first", "2", "--word", "b", "--other", "3", "--numbers", "1,2.5", "--many", "2", "--many", "3",
                    "--size", "4")
    assert full["pair"]["second"] == 3.0 and full["numbers"] == [1.0, 2.5] and full["many"] == [2, 3]
    assert full["given"] == ["--word"] and full["size"] == 4.0
    assert received("n", "--first", "2", "--flag")["given"] == ["--flag"]


@pytest.mark.parametrize(("words", "told"), [
    (["--first", "2"], "Missing argument 'NAME'"), (["n"], "Missing option '--first'"),
    (["n", "--first", "0"], "not in the range x>0"), (["n", "--first", "nan"], "not in the range x>0"),
    (["n", "--first", "2", "--word", "c"], "'a', 'b'"), (["n", "--first", "2", "--numbers", "x"], "write numbers, for example"),
    (["n", "--first", "2", "--many", "1"], "x>=2"), (["n", "--first", "2", "--other", "3"], "--other: needs --word, as the"),
    (["n", "--first", "2", "--many", "2", "--flag"], "--flag, which is one too; must be one of them")])
def test_what_cannot_be_is_refused(words, told):
    done = CliRunner().invoke(try_options, words)
    assert done.exit_code != 0 and told in f"{done.output}{done.exception}"


def test_numbers_are_typed_in_their_unit_and_received_in_si():
    @command(page=False)
    def weigh(run: Frame, *, depth: Annotated[float, Help("Depth, mm.", scale=1e-3)],
              share: Annotated[float, Help("Share, %.", scale=1e-2, above=0, maximum=100)] = 50.0,
              none: Annotated[float | None, Help("None.", scale=1e-3)] = None) -> None:
        """Say what was received."""
        run.show(Shown(depth=depth, share=share, none=none))

    def say(*words):
        return CliRunner().invoke(weigh, [*words, "--json"])
    assert json.loads(say("--depth", "2").output) == {"depth": 0.002, "share": 0.5, "none": None}
    assert json.loads(say("--depth", "2", "--share", "10").output)["share"] == pytest.approx(0.1)
    assert "101.0 is not in the range 0<x<=100" in say("--depth", "2", "--share", "101").output
    text = CliRunner().invoke(weigh, ["--help"]).output
    assert "0<x<=100" in text and "[default: 50.0; " in text and "x<=None" not in text


def test_steps_begin_by_reading_and_end_by_the_page(tmp_path, monkeypatch):
    said = []
    monkeypatch.setattr("toolpoint.app.console.show_progress",
                        lambda quiet: nullcontext(lambda name, done, total, step=False: said.append((name, done, total, step))))

    class Page:
        summary = "the answer"

        def preceded_by(self, *doubts):
            return self

        def reworded(self, spell):
            return self

        def save(self, place):
            return place / "index.html"

    @command(steps=3)
    def study(run: Frame) -> None:
        """Study."""
        run.step("study")
        run.write("List", tmp_path / "list.txt", lambda words, path: path.write_text(words), "words")
        run.write("Nothing", None, lambda path: path.write_text("nothing"))
        run.present(lambda result: Page(), Shown(), notes=["a note", Doubt("limits", "noise decides", "average more")])

    done = CliRunner().invoke(study, ["-o", str(tmp_path)])
    assert said == [("reading", 0, 3, True), ("study", 1, 3, True), ("page", 2, 3, True)]
    assert (tmp_path / "list.txt").read_text() == "words"
    assert done.output.splitlines() == ["doubt: limits: noise decides; average more", "table", "note: a note",
                                        f"List written: {tmp_path / 'list.txt'}",
                                        f"Page written: {tmp_path / 'index.html'}"]


def test_help_shows_limits_and_defaults():
    text = CliRunner().invoke(try_options, ["--help"]).output
    assert "NAME" in text and "x>0; required" in text and "[default: 2.5]" in text and "--json" in text
    assert "--output" not in text and "[default: a]" in text


def test_what_is_shown_comes_after_the_progress_even_where_the_command_fails():
    @command(page=False)
    def fail_late(run: Frame) -> None:
        """Fail."""
        run.show_text("shown")
        raise ValueError("late")

    done = CliRunner().invoke(fail_late, [])
    assert "shown" in done.output and isinstance(done.exception, ValueError)
