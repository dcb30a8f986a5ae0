"""What a person waits for before anything is computed: help, version and errors of every command, in CPU seconds.

    python benchmarks/app/start_up.py [--runs 2]

Every command is asked for its help, called with a file that is not there, with a file that is wrong inside, and some with a
good machine and a number that cannot be. Compiled modules are kept in a folder of the run, as Python keeps them after the first
call of any installed program. Last line: the largest CPU time of one call (the least of its runs: other work only adds).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine

MACHINE = "toolpoint: 1\nbodies:\n  column: {mas: 100 kg}\njoints:\n  foot: {parent: ground, child: colum}\n"
# Command and the arguments that it needs beside wrong files: {yaml} a machine, {frf} responses, {missing} nothing.
FAULTY = [
    "check {yaml}", "report {yaml}", "report --frf {frf}", "modes {yaml}", "map {yaml} --axis X=0:1:2",
    "campbell {yaml}", "robot {yaml}", "reach {yaml} --tip 0,0,0", "region {yaml} --along x=0:1:3",
    "accuracy {yaml} --square 200mm --speed 3000 --depth 1", "screen {yaml}", "improve {yaml} --answer peak --goal 1",
    "export {yaml} out.xml", "map-chatter {yaml} --axis X=0:1:2", "identify {frf}", "correlate {yaml} {frf}",
    "sensitivity {yaml}", "joints {frf} --geometry {frf} --components {yaml}", "frf {yaml}", "next-test {yaml}",
    "update {yaml} --frf {frf}", "video {frf} --fps 100", "lobes --frf {frf}", "lobes {yaml}", "rcsa {yaml} --frf {frf}",
    "turn --frf {frf} --kf 1500", "calibrate {frf} --teeth 4 --speed 3000 --depth 2 --feed 0.1",
    "mill {yaml} --speed 9000 --depth 2", "drive {yaml} --circle 50,4000", "servo-data {frf}", "demo nothing",
    "speeds --chatter -1 --teeth 4", "chekc", "lobes --teath 4",
]
# A good machine, and a number that cannot be.
IMPOSSIBLE = ["lobes {good} --immersion 3", "lobes {good} --helix nan", "mill {good} --speed 9000 --depth -2",
              "map-chatter {good} --axis X=0:0.1:2 --teeth 0", "modes {good} --pose Q=9", "lobes {good} --pose X=99m"]
GOOD = MACHINE_TEMPLATES / "three_axis_vertical.yaml"


def cpu_of(arguments: Sequence[str], folder: str) -> tuple[float, int]:
    """Return CPU seconds (user and system) and exit code of one call of the command line."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    kept["PYTHONPYCACHEPREFIX"] = str(Path(folder) / "compiled")
    with open(os.devnull, "w") as silent:
        process = subprocess.Popen([sys.executable, "-m", "toolpoint", *arguments], cwd=folder, env=kept, stdout=silent,
                                   stderr=silent)
        _, status, usage = os.wait4(process.pid, 0)
    return usage.ru_utime + usage.ru_stime, os.waitstatus_to_exitcode(status)


def calls(folder: Path) -> dict[str, int]:
    """Return every call with the exit code that it must end with."""
    from toolpoint.app.main import MODULE_OF_COMMAND

    wrong, text = folder / "wrong.yaml", folder / "wrong.txt"
    wrong.write_text(MACHINE)
    text.write_text("this is no response\n1 2\nthree\n")
    missing = {"yaml": folder / "none.yaml", "frf": folder / "none.txt"}
    helps = {f"{name} --help": 0 for name in sorted(MODULE_OF_COMMAND)} | {"--help": 0, "--version": 0}
    impossible = {call.format(good=GOOD): 2 for call in IMPOSSIBLE}
    wrongs = {call.format(**names): 2 for names in ({"yaml": wrong, "frf": text}, missing) for call in FAULTY}
    return helps | wrongs | impossible


def main() -> None:
    """Print every call with its CPU time, the slowest last."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 2)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for call, code in calls(Path(folder)).items():
            times, codes = zip(*(cpu_of(call.split(), folder) for _ in range(runs)), strict=True)
            remark = "" if set(codes) == {code} else f"  ended with {codes}"
            rows.append((min(times), call.replace(folder + os.sep, ""), remark))
    for seconds, call, wrong_end in sorted(rows):
        print(f"{seconds:6.2f} s  toolpoint {call}{wrong_end}")
    print(f"largest CPU time of {len(rows)} calls that compute nothing: {max(rows)[0]:.2f} s")


if __name__ == "__main__":
    main()
