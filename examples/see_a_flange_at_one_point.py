"""Twelve sensors and twelve blows around a flange become its six motions at one point, and how rigid the flange is."""

import numpy as np

from toolpoint import Dof, Frf
from toolpoint.spatial.rotation import skew
from toolpoint.substructuring import VirtualPoint, reduce_to_points


def main() -> float:
    """Return how far the six by six responses are from the true ones, relative."""
    rng = np.random.default_rng(3)
    corners = {1: [0.1, 0.1, 0.0], 2: [-0.1, 0.1, 0.02], 3: [-0.1, -0.1, 0.0], 4: [0.1, -0.1, 0.03]}
    places = {point: np.array(at) for point, at in corners.items()}
    labels = [Dof(point, way) for point in places for way in ("+x", "+y", "+z")]
    flange = VirtualPoint("flange", np.zeros(3), labels, labels, places)
    rigid = np.concatenate([np.hstack([np.eye(3), -skew(at)]) for at in places.values()])  # motion of the sensors: v + w x r
    truth = rng.normal(size=(5, 6, 6)) + 1j * rng.normal(size=(5, 6, 6))
    result = reduce_to_points(Frf(np.arange(1.0, 6.0), rigid @ truth @ rigid.T, labels, labels), [flange])
    print(result, *result.notes, sep="\n")
    return float(np.abs(result.values - truth).max() / np.abs(truth).max())


if __name__ == "__main__":
    main()
