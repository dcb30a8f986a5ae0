"""Ctrl-C at random moments over ten commands: code 130 within three seconds, no traceback, no process left, kept parts whole.

    python benchmarks/app/interrupts.py [--moments 200] [--seed 0]

Every command first runs to its end, for its time; then a SIGINT is sent to it at moments that are spread evenly over that time,
in a random order, from the time on that the interpreter takes to start. A chatter map with a folder is resumed after four
interruptions and must give the numbers of the run that nobody interrupted. The last line is the figure.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import ROOT, CommandLine

MACHINES = ROOT / "src" / "toolpoint" / "app" / "machines"
ALLOWED_S = 3.0
BEGUN_S = 0.15  # s within which the interpreter itself starts: no line of the package has run



@dataclass
class Command:
    """A command line, the time that it takes, and what its interruptions did wrong."""

    name: str
    arguments: list[str]
    seconds: float = 0.0
    done: int = 0
    ended: int = 0
    faults: list[str] = field(default_factory=list)


def commands(folder: Path) -> list[Command]:
    """Return ten commands; files that they need are made in the folder."""
    machine, drives = str(MACHINES / "three_axis_vertical.yaml"), str(MACHINES / "three_axis_vertical_drives.yaml")
    robot = str(next(MACHINES.glob("*robot*.yaml")))
    run(["frf", machine, "--save", str(folder / "tip.h5")], folder)
    return [
        Command("demo", ["demo", "-o", "demo"]),
        Command("report", ["report", machine, "-o", "report"]),
        Command("lobes", ["lobes", machine, "--speeds", "300:6000:300", "-o", "lobes"]),
        Command("lobes --frf", ["lobes", "--frf", "tip.h5", "--x", "tool-table:+x", "--y", "tool-table:+y", "--kt", "2000",
                                "--kn", "800", "--speeds", "1000:6000:40", "-o", "measured"]),
        Command("mill", ["mill", machine, "--speed", "3000", "--depth", "1", "-o", "mill"]),
        Command("map", ["map", drives, "--axis", "X=-0.3:0.3:21", "--axis", "Y=-0.2:0.2:21", "-o", "map"]),
        Command("map-chatter", ["map-chatter", machine, "--axis", "X=-300mm:300mm:5", "--axis", "Y=-200mm:200mm:5",
                                "--workers", "2", "-o", "chatter"]),
        Command("reach", ["reach", robot, "--tip", "690mm,20mm,100mm"]),
        Command("sensitivity", ["sensitivity", machine, "-o", "sensitivity"]),
        Command("identify", ["identify", "tip.h5", "-o", "identify"]),
    ]


def start(arguments: list[str], folder: Path) -> subprocess.Popen:
    """Start a command as a process group of its own."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT / "src")}
    return subprocess.Popen([sys.executable, "-m", "toolpoint", *arguments], cwd=folder,
                            env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


def run(arguments: list[str], folder: Path) -> float:
    """Run a command to its end and return its seconds."""
    before = time.monotonic()
    process = start(arguments, folder)
    error = process.communicate()[1].decode()
    if process.returncode:
        raise SystemExit(f"{' '.join(arguments)}: code {process.returncode}\n{error}")
    return time.monotonic() - before


def interrupt(command: Command, moment: float, folder: Path) -> None:
    """Run a command and interrupt it; note what went wrong."""
    process = start(command.arguments, folder)
    time.sleep(moment)
    if process.poll() is not None:
        process.communicate()
        command.ended += 1
        return
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        error = process.communicate(timeout=30)[1].decode(errors="replace")
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        command.faults.append(f"{moment:.2f} s: ran on")
        return
    taken = time.monotonic() - sent
    command.done += 1
    if process.returncode == 0:  # the last moment of a run that had its result: nothing was left to interrupt
        command.ended += 1
    elif process.returncode != 130:
        command.faults.append(f"{moment:.2f} s: code {process.returncode}: {error[-200:]!r}")
    if "Traceback" in error or "Error:" in error.replace("error: interrupted", ""):
        command.faults.append(f"{moment:.2f} s: {error[-300:]!r}")
    if taken > ALLOWED_S:
        command.faults.append(f"{moment:.2f} s: took {taken:.1f} s")
    if left := living(process.pid):
        command.faults.append(f"{moment:.2f} s: processes {left} are left")
        os.killpg(process.pid, signal.SIGKILL)
    torn = [str(path) for path in folder.rglob("index.html") if "</html>" not in path.read_text()[-200:]]
    command.faults += [f"{moment:.2f} s: {path} is torn" for path in torn]


def living(group: int) -> list[int]:
    """Return the processes of a session that are alive half a second later."""
    time.sleep(0.5)
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            numbers = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(numbers[3]) == group and numbers[0] != "Z":
            found.append(int(status.parent.name))
    return found


def resumed(folder: Path, rng: np.random.Generator, times: int) -> str:
    """Interrupt a chatter map with a folder again and again, resume it, and compare it with a run that nobody interrupted."""
    machine = str(MACHINES / "three_axis_vertical.yaml")
    asked = ["map-chatter", machine, "--axis", "X=-300mm:300mm:6", "--axis", "Y=-200mm:200mm:6", "--json"]

    def result(store: str) -> dict:
        process = start([*asked, "--folder", store], folder)
        return json.loads(process.communicate()[0])

    whole = result("whole")
    before = run([*asked, "--folder", "timed"], folder)
    for moment in rng.uniform(0.3, before, times):
        process = start([*asked, "--folder", "broken"], folder)
        time.sleep(float(moment))
        process.send_signal(signal.SIGINT)
        process.communicate()
    return "the same" if result("broken") == whole else "OTHER"


def main() -> None:
    """Interrupt all commands and print what went wrong."""
    parser = CommandLine(__doc__)
    parser.cases("moments", 200)
    parser.seed(0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    folder = Path(tempfile.mkdtemp())
    asked = commands(folder)
    for command in asked:
        run(command.arguments, folder)
        command.seconds = run(command.arguments, folder)
    each = -(-options.moments // len(asked))
    for command in asked:
        share = (np.arange(each) + rng.uniform(size=each)) / each
        for moment in rng.permutation(BEGUN_S + share * (command.seconds - BEGUN_S)):
            interrupt(command, float(moment), folder)
        print(f"{command.name}: {command.seconds:.1f} s, {command.done} interrupted, {command.ended} had ended, "
              f"{len(command.faults)} faults", *command.faults[:5], sep="\n  ", flush=True)
    same = resumed(folder, rng, 4)
    shutil.rmtree(folder, ignore_errors=True)
    done, faults = sum(c.done for c in asked), sum(len(c.faults) for c in asked)
    print(f"{done} interruptions, {faults} faults; a map interrupted four times and resumed gives {same} numbers")


if __name__ == "__main__":
    main()
