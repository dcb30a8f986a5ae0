"""Examples in docstrings run as they are written, and show every name that a reread room exports."""

import doctest
import importlib
import inspect
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src" / "toolpoint"
EXAMPLES = SOURCE.parents[1] / "examples"
MODULES = [f"toolpoint.{path.relative_to(SOURCE).with_suffix('').as_posix().replace('/', '.')}"
           for path in sorted(SOURCE.rglob("*.py")) if ">>> " in path.read_text(encoding="utf-8")]
# Rooms whose exported names stand in examples, and the names left out: results, shown by the functions that make them, and
# constants.
ROOMS_WITH_EXAMPLES = {
    "acquisition": set(),
    "spatial": set(),
    "joints": {"DIRECTIONS"},
    "bodies": set(),
    "bodies.solid": {"CAST_IRON", "STEEL"},
    "signals": {"DrivenAxisTest"},
    "vibration": set(),
    "vibration.sparse": set(),
    "cutting": set(),
    "drives": set(),
    "kinematics": set(),
    "substructuring": set(),
    # Left out: questions that need records, a video or a file, or take longer than an example may (50 ms).
    "studies": {
        "DrivenAxisStudy", "FILMED_TRUTH", "HeardWindow", "LiveProgress", "LiveTap", "MassCalibration",
        "OperationalStudy", "TraverseStudy", "TraverseWindow", "bases_from_gauge", "bases_of_responses", "calibrate",
        "calibrate_on_mass", "chart_lobes", "chart_turning", "choose_turns", "compare_branches", "decisive_window",
        "film_machine", "follow_blows", "follow_cut", "improve_by_plan", "improve_machine", "judge_servo_data",
        "listen", "magnify_motion", "map_chatter", "map_servo", "map_speeds", "mill_path", "modal_dynamics",
        "place_test", "plan_test", "question_structure", "question_windows", "rank_interfaces", "rank_tests",
        "run_drives", "run_plan", "run_robot_demo", "search_regions", "seen_places", "servos_of", "simulate_cut",
        "solve_matrix_modes", "structure_of", "study_base_reactions", "study_circle", "study_datasheet", "study_driven_axis",
        "study_example_mill", "study_finite_elements", "study_hammer_records", "study_joints", "study_machine",
        "study_machine_and_responses", "study_operational", "study_region", "study_responses", "study_tap",
        "study_tool", "study_traverse", "study_video", "study_videos", "study_workspace", "update_from_videos",
        "update_from_virtual_videos", "update_machine",
    },
}


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_run(name):
    result = doctest.testmod(importlib.import_module(name), verbose=False)
    assert result.attempted and not result.failed


@pytest.mark.parametrize("room", ROOMS_WITH_EXAMPLES)
def test_every_exported_name_stands_in_an_example(room):
    folder = SOURCE / room.replace(".", "/")
    text = "\n".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
    examples = "\n".join(re.findall(r"^ +(?:>>>|\.\.\.) .*$", text, re.MULTILINE))
    module = importlib.import_module(f"toolpoint.{room}")
    assert not [name for name in sorted(set(module.__all__) - ROOMS_WITH_EXAMPLES[room])
                if not re.search(rf"\b{name}\b", examples) and ">>>" not in (getattr(module, name).__doc__ or "")]


# Exported classes and functions whose own docstring shows no use: questions that need a record, a video or seconds, their
# results and pages, devices and servers. Examples of what makes a result may show it all the same. Only ever lowered.
MAX_NAMES_WITHOUT_EXAMPLE = 13


def test_exported_names_have_an_example_of_their_own():
    """In the docstring of the class or function itself, or in that of one of a class's methods."""
    exported = {}
    for path in sorted(SOURCE.rglob("__init__.py")):
        module = importlib.import_module(".".join(("toolpoint", *path.parent.relative_to(SOURCE).parts)))
        exported |= {id(value): value for value in (getattr(module, name) for name in getattr(module, "__all__", ()))
                     if inspect.isclass(value) or inspect.isfunction(value)}
    assert len(exported) > 600
    missing = sorted(f"{value.__module__}.{value.__qualname__}" for value in exported.values() if not _has_example(value))
    assert len(missing) <= MAX_NAMES_WITHOUT_EXAMPLE, missing


def _has_example(value):
    """Lines that run, in its docstring or that of a method; or the name of a file in `examples/` that uses it and is run."""
    parts = [value, *(vars(value).values() if inspect.isclass(value) else ())]
    texts = [getattr(part, "__doc__", None) or "" for part in parts]
    files = re.findall(r"Runs in ``examples/(\w+\.py)``", texts[0])
    return any(">>> " in text for text in texts) or any(
        re.search(rf"\b{value.__name__}\b", (EXAMPLES / file).read_text(encoding="utf-8")) for file in files)
