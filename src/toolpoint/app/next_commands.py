"""Commands that come next: what a person asks after a command has answered, with the files that it was given or wrote."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

# A list of ten is not read; two are.
MAX_SUGGESTED_COMMANDS = 2
MAX_NAMED_FILES = 2  # of an argument of several; more are not repeated

ANSWERS = {"listen": ("chatter_hz",)}  # numbers of a command's answer that a line takes
# Command to those that may come next; what stands in braces is an argument or option of the command itself, or a number of its
# answer, and a line is said
# only where each of them was given; one after an exclamation mark must not have been given, so that no command names itself
# again as it was; one with a kind (newer:test) must be of that kind. Words in capitals are for the reader to fill in.
NEXT_COMMANDS: dict[str, tuple[str, ...]] = {
    "tap": ("listen CUT.wav --teeth {cut_teeth} --speed SPEED",
            "new project my_project"),
    "lobes": ("mill {machine} --speed SPEED --depth DEPTH", "map-chatter {machine} --axis AXIS=LOW:HIGH:7",
              "mill --modes {modes} --teeth {cut_teeth} --speed SPEED --depth DEPTH",
              "listen CUT.wav --teeth {cut_teeth} --speed SPEED"),
    "listen": ("speeds --chatter {chatter_hz} --teeth {teeth} --highest SPEED",
               "listen {record} --teeth {teeth} --speed SPEED{!speed}",
               "tap BLOWS.csv --teeth {teeth} --diameter DIAMETER --material MATERIAL"),
    "speeds": ("listen CUT.wav --teeth {teeth} --speed SPEED", "tap BLOWS.csv --teeth {teeth} --diameter DIAMETER"),
    "turn": ("listen CUT.wav --teeth 1 --speed SPEED",),
    "mill": ("lobes {machine}", "lobes --modes {modes} --teeth {cut_teeth}",
             "listen CUT.wav --teeth {cut_teeth} --speed SPEED"),
    "rcsa": ("lobes --frf {save} --teeth 4 --material al7075", "rcsa {tool} --lobes"),
    "calibrate": ("lobes --modes modes.h5 --teeth {cut_teeth} --kt KT --kn KN",),
    "plan": ("frf {test} --save test.h5", "devices"),
    "devices": ("tap --live --device DEVICE --folder FOLDER --channel CHANNEL",),
    "frf": ("identify {save} -m modes.h5", "joints {save} --components parts.yaml --machine found.yaml",
            "frf {files} --save test.h5"),
    "identify": ("joints {modes} --geometry points.csv --components parts.yaml --machine found.yaml",
                 "lobes --modes {modes} --teeth 4 --material al7075", "identify {files} -m modes.h5"),
    "operational": ("correlate MACHINE.yaml {modes} --geometry {geometry} --components parts.yaml",
                    "correlate MACHINE.yaml {modes} --geometry points.csv --components parts.yaml{!geometry}",
                    "operational {files} -m modes.h5{!modes}"),
    "traverse": ("sensitivity {machine}", "traverse {files} --travel AXIS=FIRST:LAST:8 --machine MACHINE.yaml{!machine}"),
    "axis-test": ("axis-test {file} --set-point {set_point} --force {force} --newtons {newtons} --at {at_force} --moving "
                  "MOVING.csv{!moving}", "sensitivity {machine}"),
    "joints": ("report {written}", "next-test {written}", "joints {files} --components {components} --machine found.yaml"),
    "next-test": ("plan {machine} --test test.yaml --geometry points.csv",),
    "drift": ("compare BEFORE.h5 LATER.h5", "sensitivity {machine}"),
    "modes": ("frf {machine}", "sensitivity {machine}"),
    "map": ("map-chatter {machine} --axis AXIS=LOW:HIGH:7", "lobes {machine}"),
    "map-chatter": ("lobes {machine} --pose AXIS=POSITION", "sensitivity {machine}"),
    "campbell": ("lobes {machine}",),
    "base": ("modes {machine}",),
    "report": ("sensitivity {machine}",),
    "correlate": ("update {machine} --modes {files} --machine updated.yaml", "sensitivity {machine}"),
    "compare": ("drift {newer:test} --baseline {older:test}", "sensitivity {newer:machine}"),
    "sensitivity": ("change {machine} PATH=NUMBER -o changed.yaml", "screen PLAN.yaml"),
    "update": ("correlate {written} TEST.uff --geometry points.csv --components parts.yaml", "lobes {written}",
               "update {machine} --machine updated.yaml"),
    "screen": ("improve {plan} --answer ANSWER --goal GOAL",),
    "improve": ("change MACHINE.yaml PATH=NUMBER -o changed.yaml",),
    "drive": ("servo-data TRACE.csv", "machining {program} --drives {drives} --machine MACHINE.yaml --stock STOCK"),
    "servo-data": ("new servo my_servo.yaml", "drive my_servo.yaml --circle 50,4000"),
    "machining": ("machining {program} --machine {machine} --stock {stock} --advice", "lobes {machine}"),
    "robot": ("reach {written} --tip X,Y,Z", "accuracy {written} --square 200mm --speed SPEED --depth DEPTH",
              "robot {datasheet} --machine my_robot.yaml"),
    "reach": ("region {machine} --along x=LOW:HIGH:7",),
    "region": ("accuracy {machine} --square 200mm --speed SPEED --depth DEPTH",),
    "accuracy": ("region {machine} --along x=LOW:HIGH:7",),
    "video": ("correlate {machine} {file} --geometry points.csv --components parts.yaml", "operational {record}",
              "video {files} --fps {fps} --machine MACHINE.yaml --update updated.yaml{!machine}"),
    "convert": ("identify {target}",),
    "export": ("modes {machine}",),
    "doctor": ("demo", "samples tap"),
    "run": ("serve {folder}",),
}
# A command after which nothing is asked, or that says what comes next by itself.
ENDS = frozenset({"add", "change", "check", "completion", "demo", "new", "samples", "schema", "serve", "tried"})


def next_commands(command: str, values: Mapping[str, Any]) -> list[str]:
    """Return the commands that come after one, whose arguments and options are given by their names in the signature."""
    words = {name: text for name, value in values.items() if (text := _words_of(value))}
    lines = []
    for template in NEXT_COMMANDS.get(command, ()):
        names = value_names(template)
        absent_names = {name[1:] for name in names if name.startswith("!")}
        kinds = re.findall(r"\{(\w+):(\w+)\}", template)
        if (all(name in words for name in names if not name.startswith("!")) and not absent_names & set(words)
                and all(_kind_of(words[name]) == kind for name, kind in kinds)):
            lines.append(re.sub(r"\{!\w+\}", "", re.sub(r":\w+\}", "}", template)).format(**words))
    return lines[:MAX_SUGGESTED_COMMANDS]


def value_names(template: str) -> list[str]:
    """Return the arguments and options that a line names in braces."""
    return re.findall(r"\{(!?\w+)(?::\w+)?\}", template)


def _kind_of(word: str) -> str:
    """Return whether a file is a machine (YAML) or a test."""
    return "machine" if word.strip("'").endswith((".yaml", ".yml")) else "test"


def _words_of(value: Any) -> str:
    """Return a value as a shell takes it, empty for none, for a switch, and for many files."""
    if value is None or isinstance(value, bool):
        return ""
    if isinstance(value, (list, tuple)):
        is_short = 0 < len(value) <= MAX_NAMED_FILES and all(isinstance(part, (str, Path)) for part in value)
        return _joined(value) if is_short else ""
    return shlex.quote(str(value))


def _joined(parts: Sequence[str | Path]) -> str:
    return " ".join(shlex.quote(str(part)) for part in parts)
