"""Commands by the question that they answer, with a line for each: the order of the help and of the manual."""

from __future__ import annotations

# Question, and its commands with the line that the help gives each.
COMMANDS_OF_QUESTION: dict[str, dict[str, str]] = {
    "Begin, and see what is there": {
        "demo": "a published machine from end to end; --list names them",
        "new": "a commented file to begin with, or the folder of a project",
        "samples": "small virtual measurements, and the commands that run on them",
        "check": "a file in words: what it assumes, what looks odd, its faults",
        "report": "the page of a machine file, or of measured responses",
        "doctor": "versions, extras, browser: what is missing and the remedy",
        "convert": "responses, modes or records to another format; pages to tables",
        "schema": "the JSON schema of a kind of file, for editors",
        "completion": "completion of commands, options and files in a shell",
    },
    "All of it in one folder, from records to advice": {
        "add": "put files and parts (cuts, goals) into a project",
        "run": "records to limits, changes and the next test: what is old",
        "tried": "report a cut that was tried: every answer is sharpened",
        "serve": "the project in a browser, with sliders",
    },
    "A tool tip was struck, or a cut sounds wrong": {
        "tap": "hammer blows on a tool to speeds to use",
        "lobes": "stable depths over spindle speed",
        "listen": "chatter or not, from the sound of a cut",
        "speeds": "speeds to try when only the chatter tone is known",
        "turn": "stable widths of a turning cut",
        "mill": "a milling cut in time: forces, vibration, chatter or not",
        "rcsa": "the response of a tool that was never measured",
        "calibrate": "cutting coefficients and run-out from measured forces",
    },
    "A machine is measured: by hammer, or at work": {
        "plan": "where to measure and strike, and what to expect",
        "devices": "inputs to record from; a hammer calibrated by a free mass",
        "frf": "responses of hammer or shaker records, or of a machine file",
        "identify": "modes of measured responses, with intervals",
        "operational": "modes of a machine at work, no force measured",
        "traverse": "modes while an axis travels, and the joint that changes",
        "axis-test": "modes of an axis that shakes itself by its set point",
        "joints": "joints of a measured machine, and a machine file that runs",
        "next-test": "the test that would narrow the answer most",
        "drift": "whether a machine has changed, and which joint",
    },
    "A machine file: modes, responses and limits at any pose": {
        "modes": "natural frequencies at a pose, or of matrices",
        "map": "frequencies, stiffness or responses over the workspace",
        "map-chatter": "stable depths over workspace and feed direction",
        "campbell": "frequencies over spindle speed, critical speeds",
        "base": "forces of the machine on its floor",
        "change": "numbers of a machine file changed by hand",
        "export": "the machine for MuJoCo or Exudyn",
    },
    "A model and its test: where they differ, what to change": {
        "correlate": "a test beside a machine: MAC, points, differences",
        "compare": "two states, two tests or two machine files: what moved",
        "sensitivity": "which joint or body moves which mode",
        "update": "the machine that agrees with measured modes or responses",
        "screen": "design changes by a plan: effects, with confidence",
        "improve": "the cheapest changes that reach a goal",
    },
    "A controller: contours, friction, loops": {
        "drive": "contour error, torque and loops along a program or circle",
        "servo-data": "friction, K_v, margins, positioning from a controller's record",
    },
    "An NC program, block by block": {
        "machining": "load, stability and contacts of every block",
    },
    "A robot that mills": {
        "robot": "a robot from its datasheet: reducers, forces, its machine file",
        "reach": "poses that bring the tool to a place, and what holds there",
        "region": "the best place and segment to mill",
        "accuracy": "the error along a path, with the cut at the tool",
    },
    "A video of the machine": {
        "video": "modes from films of a machine that rings after a blow",
    },
}

# Commands that most people need rarely stand in groups, `toolpoint GROUP --help`; each also answers to its own name.
GROUPS: dict[str, tuple[str, tuple[str, ...]]] = {
    "cuts": ("Turning, a cut in time, coefficients from forces, speeds from a chatter tone.",
             ("turn", "mill", "calibrate", "speeds")),
    "tests": ("Machines that move or shake themselves, inputs to record from, the next test.",
              ("traverse", "axis-test", "devices", "next-test")),
    "studies": ("Spinning shafts, forces on the floor, slopes, design changes by a plan or to a goal.",
                ("campbell", "base", "sensitivity", "screen", "improve")),
    "robots": ("Poses, places and paths of a robot or a head.", ("reach", "region", "accuracy")),
    "files": ("Other formats, numbers changed by hand, schemas for editors, completion in a shell.",
              ("convert", "change", "export", "schema", "completion")),
}
GROUPED_COMMANDS = frozenset(name for _, names in GROUPS.values() for name in names)
LINE_OF_COMMAND = {name: line for lines in COMMANDS_OF_QUESTION.values() for name, line in lines.items()}
