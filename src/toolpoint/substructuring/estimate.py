r"""The error of a coupled solution with a reduced body, from its residual; and how many shapes a stated error needs.

With the residual r of a coupled mode in the body and :math:`\rho^2 = r^T (K + s_0 M)^{-1} r`, the body's own inverse bounds
that of the whole, and Kato and Temple give :math:`\delta f/f \le \tfrac12 (\rho^2/\lambda)\,\mu_{next}/(\mu_{next} - \mu)`,
:math:`\mu = \lambda + s_0`, the smallest over how many neighbouring modes are taken as one cluster. This holds where no
mode is missing: all free modes of the body up to 1.4 times the band must be among the shapes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, eigh

from toolpoint._check import FloatArray, count, fail, floats, positive, symmetric
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reach import MIN_TRUSTED_REACH_RATIO
from toolpoint.substructuring.reduction import Reduction, ShapeSpan, span

MAX_CLUSTER_SIZE = 4  # neighbouring modes that are bounded together
REDUCTION_STEPS = ((1.42, 2), (1.42, 3), (2.0, 3), (2.8, 4))  # reach over band and order of the responses, tried in turn
MAX_LOWERED_FRACTION = 0.25  # of a frequency: largest error by which its lower end is set below it
MAX_TRUSTED_ERROR = 0.05  # relative error of a frequency: estimates above it violate their own assumptions


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Neighbours of a body: their stiffness and mass over the loads' places, in their order, then over p more coordinates.

    stiffness, mass : (l + p, l + p) floats.

    >>> Surroundings([[1e6]], [[2.0]]).mass.tolist()  # a load's place on a spring to the ground, with 2 kg
    [[2.0]]
    """

    stiffness: FloatArray
    mass: FloatArray

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass"):
            value = symmetric(f"Surroundings.{name}", floats(f"Surroundings.{name}", getattr(self, name), (None, None)))
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class CoupledModes(NotebookText):
    """Lowest modes of a reduced body in its surroundings.

    frequency : Hz; error : estimate of the relative error of each from the reduction; coordinates : (rigid, elastic, others)
    of each mode, unit modal mass; status : whether the estimate is to be believed, a Doubt where not.

    >>> from toolpoint.substructuring import ActingLoads, LargeBody, reduce
    >>> from scipy.sparse import csc_array
    >>> pair = LargeBody(csc_array([[1e6, -1e6], [-1e6, 1e6]]), csc_array(np.eye(2)), np.eye(2)[:, :1], rigid=np.ones((2, 1)))
    >>> modes = couple_reduced(reduce(pair, ActingLoads(20.0)), Surroundings([[1e6]], [[0.0]]), 1)
    >>> golden = (np.sqrt(5) - 1) / 2  # two unit masses on two such springs: w_1 = w_0 times the golden section
    >>> bool(np.isclose(modes.frequency[0], 1e3 * golden / (2 * np.pi)))
    True
    """

    frequency: FloatArray
    error: FloatArray
    coordinates: FloatArray
    status: str

    @property
    def is_sure(self) -> bool:
        """Whether no free mode of the body can be missing."""
        return not isinstance(self.status, Doubt)

    def __repr__(self) -> str:
        return (f"CoupledModes({self.frequency.size} modes, {self.frequency[0]:.5g}..{self.frequency[-1]:.5g} Hz, error up to "
                f"{self.error.max():.1e}; {self.status})")


def couple_reduced(reduction: Reduction, surroundings: Surroundings, modes: int) -> CoupledModes:
    """Solve for the lowest coupled modes, with an estimate of the error that the reduction makes.

    The estimate is that of the body's reduction alone: the surroundings are taken as they are.

    Raises ToolpointError where the surroundings have fewer coordinates than the body has loads.

    Examples
    --------
    A free chain of 30 unit masses on springs of 1e6 N/m, held at its first mass by such a spring: w_1 = 2 w_0 sin(pi/122).

    >>> from scipy.sparse import csc_array, diags_array
    >>> from toolpoint.substructuring import ActingLoads, LargeBody, reduce
    >>> n = 30
    >>> stiffness = 1e6 * diags_array([-np.ones(n - 1), [1.0, *2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1)], offsets=[-1, 0, 1])
    >>> body = LargeBody(csc_array(stiffness), csc_array(np.eye(n)), np.eye(n)[:, :1], rigid=np.ones((n, 1)))
    >>> spring = Surroundings([[1e6]], [[0.0]])
    >>> modes = couple_reduced(reduce(body, ActingLoads(20.0)), spring, 1)
    >>> modes.is_sure, bool(abs(modes.frequency[0] / (1e3 / np.pi * np.sin(np.pi / 122)) - 1) < max(modes.error[0], 1e-9))
    (True, True)
    """
    l, r = reduction.rigid_participation.shape
    size = len(surroundings.stiffness)
    if size < l:
        fail("surroundings", f"{size} coordinates", f"must be at least the {l} loads' places")
    place = block_diag(np.hstack([reduction.rigid_participation, reduction.participation]), np.eye(size - l))
    n = r + reduction.size + size - l
    k, m = place.T @ surroundings.stiffness @ place, place.T @ surroundings.mass @ place
    k[range(n), range(n)] += np.concatenate([np.zeros(r), reduction.squares, np.zeros(size - l)])
    m[range(r + reduction.size), range(r + reduction.size)] += 1.0
    number = min(count("modes", modes), n)
    squares, vectors = eigh((k + k.T) / 2, (m + m.T) / 2)
    residual = _residuals(reduction, surroundings, place, squares=squares, vectors=vectors)
    error = bound_errors(squares, residual, reduction.residual.shift)[:number]
    frequency = np.sqrt(np.maximum(squares[:number], 0)) / (2 * np.pi)
    return CoupledModes(frequency, error, vectors[:, :number], _status(reduction, float(frequency[-1]), float(error.max())))


def _status(reduction: Reduction, band: float, error: float) -> str:
    if error > MAX_TRUSTED_ERROR:
        return Doubt("error", f"an estimate of {100 * error:.2g} % is too large to be believed itself", "keep more shapes",
                     figure=error)
    if reduction.reach >= MIN_TRUSTED_REACH_RATIO * band:
        return f"all free modes of the body to {reduction.reach / band:.3g} times the band are among the shapes"
    if reduction.reach == 0:
        return Doubt("free modes", f"{reduction.method} does not say which are among the shapes; one may be missing",
                     "compare with ActingLoads")
    return Doubt("free modes", f"those of the body are known to {reduction.reach:.5g} Hz, {reduction.reach / band:.3g} times "
                 f"the band ({MIN_TRUSTED_REACH_RATIO:g} at least); one may be missing", "reduce with a wider band",
                 figure=reduction.reach / band)


def _residuals(reduction: Reduction, surroundings: Surroundings, place: FloatArray, *, squares: FloatArray, vectors: FloatArray
               ) -> FloatArray:
    """Return rho^2 of every coupled mode."""
    products, (l, r) = reduction.residual, reduction.rigid_participation.shape
    elastic = vectors[r:r + reduction.size]
    motion = place @ vectors
    wrench = (surroundings.stiffness @ motion - (surroundings.mass @ motion) * squares)[:l]
    # r = K V t - lambda M V t - f, in the columns [M X, W] whose products in S are stored: nothing large is touched.
    inertial = products.inertial @ elastic - (products.shapes @ elastic) * squares
    inertial[:r] -= vectors[:r] * squares
    weights = np.vstack([inertial, products.loads @ elastic + wrench])
    return np.maximum(np.einsum("im,ij,jm->m", weights, products.gram[:len(weights), :len(weights)], weights), 0.0)


def bound_errors(squares: FloatArray, residual: FloatArray, shift: float) -> FloatArray:
    """Return relative errors of frequencies (modes,), at least those that the residuals bound; infinite where nothing does.

    squares : all of the reduced problem, ascending, rad^2/s^2; residual : rho^2 of each, in a flexibility no smaller than that
    of the whole, shifted; shift : s0, rad^2/s^2. The gap to the next mode is that to its lower end: a second pass takes off
    what the first one says of the next mode.
    """
    error = _bounds(squares, squares, residual, shift)
    return _bounds(squares, squares * (1 - 2 * np.minimum(error, MAX_LOWERED_FRACTION)), residual, shift)


def _bounds(squares: FloatArray, lower_ends: FloatArray, residual: FloatArray, shift: float) -> FloatArray:
    """Return the Kato-Temple bound of every mode, the least over the clusters that hold it.

    squares, lower_ends : (n,) rad^2/s^2, the eigenvalues and what the true ones are not below; residual : (n,) rho^2.
    """
    n = len(squares)
    result = np.full(n, np.inf)
    for first in range(n):
        for last in range(first, min(first + MAX_CLUSTER_SIZE, n - 1)):
            # The gap must hold for the true eigenvalues, which lie below the computed ones by up to their own error.
            next_lower_end = float(lower_ends[last + 1:last + 1 + MAX_CLUSTER_SIZE].min())
            gap = next_lower_end - squares[last]
            if gap <= 0 or squares[first] <= 0:
                continue
            # Kato-Temple: the cluster's residuals over the gap to the next eigenvalue (equation of the module's docstring).
            bound = 0.5 * residual[first:last + 1].sum() * (next_lower_end + shift) / gap
            result[first:last + 1] = np.minimum(result[first:last + 1], bound / squares[first:last + 1])
    return result


def choose_size(shapes: ShapeSpan, surroundings: Surroundings, modes: int, *, error: float) -> tuple[Reduction, CoupledModes]:
    """Search by bisection for the smallest reduction whose estimated error of the lowest coupled frequencies is within `error`.

    Raises ToolpointError where free modes may be missing (the 1.4 rule), or all shapes together do not reach the error.
    """
    positive("error", error)
    size_min, size_max = shapes.kept, shapes.largest
    best = shapes.reduced(size_max)
    solved = couple_reduced(best, surroundings, modes)
    if not solved.is_sure:
        fail("shapes", solved.status, "must reach 1.4 times the band", remedy="span the body with a wider band")
    if solved.error.max() > error:
        fail("error", f"{error:g}", f"all {size_max} shapes give {solved.error.max():.2g}",
             remedy="span the body with a wider band or responses of a higher order")
    while size_min < size_max:
        # The estimate falls as shapes are added, but for rounding, so halving finds the least number in a few solutions.
        size = (size_min + size_max) // 2
        reduction = shapes.reduced(size)
        trial = couple_reduced(reduction, surroundings, modes)
        if trial.error.max() <= error:
            size_max, best, solved = size, reduction, trial
        else:
            size_min = size + 1
    return best, solved


def reduce_automatically(body: LargeBody, surroundings: Surroundings, modes: int, *, band: float, error: float
                         ) -> tuple[Reduction, CoupledModes]:
    """Reduce a body to as few coordinates as a relative error of the lowest coupled frequencies allows.

    band : Hz, about the highest of these frequencies; it is corrected where the coupled modes go higher.

    Raises ToolpointError where the largest reduction tried does not reach the error.

    Examples
    --------
    The chain of `couple_reduced`, to 0.01 % of its lowest three frequencies:

    >>> from scipy.sparse import csc_array, diags_array
    >>> n = 30
    >>> stiffness = 1e6 * diags_array([-np.ones(n - 1), [1.0, *2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1)], offsets=[-1, 0, 1])
    >>> body = LargeBody(csc_array(stiffness), csc_array(np.eye(n)), np.eye(n)[:, :1], rigid=np.ones((n, 1)))
    >>> reduction, modes = reduce_automatically(body, Surroundings([[1e6]], [[0.0]]), 3, band=50.0, error=1e-4)
    >>> isinstance(reduction, Reduction), isinstance(modes, CoupledModes), bool(modes.error.max() < 1e-4)
    (True, True, True)
    """
    for reach, order in REDUCTION_STEPS:
        shapes = span(body, ActingLoads(band, reach, order))
        solved = couple_reduced(shapes.reduced(), surroundings, modes)
        highest = float(solved.frequency[-1])
        # The estimate holds only while all free modes to 1.4 times the highest coupled frequency are among the shapes.
        if MIN_TRUSTED_REACH_RATIO * highest > reach * band:
            band = 1.01 * highest
            shapes = span(body, ActingLoads(band, reach, order))
            solved = couple_reduced(shapes.reduced(), surroundings, modes)
        if solved.is_sure and solved.error.max() <= error:
            return choose_size(shapes, surroundings, modes, error=error)
    fail("error", f"{error:g}",
         f"{shapes.largest} shapes to {shapes.reach:.5g} Hz give {solved.error.max():.2g}; {solved.status}",
         remedy="ask for fewer modes or a larger error")
