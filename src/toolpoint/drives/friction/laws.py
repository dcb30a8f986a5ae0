"""Friction laws with one interface: steady curve, its slope, and the record that the simulation kernel reads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive, scalar
from toolpoint.drives.friction.records import BRISTLE, LAW, MAX_ELEMENTS, MAXWELL, STATIC


@runtime_checkable
class FrictionLaw(Protocol):
    """Interface of every friction law; forces in N or torques in N m, velocities in m/s or rad/s."""

    def steady(self, velocity: FloatArray | float) -> FloatArray:
        """Return the force at constant velocity."""

    @property
    def record(self) -> np.ndarray:
        """The law as the record (`records.LAW`, shape ()) that the simulation kernel reads."""


@dataclass(frozen=True)
class _SteadyCurve:
    """Dry level g(v) = a0 + a1 exp(-|v/v1|^d1) + a2 exp(-|v/v2|^d2) and a viscous part, common to all laws."""

    a0: float = 0.0
    a1: float = 0.0
    v1: float = 1.0
    d1: float = 2.0
    a2: float = 0.0
    v2: float = 1.0
    d2: float = 1.0
    viscous: float = 0.0

    def level(self, velocity: FloatArray | float) -> FloatArray:
        v = np.abs(np.asarray(velocity, float))
        return self.a0 + self.a1 * np.exp(-((v / self.v1) ** self.d1)) + self.a2 * np.exp(-((v / self.v2) ** self.d2))

    def steady(self, velocity: FloatArray | float) -> FloatArray:
        v = np.asarray(velocity, float)
        return np.sign(v) * self.level(v) + self.viscous * v

    def slope(self, velocity: FloatArray | float) -> FloatArray:
        # An exponent below one falls without bound at rest: the slope there is large, not infinite.
        v = np.maximum(np.abs(np.asarray(velocity, float)), 1e-300)
        total = np.full_like(v, self.viscous)
        for a, vs, d in ((self.a1, self.v1, self.d1), (self.a2, self.v2, self.d2)):
            if a:
                total = total - a * d / vs * (v / vs) ** (d - 1) * np.exp(-((v / vs) ** d))
        return total

    def record(self, kind: int) -> np.ndarray:
        record = np.zeros((), LAW)
        record["kind"], record["level"], record["viscous"] = kind, self.a0, self.viscous
        record["fall_size"], record["fall_velocity"] = (self.a1, self.a2), (self.v1, self.v2)
        record["fall_exponent"] = self.d1, self.d2
        return record


class _Law(ABC):
    """Steady curve and slope of a law from its `_curve`."""

    _kind = STATIC

    @property
    @abstractmethod
    def _curve(self) -> _SteadyCurve: ...

    def steady(self, velocity: FloatArray | float) -> FloatArray:
        """Return the force at constant velocity: sgn(v) g(v) + viscous part."""
        return self._curve.steady(velocity)

    def slope(self, velocity: FloatArray | float) -> FloatArray:
        """Return dF/dv of the steady curve for v != 0, N s/m or N m s/rad; negative on the falling branch."""
        return self._curve.slope(velocity)

    def level(self, velocity: FloatArray | float) -> FloatArray:
        """Return the dry level g(v) > 0 without the viscous part."""
        return self._curve.level(velocity)

    @property
    def record(self) -> np.ndarray:
        """The law as the record (`records.LAW`, shape ()) that the simulation kernel reads."""
        return self._curve.record(self._kind)


@dataclass(frozen=True)
class Coulomb(_Law):
    """Dry friction F_c sgn(v) + sigma2 v; at rest any force up to F_c.

    Parameters
    ----------
    coulomb : float
        F_c, N or N m, at least zero.
    viscous : float
        sigma2, N s/m or N m s/rad, at least zero.

    Examples
    --------
    >>> float(Coulomb(2.0, viscous=0.1).steady(-3.0))
    -2.3
    """

    coulomb: float
    viscous: float = 0.0

    def __post_init__(self) -> None:
        _not_negative(self, "coulomb", "viscous")

    @property
    def _curve(self) -> _SteadyCurve:
        return _SteadyCurve(a0=self.coulomb, viscous=self.viscous)


@dataclass(frozen=True)
class Viscous(_Law):
    """Viscous friction sigma2 v, N s/m or N m s/rad.

    Examples
    --------
    >>> float(Viscous(0.1).steady(3.0))
    0.30000000000000004
    """

    viscous: float

    def __post_init__(self) -> None:
        _not_negative(self, "viscous")

    @property
    def _curve(self) -> _SteadyCurve:
        return _SteadyCurve(viscous=self.viscous)


@dataclass(frozen=True)
class Stribeck(_Law):
    """Stribeck curve ``[F_c + (F_s - F_c) exp(-|v/v_s|^delta)] sgn(v) + sigma2 v``; at rest any force up to F_s.

    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083.

    Examples
    --------
    >>> law = Stribeck(coulomb=2.0, static=3.0, stribeck_velocity=0.5)
    >>> float(law.level(0.0)), round(float(law.level(100.0)), 9)
    (3.0, 2.0)
    """

    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float = 0.0
    exponent: float = 2.0

    def __post_init__(self) -> None:
        _not_negative(self, "coulomb", "viscous")
        _stribeck(self)

    @property
    def _curve(self) -> _SteadyCurve:
        return _SteadyCurve(self.coulomb, self.static - self.coulomb, self.stribeck_velocity, self.exponent,
                      viscous=self.viscous)


@dataclass(frozen=True)
class TwoExponential(_Law):
    """Two-exponential curve ``[F_s exp(-|v|/v_1) + F_c (1 - exp(-|v|/v_2))] sgn(v) + sigma2 v``.

    Source: Erkorkmaz, Altintas, Int. J. Machine Tools and Manufacture 41 (2001) 1487.

    Examples
    --------
    >>> law = TwoExponential(coulomb=2.0, static=3.0, static_velocity=0.1, coulomb_velocity=0.2)
    >>> float(law.level(0.0)), round(float(law.level(100.0)), 9)
    (3.0, 2.0)
    """

    coulomb: float
    static: float
    static_velocity: float
    coulomb_velocity: float
    viscous: float = 0.0

    def __post_init__(self) -> None:
        _not_negative(self, "coulomb", "static", "viscous")
        positive("TwoExponential.static_velocity", self.static_velocity)
        positive("TwoExponential.coulomb_velocity", self.coulomb_velocity)

    @property
    def _curve(self) -> _SteadyCurve:
        # The source rises to Coulomb friction by a second exponential: the same curve with a negative part.
        return _SteadyCurve(self.coulomb, self.static, self.static_velocity, 1.0, -self.coulomb, self.coulomb_velocity, 1.0,
                      self.viscous)


@dataclass(frozen=True)
class LuGre(_Law):
    r"""LuGre bristle friction.

    .. math:: \dot z = v - \sigma_0 |v| z / g(v), \quad F = \sigma_0 z + \sigma_1 \dot z + \sigma_2 v,
              \quad g = F_c + (F_s - F_c) e^{-|v/v_s|^\delta}

    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.

    Examples
    --------
    >>> law = LuGre(stiffness=1e5, damping=300.0, coulomb=1.0, static=1.5, stribeck_velocity=1e-3)
    >>> float(law.steady(1.0))
    1.0
    """

    stiffness: float
    damping: float
    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float = 0.0
    exponent: float = 2.0
    _kind = BRISTLE

    def __post_init__(self) -> None:
        _not_negative(self, "damping", "viscous")
        positive("LuGre.stiffness", self.stiffness)
        positive("LuGre.coulomb", self.coulomb)
        _stribeck(self)

    @property
    def _curve(self) -> _SteadyCurve:
        return _SteadyCurve(self.coulomb, self.static - self.coulomb, self.stribeck_velocity, self.exponent,
                      viscous=self.viscous)

    @property
    def record(self) -> np.ndarray:
        """The law as the record (`records.LAW`, shape ()) that the simulation kernel reads."""
        record = self._curve.record(self._kind)
        record["bristle_stiffness"], record["bristle_damping"] = self.stiffness, self.damping
        return record


@dataclass(frozen=True)
class MaxwellSlip(_Law):
    r"""Generalised Maxwell-slip friction: N massless blocks in parallel, each a spring that sticks or slips.

    Stick: :math:`\dot F_i = k_i v` until :math:`|F_i| = \alpha_i s(v)`; slip:
    :math:`\dot F_i = \mathrm{sgn}(v) C (\alpha_i - |F_i|/s(v))`; sum plus :math:`\sigma_2 v`; the Stribeck curve s(v)
    is that of `curve`.
    Source: Al-Bender, Lampaert, Swevers, IEEE Trans. Automatic Control 50 (2005) 1883.

    Parameters
    ----------
    stiffness : (n_elements,) floats
        k_i, N/m or N m/rad.
    share : (n_elements,) floats
        alpha_i, sums to one.
    curve : Stribeck
        s(v) and the viscous part.
    attraction : float
        C, N/s or N m/s: how fast a slipping block follows the Stribeck curve.

    Examples
    --------
    >>> law = MaxwellSlip((4e4, 1e4), (0.6, 0.4), Stribeck(1.0, 1.5, 1e-3), attraction=1e3)
    >>> float(law.steady(1.0))
    1.0
    """

    stiffness: tuple[float, ...]
    share: tuple[float, ...]
    curve: Stribeck
    attraction: float
    _kind = MAXWELL
    _names: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        k, share = floats("MaxwellSlip.stiffness", self.stiffness, (None,)), floats("share", self.share, (None,))
        if k.size != share.size or not 1 <= k.size <= MAX_ELEMENTS:
            fail("MaxwellSlip.share", f"{share.size} shares for {k.size} stiffnesses",
                 f"must be as many, 1 to {MAX_ELEMENTS}")
        if k.min() <= 0 or share.min() <= 0 or abs(share.sum() - 1) > 1e-6:
            fail("MaxwellSlip.share", f"sum {share.sum():g}", "must be positive and sum to one")
        positive("MaxwellSlip.attraction", self.attraction)
        object.__setattr__(self, "stiffness", tuple(k.tolist()))
        object.__setattr__(self, "share", tuple(share.tolist()))

    @property
    def _curve(self) -> _SteadyCurve:
        return self.curve._curve

    @property
    def record(self) -> np.ndarray:
        """The law as the record (`records.LAW`, shape ()) that the simulation kernel reads."""
        record, n = self._curve.record(self._kind), len(self.stiffness)
        record["attraction"], record["elements"] = self.attraction, n
        record["element_stiffness"][:n], record["element_share"][:n] = self.stiffness, self.share
        return record


def _not_negative(law: object, *names: str) -> None:
    for name in names:
        if scalar(f"{type(law).__name__}.{name}", getattr(law, name)) < 0:
            fail(f"{type(law).__name__}.{name}", f"{getattr(law, name):g}", "must not be negative")


def _stribeck(law: Stribeck | LuGre) -> None:
    name = type(law).__name__
    positive(f"{name}.static", law.static)
    positive(f"{name}.stribeck_velocity", law.stribeck_velocity)
    positive(f"{name}.exponent", law.exponent)
    if law.static < law.coulomb:
        fail(f"{name}.static", f"{law.static:g} below coulomb {law.coulomb:g}", "must be at least the Coulomb level",
             remedy="exchange the two, or use a Coulomb law")
