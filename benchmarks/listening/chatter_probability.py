"""Coefficients of the probability of chatter, fitted to random cuts with known truth; seeds apart from those of the bars."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.listening.heard_cuts import cuts
from toolpoint.studies.listening.evidence import gather_evidence
from toolpoint.studies.listening.probability import MAX_BROADBAND_RATIO, features_of

RIDGE = 0.001


def fit(features: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the coefficients by Newton's method on the penalised likelihood; the constant is not penalised."""
    coefficients = np.zeros(features.shape[1])
    penalty = RIDGE * truth.size / 10 * np.diag([0.0] + [1.0] * (features.shape[1] - 1))
    for _ in range(50):
        p = 1 / (1 + np.exp(-features @ coefficients))
        slope = features.T @ (truth - p) - penalty @ coefficients
        curvature = (features * (p * (1 - p))[:, None]).T @ features + penalty + 1e-9 * np.eye(features.shape[1])
        coefficients = coefficients + np.linalg.solve(curvature, slope)
    return coefficients


def main() -> None:
    """Draw, fit, print."""
    parser = CommandLine(__doc__)
    parser.cases("cuts", 240)
    parser.seed(0)
    options = parser.parse_args()
    features, truth = [], []
    for number, cut in cuts(options.cuts, options.seed):
        evidence = gather_evidence(cut.record.samples[:, 0], cut.record.sample_rate, cut.problem.tool.teeth,
                                   speed=60 * cut.spindle if cut.programmed is None else cut.programmed)
        if evidence.broadband > MAX_BROADBAND_RATIO:  # such cuts are left open whatever the model says
            continue
        features.append(features_of(evidence))
        truth.append(cut.chatters)
        print(number, "chatter" if cut.chatters else "stable", np.round(features[-1], 2), flush=True)
    coefficients = fit(np.array(features), np.array(truth, float))
    print("coefficients:", ", ".join(f"{value:.2f}" for value in coefficients))


if __name__ == "__main__":
    main()
