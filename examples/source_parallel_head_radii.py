"""The parallel head of its source with other radii, which are not published: which conclusions still hold."""

import json
import runpy
import tempfile
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from toolpoint import ToolpointError
from toolpoint.io import read_machine

HINGE_RADIUS, RATIO = (0.25, 0.5), (0.5, 0.95)  # m; spherical joints by the radius of the hinges
LENGTH = 0.905538513814  # m, of a limb where the file describes it: kept, so that its reduction stays the same


def head_with_radii(hinge: float, spherical: float) -> Any:
    """Return the head with its hinges and spherical joints on other circles, m; at the reference the platform is level."""
    text = (resources.files("toolpoint.app") / "machines" / "three_rps_tested_head.yaml").read_text(encoding="utf-8")
    machine = YAML(typ="safe").load(text)
    height = -np.sqrt(LENGTH**2 - (hinge - spherical) ** 2)
    lean = -np.pi + np.arctan2(hinge - spherical, -height)
    for k, azimuth in enumerate(2 * np.pi * np.arange(3) / 3, start=1):
        way = np.array([np.cos(azimuth), np.sin(azimuth), 0])
        base, ball = (hinge * way).tolist(), [*(spherical * way)[:2].tolist(), float(height)]
        turned = [*machine["joints"][f"ball{k}"]["rotation"][:2], float(lean)]
        machine["bodies"][f"frame{k}"]["centre"] = base
        machine["bodies"][f"limb{k}"]["frame"] = {"at": ball, "rotation": turned}
        for joint, place in ((f"hinge{k}", base), (f"slide{k}", base), (f"ball{k}", ball)):
            machine["joints"][joint] |= {"at": place, "rotation": turned}
    machine["bodies"]["platform"]["centre"] = machine["points"]["platform"]["at"] = [0, 0, float(height)]
    for name in ("tip", "work"):
        machine["points"][name]["at"] = [0, 0, float(height) - 0.2]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "head.yaml")
        path.write_text(json.dumps(machine), encoding="utf-8")  # JSON is YAML, and it writes every digit
        return read_machine(path)


def main(draws: int = 2) -> dict[str, Any]:
    """Return at how many drawn pairs of radii each conclusion holds, by name; poses out of reach are no draws."""
    judge = runpy.run_path(str(Path(__file__).with_name("source_parallel_head.py")))["judge"]
    rng = np.random.default_rng(2)
    held: list[dict[str, bool]] = []
    while len(held) < draws:
        hinge = rng.uniform(*HINGE_RADIUS)
        try:
            held.append(judge(head_with_radii(hinge, hinge * rng.uniform(*RATIO))))
        except ToolpointError:
            continue
    return {"radii_draws": draws} | {f"radii_{name}": int(sum(one[name] for one in held)) for name in held[0]}


if __name__ == "__main__":
    main()
