"""What would break on another system and can be seen on this one: encodings, modules, processes, file names, line endings."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = sorted((ROOT / "src/toolpoint").rglob("*.py"))
POSIX_MODULES = {"fcntl", "termios", "pwd", "grp", "resource", "tty", "pty", "posix", "spwd", "syslog"}
# Of `os` and `signal`, absent on Windows: used only where a guard stands around them.
POSIX_NAMES = {"os.fork", "os.getuid", "os.geteuid", "os.getpgid", "os.killpg", "os.nice", "os.sched_setaffinity", "os.mkfifo",
               "os.setsid", "os.wait", "os.uname", "signal.SIGKILL", "signal.SIGSTOP", "signal.SIGHUP", "signal.SIGUSR1",
               "signal.alarm", "os.sched_getaffinity", "os.statvfs"}
RESERVED_NAMES = {"con", "prn", "aux", "nul", *(f"{name}{n}" for name in ("com", "lpt") for n in range(1, 10))}
TEXT_METHODS = {"read_text", "write_text"}


def trees(words: str) -> Iterator[tuple[Path, ast.Module]]:
    """Yield the modules whose text holds one of the words: parsing and walking all of them took twenty seconds."""
    for path in SOURCE:
        if re.search(words, text := path.read_text(encoding="utf-8")):
            yield path, ast.parse(text)


def calls(words: str) -> Iterator[tuple[str, ast.Call]]:
    for path, tree in trees(words):
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                yield f"{path.relative_to(ROOT)}:{node.lineno}", node


def mode_of(call: ast.Call, place: int) -> str:
    """Return the mode of an `open`, empty where it is not a literal."""
    mode = next((word.value for word in call.keywords if word.arg == "mode"), call.args[place] if len(call.args) > place else
                ast.Constant("r"))
    return str(mode.value) if isinstance(mode, ast.Constant) else ""


def test_text_is_read_and_written_in_a_named_encoding():
    faults = []
    for place, call in calls(r"open\b|read_text|write_text"):
        name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
        is_text = name in TEXT_METHODS and isinstance(call.func, ast.Attribute) and not any(
            isinstance(call.func.value, ast.Call) and getattr(call.func.value.func, "attr", "") == "files" for _ in (0,))
        if isinstance(call.func, ast.Name) and name == "open":
            is_text = "b" not in (mode := mode_of(call, 1)) and mode != ""
        elif isinstance(call.func, ast.Attribute) and name == "open" and not isinstance(call.func.value, ast.Name):
            is_text = False  # of a library: its own modes
        if is_text and not any(word.arg in ("encoding", None) for word in call.keywords) and not (
                name == "read_text" and call.args) and not (name == "write_text" and len(call.args) > 1):
            faults.append(place)
    assert faults == []


def test_modules_and_names_that_windows_lacks_stand_behind_a_guard():
    faults = []
    names = "|".join(sorted({name.partition(".")[2] for name in POSIX_NAMES}))
    modules_named = "|".join(sorted(POSIX_MODULES))
    for path, tree in trees(rf"(?m)(import|from) +({modules_named})\b|^ *import .*,|\b(os|signal)\.({names})\b"):
        guarded = {id(inner) for node in ast.walk(tree) if isinstance(node, (ast.If, ast.Try, ast.FunctionDef, ast.With))
                   for inner in ast.walk(node)}
        for node in ast.walk(tree):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [str(node.module)]
                if POSIX_MODULES & {name.partition(".")[0] for name in modules} and id(node) not in guarded:
                    faults.append(f"{path.relative_to(ROOT)}:{node.lineno}: {modules}")
            if isinstance(node, ast.Attribute) and ast.unparse(node) in POSIX_NAMES:
                text = path.read_text(encoding="utf-8")
                if not any(guard in text for guard in ("sys.platform", "hasattr(os", "hasattr(signal", "os.name")):
                    faults.append(f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)}")
    assert faults == []


def test_processes_are_spawned_and_no_path_is_joined_as_text():
    faults = []
    for place, call in calls(r"get_context\(|set_start_method\(|os\.path\.join\(|os\.fork\("):
        words = ast.unparse(call)
        if ("get_context(" in words or "set_start_method(" in words) and "spawn" not in words:
            faults.append(f"{place}: {words}")
        if words.startswith(("os.path.join(", "os.fork(")):
            faults.append(f"{place}: {words}")
    assert faults == []


@cache
def tracked() -> tuple[str, ...]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True)
    if listed.returncode:
        pytest.skip("not a clone of the repository")
    return tuple(listed.stdout.decode("utf-8").strip("\0").split("\0"))


def test_names_of_files_are_those_of_every_system():
    names = tracked()
    assert len({name.casefold() for name in names}) == len(names)
    faults = [name for name in names for part in name.split("/")
              if part.partition(".")[0].lower() in RESERVED_NAMES or set(part) & set('<>:"\\|?*') or part.endswith((".", " "))
              or len(name) > 160 or not part.isascii()]
    assert faults == []


def test_texts_have_the_line_endings_of_one_system():
    faults = [name for name in tracked() if name.endswith((".py", ".md", ".js", ".css", ".yaml", ".toml", ".json", ".cff"))
              and b"\r\n" in (ROOT / name).read_bytes()]
    assert faults == []
