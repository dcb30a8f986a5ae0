r"""Shapes of bodies: one smooth motion for all windows of a body, averaged over its orders, with covariance.

Over (a, b), the distance from the body's centre right and down in units of its half length, a motion is a translation, rigid
(:math:`\phi = c_1 e_x + c_2 e_y + c_3 (-b, a)`), affine, or quadratic; each mode has its own average (`body_orders`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT, Windows
from toolpoint.vision.modes.body_orders import ORDERS, average_orders
from toolpoint.vision.modes.projection import PointShapes

RIGID_ORDERS = ORDERS[:2]
MIN_BODY_WINDOWS = 3  # of a body
# Pixels around a body in front that are left out behind it: its edge moves with it, and regions are rough.
EDGE_MARGIN = 5.0
# Chi-squared per degree of freedom, and share of the motion's power left, from which a region is not taken for one body; and
# chi-squared that no smooth motion of a body leaves, whatever its share.
MAX_BODY_MISFIT, MAX_BODY_RESIDUAL_FRACTION, MAX_SMOOTH_MISFIT = 2.5, 0.005, 1000.0
# Share of the strongest mode's power that errors of windows leave in the shapes of others: (0.3 %)^2 of its motion.
MODE_LEAKAGE = 1e-5
# Share of its motion by which windows follow one body unlike another (real and imaginary part each), by texture and pixels.
# Twenty bodies of five random mills, two films each, were followed by -0.9 to +1.5 % of it, 0.75 % in the mean square.
BODY_TRACKING_ERROR = 0.0075
# The same by compression, for a loss of one: x264 at quality 18 takes a tenth of the amplitude.
BODY_LOSS_FACTOR = 0.2


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
    residual_fraction : (r,) floats
        Share of the windows' motion, noise apart, that the body's does not explain; empty where it is not known.

    Examples
    --------
    Runs in ``examples/motion_of_a_whole_picture.py``.
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
    residual_fraction: FloatArray = field(default_factory=lambda: np.zeros(0))

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

    def joint_covariance_at(self, points: FloatArray) -> FloatArray:
        """Return the covariance E[e e^H] of all points together, (r, 2n, 2n), pixels^2; rows: right and down of each point."""
        terms = _terms(points, self.region)
        blocks = self.covariance.reshape(-1, 2, 6, 2, 6)
        trace = np.trace(self.basis_covariance, axis1=1, axis2=2)
        joint = np.einsum("rikjl,nk,ml,r->rnimj", blocks, terms, terms, trace)
        return np.asarray(joint.reshape(len(trace), 2 * len(points), 2 * len(points)))

    def deviation_at(self, points: FloatArray) -> FloatArray:
        """Return the standard deviation of ``|error|``, (n, 2, r), pixels."""
        trace = np.trace(self.basis_covariance, axis1=1, axis2=2)
        return np.sqrt(np.einsum("nrii,r->nir", self.covariance_at(points), trace))

    def __repr__(self) -> str:
        return f"BodyMotion({self.name}, {', '.join(self.orders)}, {self.windows} windows)"


def fit_bodies(windows: Windows, shapes: PointShapes, regions: Mapping[str, Region], *,
               orders: tuple[str, ...] = ORDERS, counted: BoolArray | None = None, loss: float = 0.0) -> tuple[BodyMotion, ...]:
    """Return the motion of every body; a body without texture is there with a doubt and infinite covariance.

    Parameters
    ----------
    windows, shapes : of the windows of the picture
    regions : name to Region
        Where each body is seen; later ones stand before earlier ones.
    orders : of `ORDERS`
        To average over.
    counted : (r,) bools, optional
        Modes whose misfit is doubted; all where left out.
    loss : float
        What compression took of the noise (`Quality.loss`): bodies that move less are smoothed more.

    Examples
    --------
    Runs in ``examples/motion_of_a_whole_picture.py``.
    """
    bodies = []
    names = list(regions)
    for k, name in enumerate(names):
        inside = _inside(windows, regions[name])
        for front_name in names[k + 1:]:
            inside &= ~_touches(windows, regions[front_name])
        # At the border to a body behind the blurred edge holds the texture of both; against the wall it is the body's own.
        for rear_name in names[:k]:
            inside &= _clear_of_border(windows, regions[name]) | ~_touches(windows, regions[rear_name])
        bodies.append(_fit(name, regions[name], windows, shapes, members=np.flatnonzero(inside), orders=orders, loss=loss,
                           counted=np.ones(shapes.shape.shape[2], bool) if counted is None else counted))
    return tuple(bodies)


def _inside(windows: Windows, region: Region) -> BoolArray:
    """Return which windows that see motion lie wholly inside a region."""
    half = windows.side / 2
    first_corner, last_corner = windows.centres - half + 1, windows.centres + half - 1
    return np.asarray(region.holds(first_corner) & region.holds(last_corner) & (windows.sight > BLIND_SIGHT))


def _clear_of_border(windows: Windows, region: Region) -> BoolArray:
    """Return which windows lie inside a region and clear of its border."""
    half = windows.side / 2 + EDGE_MARGIN
    return np.asarray(region.holds(windows.centres - half) & region.holds(windows.centres + half))


def _touches(windows: Windows, region: Region) -> BoolArray:
    """Return which windows come within `EDGE_MARGIN` pixels of a region."""
    half = windows.side / 2 + EDGE_MARGIN
    x, y = windows.centres[:, 0], windows.centres[:, 1]
    return ((x + half > region.left) & (x - half < region.left + region.width)
            & (y + half > region.top) & (y - half < region.top + region.height))


def _fit(name: str, region: Region, windows: Windows, shapes: PointShapes, *, members: np.ndarray,
         orders: tuple[str, ...], counted: BoolArray, loss: float) -> BodyMotion:
    if members.size < MIN_BODY_WINDOWS:
        return _unknown(name, region, shapes, int(members.size),
                        f"{members.size} windows with texture, {MIN_BODY_WINDOWS} at least are "
                        "needed")
    rows, values = _rows(windows, shapes, members)
    terms = _terms(windows.centres[members], region)
    window = rows[:, 2].astype(int)
    design = np.concatenate([rows[:, :1] * terms[window], rows[:, 1:2] * terms[window]], axis=1)
    whiten = np.linalg.cholesky(np.linalg.inv(shapes.basis.covariance)).transpose(0, 2, 1)
    components = np.stack([values.real, values.imag], axis=1)
    motions = [average_orders(design, components[:, :, r] @ white.T, orders) for r, white in enumerate(whiten)]
    averaged = [motion for motion in motions if motion is not None]
    if len(averaged) < len(motions):
        return _unknown(name, region, shapes, int(members.size),
                        f"{len(rows)} measured directions do not determine a motion both "
                        "ways")
    unwhiten = np.linalg.inv(whiten)
    coefficients = np.array([motion.coefficients @ unwhitening.T @ [1, 1j] for motion,
                             unwhitening in zip(averaged, unwhiten, strict=True)])
    covariance = np.array([motion.covariance for motion in averaged])
    trace = np.trace(shapes.basis.covariance, axis1=1, axis2=2)
    tracking_covariance = np.einsum("ri,rj->rij", coefficients, coefficients.conj()).real
    covariance += 2 * (BODY_TRACKING_ERROR + BODY_LOSS_FACTOR
                       * min(loss, 1.0)) ** 2 * tracking_covariance / trace[:, None, None]
    # Errors of windows that repeat with the other modes' motion are in this mode's shape too.
    all_modes = tracking_covariance.sum(axis=0)
    covariance += 2 * MODE_LEAKAGE * (all_modes - tracking_covariance) / trace[:, None, None]
    covariance[:, [0, 6], [0, 6]] += shapes.common  # shared by all windows: no mean over them takes it away
    fits = np.array([motion.misfit for motion in averaged])
    power = np.array([(motion.residual_power, motion.power) for motion in averaged])
    return BodyMotion(name, region, tuple(motion.order for motion in averaged), coefficients, covariance,
                      shapes.basis.covariance,
                      fits, int(members.size), _misfit_doubts(name, fits, power, counted), power[:, 0] / power[:, 1])


def _unknown(name: str, region: Region, shapes: PointShapes, windows: int, reason: str) -> BodyMotion:
    modes = shapes.shape.shape[2]
    return BodyMotion(name, region, ("unknown",) * modes, np.zeros((modes, 12), complex), np.full((modes, 12, 12), np.inf),
                      shapes.basis.covariance, np.full(modes, np.nan), windows, (
                          Doubt(name, f"{reason}: its motion is not known", "stick or spray a pattern on it"),))


def _misfit_doubts(name: str, fits: FloatArray, power: FloatArray, counted: BoolArray) -> tuple[Doubt, ...]:
    """Return a doubt where windows do not move as one; power : (r, 2) chi-squared that is left, and of the motion."""
    residual_fraction = power[:, 0] / power[:, 1]
    # Errors of windows that repeat with the strongest motion reach into the shapes of weak modes.
    is_significant = (residual_fraction > MAX_BODY_RESIDUAL_FRACTION) & (power[:, 0] > MODE_LEAKAGE * power[:, 1].max())
    misfit_fraction = np.where(counted & ((fits > MAX_BODY_MISFIT) & is_significant | (fits > MAX_SMOOTH_MISFIT)),
                               residual_fraction, 0.0)
    if not misfit_fraction.any():
        return ()
    worst_mode = int(np.argmax(misfit_fraction))
    return (Doubt(name, f"its windows do not move as one body ({100 * misfit_fraction.max():.2g} % of their motion is left, "
                  f"chi-squared {fits[worst_mode]:.3g} a degree of freedom): the region holds parts of others, it "
                  "bends more, or it was smoothed", "check where the body is said to be seen",
                  figure=float(misfit_fraction.max())),)


def _rows(windows: Windows, shapes: PointShapes, members: np.ndarray) -> tuple[FloatArray, ComplexArray]:
    """Return whitening rows (m, 2) with the index of their window in the last column, and whitened values (m, r).

    A window whose covariance is not positive is left out: a variance clipped to a small one would decide the motion alone.
    """
    rows, values = [], []
    for k, w in enumerate(members):
        spread = shapes.covariance[w]
        if windows.sight[w] == FULL_SIGHT and float(np.linalg.eigvalsh(spread)[0]) > 0:
            whiten = np.linalg.cholesky(np.linalg.inv(spread)).T
        elif windows.sight[w] == EDGE_SIGHT and float(windows.normal[w] @ spread @ windows.normal[w]) > 0:
            normal = windows.normal[w]
            whiten = normal[None] / np.sqrt(float(normal @ spread @ normal))
        else:
            continue
        for row in whiten:
            rows.append((*row, k))
            values.append(row @ shapes.shape[w])
    return np.array(rows).reshape(-1, 3), np.array(values).reshape(-1, shapes.shape.shape[2])


def _terms(points: FloatArray, region: Region) -> FloatArray:
    """Return the terms (1, a, b, a^2, a b, b^2) of a body's motion at points (n, 2), shape (n, 6)."""
    centre = np.array([region.left + (region.width - 1) / 2, region.top + (region.height - 1) / 2])
    a, b = np.moveaxis((np.asarray(points, float) - centre) / (max(region.width, region.height) / 2), -1, 0)
    return np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)
