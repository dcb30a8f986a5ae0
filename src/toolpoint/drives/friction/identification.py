"""Identification of friction from torques at constant velocity, and plausibility of a law in a servo loop."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray, ToolpointWarning, fail, floats, one_of, positive
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.drives.friction.laws import Coulomb, Stribeck, TwoExponential, _Law


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """Fitted law, standard deviations of its parameters (in the order of its fields, the offset last), residual rms, status.

    `offset` is what is added at either direction of motion (weight, preload, offset of the current sensor, or friction that
    differs by direction: records of steady speeds cannot tell these apart); `levels` the dry level moving forward and
    backward, offset + F_c and offset - F_c; `scatter` that of the points, not-a-number where it is not known;
    `inseparable` names parameters that the points hardly tell apart.
    """

    law: Coulomb | Stribeck | TwoExponential
    deviation: FloatArray
    residual: float
    status: str
    offset: float = 0.0
    levels: tuple[float, float] = (0.0, 0.0)
    scatter: float = float("nan")
    inseparable: tuple[str, ...] = ()

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Misfit of the law beyond the scatter of the points, and parameters that the points do not tell apart."""
        misfit = [] if self.status == "converged" else [Doubt("friction", self.status)]
        return (*misfit, *(Doubt("friction", words) for words in self.inseparable))


# Residual of a law that fits: over the scatter of the points, or of the dry level where the scatter is not known.
_MAX_RESIDUAL_OVER_SCATTER, _MAX_RESIDUAL_FRACTION = 3.0, 0.05
_MAX_PARAMETER_CORRELATION = 0.995  # of two parameters: above it the points do not tell them apart


def constant_velocity_points(records: Sequence[tuple[FloatArray, FloatArray]], settled: float = 0.5
                             ) -> tuple[FloatArray, FloatArray]:
    """Return mean velocity and mean torque of records (velocity, torque), the last `settled` share of each averaged.

    Examples
    --------
    >>> import numpy as np
    >>> velocity, torque = constant_velocity_points([(np.full(10, 2.0), np.full(10, 1.5))])
    >>> float(velocity[0]), float(torque[0])
    (2.0, 1.5)
    """
    positive("settled", settled, 1.0)
    points = []
    for velocity, torque in records:
        v, t = floats("velocity", velocity, (None,)), floats("torque", torque, np.shape(velocity))
        # The first part of a record holds the acceleration to its speed, whose inertia would count as friction.
        part = slice(int(len(v) * (1 - settled)), None)
        if v[part].std() > 0.5 * abs(v[part].mean()):
            warnings.warn(f"velocity {v[part].mean():g} is not constant within 50 %: stick-slip or a short record",
                          ToolpointWarning, stacklevel=2)
        points.append((v[part].mean(), t[part].mean()))
    table = np.array(points)
    return table[:, 0], table[:, 1]


def identify_friction(velocity: FloatArray, torque: FloatArray, law: str = "stribeck", *, scatter: float | None = None
                      ) -> FrictionFit:
    """Return the law, with an offset, fitted to steady torques at velocities of either sign.

    Parameters
    ----------
    velocity, torque : (n,) floats
        rad/s and N m (or m/s and N, or A); both without inertia torque. With velocities of one sign only the offset is not
        told from the dry level and stays zero; `inseparable` says so.
    law : str
        ``coulomb``, ``stribeck`` or ``two-exponential``.
    scatter : float, optional
        Standard deviation of one torque, in its unit; where left out it is taken from speeds that occur more than once.

    The status is "converged" only where the residual is within three times the scatter (or, where that is not known, within
    5 % of the dry level).

    Examples
    --------
    >>> import numpy as np
    >>> speed = np.array([-4.0, -2.0, -1.0, 1.0, 2.0, 4.0])
    >>> fit = identify_friction(speed, 2.0 * np.sign(speed) + 0.1 * speed + 0.3, "coulomb")
    >>> round(float(fit.law.coulomb), 6), round(float(fit.law.viscous), 6), round(float(fit.offset), 6)
    (2.0, 0.1, 0.3)
    """
    one_of("law", law, ("coulomb", "stribeck", "two-exponential"))
    v = floats("velocity", velocity, (None,))
    t = floats("torque", torque, v.shape)
    if (v == 0).any():
        fail("velocity", "a zero", "must not be zero: friction at rest is not a steady torque", remedy="leave those points out")
    need = {"coulomb": 2, "stribeck": 4, "two-exponential": 5}[law]
    if np.unique(np.abs(v)).size < need:
        fail("velocity", f"{np.unique(np.abs(v)).size} speeds", f"must be at least {need} for {law}")
    # One direction alone cannot tell a constant load (a weight, an offset of the sensor) from dry friction.
    both = bool((v > 0).any() and (v < 0).any())
    best, offset = _fit(law, v, t, both)
    fitted = _law_of(law, best.x[:need])
    covariance, inseparable = _covariance(best, v.size, _NAMES[law][: len(best.x)])
    if not both:
        inseparable = (*inseparable, "offset and dry level (one direction of motion only)")
    residual = float(np.sqrt(2 * best.cost / v.size))
    spread = _repeat_scatter(v, t) if scatter is None else positive("scatter", scatter)
    level = float(fitted.level(float(np.abs(v).max())))
    return FrictionFit(fitted, np.sqrt(np.diag(covariance)), residual, _status(best.success, residual, spread, level=level),
                       offset, (offset + level, offset - level), spread, inseparable)


_NAMES = {"coulomb": ("dry level", "viscous", "offset"),
          "stribeck": ("dry level", "rise at rest", "Stribeck velocity", "viscous", "offset"),
          "two-exponential": ("dry level", "static level", "static velocity", "Coulomb velocity", "viscous", "offset")}


def _law_of(law: str, p: FloatArray) -> Coulomb | Stribeck | TwoExponential:
    if law == "stribeck":
        coulomb, rise, velocity, viscous = p
        return Stribeck(coulomb, coulomb + rise, velocity, viscous)
    return Coulomb(*p) if law == "coulomb" else TwoExponential(*p)


def _fit(law: str, v: FloatArray, t: FloatArray, both: bool) -> tuple[scipy.optimize.OptimizeResult, float]:
    """Return the best of several least-squares fits and the offset; with one direction the offset is left out."""
    middle = 0.5 * (float(np.median(t[v > 0])) + float(np.median(t[v < 0]))) if both else 0.0
    guess = _first_guess(law, v, t - middle)
    n_parameters = len(guess)
    # Parameters differ in unit and size, so each step is measured by its own first guess.
    scale = np.maximum(np.abs([*guess, middle][: n_parameters + both]), 1e-6 * max(np.abs(t).max(), 1e-300))
    lower_bounds = np.array([*[1e-15] * n_parameters, -np.inf][: n_parameters + both])

    def residual(p: FloatArray) -> FloatArray:
        return _law_of(law, p[:n_parameters]).steady(v) + (p[n_parameters] if both else 0.0) - t

    best = None
    # The exponentials have several minima: the velocities of the law begin at four scales, and the best fit counts.
    for factor in (1.0, 0.3, 3.0, 10.0):
        first = np.maximum(np.array(guess), 1e-12)
        first[2:-1] *= factor
        fit = scipy.optimize.least_squares(residual, np.array([*first, middle][: n_parameters + both]), x_scale=scale,
                                           bounds=(lower_bounds, np.inf), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        best = fit if best is None or fit.cost < best.cost else best
    assert best is not None
    return best, float(best.x[n_parameters]) if both else 0.0


def _covariance(best: scipy.optimize.OptimizeResult, points: int, names: Sequence[str]) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the covariance of the parameters, and the pairs that the points do not tell apart."""
    jacobian = np.asarray(best.jac)
    size = np.linalg.norm(jacobian, axis=0)
    # A parameter on which no point depends would make the matrix singular: it gets no deviation, and is named.
    blind = size < 1e-9 * size.max()
    scaled = jacobian / np.where(blind, 1.0, size)
    shape = np.linalg.pinv(scaled.T @ scaled)
    free = max(points - len(best.x), 1)
    covariance = shape * (2 * best.cost / free) / np.outer(np.where(blind, np.inf, size), np.where(blind, np.inf, size))
    spread = np.sqrt(np.maximum(np.diag(shape), 1e-300))
    correlation = shape / np.outer(spread, spread)
    inseparable = [f"{names[i]} and {names[k]}" for i in range(len(names)) for k in range(i)
                   if abs(correlation[i, k]) > _MAX_PARAMETER_CORRELATION]
    return covariance, (*(f"{name} (no point depends on it)" for name, dark in zip(names, blind, strict=True) if dark),
                        *inseparable)


def _repeat_scatter(v: FloatArray, t: FloatArray) -> float:
    """Return the standard deviation of torques at equal velocities; not-a-number where none occurs twice."""
    _, group, number = np.unique(v, return_inverse=True, return_counts=True)
    free = int((number - 1).sum())
    # One repeated pair gives a standard deviation that is wrong by a factor of two as often as not.
    if free < 2:
        return float("nan")
    mean = np.bincount(group, t) / number
    return float(np.sqrt(((t - mean[group]) ** 2).sum() / free))


def _status(success: bool, residual: float, scatter: float, *, level: float) -> str:
    if not success:
        return "not converged: give more speeds below the minimum of the curve"
    limit = _MAX_RESIDUAL_OVER_SCATTER * scatter if np.isfinite(scatter) else _MAX_RESIDUAL_FRACTION * abs(level)
    if residual <= max(limit, 1e-12 * abs(level)):
        return "converged"
    against = f"{residual / max(scatter, 1e-300):.3g} times the scatter of the points" if np.isfinite(scatter) else \
        f"{100 * residual / max(abs(level), 1e-300):.3g} % of the dry level"
    return (f"does not fit: the residual {residual:.3g} is {against}; the friction depends on more than speed (place, load, "
            "acceleration), or another law is needed")


def _first_guess(law: str, v: FloatArray, t: FloatArray) -> list[float]:
    """Return the parameters to start from: smallest torque, torque at the slowest speed, a low speed."""
    size, order = np.abs(t), np.argsort(np.abs(v))
    # At the minimum of the curve the dry level is nearly alone; the slowest speed has nearly all of the rise.
    smallest, first = float(size.min()), float(size[order][0])
    speed = float(np.sort(np.abs(v))[len(v) // 4])
    if law == "coulomb":
        return [smallest, 1e-3]
    if law == "stribeck":
        return [smallest, max(first - smallest, 1e-3 * float(size.max())), speed, 1e-3]
    return [smallest, first, speed, speed, 1e-3]


@dataclass(frozen=True)
class Plausibility(NotebookText):
    """Report on a friction law in a velocity loop.

    `ratio` F_s/F_c; `steepest` most negative slope of the curve and the speed of it; `loop_gain` of the velocity loop, in
    the law's unit; `critical_speed` below which the falling curve is steeper than the loop gain, and `critical_feed`
    in m/s; doubts.
    """

    ratio: float
    steepest: float
    steepest_speed: float
    loop_gain: float
    critical_speed: float
    critical_feed: float
    doubts: tuple[Doubt, ...]

    def __repr__(self) -> str:
        return (f"Plausibility(F_s/F_c {self.ratio:.4g}; slope {self.steepest:.4g} against loop gain {self.loop_gain:.4g}; "
                f"critical feed {60e3 * self.critical_feed:.3g} mm/min)")


def check_plausibility(law: _Law, loop_gain: float, lead: float, *, warn: bool = True) -> Plausibility:
    """Return the report of a friction law on the motor shaft in a velocity loop of gain `loop_gain` (N m s/rad).

    Below the critical speed dF/dv + loop gain < 0: no constant speed is stable there, the axis sticks and slips.
    Published drives have F_s/F_c of 1.08 to 1.5; a ratio above 2 is marked. `lead` in m/rad turns speed into feed.

    Examples
    --------
    >>> check_plausibility(Stribeck(2.0, 2.4, 1.0), loop_gain=1.0, lead=2e-3).critical_feed
    0.0
    """
    gain, ratio = positive("loop_gain", loop_gain), float(law.level(0.0) / max(float(law.level(1e9)), 1e-300))
    curve = law._curve
    speeds = [v for a, v in ((curve.a1, curve.v1), (curve.a2, curve.v2)) if a]
    doubts: list[Doubt] = []
    if not speeds:
        return Plausibility(ratio, float(law.slope(1.0)), 0.0, gain, 0.0, 0.0, ())
    # Even in the logarithm: the two velocities of a law may be decades apart.
    grid = np.geomspace(min(speeds) * 1e-4, max(speeds) * 50, 4000)
    slope = law.slope(grid)
    steepest = int(slope.argmin())
    unstable = np.flatnonzero(slope < -gain)
    critical = 0.0
    if unstable.size:
        # The slope may cross the loop gain several times: above its last crossing every constant speed is stable.
        last = int(unstable[-1])
        critical = float(scipy.optimize.brentq(lambda v: float(law.slope(v)) + gain, grid[last], grid[last + 1]))
        doubts.append(Doubt("friction curve", f"falls by {-slope[steepest]:.3g} against a loop gain of {gain:.4g}: stick-slip "
                            f"below {60e3 * critical * lead:.3g} mm/min (critical feed)",
                            figure=-float(slope[steepest]) / gain))
    if ratio > 2:
        doubts.append(Doubt("F_s/F_c", f"is {ratio:.4g}; published drives have 1.08 to 1.5", figure=ratio))
    if warn and doubts:
        warnings.warn("; ".join(doubts), ToolpointWarning, stacklevel=2)
    return Plausibility(ratio, float(slope[steepest]), float(grid[steepest]), gain, critical, critical * lead, tuple(doubts))


def friction_variants(law: Stribeck, ratio: float = 1.5) -> dict[str, Coulomb | Stribeck]:
    """Return named readings of a doubtful Stribeck law: ``literal``; ``F_c = F_s/ratio``; ``Coulomb`` at the level F_s.

    The published value that is believed is F_s, the level that the torque record shows; nothing is replaced silently.

    Examples
    --------
    >>> sorted(friction_variants(Stribeck(1.0, 3.0, 0.5)))
    ['Coulomb', 'F_c = F_s/1.5', 'literal']
    """
    level = law.static / positive("ratio", ratio)
    return {"literal": law,
            f"F_c = F_s/{ratio:g}": Stribeck(level, law.static, law.stribeck_velocity, law.viscous, law.exponent),
            "Coulomb": Coulomb(law.static, law.viscous)}
