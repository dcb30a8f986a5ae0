r"""Shapes of bodies: one smooth motion for all windows of a body, its order by penalised likelihood, with covariance.

Over (a, b), the distance from the body's centre right and down in units of its half length, a motion is a translation, rigid
(:math:`\phi = c_1 e_x + c_2 e_y + c_3 (-b, a)`), affine, or quadratic. The order with the least :math:`\chi^2 + k \ln n` is
taken, each mode its own. Source: Schwarz, Annals of Statistics 6 (1978) 461 (the penalty).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND, BOTH, EDGE, Windows
from toolpoint.vision.modes.projection import PointShapes

ORDERS = ("translation", "rigid", "affine", "quadratic")
RIGID = ORDERS[:2]
FEWEST_WINDOWS = 3
# Pixels around a body in front that are left out behind it: its edge moves with it, and regions are rough.
EDGE_MARGIN = 5.0
# Chi-squared per degree of freedom, and share of the motion's power left, from which a region is not taken for one body.
STRANGE, STRANGERS = 2.5, 0.005


@dataclass(frozen=True, eq=False)
class BodyMotion(NotebookText):
    """Motion of one body in every mode.

    Parameters
    ----------
    name : str
    region : Region
    orders : (r,) of `ORDERS`
    coefficients : (r, 12) complex
        Over (1, a, b, a^2, a b, b^2) to the right, then down; pixels.
    covariance : (r, 12, 12) floats
        Of the coefficients' real (or imaginary) parts, for a basis covariance of one.
    basis_covariance : (r, 2, 2)
        Covariance of real and imaginary part.
    fit : (r,) floats
        Chi-squared per degree of freedom.
    windows : int
        Windows that see the body's motion.
    doubts : tuple of str
    """

    name: str
    region: Region
    orders: tuple[str, ...]
    coefficients: ComplexArray
    covariance: FloatArray
    basis_covariance: FloatArray
    fit: FloatArray
    windows: int
    doubts: tuple[Doubt, ...] = field(default=())

    def shape_at(self, points: FloatArray) -> ComplexArray:
        """Return the shapes at places of the picture (n, 2), column and row: (n, 2, r) complex, pixels."""
        terms = _terms(points, self.region)
        halves = self.coefficients.reshape(-1, 2, 6)
        return np.asarray(np.einsum("rik,nk->nir", halves, terms))

    def covariance_at(self, points: FloatArray) -> FloatArray:
        """Return the covariance (n, r, 2, 2) of right and down (real part, for a basis covariance of one)."""
        terms = _terms(points, self.region)
        blocks = self.covariance.reshape(-1, 2, 6, 2, 6)
        return np.asarray(np.einsum("rikjl,nk,nl->nrij", blocks, terms, terms))

    def deviation_at(self, points: FloatArray) -> FloatArray:
        """Return the standard deviation of ``|error|``, (n, 2, r), pixels."""
        trace = np.trace(self.basis_covariance, axis1=1, axis2=2)
        return np.sqrt(np.einsum("nrii,r->nir", self.covariance_at(points), trace))

    def __repr__(self) -> str:
        return f"BodyMotion({self.name}, {', '.join(self.orders)}, {self.windows} windows)"


def fit_bodies(windows: Windows, shapes: PointShapes, regions: Mapping[str, Region], *,
               orders: tuple[str, ...] = ORDERS) -> tuple[BodyMotion, ...]:
    """Return the motion of every body; a body without texture is there with a doubt and infinite covariance.

    Parameters
    ----------
    windows, shapes : of the windows of the picture
    regions : name to Region
        Where each body is seen; later ones stand before earlier ones.
    orders : of `ORDERS`
        To choose from.
    """
    bodies = []
    names = list(regions)
    for k, name in enumerate(names):
        inside = _inside(windows, regions[name])
        for front in names[k + 1:]:
            inside &= ~_touches(windows, regions[front])
        # At the border to a body behind the blurred edge holds the texture of both; against the wall it is the body's own.
        for behind in names[:k]:
            inside &= _deep(windows, regions[name]) | ~_touches(windows, regions[behind])
        bodies.append(_fit(name, regions[name], windows, shapes, at=np.flatnonzero(inside), orders=orders))
    return tuple(bodies)


def _inside(windows: Windows, region: Region) -> BoolArray:
    half = windows.side / 2
    low, high = windows.centres - half + 1, windows.centres + half - 1
    return np.asarray(region.holds(low) & region.holds(high) & (windows.sight > BLIND))


def _deep(windows: Windows, region: Region) -> BoolArray:
    """Return which windows lie inside a region and clear of its border."""
    half = windows.side / 2 + EDGE_MARGIN
    return np.asarray(region.holds(windows.centres - half) & region.holds(windows.centres + half))


def _touches(windows: Windows, region: Region) -> BoolArray:
    half = windows.side / 2 + EDGE_MARGIN
    x, y = windows.centres[:, 0], windows.centres[:, 1]
    return ((x + half > region.left) & (x - half < region.left + region.width)
            & (y + half > region.top) & (y - half < region.top + region.height))


def _fit(name: str, region: Region, windows: Windows, shapes: PointShapes, *, at: np.ndarray,
         orders: tuple[str, ...]) -> BodyMotion:
    modes = shapes.shape.shape[2]
    if at.size < FEWEST_WINDOWS:
        blind = np.full((modes, 12, 12), np.inf)
        return BodyMotion(name, region, ("unknown",) * modes, np.zeros((modes, 12), complex), blind, shapes.basis.covariance,
                          np.full(modes, np.nan), int(at.size), (
                              Doubt(name, f"{at.size} windows with texture, {FEWEST_WINDOWS} at least are needed: its motion "
                                    "is not known", "stick or spray a pattern on it"),))
    rows, values = _rows(windows, shapes, at)
    terms = _terms(windows.centres[at], region)
    picked, coefficients, covariances, fits, left = [], [], [], [], []
    for r in range(modes):
        order, solution, covariance, fit, share = _choose(rows, values[:, r], terms, shapes.basis.covariance[r], orders)
        picked.append(order)
        coefficients.append(solution)
        covariances.append(covariance)
        fits.append(fit)
        left.append(share)
    covariance = np.array(covariances)
    covariance[:, [0, 6], [0, 6]] += shapes.common  # shared by all windows: no mean over them takes it away
    return BodyMotion(name, region, tuple(picked), np.array(coefficients), covariance, shapes.basis.covariance, np.array(fits),
                      int(at.size), _strangers(name, np.array(fits), np.array(left)))


def _strangers(name: str, fits: FloatArray, left: FloatArray) -> tuple[Doubt, ...]:
    strange = np.where(fits > STRANGE, left, 0.0)
    if strange.max() < STRANGERS:
        return ()
    return (Doubt(name, f"its windows do not move as one body ({100 * strange.max():.1f} % of their motion is left): the "
                  "region holds parts of others, it bends more, or it was smoothed",
                  "check where the body is said to be seen", figure=float(strange.max())),)


def _rows(windows: Windows, shapes: PointShapes, at: np.ndarray) -> tuple[FloatArray, ComplexArray]:
    """Return whitening rows (m, 2) with the index of their window in the last column, and whitened values (m, r)."""
    rows, values = [], []
    for k, w in enumerate(at):
        spread = shapes.covariance[w]
        if windows.sight[w] == BOTH:
            whiten = np.linalg.cholesky(np.linalg.inv(spread)).T
        elif windows.sight[w] == EDGE:
            normal = windows.normal[w]
            whiten = normal[None] / np.sqrt(max(float(normal @ spread @ normal), 1e-30))
        else:
            continue
        for row in whiten:
            rows.append((*row, k))
            values.append(row @ shapes.shape[w])
    return np.array(rows), np.array(values)


def _choose(rows: FloatArray, values: ComplexArray, terms: FloatArray, spread: FloatArray, orders: tuple[str, ...]
            ) -> tuple[str, ComplexArray, FloatArray, float, float]:
    """Return the order of least penalised misfit, its coefficients (12,), their covariance, its misfit per degree of freedom
    and the share of the motion that it leaves, noise apart."""
    whiten = np.linalg.cholesky(np.linalg.inv(spread))
    seen = np.stack([values.real, values.imag], axis=1) @ whiten
    best = None
    for order in orders:
        turn = _subspace(order)
        window = rows[:, 2].astype(int)
        design = np.concatenate([rows[:, :1] * terms[window], rows[:, 1:2] * terms[window]], axis=1) @ turn.T
        if design.shape[0] < design.shape[1] + 2 or np.linalg.matrix_rank(design) < design.shape[1]:
            continue
        solution, *_ = np.linalg.lstsq(design, seen, rcond=None)
        misfit = float(((seen - design @ solution) ** 2).sum())
        freedom = 2 * (design.shape[0] - design.shape[1])
        score = misfit + 2 * design.shape[1] * np.log(2 * design.shape[0])
        if best is None or score < best[0]:
            parts = solution @ np.linalg.inv(whiten)
            inverse = np.linalg.inv(design.T @ design)
            # Misfit beyond the noise (no model is quite right) widens what is stated, never narrows it.
            wider = max(1.0, misfit / freedom)
            best = (score, order, turn.T @ (parts[:, 0] + 1j * parts[:, 1]), turn.T @ inverse @ turn * wider, misfit / freedom,
                    max(0.0, misfit - freedom) / max(float((seen**2).sum()), 1e-300))
    if best is None:
        fail("bodies", f"{len(rows)} measured directions", "are too few for any motion",
             remedy="take a larger region or more texture")
    return best[1], best[2], best[3], best[4], best[5]


def _subspace(order: str) -> FloatArray:
    """Return the directions (k, 12) in the space of coefficients that a motion of this order has."""
    whole = np.eye(12)
    if order == "quadratic":
        return whole
    if order == "affine":
        return whole[[0, 1, 2, 6, 7, 8]]
    turn = whole[7] - whole[2]
    return np.stack([whole[0], whole[6], turn]) if order == "rigid" else whole[[0, 6]]


def _terms(points: FloatArray, region: Region) -> FloatArray:
    centre = np.array([region.left + (region.width - 1) / 2, region.top + (region.height - 1) / 2])
    a, b = np.moveaxis((np.asarray(points, float) - centre) / (max(region.width, region.height) / 2), -1, 0)
    return np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)
