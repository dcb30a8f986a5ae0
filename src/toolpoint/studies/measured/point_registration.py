"""Registration of a test's points with a machine's from any frame, by triangles of equal sides; doubts about other fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from toolpoint._check import FloatArray, IndexArray, ToolpointError, floats
from toolpoint._doubt import Doubt
from toolpoint.spatial import registration
from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.point_pairing import EQUAL_FIT_RATIO

MAX_TEST_TRIANGLES, MAX_PLACINGS_PER_TRIANGLE = 6, 400  # of the test that are tried; placings of each that are looked at
SIDE_TOLERANCE = 0.02  # of the size of the test, between sides of equal triangles
MIN_MIRROR_GAIN = 3.0  # residual over that of a mirrored placing
NEGLIGIBLE_FIT_RESIDUAL = 1e-3  # of the size of the test
UNIT_WORDS_BY_RATIO = {1000.0: "mm read as m", 1e-3: "m read as mm", 1 / 0.0254: "inches read as m"}
MAX_UNIT_RATIO = 2.5  # around a factor of units, either way


def register_anywhere(test: Mapping[str | int, ArrayLike], model: Mapping[str | int, ArrayLike], furthest: float
                      ) -> tuple[FloatArray | None, tuple[Doubt, ...]]:
    """Return the transform (4, 4) that carries test points onto the model's, from any frame, and doubts about it.

    Triangles of the test are laid on all triangles of the model with equal sides; each placing is scored by the distances from
    test to model points (each counts for `furthest`, m, at most), the best is refined. Of placings that fit alike, the one
    under which most points keep their names is taken, then the one that turns least. None where no triangle fits (three
    points, or points on a line, fix no frame).
    """
    a, b = (np.array([floats("points", p, (3,)) for p in points.values()]).reshape(-1, 3) for points in (test, model))
    words = _unit_doubt(a, b)
    if len(a) < 3 or len(b) < 3:
        return None, words
    # However wide the caller's limit: a point a fifth of the whole away is another point.
    limit = min(furthest, 0.2 * _size(a))
    fits = _placings(a, b, limit)
    if not fits:
        return None, words
    names = [str(n) for n in test], [str(n) for n in model]
    matrix, doubts = _choose_fit(fits, a, b, names)
    return matrix, (*words, *doubts, *_question_mirror(fits[0][0], a, b, limit))


def _choose_fit(fits: list[tuple[float, FloatArray]], a: FloatArray, b: FloatArray, names: tuple[list[str], list[str]]
                ) -> tuple[FloatArray, list[Doubt]]:
    size = _size(a)
    equal_fits = [fit for fit in fits if fit[0] <= max(EQUAL_FIT_RATIO * fits[0][0], NEGLIGIBLE_FIT_RESIDUAL * size)]
    kept = [_kept_names(matrix, a, b, names) for _, matrix in equal_fits]
    best = min(range(len(equal_fits)), key=lambda k: (-kept[k], _turn(equal_fits[k][1])))
    residual, matrix = equal_fits[best]
    others = [fit[0] for k, fit in enumerate(equal_fits) if k != best and kept[k] == kept[best]]
    is_unmoved = np.allclose(matrix, np.eye(4), atol=0.02 * max(1.0, size))
    if not others or is_unmoved or kept[best] > len(a) / 2:
        return matrix, []
    return matrix, [Doubt("registration", f"another placing of the test's frame fits as well ({1e3 * others[0]:.3g} mm against "
                          f"{1e3 * residual:.3g} mm)", "give three known pairs", figure=residual / max(others[0], 1e-300))]


def _question_mirror(residual: float, a: FloatArray, b: FloatArray, limit: float) -> list[Doubt]:
    if residual <= NEGLIGIBLE_FIT_RESIDUAL * _size(a):
        return []
    fits = _placings(a * [1, 1, -1], b, limit)
    if not fits or MIN_MIRROR_GAIN * fits[0][0] >= residual:
        return []
    return [Doubt("registration", f"with one axis mirrored the points fit to {1e3 * fits[0][0]:.3g} mm, as they are to "
                  f"{1e3 * residual:.3g} mm: the test's axes may be left-handed", "turn the sign of one axis")]


def _size(points: FloatArray) -> float:
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))


def _unit_doubt(a: FloatArray, b: FloatArray) -> tuple[Doubt, ...]:
    ratio = _size(a) / max(_size(b), 1e-300)
    words = unit_slip(ratio)
    return () if words is None else (
        Doubt("points", f"the test is {ratio:.3g} times as large as the machine, as {words} makes it", "check the unit of its "
              "geometry", figure=ratio),)


def unit_slip(ratio: float) -> str | None:
    """Return the mistaken unit of length, in words, by which a test is so many times as large as its machine; None for none."""
    return next((words for factor, words in UNIT_WORDS_BY_RATIO.items()
                 if 1 / MAX_UNIT_RATIO < ratio / factor < MAX_UNIT_RATIO), None)


def _placings(a: FloatArray, b: FloatArray, furthest: float) -> list[tuple[float, FloatArray]]:
    """Return root-mean-square distance (m, each at most `furthest`) and transform of distinct placings, best first."""
    tree = cKDTree(b)
    fits: list[tuple[float, FloatArray]] = []
    for corners in _triangles(a):
        rough = []
        for indices in _equal_triangles(a[corners], b, SIDE_TOLERANCE * _size(a)):
            try:
                matrix = registration.rigid(a[corners], b[indices]).transform
            except ToolpointError:  # on one line
                continue
            rough.append((_residual(tree, a, matrix, furthest), matrix))
        for _, matrix in sorted(rough, key=lambda fit: fit[0])[:12]:
            refined = _refine(tree, a, b, matrix, furthest)
            # Starts that end within two hundredths of each other found the same placing.
            if not any(np.abs(tf.move(refined[1], a) - tf.move(m, a)).max() < 0.02 * _size(a) for _, m in fits):
                fits.append(refined)
    return sorted(fits, key=lambda fit: fit[0])


def _residual(tree: cKDTree, a: FloatArray, matrix: FloatArray, furthest: float) -> float:
    distance = np.minimum(tree.query(tf.move(matrix, a))[0], furthest)
    return float(np.sqrt(np.mean(distance**2)))


def _refine(tree: cKDTree, a: FloatArray, b: FloatArray, matrix: FloatArray, furthest: float) -> tuple[float, FloatArray]:
    for _ in range(10):
        distance, match = tree.query(tf.move(matrix, a))
        is_near = distance < furthest
        try:
            matrix = registration.rigid(a[is_near], b[match[is_near]]).transform
        except ToolpointError:  # too few, or on one line
            break
    return _residual(tree, a, matrix, furthest), matrix


def _triangles(a: FloatArray) -> Iterator[list[int]]:
    """Yield corners of large triangles of the test, no two on the same farthest corner."""
    for first in np.linspace(0, len(a) - 1, min(MAX_TEST_TRIANGLES, len(a))).astype(int):
        second = int(np.argmax(np.linalg.norm(a - a[first], axis=1)))
        along = a[second] - a[first]
        height = np.linalg.norm(np.cross(a - a[first], along), axis=1)
        third = int(np.argmax(height))
        # A flat triangle leaves the turn about its long side to the noise of its points.
        if height[third] > 0.01 * float(along @ along):
            yield [int(first), second, third]


def _equal_triangles(corners: FloatArray, b: FloatArray, within: float) -> Iterator[IndexArray]:
    """Yield places of three points of b whose sides are those of the corners, the nearest in their sides first."""
    sides = cdist(corners, corners)
    between = cdist(b, b)
    first, second = np.nonzero(np.abs(between - sides[0, 1]) < within)
    wrong = [(abs(between[i, j] - sides[0, 1]) + abs(between[i, k] - sides[0, 2]) + abs(between[j, k] - sides[1, 2]), i, j, k)
             for i, j in zip(first, second, strict=True)
             for k in np.flatnonzero((np.abs(between[i] - sides[0, 2]) < within) & (np.abs(between[j] - sides[1, 2]) < within))]
    for _, i, j, k in sorted(wrong)[:MAX_PLACINGS_PER_TRIANGLE]:
        yield np.array([i, j, k], int)


def _kept_names(matrix: FloatArray, a: FloatArray, b: FloatArray, names: tuple[list[str], list[str]]) -> int:
    match = np.argmin(cdist(tf.move(matrix, a), b), axis=1)
    return sum(name == names[1][k] for name, k in zip(names[0], match, strict=True))


def _turn(matrix: FloatArray) -> float:
    return round(float(np.arccos(np.clip((np.trace(matrix[:3, :3]) - 1) / 2, -1, 1))), 3)
