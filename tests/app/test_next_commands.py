"""What comes next: every command says it, by commands and options that exist, with its own files."""

import re
import shlex

import click
import pytest

from toolpoint.app.main import MODULE_OF_COMMAND, cli, main
from toolpoint.app.next_commands import ANSWERS, ENDS, NEXT_COMMANDS, next_commands, value_names


def command_of(name):
    return cli.get_command(click.Context(cli), name)


def test_every_command_says_what_comes_next_or_is_an_end():
    assert set(NEXT_COMMANDS) | ENDS == set(MODULE_OF_COMMAND) and not set(NEXT_COMMANDS) & ENDS


@pytest.mark.parametrize("name", list(NEXT_COMMANDS))
def test_what_is_named_exists(name):
    names = {parameter.name for parameter in command_of(name).params} | set(ANSWERS.get(name, ()))
    for template in NEXT_COMMANDS[name]:
        asked = {name.lstrip("!") for name in value_names(template)}
        assert asked <= names, (template, asked - names)
        words = shlex.split(re.sub(r"\{!\w+\}", "", template))
        following = command_of(words[0])
        options = {text for parameter in following.params if isinstance(parameter, click.Option) for text in parameter.opts}
        assert {word for word in words if word.startswith("-")} <= options, template
        needed = {parameter.opts[0] for parameter in following.params if isinstance(parameter, click.Option)
                  and parameter.required}
        assert needed <= set(words), f"{template} cannot be typed without {needed - set(words)}"
        has_arguments = any(isinstance(parameter, click.Argument) and parameter.required for parameter in following.params)
        takes_several = any(isinstance(parameter, click.Argument) and parameter.nargs == -1 for parameter in following.params)
        is_argument = "{files}" in words and not words[words.index("{files}") - 1].startswith("--")
        assert takes_several or not is_argument, f"{template} takes one file"
        assert not has_arguments or (len(words) > 1 and not words[1].startswith("-")), template


def test_only_what_was_given_is_named_and_names_are_quoted_for_a_shell():
    assert next_commands("lobes", {"machine": None, "modes": "my modes.h5", "cut_teeth": 4}) == [
        "mill --modes 'my modes.h5' --teeth 4 --speed SPEED --depth DEPTH", "listen CUT.wav --teeth 4 --speed SPEED"]
    assert next_commands("frf", {"files": [f"{i}.h5" for i in range(9)], "save": None}) == []


def test_no_command_names_itself_again_as_it_was_given():
    assert next_commands("operational", {"files": ["a.csv"], "modes": "modes.h5"}) == [
        "correlate MACHINE.yaml modes.h5 --geometry points.csv --components parts.yaml"]
    assert next_commands("traverse", {"files": ["a.csv"], "machine": "m.yaml"}) == ["sensitivity m.yaml"]
    assert next_commands("axis-test", {"file": "a.csv", "set_point": "v set", "force": "current", "newtons": 350.0,
                                       "at_force": "table:+y"}) == [
        "axis-test a.csv --set-point 'v set' --force current --newtons 350.0 --at table:+y --moving MOVING.csv"]


def test_it_is_the_last_line_and_no_part_of_json(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["speeds", "--chatter", "850", "--teeth", "4", "--highest", "18000"])
    assert capsys.readouterr().out.splitlines()[-1].startswith("Next: toolpoint listen CUT.wav --teeth 4 --speed SPEED")
    main(["speeds", "--chatter", "850", "--teeth", "4", "--highest", "18000", "--json"])
    assert "Next:" not in capsys.readouterr().out


def test_what_comes_next_is_of_the_kind_of_the_files():
    """Two machine files have no drift: that asks for a test."""
    assert next_commands("compare", {"older": "a.yaml", "newer": "b.yaml"}) == ["sensitivity b.yaml"]
    assert next_commands("compare", {"older": "a.h5", "newer": "b.h5"}) == ["drift b.h5 --baseline a.h5"]
