r"""Kind of joint that explains the relative twists of all modes: fit of every kind, F-test, the simplest that passes.

For a kind with free twists :math:`B(\theta)` and the relative twists t of all columns with covariance C,

.. math:: \chi^2 = \min_{\theta, q} (t - (I \otimes B) q)^T C^{-1} (t - (I \otimes B) q)

(variable projection: Golub, Pereyra, SIAM J. Numer. Anal. 10 (1973) 413) with 6 k - f k - n degrees of freedom for k
columns, f freedoms and n parameters. A kind is refused where so large a :math:`\chi^2` by noise alone is less probable
than the significance. The freedoms are the fewest for which any subspace of so many twists passes. Of the kinds with so many
freedoms (all sets of directions of a frame, the screw, the general subspace) those count that pass, also against the general
subspace (likelihood ratio), and whose place is no infinity; the one with the fewest parameters is taken, of several the one
with the least misfit. Other kinds are named where their Bayesian information criterion :math:`\chi^2 + n \ln 6 k` (Schwarz,
Annals of Statistics 6 (1978) 461) is no worse by 10 (very strong evidence: Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).

A freedom moves in more than one mode. Where the mode of the largest misfit alone asks for one more, and noise five times as
large as stated explains it, the simpler joint is taken; the other one is its rival, which the fit of the whole machine may
prefer. The best simple kind is the rival of a general joint. A general joint at infinity is never taken where a simple kind has
a place.

The decision allows every component a motion of its own below a floor. The position and its interval do so only as far as
the misfit asks for it: none where noise alone explains the twists, else the share at which chi-squared is what it should be
(Paule, Mandel, J. Res. NBS 87 (1982) 377).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.joints.kinds import FreedomChart, charts, general
from toolpoint.joint_identification.motion.measured import about
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion

_REGULAR_FLOOR = 1e-8  # of the motion: keeps the covariance of exact data regular
_MIN_NOISE_PROBABILITY = 0.05  # p-value below which noise alone does not explain a misfit
_FLOOR_BISECTIONS = 12
DECISIVE_INFORMATION = 10.0  # difference of the information criterion: very strong evidence
_NEAR_DISTANCE, _INFINITE_DISTANCE = 5.0, 50.0  # lengths of the components: never, and always taken for a joint at infinity
_SLOPE_STEP = 1e-6  # of the parameters
_MAX_MODE_MISFIT, _MIN_MODES_OF_FREEDOM = 25.0, 5  # of one mode over its degrees of freedom, that its noise may explain; modes
# Steps of a fit; where its misfit over its degrees of freedom is hopeless, bursts of a few steps must each go on lowering it.
_BURST_STEPS, _BURST_COUNT, _FINAL_STEPS = 5, 6, 100
_HOPELESS_MISFIT, _MAX_BURST_RATIO = 100.0, 0.1  # misfit over its degrees of freedom; cost after a burst over that before


@dataclass(frozen=True)
class Criterion:
    """Criterion by which kinds of joint are refused.

    Parameters
    ----------
    significance : float
        A kind is refused where noise alone exceeds its misfit with a smaller probability than this.
    floor : float
        Relative motion below this share of the components' own motion counts as none, whatever the noise: no casting
        is perfectly rigid and no joint perfectly stiff in its locked directions. It widens the intervals only where the
        twists scatter more than their noise.

    >>> Criterion(floor=1e-3).significance  # castings that bend by a thousandth of their motion
    0.0001
    """

    significance: float = 1e-4
    floor: float = 1e-4


@dataclass(frozen=True, eq=False)
class JointFit(NotebookText):
    """One kind fitted: its chart, parameters with covariance, gain (parameters, columns, 6) on local twists, misfit.

    probability : of so large a misfit by noise; probability_without : the same without the mode of the largest misfit, where
    its own noise may explain that, else equal; misfit_mode : that mode; mode_misfit : its misfit over its degrees of freedom.
    """

    chart: FreedomChart
    theta: FloatArray
    covariance: FloatArray
    gain: FloatArray
    chi2: float
    freedom: int
    probability: float
    probability_without: float = 0.0
    misfit_mode: int = 0
    mode_misfit: float = 0.0

    def passes(self, significance: float) -> bool:
        """Whether noise explains the misfit, be it that of a single mode larger than stated."""
        return max(self.probability, self.probability_without) >= significance

    @property
    def kind(self) -> str:
        """Name of the kind."""
        return self.chart.kind

    def __repr__(self) -> str:
        return f"JointFit({self.kind}, chi2 {self.chi2:.3g} on {self.freedom}, p {self.probability:.2g})"


@dataclass(frozen=True, eq=False)
class Stack:
    """Relative twists about a reference point in one unit.

    twists : (k, 6); root : (6 k, 6 k), inverse Cholesky factor of the covariance of all columns; sizes : (k, 6, 6), the
    covariance of each; freedom : degrees of freedom behind it.
    """

    twists: FloatArray
    root: FloatArray
    sizes: FloatArray
    freedom: int


def stack_twists(motion: RelativeMotion, criterion: Criterion) -> Stack:
    """Return the relative twists about the pair's centre in displacement units, with the floor in their covariance."""
    to_local = np.linalg.inv(about(motion.centre, motion.size))
    local = (to_local @ motion.twist).T
    covariance = np.einsum("ia,rasb,jb->risj", to_local, motion.full_covariance, to_local)
    motion_scale = np.where(motion.motion > 0, motion.motion, motion.motion.max(initial=1e-300))
    columns = np.arange(len(local))
    covariance[columns, :, columns] += (criterion.floor * motion_scale[:, None, None]) ** 2 * np.eye(6)
    flat = covariance.reshape(6 * len(local), -1)
    root = np.linalg.inv(np.linalg.cholesky((flat + flat.T) / 2))
    return Stack(local, root, covariance[columns, :, columns], motion.freedom)


def candidates(stack: Stack, criterion: Criterion) -> list[JointFit]:
    """Return the kinds with the fewest freedoms that the data do not refuse, the simplest first."""
    for f in range(6):
        unrestricted = fit_kind(stack, general(_span(stack, f)))
        if unrestricted.passes(criterion.significance):
            return _kinds_of(stack, unrestricted, criterion)
    return [fit_kind(stack, chart) for chart in charts(np.eye(6))]


def rival_of(stack: Stack, fits: Sequence[JointFit], criterion: Criterion) -> JointFit | None:
    """Return the other joint that the fit of the whole machine may prefer; None where the motions leave no choice.

    It has the freedom that a single mode speaks for, or is the best simple kind in place of a general joint.
    """
    f = fits[0].chart.freedoms
    if fits[0].kind == "general":
        return _best_simple_kind(stack, fits[0])
    if fits[0].probability >= criterion.significance:
        return None
    for count in range(f + 1, 6):
        unrestricted = fit_kind(stack, general(_span(stack, count)))
        if unrestricted.probability >= criterion.significance:
            return _kinds_of(stack, unrestricted, criterion)[0]
    return fit_kind(stack, charts(np.eye(6))[0])


def _best_simple_kind(stack: Stack, unrestricted: JointFit) -> JointFit | None:
    """Return the kind of as many freedoms as a general joint with the best evidence, of those that have a place."""
    fits = [fit_kind(stack, chart) for chart in charts(np.linalg.qr(unrestricted.chart.basis(unrestricted.theta))[0])]
    placed = [fit for fit in fits if not _at_infinity(fit)]
    return min(placed, key=lambda fit: _information(fit, stack), default=None)


def _kinds_of(stack: Stack, unrestricted: JointFit, criterion: Criterion) -> list[JointFit]:
    """Return the kinds of as many freedoms as a general joint that passes, the best first; itself where none is left."""
    fits = [fit_kind(stack, chart) for chart in charts(np.linalg.qr(unrestricted.chart.basis(unrestricted.theta))[0])]
    passing = [fit for fit in [*fits, unrestricted] if fit is unrestricted or _is_open(fit, unrestricted, criterion)]
    if passing == [unrestricted] and _at_infinity(unrestricted):
        placed = [fit for fit in fits if not _at_infinity(fit)]
        passing = [min(placed, key=lambda fit: _information(fit, stack))] if placed else passing
    passing.sort(key=lambda fit: (fit.chart.parameters, fit is unrestricted, fit.chi2))
    lowest = _information(passing[0], stack)
    # A kind that contains another as its special case, with more parameters, is no alternative to it.
    return [passing[0], *(fit for fit in passing[1:] if _information(fit, stack) < lowest + DECISIVE_INFORMATION
                          and fit.kind not in ("screw", "general"))]


def _is_open(fit: JointFit, unrestricted: JointFit, criterion: Criterion) -> bool:
    """Whether a kind is not refused: by its misfit, against the unrestricted subspace, or by lying at infinity."""
    parameter_gain = unrestricted.chart.parameters - fit.chart.parameters
    misfit_gain = max(fit.chi2 - unrestricted.chi2, 0.0) / max(unrestricted.chi2 / max(unrestricted.freedom, 1), 1.0)
    return (fit.passes(criterion.significance) and not _at_infinity(fit)
            and (parameter_gain <= 0 or float(stats.chi2.sf(misfit_gain, parameter_gain)) >= criterion.significance))


def _information(fit: JointFit, stack: Stack) -> float:
    """Return the Bayesian information criterion of a fit."""
    return float(fit.chi2 + fit.chart.parameters * np.log(stack.twists.size))


def settle_floor(motion: RelativeMotion, criterion: Criterion, fit: JointFit) -> JointFit:
    """Return the fit of the chosen kind, with as much of the floor as its misfit needs."""
    floor_min, floor_max = min(_REGULAR_FLOOR, criterion.floor), criterion.floor
    result = _with_floor(motion, floor_min, fit)
    if fit.freedom <= 0 or result.probability >= _MIN_NOISE_PROBABILITY:
        # Without a degree of freedom nothing tells how much of the floor there is.
        return fit if fit.freedom <= 0 else result
    for _ in range(_FLOOR_BISECTIONS):
        floor = float(np.sqrt(floor_min * floor_max))
        result = _with_floor(motion, floor, fit)
        floor_min, floor_max = (floor, floor_max) if result.chi2 > result.freedom else (floor_min, floor)
    return result


def _with_floor(motion: RelativeMotion, floor: float, fit: JointFit) -> JointFit:
    """Return the fit of the same kind with another floor."""
    return fit_kind(stack_twists(motion, Criterion(floor=floor)), fit.chart, fit.theta)


def _at_infinity(fit: JointFit) -> bool:
    """Whether a joint is so far away that its rotation cannot be distinguished from a translation.

    A hinge at infinity is a slide: the test is whether the inverse of its distance differs from zero by four standard
    deviations; beyond fifty lengths of the components no test helps. Joints within five lengths are not asked.
    """
    distance = float(np.linalg.norm(fit.chart.frame(fit.theta)[:3, 3]))
    if distance < _NEAR_DISTANCE or not len(fit.theta):
        return False
    if distance > _INFINITE_DISTANCE:
        return True
    step = 1e-6 * max(distance, 1.0)
    slope = [(np.linalg.norm(fit.chart.frame(fit.theta + s)[:3, 3]) - distance) / step for s in step * np.eye(len(fit.theta))]
    return float(np.sqrt(np.array(slope) @ fit.covariance @ np.array(slope))) > 0.25 * distance


def freedoms(stack: Stack, criterion: Criterion) -> int:
    """Return the fewest freedoms whose general joint passes."""
    for f in range(6):
        if fit_kind(stack, general(_span(stack, f))).passes(criterion.significance):
            return f
    return 6


def _span(stack: Stack, f: int) -> FloatArray:
    """Return start values: the f leading directions of the twists, whitened by the mean covariance."""
    if f == 0:
        return np.zeros((6, 0))
    size = np.sqrt(np.maximum(np.trace(stack.sizes, axis1=1, axis2=2), 1e-300))
    root = np.linalg.cholesky((stack.sizes / size[:, None, None] ** 2).mean(axis=0))
    whitened = np.linalg.solve(root, stack.twists.T / size)
    span = root @ np.linalg.svd(whitened)[0][:, :f]
    return np.asarray(np.linalg.qr(span)[0])


def fit_kind(stack: Stack, chart: FreedomChart, start: FloatArray | None = None) -> JointFit:
    """Return the fit of one kind; a kind far from any noise is followed only as long as it comes nearer fast."""
    count = len(stack.twists)

    def residual(theta: FloatArray) -> FloatArray:
        return project(stack, chart.basis(theta))

    def slopes(theta: FloatArray) -> FloatArray:
        return _projected_slopes(stack, chart, theta)

    theta, n = np.zeros(chart.parameters) if start is None else start, chart.parameters
    covariance, gain = np.zeros((n, n)), np.zeros((n, count, 6))
    freedom = 6 * count - chart.freedoms * count - n
    if n:
        previous_cost = np.inf
        for steps in (*[_BURST_STEPS] * _BURST_COUNT, _FINAL_STEPS):
            solution = optimize.least_squares(residual, theta, jac=slopes, method="trf", x_scale="jac", xtol=1e-10, ftol=1e-10,
                                              gtol=1e-10, max_nfev=steps)
            theta = np.asarray(solution.x)
            if solution.status > 0 or (2 * solution.cost > _HOPELESS_MISFIT * max(freedom, 1)
                                       and solution.cost > _MAX_BURST_RATIO * previous_cost):
                break
            previous_cost = solution.cost
        jacobian = np.asarray(solution.jac)
        covariance = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-14, hermitian=True)
        # d theta = -(J^T J)^-1 J^T (projected, whitened) d t to first order.
        gain = -(covariance @ jacobian.T @ stack.root).reshape(n, count, 6)
    by_mode = (residual(theta) ** 2).reshape(count, 6).sum(axis=1)
    chi2, misfit_mode, free = float(by_mode.sum()), int(by_mode.argmax()), 6 - chart.freedoms
    chance = _chance(chi2, freedom, stack)
    mode_misfit = float(by_mode[misfit_mode]) / max(free, 1)
    can_leave_out = count >= _MIN_MODES_OF_FREEDOM and freedom > free > 0 and mode_misfit <= _MAX_MODE_MISFIT
    without = _chance(chi2 - float(by_mode[misfit_mode]), freedom - free, stack) if can_leave_out else chance
    return JointFit(chart, theta, covariance, gain, chi2, freedom, chance, without, misfit_mode, mode_misfit)


def _chance(chi2: float, freedom: int, stack: Stack) -> float:
    """Return the probability of so large a misfit by noise, as well as that is known."""
    return float(stats.f.sf(chi2 / freedom, freedom, max(stack.freedom, 1))) if freedom > 0 else 1.0


def _columns(stack: Stack, basis: FloatArray) -> FloatArray:
    """Return the whitened columns (6 k, f k) of the free coordinates of all modes."""
    count = len(stack.twists)
    return np.asarray((stack.root.reshape(-1, count, 6) @ basis).reshape(-1, count * basis.shape[1]))


def project(stack: Stack, basis: FloatArray) -> FloatArray:
    """Return the whitened residuals (6 k,) of the twists in a basis (6, f), free coordinates eliminated."""
    y = stack.root @ stack.twists.ravel()
    if basis.shape[1] == 0:
        return np.asarray(y)
    q = np.linalg.qr(_columns(stack, basis))[0]
    return np.asarray(y - q @ (q.T @ y))


def _projected_slopes(stack: Stack, chart: FreedomChart, theta: FloatArray) -> FloatArray:
    """Return the slopes (6 k, n) of the projected residuals (Kaufman, BIT 15 (1975) 49: the part beside the columns)."""
    basis, y = chart.basis(theta), stack.root @ stack.twists.ravel()
    q, r = np.linalg.qr(_columns(stack, basis))
    free = np.linalg.lstsq(r, q.T @ y, rcond=1e-12)[0].reshape(-1, basis.shape[1])
    moved = [(free @ ((chart.basis(theta + step) - basis) / _SLOPE_STEP).T).ravel()
             for step in _SLOPE_STEP * np.eye(len(theta))]
    slope = -stack.root @ np.stack(moved, axis=1)
    return np.asarray(slope - q @ (q.T @ slope))
