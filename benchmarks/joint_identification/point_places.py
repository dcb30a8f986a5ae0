"""Unit and frame of tests of random machines, asked before the fit of joints: true ones doubted, turned ones turned back.

The machines: benchmarks/joint_identification/joint_machines.py. Each test as it is, in three random frames of the 24 turns
moved by up to 2 m, and in mm, inches and 1000 m read as m.

    python benchmarks/joint_identification/point_places.py [--machines 60]
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from toolpoint import ToolpointError, io
from toolpoint.spatial import transform as tf
from toolpoint.studies import place_test
from toolpoint.studies.measured.point_pairing import axis_turns


def verdict(points, components, truth) -> str:
    """Return what is made of a test whose frame is `truth`."""
    try:
        placement = place_test(points, components)
    except ToolpointError as error:
        return "unit refused" if "read as" in str(error) or "span" in str(error) else "left open in words"
    right = np.allclose(placement.transform[:3, :3], truth[:3, :3])
    return ("right" if right else "wrong") + (", doubted" if placement.doubts else ", silent")


def main() -> None:
    """Run the machines and print the figure."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 60)
    true, turned, scaled = Counter[str](), Counter[str](), Counter[str]()
    count = parser.parse_args().machines
    for seed in range(count):
        case, rng = jm.random_case(seed), np.random.default_rng(seed)
        with tempfile.TemporaryDirectory() as name:
            file = Path(name) / "components.yaml"
            file.write_text(jm.component_text(case, {}, None))
            components = io.read_components(file)
        points = case.points.coordinates
        true[verdict(points, components, np.eye(4))] += 1
        turns = [turn for turn in axis_turns() if not np.allclose(turn, np.eye(3))]
        for k in rng.choice(len(turns), 3, replace=False):
            frame = tf.transform(turns[k], rng.uniform(-2, 2, 3))
            turned[verdict({n: tf.move(tf.inverse(frame), at[None])[0] for n, at in points.items()}, components, frame)] += 1
        for factor in (1000.0, 1 / 0.0254, 1e-3):
            scaled[verdict({n: factor * at for n, at in points.items()}, components, np.eye(4))] += 1
        print(f"{seed}: true {dict(true)}; turned {dict(turned)}; scaled {dict(scaled)}", flush=True)
    print(f"{count} machines: true {dict(true)}; turned {dict(turned)}; in another unit {dict(scaled)}")


if __name__ == "__main__":
    main()
