"""MillingProblem and TurningProblem: input of every stability, force and surface computation."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointWarning, count, fail, floats, positive, scalar
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.coefficients import CuttingCoefficients, mean_matrix
from toolpoint.cutting.cut.plane import Label, PlaneDynamics, from_frf, from_modes
from toolpoint.cutting.cut.plane_pairs import from_pair
from toolpoint.cutting.cut.tool import Engagement, Tool
from toolpoint.cutting.cut.total_energy import TotalEnergy
from toolpoint.vibration import Frf, Modes

Response = Modes | Frf | PlaneDynamics
Dynamics = Response | tuple[Response, Response] | Callable[[float], "Response"]

HIDDEN_PEAK_LINES = 4.0  # half widths of a resonance to a spacing of lines, above which its peak is not seen
MISSING_BAND_WORDS = "missing is the band"  # in every remark of `coverage`


@dataclass(frozen=True)
class SpeedVariation:
    r"""Spindle speed that varies with the angle of rotation: :math:`\Omega (1 + a \sin(\theta/m + \gamma))`.

    Parameters
    ----------
    amplitude : float
        a, below 1.
    revolutions : int
        m, revolutions in one period of the variation.
    phase : float
        gamma, rad.

    Examples
    --------
    >>> import numpy as np
    >>> variation = SpeedVariation(amplitude=0.1, revolutions=4)
    >>> round(float(variation.factor(np.array(2 * np.pi))), 12)  # a quarter of the period: the highest speed
    1.1
    """

    amplitude: float
    revolutions: int = 4
    phase: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= scalar("SpeedVariation.amplitude", self.amplitude) < 0.9:
            fail("SpeedVariation.amplitude", f"{self.amplitude:g}", "must be 0 to 0.9 of the mean speed")
        count("SpeedVariation.revolutions", self.revolutions)

    def factor(self, angle: FloatArray) -> FloatArray:
        """Return the speed over mean speed at these angles of rotation."""
        return 1 + self.amplitude * np.sin(angle / self.revolutions + self.phase)

    def clock(self, angle: FloatArray, omega: float) -> FloatArray:
        """Return the time from angle zero, s, by the rapidly converging cosine series of 1/factor."""
        root = np.sqrt(1 - self.amplitude**2)
        ratio = (1 - root) / self.amplitude if self.amplitude > 0 else 0.0
        x = np.asarray(angle)[..., None] / self.revolutions + self.phase
        # Terms fall with the power of the amplitude: forty are below rounding up to 0.3, large ones need more.
        k = np.arange(1, 200 if self.amplitude > 0.3 else 40)
        # 1/(1 + a sin x) = (1 + 2 sum (-q)^k cos(k (x - pi/2)))/root, q = (1 - root)/a
        series = 2 * (-ratio) ** k / k * (np.sin(k * (x - np.pi / 2)) - np.sin(k * (self.phase - np.pi / 2)))
        return (np.asarray(angle) + self.revolutions * series.sum(-1)) / (root * omega)


@dataclass(frozen=True, eq=False)
class MillingProblem(NotebookText):
    r"""One milling cut.

    The force on the tool is :math:`F = -w \sum_j g_j(t) k(\phi_j) n(\phi_j)^T (r(t) - r(t - \tau))` plus the static
    part, x the feed direction, :math:`\phi` clockwise from y, w the axial depth.

    Parameters
    ----------
    tool : Tool
    engagement : Engagement
    coefficients : CuttingCoefficients
    dynamics : Modes, Frf, a pair of them for x and y, or a function of the spindle speed in rev/min giving one
        Response of the tool against the work. Modes and Frf may have any Dofs; see `x` and `y`.
    x, y : Dof, text or index, optional
        Labels of the two directions in the cutting plane, e.g. ``"tool:+x"`` or ``"tool-table:+x"``. Found by
        themselves where only one point has both. ``y="same"`` takes the response along x for y as well; with y
        missing the tool is rigid along y. Either is written in the notes.
    z : Dof, text or index, optional
        Label of the direction along the tool's axis, away from the work. With it the response is 3x3: the axial force
        (K_a) and the cross response with z enter, and the axial vibration where the edge is rounded.
    feed_angle : float
        rad from x towards y: the direction of feed in the plane of the labels.
    feed_per_tooth : float
        m; used for forces, surface and time domain only.
    process_damping : float
        Coefficient C in N/m: a force :math:`-w C (n^T r')/v` along n and its friction share along the tangent, v the
        cutting speed.
    damping_friction : float
        Friction share of the process damping.
    speed_variation : SpeedVariation, optional
        Spindle-speed variation; solved by `Collocation`.
    law : TotalEnergy, optional
        Force law of the chip in rigid and simulated forces; stability takes `coefficients`, its tangent at a chip thickness.

    Raises
    ------
    ToolpointError
        For labels that are not there, rigid-body or undamped modes, several poses, and faults of the parts.

    Examples
    --------
    >>> from toolpoint.vibration import Dof
    >>> modes = Modes([922.0], [0.011], [[5.0]], [Dof("tool", "+x")])
    >>> problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes, "tool:+x", "same")
    >>> problem.notes
    ('response along y taken as that along x (tool:+x), no cross response',)
    """

    tool: Tool
    engagement: Engagement
    coefficients: CuttingCoefficients
    dynamics: Dynamics
    x: Label = None
    y: Label = None
    feed_angle: float = 0.0
    feed_per_tooth: float = 0.0
    process_damping: float = 0.0
    damping_friction: float = 0.3
    speed_variation: SpeedVariation | None = None
    z: Label = None
    law: TotalEnergy | None = None
    plane: PlaneDynamics = field(init=False, repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name, kind in (("tool", Tool), ("engagement", Engagement), ("coefficients", CuttingCoefficients)):
            if not isinstance(getattr(self, name), kind):
                fail(f"MillingProblem.{name}", type(getattr(self, name)).__name__, f"must be a {kind.__name__}")
        for name in ("feed_angle", "feed_per_tooth", "process_damping", "damping_friction"):
            put(self, name, scalar(f"MillingProblem.{name}", getattr(self, name)))
        for name in ("feed_per_tooth", "process_damping"):
            if getattr(self, name) < 0:
                fail(f"MillingProblem.{name}", f"{getattr(self, name):g}", "must not be negative")
        put(self, "plane", self._plane_at(1000.0))

    @property
    def depends_on_speed(self) -> bool:
        """Whether the response is a function of the spindle speed."""
        return callable(self.dynamics) and not isinstance(self.dynamics, PlaneDynamics)

    def plane_at(self, speed: float) -> PlaneDynamics:
        """Return the response at this spindle speed (rev/min) in the feed frame."""
        if not self.depends_on_speed:
            return self.plane
        return self._plane_at(float(speed))

    def _plane_at(self, speed: float) -> PlaneDynamics:
        dynamics = self.dynamics(speed) if callable(self.dynamics) else self.dynamics
        return plane_dynamics(dynamics, self.x, self.y, z=self.z).rotated(self.feed_angle)

    def tooth_period(self, speed: FloatArray | float) -> FloatArray:
        """Return 60/(N speed), s, for speeds in rev/min."""
        return 60.0 / (self.tool.teeth * np.asarray(speed, float))

    @property
    def mean_matrix(self) -> FloatArray:
        """Mean directional matrix of a cylindrical cut, Pa, shape (2, 2), with z (3, 3)."""
        return mean_matrix(self.coefficients, self.engagement.entry, self.engagement.exit, teeth=self.tool.teeth,
                           size=self.plane.size)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks that came with the dynamics or from the choice of directions."""
        return self.plane.notes

    def changed(self, **values: Any) -> MillingProblem:
        """Return the same cut with other values, e.g. ``problem.changed(engagement=Engagement.slot())``."""
        return replace(self, **values)

    def at_feed_angle(self, angle: float) -> MillingProblem:
        """Return the same cut with the feed at this angle (rad) from x towards y."""
        return replace(self, feed_angle=angle)

    def __repr__(self) -> str:
        turn = f", feed at {np.degrees(self.feed_angle):g} deg" if self.feed_angle else ""
        return f"MillingProblem({self.tool!r}, {self.engagement!r}, {self.coefficients!r}, {self.plane!r}{turn})"


def plane_dynamics(dynamics: object, x: Label = None, y: Label = None, *, z: Label = None) -> PlaneDynamics:
    """Return Modes, an Frf or a pair of them for x and y as PlaneDynamics."""
    if isinstance(dynamics, PlaneDynamics):
        return dynamics
    if isinstance(dynamics, tuple):
        if z is not None:
            fail("dynamics", "two parts with z", "must be one Modes or Frf with x, y and z", remedy="leave z out")
        if len(dynamics) != 2:
            fail("dynamics", f"{len(dynamics)} parts", "must be two, for x and y")
        return from_pair(plane_dynamics(dynamics[0], x), plane_dynamics(dynamics[1], y))
    if isinstance(dynamics, Modes):
        return from_modes(dynamics, x, y, z=z)
    if isinstance(dynamics, Frf):
        return from_frf(dynamics, x, y, z=z)
    fail("dynamics", type(dynamics).__name__, "must be Modes, an Frf or a pair of them")


@dataclass(frozen=True, eq=False)
class TurningProblem:
    r"""Orthogonal (turning) cut: :math:`F = -K_f b (r(t) - r(t - T)) - (C b/v) r'` along one direction.

    Parameters
    ----------
    stiffness : float
        Cutting coefficient K_f along the direction of the response, Pa.
    dynamics : Modes, Frf or PlaneDynamics
        Response along the thickness of the chip (its x).
    x : label, optional
    process_damping : float
        C, N/m.
    cutting_speed : float, optional
        v in m/s, constant over the spindle speeds; needed with process damping unless `diameter` is given.
    diameter : float, optional
        m, for v = pi D n.

    Examples
    --------
    A tool of 10 N/um and 3 % damping never chatters below 2 k zeta (1 + zeta) / K_f = 0.618 mm of width:

    >>> from toolpoint.cutting import stability
    >>> from toolpoint.vibration import Modes
    >>> tool = Modes([500.0], [0.03], [[2 * np.pi * 500 / 1e7**0.5]], ("tool:+x",))
    >>> chart = stability.chart(TurningProblem(1e9, tool), np.linspace(4000, 20000, 200), depth_max=0.01)
    >>> f"{1e3 * chart.limit.min():.2f} mm"
    '0.62 mm'
    """

    stiffness: float
    dynamics: Response
    x: Label = None
    process_damping: float = 0.0
    cutting_speed: float | None = None
    diameter: float | None = None
    plane: PlaneDynamics = field(init=False, repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "stiffness", positive("TurningProblem.stiffness", self.stiffness))
        if scalar("TurningProblem.process_damping", self.process_damping) < 0:
            fail("TurningProblem.process_damping", f"{self.process_damping:g}", "must not be negative")
        if self.process_damping > 0 and self.cutting_speed is None and self.diameter is None:
            fail("TurningProblem", "process damping without a cutting speed", "needs it",
                 remedy="give cutting_speed or diameter")
        for name in ("cutting_speed", "diameter"):
            if getattr(self, name) is not None:
                put(self, name, positive(f"TurningProblem.{name}", getattr(self, name)))
        put(self, "plane", plane_dynamics(self.dynamics, self.x))

    def surface_speed(self, speed: FloatArray | float) -> FloatArray:
        """Return the cutting speed in m/s at these spindle speeds (rev/min)."""
        n = np.asarray(speed, float)
        if self.cutting_speed is not None:
            return np.full(n.shape, self.cutting_speed)
        return np.pi * float(self.diameter or 0.0) * n / 60

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks that came with the dynamics."""
        return self.plane.notes


def check_speeds(speeds: FloatArray | float) -> FloatArray:
    """Return spindle speeds (rev/min) after checking that they are above zero."""
    n = floats("speeds", np.atleast_1d(speeds))
    if n.ndim != 1 or n.size == 0 or n.min() <= 0:
        fail("speeds", f"shape {n.shape}, least {n.min() if n.size else float('nan'):g} rev/min",
             "must be one-dimensional and above zero", remedy="the tooth period is 60/(N speed)")
    return n


def coverage(problem: MillingProblem | TurningProblem, speeds: FloatArray) -> tuple[Doubt, ...]:
    """Warn where a measured FRF does not cover the chatter band; return the doubts for the result.

    Chatter appears at and somewhat above resonances, and the harmonics of the tooth-passing frequency carry it: the
    response must have fallen off at the band's upper end (here: below a tenth of its largest value) and the band must
    begin at or below the largest peak's half.
    """
    plane = problem.plane
    if plane.is_modal:
        return ()
    f, values = plane.lines
    size = np.linalg.norm(values, axis=(1, 2))
    reliable = f > f[0] + 0.02 * (f[-1] - f[0])  # integrated accelerations are meaningless near 0 Hz
    peak = float(f[reliable][np.argmax(size[reliable])])
    notes = []
    teeth = problem.tool.teeth if isinstance(problem, MillingProblem) else 1
    tooth = teeth * float(speeds.max()) / 60
    if size[-max(2, f.size // 100):].max() > 0.1 * size[reliable].max():
        notes.append(f"the FRF ends at {f[-1]:g} Hz where its response is still above a tenth of the largest: "
                     f"{MISSING_BAND_WORDS} above {f[-1]:g} Hz, to at least {max(2 * peak, 1.2 * float(f[-1])):.0f} Hz")
    if f[-1] < peak + tooth:
        notes.append(f"the FRF ends at {f[-1]:g} Hz; {MISSING_BAND_WORDS} to {peak + tooth:.0f} Hz "
                     "(largest resonance plus tooth-passing frequency)")
    if f[0] > 0.5 * peak:
        notes.append(f"the FRF begins at {f[0]:g} Hz; {MISSING_BAND_WORDS} from {0.5 * peak:.0f} Hz")
    notes += _hidden_peaks(f, values)
    doubts = [Doubt("limits", note, "limits may be far too high for it, and no stated error holds it") for note in notes]
    for doubt in doubts:
        warnings.warn(doubt, ToolpointWarning, stacklevel=3)
    return tuple(doubts)


def _hidden_peaks(f: FloatArray, values: ComplexArray) -> list[str]:
    """Return a note on the strongest resonance that is far narrower than the spacing of the lines.

    Beside a resonance 1/G is nearly a straight line over the frequency, k (f_r - f) + i k h, so that two lines give the half
    width h although neither is near the peak.
    """
    for k in range(min(2, values.shape[1])):
        g = values[:, k, k]
        size = np.abs(g)
        if not size.all():
            continue
        inverse, spacing = 1 / g, np.diff(f)
        turns = np.flatnonzero((inverse.real[:-1] > 0) & (inverse.real[1:] < 0))
        slope = (inverse.real[turns] - inverse.real[turns + 1]) / spacing[turns]
        half_width = np.abs(inverse.imag[turns] + inverse.imag[turns + 1]) / 2 / slope
        peak = np.maximum(size[turns], size[turns + 1])
        hidden = turns[(spacing[turns] > HIDDEN_PEAK_LINES * half_width) & (peak > 0.1 * size.max())]
        if hidden.size:
            i = int(hidden[np.argmax(size[hidden])])
            width = 2 * float(half_width[turns == i][0])
            return [f"the resonance near {f[i]:.4g} Hz is {width:.2g} Hz wide and the lines are {spacing[i]:.2g} Hz apart: its "
                    "peak lies between them"]
    return []
