"""A machine at its poses, its frequencies and its tool's stiffness over two axes, as a page (as `toolpoint demo gantry`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.cutting import ZeroOrder
from toolpoint.io import read_machine
from toolpoint.pages import workspace_page
from toolpoint.studies import study_workspace


def main() -> float:
    """Return the sum of the compliances along x, y and z over that of the principal ones: 1, the trace of a matrix."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "gantry.yaml") as path:
        machine, text = read_machine(path), path.read_text(encoding="utf-8")
    study = study_workspace(machine, {"Y": np.linspace(-1, 1, 5), "X": np.linspace(-0.8, 0.8, 5)}, method=ZeroOrder())
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(workspace_page(study, source=text, file_name="gantry.yaml").save(folder))
    compliance = 1 / study.stiffness.stiffness
    return float((compliance[..., :3].sum(axis=-1) / compliance[..., 3:].sum(axis=-1)).mean())


if __name__ == "__main__":
    main()
