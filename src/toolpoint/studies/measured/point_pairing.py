"""Pairing of measured points with points of a machine, and the transform between their frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint._doubt import Doubt
from toolpoint.spatial import registration
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Dof, Frf, Modes

EQUAL_FIT_RATIO = 2.0  # residual of another placing over the best one, below which both fit


@dataclass(frozen=True, eq=False)
class PointPairing:
    """Pairs of measured and model points.

    pairs : measured to model point; distance : of each, m; transform : (4, 4) from test to model frame; single : points without
    a partner; doubts : of the registration.
    """

    pairs: Mapping[str | int, str | int]
    distance: Mapping[str | int, float]
    transform: FloatArray
    single: tuple[str | int, ...]
    status: str
    doubts: tuple[Doubt, ...] = ()

    def renamed(self, modes: Modes) -> Modes:
        """Return measured modes at the model's point names, directions turned into the model's frame; single points go."""
        keep = self._kept("modes", modes.dofs)
        return replace(modes.at_dofs(keep), dofs=self.labels(keep))

    def renamed_frf(self, frf: Frf) -> Frf:
        """Return measured responses in the same way; inputs and outputs at single points go."""
        outputs, inputs = self._kept("frf outputs", frf.outputs), self._kept("frf inputs", frf.inputs)
        return replace(frf.selected(outputs, inputs), outputs=self.labels(outputs), inputs=self.labels(inputs))

    def labels(self, measured: Sequence[Dof]) -> tuple[Dof, ...]:
        """Return measured Dofs as those of the model."""
        rotation = self.transform[:3, :3]
        return tuple(d.turned(rotation, self.pairs[d.point]) for d in measured)

    def _kept(self, what: str, measured: Sequence[Dof]) -> list[Dof]:
        keep = [d for d in measured if d.point in self.pairs]
        if not keep:
            fail(what, f"no paired point ({self.status})", "must share points with the pairing",
                 remedy="toolpoint correlate: give --components, three of --pair TEST=MODEL, or a larger --furthest")
        if any(d.is_rotation for d in keep):
            fail(what, "rotational Dofs", "points are paired for translations", remedy="use at_dofs or selected first")
        return keep

    @classmethod
    def identity(cls, points: Sequence[str | int]) -> PointPairing:
        """Return the pairing of points that have the same names (as text) and frame in test and model."""
        return cls({p: str(p) for p in points}, dict.fromkeys(points, 0.0), np.eye(4), (), "the same points in test and model")


def pair_points(
    test: Mapping[str | int, ArrayLike], model: Mapping[str | int, ArrayLike], furthest: float,
    *, known_pairs: Mapping[str | int, str | int] | None = None, start: FloatArray | None = None,
) -> PointPairing:
    """Return the one-to-one pairing with the least sum of squared distances after registration.

    Parameters
    ----------
    test, model : point to (3,) position, m
        Each in its own frame.
    furthest : float
        Pairs further apart after registration are left single, m.
    known_pairs : mapping of test to model point, optional
        At least three pairs that fix the transform; otherwise ICP from `start`, which must be near.
    """
    positive("furthest", furthest)
    a = np.array([floats(f"test[{n!r}]", p, (3,)) for n, p in test.items()])
    b = np.array([floats(f"model[{n!r}]", p, (3,)) for n, p in model.items()])
    names, others = list(test), list(model)
    if known_pairs is not None:
        missing_points = [str(n) for n in (*known_pairs, *known_pairs.values()) if n not in (*names, *others)]
        if missing_points:
            fail("known_pairs", f"no point {', '.join(missing_points)}", "must be points of test and model")
        fit = registration.rigid(a[[names.index(k) for k in known_pairs]], b[[others.index(v) for v in known_pairs.values()]])
    else:
        fit = registration.iterative_closest_point(a, b, start)
    distance = cdist(tf.move(fit.transform, a), b)
    # The best pairing of all at once: nearest neighbours may both want the same point.
    rows, columns = linear_sum_assignment(distance**2)
    close_pairs = [(i, j) for i, j in zip(rows, columns, strict=True) if distance[i, j] <= furthest]
    pairs = {names[i]: others[j] for i, j in close_pairs}
    single = tuple(n for n in names if n not in pairs)
    status = fit.status if not single else (
        f"{fit.status}; {len(single)} of {len(names)} test points have no model point within {furthest:g} m: check units, "
        "give known pairs, or a nearer start")
    return PointPairing(pairs, {names[i]: float(distance[i, j]) for i, j in close_pairs}, fit.transform, single, status)


def register_points(test: Mapping[str | int, ArrayLike], model: Mapping[str | int, ArrayLike]
                    ) -> tuple[FloatArray, Doubt | None]:
    """Return a start (4, 4) for `pair_points` without known pairs, and a doubt where another start fits nearly as well.

    The 24 turns that carry axes onto axes, the middles of both boxes on each other, each followed by ICP; the least distance
    wins. It needs a frame of the test whose axes lie within about 20 degrees of axes of the model, in either order, points
    that reach over the same box as the model's, and a machine that does not look alike from several sides.
    """
    a, b = (np.array([floats("points", p, (3,)) for p in points.values()]) for points in (test, model))
    middles = [(p.max(axis=0) + p.min(axis=0)) / 2 for p in (a, b)]
    fits = []
    for turn in axis_turns():
        start = tf.transform(turn, middles[1] - turn @ middles[0])
        fits.append(registration.iterative_closest_point(a, b, start))
    fits.sort(key=lambda fit: fit.residual)
    best = fits[0]
    # Starts that end at the same transform are no rivals.
    others = [fit.residual for fit in fits[1:] if np.abs(fit.transform - best.transform).max() > 0.05]
    doubt = None
    if others and others[0] < EQUAL_FIT_RATIO * best.residual:
        doubt = Doubt("registration", f"another placing of the test's frame fits nearly as well ({1e3 * others[0]:.3g} mm "
                      f"against {1e3 * best.residual:.3g} mm)", "give three known pairs", figure=best.residual / others[0])
    return best.transform, doubt


def axis_turns() -> list[FloatArray]:
    """Return the 24 rotations (3, 3) that carry axes onto axes."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turn = np.eye(3)[list(order)] * np.array(signs)[:, None]
            # A mirrored set of axes is no turn.
            if np.linalg.det(turn) > 0:
                turns.append(turn)
    return turns
