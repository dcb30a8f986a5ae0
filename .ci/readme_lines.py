"""Every shell block of the README, run as it stands in an empty folder of its own: `python .ci/readme_lines.py BIN`.

BIN holds the commands of an installed package. Left out are blocks that set up an environment or build the manual, and lines
that wait for a browser; demos that `.ci/run` runs by themselves are named there.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

README = Path(__file__).resolve().parents[1] / "README.md"
LEFT_OUT_BLOCKS = ("python3 -m venv", "sphinx-build")
LEFT_OUT_LINES = ("toolpoint serve", "toolpoint demo project", "toolpoint demo video-mill")


def blocks() -> list[str]:
    """Return the blocks that are run, without the lines that are not."""
    texts = re.findall(r"^```sh\n(.*?)^```$", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    kept = ["".join(line for line in text.splitlines(keepends=True) if not line.startswith(LEFT_OUT_LINES)) for text in texts
            if not any(words in text for words in LEFT_OUT_BLOCKS)]
    return [text for text in kept if text.strip()]


def main() -> None:
    """Run the blocks; the first that fails ends with its output."""
    environment = {**os.environ, "PATH": f"{Path(sys.argv[1]).resolve()}{os.pathsep}{os.environ['PATH']}"}
    for text in blocks():
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(["bash", "-euc", text], cwd=folder, env=environment, capture_output=True, text=True)
        print(f"{'ran' if done.returncode == 0 else 'FAILED'}: {text.splitlines()[0]}")
        if done.returncode:
            sys.exit(done.stdout + done.stderr)


if __name__ == "__main__":
    main()
