"""A small mill filmed in two planes: its soft joints by the videos, and its model updated (as `toolpoint demo video-mill`)."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import FILMED_TRUTH, update_from_virtual_videos


def main() -> float:
    """Print ranking and update; return the lower FRAC of both planes after the update."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "small_mill.yaml") as path:
        machine = read_machine(path)
    result = update_from_virtual_videos(machine, FILMED_TRUTH, "spindle_nose", rng=np.random.default_rng(1))
    print(result.update.ranking.table())
    print(f"soft joints: {', '.join(result.update.ranking.moving)}; FRAC {result.frac[:, 1]}")
    return float(result.frac[:, 1].min())


if __name__ == "__main__":
    main()
