r"""Force laws other than the linear-edge one, orthogonal-to-oblique transformation, chip thickness, forces of a rigid
cutter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from toolpoint._check import FloatArray, fail, floats, nonnegative, positive, scalar
from toolpoint.cutting.cut.coefficients import CuttingCoefficients

if TYPE_CHECKING:
    from toolpoint.cutting.cut.problem import MillingProblem


class ForceLaw(Protocol):
    """Force per metre of edge from the chip thickness."""

    def per_length(self, chip: FloatArray) -> FloatArray:
        """Return (F_t, F_n, F_a) per metre of edge, N/m, shape (..., 3), zero where the chip is not above zero."""
        ...


@dataclass(frozen=True)
class LinearEdge:
    """F = K h + K_e, from `CuttingCoefficients`."""

    coefficients: CuttingCoefficients

    def per_length(self, chip: FloatArray) -> FloatArray:
        """See `ForceLaw.per_length`."""
        h = np.asarray(chip, float)[..., None]
        return np.where(h > 0, self.coefficients.cutting * h + self.coefficients.edge, 0.0)


@dataclass(frozen=True)
class Kienzle:
    r"""Kienzle's law: :math:`F_t/b = k_{c1.1} h (h/h_0)^{-m_c}`, h_0 = 1 mm, normal and axial likewise.

    Parameters
    ----------
    kc : float
        k_c1.1, Pa.
    mc : float
        Exponent, 0 .. 1.
    kn, mn, ka, ma : float
        The same for the normal and the axial force.

    Source: Kienzle, VDI-Z 94 (1952) 299.
    """

    kc: float
    mc: float
    kn: float = 0.0
    mn: float = 0.25
    ka: float = 0.0
    ma: float = 0.25

    def __post_init__(self) -> None:
        positive("Kienzle.kc", self.kc)
        for name in ("kn", "ka"):
            if scalar(f"Kienzle.{name}", getattr(self, name)) < 0:
                fail(f"Kienzle.{name}", f"{getattr(self, name):g}", "must not be negative")
        for name in ("mc", "mn", "ma"):
            if not 0 <= scalar(f"Kienzle.{name}", getattr(self, name)) < 1:
                fail(f"Kienzle.{name}", f"{getattr(self, name):g}", "must be within 0 .. 1")

    def per_length(self, chip: FloatArray) -> FloatArray:
        """See `ForceLaw.per_length`."""
        h = np.maximum(np.asarray(chip, float), 0.0)[..., None]
        k, m = np.array([self.kc, self.kn, self.ka]), np.array([self.mc, self.mn, self.ma])
        return k * 1e-3**m * h ** (1 - m)

    def linearised(self, chip: float) -> CuttingCoefficients:
        """Return the tangent at this chip thickness as linear-edge coefficients (edge terms take up the rest)."""
        h = positive("chip", chip)
        f = self.per_length(np.array(h))
        slope = f / h * (1 - np.array([self.mc, self.mn, self.ma]))
        (t, n, a), (te, ne, ae) = slope.tolist(), (f - slope * h).tolist()
        return CuttingCoefficients(t, n, a, te, ne, ae, f"Kienzle at {1e3 * h:g} mm")


def oblique_coefficients(shear_stress: float, shear_angle: float, friction_angle: float, *, rake: float,
                         inclination: float = 0.0, chip_flow: float | None = None) -> CuttingCoefficients:
    r"""Return oblique cutting coefficients from orthogonal data.

    With :math:`\tan\beta_n = \tan\beta_a \cos\eta` and
    :math:`c = \sqrt{\cos^2(\phi_n + \beta_n - \alpha_n) + \tan^2\eta \sin^2\beta_n}`:

    - :math:`K_{tc} = \tau/\sin\phi_n \, [\cos(\beta_n - \alpha_n) + \tan i \tan\eta \sin\beta_n]/c`
    - :math:`K_{rc} = \tau/(\sin\phi_n \cos i) \, \sin(\beta_n - \alpha_n)/c`
    - :math:`K_{ac} = \tau/\sin\phi_n \, [\cos(\beta_n - \alpha_n) \tan i - \tan\eta \sin\beta_n]/c`

    Parameters
    ----------
    shear_stress : float
        Pa.
    shear_angle, friction_angle, rake, inclination : float
        rad.
    chip_flow : float, optional
        Chip flow angle, rad; Stabler's rule (equal to the inclination) where left out.

    Source: Budak, Altintas, Armarego, J. Manufacturing Science Engineering 118 (1996) 216.
    """
    tau = positive("shear_stress", shear_stress)
    phi, alpha = positive("shear_angle", shear_angle, np.pi / 2), scalar("rake", rake)
    i = scalar("inclination", inclination)
    eta = i if chip_flow is None else scalar("chip_flow", chip_flow)
    beta = np.arctan(np.tan(positive("friction_angle", friction_angle, np.pi / 2)) * np.cos(eta))
    c = np.sqrt(np.cos(phi + beta - alpha) ** 2 + np.tan(eta) ** 2 * np.sin(beta) ** 2)
    side = np.tan(eta) * np.sin(beta)
    kt = tau / np.sin(phi) * (np.cos(beta - alpha) + np.tan(i) * side) / c
    kn = tau / (np.sin(phi) * np.cos(i)) * np.sin(beta - alpha) / c
    ka = tau / np.sin(phi) * (np.cos(beta - alpha) * np.tan(i) - side) / c
    if kn < 0:
        fail("oblique_coefficients", f"normal coefficient {kn / 1e6:g} N/mm^2 (friction angle below the rake)",
             "must not be negative", remedy="check the orthogonal data")
    return CuttingCoefficients(float(kt), float(kn), float(max(ka, 0.0)), source="orthogonal to oblique")


def exact_chip(angle: FloatArray, radius: float, feed: float, *, teeth: int) -> FloatArray:
    r"""Return the chip thickness of true (trochoidal) tooth paths, m, along the tooth's radius; beside f sin(phi).

    The tooth at angle phi (time zero, centre at the origin) lies R n(phi) away; the previous tooth was on the same ray
    at a time t before, its centre c = feed N phi'/2 pi behind: :math:`(R - h) n(\phi) = R n(\phi + \delta) - (c, 0)`.

    Parameters
    ----------
    angle : floats
        rad.
    radius, feed : float
        m; feed per tooth.
    teeth : int

    Source: Martellotti, Trans. ASME 63 (1941) 677.
    """
    phi = floats("angle", angle)
    f = float(nonnegative("feed", floats("feed", feed)))
    per_angle = f * teeth / (2 * np.pi)
    # Newton from nothing: the lag is about feed over radius, a hundredth of a rad, and two or three steps settle it.
    delta = np.zeros_like(phi)
    s, c = np.sin(phi), np.cos(phi)
    for _ in range(50):
        # The previous tooth passes angle phi + delta when the centre is `centre_lag` behind its present place.
        centre_lag = f - per_angle * delta
        gap = radius * np.sin(delta) - centre_lag * c  # across the ray, towards growing angle
        slope = radius * np.cos(delta) + per_angle * c
        step = gap / slope
        delta = delta - step
        # rad: on a radius of metres still below rounding of the chip.
        if np.abs(step).max(initial=0.0) < 1e-16:
            break
    centre_lag = f - per_angle * delta
    return radius - (radius * np.cos(delta) - centre_lag * s)


@dataclass(frozen=True, eq=False)
class RigidForces:
    """Cutting forces of a rigid tool over rotation.

    Parameters
    ----------
    angle : (n,) floats
        Rotation of tooth 0, rad.
    force : (n, 3) floats
        Force on the tool along feed x, normal y and axis z, N.
    torque : (n,) floats
        N m.
    """

    angle: FloatArray
    force: FloatArray
    torque: FloatArray

    def power(self, speed: float) -> FloatArray:
        """Return the cutting power at this spindle speed (rev/min), W."""
        return self.torque * 2 * np.pi * speed / 60


def law_of(problem: MillingProblem) -> ForceLaw:
    """Return the force law of a cut: its total-energy law where it has one, or the linear-edge law of its coefficients."""
    return problem.law or LinearEdge(problem.coefficients)


def rigid_forces(problem: MillingProblem, depth: float, angle: FloatArray, *, law: ForceLaw | None = None,
                 slices: int = 40, trochoidal: bool = False) -> RigidForces:
    r"""Return forces and torque of the rigid cutter, with helix, run-out, unequal pitch and rounded edges.

    On a corner radius or ball the slices have their own chip normal: at the axial immersion angle kappa the chip is
    :math:`h = f_z \sin\phi \sin\kappa` thick and du = dz/sin kappa wide, the normal force points along
    :math:`-[\sin\phi\sin\kappa, \cos\phi\sin\kappa, -\cos\kappa]` and the axial coefficient acts along the edge's meridian
    :math:`[\sin\phi\cos\kappa, \cos\phi\cos\kappa, \sin\kappa]`. The arc of cut at a smaller radius is where the edge is
    between the walls of the work (`Engagement.at_radius`).

    Source: Engin, Altintas, Int. J. Machine Tools Manufacture 41 (2001) 2195, in the convention of this package.

    Parameters
    ----------
    problem : MillingProblem
        `feed_per_tooth` above zero; its dynamics are not used.
    depth : float
        m.
    angle : (n,) floats
        Rotation of tooth 0, rad, clockwise from y.
    law : ForceLaw, optional
        Where left out the problem's total-energy law, or `LinearEdge` of its coefficients.
    trochoidal : bool
        Exact chip thickness instead of f sin phi.
    """
    law = law or law_of(problem)
    turn = floats("angle", np.atleast_1d(angle))
    phi, h, kappa, radius, share = edge_field(problem, positive("depth", depth, 1.0), turn, slices=slices,
                                              trochoidal=trochoidal)
    per = law.per_length(h) * share
    t, n, a = per[..., 0], per[..., 1], per[..., 2]
    s, c = np.sin(phi), np.cos(phi)
    sk, ck = np.sin(kappa)[:, None], np.cos(kappa)[:, None]
    x, y = -(t * c + n * s * sk - a * s * ck), t * s - n * c * sk + a * c * ck
    force = np.stack([x, y, n * ck + a * sk], axis=-1).sum((1, 2))
    return RigidForces(turn, force, (t * radius[:, None]).sum((1, 2)))


def edge_field(problem: MillingProblem, depth: float, angle: FloatArray, *, slices: int, trochoidal: bool = False
               ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return (phi, chip thickness, kappa, local radius, edge length of a slice); phi and chip have shape (n, slices, teeth),
    chip 0 out of cut, kappa and radius (slices,). Slices of equal length along the edge's meridian, taken at their middle."""
    tool = problem.tool
    number = slices if (tool.has_helix or tool.tilt or tool.corner_radius) else 1
    share = tool.edge_length(depth) / number
    height, kappa, radius = tool.along_edge((np.arange(number) + 0.5) * share)
    phi = (np.asarray(angle)[:, None, None] - tool.angles(height)) % (2 * np.pi)
    entry, leave = (v[:, None] for v in problem.engagement.at_radius(tool.radius / radius))
    chip = _chip_thickness(problem, height, phi, trochoidal) * np.sin(kappa)[:, None]
    return phi, np.where((phi > entry) & (phi < leave), chip, 0.0), kappa, radius, share


def _chip_thickness(problem: MillingProblem, height: FloatArray, phi: FloatArray, trochoidal: bool) -> FloatArray:
    """Return the chip thickness: over earlier passages, the least sum of feed advance and difference of edge radii, m."""
    tool, f = problem.tool, problem.feed_per_tooth
    lag, radius = tool.angles(height), tool.edge_radius(height)
    best = np.full(phi.shape, np.inf)
    # With run-out a tooth may leave more than one feed uncut: the surface is the lowest of those of all teeth of the last
    # turn.
    for i in range(1, tool.teeth + 1):
        earlier = (np.arange(tool.teeth) - i) % tool.teeth
        since = (lag - lag[:, earlier]) % (2 * np.pi)
        # A single tooth follows itself a whole turn later; the remainder would say at once.
        since = np.where(since < 1e-12, 2 * np.pi, since)
        feed = f * tool.teeth * since / (2 * np.pi)
        base = feed * np.sin(phi) if not trochoidal else _trochoid(phi, tool.radius, feed, since)
        best = np.minimum(best, base + radius - radius[:, earlier])
    return best


def _trochoid(phi: FloatArray, radius: float, feed: FloatArray, since: FloatArray) -> FloatArray:
    out = np.empty_like(phi)
    for m in range(phi.shape[1]):
        for j in range(phi.shape[-1]):
            teeth = 2 * np.pi / since[m, j]
            out[:, m, j] = exact_chip(phi[:, m, j], radius, float(feed[m, j]), teeth=teeth)
    return out
