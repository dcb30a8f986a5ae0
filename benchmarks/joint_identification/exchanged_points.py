"""Two exchanged points of one body of a test: are they left out, and are the joints those without the slip.

The tests are those of misplaced_points.py, four to eight points a body in turn. Every machine is identified as it is, with the
stated places of two random points of one random body exchanged, and with the measured shapes of two random points of two bodies
exchanged (their names, in the test).

    python benchmarks/joint_identification/exchanged_points.py [--first 0] [--seeds 30]

Left out: exactly these two. Stopped: an error that names both (the other points do not determine the body). Unseen: no exchange
is said; the distance between the two is printed.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification.misplaced_points import Shapes, errors_of, identified, random_shapes
from toolpoint._check import ToolpointError

POINTS_PER_BODY = (4, 5, 6, 8)
TITLES = ("as it is", "exchanged", "names exchanged")


def exchanged_pair(test: Shapes, rng: np.random.Generator) -> tuple[str, str]:
    """Return two random points of one random body."""
    groups = list(test.case.points.components.values())
    first, second = rng.choice(groups[int(rng.integers(len(groups)))], 2, replace=False).tolist()
    return first, second


def exchanged_names(test: Shapes, rng: np.random.Generator) -> tuple[Shapes, tuple[str, str]]:
    """Return the test with the shapes of two random points of two bodies exchanged, and these."""
    groups = list(test.case.points.components.values())
    chosen = rng.choice(len(groups), 2, replace=False)
    first, second = (str(rng.choice(groups[k])) for k in chosen)
    rows = {name: [k for k, dof in enumerate(test.modes.dofs) if str(dof.point) == name] for name in (first, second)}
    order = np.arange(len(test.modes.dofs))
    order[rows[first]], order[rows[second]] = rows[second], rows[first]
    modes = replace(test.modes, shape=test.modes.shape[order], shape_variance=test.modes.shape_variance[order])
    return replace(test, modes=modes), (first, second)


def answer_of(test: Shapes, points: dict, pair: tuple[str, str]) -> tuple[str, list[float], list[bool]]:
    """Return what is said of the points, and errors of the stiffnesses with whether their intervals hold."""
    try:
        result = identified(test, points)
    except ToolpointError as error:
        words = str(error).split(";")[0]
        return ("stopped" if "exchanged" in words and all(str(p) in words.replace(":", " ").split() for p in pair)
                else f"refused: {error}"), [], []
    left_out = [point for each in result.wrong_points.exchanged for point in each.places]
    said = "unseen"
    if left_out:
        said = "left out" if set(map(str, left_out)) == set(map(str, pair)) else f"others left out: {left_out}"
    elif result.wrong_points.misplaced:
        said = f"misplaced: {[each.point for each in result.wrong_points.misplaced]}"
    return said, *errors_of(test, result)


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 30)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    said, errors, held = ({title: [] for title in TITLES} for _ in range(3))
    for seed in range(given.first, given.first + given.seeds):
        per_body = POINTS_PER_BODY[seed % len(POINTS_PER_BODY)]
        test, rng = random_shapes(seed, per_body), np.random.default_rng(40_000 + seed)
        pair = exchanged_pair(test, rng)
        swap = {pair[0]: test.points[pair[1]], pair[1]: test.points[pair[0]]}
        renamed, names = exchanged_names(test, rng)
        line = f"{seed}, {per_body} points a body, {1e3 * np.linalg.norm(swap[pair[0]] - swap[pair[1]]):.0f} mm apart:"
        cases = ((test, test.points, pair), (test, {**test.points, **swap}, pair), (renamed, test.points, names))
        for title, (shapes, points, wrong) in zip(TITLES, cases, strict=True):
            words, error, inside = answer_of(shapes, points, wrong)
            said[title].append(words)
            errors[title] += error
            held[title] += inside
            line += f" {words}, worst {100 * max(error, default=np.nan):.1f} %;"
        print(line, file=sys.stderr, flush=True)
    for title in TITLES:
        counts = {words: said[title].count(words) for words in sorted(set(said[title]))}
        print(f"{title}: {counts}; stiffness error median {100 * np.median(errors[title]):.2f} %, worst "
              f"{100 * max(errors[title]):.1f} %, intervals hold {100 * np.mean(held[title]):.0f} % of {len(held[title])}")


if __name__ == "__main__":
    main()
