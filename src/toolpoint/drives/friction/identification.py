"""Friction from torque records at constant velocity, and whether a friction law is plausible in a servo loop."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, least_squares

from toolpoint._check import FloatArray, ToolpointWarning, fail, floats, one_of, positive
from toolpoint.drives.friction.laws import Coulomb, Stribeck, TwoExponential, _Law


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """Fitted law, standard deviations of its parameters (in the order of its fields), residual rms and status."""

    law: Coulomb | Stribeck | TwoExponential
    deviation: FloatArray
    residual: float
    status: str


def constant_velocity_points(records: Sequence[tuple[FloatArray, FloatArray]], settled: float = 0.5
                             ) -> tuple[FloatArray, FloatArray]:
    """Return mean velocity and mean torque of records (velocity, torque), the last `settled` share of each averaged."""
    positive("settled", settled, 1.0)
    points = []
    for velocity, torque in records:
        v, t = floats("velocity", velocity, (None,)), floats("torque", torque, np.shape(velocity))
        part = slice(int(len(v) * (1 - settled)), None)
        if v[part].std() > 0.5 * abs(v[part].mean()):
            warnings.warn(f"velocity {v[part].mean():g} is not constant within 50 %: stick-slip or a short record",
                          ToolpointWarning, stacklevel=2)
        points.append((v[part].mean(), t[part].mean()))
    table = np.array(points)
    return table[:, 0], table[:, 1]


def identify_friction(velocity: FloatArray, torque: FloatArray, law: str = "stribeck") -> FrictionFit:
    """Return the law fitted to steady torques at velocities of either sign.

    Parameters
    ----------
    velocity, torque : (n,) floats
        rad/s and N m (or m/s and N); both without inertia torque.
    law : str
        ``coulomb``, ``stribeck`` or ``two-exponential``.
    """
    one_of("law", law, ("coulomb", "stribeck", "two-exponential"))
    v = floats("velocity", velocity, (None,))
    t = floats("torque", torque, v.shape)
    if (v == 0).any():
        fail("velocity", "a zero", "must not be zero: friction at rest is not a steady torque", "leave those points out")
    need = {"coulomb": 2, "stribeck": 4, "two-exponential": 5}[law]
    if np.unique(np.abs(v)).size < need:
        fail("velocity", f"{np.unique(np.abs(v)).size} speeds", f"must be at least {need} for {law}")
    guess = _first_guess(law, v, t)
    make = {"coulomb": Coulomb, "two-exponential": TwoExponential, "stribeck": None}[law]

    def built(p: FloatArray) -> Coulomb | Stribeck | TwoExponential:
        if make is not None:
            return make(*p)
        coulomb, rise, velocity, viscous = p
        return Stribeck(coulomb, coulomb + rise, velocity, viscous)

    def residual(p: FloatArray) -> FloatArray:
        return built(p).steady(v) - t

    scale = np.maximum(np.abs(guess), 1e-6 * np.abs(t).max())
    best = None
    for factor in (1.0, 0.3, 3.0, 10.0):
        first = np.array(guess)
        first[2:-1] *= factor
        fit = least_squares(residual, np.maximum(first, 1e-12), x_scale=scale,
                              bounds=(1e-15, np.inf), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        best = fit if best is None or fit.cost < best.cost else best
    assert best is not None
    free = max(v.size - len(guess), 1)
    jacobian = np.asarray(best.jac)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * 2 * best.cost / free
    status = "converged" if best.success else "not converged: give more speeds below the minimum of the curve"
    return FrictionFit(built(best.x), np.sqrt(np.diag(covariance)), float(np.sqrt(2 * best.cost / v.size)), status)


def _first_guess(law: str, v: FloatArray, t: FloatArray) -> list[float]:
    """Return the parameters to start from: smallest torque, torque at the slowest speed, a low speed."""
    size, order = np.abs(t), np.argsort(np.abs(v))
    low, first = float(size.min()), float(size[order][0])
    speed = float(np.sort(np.abs(v))[len(v) // 4])
    if law == "coulomb":
        return [low, 1e-3]
    if law == "stribeck":
        return [low, max(first - low, 1e-3 * float(size.max())), speed, 1e-3]
    return [low, first, speed, speed, 1e-3]


@dataclass(frozen=True)
class Plausibility:
    """What a friction law does in a velocity loop.

    `ratio` F_s/F_c; `steepest` most negative slope of the curve and the speed of it; `loop_gain` of the velocity loop, in
    the law's unit; `critical_speed` below which the falling curve is steeper than the loop gain, and `critical_feed`
    in m/s; notes say what is doubtful.
    """

    ratio: float
    steepest: float
    steepest_speed: float
    loop_gain: float
    critical_speed: float
    critical_feed: float
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return (f"Plausibility(F_s/F_c {self.ratio:.4g}; slope {self.steepest:.4g} against loop gain {self.loop_gain:.4g}; "
                f"critical feed {60e3 * self.critical_feed:.3g} mm/min)")


def check_plausibility(law: _Law, loop_gain: float, lead: float, *, warn: bool = True) -> Plausibility:
    """Return the report of a friction law on the motor shaft in a velocity loop of gain `loop_gain` (N m s/rad).

    Below the critical speed dF/dv + loop gain < 0: no constant speed is stable there, the axis sticks and slips.
    Published drives have F_s/F_c of 1.08 to 1.5; a ratio above 2 is marked. `lead` in m/rad turns speed into feed.
    """
    gain, ratio = positive("loop_gain", loop_gain), float(law.level(0.0) / max(float(law.level(1e9)), 1e-300))
    curve = law._curve
    speeds = [v for a, v in ((curve.a1, curve.v1), (curve.a2, curve.v2)) if a]
    notes: list[str] = []
    if not speeds:
        return Plausibility(ratio, float(law.slope(1.0)), 0.0, gain, 0.0, 0.0, ())
    grid = np.geomspace(min(speeds) * 1e-4, max(speeds) * 50, 4000)
    slope = law.slope(grid)
    worst = int(slope.argmin())
    unstable = np.flatnonzero(slope < -gain)
    critical = 0.0
    if unstable.size:
        last = int(unstable[-1])
        critical = float(brentq(lambda v: float(law.slope(v)) + gain, grid[last], grid[last + 1]))
        notes.append(f"the friction curve falls by {-slope[worst]:.3g} against a loop gain of {gain:.4g}: stick-slip below "
                     f"{60e3 * critical * lead:.3g} mm/min (critical feed)")
    if ratio > 2:
        notes.append(f"F_s/F_c is {ratio:.4g}; published drives have 1.08 to 1.5")
    if warn and notes:
        warnings.warn("; ".join(notes), ToolpointWarning, stacklevel=2)
    return Plausibility(ratio, float(slope[worst]), float(grid[worst]), gain, critical, critical * lead, tuple(notes))


def friction_variants(law: Stribeck, ratio: float = 1.5) -> dict[str, Coulomb | Stribeck]:
    """Return named readings of a doubtful Stribeck law: ``literal``; ``F_c = F_s/ratio``; ``Coulomb`` at the level F_s.

    The published value that is believed is F_s, the level that the torque record shows; nothing is replaced silently.
    """
    level = law.static / positive("ratio", ratio)
    return {"literal": law,
            f"F_c = F_s/{ratio:g}": Stribeck(level, law.static, law.stribeck_velocity, law.viscous, law.exponent),
            "Coulomb": Coulomb(law.static, law.viscous)}
