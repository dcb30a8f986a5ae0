"""Registration of a test's points with a machine's from any frame, by triangles of equal sides; and what else fits as well."""

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

TRIANGLES, MOST = 6, 400  # of the test that are tried; placings of each that are looked at
SIDES = 0.02  # of the size of the test: by which sides of equal triangles may differ
ALIKE = 2.0  # residual of another placing over the best one, below which it fits nearly as well
CLEAR = 3.0  # by which a mirrored placing must be better
TINY = 1e-3  # of the size of the test: a residual that needs no better one
UNITS = {1000.0: "mm read as m", 1e-3: "m read as mm", 1 / 0.0254: "inches read as m"}
NEAR = 2.5  # of a factor of units, either way


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
    limit = min(furthest, 0.2 * _size(a))
    fits = _placings(a, b, limit)
    if not fits:
        return None, words
    names = [str(n) for n in test], [str(n) for n in model]
    matrix, doubts = _chosen(fits, a, b, names)
    return matrix, (*words, *doubts, *_mirrored(fits[0][0], a, b, limit))


def _chosen(fits: list[tuple[float, FloatArray]], a: FloatArray, b: FloatArray, names: tuple[list[str], list[str]]
            ) -> tuple[FloatArray, list[Doubt]]:
    size = _size(a)
    alike = [fit for fit in fits if fit[0] <= max(ALIKE * fits[0][0], TINY * size)]
    kept = [_kept_names(matrix, a, b, names) for _, matrix in alike]
    at = min(range(len(alike)), key=lambda k: (-kept[k], _turn(alike[k][1])))
    residual, matrix = alike[at]
    others = [fit[0] for k, fit in enumerate(alike) if k != at and kept[k] == kept[at]]
    stays = np.allclose(matrix, np.eye(4), atol=0.02 * max(1.0, size))
    if not others or stays or kept[at] > len(a) / 2:
        return matrix, []
    return matrix, [Doubt("registration", f"another placing of the test's frame fits as well ({1e3 * others[0]:.3g} mm against "
                          f"{1e3 * residual:.3g} mm)", "give three known pairs", figure=residual / max(others[0], 1e-300))]


def _mirrored(residual: float, a: FloatArray, b: FloatArray, limit: float) -> list[Doubt]:
    if residual <= TINY * _size(a):
        return []
    fits = _placings(a * [1, 1, -1], b, limit)
    if not fits or CLEAR * fits[0][0] >= residual:
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
    """Return the mistaken unit of length, in words, that makes a test so many times as large as its machine; None for none."""
    return next((words for factor, words in UNITS.items() if 1 / NEAR < ratio / factor < NEAR), None)


def _placings(a: FloatArray, b: FloatArray, furthest: float) -> list[tuple[float, FloatArray]]:
    """Return root-mean-square distance (m, each at most `furthest`) and transform of distinct placings, best first."""
    tree = cKDTree(b)
    fits: list[tuple[float, FloatArray]] = []
    for corners in _triangles(a):
        rough = []
        for there in _equal_triangles(a[corners], b, SIDES * _size(a)):
            try:
                matrix = registration.rigid(a[corners], b[there]).transform
            except ToolpointError:  # on one line
                continue
            rough.append((_residual(tree, a, matrix, furthest), matrix))
        for _, matrix in sorted(rough, key=lambda fit: fit[0])[:12]:
            refined = _refined(tree, a, b, matrix, furthest)
            if not any(np.abs(tf.move(refined[1], a) - tf.move(m, a)).max() < 0.02 * _size(a) for _, m in fits):
                fits.append(refined)
    return sorted(fits, key=lambda fit: fit[0])


def _residual(tree: cKDTree, a: FloatArray, matrix: FloatArray, furthest: float) -> float:
    distance = np.minimum(tree.query(tf.move(matrix, a))[0], furthest)
    return float(np.sqrt(np.mean(distance**2)))


def _refined(tree: cKDTree, a: FloatArray, b: FloatArray, matrix: FloatArray, furthest: float) -> tuple[float, FloatArray]:
    for _ in range(10):
        distance, match = tree.query(tf.move(matrix, a))
        near = distance < furthest
        try:
            matrix = registration.rigid(a[near], b[match[near]]).transform
        except ToolpointError:  # too few, or on one line
            break
    return _residual(tree, a, matrix, furthest), matrix


def _triangles(a: FloatArray) -> Iterator[list[int]]:
    """Yield corners of large triangles of the test, no two on the same farthest corner."""
    for first in np.linspace(0, len(a) - 1, min(TRIANGLES, len(a))).astype(int):
        second = int(np.argmax(np.linalg.norm(a - a[first], axis=1)))
        along = a[second] - a[first]
        height = np.linalg.norm(np.cross(a - a[first], along), axis=1)
        third = int(np.argmax(height))
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
    for _, i, j, k in sorted(wrong)[:MOST]:
        yield np.array([i, j, k], int)


def _kept_names(matrix: FloatArray, a: FloatArray, b: FloatArray, names: tuple[list[str], list[str]]) -> int:
    match = np.argmin(cdist(tf.move(matrix, a), b), axis=1)
    return sum(name == names[1][k] for name, k in zip(names[0], match, strict=True))


def _turn(matrix: FloatArray) -> float:
    return round(float(np.arccos(np.clip((np.trace(matrix[:3, :3]) - 1) / 2, -1, 1))), 3)
