"""Every template and every sample by the commands that a person types next: how they end, how long, how much memory.

    python benchmarks/app/template_walk.py [--templates robot,lathe]

A refusal (code 2) counts as an end where its message is one of `ALLOWED_REFUSALS`: a machine without a spinning body has no
Campbell diagram. Anything else, a warning of a library, more than `MAX_SECONDS` or `MAX_MEGABYTES` is a fault.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.frame import CommandLine
from toolpoint.io import list_templates
from toolpoint.samples import KINDS, write_samples

MAX_SECONDS, MAX_MEGABYTES = 120.0, 1000.0  # CPU of a command with its compiling; peak
COMMANDS = ("check m.yaml", "modes m.yaml", "report m.yaml -o page", "lobes m.yaml -o page",
            "mill m.yaml --speed 6000 --depth 0.5 -o page", "frf m.yaml --save tip.uff", "lobes --frf tip.uff -o page",
            "turn --frf tip.uff --kf 1500 -o page", "sensitivity m.yaml --count 3 -o page", "base m.yaml",
            "plan m.yaml -o page", "campbell m.yaml --speeds 0:6000:5 -o page", "export m.yaml out.xml",
            "convert tip.uff --to tip.h5", "identify tip.uff -o page")
ALLOWED_REFUSALS = ("no body that spins", "gravity or loads; cannot be written", "loops or elastic bodies; must be a tree",
                    "do not tell the shapes")


def _run(command: str, folder: Path) -> str | None:
    """Run a command and return what is wrong with how it ended."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-m", "toolpoint", *command.split()], cwd=folder, env=environment, text=True,
                          capture_output=True, timeout=3600, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    megabytes = after.ru_maxrss / 1024  # the largest child up to now: the first fault of memory hides later smaller ones
    print(f"  {command:60.60s} code {done.returncode}, {seconds:6.1f} CPU s, {time.monotonic() - start:6.1f} s, "
          f"{megabytes:5.0f} MB at most so far", flush=True)
    if done.returncode and not any(words in done.stderr for words in ALLOWED_REFUSALS):
        return f"code {done.returncode}: {done.stderr.strip().splitlines()[-1][:160] if done.stderr.strip() else 'no words'}"
    if "Warning:" in done.stderr or "Traceback" in done.stderr:
        return "a library's warning or a traceback reached the person"
    return f"{seconds:.0f} CPU s" if seconds > MAX_SECONDS else f"{megabytes:.0f} MB" if megabytes > MAX_MEGABYTES else None


def main() -> None:
    """Walk through templates and samples, and print the faults."""
    parser = CommandLine(__doc__)
    parser.add_argument("--templates", default="", help="names, comma separated; all and all samples where left out")
    names = parser.parse_args().templates
    faults, count = list[str](), 0
    for template in names.split(",") if names else list_templates("machine"):
        print(template)
        with tempfile.TemporaryDirectory() as folder:
            for command in (f"new machine m.yaml --template {template}", *COMMANDS):
                count += 1
                faults += [f"{template}: {command}: {fault}"] if (fault := _run(command, Path(folder))) else []
    for kind in [] if names else KINDS:
        print(kind)
        with tempfile.TemporaryDirectory() as folder:
            for command in write_samples(kind, Path(folder) / kind).commands:
                count += 1
                words = command.removeprefix("toolpoint ")
                if "*" in words:  # a shell's pattern
                    words = " ".join(str(path) for word in words.split()
                                     for path in (sorted(Path(folder, kind).glob(word)) if "*" in word else [word]))
                faults += [f"{kind}: {command}: {fault}"] if (fault := _run(words, Path(folder) / kind)) else []
    print("\n".join(faults))
    print(f"{len(faults)} of {count} commands ended otherwise than they should")


if __name__ == "__main__":
    main()
