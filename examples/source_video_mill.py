"""The small mill of its source: filmed in two planes, soft interfaces ranked, updated; which interfaces matter, drawn."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.studies import FILMED_TRUTH, Factor, draw_conclusions, update_from_virtual_videos
from toolpoint.vibration import frequency_response

LINES, PLANES = np.linspace(5.0, 100.0, 381), ("spindle_nose:+x", "spindle_nose:+y")
JOINTS = ("floor_base", "base_column", "column_housing", "base_cross_slide")
UNKNOWN = [Factor(name, (path,), low, high) for name, path, low, high in (
    ("bolts", "joints.base_column.stiffness.*", 0.1, 10.0), ("slide", "joints.base_cross_slide.stiffness.*", 0.1, 10.0),
    ("floor", "joints.floor_base.stiffness.*", 0.5, 2.0), ("housing", "joints.column_housing.stiffness.*", 0.5, 2.0),
    ("damping", "joints.*.damping.*", 0.2, 5.0), ("density", "bodies.*.density", 0.7, 1.4))]


def responses(machine: Any) -> list[Any]:
    """Return the direct responses at the spindle nose in both planes."""
    return [frequency_response.direct(assemble(machine, None, (label,)), LINES).values[:, 0, 0] for label in PLANES]


def errors(machine: Any) -> dict[str, float]:
    """Return how far twice the springs and dampers of each interface move the responses, relative (mean of the planes)."""
    result, now = {}, responses(machine)
    for joint, law in ((joint, machine.description.joints[joint]) for joint in JOINTS):
        paths = [f"joints.{joint}.{kind}.{way}" for kind in ("stiffness", "damping") for way in getattr(law, kind)]
        new = responses(machine.with_values({path: 2 * machine.value(path) for path in paths}))
        result[joint] = float(np.mean([np.abs(a - b).sum() / np.abs(b).sum() for a, b in zip(new, now, strict=True)]))
    return result


def judge(machine: Any) -> dict[str, bool]:
    """Return which conclusions of the source hold for a mill."""
    change = errors(machine)
    rest = max(change["base_column"], change["base_cross_slide"])
    return {"two_matter": min(change["floor_base"], change["column_housing"]) > rest, "rest_nothing": rest < 0.05,
            "floor": change["floor_base"] > rest, "housing": change["column_housing"] > rest}


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "small_mill.yaml") as path:
        machine = read_machine(path)
    result = update_from_virtual_videos(machine, FILMED_TRUTH, "spindle_nose", rng=np.random.default_rng(1))
    ranking = result.update.ranking
    order = ", ".join(entry.joint for entry in ranking.interfaces)
    numbers: dict[str, Any] = {"order": order, "moving": ", ".join(ranking.moving)}
    for plane, video, (before, after) in zip(("xz", "yz"), result.videos, result.frac, strict=True):
        numbers |= {f"before_{plane}": before, f"after_{plane}": after,
                    **{f"{plane}{k}": value for k, value in enumerate(video.modes.frequency, 1)}}
        numbers |= {f"{plane}{k + 1}_percent": 100 * (video.modes.frequency[k] / f - 1) for k, f in enumerate((13, 64))}
    filmed = machine.with_values(dict(FILMED_TRUTH))
    numbers |= {f"change_{joint}": 100 * value for joint, value in errors(filmed).items()}
    drawn = draw_conclusions(filmed, UNKNOWN, judge, draws=draws, rng=np.random.default_rng(1))
    return numbers | drawn.summary()


if __name__ == "__main__":
    print(main())
